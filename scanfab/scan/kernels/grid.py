"""
The grid of scan lines along one direction, its strips, and the spheres projected onto it.

In a plane, whose normal is the grid's v, the grid is one row at v = 0, and its shift is one number,
along u. The spheres are ordered by their depth along the direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import LANES, ONE, inner, part
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.strips import FAR, Counts, Sphere, Strip, span

# a bucket with more indices is sorted on its own first
FEW = 16


@part()
def cover(
    triad: FloatArray,
    bounds: FloatArray,
    skew: float,
    offset: FloatArray,
    spacing: float,
) -> Strip:
    """
    The lines ((i + offset_u) * spacing, (j + offset_v) * spacing) that meet a parallelogram.

    Its ``bounds`` are the smallest and largest u - skew * v, and the smallest and largest v.
    """
    low_u, high_u, low_v, high_v = bounds[0], bounds[1], bounds[2], bounds[3]
    aside_u, aside_v = skew * low_v, skew * high_v
    column = int(np.ceil((low_u + min(aside_u, aside_v)) / spacing - offset[0]))
    end = int(np.floor((high_u + max(aside_u, aside_v)) / spacing - offset[0])) + 1
    columns = max(end - column, 0)
    row, rows, offset_v = 0, 1, 0.0
    if offset.size > 1:
        offset_v = offset[1]
        row = int(np.ceil(low_v / spacing - offset_v))
        rows = max(int(np.floor(high_v / spacing - offset_v)) - row + 1, 0)
    first_u, first_v = (column + offset[0]) * spacing, (row + offset_v) * spacing
    low, high = np.empty(rows, np.int64), np.empty(rows, np.int64)
    for k in range(rows):
        aside = skew * (first_v + k * spacing) - first_u
        low[k] = min(max(int(np.ceil((low_u + aside) / spacing)), 0), columns)
        stop = int(np.floor((high_u + aside) / spacing)) + 1
        high[k] = max(min(stop, columns), low[k])
    pitch = columns + LANES
    return Strip(triad, spacing, 1.0 / spacing, first_u, first_v, columns, rows, pitch, low, high)


class Bounds(NamedTuple):
    """A box and a ball about the origin that hold all spheres."""

    centre: FloatArray
    half: FloatArray
    reach: float


@part()
def shadow(extent: Bounds, side: FloatArray, low: float, high: float) -> tuple[float, float]:
    """The range of the spheres along a side of the grid; at least from low to high."""
    middle = half = 0.0
    for i in range(3):
        middle += extent.centre[i] * side[i]
        half += extent.half[i] * abs(side[i])
    low = min(low, max(middle - half, -extent.reach))
    return low, max(high, min(middle + half, extent.reach))


@part()
def open_grid(
    extent: Bounds,
    triad: FloatArray,
    offset: FloatArray,
    spacing: float,
    reach: float,
    counts: Counts,
) -> Strip:
    """
    The lines that meet the window or, for the whole, any sphere.

    ``reach`` is the radius of the ball that holds the window; lines beside it are included in the
    square around it. Every line meets a window without an end.
    """
    high_u = high_v = reach if reach < FAR else 0.0
    low_u = low_v = -high_u
    if (counts.whole is not None or reach > FAR) and extent.reach > 0.0:
        low_u, high_u = shadow(extent, triad[0], low_u, high_u)
        low_v, high_v = shadow(extent, triad[1], low_v, high_v)
    return cover(triad, np.array([low_u, high_u, low_v, high_v]), 0.0, offset, spacing)


@part()
def strip_of(grid: Strip, row: int, rows: int, column: int, columns: int) -> Strip:
    """The strip that starts at a row and a column, with at most so many rows and columns."""
    rows, columns = min(rows, grid.rows - row), min(columns, grid.columns - column)
    low, high = np.empty(rows, np.int64), np.empty(rows, np.int64)
    for k in range(rows):
        low[k] = min(max(grid.low[row + k] - column, 0), columns)
        high[k] = min(max(grid.high[row + k] - column, 0), columns)
    return Strip(
        grid.triad,
        grid.spacing,
        grid.per_spacing,
        grid.first_u + column * grid.spacing,
        grid.first_v + row * grid.spacing,
        columns,
        rows,
        columns + LANES,
        low,
        high,
    )


class CellGrains(NamedTuple):
    """Grains of a periodic medium, each once; or those of an open sample, without a cell."""

    position: FloatArray
    """Shape (N, 3)."""
    radius: FloatArray
    removed: BoolArray
    vectors: FloatArray
    """Edges of the cell as rows; for discs the last one is normal to the plane and not periodic."""
    periodic: BoolArray


class Spheres(NamedTuple):
    """Projected spheres, ordered by depth; some are not in the second set of solids."""

    u: FloatArray
    v: FloatArray
    depth: FloatArray
    radius: FloatArray
    removed: BoolArray


@part()
def room_for_spheres(count: int) -> Spheres:
    """So many spheres, to be filled in."""
    # rows a power of two apart would evict one another from the processor's first cache
    rows, removed = np.empty((4, count + 24)), np.empty(count, np.bool_)
    return Spheres(rows[0], rows[1], rows[2], rows[3], removed)


@inner(inline="always")
def sphere_at(spheres: Spheres, k: int | np.uint64) -> Sphere:
    """Sphere k."""
    return Sphere(spheres.u[k], spheres.v[k], spheres.depth[k], spheres.radius[k])


class Room(NamedTuple):
    """Arrays in which spheres are projected and ordered, along one axis after the other."""

    found: Spheres
    ordered: Spheres
    order: IntArray
    """See :func:`fill_order`, shape (N,)."""
    stop: IntArray
    """See :func:`fill_order`, shape (N + 1,)."""


@part()
def room_to_project(count: int) -> Room:
    """Room for so many spheres."""
    found, ordered = room_for_spheres(count), room_for_spheres(count)
    return Room(found, ordered, np.empty(count, np.int64), np.empty(count + 1, np.int64))


@inner(error_model="numpy")
def project(
    grains: CellGrains,
    triad: FloatArray,
    grid: Strip,
    reach: float,
    margin: float,
    room: Room,
) -> Spheres:
    """
    The spheres that may meet a line, ordered by depth, in the triad with rows u, v, n.

    Spheres that lie aside of a ball about the origin are left out, and so are those that lie more
    than the margin before or behind it. The result lies in the room.
    """
    position, radius, removed = grains.position, grains.radius, grains.removed
    u_x, u_y, u_z = triad[0, 0], triad[0, 1], triad[0, 2]
    v_x, v_y, v_z = triad[1, 0], triad[1, 1], triad[1, 2]
    n_x, n_y, n_z = triad[2, 0], triad[2, 1], triad[2, 2]
    found, count, per_spacing = room.found, np.uint64(0), grid.per_spacing
    for k in range(np.uint64(radius.size)):
        x, y, z = position[k, 0], position[k, 1], position[k, 2]
        found.u[count] = u = u_x * x + u_y * y + u_z * z
        found.v[count] = v = v_x * x + v_y * y + v_z * z
        found.depth[count] = depth = n_x * x + n_y * y + n_z * z
        found.radius[count], found.removed[count] = radius[k], removed[k]
        # a row and a column lie within reach; whether they cross there, the visit finds out
        column, row = (u - grid.first_u) * per_spacing, (v - grid.first_v) * per_spacing
        away = radius[k] * per_spacing
        meets = (np.floor(row + away) >= row - away) & (np.floor(column + away) >= column - away)
        beyond, near = max(abs(depth) - margin, 0.0), reach + radius[k]
        meets &= u * u + v * v + beyond * beyond <= near * near
        count += np.uint64(meets)
    return in_order(room, int(count))


@part()
def in_order(room: Room, count: int) -> Spheres:
    """The first ``count`` spheres that were found, ordered by depth."""
    spheres, found, order = room.found, room.ordered, room.order
    fill_order(spheres.depth[:count], order, room.stop)
    for i in range(np.uint64(count)):
        k = np.uint64(order[i])
        found.u[i], found.v[i], found.depth[i] = spheres.u[k], spheres.v[k], spheres.depth[k]
        found.radius[i], found.removed[i] = spheres.radius[k], spheres.removed[k]
    return Spheres(
        found.u[:count],
        found.v[:count],
        found.depth[:count],
        found.radius[:count],
        found.removed[:count],
    )


@inner(error_model="numpy")
def fill_order(values: FloatArray, order: IntArray, stop: IntArray) -> None:
    """
    Fill in the indices that sort K values, by buckets.

    This takes linear time unless most values crowd in a few buckets. ``order`` and ``stop`` have
    room for at least K and K + 1 numbers.
    """
    count = values.size
    low, high = np.inf, -np.inf
    for value in values:
        low, high = min(low, value), max(high, value)
    per_width = (count - 1) / (high - low)
    # all values may be equal, or nearly so
    per_width = per_width if per_width < FAR else 0.0
    for bucket in range(np.uint64(count + 1)):
        stop[bucket] = 0
    for value in values:
        stop[np.uint64((value - low) * per_width) + np.uint64(1)] += 1
    for bucket in range(np.uint64(count)):
        stop[bucket + np.uint64(1)] += stop[bucket]
    # while the buckets fill, ``stop`` moves from their starts to their ends
    for k in range(np.uint64(count)):
        its_bucket = np.uint64((values[k] - low) * per_width)
        order[np.uint64(stop[its_bucket])] = k
        stop[its_bucket] += 1
    start = 0
    for bucket in range(np.uint64(count)):
        if stop[bucket] - start > FEW:
            sort_by(values, order[start : stop[bucket]])
        start = stop[bucket]
    insert(values, order[:count], ONE)


@inner()
def sort_by(values: FloatArray, members: IntArray) -> None:
    """Sort some indices by their values, in place, by Shell's sort, which suits small numbers."""
    gap = 1
    while gap < members.size // 9:
        gap = 3 * gap + 1
    while gap > 0:
        insert(values, members, gap)
        gap //= 3


