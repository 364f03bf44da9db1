"""Every void segment of a scan, from lists of chords: what sums for one cut-off cannot tell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from scanfab.kernels.axes import (
    Grid,
    bounds,
    cell_grid,
    cover,
    project,
    shadow,
    sort_into_strips,
)
from scanfab.kernels.lines import Spheres, chords_of, sort_by
from scanfab.kernels.periodic import CellGrains, Prism, next_solid
from scanfab.kernels.sweep import FAR, Strip

__all__ = ["BLOCKS", "LENGTH", "NUMBER", "SQUARE", "tally_cell_gaps", "tally_gaps"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

BLOCKS = 8
# what is added up of the gaps of a block and bin
NUMBER, LENGTH, SQUARE = range(3)
# lines of a strip: of all of them the chords are listed
MOST_LISTED = 4096


@njit(nogil=True, cache=True)
def merge(chords: FloatArray) -> int:
    """The union of chords ordered by their starts, in their place; its number of solids."""
    count = 0
    for k in range(chords.shape[0]):
        if count > 0 and chords[k, 0] <= chords[count - 1, 1]:
            chords[count - 1, 1] = max(chords[count - 1, 1], chords[k, 1])
        else:
            chords[count, 0], chords[count, 1] = chords[k, 0], chords[k, 1]
            count += 1
    return count


@njit(nogil=True, cache=True)
def block_of(place: FloatArray, to_blocks: FloatArray) -> int:
    """Which octant a place lies in, from 0: halves of the period along each row of to_blocks."""
    number = 0
    for i in range(3):
        along = (
            to_blocks[i, 0] * place[0]
            + to_blocks[i, 1] * place[1]
            + to_blocks[i, 2] * place[2]
            + to_blocks[i, 3]
        )
        number += (1 << i) * (along - np.floor(along) >= 0.5)
    return number


class Tally(NamedTuple):
    """What gaps are added to."""

    to_blocks: FloatArray
    """Affine map to three coordinates, of whose periods of 1 the halves are blocks, (3, 4)."""
    cutoffs: FloatArray
    """In ascending order, shape (C,)."""
    sums: FloatArray
    """Number, length, squared length, shape (BLOCKS, C, 3)."""


@njit(nogil=True, cache=True)
def add_gap(tally: Tally, low: float, high: float, foot: FloatArray, normal: FloatArray) -> None:
    """Add a gap to the block of its middle and the bin of the largest cut-off that it reaches."""
    length = high - low
    place = np.searchsorted(tally.cutoffs, length, "right")
    if length <= 0.0 or place == 0:
        return
    block = block_of(foot + 0.5 * (low + high) * normal, tally.to_blocks)
    tally.sums[block, place - 1, NUMBER] += 1.0
    tally.sums[block, place - 1, LENGTH] += length
    tally.sums[block, place - 1, SQUARE] += length * length


@njit(nogil=True, cache=True)
def solids_of(chords: FloatArray) -> FloatArray:
    """The union of a line's chords, shape (K, 2)."""
    order = np.arange(chords.shape[0])
    sort_by(chords[:, 0], order)
    solids = chords[order]
    return solids[: merge(solids)]


@njit(nogil=True, cache=True)
def tally_whole(solids: FloatArray, foot: FloatArray, normal: FloatArray, tally: Tally) -> None:
    """The gaps of a line between its first and its last solid."""
    for k in range(1, solids.shape[0]):
        add_gap(tally, solids[k - 1, 1], solids[k, 0], foot, normal)


@njit(nogil=True, cache=True)
def tally_window(
    solids: FloatArray, half: float, foot: FloatArray, normal: FloatArray, tally: Tally
) -> None:
    """The gaps of a line within half a length of its middle."""
    count = solids.shape[0]
    for k in range(count + 1):
        low = max(solids[k - 1, 1], -half) if k > 0 else -half
        high = min(solids[k, 0], half) if k < count else half
        add_gap(tally, low, high, foot, normal)


@njit(nogil=True, cache=True)
def strip_of(grid: Grid, number: int, rows: int) -> Strip:
    """One of the strips of a grid that have so many rows each."""
    row = number * rows
    return Strip(
        grid.spacing,
        1.0 / grid.spacing,
        grid.first_u + row * grid.shear,
        grid.first_v + row * grid.spacing,
        grid.shear,
        grid.columns,
        min(rows, grid.rows - row),
        grid.columns,
    )


