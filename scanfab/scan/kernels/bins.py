"""
Void segments one by one: by the block of their middle and by cut-off, with their squares.

What sums for one cut-off cannot tell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import Flag, inner
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.edges import ends_inside, listed_to
from scanfab.scan.kernels.strips import FAR, Edge
from scanfab.scan.kernels.sweep import Measured

__all__ = [
    "LENGTH",
    "NUMBER",
    "OF_WHOLE",
    "OF_WINDOW",
    "SQUARE",
    "Bins",
    "add_gaps",
    "bins_along",
    "list_gap",
    "no_bins",
    "room_for_gaps",
]


# what is added up of the gaps of a block and bin
NUMBER, LENGTH, SQUARE = range(3)
# whose gaps they are
OF_WHOLE, OF_WINDOW = 0, 1
# of a list of gaps its rows: the line's place along u; where the gap starts in the whole and,
# behind that, in the window; likewise where it ends, its length if it counts, its bin. By the rules
# that weigh segments half the number of its ends in the window, and, where it is followed beyond,
# its full length
LINE_U, GAP_LOW, GAP_HIGH, COUNTED, PLACE = 0, 1, 3, 5, 7
WEIGHT, FULL = 9, 10


class Bins(NamedTuple):
    """What gaps are added to."""

    to_block: FloatArray
    """
    Affine maps of places to three coordinates, of whose periods of 1 equal parts are blocks.

    For the whole and the window, shape (2, 3, 4).
    """
    parts: FloatArray
    """How many parts of each, whole numbers, shape (2, 3)."""
    halves: Flag
    """True if all of these are 2: octants, which are found in less time."""
    cutoffs: FloatArray
    """
    In ascending order, shape (C,); a gap goes to the bin of the largest that it reaches.

    None at all: gaps are to be tallied instead.
    """
    sums: FloatArray
    """
    Number, length, squared length, shape (D, 2, 2, B * C, 3) with B blocks.

    Weighted by the rule at the window's surface; of ``ends`` half the number of ends, the length
    inside, and the number of those that are kept. For each axis, whole or window, and set of
    solids; without D those of one axis.
    """

    def of_whole(self, center: FloatArray) -> Bins:
        """Empty bins by the whole's blocks for what lies in a window about a centre."""
        to_block = self.to_block[::-1].copy()
        to_block[:, :, 3] += to_block[:, :, :3] @ center
        return self._replace(
            to_block=to_block, parts=self.parts[::-1].copy(), sums=np.zeros_like(self.sums)
        )


def no_bins(axes: int) -> Bins:
    """For so many axes, none: a kernel that takes these is compiled once, with bins or without."""
    sums = np.zeros((axes, 2, 2, 0, 3))
    return Bins(np.zeros((2, 3, 4)), np.ones((2, 3)), True, np.zeros(0), sums)


@inner()
def bins_along(bins: Bins, triad: FloatArray, axis: int) -> Bins:
    """The bins of an axis, for places u, v, depth in its triad."""
    to_block = bins.to_block.copy()
    for kind in range(2):
        for i in range(3):
            for j in range(3):
                to_block[kind, i, j] = 0.0
                for k in range(3):
                    to_block[kind, i, j] += bins.to_block[kind, i, k] * triad[j, k]
    return Bins(to_block, bins.parts, bins.halves, bins.cutoffs, bins.sums[axis])


@inner()
def room_for_gaps(count: int) -> FloatArray:
    """So many gaps, for :func:`list_gap` and :func:`add_gaps`."""
    # rows that lie a power of two apart would drive one another out of the processor's first cache
    return np.empty((11, count + 24))


