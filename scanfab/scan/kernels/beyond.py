"""Segments that leave the window, followed to the solids between which they lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import ZERO, inner
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.bins import Bins, add_gaps, list_gap, room_for_gaps
from scanfab.scan.kernels.cells import Cells, Ray, next_solid, room_for_ray
from scanfab.scan.kernels.edges import listed_to, window_gap
from scanfab.scan.kernels.strips import (
    BEFORE,
    BEHIND,
    END,
    ENTRY,
    EXIT,
    FAR,
    SET,
    Edge,
    Strip,
)
from scanfab.scan.kernels.sweep import KEPT, LEFT, LENGTH, STEPS, WINDOW


class Beyond(NamedTuple):
    """What lies beyond a window, as the lines along one axis meet it."""

    cells: Cells
    triad: FloatArray
    without_removed: bool
    """Whether the first set of solids lacks the removed grains, too."""
    most_steps: float
    """Of following lines; then the scan ends, and what it has found is worth nothing."""


@inner(error_model="numpy")
def add_followed(
    low: float,
    high: float,
    sign: float,
    line: tuple[float, float, float, float],
    least: float,
    which: int,
    edge: Edge,
    tally: FloatArray,
    bins: Bins,
) -> None:
    """
    Add a segment to the tallies or the bins, or take it off; without an end, to what is left out.

    ``line``: where it is along u and v, where it enters and leaves the window.
    """
    u, v, enters, leaves = line
    if high - low > 0.5 * FAR:
        tally[which, LEFT] += 0.5
    elif bins.cutoffs.size > 0:
        one = room_for_gaps(1)
        list_gap(one, ZERO, u, low, high, enters, leaves, None, edge, None)
        add_gaps(bins, one, np.uint64(1), sign, which, v, None, edge)
    else:
        length, number, _ = window_gap(low, high, least, enters, leaves, None, edge)
        tally[which, WINDOW + LENGTH] += sign * length
        tally[which, WINDOW + KEPT] += sign * number


@inner(forceinline=True, error_model="numpy")
def followed(
    beyond: Beyond, ray: Ray, which: int, u: float, v: float, depth: float, sign: float
) -> tuple[float, float]:
    """How far from a place of a line the next solid is, along it or back; and the steps of that."""
    triad = beyond.triad
    for i in range(3):
        ray.place[i] = u * triad[0, i] + v * triad[1, i] + depth * triad[2, i]
        ray.along[i] = sign * triad[2, i]
    without = beyond.without_removed or which == 1
    return next_solid(beyond.cells, ray, without, beyond.most_steps)


@inner(error_model="numpy")
def follow_beyond(
    lines: FloatArray,
    strip: Strip,
    which: int,
    edge: Edge,
    beyond: Beyond,
    least: float,
    tally: FloatArray,
    bins: Bins,
) -> None:
    """
    Tally the segments with one end in the window that reach further than solids are listed.

    A line has two of them at most, one at either end. The first one has been counted as if it began
    where the list does. Those that meet no solid any more leave the sample: only their number is
    known.
    """
    # to it every place of a segment's end is known
    known = Edge(edge.ends, edge.start, FAR, None)
    ray = room_for_ray()
    # what is listed of a first segment suffices to count it
    adds_on = (bins.cutoffs.size == 0) & (listed_to(edge) > least)
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.low[row], strip.high[row]):
            place = np.uint64(row * strip.pitch + column)
            state = place + SET * np.uint64(which)
            enters, leaves, end = lines[place + ENTRY], lines[place + EXIT], lines[state + END]
            # NaN: a line that misses the window
            is_met = end > -FAR
            begins_before = is_met & (-lines[state + BEFORE] <= enters - listed_to(edge))
            goes_on = is_met & (end < leaves) & (lines[state + BEHIND] >= leaves + listed_to(edge))
            if not (begins_before or goes_on) or tally[0, STEPS] >= beyond.most_steps:
                continue
            u = strip.first_u + column * strip.spacing
            words = (u, v, enters, leaves), least, which, known, tally, bins
            if begins_before:
                far, steps = followed(beyond, ray, which, u, v, enters - listed_to(edge), -1.0)
                tally[0, STEPS] += steps
                if adds_on and far < FAR:
                    begins = enters - listed_to(edge) - far
                    tally[which, WINDOW + LENGTH] += 0.5 * (-lines[state + BEFORE] - begins)
                else:
                    first, steps = followed(beyond, ray, which, u, v, enters, 1.0)
                    tally[0, STEPS] += steps
                    add_followed(-lines[state + BEFORE], enters + first, -1.0, *words)
                    add_followed(enters - listed_to(edge) - far, enters + first, 1.0, *words)
            if goes_on:
                behind = leaves + listed_to(edge)
                far, steps = followed(beyond, ray, which, u, v, behind, 1.0)
                tally[0, STEPS] += steps
                add_followed(end, behind + far, 1.0, *words)
