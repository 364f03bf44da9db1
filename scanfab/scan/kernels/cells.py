"""
Grains sorted into the cells of a grid, through which long segments are followed to their ends.

The sweep leaves segments that reach beyond the listed solids. In the grid, a ray finds the next
grain in a few steps. The grid divides the box of the grains or, where they repeat, their periods.
Every grain stands in all cells that it may reach into; one that reaches through a periodic face
stands in those on the other side, too, with the image by which it does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import ONE, inner
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.bins import add_gaps, list_gap, room_for_gaps
from scanfab.scan.kernels.strips import (
    BEFORE,
    BEHIND,
    END,
    ENTRY,
    EXIT,
    FAR,
    SET,
    Counts,
    Edge,
    Line,
    Measured,
    Strip,
    Task,
)
from scanfab.scan.kernels.sweep import (
    ASTRAY,
    LENGTH,
    NOTHING,
    STEPS,
    VOID,
    WHOLE,
    WINDOW,
    add,
    counted,
    listed_to,
)

# allows vector instructions in a loop that looks for the smallest number
NO_NAN = {"nnan", "nsz", "contract"}

# a ray that misses the grid by less than this fraction of a cell is in it, but for rounding
SLIGHT = 1e-9


class Cells(NamedTuple):
    """Grains by the cell of a grid."""

    sphere: FloatArray
    """
    Centre and radius of each entry, shape (K, 4).

    The entries of a cell lie together: looking up each grain elsewhere would take most of the time.
    """
    removed: BoolArray
    """Whether each entry is removed, shape (K,)."""
    vectors: FloatArray
    """Edges of the whole grid as rows; edges along which grains repeat are the periods."""
    inverse: FloatArray
    corner: FloatArray
    periodic: BoolArray
    parts: IntArray
    """Cells along each edge, shape (3,)."""
    start: IntArray
    """First entry of each cell, first edge fastest, and the end of the last cell."""
    farthest: float
    """A ray that has met nothing after this length stays in a channel of the periodic grains."""
    farthest_kept: float
    """The same for rays that pass through removed grains."""


@inner(inline="always")
def cell_of(parts: IntArray, i: int, j: int, k: int) -> int:
    """The number of a cell."""
    return int(i + parts[0] * (j + parts[1] * k))


class Ray(NamedTuple):
    """A half line on its way through the cells; its arrays are used for one ray after the other."""

    place: FloatArray
    """Where it begins, in the void, shape (3,); moved by periods as the ray crosses their faces."""
    along: FloatArray
    """Unit vector."""
    cell: IntArray
    """The cell that holds it, shape (3,)."""
    step: IntArray
    """1 or -1: the side on which it leaves its cell, along each edge of the grid."""
    out: FloatArray
    """Distance from its beginning to the next face across each edge of the grid."""
    width: FloatArray
    """Distance from one of these faces to the next."""


@inner()
def room_for_ray() -> Ray:
    """A ray to be filled in."""
    lengths, numbers = np.empty((4, 3)), np.empty((2, 3), np.int64)
    return Ray(lengths[0], lengths[1], numbers[0], numbers[1], lengths[2], lengths[3])


# The functions of a ray are inlined: counting references to all its arrays in each call would take
# longer than the work itself.


@inner(forceinline=True, fastmath=NO_NAN, error_model="numpy")
def first_in_cell(cells: Cells, ray: Ray, number: int, without_removed: bool) -> float:
    """
    Distance to the first solid that reaches into a cell.

    The ray begins in void, so each chord lies before or behind its beginning. The chord's middle
    decides which: the end of a solid that the ray leaves may lie ahead by rounding.
    """
    # no array is looked up in the loop
    sphere, removed, start = cells.sphere, cells.removed, cells.start
    p_x, p_y, p_z = ray.place[0], ray.place[1], ray.place[2]
    n_x, n_y, n_z = ray.along[0], ray.along[1], ray.along[2]
    found = FAR
    for entry in range(np.uint64(start[number]), np.uint64(start[number + 1])):
        x, y, z = sphere[entry, 0] - p_x, sphere[entry, 1] - p_y, sphere[entry, 2] - p_z
        depth = x * n_x + y * n_y + z * n_z
        radius = sphere[entry, 3]
        reach2 = radius * radius - (x * x + y * y + z * z - depth * depth)
        is_met = (depth > 0.0) & (reach2 > 0.0) & (not (without_removed & removed[entry]))
        # selections in place of branches, which would be predicted badly
        distance = depth - np.sqrt(reach2 if reach2 > 0.0 else 0.0)
        distance = distance if is_met else FAR
        found = distance if distance < found else found
    return found


@inner(forceinline=True, error_model="numpy")
def to_grid(cells: Cells, ray: Ray) -> float:
    """
    Distance at which the ray enters the grid, which has no end where grains repeat; FAR if never.

    Fills in the ray's beginning, counted in cells, as ``out``, and its slope as ``width``.
    """
    first = 0.0
    for i in range(3):
        at = rise = 0.0
        for j in range(3):
            at += (ray.place[j] - cells.corner[j]) * cells.inverse[j, i]
            rise += ray.along[j] * cells.inverse[j, i]
        parts = cells.parts[i]
        at, rise = at * parts, rise * parts
        ray.out[i], ray.width[i] = at, rise
        if not cells.periodic[i] and not 0.0 <= at <= parts:
            # otherwise it only moves away
            comes = rise > 0.0 if at < 0.0 else rise < 0.0
            first = max(first, ((0.0 if at < 0.0 else parts) - at) / rise if comes else FAR)
    for i in range(3):
        at = ray.out[i] + first * ray.width[i]
        if not cells.periodic[i] and not -SLIGHT <= at <= cells.parts[i] + SLIGHT:
            first = FAR
    return first


@inner(forceinline=True, error_model="numpy")
def begins_inside(cells: Cells, ray: Ray) -> bool:
    """Put the ray into its first cell; returns whether there is one."""
    first = to_grid(cells, ray)
    if first == FAR:
        return False
    for i in range(3):
        at, rise, parts = ray.out[i], ray.width[i], cells.parts[i]
        at += first * rise
        cell, period = np.floor(at), 0.0
        if cells.periodic[i]:
            period = np.floor(cell / parts)
            for j in range(3):
                ray.place[j] -= period * cells.vectors[i, j]
        else:
            cell = min(max(cell, 0.0), parts - 1.0)
        ray.cell[i] = int(cell) - int(period) * parts
        ray.step[i] = 1 if rise > 0.0 else -1
        ray.width[i] = 1.0 / abs(rise) if rise != 0.0 else FAR
        ray.out[i] = first + (cell + (rise > 0.0) - at) / rise if rise != 0.0 else FAR
    return True


@inner(forceinline=True, error_model="numpy")
def enters_next(cells: Cells, ray: Ray, through: int) -> bool:
    """Move the ray into its next cell; returns whether it is still in the grid."""
    step = ray.step[through]
    ray.out[through] += ray.width[through]
    ray.cell[through] += step
    if 0 <= ray.cell[through] < cells.parts[through]:
        return True
    ray.cell[through] -= step * cells.parts[through]
    for j in range(3):
        ray.place[j] -= step * cells.vectors[through, j]
    return bool(cells.periodic[through])


@inner(forceinline=True, error_model="numpy")
def next_solid(
    cells: Cells, ray: Ray, without_removed: bool, most_steps: float
) -> tuple[float, float]:
    """
    Distance from a ray's beginning in void to the next solid, FAR if there is none.

    Also returns the number of steps: one for each cell, and one for each grain in it.
    """
    found, steps = FAR, 0.0
    parts, out = cells.parts, ray.out
    farthest = cells.farthest_kept if without_removed else cells.farthest
    goes_on = begins_inside(cells, ray)
    while goes_on:
        number = cell_of(parts, ray.cell[0], ray.cell[1], ray.cell[2])
        here = first_in_cell(cells, ray, number, without_removed)
        found = here if here < found else found
        steps += 1.0 + cells.start[number + 1] - cells.start[number]
        through = 0 if out[0] < out[1] else 1
        through = through if out[through] < out[2] else 2
        nearest = out[through]
        # a solid found beyond this cell may lie behind others
        goes_on = found > nearest and nearest <= farthest and steps <= most_steps
        goes_on = goes_on and enters_next(cells, ray, through)
    return found, steps


class Beyond(NamedTuple):
    """All grains, for following lines where solids are not listed."""

    cells: Cells
    without_removed: bool
    """Whether the first set of solids lacks the removed grains, too."""
    most_steps: float
    """Most steps of following; a scan that needs more ends early, and its sums mean nothing."""


@inner(forceinline=True, error_model="numpy")
def followed(
    strip: Strip, line: Line, beyond: Beyond, which: int, ray: Ray, depth: float, sign: float
) -> tuple[float, float]:
    """Distance from a place on a line to the next solid, ahead or back; FAR if there is none."""
    triad = strip.triad
    for i in range(3):
        ray.place[i] = line[0] * triad[0, i] + line[1] * triad[1, i] + depth * triad[2, i]
        ray.along[i] = sign * triad[2, i]
    without = beyond.without_removed or which == 1
    return next_solid(beyond.cells, ray, without, beyond.most_steps)


@inner(forceinline=True, error_model="numpy")
def add_followed(task: Task, which: int, line: Line, low: float, high: float, sign: float) -> None:
    """Count a segment, with sign -1 remove it; a segment without an end is counted as left out."""
    if high - low > 0.5 * FAR:
        task.tally[which, WINDOW + ASTRAY] += 0.5
        return
    counts = task.counts
    if task.bins.cutoffs.size > 0:
        gaps = room_for_gaps(ONE)
        list_gap(gaps, 0, line, low, high, counts)
        add_gaps(task.bins, counts, gaps, np.uint64(ONE), sign, which, line[1])
        return
    a, b, c, d, e, _ = counted(True, low, high, line[2], line[3], counts)
    # the sweep has already counted all void in the window
    add(task.tally, which, (sign * a, sign * b, sign * c, sign * d, sign * e, NOTHING))


@inner(error_model="numpy")
def follow_measured(task: Task, which: int, measured: Measured, beyond: Beyond) -> None:
    """Tally the gaps that start in the measured length and end beyond the listed solids."""
    lines, strip, tally, ray = task.lines, task.strip, task.tally, room_for_ray()
    if measured.length == FAR:
        return
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.low[row], strip.high[row]):
            u = strip.first_u + column * strip.spacing
            place = np.uint64(row * strip.pitch + column)
            enters, end = lines[place + ENTRY], lines[place + SET * np.uint64(which) + END]
            is_empty = end == -FAR
            end = enters if is_empty else end
            if not enters <= end < enters + measured.length:
                continue
            if tally[0, STEPS] >= beyond.most_steps:
                return
            line = u, v, enters, enters
            far, steps = followed(strip, line, beyond, which, ray, end, 1.0)
            tally[0, STEPS] += steps
            if far == FAR and measured.endless:
                tally[which, WHOLE + ASTRAY] += 1.0
                tally[which, WHOLE + VOID] += enters + measured.length - end
            elif far < FAR and not is_empty:
                add_followed(task, which, line, end, end + far, 1.0)


@inner(error_model="numpy")
def follow_beyond(task: Task, which: int, edge: Edge, beyond: Beyond) -> None:
    """
    Tally the segments with one end in the window that reach beyond the listed solids.

    A line has at most two of them, one at either end. The sweep has counted the first one as if it
    began where the list does. Segments that meet no further solid leave the sample; only their
    number is known.
    """
    lines, strip, tally, counts = task.lines, task.strip, task.tally, task.counts
    ray, margin = room_for_ray(), listed_to(edge)
    # with a margin of FAR, the end of every segment is known
    every = Counts(counts.least, counts.second, None, Edge(edge.ends, edge.start, FAR), None)
    known = Task(lines, strip, every, tally, task.bins)
    # the listed part of a first segment is long enough to count it
    adds_on = task.bins.cutoffs.size == 0 and margin > counts.least
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.low[row], strip.high[row]):
            place = np.uint64(row * strip.pitch + column)
            state = place + SET * np.uint64(which)
            enters, leaves, end = lines[place + ENTRY], lines[place + EXIT], lines[state + END]
            # NaN: a line that misses the window
            is_met = end > -FAR
            begins_before = is_met & (-lines[state + BEFORE] <= enters - margin)
            goes_on = is_met & (end < leaves) & (lines[state + BEHIND] >= leaves + margin)
            if not (begins_before or goes_on) or tally[0, STEPS] >= beyond.most_steps:
                continue
            u = strip.first_u + column * strip.spacing
            line = u, v, enters, leaves
            if begins_before:
                far, steps = followed(strip, line, beyond, which, ray, enters - margin, -1.0)
                tally[0, STEPS] += steps
                begins = enters - margin - far
                if adds_on and far < FAR:
                    tally[which, WINDOW + LENGTH] += 0.5 * (-lines[state + BEFORE] - begins)
                else:
                    first, steps = followed(strip, line, beyond, which, ray, enters, 1.0)
                    tally[0, STEPS] += steps
                    add_followed(known, which, line, -lines[state + BEFORE], enters + first, -1.0)
                    add_followed(known, which, line, begins, enters + first, 1.0)
            if goes_on:
                far, steps = followed(strip, line, beyond, which, ray, leaves + margin, 1.0)
                tally[0, STEPS] += steps
                add_followed(known, which, line, end, leaves + margin + far, 1.0)