@njit(nogil=True, cache=True)
def tally_grid(
    spheres: Spheres,
    grid: Grid,
    frame: FloatArray,
    which: int,
    window_radius: float,
    whole: Tally | None,
    window: Tally | None,
    grains: CellGrains | None,
    prism: Prism | None,
) -> None:
    """Add the gaps of all lines of a grid, for one set of solids."""
    rows = max(MOST_LISTED // max(grid.columns, 1), 1)
    start, chosen = sort_into_strips(spheres, grid, rows)
    for k in range(start.size - 1):
        strip = strip_of(grid, k, rows)
        lines = strip.rows * strip.columns
        number = np.arange(lines).reshape(strip.rows, strip.columns)
        met = chosen[start[k] : start[k + 1]]
        first, chords = chords_of(spheres, met, which, strip, number, lines)
        for line in range(lines):
            row, column = line // strip.columns, line % strip.columns
            u = strip.first_u + row * strip.shear + column * strip.spacing
            v = strip.first_v + row * strip.spacing
            foot = u * frame[0] + v * frame[1]
            solids = solids_of(chords[first[line] : first[line + 1]])
            if whole is not None:
                if grains is not None and prism is not None:
                    tally_measured(solids, u, v, foot, which, grains, prism, whole)
                else:
                    tally_whole(solids, foot, frame[2], whole)
            if window is not None:
                half2 = window_radius * window_radius - u * u - v * v
                if half2 > 0.0:
                    tally_window(solids, np.sqrt(half2), foot, frame[2], window)


@njit(nogil=True, cache=True)
def tally_measured(
    solids: FloatArray,
    u: float,
    v: float,
    foot: FloatArray,
    which: int,
    grains: CellGrains,
    prism: Prism,
    tally: Tally,
) -> None:
    """The gaps of a line through a periodic medium that start in its measured length."""
    low = prism.rise_u * u + prism.rise_v * v
    count = solids.shape[0]
    for k in range(1, count + 1):
        end = solids[k - 1, 1]
        if low <= end < low + prism.length:
            start = solids[k, 0] if k < count else FAR
            if k == count:
                start = next_solid(grains, prism, which == 1, u, v, end)
            if start < FAR:
                add_gap(tally, end, start, foot, prism.frame[2])


@njit(nogil=True, cache=True)
def tally_gaps(
    position: FloatArray,
    radius: FloatArray,
    removed: BoolArray,
    frames: FloatArray,
    offsets: FloatArray,
    spacing: float,
    window_radius: float,
    to_blocks: FloatArray,
    cutoffs: FloatArray,
    wanted: BoolArray,
    sums: FloatArray,
) -> None:
    """
    Scan a packing along several axes, and add up its gaps by the block of their middle.

    Parameters
    ----------
    position, radius, removed, frames, offsets, spacing, window_radius
        As in :func:`scanfab.kernels.axes.scan_axes`.
    to_blocks : shape (2, 3, 4)
        For the whole and the window, see :class:`Tally`.
    cutoffs : shape (C,)
        In ascending order; a gap goes to the bin of the largest that it reaches.
    wanted : shape (4,)
        Which of the variants a, b, c, d.
    sums : shape (D, 2, 2, BLOCKS, C, 3)
        Zeros; for each axis, set of solids, and whole or window: number, length, squared length.
    """
    extent = bounds(position, radius)
    for axis in range(frames.shape[0]):
        frame = frames[axis]
        low_u = low_v = -window_radius
        high_u = high_v = window_radius
        if (wanted[0] or wanted[1]) and radius.size > 0:
            low_u, high_u = shadow(extent, frame[0], low_u, high_u)
            low_v, high_v = shadow(extent, frame[1], low_v, high_v)
        grid = cover(low_u, high_u, low_v, high_v, offsets[axis], spacing)
        spheres = project(position, radius, removed, frame, grid)
        for which in range(2):
            whole = Tally(to_blocks[0], cutoffs, sums[axis, which, 0])
            window = Tally(to_blocks[1], cutoffs, sums[axis, which, 1])
            if wanted[which] and wanted[2 + which]:
                tally_grid(spheres, grid, frame, which, window_radius, whole, window, None, None)
            elif wanted[which]:
                tally_grid(spheres, grid, frame, which, window_radius, whole, None, None, None)
            elif wanted[2 + which]:
                tally_grid(spheres, grid, frame, which, window_radius, None, window, None, None)


@njit(nogil=True, cache=True)
def tally_cell_gaps(
    grains: CellGrains,
    normals: FloatArray,
    offsets: FloatArray,
    spacing: float,
    to_blocks: FloatArray,
    cutoffs: FloatArray,
    wanted: BoolArray,
    sums: FloatArray,
) -> None:
    """The same for the whole of a periodic medium; ``normals`` has shape (D, 3)."""
    for axis in range(normals.shape[0]):
        prism, spheres, grid = cell_grid(grains, normals[axis], offsets[axis], spacing)
        for which in range(2):
            if wanted[which]:
                whole = Tally(to_blocks[0], cutoffs, sums[axis, which, 0])
                if grains.periodic[prism.third]:
                    tally_grid(spheres, grid, prism.frame, which, 0.0, whole, None, grains, prism)
                else:
                    tally_grid(spheres, grid, prism.frame, which, 0.0, whole, None, None, None)
