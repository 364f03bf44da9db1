"""
The depth-ordered sweep: void segments on all scan lines of a strip, without any list.

The spheres are visited in the order of their centres along the direction. A chord's middle lies at
its sphere's depth, so on every line the chords arrive ordered by their middles, and three numbers a
line suffice: the running end of the solid, and the two ends of the last gap, which is not counted
yet. A chord that begins behind the running end settles the last gap and opens a new one; one that
begins earlier can only shorten the last gap. That is exact unless a chord reaches back past the
last gap: such a line is closed (its solid never ends), and is solved again from its list of chords.

What is counted is chosen by arguments that are None where they are not wanted, so that for each
choice the compiler makes a loop with nothing else in it:

``whole``     gaps as they are, between the first and the last solid of the line
``measured``  with ``whole``: only gaps that start in the line's measured length
``window``    gaps in the window, from where the line enters it to where it leaves it, by one of
              the rules of :mod:`scanfab.scan.kernels.edges`; lines that miss it carry NaN
``second``    all this again for a second set of solids, from which some spheres are removed

A gap that reaches FAR never counts in the whole.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import LANES, REORDERED, Flag, inner
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.edges import window_gap
from scanfab.scan.kernels.start import last_gap, met_beyond, reaches_in, settled_gap
from scanfab.scan.kernels.strips import (
    BEFORE,
    END,
    ENTRY,
    EXIT,
    FAR,
    GAP_END,
    GAP_START,
    SET,
    Edge,
    Sphere,
    Strip,
    columns_of_row,
    span,
)

Sums = tuple[float, float, float, float, float, float]

# the compiler leaves out what adds it: unlike 0, it changes no number, not even -0
NOTHING = -0.0
# entries of a tally, of the whole and, behind them, of the window; and the chords of all solids;
# and the lines that stay in a channel of a periodic medium, the steps of following lines, and the
# number of segments that leave the sample
LENGTH, KEPT, VOID, LINES, LINE_LENGTH = range(5)
WHOLE, WINDOW, CHORDS, CHANNELS, STEPS, LEFT = 0, 5, 10, 11, 12, 13
TALLY_SIZE = 14


class Measured(NamedTuple):
    """Of a line through a periodic medium, from where its measured length begins."""

    length: float
    """Gaps that begin in it count."""
    known: float
    """Chords that begin behind it may not be listed, and are left out."""


@inner(forceinline=True, error_model="numpy")
def whole_gap(
    low: float, high: float, least: float, enters: float, measured: Measured | None
) -> tuple[float, float, float]:
    """
    Length and number of a gap if it counts in the whole, and its length if it is too short.

    ``enters`` is where the line's measured length begins.
    """
    gap = high - low
    if measured is None:
        gap = gap if gap < 0.5 * FAR else 0.0
    else:
        # NaN: a place behind the last line
        gap = gap if low - enters >= 0.0 else 0.0
        gap = gap if low - enters < measured.length else 0.0
        gap = gap if gap < 0.5 * FAR else 0.0
    kept = gap >= least
    return gap if kept else 0.0, 1.0 if kept else 0.0, gap


@inner(forceinline=True, error_model="numpy")
def is_listed(start: float, enters: float, measured: Measured | None) -> bool:
    """Whether a chord begins where all of them are listed; others are left out."""
    known = True
    if measured is not None:
        known = start - enters < measured.known
    return known


@inner(forceinline=True, error_model="numpy")
def counted(
    settles: bool,
    low: float,
    high: float,
    least: float,
    enters: float,
    leaves: float,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> Sums:
    """What a gap adds to the tallies of the whole and of the window, if it is settled."""
    length = kept = void = NOTHING
    inside = inside_kept = inside_void = NOTHING
    # no gap is longer
    least = least if settles else 2.0 * FAR
    if whole is not None:
        length, kept, gap = whole_gap(low, high, least, enters, measured)
        if measured is not None:
            void = gap if settles else 0.0
    if window is not None:
        inside, inside_kept, gap = window_gap(low, high, least, enters, leaves, whole, window)
        inside_void = gap if settles else 0.0
    return length, kept, void, inside, inside_kept, inside_void


@inner(forceinline=True, error_model="numpy")
def moved(
    start: float, stop: float, end: float, low: float, high: float
) -> tuple[float, float, float]:
    """The state of a line after a chord; a chord of NaN leaves it as it is."""
    opens = start > end
    # the sum keeps the compiler from storing this with a mask, which is slow to read again
    low = (end if opens else low) + 0.0
    high = FAR if opens else high
    high = start if start < high else high
    end = stop if stop > end else end
    # a gap shortened to less than nothing: the chord reaches back past it
    return (FAR if high < low else end), low, high


@inner(forceinline=True, error_model="numpy")
def meet(
    lines: FloatArray,
    i: np.uint64,
    start: float,
    stop: float,
    least: float,
    enters: float,
    leaves: float,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> Sums:
    """
    Let the line whose state begins at a place meet a chord, and count the gap that this settles.

    A chord of NaN settles none, and leaves the line as it is.
    """
    end, low, high = lines[i + END], lines[i + GAP_START], lines[i + GAP_END]
    if window is not None and window.start is not None:
        if window.inside is None:
            met_beyond(lines, i, start, stop, enters, leaves)
            counts = reaches_in(start, stop, enters, leaves)
            start, stop = start if counts else np.nan, stop if counts else np.nan
        settles = start > end
        # no gap is longer
        a, b, c = settled_gap(low, high, lines[i + BEFORE], least if settles else 2.0 * FAR)
        sums = NOTHING, NOTHING, NOTHING, a, b, c if settles else 0.0
    else:
        sums = counted(start > end, low, high, least, enters, leaves, whole, window, measured)
    end, low, high = moved(start, stop, end, low, high)
    lines[i + END], lines[i + GAP_START], lines[i + GAP_END] = end, low, high
    return sums


@inner(forceinline=True, error_model="numpy")
def both(first: Sums, second: Sums) -> Sums:
    """The sums of two."""
    return (
        first[0] + second[0],
        first[1] + second[1],
        first[2] + second[2],
        first[3] + second[3],
        first[4] + second[4],
        first[5] + second[5],
    )


@inner(forceinline=True, fastmath=REORDERED, error_model="numpy")
def visit(
    lines: FloatArray,
    strip: Strip,
    sphere: Sphere,
    kept: float,
    least: float,
    tally: FloatArray,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> None:
    """
    Visit the chords that a sphere cuts from a strip, and tally the gaps that they settle.

    ``kept`` is NaN for a sphere that is not in the second set of solids, else NOTHING.

    The compiler makes vector instructions of the inner loop because rows are contiguous, indices
    cannot be negative, planes cannot overlap, and there are choices instead of branches.
    """
    sums = sums2 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    chords = 0.0
    radius, per_spacing = sphere.radius, strip.per_spacing
    rows = span(sphere.v, radius, strip.first_v, per_spacing, 0, strip.rows)
    columns = span(sphere.u, radius, strip.first_u, per_spacing, 0, strip.columns)
    from_u, from_v = strip.first_u - sphere.u, strip.first_v - sphere.v
    for row in range(rows[0], rows[1]):
        dv = from_v + row * strip.spacing
        reach2 = radius * radius - dv * dv
        first, met, cut = columns_of_row(strip, sphere, row, reach2, columns[0], columns[1])
        chords += cut
        # whole vectors, also beyond the last chord, where square roots are NaN
        vectors = (met + LANES - 1) // LANES
        first_du = from_u + first * strip.spacing
        at = np.uint64(row * strip.pitch + first)
        for j in range(np.uint64(vectors * LANES)):
            i = at + j
            du = first_du + strip.spacing * np.int32(j)
            half_chord = np.sqrt(reach2 - du * du)
            start = sphere.depth - half_chord
            stop = sphere.depth + half_chord
            enters, leaves = lines[i + ENTRY], lines[i + EXIT]
            known = is_listed(start, enters, measured)
            start, stop = start if known else np.nan, stop if known else np.nan
            found = meet(lines, i, start, stop, least, enters, leaves, whole, window, measured)
            sums = both(sums, found)
            if second is not None:
                start, stop = start + kept, stop + kept
                found = meet(
                    lines, i + SET, start, stop, least, enters, leaves, whole, window, measured
                )
                sums2 = both(sums2, found)
    tally[0, CHORDS] += chords
    add(tally, 0, sums)
    if second is not None:
        add(tally, 1, sums2)


@inner(inline="always")
def add(tally: FloatArray, which: int, sums: Sums) -> None:
    """Add sums over gaps to the tally of a set of solids, shape (2, TALLY_SIZE)."""
    tally[which, WHOLE + LENGTH] += sums[0]
    tally[which, WHOLE + KEPT] += sums[1]
    tally[which, WHOLE + VOID] += sums[2]
    tally[which, WINDOW + LENGTH] += sums[3]
    tally[which, WINDOW + KEPT] += sums[4]
    tally[which, WINDOW + VOID] += sums[5]


@inner(fastmath=REORDERED, error_model="numpy")
def settle(
    lines: FloatArray,
    strip: Strip,
    which: int,
    least: float,
    tally: FloatArray,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> float:
    """
    Tally every line's last gap, and in the window the void behind its last solid.

    Returns the number of closed lines, of which nothing is tallied here but that they are there.
    """
    a = b = c = d = e = f = 0.0
    met = length = closed = 0.0
    crossing = np.int64(0)
    state = SET * np.uint64(which)
    for i in range(np.uint64(strip.rows * strip.pitch)):
        k = i + state
        end, low, high = lines[k + END], lines[k + GAP_START], lines[k + GAP_END]
        enters, leaves = lines[i + ENTRY], lines[i + EXIT]
        closed += 1.0 if end == FAR else 0.0
        if window is not None and window.start is not None:
            at_most = least if end < FAR else 2.0 * FAR
            x, y, z = settled_gap(low, high, lines[k + BEFORE], at_most)
            sums = NOTHING, NOTHING, NOTHING, x, y, z if end < FAR else 0.0
        else:
            sums = counted(end < FAR, low, high, least, enters, leaves, whole, window, measured)
        a, b, c = a + sums[0], b + sums[1], c + sums[2]
        d, e, f = d + sums[3], e + sums[4], f + sums[5]
        if window is not None:
            start = end if end < FAR else leaves
            if window.start is not None:
                behind = last_gap(lines, k, least, enters, leaves, window)
            else:
                behind = window_gap(start, FAR, least, enters, leaves, whole, window)
            d, e, f = d + behind[0], e + behind[1], f + behind[2]
            crossing += np.int64(leaves > enters)
            length += leaves - enters if leaves > enters else 0.0
        if whole is not None:
            met += 1.0 if end > -FAR else 0.0
            if measured is not None:
                crossing += np.int64(enters < FAR)
    add(tally, which, (a, b, c, d, e, f))
    if whole is not None:
        tally[which, WHOLE + LINES] += met
    if measured is not None:
        tally[which, WHOLE + LINE_LENGTH] += crossing * measured.length
    if window is not None:
        tally[which, WINDOW + LINES] += crossing
        tally[which, WINDOW + LINE_LENGTH] += length
    return closed
