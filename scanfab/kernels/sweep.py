"""
The depth-ordered sweep: void segments on all scan lines of one direction, without any list.

The spheres are visited in the order of their centres along the direction. A chord's middle lies at
its sphere's depth, so on every line the chords arrive ordered by their middles, and three numbers a
line suffice: the running end of the solid, and the two ends of the last gap, which is not counted
yet. A chord that begins behind the running end settles the last gap and opens a new one; one that
begins earlier can only shorten the last gap. That is exact unless a chord reaches back past the
last gap: such a line is suspect, and is solved again from its list of chords.

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

FAR = 1e300
# entries of a tally: of the whole, then of the window
WHOLE_LENGTH, WHOLE_KEPT, WHOLE_LINES = 0, 1, 2
WINDOW_LENGTH, WINDOW_KEPT, WINDOW_LINES = 3, 4, 5
WINDOW_VOID, WINDOW_LINE_LENGTH = 6, 7
TALLY_SIZE = 8


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


class LineState(NamedTuple):
    """Arrays of shape (rows, columns)."""

    end: FloatArray
    gap_start: FloatArray
    gap_end: FloatArray
    suspect: IntArray
    half: FloatArray
    """Half the line's length in the window, negative where it misses the window."""


@njit(nogil=True, cache=True, inline="always")
def span(centre: float, reach: float, first: float, spacing: float, count: int) -> tuple[int, int]:
    """Range of the lines within ``reach`` of a centre, along one side of the grid."""
    low = int(np.ceil((centre - reach - first) / spacing))
    high = int(np.floor((centre + reach - first) / spacing)) + 1
    return max(low, 0), min(high, count)


@njit(nogil=True, cache=True)
def settle(tally: FloatArray, start: float, end: float, half: float, cutoff: float) -> None:
    """Count a gap that nothing can shorten any more."""
    length = end - start
    if length > 0.0 and length >= cutoff and length < 0.5 * FAR:
        tally[WHOLE_LENGTH] += length
        tally[WHOLE_KEPT] += 1.0
    length = min(end, half) - max(start, -half)
    if length > 0.0:
        tally[WINDOW_VOID] += length
        if length >= cutoff:
            tally[WINDOW_LENGTH] += length
            tally[WINDOW_KEPT] += 1.0


@njit(nogil=True, cache=True)
def sweep(spheres: Spheres, grid: Grid, state: LineState, cutoff: float, tally: FloatArray) -> int:
    """Visit all spheres; returns the number of suspect lines."""
    suspects = 0
    for k in range(spheres.u.size):
        u, v = spheres.u[k], spheres.v[k]
        depth, radius = spheres.depth[k], spheres.radius[k]
        first_row, last_row = span(v, radius, grid.first_v, grid.spacing, grid.rows)
        for row in range(first_row, last_row):
            dv = grid.first_v + row * grid.spacing - v
            reach2 = radius * radius - dv * dv
            if reach2 <= 0.0:
                continue
            first, last = span(u, np.sqrt(reach2), grid.first_u, grid.spacing, grid.columns)
            for column in range(first, last):
                du = grid.first_u + column * grid.spacing - u
                half_chord = np.sqrt(max(reach2 - du * du, 0.0))
                start = depth - half_chord
                if start > state.end[row, column]:
                    settle(
                        tally,
                        state.gap_start[row, column],
                        state.gap_end[row, column],
                        state.half[row, column],
                        cutoff,
                    )
                    state.gap_start[row, column] = state.end[row, column]
                    state.gap_end[row, column] = start
                elif start < state.gap_end[row, column]:
                    state.gap_end[row, column] = start
                    if start < state.gap_start[row, column]:
                        suspects += state.suspect[row, column] == 0
                        state.suspect[row, column] = 1
                state.end[row, column] = max(state.end[row, column], depth + half_chord)
    return suspects


@njit(nogil=True, cache=True)
def settle_rest(state: LineState, cutoff: float, tally: FloatArray) -> None:
    """Count the last gap of every line and the void behind its last solid."""
    for row in range(state.end.shape[0]):
        for column in range(state.end.shape[1]):
            half, end = state.half[row, column], state.end[row, column]
            settle(tally, state.gap_start[row, column], state.gap_end[row, column], half, cutoff)
            settle(tally, end, FAR, half, cutoff)
            tally[WHOLE_LINES] += end > -FAR
            if half > 0.0:
                tally[WINDOW_LINES] += 1.0
                tally[WINDOW_LINE_LENGTH] += 2.0 * half


