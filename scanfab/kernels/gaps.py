"""Every void segment of a scan, from lists of chords: what sums for one cut-off cannot tell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import inner, kernel
from scanfab.kernels.follow import next_solid
from scanfab.kernels.grid import Grid, bounds, columns_in, open_grid, strip_of
from scanfab.kernels.lines import chords_of, solids_of
from scanfab.kernels.periodic import CellGrains, Prism, cell_grid, measured_in
from scanfab.kernels.projection import Spheres, project, sort_into_strips
from scanfab.kernels.sweep import FAR

__all__ = ["BLOCKS", "LENGTH", "NUMBER", "SQUARE", "tally_cell_gaps", "tally_gaps"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

BLOCKS = 8
# what is added up of the gaps of a block and bin
NUMBER, LENGTH, SQUARE = range(3)
# lines of a strip: of all of them the chords are listed
MOST_LISTED = 4096


class Bins(NamedTuple):
    """What gaps are added to."""

    to_block: FloatArray
    """
    Affine map of u, v, depth to three coordinates, of whose periods of 1 the halves are blocks.

    Shape (3, 4).
    """
    cutoffs: FloatArray
    """In ascending order, shape (C,)."""
    sums: FloatArray
    """Number, length, squared length, shape (BLOCKS, C, 3)."""


@inner()
def in_frame(to_block: FloatArray, frame: FloatArray) -> FloatArray:
    """An affine map of places, shape (3, 4), as one of their coordinates in a frame."""
    found = to_block.copy()
    for i in range(3):
        for j in range(3):
            found[i, j] = 0.0
            for k in range(3):
                found[i, j] += to_block[i, k] * frame[j, k]
    return found


@inner()
def add_gap(bins: Bins, u: float, v: float, low: float, high: float) -> None:
    """Add a gap to the block of its middle and the bin of the largest cut-off that it reaches."""
    length = high - low
    place = 0
    while place < bins.cutoffs.size and bins.cutoffs[place] <= length:
        place += 1
    if length <= 0.0 or place == 0:
        return
    middle = 0.5 * (low + high)
    block = 0
    for i in range(3):
        to = bins.to_block[i]
        along = to[0] * u + to[1] * v + to[2] * middle + to[3]
        block += (1 << i) * (along - np.floor(along) >= 0.5)
    bins.sums[block, place - 1, NUMBER] += 1.0
    bins.sums[block, place - 1, LENGTH] += length
    bins.sums[block, place - 1, SQUARE] += length * length


@inner()
def add_whole(bins: Bins, u: float, v: float, solids: FloatArray, count: int) -> None:
    """Add the gaps of a line between its first and its last solid."""
    for k in range(1, count):
        add_gap(bins, u, v, solids[1, k - 1], solids[0, k])


@inner()
def add_window(bins: Bins, u: float, v: float, solids: FloatArray, count: int, half: float) -> None:
    """Add the gaps of a line within half a length of its middle."""
    for k in range(count + 1):
        low = max(solids[1, k - 1], -half) if k > 0 else -half
        high = min(solids[0, k], half) if k < count else half
        add_gap(bins, u, v, low, high)


@inner()
def add_measured(
    bins: Bins,
    u: float,
    v: float,
    solids: FloatArray,
    count: int,
    which: int,
    grains: CellGrains,
    prism: Prism,
) -> None:
    """Add the gaps of a line through a periodic medium that start in its measured length."""
    low = prism.rise_u * u + prism.rise_v * v
    known = low + measured_in(grains, prism).known
    for k in range(1, count + 1):
        end = solids[1, k - 1]
        if low <= end < low + prism.length:
            start = solids[0, k] if k < count else FAR
            if start >= known:
                # not every solid that begins there is listed
                start = next_solid(grains, prism, which == 1, u, v, end)
            if start < FAR:
                add_gap(bins, u, v, end, start)


@inner()
def tally_grid(
    spheres: Spheres,
    grid: Grid,
    which: int,
    window_radius: float,
    in_whole: bool,
    in_window: bool,
    whole: Bins,
    window: Bins,
    medium: tuple[CellGrains, Prism] | None,
) -> None:
    """Add the gaps of all lines of a grid, for one set of solids."""
    rows = max(MOST_LISTED // max(grid.columns, 1), 1)
    start, chosen = sort_into_strips(spheres, grid, rows)
    low, high = columns_in(grid, 0.0 if in_whole else window_radius)
    order = np.empty(spheres.u.size, np.int64)
    solids = np.empty((2, spheres.u.size))
    for number in range(start.size - 1):
        strip = strip_of(grid, low, high, number, rows, grid.columns)
        lines = np.arange(strip.rows * strip.columns).reshape(strip.rows, strip.columns)
        met = chosen[start[number] : start[number + 1]]
        first, chords = chords_of(spheres, met, which, strip, lines, lines.size)
        for line in range(lines.size):
            row, column = line // strip.columns, line % strip.columns
            u = strip.first_u + row * strip.shear + column * strip.spacing
            v = strip.first_v + row * strip.spacing
            listed = chords[:, first[line] : first[line + 1]]
            count = solids_of(listed, order[: listed.shape[1]], solids)
            if in_whole:
                if medium is not None:
                    add_measured(whole, u, v, solids, count, which, medium[0], medium[1])
                else:
                    add_whole(whole, u, v, solids, count)
            if in_window:
                half2 = window_radius * window_radius - u * u - v * v
                if half2 > 0.0:
                    add_window(window, u, v, solids, count, np.sqrt(half2))


@kernel
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
        For the whole and the window: affine maps of places, see :class:`Bins`.
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
        grid = open_grid(
            extent, frame, offsets[axis], spacing, window_radius, wanted[0] or wanted[1]
        )
        spheres = project(position, radius, removed, frame, grid)
        of_whole, of_window = in_frame(to_blocks[0], frame), in_frame(to_blocks[1], frame)
        for which in range(2):
            if wanted[which] or wanted[2 + which]:
                tally_grid(
                    spheres,
                    grid,
                    which,
                    window_radius,
                    wanted[which],
                    wanted[2 + which],
                    Bins(of_whole, cutoffs, sums[axis, which, 0]),
                    Bins(of_window, cutoffs, sums[axis, which, 1]),
                    None,
                )


@kernel
def tally_cell_gaps(
    grains: CellGrains,
    normals: FloatArray,
    offsets: FloatArray,
    spacing: float,
    to_block: FloatArray,
    cutoffs: FloatArray,
    wanted: BoolArray,
    sums: FloatArray,
) -> None:
    """The same for the whole of a periodic medium: ``normals`` (D, 3), ``to_block`` (3, 4)."""
    for axis in range(normals.shape[0]):
        prism, spheres, grid = cell_grid(grains, normals[axis], offsets[axis], spacing)
        for which in range(2):
            if wanted[which]:
                bins = Bins(in_frame(to_block, prism.frame), cutoffs, sums[axis, which, 0])
                if grains.periodic[prism.third]:
                    tally_grid(spheres, grid, which, 0.0, True, False, bins, bins, (grains, prism))
                else:
                    tally_grid(spheres, grid, which, 0.0, True, False, bins, bins, None)
