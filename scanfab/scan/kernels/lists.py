"""
The sweep over lists: chords are listed line by line, and lines are swept side by side.

Where lines are so far apart that a sphere meets few of them, rows of lines within a sphere are too
short for vector instructions. So the spheres, in the order of their depths, add their chords to the
lists of their lines, and the sweep takes the first chord of many lines, then the second, and so on.
The same lists serve where gaps are put in bins, line by line.

Lines that the sweep has closed are solved from lists of all their chords, which is slow and always
exact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import LANES, ONE, REORDERED, ZERO, inner, part
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.bins import add_gaps, list_gap, room_for_gaps
from scanfab.scan.kernels.grid import Spheres, sort_by, sphere_at
from scanfab.scan.kernels.strips import (
    BEFORE,
    BEHIND,
    END,
    ENTRY,
    EXIT,
    FAR,
    GAP_END,
    GAP_START,
    MOST_LINES,
    SET,
    Line,
    Strip,
    Task,
    set_off,
    span,
)
from scanfab.scan.kernels.sweep import (
    CHORDS,
    add,
    begins_at,
    both,
    is_listed,
    meet,
    met_beyond,
    moved,
    reaches_in,
)

# Lines that are swept side by side. Their lists lie together: the first chord of each line comes
# first, then the second chord of each, and so on.
ABREAST = 64
# Chords that a list has room for. As soon as a chord lies in the second half, which a bit of its
# place tells, all lists are swept.
ROOM = 64
NEXT = 2 * ABREAST
TILE = ROOM * NEXT
SECOND_HALF = TILE // 2
# above 0, but its square root is too small to matter
LEAST_REACH2 = 1e-300
# gaps that are put in bins together
TOGETHER = 512
ALMOST = np.uint64(TOGETHER - ROOM)
# chords of closed lines that there is room for at first
SOME = 256

# Chord: where it starts and stops. State: the end of the solid on a line, and the ends of its last
# gap.
Chord = tuple[float, float]
State = tuple[float, float, float]


class Lists(NamedTuple):
    """A list of chords for each line of a strip, in the order of their spheres' depths."""

    chords: FloatArray
    """
    The depth of each chord's middle and, ABREAST places behind it, the square of half its length.

    The square is negative if the sphere is not in the second set of solids.
    """
    stop: IntArray
    """Place behind the last chord of each line, shape (MOST_LINES,)."""


