"""A scan along several axes: spheres are projected, ordered by depth, and swept strip by strip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from scanfab.kernels.lines import Spheres, solve_closed, sort_by, span, sphere_at
from scanfab.kernels.periodic import CellGrains, Prism, images_in, next_solid, prism_along
from scanfab.kernels.sweep import (
    BOUND,
    CHANNELS,
    END,
    FAR,
    KEPT,
    LENGTH,
    MOST_LINES,
    SET,
    STATE_SIZE,
    VOID,
    WHOLE,
    WIDTH,
    Flag,
    Strip,
    begin,
    measure_from,
    settle,
    visit,
)

__all__ = ["Grid", "cover", "order_of", "project", "scan_axes", "scan_cell"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

SMALLEST = 5e-324


class Grid(NamedTuple):
    """Lines at (first_u + row * shear + column * spacing, first_v + row * spacing)."""

    spacing: float
    first_u: float
    first_v: float
    shear: float
    columns: int
    rows: int


@njit(nogil=True, cache=True)
def cover(
    low_u: float, high_u: float, low_v: float, high_v: float, offset: FloatArray, spacing: float
) -> Grid:
    """The lines ((i + offset_u) * spacing, (j + offset_v) * spacing) that meet a rectangle."""
    column = int(np.ceil(low_u / spacing - offset[0]))
    row = int(np.ceil(low_v / spacing - offset[1]))
    columns = int(np.floor(high_u / spacing - offset[0])) - column + 1
    rows = int(np.floor(high_v / spacing - offset[1])) - row + 1
    return Grid(
        spacing,
        (column + offset[0]) * spacing,
        (row + offset[1]) * spacing,
        0.0,
        max(columns, 0),
        max(rows, 0),
    )


class Bounds(NamedTuple):
    """A box and a sphere about the origin that hold all spheres."""

    centre: FloatArray
    half: FloatArray
    reach: float


@njit(nogil=True, cache=True)
def bounds(position: FloatArray, radius: FloatArray) -> Bounds:
    """What holds all spheres."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    reach = 0.0
    for k in range(radius.size):
        distance2 = 0.0
        for i in range(3):
            x = position[k, i]
            distance2 += x * x
            low[i], high[i] = min(low[i], x - radius[k]), max(high[i], x + radius[k])
        reach = max(reach, np.sqrt(distance2) + radius[k])
    return Bounds(0.5 * (low + high), 0.5 * (high - low), reach)


@njit(nogil=True, cache=True)
def shadow(extent: Bounds, side: FloatArray, low: float, high: float) -> tuple[float, float]:
    """Where the spheres may be along a side of the grid, and at least from low to high."""
    middle = half = 0.0
    for i in range(3):
        middle += extent.centre[i] * side[i]
        half += extent.half[i] * abs(side[i])
    return (
        min(low, max(middle - half, -extent.reach)),
        max(high, min(middle + half, extent.reach)),
    )


@njit(nogil=True, cache=True)
def order_of(values: FloatArray) -> IntArray:
    """Indices that sort the values: by buckets, in linear time unless most crowd in a few."""
    count = values.size
    low, high = np.inf, -np.inf
    for value in values:
        low, high = min(low, value), max(high, value)
    per_width = (count - 1) / (high - low) if high > low else 0.0
    stop = np.zeros(count + 1, np.int64)
    for value in values:
        stop[int((value - low) * per_width) + 1] += 1
    for bucket in range(count):
        stop[bucket + 1] += stop[bucket]
    # from starts of the buckets to their ends, while they fill
    order = np.empty(count, np.int64)
    for k in range(count):
        bucket = int((values[k] - low) * per_width)
        order[stop[bucket]] = k
        stop[bucket] += 1
    start = 0
    for bucket in range(count):
        sort_by(values, order[start : stop[bucket]])
        start = stop[bucket]
    return order


@njit(nogil=True, cache=True)
def project(
    position: FloatArray,
    radius: FloatArray,
    removed: BoolArray,
    frame: FloatArray,
    grid: Grid,
) -> Spheres:
    """The spheres that may meet a line, ordered by depth, in the frame with rows u, v, n."""
    met = np.empty(radius.size, np.int64)
    depth = np.empty(radius.size)
    count = 0
    per_spacing = 1.0 / grid.spacing
    for k in range(radius.size):
        x, y, z = position[k, 0], position[k, 1], position[k, 2]
        # a row within reach; whether a column is too, the visit will see
        row = (frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z - grid.first_v) * per_spacing
        reach = radius[k] * per_spacing
        met[count] = k
        depth[count] = frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z
        count += np.floor(row + reach) >= row - reach
    order = met[:count][order_of(depth[:count])]
    return Spheres(
        along(position, order, frame[0]),
        along(position, order, frame[1]),
        along(position, order, frame[2]),
        radius[order],
        removed[order],
    )


