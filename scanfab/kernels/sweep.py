"""
The depth-ordered sweep: void segments on all scan lines of one direction, without any list.

The spheres are visited in the order of their centres along the direction. A chord's middle lies at
its sphere's depth, so on every line the chords arrive ordered by their middles, and three numbers a
line suffice: the running end of the solid, and the two ends of the last gap, which is not counted
yet. A chord that begins behind the running end settles the last gap and opens a new one; one that
begins earlier can only shorten the last gap. That is exact unless a chord reaches back past the
last gap: such a line is closed (its solid never ends), and is solved again from its list of chords.

Each gap is tallied twice: as it is (whole sample), and clipped to the sphere window. Infinity is
FAR, and the void outside the first and last solid is a gap of infinite length: never counted in
the whole, clipped in the window.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

__all__ = [
    "TALLY_SIZE",
    "WHOLE_KEPT",
    "WHOLE_LENGTH",
    "WHOLE_LINES",
    "WINDOW_KEPT",
    "WINDOW_LENGTH",
    "WINDOW_LINES",
    "WINDOW_LINE_LENGTH",
    "WINDOW_VOID",
    "scan_axes",
]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Sums = tuple[float, float, float, float, float]

FAR = 1e300
SMALLEST = 5e-324
# entries of a tally: of the whole, then of the window
WHOLE_LENGTH, WHOLE_KEPT, WHOLE_LINES = 0, 1, 2
WINDOW_LENGTH, WINDOW_KEPT, WINDOW_LINES = 3, 4, 5
WINDOW_VOID, WINDOW_LINE_LENGTH = 6, 7
TALLY_SIZE = 8
# what lets the compiler make vector instructions of a loop with sums: any order of the terms
REORDERED = {"reassoc", "nsz"}
# lines whose state stays in a core's cache
LINES_PER_STRIP = 8192


class Spheres(NamedTuple):
    """Projected spheres, ordered by depth."""

    u: FloatArray
    v: FloatArray
    depth: FloatArray
    radius: FloatArray


class Grid(NamedTuple):
    """Lines at (first_u + column * spacing, first_v + row * spacing)."""

    spacing: float
    first_u: float
    first_v: float
    columns: int
    rows: int


class RowChords(NamedTuple):
    """The chords that a sphere cuts from the lines ``first`` to ``last`` of a row."""

    first: int
    last: int
    first_u: float
    """Of the row's line 0, from the sphere's centre."""
    spacing: float
    reach2: float
    """Square of the radius of the circle that the row's plane cuts from the sphere."""
    depth: float


class LineState(NamedTuple):
    """Arrays of shape (rows, columns)."""

    end: FloatArray
    """Running end of the solid; FAR once a line is closed."""
    gap_start: FloatArray
    gap_end: FloatArray
    half: FloatArray
    """Half the line's length in the window, negative where it misses the window."""


@njit(nogil=True, cache=True, inline="always")
def tally_gap(start: float, end: float, half: float, least: float) -> Sums:
    """
    What a gap adds to a tally, as :func:`add` takes it; nothing if it is empty.

    ``least`` is the cut-off, or the smallest number above 0.
    """
    length = end - start
    kept = (length >= least) & (length < 0.5 * FAR)
    inside = max(min(end, half) - max(start, -half), 0.0)
    return (
        length if kept else 0.0,
        1.0 if kept else 0.0,
        inside if inside >= least else 0.0,
        1.0 if inside >= least else 0.0,
        inside,
    )


@njit(nogil=True, cache=True, fastmath=REORDERED, error_model="numpy")
def sweep_row(
    end: FloatArray,
    gap_start: FloatArray,
    gap_end: FloatArray,
    half: FloatArray,
    chords: RowChords,
    least: float,
) -> Sums:
    """
    Visit the chords that one sphere cuts from one row of lines; the sums of the settled gaps.

    The compiler makes vector instructions of this loop because rows are contiguous, indices cannot
    be negative, and there are choices instead of branches.
    """
    a = b = c = d = e = 0.0
    for i in range(np.uint64(chords.first), np.uint64(chords.last)):
        du = chords.first_u + chords.spacing * np.int64(i)
        half_chord = np.sqrt(max(chords.reach2 - du * du, 0.0))
        start = chords.depth - half_chord
        solid, low, high = end[i], gap_start[i], gap_end[i]
        opens = start > solid
        sums = tally_gap(low if opens else 0.0, high if opens else 0.0, half[i], least)
        a += sums[0]
        b += sums[1]
        c += sums[2]
        d += sums[3]
        e += sums[4]
        low = solid if opens else low
        high = start if opens else min(high, start)
        gap_start[i] = low
        gap_end[i] = high
        # a gap shortened to less than nothing: the chord reaches back past it
        end[i] = FAR if high < low else max(solid, chords.depth + half_chord)
    return a, b, c, d, e


