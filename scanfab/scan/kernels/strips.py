"""
Strips of scan lines: where the lines are, which of them a sphere reaches, and their state.

The state is three numbers a line for each set of solids, the running end of the solid and the two
ends of the last gap, and two more that both sets share, where the line enters and leaves the
window; what they are for, :mod:`scanfab.scan.kernels.sweep` says.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import LANES, Flag, inner, kernel
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.windows import Clip, Section, section_along

__all__ = [
    "END",
    "ENTRY",
    "EXIT",
    "FAR",
    "FIRST",
    "GAP_END",
    "GAP_START",
    "MOST_LINES",
    "SET",
    "STATE_SIZE",
    "Edge",
    "Sphere",
    "Strip",
    "begin",
    "columns_of_row",
    "measure_from",
    "span",
    "spans",
]


# infinity
FAR = 1e300
# the state of a strip's lines fits a core's cache; its planes lie at a fixed distance, by which the
# compiler sees that they do not overlap
MOST_LINES = 24_576
PLANE = np.uint64(MOST_LINES + 24)
# first places of the planes: running end, last gap; the same for the second set of solids; and
# where the line enters the window, or where its measured length begins, and where it leaves it
END, GAP_START, GAP_END = np.uint64(0), PLANE, np.uint64(2) * PLANE
SET = np.uint64(3) * PLANE
ENTRY, EXIT = np.uint64(6) * PLANE, np.uint64(7) * PLANE
# Of lines that are followed beyond the window: where their first gap ends, if it begins further
# before the window than solids are listed. The second set's plane is SET behind, and those between
# are never touched.
FIRST = np.uint64(8) * PLANE
STATE_SIZE = int(12 * PLANE)
ONE = np.uint64(1)
# a sphere that is no more lines wide is visited as a square: to find where its chords begin and end
# in each row would take longer than the corners
NARROW = 12


class Edge(NamedTuple):
    """
    A rule of what counts at the window's surface, see :mod:`scanfab.scan.kernels.edges`.

    For each of them kernels are compiled with nothing else in them.
    """

    ends: Flag
    start: Flag
    margin: float
    """Of ``start``: how far beyond the window solids are listed; else 0."""


class Strip(NamedTuple):
    """
    Lines at (first_u + column * spacing, first_v + row * spacing), of each row low to before high.

    A row takes ``pitch`` places of a plane, which is ``columns`` and at least LANES more.
    """

    spacing: float
    per_spacing: float
    first_u: float
    first_v: float
    columns: int
    rows: int
    pitch: int
    low: IntArray
    high: IntArray


class Sphere(NamedTuple):
    """A sphere, projected."""

    u: float
    v: float
    depth: float
    radius: float


@inner(fastmath={"contract"}, error_model="numpy")
def begin(
    lines: FloatArray,
    strip: Strip,
    section: Section,
    second: Flag,
    whole: Flag,
    window: Edge | None,
) -> None:
    """
    Lines that have met nothing yet, and where they enter and leave the window.

    Rows lose the lines at their ends that miss its planes, if these serve the window alone.
    """
    before = 0.0
    if window is not None:
        before = window.margin
    a, rise_u = section.a, section.rise_u
    chosen = np.empty(section.planes.shape[0], np.int64)
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        rest, aslant = section.level - section.c * v * v, 2.0 * section.b * v
        aside = section.rise_v * v
        at = np.uint64(row * strip.pitch)
        for j in range(np.uint64(strip.pitch)):
            i = at + j
            u = strip.first_u + strip.spacing * np.int32(j)
            half = np.sqrt(rest - (aslant + a * u) * u)
            middle = aside + rise_u * u
            enters = middle - half
            end = -FAR if whole is not None else enters - before
            lines[i + ENTRY] = enters
            lines[i + EXIT] = middle + half
            lines[i + END] = end
            lines[i + GAP_START] = -FAR
            lines[i + GAP_END] = -FAR
            if second is not None:
                lines[i + SET + END] = end
                lines[i + SET + GAP_START] = -FAR
                lines[i + SET + GAP_END] = -FAR
            if window is not None and window.start is not None:
                lines[i + FIRST] = -FAR
                if second is not None:
                    lines[i + SET + FIRST] = -FAR
        if section.planes.shape[0] > 0:
            cut_row(lines, strip, section.planes, chosen, row, whole, before)
        no_lines(lines, at, np.uint64(0), np.uint64(strip.low[row]))
        no_lines(lines, at, np.uint64(strip.high[row]), np.uint64(strip.pitch))


@inner()
def cutting(planes: FloatArray, chosen: IntArray, first: float, last: float, v: float) -> int:
    """
    List the planes that may cut a line of a row before all others, from u = first to last.

    Returns how many. A plane's distance from the origin is linear along the row: where it is beyond
    that of another on its side at both ends, it is so everywhere; the others are the nearest at
    either end.
    """
    nearest, beyond = np.full(4, np.inf), np.full(4, np.inf)
    for k in range(planes.shape[0]):
        side = 2 * int(planes[k, 3] < 0.0)
        rest = planes[k, 0] - planes[k, 2] * v
        start, stop = rest - planes[k, 1] * first, rest - planes[k, 1] * last
        if start < nearest[side]:
            nearest[side], beyond[side] = start, stop
        if stop < nearest[side + 1]:
            nearest[side + 1], beyond[side + 1] = stop, start
    count = 0
    for k in range(planes.shape[0]):
        side = 2 * int(planes[k, 3] < 0.0)
        rest = planes[k, 0] - planes[k, 2] * v
        start, stop = rest - planes[k, 1] * first, rest - planes[k, 1] * last
        if stop <= beyond[side] and start <= beyond[side + 1]:
            chosen[count] = k
            count += 1
    return count


@inner(fastmath={"contract"}, error_model="numpy")
def cut_row(
    lines: FloatArray,
    strip: Strip,
    planes: FloatArray,
    chosen: IntArray,
    row: int,
    whole: Flag,
    before: float,
) -> None:
    """Let the lines of a row enter and leave the window between its planes, too."""
    v = strip.first_v + row * strip.spacing
    at = np.uint64(row * strip.pitch)
    low, high = np.uint64(strip.low[row]), np.uint64(strip.high[row])
    first = strip.first_u + strip.spacing * strip.low[row]
    last = strip.first_u + strip.spacing * (strip.high[row] - 1)
    for place in range(cutting(planes, chosen, first, last, v)):
        k = chosen[place]
        slope, rest = planes[k, 1], planes[k, 0] - planes[k, 2] * v
        # NaN, a line that misses the quadric, stays NaN
        if planes[k, 3] < 0.0:
            for j in range(low, high):
                i = at + j
                cut = slope * (strip.first_u + strip.spacing * np.int32(j)) - rest
                enters = lines[i + ENTRY]
                lines[i + ENTRY] = cut if cut > enters else enters
        else:
            for j in range(low, high):
                i = at + j
                cut = rest - slope * (strip.first_u + strip.spacing * np.int32(j))
                leaves = lines[i + EXIT]
                lines[i + EXIT] = cut if cut < leaves else leaves
    for j in range(low, high):
        i = at + j
        enters, leaves = lines[i + ENTRY], lines[i + EXIT]
        enters = enters if enters < leaves else np.nan
        lines[i + ENTRY] = enters
        lines[i + EXIT] = leaves if enters < leaves else np.nan
        if whole is None:
            lines[i + END] = enters - before
            lines[i + SET + END] = enters - before
    if whole is None:
        # lines that miss the window at either end of the row need not be visited
        while low < high and np.isnan(lines[at + low + ENTRY]):
            low += ONE
        while low < high and np.isnan(lines[at + high - ONE + ENTRY]):
            high -= ONE
        strip.low[row], strip.high[row] = low, high


@inner()
def no_lines(lines: FloatArray, row: np.uint64, first: np.uint64, last: np.uint64) -> None:
    """Mark places of a row where no lines are: nothing is ever greater or less than NaN."""
    for column in range(first, last):
        k = row + column
        lines[k + ENTRY] = lines[k + EXIT] = np.nan
        lines[k + END] = lines[k + SET + END] = np.nan


@inner()
def measure_from(lines: FloatArray, strip: Strip, rise_u: float, rise_v: float) -> None:
    """Let the measured length of each line begin on a plane through the origin."""
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.low[row], strip.high[row]):
            u = strip.first_u + column * strip.spacing
            place = np.uint64(row * strip.pitch + column)
            lines[place + ENTRY] = rise_u * u + rise_v * v


@kernel
def spans(clip: Clip, triad: FloatArray, points: FloatArray, ends: FloatArray) -> None:
    """
    Where a few lines enter and leave a window, to be looked at; NaN where they miss it.

    They run along the third row of a triad through ``points`` along the other two, shape (L, 2);
    ``ends`` has the same shape.
    """
    section, lines = section_along(clip, triad), np.empty(STATE_SIZE)
    low, high = np.zeros(1, np.int64), np.ones(1, np.int64)
    for k in range(points.shape[0]):
        # a line that misses the window is taken out of its row
        low[0], high[0] = 0, 1
        strip = Strip(1.0, 1.0, points[k, 0], points[k, 1], 1, 1, 1 + LANES, low, high)
        begin(lines, strip, section, None, None, None)
        ends[k, 0], ends[k, 1] = lines[ENTRY], lines[EXIT]


@inner(inline="always")
def span(
    centre: float, reach: float, first: float, per_spacing: float, low: int, high: int
) -> tuple[int, int]:
    """Which lines along one side of the grid, of a range, are within ``reach`` of a centre."""
    start = int(np.ceil((centre - reach - first) * per_spacing))
    stop = int(np.floor((centre + reach - first) * per_spacing)) + 1
    return max(start, low), min(stop, high)


@inner(forceinline=True, error_model="numpy")
def columns_of_row(
    strip: Strip, sphere: Sphere, row: int, reach2: float, first: int, last: int
) -> tuple[int, int, float]:
    """
    The first of the columns to visit in a row, how many, and how many chords are expected there.

    ``reach2`` is the square of half the circle's width in the row; the sphere reaches from column
    ``first`` to before ``last``.
    """
    low, high = strip.low[row], strip.high[row]
    if last - first <= NARROW:
        # the circle has this share of the square
        chords = 0.25 * np.pi * max(min(last, high) - max(first, low), 0)
        return first, max(last - first, 0), chords
    reach = np.sqrt(max(reach2, 0.0))
    first, last = span(sphere.u, reach, strip.first_u, strip.per_spacing, low, high)
    met = max(last - first, 0)
    return first, met, float(met)
