"""A scan along several axes: spheres are projected, ordered by depth, and swept strip by strip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import LANES, ZERO, Flag, kernel, part
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.bins import bins_along
from scanfab.scan.kernels.cells import Beyond, Cells, follow_beyond, follow_measured
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
from scanfab.scan.kernels.periodic import cell_grid, foot_of
from scanfab.scan.kernels.strips import (
    FAR,
    MOST_LINES,
    STATE_SIZE,
    Bins,
    Clip,
    Counts,
    Section,
    Strip,
    Task,
    begin,
    section_along,
)
from scanfab.scan.kernels.sweep import LINE_LENGTH, NOTHING, STEPS, VOID, settle, visit


class Axes(NamedTuple):
    """Several axes, and the grid of lines along each."""

    triads: FloatArray
    """Orthonormal rows u, v, n of each axis, shape (D, 3, 3): the lines run along n."""
    offsets: FloatArray
    """Shift of each axis' grid, in units of the spacing, shape (D, 2), or (D, 1) in a plane."""
    spacing: float


class Followed(NamedTuple):
    """What lines are followed through where solids are not listed."""

    cells: Cells
    without_removed: bool
    """Whether the first set of solids lacks the removed grains, too."""
    most_steps: float
    """
    Most steps of following, all directions together.

    A scan that needs more ends early, and its tallies mean nothing.
    """


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
    reach: float,
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
            sweep_strip(task, spheres, met, reach, listed, lists)
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
    extent: Bounds | None,
    axes: Axes,
    clip: Clip,
    counts: Counts,
    listed: Flag,
    bins: Bins,
    followed: Followed | None,
    tallies: FloatArray,
) -> None:
    """
    Scan a packing along several axes.

    Parameters
    ----------
    grains : CellGrains
        Spheres; the window's centre is the origin.
    extent : Bounds or None
        Bounds of the spheres; None for the whole of a periodic medium, which has no edge.
    axes : Axes
        The axes and the lines along them; in a periodic medium only the last row of each triad
        counts.
    clip : Clip
        The window.
    counts : Counts
        What is counted.
    listed : Flag
        Whether to list the chords of each line first, see :mod:`scanfab.scan.kernels.lists`: faster
        where a sphere meets few lines. For bins they are listed anyhow.
    bins : Bins
        If there are any cut-offs, every gap is added here and not to the tallies.
    followed : Followed or None
        What lies beyond the window, for a rule that follows segments there.
    tallies : shape (D, 2, TALLY_SIZE)
        Zeros; the results for each axis and set of solids.
    """
    lines = np.empty(STATE_SIZE)
    lists = room_for_lists(listed is not None or bins.cutoffs.size > 0)
    # kept from axis to axis: to get the pages of large arrays anew takes long
    room = room_to_project(ZERO if extent is None else grains.radius.size)
    left = np.inf if followed is None else followed.most_steps
    for axis in range(axes.triads.shape[0]):
        if left <= 0.0:
            return
        triad, offset, tally = axes.triads[axis], axes.offsets[axis], tallies[axis]
        if extent is not None:
            counted, endless, reach, margin = counts, False, np.inf, 0.0
            whole = counts.whole is not None
            grid = open_grid(extent, triad, offset, axes.spacing, clip.reach, whole)
            if counts.window is not None and counts.window.start is not None:
                # other spheres change no line
                reach, margin = clip.reach, counts.window.margin
            spheres = project(grains, triad, grid, reach, margin, room)
            section = section_along(clip, triad)
        else:
            prism, spheres, grid, measured = cell_grid(grains, triad[2], offset, axes.spacing)
            section, triad, endless = foot_of(prism, measured), prism.triad, prism.endless
            counted = Counts(counts.least, counts.second, True, None, measured)
        beyond = None
        if followed is not None:
            beyond = Beyond(followed.cells, triad, followed.without_removed, left, endless)
        here = bins_along(bins, triad, axis)
        scan_strips(
            lines, spheres, grid, section, clip.reach, tally, counted, listed, lists, here, beyond
        )
        if extent is None and measured.length == FAR:
            # the void and the length of a line from the first solid to the last mean nothing
            tally[:, VOID] = tally[:, LINE_LENGTH] = 0.0
        left -= tally[0, STEPS]