@part()
def room_for_lists(wanted: bool) -> Lists:
    """Empty lists; arrays without entries if none are wanted."""
    count = MOST_LINES if wanted else 0
    lists = Lists(np.empty(count // ABREAST * TILE), np.empty(count, np.int64))
    for line in range(count):
        lists.stop[line] = first_place(line)
    return lists


@inner(inline="always")
def first_place(line: int) -> int:
    """Place where the list of a line begins."""
    return line // ABREAST * TILE + line % ABREAST


@inner(fastmath=REORDERED, error_model="numpy")
def list_chords(lists: Lists, strip: Strip, spheres: Spheres, chosen: IntArray, done: int) -> int:
    """
    List the chords that spheres cut from a strip, until some list is half full.

    Starts at number ``done`` of the chosen spheres; returns the number of the next sphere.
    """
    # no array is passed on in the loop: counting references would take most of the time
    chords, stop, removed = lists.chords, lists.stop, spheres.removed
    spacing, per_spacing = strip.spacing, strip.per_spacing
    for number in range(done, chosen.size):
        k = np.uint64(chosen[np.uint64(number)])
        sphere = sphere_at(spheres, k)
        radius, depth = sphere.radius, sphere.depth
        sign = -1.0 if removed[k] else 1.0
        rows = span(sphere.v, radius, strip.first_v, per_spacing, 0, strip.rows)
        # The columns of the widest row serve for all rows: finding those of each row would take
        # longer than visiting the corners. Places without a line, at the ends of rows, also get
        # lists, which are dropped.
        first, last = span(sphere.u, radius, strip.first_u, per_spacing, 0, strip.columns)
        columns = np.uint64(max(last - first, 0))
        from_v = strip.first_v - sphere.v
        first_du = strip.first_u - sphere.u + first * spacing
        seen = 0
        for row in range(rows[0], rows[1]):
            dv = from_v + row * spacing
            reach2 = radius * radius - dv * dv
            at = np.uint64(row * strip.pitch + first)
            for j in range(columns):
                du = first_du + spacing * np.int32(j)
                rest2 = reach2 - du * du
                place = stop[at + j]
                # written in any case, and overwritten if it is no chord: this needs no branch
                chords[np.uint64(place)] = depth
                chords[np.uint64(place + ABREAST)] = sign * max(rest2, LEAST_REACH2)
                stop[at + j] = place + (NEXT if rest2 >= 0.0 else 0)
                seen |= place
        if seen & SECOND_HALF:
            return number + 1
    return int(chosen.size)


@inner(forceinline=True, fastmath=REORDERED, error_model="numpy")
def sweep_abreast(
    task: Task, lists: Lists, first: np.uint64, place: np.uint64, vectors: np.uint64
) -> None:
    """Let vectors of lines, from the first line on, meet one chord each."""
    lines, counts = task.lines, task.counts
    sums = sums2 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in range(np.uint64(vectors * LANES)):
        i, k = first + j, place + j
        depth, reach2 = lists.chords[k], lists.chords[k + np.uint64(ABREAST)]
        half_chord = np.sqrt(abs(reach2))
        half_chord = half_chord if np.int64(k) < lists.stop[i] else np.nan
        start, stop = depth - half_chord, depth + half_chord
        line = 0.0, 0.0, lines[i + ENTRY], lines[i + EXIT]
        known = is_listed(start, lines[i + ENTRY], counts)
        start, stop = start if known else np.nan, stop if known else np.nan
        sums = both(sums, meet(lines, i, line, start, stop, counts))
        if counts.second is not None:
            start = start if reach2 > 0.0 else np.nan
            stop = stop if reach2 > 0.0 else np.nan
            sums2 = both(sums2, meet(lines, i + SET, line, start, stop, counts))
    add(task.tally, 0, sums)
    if counts.second is not None:
        add(task.tally, 1, sums2)


@inner()
def sweep_lists(task: Task, lists: Lists) -> None:
    """Sweep the lines of a strip over their lists, tally the gaps and empty the lists."""
    lines, stop, count = task.lines, lists.stop, task.strip.rows * task.strip.pitch
    chords = 0
    for begin in range(0, count, ABREAST):
        place = first_place(begin)
        first, last = 0, min(ABREAST, count - begin)
        for k in range(first, last):
            i = np.uint64(begin + k)
            is_line = lines[i + END] == lines[i + END]
            chords += (stop[begin + k] - place) // NEXT if is_line else 0
        while True:
            # drop lines at either end that have no more chords, until none is left
            while first < last and stop[begin + first] <= place + first:
                first += 1
            while first < last and stop[begin + last - 1] <= place + last - 1:
                last -= 1
            if first == last:
                break
            skipped = first // LANES * LANES
            at, chord = np.uint64(begin + skipped), np.uint64(place + skipped)
            vectors = np.uint64((last - skipped + LANES - 1) // LANES)
            sweep_abreast(task, lists, at, chord, vectors)
            place += NEXT
        for line in range(begin, min(begin + ABREAST, count)):
            stop[line] = first_place(line)
    task.tally[0, CHORDS] += chords


@inner(forceinline=True, error_model="numpy")
def list_settled(
    task: Task,
    k: np.uint64,
    line: Line,
    chord: Chord,
    state: State,
    gaps: FloatArray,
    count: np.uint64,
) -> tuple[State, np.uint64]:
    """
    Let a line meet a chord, and list the gap that this settles.

    ``k`` is where the line's state begins. Returns the new state and the number of listed gaps. A
    chord of NaN settles no gap.
    """
    lines, counts = task.lines, task.counts
    (start, stop), (end, low, high), (_, _, enters, leaves) = chord, state, line
    first, is_met = low, is_listed(start, enters, counts)
    if counts.window is not None and counts.window.start is not None:
        met_beyond(lines, k, start, stop, enters, leaves)
        is_met = reaches_in(start, stop, enters, leaves)
        first = begins_at(low, lines[k + BEFORE])
    if is_met:
        # written in any case, as chords are
        list_gap(gaps, count, line, first, high, counts)
        count += np.uint64((start > end) & (high - first >= counts.least))
        state = moved(start, stop, end, low, high)
    return state, count


@inner(error_model="numpy")
def bin_lists(task: Task, lists: Lists) -> None:
    """Sweep the lines of a strip over their lists, put the gaps in bins and empty the lists."""
    lines, strip, counts, stops = task.lines, task.strip, task.counts, lists.stop
    gaps, gaps2, met = room_for_gaps(TOGETHER), room_for_gaps(TOGETHER), 0
    for row in range(strip.rows):
        v, count, count2 = strip.first_v + row * strip.spacing, np.uint64(0), np.uint64(0)
        for column in range(strip.columns):
            number = row * strip.pitch + column
            i, i2 = np.uint64(number), np.uint64(number) + SET
            line = strip.first_u + column * strip.spacing, v, lines[i + ENTRY], lines[i + EXIT]
            state = lines[i + END], lines[i + GAP_START], lines[i + GAP_END]
            state2 = lines[i2 + END], lines[i2 + GAP_START], lines[i2 + GAP_END]
            for place in range(first_place(number), stops[i], NEXT):
                depth, reach2 = (
                    lists.chords[np.uint64(place)],
                    lists.chords[np.uint64(place + ABREAST)],
                )
                half_chord = np.sqrt(abs(reach2))
                chord = depth - half_chord, depth + half_chord
                state, count = list_settled(task, i, line, chord, state, gaps, count)
                if counts.second is not None and reach2 > 0.0:
                    state2, count2 = list_settled(task, i2, line, chord, state2, gaps2, count2)
            lines[i + END], lines[i + GAP_START], lines[i + GAP_END] = state
            if counts.second is not None:
                lines[i2 + END], lines[i2 + GAP_START], lines[i2 + GAP_END] = state2
            met += (stops[i] - first_place(number)) // NEXT
            stops[i] = first_place(number)
            if count >= ALMOST or count2 >= ALMOST or column == strip.columns - 1:
                add_gaps(task.bins, counts, gaps, count, 1.0, ZERO, v)
                add_gaps(task.bins, counts, gaps2, count2, 1.0, ONE, v)
                count = count2 = np.uint64(0)
    task.tally[0, CHORDS] += met


@part()
def bin_last_gaps(task: Task, which: int) -> None:
    """Put the last gap of each line, and the void behind its last solid, in bins."""
    lines, strip, counts = task.lines, task.strip, task.counts
    gaps = room_for_gaps(2 * strip.columns)
    for row in range(strip.rows):
        v, count = strip.first_v + row * strip.spacing, 0
        for column in range(strip.low[row], strip.high[row]):
            i = np.uint64(row * strip.pitch + column)
            k = i + SET * np.uint64(which)
            end, first, behind = lines[k + END], lines[k + GAP_START], FAR
            line = strip.first_u + column * strip.spacing, v, lines[i + ENTRY], lines[i + EXIT]
            if counts.window is not None and counts.window.start is not None:
                first, behind = begins_at(first, lines[k + BEFORE]), lines[k + BEHIND]
            for low, high in ((first, lines[k + GAP_END]), (end, behind)):
                list_gap(gaps, count, line, low, high, counts)
                # void behind the last solid counts only in the window
                count += (high - low > 0.0) & ((high < FAR) | (low < line[3]))
        add_gaps(task.bins, counts, gaps, np.uint64(count), 1.0, which, v)


@inner()
def closed_lines(task: Task, which: int) -> tuple[IntArray, IntArray]:
    """The number of closed lines before each place of a strip, and the places of closed lines."""
    lines, state, closed = task.lines, SET * np.uint64(which), 0
    places = task.strip.rows * task.strip.pitch
    for i in range(np.uint64(places)):
        closed += lines[i + state + END] == FAR
    places = places if closed else 0  # most strips have none
    first, place_of = np.zeros(places + 1, np.int64), np.empty(closed, np.int64)
    count = 0
    for place in range(first.size - 1):
        if lines[np.uint64(place) + state + END] == FAR:
            place_of[count] = place
            count += 1
        first[place + 1] = count
    return first, place_of


@part(error_model="numpy")
def chords_of(
    task: Task, spheres: Spheres, chosen: IntArray, which: int, first: IntArray, place_of: IntArray
) -> tuple[FloatArray, IntArray]:
    """
    Find the chords of closed lines, in the order of their spheres' depths.

    Returns where each chord starts and stops and, as a third row, the number of the line's chord
    before it, shape (3, M); and the number of each line's last chord. Behind a line's first chord
    comes -1.
    """
    strip, met = task.strip, 0
    chords, last = np.empty((3, SOME)), np.full(place_of.size, -1)
    for k in chosen:
        sphere = sphere_at(spheres, k)
        rows = span(sphere.v, sphere.radius, strip.first_v, strip.per_spacing, 0, strip.rows)
        columns = span(sphere.u, sphere.radius, strip.first_u, strip.per_spacing, 0, strip.columns)
        if columns[0] >= columns[1] or (which == 1 and spheres.removed[k]):
            continue
        for row in range(rows[0], rows[1]):
            dv = strip.first_v + row * strip.spacing - sphere.v
            reach2 = sphere.radius * sphere.radius - dv * dv
            at = row * strip.pitch
            for line in range(first[at + columns[0]], first[at + columns[1]]):
                du = strip.first_u - sphere.u + (place_of[line] - at) * strip.spacing
                rest2 = reach2 - du * du
                if not rest2 >= 0.0:
                    continue
                if met == chords.shape[1]:
                    chords = np.concatenate((chords, np.empty_like(chords)), axis=1)
                half_chord = np.sqrt(rest2)
                chords[0, met] = sphere.depth - half_chord
                chords[1, met] = sphere.depth + half_chord
                chords[2, met], last[line] = last[line], met
                met += 1
    return chords, last


@part(error_model="numpy")
def sweep_again(
    task: Task, which: int, place: int, chords: FloatArray, order: IntArray, sign: float
) -> None:
    """Sweep one line afresh over its chords, in this order; sign -1 removes the settled gaps."""
    lines, strip, counts = task.lines, task.strip, task.counts
    i, gaps, count = np.uint64(place), room_for_gaps(order.size), np.uint64(0)
    k, (row, column) = i + SET * np.uint64(which), divmod(place, strip.pitch)
    enters, leaves = lines[i + ENTRY], lines[i + EXIT]
    u, v = strip.first_u + column * strip.spacing, strip.first_v + row * strip.spacing
    line = u, v, enters, leaves
    set_off(lines, k, enters, leaves, True, counts)
    state = lines[k + END], lines[k + GAP_START], lines[k + GAP_END]
    sums = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in order:
        start, stop = chords[0, j], chords[1, j]
        if task.bins.cutoffs.size > 0:
            state, count = list_settled(task, k, line, (start, stop), state, gaps, count)
        elif is_listed(start, enters, counts):
            sums = both(sums, meet(lines, k, line, start, stop, counts))
    if task.bins.cutoffs.size > 0:
        lines[k + END], lines[k + GAP_START], lines[k + GAP_END] = state
        add_gaps(task.bins, counts, gaps, count, sign, which, v)
    a, b, c, d, e, f = sums
    add(task.tally, which, (sign * a, sign * b, sign * c, sign * d, sign * e, sign * f))


@part()
def solve_closed(task: Task, spheres: Spheres, chosen: IntArray, which: int) -> None:
    """
    Sweep closed lines again, over their chords in the order of their starts.

    This is exact, since no chord can reach back. What the sweep by depth has counted is removed.
    """
    first, place_of = closed_lines(task, which)
    if place_of.size == 0:
        return
    chords, last = chords_of(task, spheres, chosen, which, first, place_of)
    order = np.empty(chords.shape[1], np.int64)
    for number in range(place_of.size):
        begin, k = order.size, last[number]
        while k >= 0:
            begin -= 1
            order[begin] = k
            k = np.int64(chords[2, k])
        sweep_again(task, which, place_of[number], chords, order[begin:], -1.0)
        sort_by(chords[0], order[begin:])
        sweep_again(task, which, place_of[number], chords, order[begin:], 1.0)
