"""Every void segment of a scan, from lists of chords: what sums for one cut-off cannot tell."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from scanfab.kernels.axes import bounds, cover, project, shadow, sort_into_strips
from scanfab.kernels.lines import Spheres, chords_of, sort_by
from scanfab.kernels.sweep import Strip

__all__ = ["BLOCKS", "LENGTH", "NUMBER", "SQUARE", "tally_gaps"]

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


@njit(nogil=True, cache=True)
def add_gap(
    sums: FloatArray,
    low: float,
    high: float,
    foot: FloatArray,
    normal: FloatArray,
    to_blocks: FloatArray,
    cutoffs: FloatArray,
) -> None:
    """Add a gap to the block of its middle and the bin of the largest cut-off that it reaches."""
    length = high - low
    place = np.searchsorted(cutoffs, length, "right")
    if length <= 0.0 or place == 0:
        return
    block = block_of(foot + 0.5 * (low + high) * normal, to_blocks)
    sums[block, place - 1, NUMBER] += 1.0
    sums[block, place - 1, LENGTH] += length
    sums[block, place - 1, SQUARE] += length * length


@njit(nogil=True, cache=True)
def tally_strip(
    spheres: Spheres,
    chosen: IntArray,
    which: int,
    strip: Strip,
    frame: FloatArray,
    window_radius: float,
    to_blocks: FloatArray,
    cutoffs: FloatArray,
    whole: bool,
    window: bool,
    sums: FloatArray,
) -> None:
    """Add the gaps of a strip's lines; ``sums`` has shape (2, BLOCKS, C, 3): whole, window."""
    lines = strip.rows * strip.columns
    number = np.arange(lines).reshape(strip.rows, strip.columns)
    start, chords = chords_of(spheres, chosen, which, strip, number, lines)
    for line in range(lines):
        row, column = line // strip.columns, line % strip.columns
        u = strip.first_u + row * strip.shear + column * strip.spacing
        v = strip.first_v + row * strip.spacing
        half2 = window_radius * window_radius - u * u - v * v
        foot = u * frame[0] + v * frame[1]
        met = chords[start[line] : start[line + 1]]
        order = np.arange(met.shape[0])
        sort_by(met[:, 0], order)
        solids = met[order]
        count = merge(solids)
        if whole:
            for k in range(1, count):
                low, high = solids[k - 1, 1], solids[k, 0]
                add_gap(sums[0], low, high, foot, frame[2], to_blocks[0], cutoffs)
        if window and half2 > 0.0:
            half = np.sqrt(half2)
            for k in range(count + 1):
                low = max(solids[k - 1, 1], -half) if k > 0 else -half
                high = min(solids[k, 0], half) if k < count else half
                add_gap(sums[1], low, high, foot, frame[2], to_blocks[1], cutoffs)


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
        For the whole and the window: affine map of a place to three coordinates, of whose periods
        of 1 the halves are the blocks.
    cutoffs : shape (C,)
        In ascending order; a gap goes to the bin of the largest that it reaches.
    wanted : shape (4,)
        Which of the variants a, b, c, d.
    sums : shape (D, 2, 2, BLOCKS, C, 3)
        Zeros; for each axis, set of solids, and whole or window: number, length, squared length.
    """
    extent = bounds(position, radius)
    whole = wanted[0] or wanted[1]
    for axis in range(frames.shape[0]):
        low_u = low_v = -window_radius
        high_u = high_v = window_radius
        if whole and radius.size > 0:
            low_u, high_u = shadow(extent, frames[axis, 0], low_u, high_u)
            low_v, high_v = shadow(extent, frames[axis, 1], low_v, high_v)
        grid = cover(low_u, high_u, low_v, high_v, offsets[axis], spacing)
        spheres = project(position, radius, removed, frames[axis], grid)
        rows = max(MOST_LISTED // max(grid.columns, 1), 1)
        start, chosen = sort_into_strips(spheres, grid, rows)
        for k in range(start.size - 1):
            strip = Strip(
                spacing,
                1.0 / spacing,
                grid.first_u,
                grid.first_v + k * rows * spacing,
                0.0,
                grid.columns,
                min(rows, grid.rows - k * rows),
                grid.columns,
            )
            for which in range(2):
                if wanted[which] or wanted[2 + which]:
                    tally_strip(
                        spheres,
                        chosen[start[k] : start[k + 1]],
                        which,
                        strip,
                        frames[axis],
                        window_radius,
                        to_blocks,
                        cutoffs,
                        wanted[which],
                        wanted[2 + which],
                        sums[axis, which],
                    )
