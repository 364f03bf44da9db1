"""Spheres projected along a direction: ordered by depth, and sorted into strips of lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import ONE, ZERO, inner
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.grid import Grid
from scanfab.scan.kernels.strips import FAR, Edge, Sphere, span

# a bucket with more indices is sorted by itself, and not with all others
FEW = 16


class Spheres(NamedTuple):
    """Projected spheres, ordered by depth; some are not in the second set of solids."""

    u: FloatArray
    v: FloatArray
    depth: FloatArray
    radius: FloatArray
    removed: BoolArray


@inner()
def room_for_spheres(count: int) -> Spheres:
    """So many spheres, to be filled in."""
    return Spheres(
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty(count, np.bool_),
    )


@inner(inline="always")
def sphere_at(spheres: Spheres, k: int | np.uint64) -> Sphere:
    """Sphere k."""
    return Sphere(spheres.u[k], spheres.v[k], spheres.depth[k], spheres.radius[k])


@inner(error_model="numpy")
def project(
    position: FloatArray,
    radius: FloatArray,
    removed: BoolArray,
    triad: FloatArray,
    grid: Grid,
    reach_of_window: float,
    window: Edge | None,
) -> Spheres:
    """
    The spheres that may meet a line, ordered by depth, in the triad with rows u, v, n.

    By the rule ``start`` without those that lie aside of the ball that holds the window, or more
    than the margin before or behind it.
    """
    u_x, u_y, u_z = triad[0, 0], triad[0, 1], triad[0, 2]
    v_x, v_y, v_z = triad[1, 0], triad[1, 1], triad[1, 2]
    n_x, n_y, n_z = triad[2, 0], triad[2, 1], triad[2, 2]
    met, depth = np.empty(radius.size, np.int64), np.empty(radius.size)
    count = np.uint64(0)
    low, high = np.inf, -np.inf
    per_spacing = 1.0 / grid.spacing
    for k in range(np.uint64(radius.size)):
        x, y, z = position[k, 0], position[k, 1], position[k, 2]
        # a row and a column within reach; whether they cross there, the visit will see
        column = (u_x * x + u_y * y + u_z * z - grid.first_u) * per_spacing
        row = (v_x * x + v_y * y + v_z * z - grid.first_v) * per_spacing
        away = radius[k] * per_spacing
        met[count] = k
        along = n_x * x + n_y * y + n_z * z
        depth[count] = along
        low, high = min(low, along), max(high, along)
        meets = (np.floor(row + away) >= row - away) & (np.floor(column + away) >= column - away)
        if window is not None and window.start is not None:
            beyond = max(abs(along) - window.margin, 0.0)
            reach = reach_of_window + radius[k]
            from_axis2 = x * x + y * y + z * z - along * along
            meets &= from_axis2 + beyond * beyond <= reach * reach
        count += np.uint64(meets)
    order = order_of(depth[:count], low, high)
    found = room_for_spheres(int(count))
    for i in range(count):
        place = np.uint64(order[i])
        grain = np.uint64(met[place])
        x, y, z = position[grain, 0], position[grain, 1], position[grain, 2]
        found.u[i] = u_x * x + u_y * y + u_z * z
        found.v[i] = v_x * x + v_y * y + v_z * z
        found.depth[i] = depth[place]
        found.radius[i] = radius[grain]
        found.removed[i] = removed[grain]
    return found


@inner()
def range_of(values: FloatArray) -> tuple[float, float]:
    """The least and the greatest of values."""
    low, high = np.inf, -np.inf
    for value in values:
        low, high = min(low, value), max(high, value)
    return low, high


@inner()
def in_order(spheres: Spheres, order: IntArray) -> Spheres:
    """The spheres in another order."""
    found = room_for_spheres(order.size)
    for i in range(np.uint64(order.size)):
        k = np.uint64(order[i])
        found.u[i], found.v[i], found.depth[i] = spheres.u[k], spheres.v[k], spheres.depth[k]
        found.radius[i], found.removed[i] = spheres.radius[k], spheres.removed[k]
    return found


@inner(error_model="numpy")
def order_of(values: FloatArray, low: float, high: float) -> IntArray:
    """
    Indices that sort values, none of which is less than ``low`` or greater than ``high``.

    By buckets, in linear time unless most values crowd in a few.
    """
    count = values.size
    per_width = (count - 1) / (high - low)
    # all of them may be equal, or nearly
    per_width = per_width if per_width < FAR else 0.0
    stop = np.zeros(count + 1, np.int64)
    for value in values:
        stop[np.uint64((value - low) * per_width) + np.uint64(1)] += 1
    for bucket in range(np.uint64(count)):
        stop[bucket + np.uint64(1)] += stop[bucket]
    # from starts of the buckets to their ends, while they fill
    order = np.empty(count, np.int64)
    for k in range(np.uint64(count)):
        its_bucket = np.uint64((values[k] - low) * per_width)
        order[np.uint64(stop[its_bucket])] = k
        stop[its_bucket] += 1
    start = 0
    for bucket in range(np.uint64(count)):
        if stop[bucket] - start > FEW:
            sort_by(values, order[start : stop[bucket]])
        start = stop[bucket]
    insert(values, order, ONE)
    return order


@inner()
def sort_by(values: FloatArray, members: IntArray) -> None:
    """Order some indices by their values, in place (Shell's sort, which suits few of them)."""
    gap = 1
    while gap < members.size // 9:
        gap = 3 * gap + 1
    while gap > 0:
        insert(values, members, gap)
        gap //= 3


@inner()
def insert(values: FloatArray, members: IntArray, gap: int) -> None:
    """Order those that are a multiple of the gap apart: fast where few are far from their place."""
    step = np.uint64(gap)
    for i in range(step, np.uint64(members.size)):
        moving, j = members[i], np.uint64(i)
        value = values[np.uint64(moving)]
        while j >= step and values[np.uint64(members[j - step])] > value:
            members[j] = members[j - step]
            j -= step
        members[j] = moving


@inner()
def number_from(first: int, numbers: IntArray) -> None:
    """Fill in the numbers from the first one on."""
    for k in range(numbers.size):
        numbers[k] = first + k


@inner()
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
        every = np.empty(spheres.u.size, np.int64)
        number_from(ZERO, every)
        return start, every
    chosen = np.empty(0, np.int64)
    per_spacing = 1.0 / grid.spacing
    for fill in range(2):
        place = np.empty(strips, np.int64)
        for strip in range(strips):
            place[strip] = start[strip]
        for k in range(spheres.u.size):
            v, radius = spheres.v[k], spheres.radius[k]
            first, last = span(v, radius, grid.first_v, per_spacing, 0, grid.rows)
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
