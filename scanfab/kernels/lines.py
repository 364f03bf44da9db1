"""
Scan lines from lists of their chords: slower than the sweep, and exact for any spheres.

For the lines that the sweep cannot solve, and where the gaps themselves are wanted.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import inner
from scanfab.kernels.projection import Spheres, sort_by, span, sphere_at
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
)

__all__ = ["chords_of", "solids_of", "solve_closed"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@inner()
def list_chords(
    spheres: Spheres,
    chosen: IntArray,
    which: int,
    strip: Strip,
    number: IntArray,
    filled: IntArray,
    chords: FloatArray,
) -> None:
    """
    List the chords of the lines that have a number >= 0, in the order of depth.

    ``number`` has shape (rows, columns). ``filled[number]`` is the place of a line's next chord in
    ``chords`` (shape (2, M)); with no room there (M = 0) the chords are only counted.
    """
    for k in chosen:
        if which == 1 and spheres.removed[k]:
            continue
        u, v, depth, radius = sphere_at(spheres, k)
        rows = span(v, radius, strip.first_v, strip.per_spacing, 0, strip.rows)
        for row in range(rows[0], rows[1]):
            dv = strip.first_v + row * strip.spacing - v
            reach2 = radius * radius - dv * dv
            reach = np.sqrt(max(reach2, 0.0))
            first_u = strip.first_u + row * strip.shear
            columns = span(u, reach, first_u, strip.per_spacing, strip.low[row], strip.high[row])
            for column in range(columns[0], columns[1]):
                line = number[row, column]
                du = first_u + column * strip.spacing - u
                if line < 0 or reach2 < du * du:
                    continue
                if chords.shape[1] > 0:
                    half_chord = np.sqrt(reach2 - du * du)
                    chords[0, filled[line]] = depth - half_chord
                    chords[1, filled[line]] = depth + half_chord
                filled[line] += 1


@inner()
def chords_of(
    spheres: Spheres, chosen: IntArray, which: int, strip: Strip, number: IntArray, count: int
) -> tuple[IntArray, FloatArray]:
    """The chords of numbered lines: the start of each line's list (and the end), and the lists."""
    # lists begin where those before them end, so the first filling leaves the second its places
    stop = np.zeros(count + 2, np.int64)
    list_chords(spheres, chosen, which, strip, number, stop[2:], np.empty((2, 0)))
    for line in range(count):
        stop[line + 2] += stop[line + 1]
    chords = np.empty((2, stop[count + 1]))
    if chords.shape[1] > 0:
        list_chords(spheres, chosen, which, strip, number, stop[1:], chords)
    return stop, chords


@inner()
def solids_of(chords: FloatArray, order: IntArray, solids: FloatArray) -> int:
    """
    The union of a line's chords, shape (2, K), into the first places of ``solids``; their number.

    ``order`` is room for K numbers.
    """
    for k in range(order.size):
        order[k] = k
    sort_by(chords[0], order)
    count = 0
    for k in order:
        if count > 0 and chords[0, k] <= solids[1, count - 1]:
            solids[1, count - 1] = max(solids[1, count - 1], chords[1, k])
        else:
            solids[0, count], solids[1, count] = chords[0, k], chords[1, k]
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
        order = np.arange(start[line], start[line + 1])
        bound = lines[places[line] + BOUND]
        sweep_line(chords, order, bound, least, wrong, which, whole, window, measured)
        sort_by(chords[0], order)
        end = sweep_line(chords, order, bound, least, right, which, whole, window, measured)
        lines[places[line] + SET * np.uint64(which) + END] = end
    for entry in range(TALLY_SIZE):
        tally[which, entry] += right[which, entry] - wrong[which, entry]
