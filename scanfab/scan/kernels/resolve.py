"""
What the sweep of a strip leaves: closed lines, and segments that reach beyond the listed solids.

Closed lines are solved from lists of their chords, which is slow and always exact. Long segments
are followed to their ends through the cells of a grid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import ONE, inner, part
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.bins import count_gaps
from scanfab.scan.kernels.cells import Cells, Ray, next_solid, room_for_ray
from scanfab.scan.kernels.grid import Spheres, sort_by, sphere_at
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
    Sphere,
    Task,
    span,
)
from scanfab.scan.kernels.sweep import (
    ASTRAY,
    LENGTH,
    STEPS,
    VOID,
    WHOLE,
    WINDOW,
    begins_at,
    is_listed,
    listed_to,
    moved,
    reaches_in,
)


@part()
def closed_lines(task: Task, which: int, closed: int) -> tuple[IntArray, IntArray]:
    """The number of closed lines before each place of a strip, and the places of closed lines."""
    strip = task.strip
    first, place_of = np.zeros(strip.rows * strip.pitch + 1, np.int64), np.empty(closed, np.int64)
    count = 0
    for place in range(first.size - 1):
        if task.lines[np.uint64(place) + SET * np.uint64(which) + END] == FAR:
            place_of[count] = place
            count += 1
        first[place + 1] = count
    return first, place_of


@part(forceinline=True, error_model="numpy")
def cut(
    task: Task,
    sphere: Sphere,
    first: IntArray,
    place_of: IntArray,
    stop: IntArray,
    chords: FloatArray,
) -> int:
    """
    List the chords that a sphere cuts from closed lines; without room for them, count them.

    The chords of line k are counted in ``stop[k + 2]``, and its list ends at ``stop[k + 1]``.
    Returns the number of chords.
    """
    strip, met = task.strip, 0
    rows = span(sphere.v, sphere.radius, strip.first_v, strip.per_spacing, 0, strip.rows)
    columns = span(sphere.u, sphere.radius, strip.first_u, strip.per_spacing, 0, strip.columns)
    if columns[0] >= columns[1]:
        return 0
    for row in range(rows[0], rows[1]):
        dv = strip.first_v + row * strip.spacing - sphere.v
        reach2 = sphere.radius * sphere.radius - dv * dv
        at = row * strip.pitch
        for line in range(first[at + columns[0]], first[at + columns[1]]):
            du = strip.first_u - sphere.u + (place_of[line] - at) * strip.spacing
            rest2 = reach2 - du * du
            if not rest2 >= 0.0:
                continue
            met += 1
            if chords.size > 0:
                place, half_chord = stop[line + 1], np.sqrt(rest2)
                chords[0, place] = sphere.depth - half_chord
                chords[1, place] = sphere.depth + half_chord
                stop[line + 1] += 1
            else:
                stop[line + 2] += 1
    return met


@part(error_model="numpy")
def chords_of(
    task: Task, spheres: Spheres, chosen: IntArray, which: int, first: IntArray, place_of: IntArray
) -> tuple[IntArray, FloatArray]:
    """
    List the chords of closed lines, line by line, each list in the order of depth.

    Returns the start of each line's list, with the end of the last list behind, and where the
    chords start and stop, shape (2, M).
    """
    stop, chords = np.zeros(place_of.size + 2, np.int64), np.empty((2, 0))
    hit, hits = np.empty_like(chosen), 0
    for k in chosen:
        if which == 0 or not spheres.removed[k]:
            hit[hits] = k
            hits += cut(task, sphere_at(spheres, k), first, place_of, stop, chords) > 0
    for line in range(2, stop.size):
        stop[line] += stop[line - 1]
    chords = np.empty((2, stop[-1]))
    # while a list fills, its start moves to its end
    for k in hit[:hits]:
        cut(task, sphere_at(spheres, k), first, place_of, stop, chords)
    return stop, chords


@part(error_model="numpy")
def gaps_of(
    line: Line, chords: FloatArray, order: IntArray, counts: Counts, gaps: FloatArray
) -> tuple[int, float]:
    """
    List where the gaps that the sweep settles on one line start and end, shape (2, M).

    Returns their number and where the line's last solid ends. With chords ordered by their middles,
    these are the gaps that the sweep has counted, none after the line was closed. With chords
    ordered by their starts, they are exact, since no chord can reach back.
    """
    _, _, enters, leaves = line
    end, low, high = -FAR, -FAR, -FAR
    before, behind, count = FAR, FAR, 0
    if counts.window is not None and counts.window.start is not None:
        before, behind = counts.window.margin - enters, leaves + counts.window.margin
    elif counts.whole is None:
        end = enters
    for k in order:
        start, stop = chords[0, k], chords[1, k]
        if not is_listed(start, enters, counts):
            continue
        if counts.window is not None and counts.window.start is not None:
            before = min(before, -stop) if start <= enters else before
            behind = min(behind, start) if start >= leaves else behind
            if not reaches_in(start, stop, enters, leaves):
                continue
        gaps[0, count], gaps[1, count] = begins_at(low, before), high
        count += start > end
        end, low, high = moved(start, stop, end, low, high)
    if end < FAR:
        gaps[0, count], gaps[1, count] = begins_at(low, before), high
        gaps[0, count + 1], gaps[1, count + 1] = end, behind
        count += 2
    return count, end


@part()
def solve_closed(task: Task, spheres: Spheres, chosen: IntArray, which: int, closed: int) -> None:
    """Replace what the sweep has tallied on closed lines by the gaps of their lists of chords."""
    lines, strip = task.lines, task.strip
    first, place_of = closed_lines(task, which, closed)
    stop, chords = chords_of(task, spheres, chosen, which, first, place_of)
    starts, gaps = chords[0], np.empty((2, chords.shape[1] + 2))
    order = np.empty(starts.size, np.int64)
    for k in range(order.size):
        order[k] = k
    for number in range(closed):
        row, column = place_of[number] // strip.pitch, place_of[number] % strip.pitch
        u, v = strip.first_u + column * strip.spacing, strip.first_v + row * strip.spacing
        place = np.uint64(place_of[number])
        line = u, v, lines[place + ENTRY], lines[place + EXIT]
        its = order[stop[number] : stop[number + 1]]
        count, _ = gaps_of(line, chords, its, task.counts, gaps)
        count_gaps(task, which, line, gaps, count, -1.0)
        sort_by(starts, its)
        count, end = gaps_of(line, chords, its, task.counts, gaps)
        count_gaps(task, which, line, gaps, count, 1.0)
        lines[place + SET * np.uint64(which) + END] = end


class Beyond(NamedTuple):
    """All grains, for following lines along one axis."""

    cells: Cells
    triad: FloatArray
    without_removed: bool
    """Whether the first set of solids lacks the removed grains, too."""
    most_steps: float
    """Most steps of following; a scan that needs more ends early, and its sums mean nothing."""
    endless: bool
    """Whether a line that meets no further solid stays in a channel of a periodic medium."""


@inner(forceinline=True, error_model="numpy")
def followed(
    line: Line, beyond: Beyond, which: int, ray: Ray, depth: float, sign: float
) -> tuple[float, float]:
    """Distance from a place on a line to the next solid, ahead or back; FAR if there is none."""
    triad = beyond.triad
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
    ends, void = np.empty((2, 1)), task.tally[which, WINDOW + VOID]
    ends[0, 0], ends[1, 0] = low, high
    count_gaps(task, which, line, ends, ONE, sign)
    # the sweep has already counted all void in the window
    task.tally[which, WINDOW + VOID] = void


@inner(error_model="numpy")
def follow_measured(task: Task, which: int, measured: Measured, beyond: Beyond) -> None:
    """Tally the gaps that start in the measured length and end beyond the listed solids."""
    lines, strip, tally, ray = task.lines, task.strip, task.tally, room_for_ray()
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
            far, steps = followed(line, beyond, which, ray, end, 1.0)
            tally[0, STEPS] += steps
            if far == FAR and beyond.endless:
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
                far, steps = followed(line, beyond, which, ray, enters - margin, -1.0)
                tally[0, STEPS] += steps
                begins = enters - margin - far
                if adds_on and far < FAR:
                    tally[which, WINDOW + LENGTH] += 0.5 * (-lines[state + BEFORE] - begins)
                else:
                    first, steps = followed(line, beyond, which, ray, enters, 1.0)
                    tally[0, STEPS] += steps
                    add_followed(known, which, line, -lines[state + BEFORE], enters + first, -1.0)
                    add_followed(known, which, line, begins, enters + first, 1.0)
            if goes_on:
                far, steps = followed(line, beyond, which, ray, leaves + margin, 1.0)
                tally[0, STEPS] += steps
                add_followed(known, which, line, end, leaves + margin + far, 1.0)