@njit(nogil=True, cache=True, fastmath=REORDERED, error_model="numpy")
def settle_row(
    end: FloatArray, gap_start: FloatArray, gap_end: FloatArray, half: FloatArray, least: float
) -> Sums:
    """The sums of every line's last gap and of the void behind its last solid, if not closed."""
    a = b = c = d = e = 0.0
    for i in range(np.uint64(end.size)):
        closed = end[i] == FAR
        last = tally_gap(
            0.0 if closed else gap_start[i], 0.0 if closed else gap_end[i], half[i], least
        )
        behind = tally_gap(0.0 if closed else end[i], 0.0 if closed else FAR, half[i], least)
        a += last[0] + behind[0]
        b += last[1] + behind[1]
        c += last[2] + behind[2]
        d += last[3] + behind[3]
        e += last[4] + behind[4]
    return a, b, c, d, e


@njit(nogil=True, cache=True, inline="always")
def add(tally: FloatArray, sums: Sums) -> None:
    """Add the sums over gaps to a tally."""
    tally[WHOLE_LENGTH] += sums[0]
    tally[WHOLE_KEPT] += sums[1]
    tally[WINDOW_LENGTH] += sums[2]
    tally[WINDOW_KEPT] += sums[3]
    tally[WINDOW_VOID] += sums[4]


@njit(nogil=True, cache=True, inline="always")
def span(centre: float, reach: float, first: float, spacing: float, count: int) -> tuple[int, int]:
    """Range of the lines within ``reach`` of a centre, along one side of the grid."""
    low = int(np.ceil((centre - reach - first) / spacing))
    high = int(np.floor((centre + reach - first) / spacing)) + 1
    return max(low, 0), min(high, count)


@njit(nogil=True, cache=True, inline="always")
def row_chords(spheres: Spheres, k: int, grid: Grid, row: int) -> RowChords:
    """The chords of sphere k in a row; ``first >= last`` if there are none."""
    dv = grid.first_v + row * grid.spacing - spheres.v[k]
    reach2 = spheres.radius[k] * spheres.radius[k] - dv * dv
    reach = np.sqrt(max(reach2, 0.0))
    first, last = span(spheres.u[k], reach, grid.first_u, grid.spacing, grid.columns)
    return RowChords(
        first, last, grid.first_u - spheres.u[k], grid.spacing, reach2, spheres.depth[k]
    )


@njit(nogil=True, cache=True)
def sweep(
    spheres: Spheres,
    chosen: IntArray,
    grid: Grid,
    state: LineState,
    least: float,
    tally: FloatArray,
) -> int:
    """Visit the chosen spheres in their order; returns the number of closed lines."""
    for k in chosen:
        first_row, last_row = span(
            spheres.v[k], spheres.radius[k], grid.first_v, grid.spacing, grid.rows
        )
        for row in range(first_row, last_row):
            chords = row_chords(spheres, k, grid, row)
            if chords.first < chords.last:
                sums = sweep_row(
                    state.end[row],
                    state.gap_start[row],
                    state.gap_end[row],
                    state.half[row],
                    chords,
                    least,
                )
                add(tally, sums)
    closed = 0
    for row in range(grid.rows):
        end, half = state.end[row], state.half[row]
        add(tally, settle_row(end, state.gap_start[row], state.gap_end[row], half, least))
        for column in range(grid.columns):
            closed += end[column] == FAR
            tally[WHOLE_LINES] += end[column] > -FAR
            tally[WINDOW_LINES] += half[column] > 0.0
            tally[WINDOW_LINE_LENGTH] += max(2.0 * half[column], 0.0)
    return closed


