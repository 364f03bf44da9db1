"""
Strips of scan lines: where they are, where they enter and leave the window, and their state.

The state of a line is three numbers for each set of solids, the running end of the solid and the
two ends of the last gap, and two that both sets share, where the line enters and leaves the window;
:mod:`scanfab.scan.kernels.sweep` says what they are for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.jit import Flag, inner, part
from scanfab.base.typing import FloatArray, IntArray

# place of a line along u and v, and the depths at which it enters and leaves the window
Line = tuple[float, float, float, float]

# infinity
FAR = 1e300
# The state of a strip's lines fits a core's cache. Its planes lie at a fixed distance, so that the
# compiler sees that they do not overlap.
MOST_LINES = 16_384
PLANE = np.uint64(MOST_LINES + 24)
# First places of the planes. END, GAP_START and GAP_END are the running end and the last gap; SET
# places behind them are those of the second set of solids. ENTRY is where the line enters the
# window, or where its measured length begins; EXIT is where it leaves the window.
END, GAP_START, GAP_END = np.uint64(0), PLANE, np.uint64(2) * PLANE
SET = np.uint64(3) * PLANE
ENTRY, EXIT = np.uint64(6) * PLANE, np.uint64(7) * PLANE
# For the rule `start`: minus the end of the last solid before the window, and the beginning of the
# first solid behind it. The planes of the second set are SET behind; the one between is not used.
BEFORE, BEHIND = np.uint64(8) * PLANE, np.uint64(9) * PLANE
STATE_SIZE = int(13 * PLANE)
ONE = np.uint64(1)
# A sphere of at most so many lines in width is visited as a square: to find where its chords begin
# and end in each row would take longer than to visit the corners.
NARROW = 12
# A quadric that changes along a line by less than this fraction of its size changes by rounding
# alone. Such a line, along a cylinder's axis, leaves the quadric far beyond the planes.
FLAT, LEAST = 1e-15, 1e-300
# a line is parallel to a plane if the component of the plane's unit normal along it is smaller
GRAZING = 1e-100


class Edge(NamedTuple):
    """The edge rule: what counts at the window's surface, see :mod:`scanfab.scan.kernels.sweep`."""

    ends: Flag
    start: Flag
    margin: float
    """For ``start``: how far beyond the window solids are listed; otherwise 0."""


class Measured(NamedTuple):
    """The measured length of a line through a periodic medium."""

    length: float
    """Gaps that begin within this length count."""
    known: float
    """Chords that begin further than this behind its beginning may not be listed: left out."""
    endless: bool
    """Whether a line that meets no further solid stays in a channel; otherwise it may have left."""


class Counts(NamedTuple):
    """
    What a scan counts.

    If a field is None, kernels are compiled without the code for it. The fields are explained in
    :mod:`scanfab.scan.kernels.sweep`.
    """

    least: float
    """Length of the shortest gap that is kept, above 0."""
    second: Flag
    whole: Flag
    window: Edge | None
    measured: Measured | None


class Section(NamedTuple):
    """
    A window as lines meet it; for several axes, each array has one more axis, the first.

    A line through (u, v) is inside at depths within √(level - a u² - 2 b u v - c v²) of
    rise_u u + rise_v v that lie on the inner side of all planes.
    """

    planes: FloatArray
    """
    Rows h, p, q, side: the plane is met at the depth side * (h - p u - q v), shape (P, 4).

    If side is 1, a line leaves the window there; if it is -1, it enters.
    """
    quadric: FloatArray
    """level, a, b, c, rise_u, rise_v, shape (6,)."""
    reach: float
    """Radius of a ball about the origin that holds the window."""


class Strip(NamedTuple):
    """
    Lines at (first_u + column * spacing, first_v + row * spacing) with low <= column < high.

    Each row takes ``pitch`` places of a plane, LANES more than there are columns. All lines of an
    axis together, its grid, are a strip as well, but only smaller strips fit the planes.
    """

    triad: FloatArray
    """Orthonormal rows u, v, n: the lines run along n."""
    spacing: float
    per_spacing: float
    first_u: float
    first_v: float
    columns: int
    rows: int
    pitch: int
    low: IntArray
    """First column of each row, from 0."""
    high: IntArray
    """End of the columns of each row, up to ``columns``."""