@njit(nogil=True, cache=True)
def along(position: FloatArray, chosen: IntArray, side: FloatArray) -> FloatArray:
    """Coordinates of the chosen spheres along a side of the frame."""
    found = np.empty(chosen.size)
    for i in range(chosen.size):
        k = chosen[i]
        found[i] = position[k, 0] * side[0] + position[k, 1] * side[1] + position[k, 2] * side[2]
    return found


@njit(nogil=True, cache=True)
def sort_into_strips(
    spheres: Spheres, grid: Grid, rows_per_strip: int
) -> tuple[IntArray, IntArray]:
    """
    The spheres that each strip of rows meets, in their order.

    Returns the start of each strip's list (one entry more than there are strips) and the lists.
    """
    strips = -(-grid.rows // rows_per_strip)
    start = np.zeros(strips + 1, np.int64)
    if strips == 1:
        start[1] = spheres.u.size
        return start, np.arange(spheres.u.size)
    chosen = np.empty(0, np.int64)
    per_spacing = 1.0 / grid.spacing
    for fill in range(2):
        place = start[:-1].copy()
        for k in range(spheres.u.size):
            first, last = span(
                spheres.v[k], spheres.radius[k], grid.first_v, per_spacing, grid.rows
            )
            if first < last:
                for strip in range(first // rows_per_strip, (last - 1) // rows_per_strip + 1):
                    if fill:
                        chosen[place[strip]] = k
                    place[strip] += 1
        if not fill:
            total = 0
            for strip in range(strips):
                total += place[strip]
                start[strip + 1] = total
            chosen = np.empty(start[-1], np.int64)
    return start, chosen


@njit(nogil=True, cache=True)
def visit_all(
    lines: FloatArray,
    strip: Strip,
    spheres: Spheres,
    chosen: IntArray,
    window_radius: float,
    least: float,
    tally: FloatArray,
    second: Flag,
    whole: Flag,
    window: Flag,
    measured: float | None,
) -> None:
    """Visit the chosen spheres, and do for each only what it can change."""
    for k in chosen:
        sphere = sphere_at(spheres, k)
        if whole is not None and window is not None:
            reach = window_radius + sphere.radius
            if sphere.u * sphere.u + sphere.v * sphere.v > reach * reach:
                # its lines miss the window
                if second is not None and not spheres.removed[k]:
                    visit(lines, strip, sphere, least, tally, second, whole, None, measured)
                else:
                    visit(lines, strip, sphere, least, tally, None, whole, None, measured)
                continue
        if second is not None and not spheres.removed[k]:
            visit(lines, strip, sphere, least, tally, second, whole, window, measured)
        else:
            visit(lines, strip, sphere, least, tally, None, whole, window, measured)


@njit(nogil=True, cache=True)
def scan_strips(
    lines: FloatArray,
    spheres: Spheres,
    grid: Grid,
    window_radius: float,
    cutoff: float,
    tally: FloatArray,
    second: Flag,
    whole: Flag,
    window: Flag,
    measured: float | None,
    medium: tuple[CellGrains, Prism] | None,
) -> None:
    """Scan a grid strip by strip, so that the lines' state stays in cache."""
    least = max(cutoff, SMALLEST)
    pitch = grid.columns + WIDTH
    rows_per_strip = max(MOST_LINES // pitch, 1)
    start, chosen = sort_into_strips(spheres, grid, rows_per_strip)
    for number in range(start.size - 1):
        row = number * rows_per_strip
        strip = Strip(
            grid.spacing,
            1.0 / grid.spacing,
            grid.first_u + row * grid.shear,
            grid.first_v + row * grid.spacing,
            grid.shear,
            grid.columns,
            min(rows_per_strip, grid.rows - row),
            pitch,
        )
        met = chosen[start[number] : start[number + 1]]
        begin(lines, strip, window_radius, second, whole)
        if medium is not None:
            measure_from(lines, strip, medium[1].rise_u, medium[1].rise_v)
        visit_all(
            lines, strip, spheres, met, window_radius, least, tally, second, whole, window, measured
        )
        for which in range(1 if second is None else 2):
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
                )
            if medium is not None:
                follow(lines, strip, which, medium[0], medium[1], least, tally)


@njit(nogil=True, cache=True)
def follow(
    lines: FloatArray,
    strip: Strip,
    which: int,
    grains: CellGrains,
    prism: Prism,
    least: float,
    tally: FloatArray,
) -> None:
    """Tally the gaps that start in the measured length and end beyond what was listed of it."""
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.columns):
            u = strip.first_u + row * strip.shear + column * strip.spacing
            place = np.uint64(row * strip.pitch + column)
            bound = lines[place + BOUND]
            end = lines[place + SET * np.uint64(which) + END]
            is_empty = end == -FAR
            if not is_empty and not bound <= end < bound + prism.length:
                continue
            start = next_solid(grains, prism, which == 1, u, v, bound if is_empty else end)
            if start == FAR and not (
                grains.periodic[0] and grains.periodic[1] and grains.periodic[2]
            ):
                # it leaves through a face that does not repeat
                continue
            if start == FAR:
                tally[which, CHANNELS] += 1.0
                tally[which, WHOLE + VOID] += (
                    prism.length if is_empty else bound + prism.length - end
                )
            elif not is_empty:
                gap = start - end
                tally[which, WHOLE + VOID] += gap
                if gap >= least:
                    tally[which, WHOLE + LENGTH] += gap
                    tally[which, WHOLE + KEPT] += 1.0


@njit(nogil=True, cache=True)
def scan_axes(
    position: FloatArray,
    radius: FloatArray,
    removed: BoolArray,
    frames: FloatArray,
    offsets: FloatArray,
    spacing: float,
    cutoff: float,
    window_radius: float,
    tallies: FloatArray,
    second: Flag,
    whole: Flag,
    window: Flag,
) -> None:
    """
    Scan a packing along several axes.

    Parameters
    ----------
    position, radius : shapes (N, 3), (N,)
        Spheres; the window's centre is the origin.
    removed : shape (N,)
        Spheres that are not solid in the second set of solids.
    frames : shape (D, 3, 3)
        Orthonormal rows u, v, n of each axis: the lines run along n.
    offsets : shape (D, 2)
        Shift of each axis' grid, in units of the spacing.
    window_radius : float
        Radius of the sphere window; 0 for none.
    tallies : shape (D, 2, TALLY_SIZE)
        Zeros; the results for each axis and set of solids.
    second, whole, window : True or None
        What is counted, see :mod:`scanfab.kernels.sweep`.
    """
    lines = np.empty(STATE_SIZE)
    extent = bounds(position, radius)
    for axis in range(frames.shape[0]):
        low_u = low_v = -window_radius
        high_u = high_v = window_radius
        if whole is not None and radius.size > 0:
            low_u, high_u = shadow(extent, frames[axis, 0], low_u, high_u)
            low_v, high_v = shadow(extent, frames[axis, 1], low_v, high_v)
        grid = cover(low_u, high_u, low_v, high_v, offsets[axis], spacing)
        spheres = project(position, radius, removed, frames[axis], grid)
        # a row of lines has to fit a strip
        most = MOST_LINES - WIDTH
        for first in range(0, grid.columns, most):
            part = Grid(
                spacing,
                grid.first_u + first * spacing,
                grid.first_v,
                0.0,
                min(most, grid.columns - first),
                grid.rows,
            )
            scan_strips(
                lines,
                spheres,
                part,
                window_radius,
                cutoff,
                tallies[axis],
                second,
                whole,
                window,
                None,
                None,
            )


@njit(nogil=True, cache=True)
def cell_grid(
    grains: CellGrains, normal: FloatArray, offset: FloatArray, spacing: float
) -> tuple[Prism, Spheres, Grid]:
    """The lines along a direction through a periodic medium, and the images that they may meet."""
    prism = prism_along(normal, grains.vectors, grains.periodic)
    found, extent = images_in(grains, prism)
    order = order_of(found.depth)
    spheres = Spheres(
        found.u[order],
        found.v[order],
        found.depth[order],
        found.radius[order],
        found.removed[order],
    )
    face = cover(extent[2], extent[3], extent[0], extent[1], offset, spacing)
    skew = prism.skew_u / prism.base_v
    grid = Grid(
        spacing,
        face.first_u + skew * face.first_v,
        face.first_v,
        skew * spacing,
        face.columns,
        face.rows,
    )
    return prism, spheres, grid


@njit(nogil=True, cache=True)
def scan_cell(
    grains: CellGrains,
    normals: FloatArray,
    offsets: FloatArray,
    spacing: float,
    cutoff: float,
    tallies: FloatArray,
    second: Flag,
) -> None:
    """
    Scan a periodic medium along several directions: the whole of it, that has no edge.

    ``normals`` has shape (D, 3), the rest is as in :func:`scan_axes`.
    """
    lines = np.empty(STATE_SIZE)
    for axis in range(normals.shape[0]):
        prism, spheres, grid = cell_grid(grains, normals[axis], offsets[axis], spacing)
        most = MOST_LINES - WIDTH
        for first in range(0, grid.columns, most):
            part = Grid(
                spacing,
                grid.first_u + first * spacing,
                grid.first_v,
                grid.shear,
                min(most, grid.columns - first),
                grid.rows,
            )
            tally = tallies[axis]
            # along an axis that is not periodic a line runs from the first solid to the last
            if grains.periodic[prism.third]:
                scan_strips(
                    lines, spheres, part, 0.0, cutoff, tally, second, True, None, prism.length,
                    (grains, prism),
                )  # fmt: skip
            else:
                scan_strips(
                    lines, spheres, part, 0.0, cutoff, tally, second, True, None, None, None
                )
