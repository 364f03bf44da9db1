"""Spheres projected along a direction: ordered by depth, and sorted into strips of lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import ONE, ZERO, inner
from scanfab.kernels.grid import Grid
from scanfab.kernels.strips import Sphere, span

__all__ = [
    "Spheres",
    "number_from",
    "order_of",
    "project",
    "room_for_spheres",
    "sort_by",
    "sort_into_strips",
    "sphere_at",
]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

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
def sphere_at(spheres: Spheres, k: int) -> Sphere:
    """Sphere k."""
    return Sphere(spheres.u[k], spheres.v[k], spheres.depth[k], spheres.radius[k])


@inner()
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
        # a row and a column within reach; whether they cross there, the visit will see
        column = (frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z - grid.first_u) * per_spacing
        row = (frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z - grid.first_v) * per_spacing
        reach = radius[k] * per_spacing
        met[count] = k
        depth[count] = frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z
        count += (np.floor(row + reach) >= row - reach) & (
            np.floor(column + reach) >= column - reach
        )
    order = order_of(depth[:count])
    found = room_for_spheres(count)
    for i in range(count):
        k = met[order[i]]
        x, y, z = position[k, 0], position[k, 1], position[k, 2]
        found.u[i] = frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z
        found.v[i] = frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z
        found.depth[i] = depth[order[i]]
        found.radius[i] = radius[k]
        found.removed[i] = removed[k]
    return found


@inner()
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
    for i in range(gap, members.size):
        moving, j = members[i], i
        while j >= gap and values[members[j - gap]] > values[moving]:
            members[j] = members[j - gap]
            j -= gap
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