class Partition(NamedTuple):
    """Blocks of space as numbers; each array has a row for the whole and one for the window."""

    to_block: FloatArray
    """Affine maps of places to three coordinates, shape (2, 3, 4)."""
    parts: FloatArray
    """Number of equal parts of each coordinate, and number of shells, shape (2, 4)."""
    repeats: FloatArray
    """1 where the fractional part of a coordinate counts, else 0, shape (2, 3)."""
    form: FloatArray
    """
    Quadratic form of the coordinates minus ½ that gives the squared distance from the middle.

    Shape (2, 6). The outermost shell ends at the distance 1. Zeros if there are no shells.
    """
    halves: Flag
    """True for octants, that is halves of coordinates that repeat, which are found faster."""


class Bins(NamedTuple):
    """What gaps are added to."""

    partition: Partition
    """In which block a gap's middle lies."""
    cutoffs: FloatArray
    """
    Cut-offs in ascending order, shape (C,); a gap goes to the bin of the largest that it reaches.

    If there is none, gaps are tallied instead.
    """
    sums: FloatArray
    """
    Number, length and squared length of the gaps in B blocks, shape (D, 2, 2, B * C, 3).

    The axes of the array are: direction, whole or window, set of solids, block and cut-off, sum. A
    kernel sees one direction, without D. Gaps are weighted by the rule at the window's surface. For
    ``ends`` the three sums are half the number of ends, the length inside, and the number of gaps
    that are kept.
    """

    def of_whole(self, center: FloatArray) -> Bins:
        """The same bins, by the whole's blocks for what lies in a window about a centre."""
        to_block, parts, repeats, form, halves = self.partition
        to_block = to_block[::-1].copy()
        to_block[:, :, 3] += to_block[:, :, :3] @ center
        parts, repeats, form = parts[::-1].copy(), repeats[::-1].copy(), form[::-1].copy()
        return self._replace(partition=Partition(to_block, parts, repeats, form, halves))


class Task(NamedTuple):
    """The lines of a strip, what is counted on them, and where the sums go."""

    lines: FloatArray
    """State of the lines, shape (STATE_SIZE,)."""
    strip: Strip
    counts: Counts
    tally: FloatArray
    """Sums for the two sets of solids, shape (2, TALLY_SIZE)."""
    bins: Bins
    """If they have cut-offs, every gap is added here and not to the tally."""


class Sphere(NamedTuple):
    """A sphere, projected."""

    u: float
    v: float
    depth: float
    radius: float


def section_along(triads: FloatArray, window: Convex | None) -> Section:
    """
    The section of a window for lines along the third row of each triad, shape (D, 3, 3).

    Nothing clips lines without a window. On a line the quadric x·Q x = L is a quadratic equation
    in the depth t. With q the matrix Q in the triad,

        t = -(q_un u + q_vn v) / q_nn ± √(L / q_nn - a u² - 2 b u v - c v²),

    where a = q_uu / q_nn - (q_un / q_nn)², and b, c likewise.
    """
    planes, form, level, reach = np.zeros((0, 4)), np.eye(3), np.inf, np.inf
    if window is not None:
        planes, (form, level), reach = window.planes, window.quadric, window.reach
    # the operator @ would wake the threads of BLAS, in each job of a scan
    q = np.einsum("dil,djl->dij", np.einsum("dik,kl->dil", triads, form), triads)
    along, flat = q[:, 2, 2:], FLAT * np.trace(form) + LEAST
    lean = np.where(along < flat, 0.0, q[:, 2, :2])
    along = np.maximum(along, flat)
    lean /= along
    quadric = np.empty((len(triads), 6))
    quadric[:, :1], quadric[:, 4:] = level / along, -lean
    quadric[:, 1:4] = q[:, [0, 0, 1], [0, 1, 1]] / along - lean[:, [0, 0, 1]] * lean[:, [0, 1, 1]]
    normals = np.einsum("pk,djk->dpj", planes[:, :3], triads)
    cuts = np.empty((*normals.shape[:2], 4))
    cuts[..., 0], cuts[..., 1:3] = planes[:, 3], normals[..., :2]
    # a line parallel to a plane meets it far beyond all other planes, in front or behind
    cuts[..., :3] /= np.maximum(np.abs(normals[..., 2:]), GRAZING)
    cuts[..., 3] = np.where(normals[..., 2] < 0.0, -1.0, 1.0)
    return Section(cuts, quadric, reach)


