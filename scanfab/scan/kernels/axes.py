"""A scan along several axes: spheres are projected, ordered by depth, and swept strip by strip."""

from __future__ import annotations

import numpy as np

from scanfab.base.jit import LANES, ZERO, Flag, inner, kernel
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.beyond import Beyond, follow_beyond
from scanfab.scan.kernels.bins import Bins, bins_along
from scanfab.scan.kernels.cells import Cells
from scanfab.scan.kernels.follow import follow
from scanfab.scan.kernels.grid import Grid, bounds, open_grid, part_of, strip_of
from scanfab.scan.kernels.lines import solve_closed
from scanfab.scan.kernels.lists import (
    LISTED_LINES,
    Lists,
    bin_last_gaps,
    bin_lists,
    list_chords,
    room_for_lists,
    sweep_lists,
)
from scanfab.scan.kernels.periodic import CellGrains, Prism, cell_grid, measured_in
from scanfab.scan.kernels.projection import Spheres, project, sort_into_strips, sphere_at
from scanfab.scan.kernels.start import visit_beyond
from scanfab.scan.kernels.strips import (
    MOST_LINES,
    STATE_SIZE,
    Edge,
    Strip,
    begin,
    measure_from,
)
from scanfab.scan.kernels.sweep import CHORDS, NOTHING, STEPS, Measured, settle, visit
from scanfab.scan.kernels.windows import Clip, Section, section_along

SMALLEST = 5e-324


