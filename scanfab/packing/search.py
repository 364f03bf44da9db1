"""Pairs of grains that touch, overlap or nearly touch, from geometry alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import contacts_of, geometry
from scanfab.packing.kernels import Grid, PairArray, find_pairs
from scanfab.packing.packing import Packing

if TYPE_CHECKING:
    from scanfab.packing.sample import Sample, Variant
    from scanfab.packing.window import Window

# Grains of one grid differ by no more than this factor, so that dust is not sought in bins that are
# as wide as boulders.
CLASS_RATIO = 3.5
# Bins are a little wider than the longest contact: rounding moves no grain two bins away.
ROOM = 1.0 + 1e-9
# Contacts a grain that the first attempt has room for, and, in the mean of all grains, that only a
# mistake of units makes.
USUAL_CONTACTS, MOST_CONTACTS = 4, 1000
# grains that tell where the others are
SAMPLE = 10_000
# cells that a contact may span: a grain as large as that is a mistake of units
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
        Its own contacts, if any, are replaced.
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
    Pairs of a region's grains whose surfaces are near, and how much the grains shade.

    Attributes
    ----------
    normal : ndarray, shape (M, 3)
        Unit vectors between the centres of each pair.
    overlap : ndarray, shape (M,)
        r1 + r2 less the distance of the centres, dump's length unit; below 0 for a gap.
    reduced_radius : ndarray, shape (M,)
        r1 r2 / (r1 + r2), dump's length unit.
    shadow : float
        What lines of one direction meet of all grains: Σ π r², of discs Σ 2 r.
    volume : float
        Of the region, of discs its area.
    space : Space
        The plane in which discs lie.
    """

    normal: FloatArray
    overlap: FloatArray
    reduced_radius: FloatArray
    shadow: float
    volume: float
    space: Space = SPACE


def near_pairs(sample: Sample, variant: Variant, window: Window | None, gap: float) -> NearPairs:
    """
    The pairs of a variant's solids whose surfaces are no more than a gap apart.

    Parameters
    ----------
    sample : Sample
        Of spheres, without clumps.
    variant : Variant
        Whose solids.
    window : Window or None
        The RV, in which the pairs' middles and the grains' centres lie; None for a whole that
        repeats along all vectors of its cell.
    gap : float
        Between surfaces, dump's length unit.

    Returns
    -------
    NearPairs
    """
    packing = sample.packing
    solid = sample.grains & ~sample.removed(variant)
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
    shadow = packing.space.shadow(radius[sample.counted(variant, window)[solid]])
    return NearPairs(normal[chosen], overlap, reduced, shadow, volume, packing.space)


def overlapping_pairs(
    position: FloatArray, radius: FloatArray, scale: float = 1.0, cell: Cell | None = None
) -> tuple[PairArray, PairArray]:
    """
    Pairs of spheres whose distance is below (r_i + r_j) * scale, in linear time.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Finite, inside the cell along its periodic vectors, dump's length unit.
    radius : ndarray, shape (N,)
        Above 0, dump's length unit.
    scale : float, optional
        Dimensionless.
    cell : Cell, optional
        Of any shape, periodic along any of its vectors.

    Returns
    -------
    pairs : ndarray of int, shape (M, 2)
        Rows of both spheres, the smaller first, in their order; each pair once an image.
    image : ndarray of int, shape (M, 3)
        Lattice translation of the second sphere.
    """
    if cell is None or not cell.is_periodic:
        pairs = _pairs_in_order(position, radius, np.ones(len(radius), np.bool_), scale)
        return pairs, np.broadcast_to(np.int32(0), (len(pairs), 3))
    reach = 2.0 * scale * float(radius.max(initial=0.0)) * ROOM
    # cut by its shortest vectors, a tilted cell has the fewest images around it
    short, turns = Cell(cell.short_vectors, cell.periodic, cell.origin), None
    if reach > MOST_CELLS * short.heights[list(cell.periodic)].min():
        cells = reach / short.heights[list(cell.periodic)].min()
        raise PackingError(
            f"a grain of radius {radius.max():g} spans {cells:g} periodic cells: "
            f"have the cell and the radii the same unit?"
        )
    if not np.array_equal(short.vectors, cell.vectors):
        position, turns = short.place(position)
    # Images come in the order of the spheres that they repeat, the sphere itself among them. Both
    # spheres of a pair see an image of the other, but only one of the images comes later.
    places, row, shift = short.with_images(position, reach)
    one, two = _pairs_in_order(places, radius[row], (shift == 0).all(axis=1), scale).T
    pairs, image = np.column_stack([row[one], row[two]]), shift[two]
    if turns is not None:
        image = image + turns[pairs[:, 0]] - turns[pairs[:, 1]]
        image = image[:, list(cell.periodic)] @ cell.lattice.combination
    return pairs.astype(np.int32), image.astype(np.int32)


