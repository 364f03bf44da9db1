"""Bodies: which spheres are one grain, a clump; where it is, and what it touches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scanfab.base.errors import Note
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from scanfab.packing.cell import Cell


# columns of dumps, by their names in lower case: these number clumps, whatever the format
CLUMP_COLUMNS = ("id_multisphere", "clumpid", "clump_id", "clump")
# and these molecules, which may be clumps, or species, or bonded spheres; 0 stands for none
MOLECULE_COLUMNS = ("mol", "molecule")


@dataclass(frozen=True, eq=False)
class Bodies:
    """
    The bodies of a packing of which at least one has several spheres.

    All arrays have a row for each sphere, so that nobody has to translate between spheres and
    bodies: what is one for a whole body stands at each of its spheres.

    Attributes
    ----------
    number : ndarray of int, shape (N,)
        As the source numbers the bodies; negative for a sphere that is a body of its own.
    head : ndarray of int, shape (N,)
        Row of the first sphere of each one's body.
    turns : ndarray of int, shape (N, 3)
        Lattice vectors from where the sphere is to where it is next to the first one of its body.
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
        """Whether a sphere is the first one of its body: true once a body, shape (N,)."""
        return np.asarray(self.head == np.arange(len(self.head)))

    @property
    def has_many(self) -> BoolArray:
        """Whether a sphere's body has more spheres, shape (N,)."""
        return np.asarray(np.bincount(self.head, minlength=len(self.head))[self.head] > 1)

    def count(self, chosen: BoolArray) -> int:
        """Of how many bodies some spheres are, shape (N,)."""
        return len(np.unique(self.head[chosen]))

    def whole(self, chosen: BoolArray) -> BoolArray:
        """All spheres of the bodies of which one is chosen, shape (N,)."""
        some = np.zeros(len(self.head), np.bool_)
        some[self.head[chosen]] = True
        return some[self.head]

    def to_place(self, position: FloatArray, cell: Cell | None) -> FloatArray:
        """From each sphere, where it lies in the cell, to the place of its body, shape (N, 3)."""
        vectors = np.zeros((3, 3)) if cell is None else cell.vectors
        return self.place - position - self.turns @ vectors

    def image(self, pairs: IntArray, image: IntArray) -> IntArray:
        """
        Lattice translations from first body to second, of which spheres touch, shape (M, 3).

        Those of the spheres are from where each of them lies in the cell; these are from where the
        first spheres of both bodies lie.
        """
        one, two = pairs.T
        moved: IntArray = image + self.turns[one] - self.turns[two]
        return moved

    def between(self, pairs: IntArray, image: IntArray) -> BoolArray:
        """Which pairs of spheres are not of one body (or of it and its image), shape (M,)."""
        one, two = pairs.T
        # a sphere and itself are for others to judge
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
        Spheres of one number are one body, each of a negative one is a body of its own.
    position : ndarray, shape (N, 3)
        Inside the cell, dump's length unit.
    radius : ndarray, shape (N,)
        Dump's length unit.
    cell : Cell, optional
        Through its periodic faces each sphere is next to the first one of its body.
    space : Space, optional
        The plane of discs, whose places are weighted with their areas.

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
    # over that of the body's largest sphere: the cube of a length may be beyond all numbers
    largest = np.zeros(len(head))
    np.maximum.at(largest, head, radius)
    volume = (radius / largest[head]) ** space.dimension
    weight = np.bincount(head, volume, len(head))[head]
    moment = [np.bincount(head, volume * along, len(head))[head] for along in branch.T]
    place = position[head] + np.column_stack(moment) / weight[:, None]
    return Bodies(number, head, turns, place)


class Grouping(NamedTuple):
    """The spheres of a frame, those of one body by one number."""

    id: IntArray
    """Shape (N,): as the dump numbers the spheres."""
    body: IntArray
    """Shape (N,): the id of the first sphere of each one's body."""

    def in_words(self) -> str:
        """How many grains there are, bodies of one sphere among them, and of how many spheres."""
        grains = counted(len(np.unique(self.body)), "grain")
        return f"{grains} of {counted(len(self.id), 'sphere')}"


def regrouped(first: int, before: Grouping, now: Grouping) -> Note | None:
    """
    What to tell if other spheres are one body than before, or other spheres are there.

    Parameters
    ----------
    first : int
        Number of the frame before.
    before, now : Grouping
        The numbers of bodies may be others, as long as the same spheres are one.
    """
    common, early, late = np.intersect1d(before.id, now.id, return_indices=True)
    one, two = before.body[early], now.body[late]
    both = len(np.unique(np.column_stack([one, two]), axis=0))
    if not both == len(np.unique(one)) == len(np.unique(two)):
        text = (
            f"other spheres are one body than in frame {first}: each frame is computed with its "
            f"own bodies; is the column that numbers them the right one (`bodies`)? (told once)"
        )
        return Note("other_bodies", text)
    if len(common) == len(before.id) == len(now.id):
        return None
    text = (
        f"{now.in_words()}, where frame {first} has {before.in_words()}: grains have left or "
        f"come in (told once)"
    )
    return Note("grains_left", text)
