"""Pairs of grains that touch, overlap or nearly touch, from geometry alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import Contacts, branches, warn_of_same_centre
from scanfab.packing.kernels import (
    Basis,
    Grid,
    Pairs,
    contact_geometry,
    fill_grid,
    move_into_basis,
    pairs_between,
    pairs_within,
    sort_pairs,
)
from scanfab.packing.packing import Packing

if TYPE_CHECKING:
    from scanfab.packing.sample import Sample, Variant
    from scanfab.packing.window import Window

# grains of one grid differ by no more than this factor: dust is not sought in bins of boulders
CLASS_RATIO = 3.5
# bins are a little larger than the longest contact: rounding moves no grain two bins away
ROOM = 1.0 + 1e-9
# contacts a grain that the first attempt has room for
USUAL_CONTACTS = 4
# contacts a grain, in the mean of all, that only a mistake of units makes
MOST_CONTACTS = 1000
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
    >>> find_contacts(line).contacts.pairs
    array([[0, 1],
           [1, 2]])
    """
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise SettingsError(f"contact_tolerance: expected a number >= 0, found {tolerance}")
    pairs, image = overlapping_pairs(
        packing.position, packing.radius, 1.0 + tolerance, packing.cell
    )
    if packing.bodies is not None:
        outer = packing.bodies.between(pairs, image)
        pairs, image = pairs[outer], image[outer]
    # normals and points as of listed contacts, but nothing is to be checked
    vectors = np.zeros((3, 3)) if packing.cell is None else packing.cell.vectors
    normal, point = np.empty((len(pairs), 3)), np.empty((len(pairs), 3))
    sound = np.empty(len(pairs), np.bool_)
    contact_geometry(packing.position, packing.radius, pairs, image, vectors, normal, point, sound)
    if not sound.all():
        warn_of_same_centre(pairs[~sound], packing.id)
        pairs, image, normal, point = pairs[sound], image[sound], normal[sound], point[sound]
    return packing.with_contacts(Contacts(pairs, image, normal, point, None, "geometric"))


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
    one, two = pairs.T
    branch = branches(position, pairs, image, packing.cell)
    distance = np.linalg.norm(branch, axis=1)
    normal = branch / np.where(distance > 0.0, distance, 1.0)[:, None]
    overlap = radius[one] + radius[two] - distance
    chosen = distance > 0.0
    inside = sample.counted(variant, window)[solid]
    if window is not None:
        middle = position[one] + normal * (radius[one] - 0.5 * overlap)[:, None]
        chosen &= window.contains(middle, packing)
        volume = window.shape.volume
    else:
        assert packing.cell is not None
        volume = packing.cell.volume
    reduced = radius[one] * radius[two] / (radius[one] + radius[two])
    found = normal[chosen], overlap[chosen], reduced[chosen]
    return NearPairs(*found, packing.space.shadow(radius[inside]), volume, packing.space)


