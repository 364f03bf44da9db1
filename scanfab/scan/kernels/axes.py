"""A scan along several axes: spheres are projected, ordered by depth, and swept strip by strip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import LANES, ZERO, Flag, kernel, part
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.bins import bins_along
from scanfab.scan.kernels.cells import Beyond, follow_beyond, follow_measured
from scanfab.scan.kernels.grid import (
    Bounds,
    CellGrains,
    Spheres,
    open_grid,
    project,
    room_to_project,
    sort_into_strips,
    sphere_at,
    strip_of,
)
from scanfab.scan.kernels.lists import (
    Lists,
    bin_last_gaps,
    bin_lists,
    list_chords,
    room_for_lists,
    solve_closed,
    sweep_lists,
)
from scanfab.scan.kernels.periodic import Prism, cell_grid
from scanfab.scan.kernels.strips import (
    FAR,
    MOST_LINES,
    STATE_SIZE,
    Bins,
    Counts,
    Section,
    Strip,
    Task,
    begin,
)
from scanfab.scan.kernels.sweep import LINE_LENGTH, NOTHING, STEPS, VOID, settle, visit


class Axes(NamedTuple):
    """Several axes, and the grid of lines along each."""

    triads: FloatArray
    """Orthonormal rows u, v, n of each axis, shape (D, 3, 3): the lines run along n."""
    offsets: FloatArray
    """Shift of each axis' grid, in units of the spacing, shape (D, 2), or (D, 1) in a plane."""
    spacing: float


@part()
def sweep_strip(
    task: Task, spheres: Spheres, met: IntArray, reach: float, listed: Flag, lists: Lists
) -> None:
    """
    Let the lines of a strip meet the chords of spheres.

    ``reach`` is the radius of the ball that holds the window. Spheres beside it meet no line that
    meets the window.
    """
    done, counts = ZERO, task.counts
    if listed is not None:
        while done < met.size:
            done = list_chords(lists, task.strip, spheres, met, done)
            sweep_lists(task, lists)
    elif task.bins.cutoffs.size > 0:
        while done < met.size:
            done = list_chords(lists, task.strip, spheres, met, done)
            bin_lists(task, lists)
    else:
        for k in met:
            sphere = sphere_at(spheres, k)
            kept = np.nan if spheres.removed[k] else NOTHING
            if counts.whole is not None and counts.window is not None:
                away = reach + sphere.radius
                if sphere.u * sphere.u + sphere.v * sphere.v > away * away:
                    aside = Counts(counts.least, counts.second, True, None, None)
                    visit(Task(task.lines, task.strip, aside, task.tally, task.bins), sphere, kept)
                    continue
            visit(task, sphere, kept)


@part()
def scan_strips(
    lines: FloatArray,
    spheres: Spheres,
    grid: Strip,
    section: Section,
    tally: FloatArray,
    counts: Counts,
    listed: Flag,
    lists: Lists,
    bins: Bins,
    beyond: Beyond | None,
) -> None:
    """Scan a grid strip by strip, so that the lines' state stays in cache."""
    in_bins = bins.cutoffs.size > 0
    # a row of lines has to fit a strip
    columns = min(max(grid.columns, 1), MOST_LINES - LANES)
    rows = MOST_LINES // (columns + LANES)
    start, chosen = sort_into_strips(spheres, grid, rows)
    for column in range(0, grid.columns, columns):
        for number in range(start.size - 1):
            strip = strip_of(grid, number * rows, rows, column, columns)
            task = Task(lines, strip, counts, tally, bins)
            begin(lines, strip, section, counts)
            met = chosen[start[number] : start[number + 1]]
            sweep_strip(task, spheres, met, section.reach, listed, lists)
            for which in range(1 if counts.second is None else 2):
                solve_closed(task, spheres, met, which)
                if in_bins:
                    bin_last_gaps(task, which)
                else:
                    settle(task, which)
                if beyond is not None and counts.measured is not None:
                    follow_measured(task, which, counts.measured, beyond)
                if beyond is not None and counts.window is not None:
                    follow_beyond(task, which, counts.window, beyond)


@kernel
def scan_axes(
    grains: CellGrains,
    extent: Bounds,
    axes: Axes,
    sections: Section,
    prisms: Prism | None,
    counts: Counts,
    listed: Flag,
    bins: Bins,
    beyond: Beyond | None,
    tallies: FloatArray,
) -> None:
    """
    Scan a packing along several axes.

    Parameters
    ----------
    grains : CellGrains
        Spheres; the window's centre is the origin.
    extent : Bounds
        Bounds of the spheres of an open sample.
    axes : Axes
        The axes and the lines along them.
    sections : Section
        The window along each axis or, in a periodic medium, where the lines begin.
    prisms : Prism or None
        For the whole of a periodic medium, which has no edge: where the lines run along each axis.
    counts : Counts
        What is counted.
    listed : Flag
        Whether to list the chords of each line first, see :mod:`scanfab.scan.kernels.lists`: faster
        where a sphere meets few lines. For bins they are listed anyhow.
    bins : Bins
        If there are any cut-offs, every gap is added here and not to the tallies.
    beyond : Beyond or None
        What lies beyond the listed solids, if segments are followed there.
    tallies : shape (D, 2, TALLY_SIZE)
        Zeros; the results for each axis and set of solids.
    """
    lines = np.empty(STATE_SIZE)
    lists = room_for_lists(listed is not None or bins.cutoffs.size > 0)
    # kept from axis to axis: to get the pages of large arrays anew takes long
    room = room_to_project(ZERO if prisms is not None else grains.radius.size)
    for axis in range(axes.triads.shape[0]):
        if beyond is not None and tallies[:, 0, STEPS].sum() >= beyond.most_steps:
            return
        triad, offset, tally = axes.triads[axis], axes.offsets[axis], tallies[axis]
        section = Section(sections.planes[axis], sections.quadric[axis], sections.reach)
        if prisms is None:
            counted, reach, margin = counts, np.inf, 0.0
            grid = open_grid(extent, triad, offset, axes.spacing, section.reach, counts)
            if counts.window is not None and counts.window.start is not None:
                # other spheres change no line
                reach, margin = section.reach, counts.window.margin
            spheres = project(grains, triad, grid, reach, margin, room)
        else:
            prism = Prism(prisms.edges[axis], prisms.repeats[axis], prisms.climb[axis])
            spheres, grid, measured = cell_grid(grains, triad, prism, offset, axes.spacing)
            counted = Counts(counts.least, counts.second, True, None, measured)
        here = bins_along(bins, triad, axis)
        scan_strips(lines, spheres, grid, section, tally, counted, listed, lists, here, beyond)
        if prisms is not None and measured.length == FAR:
            # the void and the length of a line from the first solid to the last mean nothing
            tally[:, VOID] = tally[:, LINE_LENGTH] = 0.0
