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
from scanfab.scan.kernels.bins import add_gaps, list_gap, room_for_gaps
from scanfab.scan.kernels.cells import Cells, Ray, next_solid, room_for_ray
from scanfab.scan.kernels.grid import Spheres, sort_by, sphere_at
from scanfab.scan.kernels.lists import list_settled
from scanfab.scan.kernels.strips import (
    BEFORE,
    BEHIND,
    END,
    ENTRY,
    EXIT,
    FAR,
    GAP_END,
    GAP_START,
    SET,
    Counts,
    Edge,
    Line,
    Measured,
    Task,
    set_off,
    span,
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
    both,
    counted,
    is_listed,
    listed_to,
    meet,
)

# chords that there is room for at first
SOME = 256


@inner()
def closed_lines(task: Task, which: int) -> tuple[IntArray, IntArray]:
    """The number of closed lines before each place of a strip, and the places of closed lines."""
    lines, state, closed = task.lines, SET * np.uint64(which), 0
    places = task.strip.rows * task.strip.pitch
    for i in range(np.uint64(places)):
        closed += lines[i + state + END] == FAR
    places = places if closed else 0  # most strips have none
    first, place_of = np.zeros(places + 1, np.int64), np.empty(closed, np.int64)
    count = 0
    for place in range(first.size - 1):
        if lines[np.uint64(place) + state + END] == FAR:
            place_of[count] = place
            count += 1
        first[place + 1] = count
    return first, place_of


@part(error_model="numpy")
def chords_of(
    task: Task, spheres: Spheres, chosen: IntArray, which: int, first: IntArray, place_of: IntArray
) -> tuple[FloatArray, IntArray]:
    """
    Find the chords of closed lines, in the order of their spheres' depths.

    Returns where each chord starts and stops and, as a third row, the number of the line's chord
    before it, shape (3, M); and the number of each line's last chord. Behind a line's first chord
    comes -1.
    """
    strip, met = task.strip, 0
    chords, last = np.empty((3, SOME)), np.full(place_of.size, -1)
    for k in chosen:
        sphere = sphere_at(spheres, k)
        rows = span(sphere.v, sphere.radius, strip.first_v, strip.per_spacing, 0, strip.rows)
        columns = span(sphere.u, sphere.radius, strip.first_u, strip.per_spacing, 0, strip.columns)
        if columns[0] >= columns[1] or (which == 1 and spheres.removed[k]):
            continue
        for row in range(rows[0], rows[1]):
            dv = strip.first_v + row * strip.spacing - sphere.v
            reach2 = sphere.radius * sphere.radius - dv * dv
            at = row * strip.pitch
            for line in range(first[at + columns[0]], first[at + columns[1]]):
                du = strip.first_u - sphere.u + (place_of[line] - at) * strip.spacing
                rest2 = reach2 - du * du
                if not rest2 >= 0.0:
                    continue
                if met == chords.shape[1]:
                    chords = np.concatenate((chords, np.empty_like(chords)), axis=1)
                half_chord = np.sqrt(rest2)
                chords[0, met] = sphere.depth - half_chord
                chords[1, met] = sphere.depth + half_chord
                chords[2, met], last[line] = last[line], met
                met += 1
    return chords, last


@part(error_model="numpy")
def sweep_again(
    task: Task, which: int, place: int, chords: FloatArray, order: IntArray, sign: float
) -> None:
    """Sweep one line afresh over its chords, in this order; sign -1 removes the settled gaps."""
    lines, strip, counts = task.lines, task.strip, task.counts
    i, gaps, count = np.uint64(place), room_for_gaps(order.size), np.uint64(0)
    k, (row, column) = i + SET * np.uint64(which), divmod(place, strip.pitch)
    enters, leaves = lines[i + ENTRY], lines[i + EXIT]
    u, v = strip.first_u + column * strip.spacing, strip.first_v + row * strip.spacing
    line = u, v, enters, leaves
    set_off(lines, k, enters, leaves, True, counts)
    state = lines[k + END], lines[k + GAP_START], lines[k + GAP_END]
    sums = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in order:
        start, stop = chords[0, j], chords[1, j]
        if task.bins.cutoffs.size > 0:
            state, count = list_settled(task, k, line, (start, stop), state, gaps, count)
        elif is_listed(start, enters, counts):
            sums = both(sums, meet(lines, k, line, start, stop, counts))
    if task.bins.cutoffs.size > 0:
        lines[k + END], lines[k + GAP_START], lines[k + GAP_END] = state
        add_gaps(task.bins, counts, gaps, count, sign, which, v)
    a, b, c, d, e, f = sums
    add(task.tally, which, (sign * a, sign * b, sign * c, sign * d, sign * e, sign * f))


@part()
def solve_closed(task: Task, spheres: Spheres, chosen: IntArray, which: int) -> None:
    """
    Sweep closed lines again, over their chords in the order of their starts.

    This is exact, since no chord can reach back. What the sweep by depth has counted is removed.
    """
    first, place_of = closed_lines(task, which)
    if place_of.size == 0:
        return
    chords, last = chords_of(task, spheres, chosen, which, first, place_of)
    order = np.empty(chords.shape[1], np.int64)
    for number in range(place_of.size):
        begin, k = order.size, last[number]
        while k >= 0:
            begin -= 1
            order[begin] = k
            k = np.int64(chords[2, k])
        sweep_again(task, which, place_of[number], chords, order[begin:], -1.0)
        sort_by(chords[0], order[begin:])
        sweep_again(task, which, place_of[number], chords, order[begin:], 1.0)


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