@njit(nogil=True, cache=True)
def sweep_line(
    starts: FloatArray, ends: FloatArray, half: float, least: float, tally: FloatArray
) -> None:
    """
    The sweep of one line, as far as it goes.

    Chords ordered by their middles: what the sweep tallies, and nothing more once the line is
    closed. Chords ordered by their starts: exact, as none of them can reach back.
    """
    end, gap_start, gap_end = -FAR, -FAR, -FAR
    for k in range(starts.size):
        if starts[k] > end:
            add(tally, tally_gap(gap_start, gap_end, half, least))
            gap_start, gap_end = end, starts[k]
        else:
            gap_end = min(gap_end, starts[k])
            if gap_end < gap_start:
                return
        end = max(end, ends[k])
    add(tally, tally_gap(gap_start, gap_end, half, least))
    add(tally, tally_gap(end, FAR, half, least))


@njit(nogil=True, cache=True)
def list_chords(
    spheres: Spheres,
    chosen: IntArray,
    grid: Grid,
    number: IntArray,
    filled: IntArray,
    chords: FloatArray,
) -> None:
    """
    List the chords of the lines that have a number >= 0, in the order of depth.

    ``filled[number]`` is the place of a line's next chord in ``chords`` (shape (M, 2)); with no
    room there (M = 0) the chords are only counted.
    """
    for k in chosen:
        first_row, last_row = span(
            spheres.v[k], spheres.radius[k], grid.first_v, grid.spacing, grid.rows
        )
        for row in range(first_row, last_row):
            found = row_chords(spheres, k, grid, row)
            for column in range(found.first, found.last):
                line = number[row, column]
                if line < 0:
                    continue
                if chords.shape[0] > 0:
                    du = found.first_u + found.spacing * column
                    half_chord = np.sqrt(max(found.reach2 - du * du, 0.0))
                    chords[filled[line], 0] = found.depth - half_chord
                    chords[filled[line], 1] = found.depth + half_chord
                filled[line] += 1


@njit(nogil=True, cache=True)
def solve_closed(
    spheres: Spheres,
    chosen: IntArray,
    grid: Grid,
    state: LineState,
    closed: int,
    least: float,
    tally: FloatArray,
) -> None:
    """Replace what the sweep tallied on closed lines by what their lists of chords give."""
    number = np.full(state.end.shape, -1)
    half = np.empty(closed)
    line = 0
    for row in range(grid.rows):
        for column in range(grid.columns):
            if state.end[row, column] == FAR:
                number[row, column] = line
                half[line] = state.half[row, column]
                line += 1
    count = np.zeros(closed, np.int64)
    list_chords(spheres, chosen, grid, number, count, np.empty((0, 2)))
    stop = np.cumsum(count)
    chords = np.empty((stop[-1], 2))
    list_chords(spheres, chosen, grid, number, stop - count, chords)
    wrong = np.zeros(TALLY_SIZE)
    right = np.zeros(TALLY_SIZE)
    for line in range(closed):
        starts = chords[stop[line] - count[line] : stop[line], 0]
        ends = chords[stop[line] - count[line] : stop[line], 1]
        sweep_line(starts, ends, half[line], least, wrong)
        order = np.argsort(starts)
        sweep_line(starts[order], ends[order], half[line], least, right)
    tally += right - wrong


@njit(nogil=True, cache=True)
def line_state(grid: Grid, window_radius: float) -> LineState:
    """Lines that have met nothing yet."""
    shape = (grid.rows, grid.columns)
    half = np.full(shape, -1.0)
    for row in range(grid.rows):
        v = grid.first_v + row * grid.spacing
        for column in range(grid.columns):
            u = grid.first_u + column * grid.spacing
            half2 = window_radius * window_radius - u * u - v * v
            if half2 > 0.0:
                half[row, column] = np.sqrt(half2)
    return LineState(np.full(shape, -FAR), np.full(shape, -FAR), np.full(shape, -FAR), half)


@njit(nogil=True, cache=True)
def cover(
    low_u: float, high_u: float, low_v: float, high_v: float, offset: FloatArray, spacing: float
) -> Grid:
    """The lines ((i + offset_u) * spacing, (j + offset_v) * spacing) that meet a rectangle."""
    column = int(np.ceil(low_u / spacing - offset[0]))
    row = int(np.ceil(low_v / spacing - offset[1]))
    columns = int(np.floor(high_u / spacing - offset[0])) - column + 1
    rows = int(np.floor(high_v / spacing - offset[1])) - row + 1
    return Grid(
        spacing,
        (column + offset[0]) * spacing,
        (row + offset[1]) * spacing,
        max(columns, 0),
        max(rows, 0),
    )


