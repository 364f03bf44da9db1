"""Scan lines that the sweep cannot solve, from lists of their chords: slow, and always exact."""

from __future__ import annotations

import numpy as np

from scanfab.base.jit import ZERO, Flag, inner
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.bins import Bins, add_gaps, list_gap, room_for_gaps
from scanfab.scan.kernels.projection import Spheres, number_from, sort_by, sphere_at
from scanfab.scan.kernels.start import begins_at, reaches_in
from scanfab.scan.kernels.strips import (
    END,
    ENTRY,
    EXIT,
    FAR,
    SET,
    Edge,
    Strip,
    span,
)
from scanfab.scan.kernels.sweep import Measured, add, counted, is_listed, moved


@inner()
def cut(
    spheres: Spheres,
    chosen: IntArray,
    which: int,
    strip: Strip,
    number: IntArray,
    line: IntArray,
    chords: FloatArray,
    done: int,
    count: int,
) -> tuple[int, int]:
    """
    Add chords of the lines that have a number >= 0, in the order of depth, and those numbers.

    Of the first set of solids, which has all spheres, or of the second one.

    ``number`` has shape (rows, columns), ``chords`` (2, M): where they start and stop. From the
    sphere ``done`` on, to the ``count`` chords that are there, until there is no more room. Returns
    the new ``done`` and ``count``.
    """
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
                chords[0, count] = sphere.depth - half_chord
                chords[1, count] = sphere.depth + half_chord
                count += 1
    return chosen.size, count


@inner()
def copy(line: IntArray, chords: FloatArray, count: int, lines: IntArray, more: FloatArray) -> None:
    """Copy the first chords of a list and the numbers of their lines into another."""
    for k in range(count):
        lines[k] = line[k]
        more[0, k], more[1, k] = chords[0, k], chords[1, k]


@inner()
def cut_all(
    spheres: Spheres, chosen: IntArray, which: int, strip: Strip, number: IntArray
) -> tuple[IntArray, FloatArray]:
    """All that :func:`cut` finds."""
    room = 4 * chosen.size + strip.rows * strip.columns
    line, chords = np.empty(room, np.int64), np.empty((2, room))
    done = count = ZERO
    while True:
        done, count = cut(spheres, chosen, which, strip, number, line, chords, done, count)
        if done == chosen.size:
            return line[:count], chords
        lines, more = np.empty(2 * line.size, np.int64), np.empty((2, 2 * line.size))
        copy(line, chords, count, lines, more)
        line, chords = lines, more


@inner()
def chords_of(
    spheres: Spheres, chosen: IntArray, which: int, strip: Strip, number: IntArray, count: int
) -> tuple[IntArray, FloatArray]:
    """
    The chords of numbered lines, in lists one after the other, each in the order of depth.

    Returns the start of each line's list (and the end of the last), and where chords start and
    stop, shape (2, M).
    """
    line, chords = cut_all(spheres, chosen, which, strip, number)
    stop, listed = np.zeros(count + 2, np.int64), np.empty((2, line.size))
    for k in range(line.size):
        stop[line[k] + 2] += 1
    for one in range(2, stop.size):
        stop[one] += stop[one - 1]
    # lists begin where those before them end, so filling them leaves each its start
    for k in range(line.size):
        place = stop[line[k] + 1]
        stop[line[k] + 1] += 1
        listed[0, place], listed[1, place] = chords[0, k], chords[1, k]
    return stop, listed


@inner()
def gaps_of(
    chords: FloatArray,
    order: IntArray,
    enters: float,
    leaves: float,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
    ends: FloatArray,
) -> tuple[int, float]:
    """
    The gaps that the sweep settles on one line: in ``ends``, (2, M), where they start and stop.

    Their number, the void behind the last solid included, and where that ends. Chords ordered by
    their middles: as the sweep does it, and nothing more once the line is closed. Chords ordered by
    their starts: exact, as none of them can reach back.
    """
    end, low, high = -FAR, -FAR, -FAR
    before, behind = FAR, FAR
    if window is not None and window.start is not None:
        before, behind = window.margin - enters, leaves + window.margin
    elif whole is None:
        end = enters
    count = 0
    for k in order:
        start, stop = chords[0, k], chords[1, k]
        if not is_listed(start, enters, measured):
            continue
        if window is not None and window.start is not None:
            before = min(before, -stop) if start <= enters else before
            behind = min(behind, start) if start >= leaves else behind
            if not reaches_in(start, stop, enters, leaves):
                continue
        if start > end:
            ends[0, count], ends[1, count] = begins_at(low, before), high
            count += 1
        end, low, high = moved(start, stop, end, low, high)
    if end < FAR:
        ends[0, count], ends[1, count] = begins_at(low, before), high
        ends[0, count + 1], ends[1, count + 1] = end, behind
        count += 2
    return count, end


@inner()
def tally_line(
    ends: FloatArray,
    count: int,
    sign: float,
    u: float,
    v: float,
    enters: float,
    leaves: float,
    least: float,
    tally: FloatArray,
    which: int,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
    bins: Bins,
) -> None:
    """Tally the gaps of one line, or take them back, with a sign of -1."""
    if bins.cutoffs.size > 0:
        gaps = room_for_gaps(count)
        for k in range(count):
            low, high = ends[0, k], ends[1, k]
            list_gap(gaps, k, u, low, high, enters, leaves, whole, window, measured)
        add_gaps(bins, gaps, np.uint64(count), sign, which, v, whole, window)
    else:
        for k in range(count):
            low, high = ends[0, k], ends[1, k]
            a, b, c, d, e, f = counted(
                True, low, high, least, enters, leaves, whole, window, measured
            )
            if window is not None and window.start is not None and sign < 0.0:
                # the sweep has added all its length
                f = max(high - low, 0.0)
            add(tally, which, (sign * a, sign * b, sign * c, sign * d, sign * e, sign * f))


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
    window: Edge | None,
    measured: Measured | None,
    bins: Bins,
) -> None:
    """Replace what the sweep tallied on closed lines by what their lists of chords give."""
    number = np.full((strip.rows, strip.columns), -1)
    places = np.empty(closed, np.int64)
    line = 0
    for row in range(strip.rows):
        for column in range(strip.columns):
            place = np.uint64(row * strip.pitch + column)
            if lines[place + SET * np.uint64(which) + END] == FAR:
                number[row, column] = line
                places[line] = row * strip.pitch + column
                line += 1
    first, chords = chords_of(spheres, chosen, which, strip, number, closed)
    ends = np.empty((2, chords.size // 2 + 2))
    for line in range(closed):
        row, column = places[line] // strip.pitch, places[line] % strip.pitch
        u = strip.first_u + column * strip.spacing
        v = strip.first_v + row * strip.spacing
        place = np.uint64(places[line])
        enters, leaves = lines[place + ENTRY], lines[place + EXIT]
        order = np.empty(first[line + 1] - first[line], np.int64)
        number_from(first[line], order)
        end, count = 0.0, ZERO
        for sign in (-1.0, 1.0):
            count, end = gaps_of(chords, order, enters, leaves, whole, window, measured, ends)
            tally_line(
                ends, count, sign, u, v, enters, leaves, least, tally, which, whole, window,
                measured, bins,
            )  # fmt: skip
            sort_by(chords[0], order)
        lines[place + SET * np.uint64(which) + END] = end
