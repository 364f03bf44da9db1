"""
The sweep over lists: chords are listed line by line, and lines are swept side by side.

Where lines are so far apart that a sphere meets few of them, rows of lines within a sphere are too
short for vector instructions. So the spheres, in the order of their depths, add their chords to the
lists of their lines, and the sweep takes the first chord of many lines, then the second, and so on.
The same lists serve where gaps are put in bins, line by line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import LANES, ONE, REORDERED, ZERO, Flag, inner
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.bins import (
    Bins,
    add_gaps,
    list_gap,
    room_for_gaps,
)
from scanfab.scan.kernels.projection import Spheres, sphere_at
from scanfab.scan.kernels.start import begins_at, met_beyond, reaches_in
from scanfab.scan.kernels.strips import (
    BEFORE,
    BEHIND,
    END,
    ENTRY,
    EXIT,
    FAR,
    GAP_END,
    GAP_START,
    SET,
    Edge,
    Strip,
    span,
)
from scanfab.scan.kernels.sweep import CHORDS, Measured, add, both, is_listed, meet, moved

# lines swept side by side; their lists lie together, first the first chord of each line
ABREAST = 64
# chords that a list has room for; as soon as one is in the second half, whose places have a bit of
# their own, all lists are swept
ROOM = 64
NEXT = 2 * ABREAST
TILE = ROOM * NEXT
SECOND_HALF = TILE // 2
# samples of ten thousand grains have one strip, mostly: to sort spheres into smaller ones, whose
# lists fit the second cache, takes longer than it saves
LISTED_LINES = 16_384
# more than nothing, and its square root too little to matter
LEAST_REACH2 = 1e-300
# gaps to be put in bins together
TOGETHER = 512
ALMOST = np.uint64(TOGETHER - ROOM)


class Lists(NamedTuple):
    """Of the lines of a strip, each a list of chords in the order of their spheres' depths."""

    chords: FloatArray
    """
    The depth of each chord's middle and, ABREAST places on, the square of half its length.

    That square is below 0 where the sphere is not in the second set of solids.
    """
    stop: IntArray
    """Place behind each line's last chord, shape (LISTED_LINES,)."""


