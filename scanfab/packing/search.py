"""Pairs of grains that touch, overlap or nearly touch, from geometry alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, SettingsError
from scanfab.base.jit import inner, kernel
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray, IntArray, RowArray
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import contacts_of, geometry
from scanfab.packing.packing import Packing
from scanfab.packing.window import Window

# The radii in one grid differ by at most this factor, so that bins are not much wider than grains.
CLASS_RATIO = 3.5
# Bins are a little wider than the longest contact, so that rounding moves no grain two bins away.
ROOM = 1.0 + 1e-9
# The first attempt has room for so many contacts a grain. A mean above MOST_CONTACTS is a mistake
# of units.
USUAL_CONTACTS, MOST_CONTACTS = 4, 1000
# The extents of the grains are estimated from so many of them.
SAMPLE = 10_000
# A grain that spans more periodic cells is a mistake of units.
MOST_CELLS = 20


def find_contacts(packing: Packing, tolerance: float = 0.0) -> Packing:
    """
    Find the contacts of a packing from positions and radii, in any cell.

    Two grains (or a grain and a periodic image, its own included) are in contact if their distance
    is below (r1 + r2)(1 + tolerance). Each pair counts once for each image that it touches. Spheres
    of one body have no contacts with one another.

    Parameters
    ----------
    packing : Packing
        The grains; contacts that the packing has already are replaced.
    tolerance : float, optional
        Relative, dimensionless. Lattices and text files with 6 digits need about 1e-4: at 0,
        exact ties are decided by rounding.

    Returns
    -------
    Packing
        The same grains, with ``contacts.source == "geometric"``.

    Raises
    ------
    SettingsError
        If the tolerance is not a number >= 0.
    PackingError
        If a grain is much larger than the periodic cell, or thousands lie on top of one another.

    Examples
    --------
    >>> from scanfab import Packing, find_contacts
    >>> line = Packing([[0, 0, 0], [1.9, 0, 0], [3.8, 0, 0]], 1.0)
    >>> find_contacts(line).contacts.pairs.tolist()
    [[0, 1], [1, 2]]
    """
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise SettingsError(f"contact_tolerance: expected a number >= 0, found {tolerance}")
    pairs, image = overlapping_pairs(
        packing.position, packing.radius, 1.0 + tolerance, packing.cell
    )
    if packing.bodies is not None:
        outer = packing.bodies.between(pairs, image)
        pairs, image = pairs[outer], image[outer]
    return packing.with_contacts(contacts_of(packing, pairs, image, "geometric"))


class NearPairs(NamedTuple):
    """
    Pairs of grains in a region whose surfaces are near, and the shadow of the grains.

    Attributes
    ----------
    normal : ndarray, shape (M, 3)
        Unit vectors between the centres of each pair.
    overlap : ndarray, shape (M,)
        r1 + r2 minus the distance of the centres, dump's length unit; negative for a gap.
    reduced_radius : ndarray, shape (M,)
        r1 r2 / (r1 + r2), dump's length unit.
    shadow : float
        Projected area of all grains: Σ π r², or Σ 2 r for discs.
    volume : float
        Volume of the region, or its area for discs.
    space : Space
        The plane of the discs, if the grains are discs.
    """

    normal: FloatArray
    overlap: FloatArray
    reduced_radius: FloatArray
    shadow: float
    volume: float
    space: Space = SPACE


def near_pairs(
    packing: Packing, solid: BoolArray, counted: BoolArray, window: Window | None, gap: float
) -> NearPairs:
    """
    Find the pairs of solid grains whose surfaces are no more than a gap apart.

    Parameters
    ----------
    packing : Packing
        Spheres, without clumps.
    solid, counted : ndarray of bool, shape (N,)
        Grains that form pairs, and grains in the region; only solid ones have a shadow.
    window : Window or None
        The RV, in which the middles of the pairs lie. None for a sample that repeats along all
        vectors of its cell.
    gap : float
        Largest gap between surfaces, dump's length unit.

    Returns
    -------
    NearPairs
    """
    position, radius = packing.position[solid], packing.radius[solid]
    pairs, image = overlapping_pairs(position, radius + 0.5 * gap, 1.0, packing.cell)
    normal, middle, distance = geometry(position, radius, pairs, image, packing.cell)
    chosen = distance > 0.0
    if window is not None:
        chosen &= window.contains(middle, packing)
        volume = window.shape.volume
    else:
        assert packing.cell is not None
        volume = packing.cell.volume
    one, two = radius[pairs[chosen]].T
    overlap, reduced = one + two - distance[chosen], one * two / (one + two)
    shadow = packing.space.shadow(radius[counted[solid]])
    return NearPairs(normal[chosen], overlap, reduced, shadow, volume, packing.space)


def overlapping_pairs(
    position: FloatArray, radius: FloatArray, scale: float = 1.0, cell: Cell | None = None
) -> tuple[RowArray, RowArray]:
    """
    Find the pairs of spheres whose distance is below (r_i + r_j) * scale, in linear time.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Finite, inside the cell along its periodic vectors, dump's length unit.
    radius : ndarray, shape (N,)
        Above 0, dump's length unit.
    scale : float, optional
        Factor, dimensionless.
    cell : Cell, optional
        A cell of any shape, periodic along any of its vectors.

    Returns
    -------
    pairs : ndarray of int, shape (M, 2)
        Rows of both spheres, the smaller row first, sorted; a pair occurs once for each image.
    image : ndarray of int, shape (M, 3)
        Lattice translation of the second sphere.
    """
    count = len(radius)
    if cell is None or not cell.is_periodic:
        numbers = _numbered_pairs(position, radius, np.arange(count), count, 1, scale)
        pairs = np.column_stack(np.divmod(numbers, max(count, 1))).astype(np.int32)
        return pairs, np.broadcast_to(np.int32(0), (len(pairs), 3))
    # a tilted cell has the fewest images around it by its shortest vectors
    short, turns = Cell(cell.short_vectors, cell.periodic, cell.origin), None
    reach = 2.0 * scale * float(radius.max(initial=0.0)) * ROOM
    cells = reach / short.heights[list(cell.periodic)].min()
    if cells > MOST_CELLS:
        raise PackingError(
            f"a grain of radius {radius.max():g} spans {cells:g} periodic cells: "
            f"have the cell and the radii the same unit?"
        )
    if not np.array_equal(short.vectors, cell.vectors):
        position, turns = short.place(position)
    places, row, image = short.images_outside(position, reach)
    most = int(np.abs(image).max(initial=0))
    shape = (2 * most + 1,) * 3
    images = math.prod(shape)
    codes = np.append(
        np.full(count, images // 2), np.ravel_multi_index(tuple((image + most).T), shape)
    )
    label = np.append(np.arange(count), row) * images + codes
    position, radius = np.concatenate([position, places]), np.append(radius, radius[row])
    numbers = _numbered_pairs(position, radius, label, count, images, scale)
    one, two = np.divmod(numbers, max(count * images, 1))
    pairs = np.column_stack([one, two // images]).astype(np.int32)
    image = np.column_stack(np.unravel_index(two % images, shape)) - most
    if turns is not None:
        image += turns[pairs[:, 0]] - turns[pairs[:, 1]]
        image = image[:, np.array(cell.periodic)] @ cell.lattice.combination
    return pairs, image.astype(np.int32)


class Grid(NamedTuple):
    """Spheres in the order of the bins of a box; a sphere outside belongs to an outermost bin."""

    spheres: FloatArray
    """Shape (N, 4): centre and radius."""
    label: IntArray
    """Shape (N,): see :func:`find_pairs`."""
    start: IntArray
    """Shape (bins + 1,): where each bin starts. Bins along z follow one another."""
    shape: IntArray
    """Shape (3,): number of bins along x, y and z."""
    low: FloatArray
    """Shape (3,): corner of the box."""
    width: FloatArray
    """Shape (3,): edges of a bin. Two spheres of the grid in contact are closer than that."""


@inner()
def _bin(grid: Grid, sphere: FloatArray, axis: int) -> int:
    place = (sphere[axis] - grid.low[axis]) / grid.width[axis]
    number: int = int(min(max(place, 0.0), grid.shape[axis] - 1.0))
    return number


@kernel
def find_pairs(
    grid: Grid,
    other: Grid,
    own: bool,
    count: int,
    images: int,
    scale: float,
    most: int,
    pairs: IntArray,
    found: int,
) -> int:
    """
    Add the pairs whose distance is below (r_i + r_j) * scale; returns their number so far.

    The first sphere of a pair belongs to ``grid``. The second belongs to ``other``, the same grid
    or one with larger spheres; its bins around the first sphere hold all that can be near.

    The label of a sphere is its row of ``count`` times ``images``, plus the number of the image,
    which is images // 2 for the sphere itself. Both spheres of a pair see an image of the other. So
    a pair counts once if its smaller label is that of a sphere itself. Its number is the smaller
    row times (count * images), plus the larger label. Pairs without room in ``pairs``, shape (M,),
    are only counted, and the search ends once there are more than ``most``.
    """
    shape, b = other.shape, other.spheres
    for i in range(len(grid.label)):
        if found > most:
            return found
        a, one = grid.spheres[i], grid.label[i]
        x, y, z = _bin(other, a, 0), _bin(other, a, 1), _bin(other, a, 2)
        low, high = max(z - 1, 0), min(z + 2, shape[2])
        for bx in range(max(x - 1, 0), min(x + 2, shape[0])):
            for by in range(max(y - 1, 0), min(y + 2, shape[1])):
                column = (bx * shape[1] + by) * shape[2]
                first = other.start[column + low]
                # within one grid, a sphere is compared with the spheres behind it
                for j in range(max(first, i + 1) if own else first, other.start[column + high]):
                    dx, dy, dz = b[j, 0] - a[0], b[j, 1] - a[1], b[j, 2] - a[2]
                    reach = (a[3] + b[j, 3]) * scale
                    if dx * dx + dy * dy + dz * dz < reach * reach:
                        smaller, larger = min(one, other.label[j]), max(one, other.label[j])
                        row = smaller // images
                        if smaller - row * images == images // 2:
                            if found < len(pairs):
                                pairs[found] = row * (count * images) + larger
                            found += 1
    return found


def _numbered_pairs(
    position: FloatArray,
    radius: FloatArray,
    label: IntArray,
    count: int,
    images: int,
    scale: float,
) -> IntArray:
    """The numbers of the pairs, as :func:`find_pairs` defines them, in ascending order."""
    grids = list(_grids(position, radius, label, scale)) if count else []
    room, most = USUAL_CONTACTS * count, MOST_CONTACTS * count
    while True:
        pairs, found = np.empty(room, np.int64), 0
        for place, grid in enumerate(grids):
            for other in grids[: place + 1]:
                own = other is grid
                found = find_pairs(grid, other, own, count, images, scale, most, pairs, found)
        if found > most:
            raise PackingError(
                f"more than {MOST_CONTACTS} contacts a grain by geometry: {count} grains "
                f"lie on top of one another; check the units of radii and positions"
            )
        if found <= room:
            pairs = pairs[:found]
            pairs.sort()
            return pairs
        room = found


def _grids(
    position: FloatArray, radius: FloatArray, label: IntArray, scale: float
) -> Iterator[Grid]:
    """Grids of grains of like size, the largest grains first."""
    low, high = _extents(position)
    classes = np.floor(np.log(radius.max() / radius) / np.log(CLASS_RATIO)).astype(np.int16)
    for one in np.flatnonzero(np.bincount(classes)):
        rows = np.flatnonzero(classes == one)
        edge = 2.0 * scale * float(radius[rows].max()) * ROOM
        size = np.maximum(high - low, edge)
        parts = size / edge
        # about as many bins as there are grains
        while np.prod(np.floor(parts)) > 2 * len(rows) + 8:
            excess = np.cbrt(np.prod(np.floor(parts)) / (2 * len(rows) + 8))
            parts = np.maximum(parts / max(excess, 1.01), 1.0)
        shape = parts.astype(np.int64)
        width, number = size / shape, np.zeros(len(rows), np.int64)
        for axis in range(3):
            place = (np.take(position[:, axis], rows) - low[axis]) / width[axis]
            number *= shape[axis]
            number += np.clip(place, 0.0, shape[axis] - 1.0).astype(np.int64)
        start = np.append(0, np.cumsum(np.bincount(number, minlength=int(np.prod(shape)))))
        rows = rows[np.argsort(number)]
        spheres = np.empty((len(rows), 4))
        spheres[:, :3], spheres[:, 3] = np.take(position, rows, axis=0), radius[rows]
        yield Grid(spheres, label[rows], start, shape, low, width)


def _extents(position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    The smallest and largest coordinates of nearly all grains.

    The box is at most three times as wide as that of 98 % of the grains. A few grains that flew far
    away would make all bins large; instead they go to the outermost bins, and neighbours stay in
    bins side by side.
    """
    some = position[:: len(position) // SAMPLE + 1]
    least, most = np.quantile(some, [0.01, 0.99], axis=0)
    width = most - least
    # one coordinate after the other: that takes a third of the time
    low, high = ([end(along) for along in position.T] for end in (np.min, np.max))
    return np.maximum(low, least - width), np.minimum(high, most + width)