@njit(nogil=True, cache=True)
def sort_into_strips(
    spheres: Spheres, grid: Grid, rows_per_strip: int
) -> tuple[IntArray, IntArray]:
    """
    The spheres that each strip of rows meets, in their order.

    Returns the start of each strip's list (one entry more than there are strips) and the lists.
    """
    strips = -(-grid.rows // rows_per_strip)
    start = np.zeros(strips + 1, np.int64)
    chosen = np.empty(0, np.int64)
    for fill in range(2):
        place = start[:-1].copy()
        for k in range(spheres.u.size):
            first, last = span(
                spheres.v[k], spheres.radius[k], grid.first_v, grid.spacing, grid.rows
            )
            if first < last:
                for strip in range(first // rows_per_strip, (last - 1) // rows_per_strip + 1):
                    if fill:
                        chosen[place[strip]] = k
                    place[strip] += 1
        if not fill:
            start[1:] = np.cumsum(place)
            chosen = np.empty(start[-1], np.int64)
    return start, chosen


@njit(nogil=True, cache=True)
def scan_solids(
    spheres: Spheres, grid: Grid, window_radius: float, cutoff: float, tally: FloatArray
) -> None:
    """Scan along one direction, strip by strip so that the lines' state stays in cache."""
    least = max(cutoff, SMALLEST)
    rows_per_strip = max(LINES_PER_STRIP // max(grid.columns, 1), 1)
    start, chosen = sort_into_strips(spheres, grid, rows_per_strip)
    for strip in range(start.size - 1):
        first_row = strip * rows_per_strip
        part = Grid(
            grid.spacing,
            grid.first_u,
            grid.first_v + first_row * grid.spacing,
            grid.columns,
            min(rows_per_strip, grid.rows - first_row),
        )
        state = line_state(part, window_radius)
        met = chosen[start[strip] : start[strip + 1]]
        closed = sweep(spheres, met, part, state, least, tally)
        if closed > 0:
            solve_closed(spheres, met, part, state, closed, least, tally)


@njit(nogil=True, cache=True)
def scan_axes(
    position: FloatArray,
    radius: FloatArray,
    removed: npt.NDArray[np.bool_],
    solids: tuple[bool, bool],
    whole: bool,
    frames: FloatArray,
    offsets: FloatArray,
    spacing: float,
    cutoff: float,
    window_radius: float,
    tallies: FloatArray,
) -> None:
    """
    Scan a packing along several axes.

    Parameters
    ----------
    position, radius : shapes (N, 3), (N,)
        Spheres; the window's centre is the origin.
    removed : shape (N,)
        Spheres that are not solid in the second set of solids.
    solids : two bool
        Whether to scan the set of all spheres, and the set of those not removed.
    whole : bool
        Whether lines outside the window count too.
    frames : shape (D, 3, 3)
        Orthonormal rows u, v, n of each axis: the lines run along n.
    offsets : shape (D, 2)
        Shift of each axis' grid, in units of the spacing.
    window_radius : float
        Radius of the sphere window; 0 for none.
    tallies : shape (D, 2, TALLY_SIZE)
        Zeros; the results for each axis and set of solids.
    """
    for axis in range(frames.shape[0]):
        projected = position @ frames[axis].T
        u, v, depth = projected[:, 0], projected[:, 1], projected[:, 2]
        order = np.argsort(depth)
        low_u, high_u = -window_radius, window_radius
        low_v, high_v = -window_radius, window_radius
        if whole and u.size > 0:
            low_u, high_u = min(np.min(u - radius), low_u), max(np.max(u + radius), high_u)
            low_v, high_v = min(np.min(v - radius), low_v), max(np.max(v + radius), high_v)
        grid = cover(low_u, high_u, low_v, high_v, offsets[axis], spacing)
        for chosen in range(2):
            if solids[chosen]:
                if chosen == 1:
                    order = order[~removed[order]]
                spheres = Spheres(u[order], v[order], depth[order], radius[order])
                scan_solids(spheres, grid, window_radius, cutoff, tallies[axis, chosen])