@inner(fastmath={"contract"}, error_model="numpy")
def begin(lines: FloatArray, strip: Strip, section: Section, counts: Counts) -> None:
    """
    Start the lines of a strip, which have met nothing yet, and find where they cross the window.

    Rows that serve only the window lose lines at their ends that miss it. Places of a row without a
    line hold NaN, which is neither larger nor smaller than any number.
    """
    level, a, b, c = section.quadric[0], section.quadric[1], section.quadric[2], section.quadric[3]
    rise_u, rise_v = section.quadric[4], section.quadric[5]
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        rest, aslant, aside = level - c * v * v, 2.0 * b * v, rise_v * v
        at = np.uint64(row * strip.pitch)
        for j in range(np.uint64(strip.pitch)):
            u = strip.first_u + strip.spacing * np.int32(j)
            half = np.sqrt(rest - (aslant + a * u) * u)
            middle = aside + rise_u * u
            lines[at + j + ENTRY], lines[at + j + EXIT] = middle - half, middle + half
        for k in range(section.planes.shape[0]):
            cut_row(lines, strip, section.planes, np.uint64(k), v, at)
        low, high = np.uint64(strip.low[row]), np.uint64(strip.high[row])
        if counts.whole is None:
            # lines at either end of the row that miss the window need no visit
            while low < high and not lines[at + low + ENTRY] < lines[at + low + EXIT]:
                low += ONE
            while low < high and not lines[at + high - ONE + ENTRY] < lines[at + high - ONE + EXIT]:
                high -= ONE
            strip.low[row], strip.high[row] = low, high
        for j in range(np.uint64(strip.pitch)):
            i = at + j
            is_line = (j >= low) & (j < high)
            enters, leaves = lines[i + ENTRY], lines[i + EXIT]
            # in a periodic medium, both are where the line's measured length begins
            is_met = is_line & (enters <= leaves)
            enters, leaves = enters if is_met else np.nan, leaves if is_met else np.nan
            lines[i + ENTRY], lines[i + EXIT] = enters, leaves
            set_off(lines, i, enters, leaves, is_line, counts)
            if counts.second is not None:
                set_off(lines, i + SET, enters, leaves, is_line, counts)


@part(fastmath={"contract"}, error_model="numpy")
def cut_row(
    lines: FloatArray, strip: Strip, planes: FloatArray, k: np.uint64, v: float, at: np.uint64
) -> None:
    """Cut the lines of a row at plane k."""
    slope, rest, enter = planes[k, 1], planes[k, 0] - planes[k, 2] * v, planes[k, 3] < 0.0
    for j in range(np.uint64(strip.pitch)):
        i = at + j
        depth = rest - slope * (strip.first_u + strip.spacing * np.int32(j))
        # NaN, a line that misses the quadric, stays NaN
        if enter:
            lines[i + ENTRY] = -depth if -depth > lines[i + ENTRY] else lines[i + ENTRY]
        else:
            lines[i + EXIT] = depth if depth < lines[i + EXIT] else lines[i + EXIT]


@inner(forceinline=True, error_model="numpy")
def set_off(
    lines: FloatArray,
    i: np.uint64,
    enters: float,
    leaves: float,
    is_line: bool | np.bool,
    counts: Counts,
) -> None:
    """Start a line that has met nothing yet: before all solids or where it enters the window."""
    lines[i + GAP_START] = lines[i + GAP_END] = -FAR
    if counts.window is not None and counts.window.start is not None:
        # NaN, a line that misses the window, stays NaN
        lines[i + END] = 0.0 * enters - FAR
        lines[i + BEFORE] = counts.window.margin - enters
        lines[i + BEHIND] = leaves + counts.window.margin
    elif counts.whole is not None:
        lines[i + END] = -FAR if is_line else np.nan
    else:
        lines[i + END] = enters


@inner(inline="always")
def span(
    centre: float, reach: float, first: float, per_spacing: float, low: int, high: int
) -> tuple[int, int]:
    """The lines from low to high, along one side of the grid, within ``reach`` of a centre."""
    start = int(np.ceil((centre - reach - first) * per_spacing))
    stop = int(np.floor((centre + reach - first) * per_spacing)) + 1
    return max(start, low), min(stop, high)


@inner(forceinline=True, error_model="numpy")
def columns_of_row(
    strip: Strip, sphere: Sphere, row: int, reach2: float, first: int, last: int
) -> tuple[int, int, float]:
    """
    The first column to visit in a row, the number of columns, and the expected number of chords.

    ``reach2`` is the square of half the circle's width in the row. The sphere reaches from column
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
