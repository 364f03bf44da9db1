"""
Void segments one by one: by the octant of their middle and by cut-off, with their squares.

What sums for one cut-off cannot tell. It is the sweep again, chord by chord.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import Flag, inner
from scanfab.kernels.strips import (
    BOUND,
    END,
    FAR,
    GAP_END,
    GAP_START,
    SET,
    Sphere,
    Strip,
    columns_of_row,
    span,
)
from scanfab.kernels.sweep import Measured, moved, whole_gap

__all__ = [
    "BLOCKS",
    "HIGH",
    "LENGTH",
    "LOW",
    "NUMBER",
    "SQUARE",
    "Bins",
    "add_gaps",
    "add_line",
    "bins_along",
    "list_gaps",
    "list_last_gaps",
    "no_bins",
    "room_for_gaps",
]

FloatArray = npt.NDArray[np.float64]

BLOCKS = 8
# what is added up of the gaps of a block and bin
NUMBER, LENGTH, SQUARE = range(3)
# whose gaps they are, and of the list of gaps its rows
OF_WHOLE, OF_WINDOW = 0, 1
WHICH, U, V, LINE_BOUND, LOW, HIGH = range(6)


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
    Number, length, squared length, shape (D, 2, 2, BLOCKS, C, 3).

    For each axis, whole or window, and set of solids; without D those of one axis.
    """


def no_bins(axes: int) -> Bins:
    """For so many axes, none: a kernel that takes these is compiled once, with bins or without."""
    return Bins(np.zeros((2, 3, 4)), np.zeros(0), np.zeros((axes, 2, 2, BLOCKS, 0, 3)))


@inner()
def bins_along(bins: Bins, frame: FloatArray, axis: int) -> Bins:
    """The bins of an axis, for places u, v, depth in its frame."""
    to_block = bins.to_block.copy()
    for kind in range(2):
        for i in range(3):
            for j in range(3):
                to_block[kind, i, j] = 0.0
                for k in range(3):
                    to_block[kind, i, j] += bins.to_block[kind, i, k] * frame[j, k]
    return Bins(to_block, bins.cutoffs, bins.sums[axis])


@inner()
def room_for_gaps(count: int) -> FloatArray:
    """So many gaps, to be listed: set of solids, line, its bound, and where the gap is."""
    return np.empty((6, count))


@inner(error_model="numpy")
def add_gaps(
    bins: Bins,
    gaps: FloatArray,
    count: int,
    sign: float,
    whole: Flag,
    window: Flag,
    measured: Measured | None,
) -> None:
    """Add the first gaps of a list where they count, as the sweep does, or take them back."""
    # no array is handed on in the loop: to count its references would take longer than all else
    to_block, cutoffs, sums = bins.to_block, bins.cutoffs, bins.sums
    for k in range(count):
        which = int(gaps[WHICH, k])
        u, v, bound = gaps[U, k], gaps[V, k], gaps[LINE_BOUND, k]
        for kind in range(2):
            low, high = gaps[LOW, k], gaps[HIGH, k]
            length = 0.0
            if kind == OF_WHOLE and whole is not None:
                length = whole_gap(low, high, 0.0, bound, measured)[2]
            if kind == OF_WINDOW and window is not None:
                # NaN where the line misses the window
                low = low if low > -bound else -bound
                high = high if high < bound else bound
                length = high - low
            place = -1
            while place + 1 < cutoffs.size and cutoffs[place + 1] <= length:
                place += 1
            if not length > 0.0 or place < 0:
                continue
            middle, block = 0.5 * (low + high), 0
            for i in range(3):
                x = to_block[kind, i, 0] * u + to_block[kind, i, 1] * v + to_block[kind, i, 3]
                x += to_block[kind, i, 2] * middle
                block += (1 << i) * (x - np.floor(x) >= 0.5)
            sums[kind, which, block, place, NUMBER] += sign
            sums[kind, which, block, place, LENGTH] += sign * length
            sums[kind, which, block, place, SQUARE] += sign * length * length


@inner()
def add_line(
    bins: Bins,
    gaps: FloatArray,
    count: int,
    sign: float,
    which: int,
    u: float,
    v: float,
    bound: float,
    whole: Flag,
    window: Flag,
    measured: Measured | None,
) -> None:
    """The same for gaps of the line through (u, v), of which the list has but their two ends."""
    for k in range(count):
        gaps[WHICH, k], gaps[U, k], gaps[V, k], gaps[LINE_BOUND, k] = which, u, v, bound
    add_gaps(bins, gaps, count, sign, whole, window, measured)


@inner(error_model="numpy")
def list_gaps(
    lines: FloatArray,
    strip: Strip,
    sphere: Sphere,
    removed: bool,
    least: float,
    second: Flag,
    measured: Measured | None,
    gaps: FloatArray,
) -> int:
    """Visit the chords that a sphere cuts from a strip, and list the gaps that they settle."""
    count = 0
    radius, per_spacing = sphere.radius, strip.per_spacing
    rows = span(sphere.v, radius, strip.first_v, per_spacing, 0, strip.rows)
    columns = span(sphere.u, radius, strip.first_u, per_spacing, 0, strip.columns)
    for row in range(rows[0], rows[1]):
        v = strip.first_v + row * strip.spacing
        reach2 = radius * radius - (v - sphere.v) * (v - sphere.v)
        first, met, _ = columns_of_row(strip, sphere, row, reach2, columns[0], columns[1])
        for column in range(first, first + met):
            u = strip.first_u + column * strip.spacing
            # NaN beyond the ends of the row: then nothing happens
            half_chord = np.sqrt(reach2 - (u - sphere.u) * (u - sphere.u))
            start, stop = sphere.depth - half_chord, sphere.depth + half_chord
            i = np.uint64(row * strip.pitch + column)
            bound = lines[i + BOUND]
            if measured is not None and not start - bound < measured.known:
                continue
            for which in range(1 if second is None or removed else 2):
                k = i + SET * np.uint64(which)
                end, low, high = lines[k + END], lines[k + GAP_START], lines[k + GAP_END]
                # listed anyhow, and overwritten if it is none: no branch to be guessed wrong
                gaps[WHICH, count], gaps[U, count], gaps[V, count] = which, u, v
                gaps[LINE_BOUND, count], gaps[LOW, count], gaps[HIGH, count] = bound, low, high
                count += (start > end) & (high - low >= least)
                end, low, high = moved(start, stop, end, low, high)
                lines[k + END], lines[k + GAP_START], lines[k + GAP_END] = end, low, high
    return count


@inner()
def list_last_gaps(
    lines: FloatArray, strip: Strip, which: int, least: float, gaps: FloatArray
) -> tuple[int, float]:
    """
    List every line's last gap, and the void behind its last solid.

    Returns how many they are, and the number of closed lines, of which nothing is listed.
    """
    count, closed = 0, 0.0
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.low[row], strip.high[row]):
            u = strip.first_u + column * strip.spacing
            i = np.uint64(row * strip.pitch + column)
            k = i + SET * np.uint64(which)
            end, bound = lines[k + END], lines[i + BOUND]
            if end == FAR:
                closed += 1.0
                continue
            last = lines[k + GAP_START], lines[k + GAP_END]
            for low, high in (last, (end, FAR)):
                if high - low >= least:
                    gaps[WHICH, count], gaps[U, count], gaps[V, count] = which, u, v
                    gaps[LINE_BOUND, count], gaps[LOW, count], gaps[HIGH, count] = bound, low, high
                    count += 1
    return count, closed
