"""
The depth-ordered sweep: void segments on all scan lines of a strip, without lists of chords.

Spheres are visited in the order of their centres along the direction. A chord's middle lies at its
sphere's depth, so on every line the chords arrive ordered by their middles. Three numbers per line
are enough: the running end of the solid, and the two ends of the last gap, which is not counted
yet. A chord that begins behind the running end settles the last gap and opens a new one. A chord
that begins earlier can only shorten the last gap. This is exact unless a chord reaches back past
the last gap. Such a line is closed (its solid never ends), and is solved again from a list of its
chords.

What is counted is chosen by the fields of :class:`scanfab.scan.kernels.strips.Counts`:

``whole``     gaps as they are, between the first and the last solid of the line
``measured``  with ``whole``: only gaps that start in the line's measured length
``window``    gaps in the window, from where the line enters it to where it leaves it, by one of
              the edge rules below; lines that miss it carry NaN
``second``    the same for a second set of solids, from which some spheres are removed

In the whole, a gap that reaches FAR never counts.

A line is inside the window from ``enters`` to ``leaves``. A segment [low, high] on it adds a length
and a number to the sums of its direction. L = high - low is its full length, I is the length of its
part inside, and c is the cut-off. e is the number of its ends inside (0, 1 or 2); a place at which
the window cuts it is no end::

    rule    counts if   length                number
    clip    I >= c      I                     1
    start   L >= c      L e/2                 e/2
    ends    I >= c      (I - c) + c e/2       e/2

The mean length is the ratio of the sums; for ``ends`` it is c + Σ (I - c) / Σ e/2, as one ratio.

By ``start``, only chords that reach into the window change a line. Of the other chords a line keeps
the end of the last solid before the window and the beginning of the first solid behind it: there
its first segment begins and its last segment ends. The former is kept with a minus, so that both
are found as a minimum, whatever the order of the chords. Solids are listed up to a margin beyond
the window. A line that meets none there keeps the margin's end, and is followed further
(:mod:`scanfab.scan.kernels.cells`).
"""

from __future__ import annotations

import numpy as np

from scanfab.base.jit import LANES, REORDERED, inner
from scanfab.base.typing import FloatArray
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
    Counts,
    Edge,
    Line,
    Measured,
    Sphere,
    Task,
    columns_of_row,
    span,
)

Sums = tuple[float, float, float, float, float, float]

# Adding -0 changes no number, not even -0 itself, so the compiler drops the addition.
NOTHING = -0.0
# Entries of a tally: six sums of the whole and, behind them, of the window; then the chords of all
# solids, and the steps of following lines. ASTRAY counts lines of the whole that stay in a channel
# of a periodic medium, and segments of the window that leave the sample.
LENGTH, KEPT, VOID, LINES, LINE_LENGTH, ASTRAY = range(6)
WHOLE, WINDOW, CHORDS, STEPS = 0, 6, 12, 13
TALLY_SIZE = 14
# Segments that reach this fraction of the margin are followed: rounding at its end has no effect.
NEARLY = 1.0 - 1e-6


@inner(forceinline=True, error_model="numpy")
def ends_inside(low: float, high: float, enters: float, leaves: float) -> float:
    """Half the number of ends that lie in the window, for a segment with a part in it."""
    return (0.5 if low > enters else 0.0) + (0.5 if high < leaves else 0.0)


@inner(forceinline=True, error_model="numpy")
def listed_to(edge: Edge) -> float:
    """Distance beyond the window from which on solids may not be listed."""
    return edge.margin * NEARLY


@inner(forceinline=True, error_model="numpy")
def is_listed(start: float, enters: float, counts: Counts) -> bool:
    """Whether a chord begins where all chords are listed; other chords are left out."""
    known = True
    if counts.measured is not None:
        known = start - enters < counts.measured.known
    return known


@inner(forceinline=True, error_model="numpy")
def begins_in(low: float, enters: float, measured: Measured) -> bool:
    """Whether a gap begins in the measured length of its line; False for NaN, that is no line."""
    return (low - enters >= 0.0) & (low - enters < measured.length)


@inner(forceinline=True, error_model="numpy")
def whole_gap(
    low: float, high: float, least: float, enters: float, counts: Counts
) -> tuple[float, float, float]:
    """Length and number that a gap adds to the sums of the whole, and its length, kept or not."""
    gap = high - low
    if counts.measured is not None:
        gap = gap if begins_in(low, enters, counts.measured) else 0.0
    gap = gap if gap < 0.5 * FAR else 0.0
    kept = gap >= least
    return gap if kept else 0.0, 1.0 if kept else 0.0, gap


