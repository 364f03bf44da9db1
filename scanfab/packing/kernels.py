"""
Pairs of overlapping spheres, by cell lists, in time linear in the number of spheres.

The bins are cut out of a *basis*: three vectors, of which some are lattice vectors. A bin beyond
the last one along a lattice vector is the first one, moved by that vector: so each pair is met once
with each of its images, however thin the cell is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.jit import inner, kernel
from scanfab.base.typing import FloatArray, IntArray

RowArray = npt.NDArray[np.int32]
ShiftArray = npt.NDArray[np.int16]


class Basis(NamedTuple):
    """The parallelepiped that is cut into bins."""

    inverse: FloatArray
    """Shape (3, 3): position @ inverse - low are fractions, 0 to 1 inside."""
    low: FloatArray
    """Shape (3,)."""
    lattice: FloatArray
    """Shape (3, 3): its vectors as rows, zero where it does not repeat."""
    repeats: npt.NDArray[np.bool_]
    """Shape (3,)."""


class Grid(NamedTuple):
    """Spheres in the order of their bins."""

    spheres: FloatArray
    """Shape (N, 4): centre and radius."""
    row: RowArray
    """Shape (N,): which sphere of the packing each one is."""
    start: IntArray
    """Shape (bins + 1,): where each bin starts."""
    shape: IntArray
    """Shape (3,): number of bins along each vector of the basis."""
    reach: IntArray
    """Shape (3,): how many bins away a sphere in contact can be."""


class Pairs(NamedTuple):
    """
    Room for pairs and the images of their second spheres; what does not fit is counted only.

    The search ends early once there are more than ``most``.
    """

    rows: RowArray
    """Shape (M, 2), the smaller row first."""
    image: ShiftArray
    """Shape (M, 3), in vectors of the basis."""
    most: int


@kernel
def move_into_basis(position: FloatArray, basis: Basis, moved: FloatArray, turns: IntArray) -> None:
    """Move positions into the basis along its lattice vectors."""
    lattice = basis.lattice
    for i in range(position.shape[0]):
        for k in range(3):
            moved[i, k] = position[i, k]
        for axis in range(3):
            fraction = -basis.low[axis]
            for k in range(3):
                fraction += position[i, k] * basis.inverse[k, axis]
            # a rounding error outside is inside
            outside = fraction < -1e-12 or fraction >= 1.0 + 1e-12
            turn = int(np.floor(fraction)) if basis.repeats[axis] and outside else 0
            turns[i, axis] = turn
            if turn != 0:
                for k in range(3):
                    moved[i, k] -= turn * lattice[axis, k]


@inner()
def _bin(basis: Basis, shape: IntArray, x: float, y: float, z: float, axis: int) -> int:
    inverse = basis.inverse
    fraction = x * inverse[0, axis] + y * inverse[1, axis] + z * inverse[2, axis] - basis.low[axis]
    # what lies outside belongs to the outermost bins
    place: int = int(min(max(fraction * shape[axis], 0.0), shape[axis] - 1.0))
    return place


@kernel
def fill_grid(
    position: FloatArray, radius: FloatArray, rows: RowArray, basis: Basis, grid: Grid
) -> None:
    """Sort the spheres of some rows into the bins of a grid, whose start is zero."""
    start, shape, spheres = grid.start, grid.shape, grid.spheres
    bins = np.empty(rows.shape[0], np.int64)
    for place in range(rows.shape[0]):
        i = rows[place]
        x, y, z = position[i, 0], position[i, 1], position[i, 2]
        number = 0
        for axis in range(3):
            number = number * shape[axis] + _bin(basis, shape, x, y, z, axis)
        bins[place] = number
        start[number + 1] += 1
    for number in range(1, start.shape[0]):
        start[number] += start[number - 1]
    filled = start.copy()
    for place in range(rows.shape[0]):
        i, to = rows[place], filled[bins[place]]
        filled[bins[place]] += 1
        grid.row[to] = i
        spheres[to, 0] = position[i, 0]
        spheres[to, 1] = position[i, 1]
        spheres[to, 2] = position[i, 2]
        spheres[to, 3] = radius[i]


@inner()
def _runs(basis: Basis, grid: Grid, place: tuple[int, int, int], half: bool, runs: IntArray) -> int:
    """
    Runs of spheres in the bins around a place; how many runs there are.

    A run, a row of ``runs``: its first sphere, the one behind its last, and its image. Half of the
    bins suffice where the others see a pair from its other sphere; the place itself is not in it.
    """
    shape, reach, repeats, start = grid.shape, grid.reach, basis.repeats, grid.start
    count = 0
    for x in range(0 if half else -reach[0], reach[0] + 1):
        ix = (place[0] + x) // shape[0]
        if ix != 0 and not repeats[0]:
            continue
        for y in range(0 if half and x == 0 else -reach[1], reach[1] + 1):
            iy = (place[1] + y) // shape[1]
            if iy != 0 and not repeats[1]:
                continue
            low = place[2] + (1 if half and x == 0 and y == 0 else -reach[2])
            high = place[2] + reach[2]
            if not repeats[2]:
                low, high = max(low, 0), min(high, shape[2] - 1)
            base = place[0] + x - ix * shape[0]
            base = (base * shape[1] + place[1] + y - iy * shape[1]) * shape[2]
            while low <= high:
                # bins along the third vector are neighbours in memory, up to the last
                iz = low // shape[2]
                end = min(high, (iz + 1) * shape[2] - 1)
                runs[count, 0] = start[base + low - iz * shape[2]]
                runs[count, 1] = start[base + end - iz * shape[2] + 1]
                runs[count, 2], runs[count, 3], runs[count, 4] = ix, iy, iz
                count += runs[count, 0] < runs[count, 1]
                low = end + 1
    return count


@inner()
def _room_for_runs(basis: Basis, grid: Grid) -> int:
    reach, shape = grid.reach, grid.shape
    pieces = (2 * reach[2] + 1) // shape[2] + 3
    room: int = (2 * reach[0] + 1) * (2 * reach[1] + 1) * pieces
    return room


@inner(inline="always")
def _add_pair(pairs: Pairs, place: int, one: int, two: int, ix: int, iy: int, iz: int) -> None:
    """Write down a pair, if there is room."""
    if place < pairs.rows.shape[0]:
        sign = 1 if one <= two else -1
        pairs.rows[place, 0], pairs.rows[place, 1] = min(one, two), max(one, two)
        pairs.image[place, 0] = sign * ix
        pairs.image[place, 1] = sign * iy
        pairs.image[place, 2] = sign * iz


@kernel
def pairs_within(grid: Grid, basis: Basis, scale: float, pairs: Pairs, found: int) -> int:
    """Add the pairs of one grid whose distance is below (r_i + r_j) * scale; how many there are."""
    shape, start, a, lattice = grid.shape, grid.start, grid.spheres, basis.lattice
    row = grid.row
    runs = np.empty((_room_for_runs(basis, grid), 5), np.int64)
    for number in range(start.shape[0] - 1):
        first, last = start[number], start[number + 1]
        if first == last:
            continue
        column = number // shape[2]
        place = (column // shape[1], column % shape[1], number % shape[2])
        count = _runs(basis, grid, place, True, runs)
        for k in range(-1, count):
            # the bin itself first
            ix, iy, iz = (0, 0, 0) if k < 0 else (runs[k, 2], runs[k, 3], runs[k, 4])
            sx = ix * lattice[0, 0] + iy * lattice[1, 0] + iz * lattice[2, 0]
            sy = ix * lattice[0, 1] + iy * lattice[1, 1] + iz * lattice[2, 1]
            sz = ix * lattice[0, 2] + iy * lattice[1, 2] + iz * lattice[2, 2]
            for i in range(first, last):
                if found > pairs.most:
                    return found
                begin, stop = (i + 1, last) if k < 0 else (runs[k, 0], runs[k, 1])
                x, y, z, r = a[i, 0] - sx, a[i, 1] - sy, a[i, 2] - sz, a[i, 3]
                for j in range(begin, stop):
                    dx, dy, dz, most = a[j, 0] - x, a[j, 1] - y, a[j, 2] - z, (r + a[j, 3]) * scale
                    if dx * dx + dy * dy + dz * dz < most * most:
                        _add_pair(pairs, found, row[i], row[j], ix, iy, iz)
                        found += 1
    return found


@kernel
def pairs_between(
    small: Grid, large: Grid, basis: Basis, scale: float, pairs: Pairs, found: int
) -> int:
    """Add the pairs of a sphere of one grid and one of another, whose spheres are larger."""
    shape, a, b, lattice = large.shape, small.spheres, large.spheres, basis.lattice
    runs = np.empty((_room_for_runs(basis, large), 5), np.int64)
    for i in range(a.shape[0]):
        if found > pairs.most:
            return found
        place = (
            _bin(basis, shape, a[i, 0], a[i, 1], a[i, 2], 0),
            _bin(basis, shape, a[i, 0], a[i, 1], a[i, 2], 1),
            _bin(basis, shape, a[i, 0], a[i, 1], a[i, 2], 2),
        )
        count = _runs(basis, large, place, False, runs)
        for k in range(count):
            ix, iy, iz = runs[k, 2], runs[k, 3], runs[k, 4]
            x = a[i, 0] - ix * lattice[0, 0] - iy * lattice[1, 0] - iz * lattice[2, 0]
            y = a[i, 1] - ix * lattice[0, 1] - iy * lattice[1, 1] - iz * lattice[2, 1]
            z = a[i, 2] - ix * lattice[0, 2] - iy * lattice[1, 2] - iz * lattice[2, 2]
            for j in range(runs[k, 0], runs[k, 1]):
                dx, dy, dz = b[j, 0] - x, b[j, 1] - y, b[j, 2] - z
                most = (a[i, 3] + b[j, 3]) * scale
                if dx * dx + dy * dy + dz * dz < most * most:
                    _add_pair(pairs, found, small.row[i], large.row[j], ix, iy, iz)
                    found += 1
    return found


@kernel
def sort_pairs(pairs: Pairs, count: int, rows: IntArray, image: IntArray) -> None:
    """Pairs by first and then second row, of ``count`` spheres: two counting sorts."""
    number = rows.shape[0]
    filled = np.zeros(count + 1, np.int64)
    by_second = np.empty(number, np.int32)
    for k in range(number):
        filled[pairs.rows[k, 1] + 1] += 1
    for i in range(count):
        filled[i + 1] += filled[i]
    for k in range(number):
        second = pairs.rows[k, 1]
        by_second[filled[second]] = k
        filled[second] += 1
    filled[:] = 0
    for k in range(number):
        filled[pairs.rows[k, 0] + 1] += 1
    for i in range(count):
        filled[i + 1] += filled[i]
    for place in range(number):
        k = by_second[place]
        first = pairs.rows[k, 0]
        to = filled[first]
        filled[first] += 1
        rows[to, 0], rows[to, 1] = first, pairs.rows[k, 1]
        for axis in range(3):
            image[to, axis] = pairs.image[k, axis]


@kernel
def contact_geometry(
    position: FloatArray,
    radius: FloatArray,
    rows: IntArray,
    image: IntArray,
    vectors: FloatArray,
    normal: FloatArray,
    point: FloatArray,
    sound: npt.NDArray[np.bool_],
) -> None:
    """Unit normals and points of contacts; ``sound`` is false where both centres are the same."""
    branch = np.empty(3)
    for k in range(rows.shape[0]):
        one, two = rows[k, 0], rows[k, 1]
        square = 0.0
        for axis in range(3):
            branch[axis] = position[two, axis] - position[one, axis]
            for vector in range(3):
                branch[axis] += image[k, vector] * vectors[vector, axis]
            square += branch[axis] * branch[axis]
        length = np.sqrt(square)
        sound[k] = length > 0.0
        for axis in range(3):
            normal[k, axis] = branch[axis] / length if length > 0.0 else 0.0
            middle = 0.5 * (length + radius[one] - radius[two])
            point[k, axis] = position[one, axis] + middle * normal[k, axis]
