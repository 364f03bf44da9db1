"""
Scan lines from lists of their chords: slower than the sweep, and exact for any spheres.

For the lines that the sweep cannot solve, and where the gaps themselves are wanted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import ZERO, inner
from scanfab.kernels.projection import Spheres, number_from, sort_by, sphere_at
from scanfab.kernels.sweep import (
    BOUND,
    END,
    FAR,
    SET,
    TALLY_SIZE,
    Flag,
    Measured,
    Strip,
    add,
    counted,
    moved,
    span,
)

__all__ = ["chords_of", "solids_of", "solve_closed"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


class Chords(NamedTuple):
    """Chords in lists, one after the other."""

    ends: FloatArray
    """Where they start and stop, shape (2, M)."""
    removed: BoolArray
    """Whether their spheres are not in the second set of solids, shape (M,)."""


@inner()
def room_for(count: int) -> Chords:
    """So many chords, to be filled in."""
    return Chords(np.empty((2, count)), np.empty(count, np.bool_))


@inner()
def cut(
    spheres: Spheres,
    chosen: IntArray,
    which: int,
    strip: Strip,
    number: IntArray,
    line: IntArray,
    chords: Chords,
    done: int,
    count: int,
) -> tuple[int, int]:
    """
    Add chords of the lines that have a number >= 0, in the order of depth, and those numbers.

    Of the first set of solids, which has all spheres, or of the second one.

    ``number`` has shape (rows, columns). From the sphere ``done`` on, to the ``count`` chords that
    are there, until there is no more room. Returns the new ``done`` and ``count``.
    """
    ends, removed = chords.ends, chords.removed
    low, high = strip.low, strip.high
    for place in range(done, chosen.size):
        k = chosen[place]
        if which == 1 and spheres.removed[k]:
            continue
        sphere = sphere_at(spheres, k)
        rows = span(sphere.v, sphere.radius, strip.first_v, strip.per_spacing, 0, strip.rows)
        if count + (rows[1] - rows[0]) * strip.columns > line.size:
            return place, count
        for row in range(rows[0], rows[1]):
            dv = strip.first_v + row * strip.spacing - sphere.v
            reach2 = sphere.radius * sphere.radius - dv * dv
            reach = np.sqrt(max(reach2, 0.0))
            columns = span(sphere.u, reach, strip.first_u, strip.per_spacing, low[row], high[row])
            for column in range(columns[0], columns[1]):
                du = strip.first_u + column * strip.spacing - sphere.u
                if number[row, column] < 0 or reach2 < du * du:
                    continue
                half_chord = np.sqrt(reach2 - du * du)
                line[count] = number[row, column]
                ends[0, count] = sphere.depth - half_chord
                ends[1, count] = sphere.depth + half_chord
                removed[count] = spheres.removed[k]
                count += 1
    return chosen.size, count


@inner()
def copy(line: IntArray, chords: Chords, count: int, to_line: IntArray, to_chords: Chords) -> None:
    """Copy the first chords of a list and the numbers of their lines into another."""
    for k in range(count):
        to_line[k] = line[k]
        to_chords.ends[0, k], to_chords.ends[1, k] = chords.ends[0, k], chords.ends[1, k]
        to_chords.removed[k] = chords.removed[k]


@inner()
def cut_all(
    spheres: Spheres, chosen: IntArray, which: int, strip: Strip, number: IntArray
) -> tuple[IntArray, Chords]:
    """All that :func:`cut` finds."""
    room = 4 * chosen.size + strip.rows * strip.columns
    line, chords = np.empty(room, np.int64), room_for(room)
    done = count = ZERO
    while True:
        done, count = cut(spheres, chosen, which, strip, number, line, chords, done, count)
        if done == chosen.size:
            return line[:count], chords
        lines, more = np.empty(2 * line.size, np.int64), room_for(2 * line.size)
        copy(line, chords, count, lines, more)
        line, chords = lines, more


@inner()
def sort_by_line(line: IntArray, chords: Chords, stop: IntArray, listed: Chords) -> None:
    """
    Sort chords by the number of their line, in the order that they have.

    ``stop``, zeros, becomes the start of each line's list, and the end of the last; see ``listed``.
    """
    from_ends, from_removed = chords.ends, chords.removed
    ends, removed = listed.ends, listed.removed
    for k in range(line.size):
        stop[line[k] + 2] += 1
    for one in range(2, stop.size):
        stop[one] += stop[one - 1]
    # lists begin where those before them end, so filling them leaves each its start
    for k in range(line.size):
        place = stop[line[k] + 1]
        stop[line[k] + 1] += 1
        ends[0, place], ends[1, place] = from_ends[0, k], from_ends[1, k]
        removed[place] = from_removed[k]


@inner()
def chords_of(
    spheres: Spheres, chosen: IntArray, which: int, strip: Strip, number: IntArray, count: int
) -> tuple[IntArray, Chords]:
    """The chords of numbered lines, and the start of each line's list (and the end of the last)."""
    line, chords = cut_all(spheres, chosen, which, strip, number)
    stop, listed = np.zeros(count + 2, np.int64), room_for(line.size)
    sort_by_line(line, chords, stop, listed)
    return stop, listed


@inner()
def solids_of(chords: Chords, order: IntArray, which: int, solids: FloatArray) -> int:
    """
    The union of a line's chords into the first places of ``solids``; their number.

    Of the first set of solids, or of the second one, without the chords that are removed from it.
    """
    count = 0
    for k in order:
        if which == 1 and chords.removed[k]:
            continue
        start, stop = chords.ends[0, k], chords.ends[1, k]
        if count > 0 and start <= solids[1, count - 1]:
            solids[1, count - 1] = max(solids[1, count - 1], stop)
        else:
            solids[0, count], solids[1, count] = start, stop
            count += 1
    return count


@inner()
def sweep_line(
    chords: FloatArray,
    order: IntArray,
    bound: float,
    least: float,
    tally: FloatArray,
    which: int,
    whole: Flag,
    window: Flag,
    measured: Measured | None,
) -> float:
    """
    The sweep of one line's chords in an order, as far as it goes; where its last solid ends.

    Chords ordered by their middles: what the sweep tallies, and nothing more once the line is
    closed. Chords ordered by their starts: exact, as none of them can reach back.
    """
    end, low, high = -FAR, -FAR, -FAR
    if whole is None:
        end = -bound
    for k in range(order.size + 1):
        is_last = k == order.size
        start = FAR if is_last else chords[0, order[k]]
        stop = FAR if is_last else chords[1, order[k]]
        if measured is not None and not is_last and start - bound >= measured.known:
            continue
        if end < FAR and start > end:
            add(tally, which, counted(True, low, high, least, bound, whole, window, measured))
            if is_last and window is not None:
                add(tally, which, counted(True, end, FAR, least, bound, whole, window, measured))
        if is_last:
            return end
        end, low, high = moved(start, stop, end, low, high)
    return end


@inner()
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
    measured: Measured | None,
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
        order = np.empty(start[line + 1] - start[line], np.int64)
        number_from(start[line], order)
        bound = lines[places[line] + BOUND]
        sweep_line(chords.ends, order, bound, least, wrong, which, whole, window, measured)
        sort_by(chords.ends[0], order)
        end = sweep_line(chords.ends, order, bound, least, right, which, whole, window, measured)
        lines[places[line] + SET * np.uint64(which) + END] = end
    for entry in range(TALLY_SIZE):
        tally[which, entry] += right[which, entry] - wrong[which, entry]
