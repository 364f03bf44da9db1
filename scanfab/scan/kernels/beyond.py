"""Segments that leave the window, followed to the solids between which they lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import ZERO, inner
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.bins import Bins, add_gaps, list_gap, room_for_gaps
from scanfab.scan.kernels.cells import Cells, Ray, next_solid, room_for_ray
from scanfab.scan.kernels.edges import cut_at_entry, listed_to, window_gap
from scanfab.scan.kernels.strips import (
    END,
    ENTRY,
    EXIT,
    FAR,
    FIRST,
    GAP_END,
    GAP_START,
    SET,
    Edge,
    Strip,
)
from scanfab.scan.kernels.sweep import KEPT, LEFT, LENGTH, STEPS, WINDOW

__all__ = ["Beyond", "follow_beyond"]


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
    u: float,
    v: float,
    enters: float,
    leaves: float,
    least: float,
    which: int,
    edge: Edge,
    tally: FloatArray,
    bins: Bins,
) -> None:
    """Add a segment to the tallies or the bins; one without an end to those that are left out."""
    if high - low > 0.5 * FAR:
        tally[which, LEFT] += 0.5
    elif bins.cutoffs.size > 0:
        one = room_for_gaps(1)
        list_gap(one, ZERO, u, low, high, enters, leaves, None, edge, None)
        add_gaps(bins, one, np.uint64(1), 1.0, which, v, None, edge)
    else:
        length, number, _ = window_gap(low, high, least, enters, leaves, None, edge)
        tally[which, WINDOW + LENGTH] += length
        tally[which, WINDOW + KEPT] += number


@inner(error_model="numpy")
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

    A line has two of them at most, one at either end. Those that meet no solid any more leave the
    sample: only their number is known.
    """
    # to it every place of a segment's beginning is known
    known = Edge(edge.ends, edge.start, FAR)
    ray = room_for_ray()
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.low[row], strip.high[row]):
            line = np.uint64(row * strip.pitch + column)
            state = line + SET * np.uint64(which)
            enters, leaves = lines[line + ENTRY], lines[line + EXIT]
            first, end = lines[state + FIRST], lines[state + END]
            if cut_at_entry(lines[state + GAP_START], lines[state + GAP_END], enters, leaves, edge):
                first = lines[state + GAP_END]
            goes_on = (end > enters) & (end < leaves)
            if (first == -FAR and not goes_on) or tally[0, STEPS] >= beyond.most_steps:
                continue
            u = strip.first_u + column * strip.spacing
            words = u, v, enters, leaves, least, which, known, tally, bins
            if first > -FAR:
                before = enters - listed_to(edge)
                far, steps = followed(beyond, ray, which, u, v, before, -1.0)
                tally[0, STEPS] += steps
                add_followed(before - far, first, *words)
            if goes_on:
                behind = leaves + listed_to(edge)
                far, steps = followed(beyond, ray, which, u, v, behind, 1.0)
                tally[0, STEPS] += steps
                add_followed(end, behind + far, *words)
