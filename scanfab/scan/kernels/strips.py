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
# Of the rule ``start``: where the last solid before the window ends, with a minus, and where the
# first one behind it begins, see :mod:`scanfab.scan.kernels.start`. The second set's planes are SET
# behind, and the one between is never touched.
BEFORE, BEHIND = np.uint64(8) * PLANE, np.uint64(9) * PLANE
STATE_SIZE = int(13 * PLANE)
ONE = np.uint64(1)
# a sphere that is no more lines wide is visited as a square: to find where its chords begin and end
# in each row would take longer than the corners
NARROW = 12


# steps towards the lines of a row that meet a window of planes: the more, the fewer are left over
TANGENTS = 2


class Edge(NamedTuple):
    """
    A rule of what counts at the window's surface, see :mod:`scanfab.scan.kernels.edges`.

    For each of them kernels are compiled with nothing else in them.
    """

    ends: Flag
    start: Flag
    margin: float
    """Of ``start``: how far beyond the window solids are listed; else 0."""
    inside: Flag
    """Of ``start``: whether only chords of spheres that lie wholly in the window are met."""


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
            set_off(lines, i, middle - half, middle + half, whole, window)
            lines[i + GAP_START] = -FAR
            lines[i + GAP_END] = -FAR
            if second is not None:
                set_off(lines, i + SET, middle - half, middle + half, whole, window)
                lines[i + SET + GAP_START] = -FAR
                lines[i + SET + GAP_END] = -FAR
            lines[i + ENTRY] = middle - half
            lines[i + EXIT] = middle + half
        if section.planes.shape[0] > 0:
            cut_row(lines, strip, section.planes, chosen, row, second, whole, window)
        no_lines(lines, at, np.uint64(0), np.uint64(strip.low[row]))
        no_lines(lines, at, np.uint64(strip.high[row]), np.uint64(strip.pitch))


@inner(forceinline=True, error_model="numpy")
def set_off(
    lines: FloatArray,
    i: np.uint64,
    enters: float,
    leaves: float,
    whole: Flag,
    window: Edge | None,
) -> None:
    """Let a line, which has met nothing yet, begin: before all, or where it enters the window."""
    if window is not None and window.start is not None:
        # NaN, a line that misses the window, stays NaN
        lines[i + END] = 0.0 * enters - FAR
        lines[i + BEFORE] = window.margin - enters
        lines[i + BEHIND] = leaves + window.margin
    else:
        lines[i + END] = -FAR if whole is not None else enters


@inner()
def cutting(
    planes: FloatArray, side: float, chosen: IntArray, first: float, last: float, v: float
) -> int:
    """
    List the planes of a side that may cut a line of a row, from u = first to last, before others.

    Returns how many. A plane's distance from the origin is linear along the row: where it is beyond
    that of another on its side at both ends, it is so everywhere; the others are the nearest at
    either end.
    """
    at_first = at_last = beyond_first = beyond_last = np.inf
    for k in range(planes.shape[0]):
        if planes[k, 3] == side:
            rest = planes[k, 0] - planes[k, 2] * v
            start, stop = rest - planes[k, 1] * first, rest - planes[k, 1] * last
            if start < at_first:
                at_first, beyond_last = start, stop
            if stop < at_last:
                at_last, beyond_first = stop, start
    count = 0
    for k in range(planes.shape[0]):
        if planes[k, 3] == side:
            rest = planes[k, 0] - planes[k, 2] * v
            start, stop = rest - planes[k, 1] * first, rest - planes[k, 1] * last
            if stop <= beyond_last and start <= beyond_first:
                chosen[count] = k
                count += 1
    return count