@inner(forceinline=True, error_model="numpy")
def window_gap(
    low: float, high: float, least: float, enters: float, leaves: float, counts: Counts, edge: Edge
) -> tuple[float, float, float]:
    """Length and number that a gap adds to the window's sums, and the length of its part inside."""
    last = high if high < leaves else leaves
    first = low
    if counts.whole is not None or edge.start is not None:
        # otherwise no line begins before the window
        first = low if low > enters else enters
    inside = last - first
    void = inside if inside > 0.0 else 0.0
    length, kept, weight = inside, inside >= least, 1.0
    if edge.ends is None and edge.start is None:
        # a window without an end ends no gap
        kept &= inside < 0.5 * FAR
    if edge.ends is not None:
        weight = ends_inside(low, high, enters, leaves)
        length = inside - least + weight * least
    if edge.start is not None:
        weight = ends_inside(low, high, enters, leaves)
        length = weight * (high - low)
        # other segments are followed
        known = (high < leaves + listed_to(edge)) & (high - low < 0.5 * FAR)
        kept = (inside > 0.0) & (high - low >= least) & known
    return length if kept else 0.0, weight if kept else 0.0, void


@inner(forceinline=True, error_model="numpy")
def counted(
    settles: bool, low: float, high: float, enters: float, leaves: float, counts: Counts
) -> Sums:
    """What a gap adds to the tallies of the whole and of the window, if it is settled."""
    length = kept = void = NOTHING
    inside = inside_kept = inside_void = NOTHING
    # no gap is as long as that
    least = counts.least if settles else 2.0 * FAR
    if counts.whole is not None:
        length, kept, gap = whole_gap(low, high, least, enters, counts)
        if counts.measured is not None:
            void = gap if settles else 0.0
    if counts.window is not None:
        edge = counts.window
        inside, inside_kept, gap = window_gap(low, high, least, enters, leaves, counts, edge)
        inside_void = gap if settles else 0.0
    return length, kept, void, inside, inside_kept, inside_void


@inner(forceinline=True, error_model="numpy")
def moved(
    start: float, stop: float, end: float, low: float, high: float
) -> tuple[float, float, float]:
    """The state of a line after a chord; a chord of NaN leaves it as it is."""
    opens = start > end
    # adding 0 keeps the compiler from a masked store, which is slow to read again
    low = (end if opens else low) + 0.0
    high = FAR if opens else high
    high = start if start < high else high
    end = stop if stop > end else end
    # a gap shortened to less than nothing: the chord reaches back past it
    return (FAR if high < low else end), low, high


@inner(forceinline=True, error_model="numpy")
def met_beyond(
    lines: FloatArray, i: np.uint64, start: float, stop: float, enters: float, leaves: float
) -> None:
    """Update the solids beyond the window that a line keeps; a chord of NaN changes nothing."""
    before, behind = lines[i + BEFORE], lines[i + BEHIND]
    place = -stop if start <= enters else before
    lines[i + BEFORE] = place if place < before else before
    place = start if start >= leaves else behind
    lines[i + BEHIND] = place if place < behind else behind


@inner(forceinline=True, error_model="numpy")
def reaches_in(start: float, stop: float, enters: float, leaves: float) -> bool:
    """Whether a chord has a part in the window."""
    return (stop > enters) & (start < leaves)


@inner(forceinline=True, error_model="numpy")
def begins_at(low: float, before: float) -> float:
    """Where a gap begins; a line's first gap begins at the last solid before the window."""
    return low if low > -before else -before


@inner(forceinline=True, error_model="numpy")
def settled_gap(settles: bool, low: float, high: float, before: float, counts: Counts) -> Sums:
    """
    What a gap that ends in the window adds by the rule ``start``, if it is settled.

    The void of a first gap includes its part before the window, which :func:`last_gap` subtracts.
    """
    length = high - begins_at(low, before)
    weight = 0.5 if low < -before else 1.0
    # no gap is as long as that
    kept = length >= (counts.least if settles else 2.0 * FAR)
    void = length if length > 0.0 else 0.0
    inside = weight * length if kept else 0.0, weight if kept else 0.0, void if settles else 0.0
    return NOTHING, NOTHING, NOTHING, inside[0], inside[1], inside[2]


@inner(forceinline=True, error_model="numpy")
def last_gap(
    lines: FloatArray, i: np.uint64, enters: float, leaves: float, counts: Counts, edge: Edge
) -> tuple[float, float, float]:
    """
    Length and number that the void behind a line's last solid adds, and its length in the window.

    By the rule ``start``, the latter is without the part of the first gap before the window.
    """
    end = lines[i + END]
    if edge.start is None:
        return window_gap(end, FAR, counts.least, enters, leaves, counts, edge)
    before, behind = lines[i + BEFORE], lines[i + BEHIND]
    length = behind - end
    is_met = end > -FAR
    ends_beyond = is_met & (end < leaves) & (behind < leaves + listed_to(edge))
    kept = ends_beyond & (length >= counts.least)
    void = leaves - (end if end > -FAR else enters)
    void = void if void > 0.0 else 0.0
    outside = enters + before if is_met else 0.0
    void -= outside if outside > 0.0 else 0.0
    return 0.5 * length if kept else 0.0, 0.5 if kept else 0.0, void


