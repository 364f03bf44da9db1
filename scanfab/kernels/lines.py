"""
Scan lines from lists of their chords: slower than the sweep, and exact for any spheres.

For the lines that the sweep cannot solve, and where the gaps themselves are wanted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from scanfab.kernels.sweep import (
    BOUND,
    END,
    FAR,
    SET,
    TALLY_SIZE,
    Flag,
    Sphere,
    Strip,
    add,
    counted,
    moved,
)

__all__ = [
    "Spheres",
    "chords_of",
    "list_chords",
    "solve_closed",
    "sort_by",
    "span",
    "sphere_at",
    "sweep_line",
]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


class Spheres(NamedTuple):
    """Projected spheres, ordered by depth; some are not in the second set of solids."""

    u: FloatArray
    v: FloatArray
    depth: FloatArray
    radius: FloatArray
    removed: BoolArray


@njit(nogil=True, cache=True, inline="always")
def sphere_at(spheres: Spheres, k: int) -> Sphere:
    """Sphere k."""
    return Sphere(spheres.u[k], spheres.v[k], spheres.depth[k], spheres.radius[k])


@njit(nogil=True, cache=True, inline="always")
def span(
    centre: float, reach: float, first: float, per_spacing: float, count: int
) -> tuple[int, int]:
    """Range of the lines within ``reach`` of a centre, along one side of the grid."""
    low = int(np.ceil((centre - reach - first) * per_spacing))
    high = int(np.floor((centre + reach - first) * per_spacing)) + 1
    return max(low, 0), min(high, count)


@njit(nogil=True, cache=True)
def sort_by(values: FloatArray, members: IntArray) -> None:
    """Order some indices by their values, in place (Shell's sort, which suits few of them)."""
    gap = 1
    while gap < members.size // 9:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, members.size):
            moving, j = members[i], i
            while j >= gap and values[members[j - gap]] > values[moving]:
                members[j] = members[j - gap]
                j -= gap
            members[j] = moving
        gap //= 3


@njit(nogil=True, cache=True)
def list_chords(
    spheres: Spheres,
    chosen: IntArray,
    which: int,
    strip: Strip,
    number: IntArray,
    filled: IntArray,
    chords: FloatArray,
) -> None:
    """
    List the chords of the lines that have a number >= 0, in the order of depth.

    ``number`` has shape (rows, columns). ``filled[number]`` is the place of a line's next chord in
    ``chords`` (shape (M, 2)); with no room there (M = 0) the chords are only counted.
    """
    for k in chosen:
        if which == 1 and spheres.removed[k]:
            continue
        u, v, depth, radius = sphere_at(spheres, k)
        rows = span(v, radius, strip.first_v, strip.per_spacing, strip.rows)
        for row in range(rows[0], rows[1]):
            dv = strip.first_v + row * strip.spacing - v
            reach2 = radius * radius - dv * dv
            reach = np.sqrt(max(reach2, 0.0))
            first_u = strip.first_u + row * strip.shear
            columns = span(u, reach, first_u, strip.per_spacing, strip.columns)
            for column in range(columns[0], columns[1]):
                line = number[row, column]
                du = first_u + column * strip.spacing - u
                if line < 0 or reach2 < du * du:
                    continue
                if chords.shape[0] > 0:
                    half_chord = np.sqrt(reach2 - du * du)
                    chords[filled[line], 0] = depth - half_chord
                    chords[filled[line], 1] = depth + half_chord
                filled[line] += 1


@njit(nogil=True, cache=True)
def chords_of(
    spheres: Spheres, chosen: IntArray, which: int, strip: Strip, number: IntArray, count: int
) -> tuple[IntArray, FloatArray]:
    """The chords of numbered lines: the start of each line's list (and the end), and the lists."""
    counted = np.zeros(count, np.int64)
    list_chords(spheres, chosen, which, strip, number, counted, np.empty((0, 2)))
    start = np.zeros(count + 1, np.int64)
    for line in range(count):
        start[line + 1] = start[line] + counted[line]
    chords = np.empty((start[-1], 2))
    if start[-1] > 0:
        list_chords(spheres, chosen, which, strip, number, start[:-1].copy(), chords)
    return start, chords


@njit(nogil=True, cache=True)
def sweep_line(
    chords: FloatArray,
    bound: float,
    least: float,
    tally: FloatArray,
    which: int,
    whole: Flag,
    window: Flag,
    measured: float | None,
) -> float:
    """
    The sweep of one line, as far as it goes; where its last solid ends.

    Chords ordered by their middles: what the sweep tallies, and nothing more once the line is
    closed. Chords ordered by their starts: exact, as none of them can reach back.
    """
    end, low, high = -FAR, -FAR, -FAR
    if whole is None:
        end = -bound
    for k in range(chords.shape[0] + 1):
        is_last = k == chords.shape[0]
        start = FAR if is_last else chords[k, 0]
        stop = FAR if is_last else chords[k, 1]
        if end < FAR and start > end:
            add(tally, which, counted(True, low, high, least, bound, whole, window, measured))
            if is_last and window is not None:
                add(tally, which, counted(True, end, FAR, least, bound, whole, window, measured))
        if is_last:
            return end
        end, low, high = moved(start, stop, end, low, high)
    return end


@njit(nogil=True, cache=True)
def solve_closed(
    lines: FloatArray,
    spheres: Spheres,
    chosen: IntArray,
    strip: Strip,
    which: int,
    closed: int,
    least: float,
    tally: FloatArray,
    whole: Flag,
    window: Flag,
    measured: float | None,
) -> None:
    """Replace what the sweep tallied on closed lines by what their lists of chords give."""
    number = np.full((strip.rows, strip.columns), -1)
    places = np.empty(closed, np.uint64)
    line = 0
    for row in range(strip.rows):
        for column in range(strip.columns):
            place = np.uint64(row * strip.pitch + column)
            if lines[place + SET * np.uint64(which) + END] == FAR:
                number[row, column] = line
                places[line] = place
                line += 1
    start, chords = chords_of(spheres, chosen, which, strip, number, closed)
    wrong = np.zeros((2, TALLY_SIZE))
    right = np.zeros((2, TALLY_SIZE))
    for line in range(closed):
        met = chords[start[line] : start[line + 1]]
        bound = lines[places[line] + BOUND]
        sweep_line(met, bound, least, wrong, which, whole, window, measured)
        order = np.arange(met.shape[0])
        sort_by(met[:, 0], order)
        met = met[order]
        end = sweep_line(met, bound, least, right, which, whole, window, measured)
        lines[places[line] + SET * np.uint64(which) + END] = end
    for entry in range(TALLY_SIZE):
        tally[which, entry] += right[which, entry] - wrong[which, entry]