@inner()
def visit_all(
    lines: FloatArray,
    strip: Strip,
    spheres: Spheres,
    chosen: IntArray,
    section: Section,
    least: float,
    tally: FloatArray,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> None:
    """Visit the chosen spheres, and do for each only what it can change."""
    for k in chosen:
        sphere = sphere_at(spheres, k)
        kept = np.nan if spheres.removed[k] else NOTHING
        if window is not None and window.start is not None:
            away = np.sqrt(sphere.u * sphere.u + sphere.v * sphere.v + sphere.depth * sphere.depth)
            if away - sphere.radius > section.reach:
                tally[0, CHORDS] += visit_beyond(lines, strip, sphere, kept, second)
                continue
            if away + sphere.radius < section.core:
                inside = Edge(None, True, window.margin, True)
                visit(lines, strip, sphere, kept, least, tally, second, whole, inside, measured)
                continue
        if whole is not None and window is not None:
            reach = section.reach + sphere.radius
            if sphere.u * sphere.u + sphere.v * sphere.v > reach * reach:
                # its lines miss the window
                visit(lines, strip, sphere, kept, least, tally, second, whole, None, measured)
                continue
        visit(lines, strip, sphere, kept, least, tally, second, whole, window, measured)


@inner()
def visit_listed(
    lines: FloatArray,
    lists: Lists,
    strip: Strip,
    spheres: Spheres,
    chosen: IntArray,
    least: float,
    tally: FloatArray,
    bins: Bins,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
) -> None:
    """List the chords of the chosen spheres, and sweep the lists when one is full and at last."""
    done = ZERO
    while done < chosen.size:
        done = list_chords(lists, strip, spheres, chosen, done)
        if bins.cutoffs.size > 0:
            bin_lists(lines, lists, strip, least, tally, bins, second, whole, window, measured)
        else:
            sweep_lists(lines, lists, strip, least, tally, second, whole, window, measured)


@inner()
def most_lines(lists: Lists) -> int:
    """So many lines a strip may have."""
    return LISTED_LINES if lists.stop.size > 0 else MOST_LINES


@inner()
def scan_strips(
    lines: FloatArray,
    spheres: Spheres,
    grid: Grid,
    section: Section,
    cutoff: float,
    tally: FloatArray,
    lists: Lists,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    measured: Measured | None,
    medium: tuple[CellGrains, Prism] | None,
    most_steps: float,
    bins: Bins,
    beyond: Beyond | None,
) -> None:
    """Scan a grid strip by strip, so that the lines' state stays in cache."""
    least = max(cutoff, SMALLEST)
    pitch = grid.columns + LANES
    by_lists, in_bins = lists.stop.size > 0, bins.cutoffs.size > 0
    rows = max(most_lines(lists) // pitch, 1)
    start, chosen = sort_into_strips(spheres, grid, rows)
    for number in range(start.size - 1):
        strip = strip_of(grid, number, rows, pitch)
        met = chosen[start[number] : start[number + 1]]
        begin(lines, strip, section, second, whole, window)
        if medium is not None:
            measure_from(lines, strip, medium[1].rise_u, medium[1].rise_v)
        flags = second, whole, window, measured
        if by_lists:
            visit_listed(lines, lists, strip, spheres, met, least, tally, bins, *flags)
        else:
            visit_all(lines, strip, spheres, met, section, least, tally, *flags)
        for which in range(1 if second is None else 2):
            if in_bins:
                closed = bin_last_gaps(lines, strip, which, bins, whole, window, measured)
            else:
                closed = settle(lines, strip, which, least, tally, whole, window, measured)
            if closed > 0.0:
                solve_closed(
                    lines,
                    spheres,
                    met,
                    strip,
                    which,
                    int(closed),
                    least,
                    tally,
                    whole,
                    window,
                    measured,
                    bins,
                )
            if medium is not None:
                follow(
                    lines, strip, which, medium[0], medium[1], least, most_steps, tally, bins,
                )  # fmt: skip
            if beyond is not None and window is not None:
                follow_beyond(lines, strip, which, window, beyond, least, tally, bins)


@kernel
def scan_axes(
    position: FloatArray,
    radius: FloatArray,
    removed: BoolArray,
    triads: FloatArray,
    offsets: FloatArray,
    spacing: float,
    cutoff: float,
    clip: Clip,
    tallies: FloatArray,
    by_lists: bool,
    second: Flag,
    whole: Flag,
    window: Edge | None,
    bins: Bins,
    cells: Cells | None,
    without_removed: bool,
    most_steps: float,
) -> None:
    """
    Scan a packing along several axes.

    Parameters
    ----------
    position, radius : shapes (N, 3), (N,)
        Spheres; the window's centre is the origin.
    removed : shape (N,)
        Spheres that are not solid in the second set of solids.
    triads : shape (D, 3, 3)
        Orthonormal rows u, v, n of each axis: the lines run along n.
    offsets : shape (D, 2), or (D, 1) in a plane
        Shift of each axis' grid, in units of the spacing.
    clip : Clip
        The window.
    tallies : shape (D, 2, TALLY_SIZE)
        Zeros; the results for each axis and set of solids.
    by_lists : bool
        Whether to list the chords of each line first, see :mod:`scanfab.scan.kernels.lists`: faster
        where a sphere meets few lines. For bins they are listed anyhow.
    second, whole : True or None
        What is counted, see :mod:`scanfab.scan.kernels.sweep`.
    window : Edge or None
        Likewise, and by which rule.
    bins : Bins
        Where every gap is added, instead of to the tallies, if there are any.
    cells : Cells or None
        What lies beyond the window, for a rule that follows segments there.
    without_removed : bool
        Whether that is without the removed grains in both sets of solids.
    most_steps : float
        Of following segments, all directions together; then the scan ends, and its tallies are
        worth nothing.
    """
    left = most_steps
    lines = np.empty(STATE_SIZE)
    lists = room_for_lists(by_lists or bins.cutoffs.size > 0)
    # a row of lines has to fit a strip
    most = most_lines(lists) - LANES
    extent = bounds(position, radius)
    for axis in range(triads.shape[0]):
        triad = triads[axis]
        grid = open_grid(extent, triad, offsets[axis], spacing, clip.reach, whole is not None)
        spheres = project(position, radius, removed, triad, grid, clip.reach, window)
        section = section_along(clip, triad)
        beyond = None
        if cells is not None:
            if left <= 0.0:
                return
            beyond = Beyond(cells, triad, without_removed, left)
        for first in range(0, grid.columns, most):
            scan_strips(
                lines,
                spheres,
                part_of(grid, first, most),
                section,
                cutoff,
                tallies[axis],
                lists,
                second,
                whole,
                window,
                None,
                None,
                np.inf,
                bins_along(bins, triad, axis),
                beyond,
            )
        left -= tallies[axis, 0, STEPS]


@kernel
def scan_cell(
    grains: CellGrains,
    normals: FloatArray,
    offsets: FloatArray,
    spacing: float,
    cutoff: float,
    clip: Clip,
    tallies: FloatArray,
    by_lists: bool,
    second: Flag,
    bins: Bins,
    most_steps: float,
) -> None:
    """
    Scan a periodic medium along several directions: the whole of it, that has no edge.

    ``normals`` has shape (D, 3), ``clip`` is that of no window, the rest is as in
    :func:`scan_axes`. When following lines has
    taken ``most_steps``, all directions together, the scan ends and its tallies are worth nothing.
    """
    left = most_steps
    lines = np.empty(STATE_SIZE)
    lists = room_for_lists(by_lists or bins.cutoffs.size > 0)
    most = most_lines(lists) - LANES
    for axis in range(normals.shape[0]):
        prism, spheres, grid = cell_grid(grains, normals[axis], offsets[axis], spacing)
        tally = tallies[axis]
        measured = measured_in(grains, prism)
        section = section_along(clip, prism.triad)
        here = bins_along(bins, prism.triad, axis)
        for first in range(0, grid.columns, most):
            part = part_of(grid, first, most)
            if left <= tally[0, STEPS]:
                return
            # along an axis that is not periodic a line runs from the first solid to the last
            if grains.periodic[prism.third]:
                medium = grains, prism
                scan_strips(
                    lines, spheres, part, section, cutoff, tally, lists, second, True, None,
                    measured, medium, left, here, None,
                )  # fmt: skip
            else:
                scan_strips(
                    lines, spheres, part, section, cutoff, tally, lists, second, True, None, None,
                    None, np.inf, here, None,
                )  # fmt: skip
        left -= tally[0, STEPS]