def _pairs_in_order(
    position: FloatArray, radius: FloatArray, is_real: BoolArray, scale: float
) -> PairArray:
    """Near pairs of rows, of which the smaller stands first and is real, in ascending order."""
    count = len(radius)
    grids = list(_grids(position, radius, scale)) if count else []
    room, most = USUAL_CONTACTS * count, MOST_CONTACTS * count
    while True:
        pairs, found = np.empty((room, 2), np.int32), 0
        for place, grid in enumerate(grids):
            for other in grids[: place + 1]:
                found = find_pairs(grid, other, other is grid, is_real, scale, most, pairs, found)
        if found <= room:
            break
        if found > most:
            raise PackingError(
                f"more than {MOST_CONTACTS} contacts a grain by geometry: {is_real.sum()} grains "
                f"lie on top of one another; check the units of radii and positions"
            )
        room = found
    numbers = pairs[:found, 0].astype(np.int64)
    numbers *= count
    numbers += pairs[:found, 1]
    numbers.sort()
    for side, part in enumerate(np.divmod(numbers, max(count, 1))):
        pairs[:found, side] = part
    # a copy, as the room may be several times as large
    return pairs[:found].copy()


def _grids(position: FloatArray, radius: FloatArray, scale: float) -> Iterator[Grid]:
    """Grids of grains of like size, the largest grains first."""
    low, high = _extents(position)
    classes = np.floor(np.log(radius.max() / radius) / np.log(CLASS_RATIO)).astype(np.int16)
    for one in np.unique(classes):
        rows = np.flatnonzero(classes == one).astype(np.int32)
        edge = 2.0 * scale * float(radius[rows].max()) * ROOM
        size = np.maximum(high - low, edge)
        parts = size / edge
        # about as many bins as there are grains
        while np.prod(np.floor(parts)) > 2 * len(rows) + 8:
            excess = np.cbrt(np.prod(np.floor(parts)) / (2 * len(rows) + 8))
            parts = np.maximum(parts / max(excess, 1.01), 1.0)
        shape = parts.astype(np.int64)
        width, number = size / shape, np.zeros(len(rows), np.int64)
        spheres = np.column_stack([np.take(position, rows, axis=0), radius[rows]])
        for axis in range(3):
            place = (spheres[:, axis] - low[axis]) / width[axis]
            number *= shape[axis]
            number += np.clip(place, 0.0, shape[axis] - 1.0).astype(np.int64)
        start = np.append(0, np.cumsum(np.bincount(number, minlength=int(np.prod(shape)))))
        order = np.argsort(number)
        spheres, rows = np.take(spheres, order, axis=0), rows[order]
        yield Grid(spheres, rows, start, shape, low, width)


def _extents(position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    The smallest and largest coordinates of nearly all grains.

    The box is at most three times as wide as that of 98 % of the grains. A few grains that flew far
    away would make all bins large; they go to the outermost bins, which parts no neighbours.
    """
    some = position[:: len(position) // SAMPLE + 1]
    least, most = np.quantile(some, [0.01, 0.99], axis=0)
    width = most - least
    low, high = np.maximum(position.min(axis=0), least - width), most + width
    return low, np.minimum(position.max(axis=0), high)