def overlapping_pairs(
    position: FloatArray, radius: FloatArray, scale: float = 1.0, cell: Cell | None = None
) -> tuple[IntArray, IntArray]:
    """
    Pairs of spheres whose distance is below (r_i + r_j) * scale, in linear time.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Finite, dump's length unit.
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
    count = len(radius)
    if count == 0:
        return np.zeros((0, 2), np.int64), np.zeros((0, 3), np.int64)
    basis = _basis(position, cell)
    moved, turns = position, np.empty((0, 3), np.int64)
    if basis.repeats.any():
        moved, turns = np.empty((count, 3)), np.empty((count, 3), np.int64)
        move_into_basis(position, basis, moved, turns)
    grids = list(_grids(moved, radius, scale, basis))
    room, most = USUAL_CONTACTS * count, MOST_CONTACTS * count
    while True:
        pairs = Pairs(np.empty((room, 2), np.int32), np.empty((room, 3), np.int16), most)
        found = 0
        for place, grid in enumerate(grids):
            found = pairs_within(grid, basis, scale, pairs, found)
            for larger in grids[:place]:
                found = pairs_between(grid, larger, basis, scale, pairs, found)
        if found > most:
            raise PackingError(
                f"more than {MOST_CONTACTS} contacts a grain by geometry: {count} grains lie on "
                f"top of one another; check the units of radii and positions"
            )
        if found <= room:
            break
        room = found
    rows, image = np.empty((found, 2), np.int64), np.empty((found, 3), np.int64)
    sort_pairs(Pairs(pairs.rows[:found], pairs.image[:found], most), count, rows, image)
    if turns.any():
        image += turns[rows[:, 0]] - turns[rows[:, 1]]
    if cell is not None and not np.array_equal(cell.lattice.combination, np.eye(3)):
        # from vectors of the basis to those of the cell
        image = image[:, : len(cell.lattice.combination)] @ cell.lattice.combination
    return rows, image


def _basis(position: FloatArray, cell: Cell | None) -> Basis:
    """What is cut into bins: the cell by its shortest vectors, closed by the grains' own box."""
    lattice = np.zeros((0, 3)) if cell is None else cell.lattice.vectors
    repeating = len(lattice)
    # what does not repeat is orthogonal to what does
    across = np.eye(3)
    if repeating:
        unit = lattice / np.linalg.norm(lattice, axis=1)[:, None]
        across = np.asarray(np.linalg.svd(unit)[2][repeating:])
    low, high = _extents(position, across)
    size = np.maximum(high - low, np.finfo(float).tiny ** 0.25)
    vectors = np.vstack([lattice, across * size[:, None]])
    inverse: FloatArray = np.linalg.inv(vectors).astype(np.float64)
    start = np.zeros(3)
    if cell is not None:
        start[:repeating] = (cell.origin @ inverse)[:repeating]
    start[repeating:] = low / size
    lattice_rows = np.zeros((3, 3))
    lattice_rows[:repeating] = lattice
    return Basis(inverse, start, lattice_rows, np.arange(3) < repeating)


def _extents(position: FloatArray, directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    The smallest and largest coordinate of nearly all grains along each direction (shape (K, 3)).

    The bounds are three times as wide as those of 98 % of the grains at most. A few grains that
    flew far away would make all bins large. They go to the outermost bins: that brings no
    neighbours apart.
    """
    low, high = np.empty(len(directions)), np.empty(len(directions))
    # one after the other: that needs a third of the memory
    for k, direction in enumerate(directions):
        along = np.einsum("ij,j->i", position, direction)
        low[k], high[k] = along.min(), along.max()
    some = position[:: len(position) // SAMPLE + 1] @ directions.T
    least, most = np.quantile(some, [0.01, 0.99], axis=0)
    width = most - least
    return np.maximum(low, least - width), np.minimum(high, most + width)


def _grids(position: FloatArray, radius: FloatArray, scale: float, basis: Basis) -> Iterator[Grid]:
    """Grids of grains of like size, the largest grains first."""
    largest, smallest = float(radius.max()), float(radius.min())
    if largest <= CLASS_RATIO * smallest:
        classes = [np.arange(len(radius), dtype=np.int32)]
    else:
        number = np.floor(np.log(largest / radius) / np.log(CLASS_RATIO)).astype(np.int64)
        order = np.argsort(number, kind="stable").astype(np.int32)
        classes = np.split(order, np.cumsum(np.bincount(number))[:-1])
    for rows in classes:
        if len(rows):
            grid = _empty_grid(len(rows), 2 * scale * float(radius[rows].max()), basis)
            fill_grid(position, radius, rows, basis, grid)
            yield grid


def _empty_grid(count: int, edge: float, basis: Basis) -> Grid:
    """A grid of bins that are no thinner than an edge, about as many as there are grains."""
    heights = 1.0 / np.linalg.norm(basis.inverse, axis=0)
    cells = np.where(basis.repeats, edge / heights, 0.0)
    if np.any(cells > MOST_CELLS):
        raise PackingError(
            f"a grain of radius {0.5 * edge:g} spans {cells.max():g} periodic cells: "
            f"have the cell and the radii the same unit?"
        )
    shape = np.maximum(heights / (edge * ROOM), 1.0)
    while np.prod(np.floor(shape)) > 2 * count + 8:
        excess = np.cbrt(np.prod(np.floor(shape)) / (2 * count + 8))
        shape = np.maximum(shape / max(excess, 1.01), 1.0)
    bins = shape.astype(np.int64)
    reach = np.where(basis.repeats, np.ceil(edge * ROOM * bins / heights), 1.0).astype(np.int64)
    return Grid(
        np.empty((count, 4)),
        np.empty(count, np.int32),
        np.zeros(int(np.prod(bins)) + 1, np.int64),
        bins,
        np.maximum(reach, 1),
    )
