"""
Strips of scan lines: where the lines are, which of them a sphere reaches, and their state.

The state is three numbers a line for each set of solids, the running end of the solid and the two
ends of the last gap, and one more; what they are for, :mod:`scanfab.scan.kernels.sweep` says.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import REORDERED, Flag, inner
from scanfab.base.typing import FloatArray, IntArray

__all__ = [
    "BOUND",
    "END",
    "FAR",
    "GAP_END",
    "GAP_START",
    "MOST_LINES",
    "SET",
    "STATE_SIZE",
    "Sphere",
    "Strip",
    "begin",
    "columns_of_row",
    "measure_from",
    "span",
]


# infinity
FAR = 1e300
# the state of a strip's lines fits a core's cache; its planes lie at a fixed distance, by which the
# compiler sees that they do not overlap
MOST_LINES = 24_576
PLANE = np.uint64(MOST_LINES + 24)
# first places of the planes: running end, last gap; the same for the second set of solids; and
# half the line's length in the window, or where its measured length begins
END, GAP_START, GAP_END = np.uint64(0), PLANE, np.uint64(2) * PLANE
SET = np.uint64(3) * PLANE
BOUND = np.uint64(6) * PLANE
STATE_SIZE = int(7 * PLANE)
# a sphere that is no more lines wide is visited as a square: to find where its chords begin and end
# in each row would take longer than the corners
NARROW = 12


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


@inner(fastmath=REORDERED, error_model="numpy")
def begin(lines: FloatArray, strip: Strip, radius: float, second: Flag, whole: Flag) -> None:
    """Lines that have met nothing yet, in a window of this radius."""
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        half2 = radius * radius - v * v
        at = np.uint64(row * strip.pitch)
        for j in range(np.uint64(strip.pitch)):
            i = at + j
            u = strip.first_u + strip.spacing * np.int32(j)
            half = np.sqrt(half2 - u * u)
            end = -FAR if whole is not None else -half
            lines[i + BOUND] = half
            lines[i + END] = end
            lines[i + GAP_START] = -FAR
            lines[i + GAP_END] = -FAR
            if second is not None:
                lines[i + SET + END] = end
                lines[i + SET + GAP_START] = -FAR
                lines[i + SET + GAP_END] = -FAR
        no_lines(lines, at, np.uint64(0), np.uint64(strip.low[row]))
        no_lines(lines, at, np.uint64(strip.high[row]), np.uint64(strip.pitch))


@inner()
def no_lines(lines: FloatArray, row: np.uint64, first: np.uint64, last: np.uint64) -> None:
    """Mark places of a row where no lines are: nothing is ever greater or less than NaN."""
    for column in range(first, last):
        k = row + column
        lines[k + BOUND] = lines[k + END] = lines[k + SET + END] = np.nan


@inner()
def measure_from(lines: FloatArray, strip: Strip, rise_u: float, rise_v: float) -> None:
    """Let the measured length of each line begin on a plane through the origin."""
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.low[row], strip.high[row]):
            u = strip.first_u + column * strip.spacing
            place = np.uint64(row * strip.pitch + column)
            lines[place + BOUND] = rise_u * u + rise_v * v


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