@njit(nogil=True, cache=True)
def sweep_line(
    starts: FloatArray, ends: FloatArray, half: float, cutoff: float, tally: FloatArray
) -> None:
    """The sweep of one line; exact for chords ordered by their starts, however they overlap."""
    end, gap_start, gap_end = -FAR, -FAR, -FAR
    for k in range(starts.size):
        if starts[k] > end:
            settle(tally, gap_start, gap_end, half, cutoff)
            gap_start, gap_end = end, starts[k]
        else:
            gap_end = min(gap_end, starts[k])
        end = max(end, ends[k])
    settle(tally, gap_start, gap_end, half, cutoff)
    settle(tally, end, FAR, half, cutoff)


@njit(nogil=True, cache=True)
def list_chords(
    spheres: Spheres, grid: Grid, number: IntArray, filled: IntArray, chords: FloatArray
) -> None:
    """
    List the chords of the lines that have a number > 0, in the order of depth.

    ``filled[number - 1]`` is the place of a line's next chord in ``chords`` (shape (M, 2)); with
    no room there (M = 0) the chords are only counted.
    """
    for k in range(spheres.u.size):
        u, v = spheres.u[k], spheres.v[k]
        depth, radius = spheres.depth[k], spheres.radius[k]
        first_row, last_row = span(v, radius, grid.first_v, grid.spacing, grid.rows)
        for row in range(first_row, last_row):
            dv = grid.first_v + row * grid.spacing - v
            reach2 = radius * radius - dv * dv
            if reach2 <= 0.0:
                continue
            first, last = span(u, np.sqrt(reach2), grid.first_u, grid.spacing, grid.columns)
            for column in range(first, last):
                line = number[row, column] - 1
                if line < 0:
                    continue
                if chords.shape[0] > 0:
                    du = grid.first_u + column * grid.spacing - u
                    half_chord = np.sqrt(max(reach2 - du * du, 0.0))
                    chords[filled[line], 0] = depth - half_chord
                    chords[filled[line], 1] = depth + half_chord
                filled[line] += 1


@njit(nogil=True, cache=True)
def solve_suspects(
    spheres: Spheres, grid: Grid, state: LineState, suspects: int, cutoff: float, tally: FloatArray
) -> None:
    """Replace what the sweep tallied on suspect lines by what their lists of chords give."""
    half = np.empty(suspects)
    line = 0
    for row in range(grid.rows):
        for column in range(grid.columns):
            if state.suspect[row, column] > 0:
                half[line] = state.half[row, column]
                line += 1
                state.suspect[row, column] = line
    count = np.zeros(suspects, np.int64)
    list_chords(spheres, grid, state.suspect, count, np.empty((0, 2)))
    stop = np.cumsum(count)
    chords = np.empty((stop[-1], 2))
    list_chords(spheres, grid, state.suspect, stop - count, chords)
    wrong = np.zeros(TALLY_SIZE)
    right = np.zeros(TALLY_SIZE)
    for line in range(suspects):
        starts = chords[stop[line] - count[line] : stop[line], 0]
        ends = chords[stop[line] - count[line] : stop[line], 1]
        # in the order of depth the same steps as in the sweep: what it has tallied
        sweep_line(starts, ends, half[line], cutoff, wrong)
        order = np.argsort(starts)
        sweep_line(starts[order], ends[order], half[line], cutoff, right)
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
    return LineState(
        np.full(shape, -FAR),
        np.full(shape, -FAR),
        np.full(shape, -FAR),
        np.zeros(shape, np.int64),
        half,
    )


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
            if not solids[chosen]:
                continue
            if chosen == 1:
                order = order[~removed[order]]
            spheres = Spheres(u[order], v[order], depth[order], radius[order])
            state = line_state(grid, window_radius)
            tally = tallies[axis, chosen]
            suspects = sweep(spheres, grid, state, cutoff, tally)
            settle_rest(state, cutoff, tally)
            if suspects > 0:
                solve_suspects(spheres, grid, state, suspects, cutoff, tally)