@inner(forceinline=True, error_model="numpy")
def meet(
    lines: FloatArray, i: np.uint64, line: Line, start: float, stop: float, counts: Counts
) -> Sums:
    """
    Let a line, whose state begins at place i, meet a chord, and count the gap that this settles.

    A chord of NaN settles no gap and leaves the line as it is.
    """
    _, _, enters, leaves = line
    end, low, high = lines[i + END], lines[i + GAP_START], lines[i + GAP_END]
    if counts.window is not None and counts.window.start is not None:
        met_beyond(lines, i, start, stop, enters, leaves)
        counts_here = reaches_in(start, stop, enters, leaves)
        start, stop = start if counts_here else np.nan, stop if counts_here else np.nan
        sums = settled_gap(start > end, low, high, lines[i + BEFORE], counts)
    else:
        sums = counted(start > end, low, high, enters, leaves, counts)
    end, low, high = moved(start, stop, end, low, high)
    lines[i + END], lines[i + GAP_START], lines[i + GAP_END] = end, low, high
    return sums


@inner(forceinline=True, error_model="numpy")
def both(first: Sums, second: Sums) -> Sums:
    """Add two sets of sums."""
    return (
        first[0] + second[0],
        first[1] + second[1],
        first[2] + second[2],
        first[3] + second[3],
        first[4] + second[4],
        first[5] + second[5],
    )


@inner(inline="always")
def add(tally: FloatArray, which: int, sums: Sums) -> None:
    """Add sums over gaps to the tally of a set of solids, shape (2, TALLY_SIZE)."""
    tally[which, WHOLE + LENGTH] += sums[0]
    tally[which, WHOLE + KEPT] += sums[1]
    tally[which, WHOLE + VOID] += sums[2]
    tally[which, WINDOW + LENGTH] += sums[3]
    tally[which, WINDOW + KEPT] += sums[4]
    tally[which, WINDOW + VOID] += sums[5]


@inner(forceinline=True, fastmath=REORDERED, error_model="numpy")
def visit(task: Task, sphere: Sphere, kept: float) -> None:
    """
    Visit the chords that a sphere cuts from a strip, and tally the gaps that they settle.

    ``kept`` is NaN for a sphere that is not in the second set of solids, otherwise NOTHING.

    The compiler turns the inner loop into vector instructions, because rows are contiguous, indices
    cannot be negative, planes cannot overlap, and selections take the place of branches.
    """
    lines, strip, counts = task.lines, task.strip, task.counts
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
        # whole vectors, also behind the last chord, where square roots are NaN
        vectors = (met + LANES - 1) // LANES
        first_du = from_u + first * strip.spacing
        at = np.uint64(row * strip.pitch + first)
        for j in range(np.uint64(vectors * LANES)):
            i = at + j
            du = first_du + strip.spacing * np.int32(j)
            half_chord = np.sqrt(reach2 - du * du)
            start = sphere.depth - half_chord
            stop = sphere.depth + half_chord
            line = 0.0, 0.0, lines[i + ENTRY], lines[i + EXIT]
            known = is_listed(start, lines[i + ENTRY], counts)
            start, stop = start if known else np.nan, stop if known else np.nan
            sums = both(sums, meet(lines, i, line, start, stop, counts))
            if counts.second is not None:
                start, stop = start + kept, stop + kept
                sums2 = both(sums2, meet(lines, i + SET, line, start, stop, counts))
    task.tally[0, CHORDS] += chords
    add(task.tally, 0, sums)
    if counts.second is not None:
        add(task.tally, 1, sums2)


@inner(fastmath=REORDERED, error_model="numpy")
def settle(task: Task, which: int) -> None:
    """Tally the last gap of each line and, in the window, the void behind its last solid."""
    lines, strip, tally = task.lines, task.strip, task.tally
    counts = task.counts
    sums = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    met = length = 0.0
    crossing = np.int64(0)
    state = SET * np.uint64(which)
    for i in range(np.uint64(strip.rows * strip.pitch)):
        k = i + state
        end, low, high = lines[k + END], lines[k + GAP_START], lines[k + GAP_END]
        enters, leaves = lines[i + ENTRY], lines[i + EXIT]
        if counts.window is not None and counts.window.start is not None:
            last = settled_gap(end < FAR, low, high, lines[k + BEFORE], counts)
        else:
            last = counted(end < FAR, low, high, enters, leaves, counts)
        sums = both(sums, last)
        if counts.window is not None:
            behind = last_gap(lines, k, enters, leaves, counts, counts.window)
            sums = both(sums, (0.0, 0.0, 0.0, behind[0], behind[1], behind[2]))
            crosses = leaves > enters
            if counts.whole is None and counts.window.start is None:
                # in a window without an end a line has to meet a solid
                crosses &= end > -FAR
            crossing += np.int64(crosses)
            length += leaves - enters if leaves > enters else 0.0
        if counts.whole is not None:
            met += 1.0 if end > -FAR else 0.0
            if counts.measured is not None:
                crossing += np.int64(enters < FAR)
    add(tally, which, sums)
    if counts.whole is not None:
        tally[which, WHOLE + LINES] += met
    if counts.measured is not None:
        tally[which, WHOLE + LINE_LENGTH] += crossing * counts.measured.length
    if counts.window is not None:
        tally[which, WINDOW + LINES] += crossing
        tally[which, WINDOW + LINE_LENGTH] += length
