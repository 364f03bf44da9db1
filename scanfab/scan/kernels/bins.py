"""
Void segments one by one: sorted by the block of their middle and by cut-off, with their squares.

Sums over all segments above one cut-off cannot tell this.
"""

from __future__ import annotations

import numpy as np

from scanfab.base.jit import inner, part
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.strips import FAR, Bins, Counts, Line, Partition
from scanfab.scan.kernels.sweep import begins_in, listed_to

# sums over the gaps of a block and bin
NUMBER, LENGTH, SQUARE = range(3)
# kinds of gaps: those of the whole sample and those of the window
OF_WHOLE, OF_WINDOW = 0, 1
# Rows of a list of gaps. LINE_U is the line's place along u. A gap runs from GAP_LOW to GAP_HIGH,
# COUNTED is its length if it counts, PLACE is its bin: each has a row for the whole and, behind it,
# a row for the window. For rules that weigh segments, LOW_END and HIGH_END are a half for an end in
# the window, and FULL is the full length of a gap that is followed beyond the window.
LINE_U, GAP_LOW, GAP_HIGH, COUNTED, PLACE = 0, 1, 3, 5, 7
LOW_END, HIGH_END, FULL = 9, 10, 11


def no_bins(axes: int) -> Bins:
    """Bins without a cut-off: with them a kernel is compiled once, whether it uses bins or not."""
    sums = np.zeros((axes, 2, 2, 0, 3))
    numbers = np.zeros((2, 3, 4)), np.ones((2, 4)), np.ones((2, 3)), np.zeros((2, 6))
    return Bins(Partition(*numbers, True), np.zeros(0), sums)


@part()
def bins_along(bins: Bins, triad: FloatArray, axis: int) -> Bins:
    """The bins of an axis, for places u, v, depth in its triad."""
    of = bins.partition
    to_block = of.to_block.copy()
    for kind in range(2):
        for i in range(3):
            for j in range(3):
                to_block[kind, i, j] = 0.0
                for k in range(3):
                    to_block[kind, i, j] += of.to_block[kind, i, k] * triad[j, k]
    turned = Partition(to_block, of.parts, of.repeats, of.form, of.halves)
    return Bins(turned, bins.cutoffs, bins.sums[axis])


@part()
def room_for_gaps(count: int) -> FloatArray:
    """Room for a list of so many gaps, for :func:`list_gap` and :func:`add_gaps`."""
    # rows a power of two apart would evict one another from the processor's first cache
    return np.empty((12, count + 24))


@inner(forceinline=True, error_model="numpy")
def list_gap(
    gaps: FloatArray, k: int | np.uint64, line: Line, low: float, high: float, counts: Counts
) -> None:
    """List a gap as number k, unclipped and clipped to the window; NaN if it does not count."""
    u, _, enters, leaves = line
    gaps[LINE_U, k] = u
    if counts.whole is not None:
        gaps[GAP_LOW + OF_WHOLE, k] = low
        gaps[GAP_HIGH + OF_WHOLE, k] = high
        if counts.measured is not None and not begins_in(low, enters, counts.measured):
            gaps[GAP_HIGH + OF_WHOLE, k] = np.nan
    if counts.window is not None:
        gaps[GAP_LOW + OF_WINDOW, k] = low if low > enters else enters
        gaps[GAP_HIGH + OF_WINDOW, k] = high if high < leaves else leaves
        gaps[LOW_END, k] = 0.5 if low > enters else 0.0
        gaps[HIGH_END, k] = 0.5 if high < leaves else 0.0
        if counts.window.start is not None:
            # those that end beyond the listed solids are followed
            known = high < leaves + listed_to(counts.window)
            gaps[FULL, k] = high - low if known & (low < leaves) & (high > enters) else 0.0


@inner(inline="always")
def upper_half(x: float) -> float:
    """1 where a coordinate lies in the upper half of its period of 1, else 0."""
    return 1.0 if x - np.floor(x) >= 0.5 else 0.0


@inner(inline="always")
def part_of(x: float, parts: float) -> float:
    """Number of the part of 0 to 1 that holds a coordinate; any part if it lies outside."""
    part = np.floor(x * parts)
    # Rounding turns a coordinate just below 0 into 1, a whole period. NaN, from a line that misses
    # the window, needs some valid part as well.
    part = part if part < parts - 1.0 else parts - 1.0
    return part if part > 0.0 else 0.0


