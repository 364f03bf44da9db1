"""
Void segments one by one: by the octant of their middle and by cut-off, with their squares.

What sums for one cut-off cannot tell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import Flag, inner
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.strips import FAR
from scanfab.scan.kernels.sweep import Measured, whole_gap

__all__ = [
    "BLOCKS",
    "GAP_HIGH",
    "GAP_LOW",
    "LENGTH",
    "LINE_BOUND",
    "LINE_U",
    "NUMBER",
    "SQUARE",
    "Bins",
    "add_gaps",
    "bins_along",
    "no_bins",
    "room_for_gaps",
]


BLOCKS = 8
# what is added up of the gaps of a block and bin
NUMBER, LENGTH, SQUARE = range(3)
# whose gaps they are
OF_WHOLE, OF_WINDOW = 0, 1
# of a list of gaps its rows: the line's place along u, its bound, where the gap starts and ends;
# its length in the whole and, behind that, in the window; likewise its bin
LINE_U, LINE_BOUND, GAP_LOW, GAP_HIGH = range(4)
COUNTED, PLACE = 4, 6


class Bins(NamedTuple):
    """What gaps are added to."""

    to_block: FloatArray
    """
    Affine maps of places to three coordinates, of whose periods of 1 the halves are blocks.

    For the whole and the window, shape (2, 3, 4).
    """
    cutoffs: FloatArray
    """
    In ascending order, shape (C,); a gap goes to the bin of the largest that it reaches.

    None at all: gaps are to be tallied instead.
    """
    sums: FloatArray
    """
    Number, length, squared length, shape (D, 2, 2, BLOCKS * C, 3).

    For each axis, whole or window, and set of solids; without D those of one axis.
    """


def no_bins(axes: int) -> Bins:
    """For so many axes, none: a kernel that takes these is compiled once, with bins or without."""
    return Bins(np.zeros((2, 3, 4)), np.zeros(0), np.zeros((axes, 2, 2, 0, 3)))


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
    return Bins(to_block, bins.cutoffs, bins.sums[axis])


@inner()
def room_for_gaps(count: int) -> FloatArray:
    """So many gaps, to be listed: the first four rows; the others are for :func:`add_gaps`."""
    return np.empty((8, count))


@inner(error_model="numpy")
def find_bins(
    bins: Bins,
    gaps: FloatArray,
    count: np.uint64,
    kind: int,
    v: float,
    measured: Measured | None,
) -> None:
    """Of gaps on a row of lines, the lengths, 0 where they do not count, and the bins."""
    cutoffs, to_block = bins.cutoffs, bins.to_block[kind]
    x_u, y_u, z_u = to_block[0, 0], to_block[1, 0], to_block[2, 0]
    x_n, y_n, z_n = to_block[0, 2], to_block[1, 2], to_block[2, 2]
    x_v = to_block[0, 1] * v + to_block[0, 3]
    y_v = to_block[1, 1] * v + to_block[1, 3]
    z_v = to_block[2, 1] * v + to_block[2, 3]
    lengths, places = gaps[COUNTED + kind], gaps[PLACE + kind]
    for k in range(count):
        u, bound = gaps[LINE_U, k], gaps[LINE_BOUND, k]
        low, high = gaps[GAP_LOW, k], gaps[GAP_HIGH, k]
        # NaN where the line misses the window
        reach = bound if kind == OF_WINDOW else FAR
        low = low if low > -reach else -reach
        high = high if high < reach else reach
        length = whole_gap(low, high, 0.0, bound, measured)[2]
        middle = 0.5 * (low + high)
        x = x_v + x_u * u + x_n * middle
        y = y_v + y_u * u + y_n * middle
        z = z_v + z_u * u + z_n * middle
        block = 1.0 if x - np.floor(x) >= 0.5 else 0.0
        block += 2.0 if y - np.floor(y) >= 0.5 else 0.0
        block += 4.0 if z - np.floor(z) >= 0.5 else 0.0
        lengths[k] = length if (length > 0.0) & (length >= cutoffs[0]) else 0.0
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
    window: Flag,
    measured: Measured | None,
) -> None:
    """Add the first gaps of a list, all on one row of lines, where they count; or take them off."""
    kinds = np.uint64(OF_WINDOW if whole is None else OF_WHOLE), np.uint64(1 + (window is not None))
    for kind in range(kinds[0], kinds[1]):
        find_bins(bins, gaps, count, kind, v, measured)
    sums, of = bins.sums, np.uint64(which)
    for k in range(count):
        # both in turns, as a gap has to wait for the one before it if they share a bin
        for kind in range(kinds[0], kinds[1]):
            length = gaps[np.uint64(COUNTED) + kind, k]
            place = np.uint64(gaps[np.uint64(PLACE) + kind, k])
            number = sign if length > 0.0 else 0.0
            sums[kind, of, place, NUMBER] += number
            sums[kind, of, place, LENGTH] += number * length
            sums[kind, of, place, SQUARE] += number * length * length