@inner(error_model="numpy")
def nearer(planes: FloatArray, u: float, v: float, sign: float) -> float:
    """
    From a place on a row, one that is nearer to the lines between all planes, if it has none.

    On a line by how much the last plane to be entered is behind the first one to be left is a
    convex function along the row: its tangent meets 0 before it does. ``sign`` is that of the way
    to these lines. FAR if there are none.
    """
    enters, leaves = -np.inf, np.inf
    slope_in = slope_out = 0.0
    for k in range(planes.shape[0]):
        depth = planes[k, 3] * (planes[k, 0] - planes[k, 1] * u - planes[k, 2] * v)
        if planes[k, 3] < 0.0:
            if depth > enters:
                enters, slope_in = depth, planes[k, 1]
        elif depth < leaves:
            leaves, slope_out = depth, planes[k, 1]
    missing, falls = enters - leaves, -sign * (slope_in + slope_out)
    if not missing > 0.0:
        return u
    return u + sign * missing / falls if falls > 0.0 else sign * FAR


@inner(error_model="numpy")
def narrow_row(strip: Strip, planes: FloatArray, row: int) -> None:
    """Take lines at the ends of a row that miss a window for its planes out of it, or most."""
    v = strip.first_v + row * strip.spacing
    first = strip.first_u + strip.spacing * strip.low[row]
    last = strip.first_u + strip.spacing * (strip.high[row] - 1)
    for _ in range(TANGENTS):
        first, last = nearer(planes, first, v, 1.0), nearer(planes, last, v, -1.0)
        if not first <= last:
            strip.high[row] = strip.low[row]
            return
    # a line more, as a place may be beyond by rounding
    low = int((first - strip.first_u) * strip.per_spacing) - 1
    high = int((last - strip.first_u) * strip.per_spacing) + 3
    strip.low[row] = max(low, strip.low[row])
    strip.high[row] = min(high, strip.high[row])


@inner(fastmath={"contract"}, error_model="numpy")
def cut_between(
    lines: FloatArray, strip: Strip, planes: FloatArray, chosen: IntArray, row: int
) -> None:
    """Let the lines of a row enter and leave no further out than at its planes."""
    v = strip.first_v + row * strip.spacing
    at = np.uint64(row * strip.pitch)
    low, high = np.uint64(strip.low[row]), np.uint64(strip.high[row])
    first = strip.first_u + strip.spacing * strip.low[row]
    last = strip.first_u + strip.spacing * (strip.high[row] - 1)
    # NaN, a line that misses the quadric, stays NaN
    for place in range(cutting(planes, -1.0, chosen, first, last, v)):
        k = chosen[place]
        slope, rest = planes[k, 1], planes[k, 0] - planes[k, 2] * v
        for j in range(low, high):
            i = at + j
            cut = slope * (strip.first_u + strip.spacing * np.int32(j)) - rest
            enters = lines[i + ENTRY]
            lines[i + ENTRY] = cut if cut > enters else enters
    for place in range(cutting(planes, 1.0, chosen, first, last, v)):
        k = chosen[place]
        slope, rest = planes[k, 1], planes[k, 0] - planes[k, 2] * v
        for j in range(low, high):
            i = at + j
            cut = rest - slope * (strip.first_u + strip.spacing * np.int32(j))
            leaves = lines[i + EXIT]
            lines[i + EXIT] = cut if cut < leaves else leaves


@inner(fastmath={"contract"}, error_model="numpy")
def cut_row(
    lines: FloatArray,
    strip: Strip,
    planes: FloatArray,
    chosen: IntArray,
    row: int,
    second: Flag,
    whole: Flag,
    window: Edge | None,
) -> None:
    """Let the lines of a row enter and leave the window between its planes, too."""
    if whole is None:
        narrow_row(strip, planes, row)
    cut_between(lines, strip, planes, chosen, row)
    at = np.uint64(row * strip.pitch)
    low, high = np.uint64(strip.low[row]), np.uint64(strip.high[row])
    for j in range(low, high):
        i = at + j
        enters, leaves = lines[i + ENTRY], lines[i + EXIT]
        enters = enters if enters < leaves else np.nan
        lines[i + ENTRY] = enters
        lines[i + EXIT] = leaves if enters < leaves else np.nan
        if whole is None:
            set_off(lines, i, enters, leaves, whole, window)
            if second is not None:
                set_off(lines, i + SET, enters, leaves, whole, window)
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