@inner(error_model="numpy")
def find_bins(
    bins: Bins,
    counts: Counts,
    gaps: FloatArray,
    count: np.uint64,
    kind: int | np.uint64,
    v: float,
    rows: tuple[np.uint64, np.uint64],
) -> None:
    """
    Find the lengths of gaps on a row of lines, 0 if they do not count, and their bins.

    The bin is that of the middle between the places in two ``rows`` of the list: both ends of the
    gap, or one end twice.
    """
    cutoffs, of = bins.cutoffs, bins.partition
    to_block, parts = of.to_block[kind], of.parts[kind]
    repeats, form = of.repeats[kind], of.form[kind]
    x_u, y_u, z_u = to_block[0, 0], to_block[1, 0], to_block[2, 0]
    x_n, y_n, z_n = to_block[0, 2], to_block[1, 2], to_block[2, 2]
    x_v = to_block[0, 1] * v + to_block[0, 3]
    y_v = to_block[1, 1] * v + to_block[1, 3]
    z_v = to_block[2, 1] * v + to_block[2, 3]
    in_x, in_y, in_z, shells = parts[0], parts[1], parts[2], parts[3]
    by_x, by_y, by_z = repeats[0], repeats[1], repeats[2]
    xx, yy, zz, xy, xz, yz = form[0], form[1], form[2], form[3], form[4], form[5]
    lows, highs = gaps[rows[0]], gaps[rows[1]]
    lengths, places = gaps[COUNTED + kind], gaps[PLACE + kind]
    for k in range(count):
        u, low, high = gaps[LINE_U, k], lows[k], highs[k]
        length = high - low
        middle = 0.5 * (low + high)
        x = x_v + x_u * u + x_n * middle
        y = y_v + y_u * u + y_n * middle
        z = z_v + z_u * u + z_n * middle
        is_inside = True
        if of.halves is not None:
            block = upper_half(x) + 2.0 * upper_half(y) + 4.0 * upper_half(z)
        else:
            x, y, z = x - by_x * np.floor(x), y - by_y * np.floor(y), z - by_z * np.floor(z)
            block = part_of(x, in_x) + in_x * (part_of(y, in_y) + in_y * part_of(z, in_z))
            x, y, z = x - 0.5, y - 0.5, z - 0.5
            square = x * (xx * x + xy * y + xz * z) + y * (yy * y + yz * z) + zz * z * z
            distance = np.sqrt(square if square > 0.0 else 0.0)
            block += in_x * in_y * in_z * part_of(distance, shells)
            is_inside = (abs(x) <= 0.5) & (abs(y) <= 0.5) & (abs(z) <= 0.5) & (distance <= 1.0)
        if counts.window is not None and counts.window.start is not None:
            length = gaps[FULL, k]
        is_kept = (length > 0.0) & (length >= cutoffs[0]) & (length < 0.5 * FAR) & is_inside
        lengths[k] = length if is_kept else 0.0
        places[k] = block * cutoffs.size
    for number in range(1, cutoffs.size):
        for k in range(count):
            places[k] += 1.0 if lengths[k] >= cutoffs[number] else 0.0


@inner(error_model="numpy")
def add_ends(
    bins: Bins,
    counts: Counts,
    gaps: FloatArray,
    count: np.uint64,
    sign: float,
    which: int,
    v: float,
) -> None:
    """
    Add the first gaps of a list, one half to the block of each end that is in the window.

    By the rule ``start`` a segment counts by its ends. By the middle of its part inside, long
    segments would go to the blocks at the window's surface.
    """
    sums, of, kind = bins.sums, np.uint64(which), np.uint64(OF_WINDOW)
    for end in range(2):
        row = np.uint64(GAP_LOW + OF_WINDOW if end == 0 else GAP_HIGH + OF_WINDOW)
        weights = gaps[np.uint64(LOW_END + end)]
        find_bins(bins, counts, gaps, count, kind, v, (row, row))
        for k in range(count):
            length = gaps[np.uint64(COUNTED) + kind, k]
            place = np.uint64(gaps[np.uint64(PLACE) + kind, k])
            number = sign * weights[k] if length > 0.0 else 0.0
            sums[kind, of, place, NUMBER] += number
            sums[kind, of, place, LENGTH] += number * length
            sums[kind, of, place, SQUARE] += number * length * length


@inner(error_model="numpy")
def add_gaps(
    bins: Bins,
    counts: Counts,
    gaps: FloatArray,
    count: np.uint64,
    sign: float,
    which: int,
    v: float,
) -> None:
    """Add the first gaps of a list, all on one row of lines, to the bins; sign -1 removes them."""
    window = counts.window
    if window is not None and window.start is not None and bins.partition.halves is None:
        add_ends(bins, counts, gaps, count, sign, which, v)
        return
    first = np.uint64(OF_WINDOW if counts.whole is None else OF_WHOLE)
    last = np.uint64(OF_WHOLE if window is None else OF_WINDOW) + np.uint64(1)
    for kind in range(first, last):
        rows = np.uint64(GAP_LOW) + kind, np.uint64(GAP_HIGH) + kind
        find_bins(bins, counts, gaps, count, kind, v, rows)
    sums, of = bins.sums, np.uint64(which)
    for k in range(count):
        # whole and window in turns, since a gap must wait for the one before it if they share a bin
        for kind in range(first, last):
            length = gaps[np.uint64(COUNTED) + kind, k]
            place = np.uint64(gaps[np.uint64(PLACE) + kind, k])
            number = sign if length > 0.0 else 0.0
            weighted, last_sum = number, number * length * length
            if window is not None and window.start is not None:
                number *= gaps[LOW_END, k] + gaps[HIGH_END, k]
                weighted, last_sum = number, number * length * length
            if window is not None and window.ends is not None:
                # squares of lengths inside mean nothing: their place takes the number of kept gaps
                weighted, last_sum = number * (gaps[LOW_END, k] + gaps[HIGH_END, k]), number
            sums[kind, of, place, NUMBER] += weighted
            sums[kind, of, place, LENGTH] += number * length
            sums[kind, of, place, SQUARE] += last_sum
