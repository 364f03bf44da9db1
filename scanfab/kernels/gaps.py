"""Every void segment of a scan, from lists of chords: what sums for one cut-off cannot tell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import ZERO, inner, kernel
from scanfab.kernels.follow import next_solid
from scanfab.kernels.grid import Grid, bounds, open_grid, strip_of
from scanfab.kernels.lines import chords_of, solids_of
from scanfab.kernels.periodic import CellGrains, Prism, cell_grid, measured_in
from scanfab.kernels.projection import Spheres, number_from, project, sort_by, sort_into_strips
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
    """What the gaps of a direction's lines are added to."""

    to_block: FloatArray
    """
    Affine map of u, v, depth to three coordinates, of whose periods of 1 the halves are blocks.

    Shape (3, 4).
    """
    cutoffs: FloatArray
    """In ascending order, shape (C,)."""
    sums: FloatArray
    """Number, length, squared length for each set of solids, shape (2, BLOCKS, C, 3)."""


class Line(NamedTuple):
    """A line: its place, and where it is in the blocks' coordinates at the depth 0."""

    u: float
    v: float
    x: float
    y: float
    z: float


@inner(inline="always")
def line_at(to_block: FloatArray, u: float, v: float) -> Line:
    """The line at a place."""
    return Line(
        u,
        v,
        to_block[0, 0] * u + to_block[0, 1] * v + to_block[0, 3],
        to_block[1, 0] * u + to_block[1, 1] * v + to_block[1, 3],
        to_block[2, 0] * u + to_block[2, 1] * v + to_block[2, 3],
    )


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


@inner(inline="always")
def is_upper(coordinate: float) -> bool:
    """Whether a coordinate lies in the upper half of its period of 1."""
    return bool(coordinate - np.floor(coordinate) >= 0.5)


@inner()
def add_gap(bins: Bins, which: int, line: Line, low: float, high: float) -> None:
    """Add a gap to the block of its middle and the bin of the largest cut-off that it reaches."""
    length = high - low
    place = 0
    while place < bins.cutoffs.size and bins.cutoffs[place] <= length:
        place += 1
    if length <= 0.0 or place == 0:
        return
    middle = 0.5 * (low + high)
    block = 1 * is_upper(line.x + bins.to_block[0, 2] * middle)
    block += 2 * is_upper(line.y + bins.to_block[1, 2] * middle)
    block += 4 * is_upper(line.z + bins.to_block[2, 2] * middle)
    bins.sums[which, block, place - 1, NUMBER] += 1.0
    bins.sums[which, block, place - 1, LENGTH] += length
    bins.sums[which, block, place - 1, SQUARE] += length * length


@inner()
def add_whole(bins: Bins, which: int, line: Line, solids: FloatArray, count: int) -> None:
    """Add the gaps of a line between its first and its last solid."""
    for k in range(1, count):
        add_gap(bins, which, line, solids[1, k - 1], solids[0, k])


@inner()
def add_window(
    bins: Bins, which: int, line: Line, solids: FloatArray, count: int, half: float
) -> None:
    """Add the gaps of a line within half a length of its middle."""
    for k in range(count + 1):
        low = max(solids[1, k - 1], -half) if k > 0 else -half
        high = min(solids[0, k], half) if k < count else half
        add_gap(bins, which, line, low, high)


@inner()
def add_measured(
    bins: Bins,
    which: int,
    line: Line,
    solids: FloatArray,
    count: int,
    grains: CellGrains,
    prism: Prism,
) -> None:
    """Add the gaps of a line through a periodic medium that start in its measured length."""
    low = prism.rise_u * line.u + prism.rise_v * line.v
    known = low + measured_in(grains, prism).known
    for k in range(1, count + 1):
        end = solids[1, k - 1]
        if low <= end < low + prism.length:
            start = solids[0, k] if k < count else FAR
            if start >= known:
                # not every solid that begins there is listed
                start = next_solid(grains, prism, which == 1, line.u, line.v, end)
            if start < FAR:
                add_gap(bins, which, line, end, start)


@inner()
def tally_grid(
    spheres: Spheres,
    grid: Grid,
    window_radius: float,
    wanted: BoolArray,
    whole: Bins,
    window: Bins,
    medium: tuple[CellGrains, Prism] | None,
) -> None:
    """Add the gaps of all lines of a grid."""
    rows = max(MOST_LISTED // max(grid.columns, 1), 1)
    start, chosen = sort_into_strips(spheres, grid, rows)
    order = np.empty(spheres.u.size, np.int64)
    solids = np.empty((2, spheres.u.size))
    for number in range(start.size - 1):
        strip = strip_of(grid, number, rows, grid.columns)
        lines = np.empty((strip.rows, strip.columns), np.int64)
        number_from(ZERO, lines.ravel())
        met = chosen[start[number] : start[number + 1]]
        first, chords = chords_of(spheres, met, ZERO, strip, lines, lines.size)
        for line in range(lines.size):
            row, column = line // strip.columns, line % strip.columns
            u = strip.first_u + column * strip.spacing
            v = strip.first_v + row * strip.spacing
            half2 = window_radius * window_radius - u * u - v * v
            ordered = order[: first[line + 1] - first[line]]
            number_from(first[line], ordered)
            sort_by(chords.ends[0], ordered)
            in_blocks = line_at(whole.to_block, u, v), line_at(window.to_block, u, v)
            for which in range(2):
                in_window = wanted[2 + which] and half2 > 0.0
                if not (wanted[which] or in_window):
                    continue
                count = solids_of(chords, ordered, which, solids)
                if wanted[which]:
                    if medium is not None:
                        add_measured(
                            whole, which, in_blocks[0], solids, count, medium[0], medium[1]
                        )
                    else:
                        add_whole(whole, which, in_blocks[0], solids, count)
                if in_window:
                    add_window(window, which, in_blocks[1], solids, count, np.sqrt(half2))


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
        Zeros; for each axis, whole or window, and set of solids: number, length, squared length.
    """
    extent = bounds(position, radius)
    for axis in range(frames.shape[0]):
        frame = frames[axis]
        grid = open_grid(
            extent, frame, offsets[axis], spacing, window_radius, wanted[0] or wanted[1]
        )
        spheres = project(position, radius, removed, frame, grid)
        of_whole, of_window = in_frame(to_blocks[0], frame), in_frame(to_blocks[1], frame)
        tally_grid(
            spheres,
            grid,
            window_radius,
            wanted,
            Bins(of_whole, cutoffs, sums[axis, 0]),
            Bins(of_window, cutoffs, sums[axis, 1]),
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
        # with a window of no radius the second bins get nothing
        bins = Bins(in_frame(to_block, prism.frame), cutoffs, sums[axis, 0])
        if grains.periodic[prism.third]:
            tally_grid(spheres, grid, 0.0, wanted, bins, bins, (grains, prism))
        else:
            tally_grid(spheres, grid, 0.0, wanted, bins, bins, None)