@inner(forceinline=True)
def list_gap(
    gaps: FloatArray,
    k: int | np.uint64,
    u: float,
    low: float,
    high: float,
    enters: float,
    leaves: float,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> None:
    """List a gap as number k, as it is and clipped to the window; NaN where it does not count."""
    gaps[LINE_U, k] = u
    if whole is not None:
        gaps[GAP_LOW + OF_WHOLE, k] = low
        if measured is not None:
            begins = (low - enters >= 0.0) & (low - enters < measured.length)
            gaps[GAP_HIGH + OF_WHOLE, k] = high if begins else np.nan
        else:
            gaps[GAP_HIGH + OF_WHOLE, k] = high
    if window is not None:
        gaps[GAP_LOW + OF_WINDOW, k] = low if low > enters else enters
        gaps[GAP_HIGH + OF_WINDOW, k] = high if high < leaves else leaves
        if window.ends is not None or window.start is not None:
            gaps[WEIGHT, k] = ends_inside(low, high, enters, leaves)
        if window.start is not None:
            # those that end beyond the listed solids are followed
            known = (high < leaves + listed_to(window)) & (low < leaves) & (high > enters)
            gaps[FULL, k] = high - low if known else 0.0


@inner(inline="always")
def part_of_period(x: float, parts: float, halves: Flag) -> float:
    """In which of so many equal parts of its period of 1 a coordinate lies, from 0."""
    if halves is not None:
        return 1.0 if x - np.floor(x) >= 0.5 else 0.0
    part = np.floor((x - np.floor(x)) * parts)
    # rounding makes a whole period of what is just below 0; and NaN, of a line that misses the
    # window, must have some place, too
    return part if part < parts - 1.0 else parts - 1.0


@inner(error_model="numpy")
def find_bins(
    bins: Bins,
    gaps: FloatArray,
    count: np.uint64,
    kind: int,
    v: float,
    window: Edge | None,
) -> None:
    """Of gaps on a row of lines, the lengths, 0 where they do not count, and the bins."""
    cutoffs, to_block = bins.cutoffs, bins.to_block[kind]
    x_u, y_u, z_u = to_block[0, 0], to_block[1, 0], to_block[2, 0]
    x_n, y_n, z_n = to_block[0, 2], to_block[1, 2], to_block[2, 2]
    x_v = to_block[0, 1] * v + to_block[0, 3]
    y_v = to_block[1, 1] * v + to_block[1, 3]
    z_v = to_block[2, 1] * v + to_block[2, 3]
    in_x, in_y, in_z = bins.parts[kind, 0], bins.parts[kind, 1], bins.parts[kind, 2]
    in_xy = in_x * in_y
    lows, highs = gaps[GAP_LOW + kind], gaps[GAP_HIGH + kind]
    lengths, places = gaps[COUNTED + kind], gaps[PLACE + kind]
    for k in range(count):
        u, low, high = gaps[LINE_U, k], lows[k], highs[k]
        length = high - low
        middle = 0.5 * (low + high)
        x = x_v + x_u * u + x_n * middle
        y = y_v + y_u * u + y_n * middle
        z = z_v + z_u * u + z_n * middle
        block = part_of_period(x, in_x, bins.halves)
        block += in_x * part_of_period(y, in_y, bins.halves)
        block += in_xy * part_of_period(z, in_z, bins.halves)
        if window is not None and window.start is not None:
            length = gaps[FULL, k]
        is_kept = (length > 0.0) & (length >= cutoffs[0]) & (length < 0.5 * FAR)
        lengths[k] = length if is_kept else 0.0
        places[k] = block * cutoffs.size
    for number in range(1, cutoffs.size):
        for k in range(count):
            places[k] += 1.0 if lengths[k] >= cutoffs[number] else 0.0


@inner(error_model="numpy")
def add_gaps(
    bins: Bins,
    gaps: FloatArray,
    count: np.uint64,
    sign: float,
    which: int,
    v: float,
    whole: Flag,
    window: Edge | None,
) -> None:
    """Add the first gaps of a list, all on one row of lines, where they count; or take them off."""
    kinds = np.uint64(OF_WINDOW if whole is None else OF_WHOLE), np.uint64(1 + (window is not None))
    for kind in range(kinds[0], kinds[1]):
        find_bins(bins, gaps, count, kind, v, window)
    sums, of = bins.sums, np.uint64(which)
    for k in range(count):
        # both in turns, as a gap has to wait for the one before it if they share a bin
        for kind in range(kinds[0], kinds[1]):
            length = gaps[np.uint64(COUNTED) + kind, k]
            place = np.uint64(gaps[np.uint64(PLACE) + kind, k])
            number = sign if length > 0.0 else 0.0
            weighted, counted = number, number * length * length
            if window is not None and window.start is not None:
                number *= gaps[WEIGHT, k]
                weighted, counted = number, number * length * length
            if window is not None and window.ends is not None:
                # squares of what is inside say nothing: in their place all that are kept
                weighted, counted = number * gaps[WEIGHT, k], number
            sums[kind, of, place, NUMBER] += weighted
            sums[kind, of, place, LENGTH] += number * length
            sums[kind, of, place, SQUARE] += counted
