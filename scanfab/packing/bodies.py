"""Bodies, also called clumps: which spheres are one grain, where the grain is, and its volume."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scanfab.base.errors import Note
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, FloatArray, IntArray, RowArray

if TYPE_CHECKING:
    from scanfab.packing.cell import Cell
    from scanfab.packing.packing import Packing

# Names of columns in lower case. In any format, these columns number clumps.
CLUMP_COLUMNS = ("id_multisphere", "clumpid", "clump_id", "clump")
# These number molecules, which may be clumps, species or bonded spheres; 0 stands for none.
MOLECULE_COLUMNS = ("mol", "molecule")
# Rays through all pairs of spheres of one clump together, which take a second or two.
MOST_RAYS = 1 << 23
# Rays of a sphere: the errors of many clumps cancel, so a few rays do; few clumps need more.
FEWEST_RAYS, ENOUGH_RAYS = 256, 4096
# Rays through pairs of spheres at a time, which take some tens of megabytes.
CHUNK = 1 << 20


@dataclass(frozen=True, eq=False)
class Bodies:
    """
    The bodies of a packing in which at least one body has several spheres.

    All arrays have a row for each sphere. A value of a whole body stands at each of its spheres, so
    that nobody has to translate between spheres and bodies.

    Attributes
    ----------
    number : ndarray of int, shape (N,)
        Number of the body in the source; negative for a sphere that is a body of its own.
    head : ndarray of int, shape (N,)
        Row of the first sphere of the body.
    turns : ndarray of int, shape (N, 3)
        Lattice vectors from the sphere in the cell to its image next to the first sphere.
    place : ndarray, shape (N, 3)
        Place of the body next to its first sphere, dump's length unit: the mean of its spheres'
        centres, weighted by their volumes.
    """

    number: IntArray
    head: IntArray
    turns: IntArray
    place: FloatArray

    @property
    def is_head(self) -> BoolArray:
        """Whether a sphere is the first one of its body, shape (N,)."""
        return np.asarray(self.head == np.arange(len(self.head)))

    def count(self, chosen: BoolArray) -> int:
        """Number of bodies with a chosen sphere; ``chosen`` has shape (N,)."""
        return len(np.unique(self.head[chosen]))

    def whole(self, chosen: BoolArray) -> BoolArray:
        """All spheres of bodies with a chosen sphere, shape (N,)."""
        some = np.zeros(len(self.head), np.bool_)
        some[self.head[chosen]] = True
        return some[self.head]

    def to_place(self, position: FloatArray, cell: Cell | None) -> FloatArray:
        """Vectors from each sphere in the cell to the place of its body, shape (N, 3)."""
        vectors = np.zeros((3, 3)) if cell is None else cell.vectors
        return self.place - position - self.turns @ vectors

    def image(self, pairs: RowArray, image: RowArray) -> IntArray:
        """
        Lattice translations between bodies, shape (M, 3), from those between their spheres.

        The translation of spheres counts from the sphere in the cell, that of bodies from their
        first spheres.
        """
        return np.asarray(image + self.turns[pairs[:, 0]] - self.turns[pairs[:, 1]])

    def between(self, pairs: RowArray, image: RowArray) -> BoolArray:
        """Which pairs of spheres belong to two bodies, or to a body and its image, shape (M,)."""
        one, two = pairs.T
        # a sphere that touches itself is an error, which the caller reports
        apart = (self.head[one] != self.head[two]) | (one == two)
        same = np.flatnonzero(~apart)
        apart[same] = self.image(pairs[same], image[same]).any(axis=1)
        return np.asarray(apart)


def bodies_of(
    number: IntArray,
    position: FloatArray,
    radius: FloatArray,
    cell: Cell | None,
    space: Space = SPACE,
) -> Bodies | None:
    """
    Put spheres together as bodies; None if each is a body of its own.

    Parameters
    ----------
    number : ndarray of int, shape (N,)
        Spheres of one number are one body. A sphere with a negative number is a body of its own.
    position : ndarray, shape (N, 3)
        Inside the cell, dump's length unit.
    radius : ndarray, shape (N,)
        Dump's length unit.
    cell : Cell, optional
        The spheres of a body may lie on both sides of its periodic faces.
    space : Space, optional
        The plane of discs. Their areas take the place of volumes.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.packing.bodies import bodies_of
    >>> row = np.array([[0.0, 0, 0], [1, 0, 0], [5, 0, 0]])
    >>> bodies = bodies_of(np.array([4, 4, -1]), row, np.ones(3), None)
    >>> bodies.head, bodies.place[:, 0]
    (array([0, 0, 2]), array([0.5, 0.5, 5. ]))
    """
    head = np.arange(len(number))
    rows = np.flatnonzero(number >= 0)
    _, first, of = np.unique(number[rows], return_index=True, return_inverse=True)
    if len(first) == len(rows):
        return None
    head[rows] = rows[first[of]]
    turns = np.zeros((len(number), 3), np.int64)
    branch = position - position[head]
    if cell is not None and cell.is_periodic:
        turns = cell.nearest_image(branch)
        branch = branch + turns @ cell.vectors
    # in units of the body's largest sphere, as the cube of a length may overflow
    largest = np.zeros(len(head))
    np.maximum.at(largest, head, radius)
    volume = (radius / largest[head]) ** space.dimension
    weight = np.bincount(head, volume, len(head))[head]
    moment = [np.bincount(head, volume * along, len(head))[head] for along in branch.T]
    place = position[head] + np.column_stack(moment) / weight[:, None]
    return Bodies(number, head, turns, place)


class Grouping(NamedTuple):
    """The spheres of a frame, and the bodies that they belong to."""

    id: IntArray
    """Number of each sphere in the dump, shape (N,)."""
    body: IntArray
    """The id of the first sphere of the body of each sphere, shape (N,)."""


def regrouped(first: int, before: Grouping, now: Grouping) -> Note | None:
    """
    Say that bodies consist of other spheres than before, or that spheres have come or gone.

    Parameters
    ----------
    first : int
        Number of the frame before.
    before, now : Grouping
        Bodies may have other numbers, as long as they consist of the same spheres.
    """
    common, early, late = np.intersect1d(before.id, now.id, return_indices=True)
    one, two = before.body[early], now.body[late]
    both = len(np.unique(np.column_stack([one, two]), axis=0))
    if not both == len(np.unique(one)) == len(np.unique(two)):
        text = f"other spheres are one body than in frame {first}, so each frame has its own bodies"
        cure = "does the column of `bodies` number bodies?"
        return Note("other_bodies", f"{text}: {cure}")
    if len(common) == len(before.id) == len(now.id):
        return None
    here, there = (
        f"{counted(len(np.unique(frame.body)), 'grain')} of {counted(len(frame.id), 'sphere')}"
        for frame in (now, before)
    )
    text = f"{here}, where frame {first} has {there}: grains have left or come in"
    return Note("grains_left", text)


def own_shares(packing: Packing, directions: Callable[[int], FloatArray]) -> FloatArray:
    """
    The share of each sphere's volume that no earlier sphere of the same clump covers.

    Rays run from the centre of a sphere to its surface. The part of each ray inside other spheres
    is exact, and so is the volume of two spheres or of a rod. The volume of other clumps has a
    relative error of 1e-4 to 1e-3, which averages out over many clumps.

    Parameters
    ----------
    packing : Packing
        Its spheres are grains, or parts of clumps.
    directions : callable
        Makes a number of unit vectors that are evenly spread, shape (P, 3).

    Returns
    -------
    ndarray, shape (N,)
        1 for spheres that are a grain of their own.
    """
    bodies, radius, space = packing.bodies, packing.radius, packing.space
    share = np.ones(len(radius))
    if bodies is None:
        return share
    position = -bodies.to_place(packing.position, packing.cell)
    # all pairs of spheres of one body, the earlier row and the later one
    order = np.argsort(bodies.head, kind="stable")
    starts = np.searchsorted(bodies.head[order], bodies.head[order], side="left")
    place = np.arange(len(order)) - starts
    later = np.repeat(np.arange(len(order)), place)
    earlier = np.arange(len(later)) - np.repeat(np.cumsum(place) - place, place) + starts[later]
    one, two = order[earlier], order[later]
    apart = np.linalg.norm(position[one] - position[two], axis=1)
    meet = apart < radius[one] + radius[two]
    one, two, apart = one[meet], two[meet], apart[meet]
    rays = directions(int(np.clip(MOST_RAYS // max(len(one), 1), FEWEST_RAYS, ENOUGH_RAYS)))
    _, first, before = np.unique(two, return_index=True, return_counts=True)
    # the part that the nearest sphere covers is a lens; rays measure what others cover beyond it
    lens = lens_volumes(apart, radius[one], radius[two], space) / space.volume(radius[two])
    for count in np.unique(before):
        pairs = first[before == count][:, None] + np.arange(count)
        nearest = lens[pairs].argmax(axis=1)
        share[two[pairs[:, 0]]] -= lens[pairs].max(axis=1)
        if count == 1:
            continue
        for part in np.array_split(np.arange(len(pairs)), 1 + pairs.size * len(rays) // CHUNK):
            some = pairs[part]
            other, own = one[some], two[some]
            place = (position[other] - position[own]) / radius[own][..., None]
            ratio = radius[other] / radius[own]
            share[own[:, 0]] -= _beyond(place, ratio, nearest[part], rays, space.dimension)
    return share


def _beyond(
    place: FloatArray, radius: FloatArray, nearest: IntArray, rays: FloatArray, dimension: int
) -> FloatArray:
    """
    The share of spheres' volumes that others cover beyond the nearest one.

    Places and radii of the others, shape (spheres, others), are in radii of their sphere.
    """
    depth = place @ rays.T
    reach = np.square(radius) - np.einsum("...i,...i->...", place, place)
    half = np.sqrt(np.maximum(reach[..., None] + depth**2, 0.0))
    # where rays enter and leave other spheres
    into, out = np.clip(depth - half, 0.0, 1.0), np.clip(depth + half, 0.0, 1.0)
    row = np.arange(len(nearest))
    known = (out[row, nearest] ** dimension - into[row, nearest] ** dimension).mean(axis=1)
    order = np.argsort(into, axis=1)
    into, out = (np.take_along_axis(ends, order, axis=1) for ends in (into, out))
    # each stretch begins behind the stretches that begin before it
    until = np.maximum.accumulate(out, axis=1)
    into[:, 1:] = np.maximum(into[:, 1:], until[:, :-1])
    covered = np.maximum(out**dimension - into**dimension, 0.0)
    found: FloatArray = covered.sum(axis=1).mean(axis=1) - known
    return found


def lens_volumes(
    apart: FloatArray, one: FloatArray, two: FloatArray | float, space: Space = SPACE
) -> FloatArray:
    """
    Volumes that pairs of spheres share; of discs the areas.

    Parameters
    ----------
    apart : ndarray, shape (K,)
        Distance of their centres, dump's length unit.
    one, two : ndarray, shape (K,), or float
        Their radii, dump's length unit.
    space : Space, optional
        The plane in which they lie, if they are discs.
    """
    smaller = space.volume(np.minimum(one, two))
    is_inside = apart <= np.abs(two - one)
    distance = np.where(is_inside, 1.0, apart)
    if space.is_plane:
        # two segments of circles, each a sector less its triangle
        lens = np.zeros_like(distance)
        for r, other in ((one, two), (two, one)):
            height = (distance**2 + np.square(r) - np.square(other)) / (2.0 * distance)
            cosine = np.clip(height / r, -1.0, 1.0)
            lens = lens + np.square(r) * (np.arccos(cosine) - cosine * np.sqrt(1.0 - cosine**2))
        return np.where(is_inside, smaller, lens)
    deep = np.maximum(two + one - apart, 0.0)
    lens = np.pi * deep**2 / (12.0 * distance)
    lens *= distance**2 + 2.0 * distance * (one + two) - 3.0 * (one - two) ** 2
    return np.where(is_inside, smaller, lens)