@inner()
def room_for_lists(wanted: bool) -> Lists:
    """Empty lists, or none at all."""
    count = LISTED_LINES if wanted else 0
    lists = Lists(np.empty(count // ABREAST * TILE), np.empty(count, np.int64))
    for line in range(count):
        lists.stop[line] = first_place(line)
    return lists


@inner(inline="always")
def first_place(line: int) -> int:
    """Where the list of a line begins."""
    return line // ABREAST * TILE + line % ABREAST


@inner(fastmath=REORDERED, error_model="numpy")
def list_chords(lists: Lists, strip: Strip, spheres: Spheres, chosen: IntArray, done: int) -> int:
    """
    Add the chords that spheres cut from a strip, until some list is half full.

    Of the chosen spheres from number ``done`` on; returns the number of the next one.
    """
    # no array is handed on in the loop: to count its references would take longer than all else
    chords, stop, removed = lists.chords, lists.stop, spheres.removed
    spacing, per_spacing = strip.spacing, strip.per_spacing
    for number in range(done, chosen.size):
        k = np.uint64(chosen[np.uint64(number)])
        sphere = sphere_at(spheres, k)
        radius, depth = sphere.radius, sphere.depth
        sign = -1.0 if removed[k] else 1.0
        rows = span(sphere.v, radius, strip.first_v, per_spacing, 0, strip.rows)
        # of the widest row: to find those of each would take longer than the corners; and places
        # where no line is, at the ends of the strip's rows, get lists, too, of which nothing comes
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
                # listed anyhow, and overwritten if it is none: no branch to be guessed wrong
                chords[np.uint64(place)] = depth
                chords[np.uint64(place + ABREAST)] = sign * max(rest2, LEAST_REACH2)
                stop[at + j] = place + (NEXT if rest2 >= 0.0 else 0)
                seen |= place
        if seen & SECOND_HALF:
            return number + 1
    return int(chosen.size)


@inner(forceinline=True, fastmath=REORDERED, error_model="numpy")
def sweep_abreast(
    lines: FloatArray,
    lists: Lists,
    first: np.uint64,
    place: np.uint64,
    vectors: np.uint64,
    least: float,
    tally: FloatArray,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> None:
    """Let so many vectors of lines from the first on meet one chord each."""
    sums = sums2 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in range(np.uint64(vectors * LANES)):
        i, k = first + j, place + j
        depth, reach2 = lists.chords[k], lists.chords[k + np.uint64(ABREAST)]
        half_chord = np.sqrt(abs(reach2))
        half_chord = half_chord if np.int64(k) < lists.stop[i] else np.nan
        start, stop = depth - half_chord, depth + half_chord
        enters, leaves = lines[i + ENTRY], lines[i + EXIT]
        known = is_listed(start, enters, measured)
        start, stop = start if known else np.nan, stop if known else np.nan
        found = meet(lines, i, start, stop, least, enters, leaves, whole, window, measured)
        sums = both(sums, found)
        if second is not None:
            start = start if reach2 > 0.0 else np.nan
            stop = stop if reach2 > 0.0 else np.nan
            found = meet(
                lines, i + SET, start, stop, least, enters, leaves, whole, window, measured
            )
            sums2 = both(sums2, found)
    add(tally, 0, sums)
    if second is not None:
        add(tally, 1, sums2)


@inner()
def sweep_lists(
    lines: FloatArray,
    lists: Lists,
    strip: Strip,
    least: float,
    tally: FloatArray,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> None:
    """Sweep the lines of a strip over their lists, tally the gaps, and empty the lists."""
    stop = lists.stop
    count = strip.rows * strip.pitch
    chords = 0
    for begin in range(0, count, ABREAST):
        place = first_place(begin)
        first, last = 0, min(ABREAST, count - begin)
        for k in range(first, last):
            i = np.uint64(begin + k)
            is_line = lines[i + END] == lines[i + END]
            chords += (stop[begin + k] - place) // NEXT if is_line else 0
        while True:
            # lines at either end that have no more chords are left out, at last all
            while first < last and stop[begin + first] <= place + first:
                first += 1
            while first < last and stop[begin + last - 1] <= place + last - 1:
                last -= 1
            if first == last:
                break
            skipped = first // LANES * LANES
            these = (
                np.uint64(begin + skipped),
                np.uint64(place + skipped),
                np.uint64((last - skipped + LANES - 1) // LANES),
            )
            sweep_abreast(lines, lists, *these, least, tally, second, whole, window, measured)
            place += NEXT
        for line in range(begin, min(begin + ABREAST, count)):
            stop[line] = first_place(line)
    tally[0, CHORDS] += chords


@inner(forceinline=True, error_model="numpy")
def meets(
    lines: FloatArray,
    i: np.uint64,
    start: float,
    stop: float,
    enters: float,
    leaves: float,
    window: Edge | None,
    measured: Measured | None,
) -> bool:
    """Whether a line's state is moved on by a chord."""
    is_met = is_listed(start, enters, measured)
    if window is not None and window.start is not None:
        met_beyond(lines, i, start, stop, enters, leaves)
        is_met = reaches_in(start, stop, enters, leaves)
    return is_met


@inner(forceinline=True, error_model="numpy")
def begin_of(lines: FloatArray, i: np.uint64, low: float, window: Edge | None) -> float:
    """Where a line's last gap begins."""
    if window is not None and window.start is not None:
        low = begins_at(low, lines[i + BEFORE])
    return low


@inner(error_model="numpy")
def bin_lists(
    lines: FloatArray,
    lists: Lists,
    strip: Strip,
    least: float,
    tally: FloatArray,
    bins: Bins,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> None:
    """Sweep the lines of a strip over their lists, put the gaps in bins, and empty the lists."""
    chords, stops, met = lists.chords, lists.stop, 0
    gaps, gaps2 = room_for_gaps(TOGETHER), room_for_gaps(TOGETHER)
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        count = count2 = np.uint64(0)
        for column in range(strip.columns):
            u = strip.first_u + column * strip.spacing
            line = row * strip.pitch + column
            i, i2 = np.uint64(line), np.uint64(line) + SET
            enters, leaves = lines[i + ENTRY], lines[i + EXIT]
            end, low, high = lines[i + END], lines[i + GAP_START], lines[i + GAP_END]
            end2, low2, high2 = lines[i2 + END], lines[i2 + GAP_START], lines[i2 + GAP_END]
            for place in range(first_place(line), stops[i], NEXT):
                depth, reach2 = chords[np.uint64(place)], chords[np.uint64(place + ABREAST)]
                half_chord = np.sqrt(abs(reach2))
                start, stop = depth - half_chord, depth + half_chord
                is_met = meets(lines, i, start, stop, enters, leaves, window, measured)
                if second is not None and reach2 > 0.0:
                    meets(lines, i2, start, stop, enters, leaves, window, measured)
                if not is_met:
                    continue
                first = begin_of(lines, i, low, window)
                # listed anyhow, as chords are
                list_gap(gaps, count, u, first, high, enters, leaves, whole, window, measured)
                count += np.uint64((start > end) & (high - first >= least))
                end, low, high = moved(start, stop, end, low, high)
                if second is not None:
                    start = start if reach2 > 0.0 else np.nan
                    stop = stop if reach2 > 0.0 else np.nan
                    first = begin_of(lines, i2, low2, window)
                    list_gap(
                        gaps2, count2, u, first, high2, enters, leaves, whole, window, measured
                    )
                    count2 += np.uint64((start > end2) & (high2 - first >= least))
                    end2, low2, high2 = moved(start, stop, end2, low2, high2)
            lines[i + END], lines[i + GAP_START], lines[i + GAP_END] = end, low, high
            if second is not None:
                lines[i2 + END], lines[i2 + GAP_START], lines[i2 + GAP_END] = end2, low2, high2
            met += (stops[i] - first_place(line)) // NEXT
            stops[i] = first_place(line)
            if count >= ALMOST or count2 >= ALMOST or column == strip.columns - 1:
                add_gaps(bins, gaps, count, 1.0, ZERO, v, whole, window)
                add_gaps(bins, gaps2, count2, 1.0, ONE, v, whole, window)
                count = count2 = np.uint64(0)
    tally[0, CHORDS] += met


@inner()
def bin_last_gaps(
    lines: FloatArray,
    strip: Strip,
    which: int,
    bins: Bins,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> float:
    """
    Put every line's last gap, and the void behind its last solid, in bins.

    Returns the number of closed lines, of which there is nothing put.
    """
    closed = 0.0
    gaps = room_for_gaps(2 * strip.columns)
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        count = 0
        for column in range(strip.low[row], strip.high[row]):
            i = np.uint64(row * strip.pitch + column)
            k = i + SET * np.uint64(which)
            if lines[k + END] == FAR:
                closed += 1.0
                continue
            u, enters, leaves = (
                strip.first_u + column * strip.spacing,
                lines[i + ENTRY],
                lines[i + EXIT],
            )
            last = begin_of(lines, k, lines[k + GAP_START], window), lines[k + GAP_END]
            behind = FAR
            if window is not None and window.start is not None:
                behind = lines[k + BEHIND]
            for low, high in (last, (lines[k + END], behind)):
                list_gap(gaps, count, u, low, high, enters, leaves, whole, window, measured)
                # behind the last solid there is void in the window alone
                count += (high - low > 0.0) & ((high < FAR) | (low < leaves))
        add_gaps(bins, gaps, np.uint64(count), 1.0, which, v, whole, window)
    return closed