@inner()
def insert(values: FloatArray, members: IntArray, gap: int) -> None:
    """Sort members that are multiples of the gap apart; fast if few are far from their place."""
    step = np.uint64(gap)
    for i in range(step, np.uint64(members.size)):
        moving, j = members[i], np.uint64(i)
        value = values[np.uint64(moving)]
        while j >= step and values[np.uint64(members[j - step])] > value:
            members[j] = members[j - step]
            j -= step
        members[j] = moving


@part()
def sort_into_strips(spheres: Spheres, grid: Strip, rows: int) -> tuple[IntArray, IntArray]:
    """
    List the spheres that each strip of so many rows meets, in their order.

    Returns the start of each strip's list, with the end of the last list behind, and the lists.
    """
    start, chosen = np.zeros(-(-grid.rows // rows) + 2, np.int64), np.empty(0, np.int64)
    if grid.rows <= rows:
        # one strip meets all spheres
        chosen = np.empty(spheres.u.size, np.int64)
        for k in range(chosen.size):
            chosen[k] = k
        start[1] = chosen.size
        return start[:2], chosen
    # first pass: count; second pass: fill, while each start moves to the end of its list
    for fill in range(2):
        for k in range(spheres.u.size):
            v, radius = spheres.v[k], spheres.radius[k]
            first, last = span(v, radius, grid.first_v, grid.per_spacing, 0, grid.rows)
            if first < last:
                for strip in range(first // rows, (last - 1) // rows + 1):
                    if fill:
                        chosen[start[strip + 1]] = k
                    start[strip + (1 if fill else 2)] += 1
        if not fill:
            for strip in range(2, start.size):
                start[strip] += start[strip - 1]
            chosen = np.empty(start[-1], np.int64)
    return start[:-1], chosen
