"""Contacts as a source lists them, and as a packing knows them with normals and points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import cast, grains_named
from scanfab.base.errors import PackingError, warn
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, FloatArray, IntArray, RowArray
from scanfab.packing.bodies import Bodies
from scanfab.packing.cell import Cell

if TYPE_CHECKING:
    from scanfab.packing.packing import Packing

ContactSource = Literal["file", "geometric"]

# The geometry of so many contacts is computed at a time, which takes some megabytes.
CHUNK = 1 << 16


class ContactList(NamedTuple):
    """
    Contacts as a source lists them; the packing computes their normals and points.

    Parameters
    ----------
    pairs : array_like of int, shape (M, 2)
        Rows of the two grains.
    image : array_like of int, shape (M, 3), optional
        Lattice translation of the second grain, from the positions as the source has them, wrapped
        or not. By default the second grain is at its nearest image.
    force : array_like, shape (M, 3), optional
        Force on the second grain, dump's force unit.
    source : str, optional
        Where the list comes from: ``file`` or ``geometric``.
    force_n : array_like, shape (M,) or (M, 3), optional
        Normal force, dump's force unit: compression positive, or the vector on the second grain.
        It is for sources without the whole force, from which it follows otherwise.

    Examples
    --------
    >>> from scanfab import ContactList, Packing
    >>> listed = ContactList([[0, 1]], force=[[2.0, 0.0, 0.0]])
    >>> Packing([[0, 0, 0], [2, 0, 0]], 1.0, contacts=listed).contacts.force
    array([[2., 0., 0.]])
    """

    pairs: npt.ArrayLike
    image: npt.ArrayLike | None = None
    force: npt.ArrayLike | None = None
    source: ContactSource = "file"
    force_n: npt.ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Contacts:
    """
    The contacts of a packing, each pair of grains (with its periodic image) once.

    The normal is the unit branch vector from the first to the second centre; the point is the
    middle of the overlap on the branch. Both come from positions and radii, whatever the file
    stores, so that every format gives the same answer.

    Attributes
    ----------
    pairs : ndarray of int
        Rows of the two grains, shape (M, 2).
    image : ndarray of int
        Lattice translation of the second grain, shape (M, 3).
    normal : ndarray
        Unit normals, shape (M, 3), dimensionless.
    point : ndarray
        Contact points, shape (M, 3), dump's length unit; next to the first grain.
    force : ndarray or None
        Force on the second grain, shape (M, 3), dump's force unit; None if the dump has none.
    source : str
        ``file`` or ``geometric``.
    force_n : ndarray or None
        Normal force f·n, shape (M,), dump's force unit: above 0 the grains push each other
        apart (compression). None if the dump has none.

    Examples
    --------
    >>> from scanfab import Packing
    >>> contacts = Packing([[0, 0, 0], [1.5, 0, 0]], 1.0, contacts=[[0, 1], [1, 0]]).contacts
    >>> contacts
    Contacts: 1 contact from file
    >>> contacts.normal, contacts.point
    (array([[1., 0., 0.]]), array([[0.75, 0.  , 0.  ]]))
    """

    pairs: RowArray
    image: RowArray
    normal: FloatArray
    point: FloatArray
    force: FloatArray | None
    source: ContactSource
    force_n: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.pairs)

    def __repr__(self) -> str:
        return f"Contacts: {self.in_words()}"

    def in_words(self) -> str:
        """
        How many there are, and where they come from.

        Returns
        -------
        str
        """
        whence = "from file" if self.source == "file" else "by geometry"
        forces = "" if self.force_n is None else " with normal forces"
        forces = forces if self.force is None else " with forces"
        return f"{counted(len(self), 'contact')} {whence}{forces}"

    def neighbours(self, bodies: Bodies | None, without: BoolArray | None = None) -> RowArray:
        """
        The pairs of grains that touch; clumps that touch in several points are one pair.

        Grains that touch through two images are two pairs, as they are neighbours twice.

        Parameters
        ----------
        bodies : Bodies or None
            The bodies of the packing. Without them grains are spheres, and each contact is a pair.
        without : ndarray of bool, shape (M,), optional
            Contacts that do not count.

        Returns
        -------
        ndarray of int, shape (K, 2)
            Rows of the grains' first spheres.
        """
        # rows are several times as fast to index with as a mask
        rows = slice(None) if without is None else np.flatnonzero(~without)
        pairs = self.pairs[rows]
        if bodies is None:
            return pairs
        heads = bodies.head[pairs]
        return heads[_first_of_each(heads, bodies.image(pairs, self.image[rows]))]


def branches(
    position: FloatArray, pairs: RowArray, image: RowArray, cell: Cell | None
) -> FloatArray:
    """Vectors between the centres of pairs, shape (M, 3), dump's length unit."""
    branch: FloatArray = np.take(position, pairs[:, 1], axis=0)
    branch -= np.take(position, pairs[:, 0], axis=0)
    return branch if cell is None else branch + image.astype(np.float64) @ cell.vectors


def resolve_contacts(listed: ContactList, packing: Packing, turns: IntArray | None) -> Contacts:
    """
    Check a list of contacts, and compute normals and points; each pair and image counts once.

    Parameters
    ----------
    listed : ContactList
        The contacts as the source lists them.
    packing : Packing
        The packing that holds the grains.
    turns : ndarray of int, shape (N, 3), or None
        Lattice vectors from the position of each grain in the packing to its position in the
        source; None if these are the same.

    Raises
    ------
    PackingError
        If a contact names a row that does not exist, or cannot be one.
    """
    count = len(packing)
    pairs = cast("contacts", listed.pairs, np.int64, (None, 2))
    if pairs.size and (pairs.min() < 0 or pairs.max() >= count):
        wrong = int(np.flatnonzero(np.any((pairs < 0) | (pairs >= count), axis=1))[0])
        raise PackingError(
            f"contact {wrong} names the rows {pairs[wrong].tolist()}, "
            f"but there are {count} grains (rows from 0)"
        )
    force: FloatArray | None = None
    if listed.force is not None:
        force = cast("force", listed.force, np.float64, (len(pairs), 3))
    force_n = force
    if force is None and listed.force_n is not None:
        force_n = cast("force_n", listed.force_n, np.float64, (len(pairs), ...))
        if force_n.ndim > 1:
            force_n = cast("force_n", force_n, np.float64, (len(pairs), 3))
    image = _images(listed, pairs, packing, turns)
    rows = np.arange(len(pairs))
    if packing.bodies is not None:
        rows = np.flatnonzero(packing.bodies.between(pairs, image))
    _refuse_itself(pairs[rows], image[rows], packing)
    rows = rows[_first_of_each(pairs[rows], image[rows])]
    force, force_n = (None if one is None else one[rows] for one in (force, force_n))
    return contacts_of(packing, pairs[rows], image[rows], listed.source, force, force_n)


def contacts_of(
    packing: Packing,
    pairs: RowArray,
    image: RowArray,
    source: ContactSource,
    force: FloatArray | None = None,
    force_n: FloatArray | None = None,
) -> Contacts:
    """
    Compute normals and points of contacts between pairs of rows.

    Parameters
    ----------
    packing : Packing
        The packing that holds the grains.
    pairs, image, force : ndarray
        As in :class:`Contacts`.
    source : str
        ``file`` or ``geometric``. Contacts from a file are refused if the grains are too far apart.
    force_n : ndarray, shape (M,) or (M, 3), optional
        Normal force, or a force whose normal part it is.

    Warns
    -----
    ScanfabWarning
        If two centres are the same. The contact has no direction then, and is left out.
    """
    pairs, image = pairs.astype(np.int32, copy=False), image.astype(np.int32, copy=False)
    normal, point, length = geometry(packing.position, packing.radius, pairs, image, packing.cell)
    if source == "file":
        _refuse_long(pairs, length, packing)
    if not length.all():
        same = length == 0.0
        one, two = packing.id[pairs[np.argmax(same)]]
        warn(
            f"the grains {one} and {two} have the same centre ({same.sum()} such pairs): a contact "
            f"between them has no direction and is left out"
        )
        pairs, image, normal, point = pairs[~same], image[~same], normal[~same], point[~same]
        force, force_n = (None if values is None else values[~same] for values in (force, force_n))
    if force_n is not None and force_n.ndim == 2:
        force_n = np.einsum("ci,ci->c", force_n, normal)
    return Contacts(pairs, image, normal, point, force, source, force_n)


def geometry(
    position: FloatArray, radius: FloatArray, pairs: RowArray, image: RowArray, cell: Cell | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Unit normals, middles of the overlaps or gaps, and distances of the centres of pairs.

    Their shapes are (M, 3), (M, 3) and (M,), lengths are in the dump's unit. The normal of grains
    with the same centre is 0, as it has no direction.
    """
    normal, point = np.empty((len(pairs), 3)), np.empty((len(pairs), 3))
    length = np.empty(len(pairs))
    # some pairs at a time, so that temporary arrays take little memory
    for start in range(0, len(pairs), CHUNK):
        some = slice(start, start + CHUNK)
        one, two = pairs[some].T
        branch = branches(position, pairs[some], image[some], cell)
        # a third of the time of np.linalg.norm, with the same result
        apart = np.sqrt(sum(part * part for part in branch.T))
        normal[some] = branch / np.where(apart > 0.0, apart, 1.0)[:, None]
        middle = 0.5 * (apart + radius[one] - radius[two])
        point[some] = np.take(position, one, axis=0) + middle[:, None] * normal[some]
        length[some] = apart
    return normal, point, length


def _images(
    listed: ContactList, pairs: IntArray, packing: Packing, turns: IntArray | None
) -> IntArray:
    """Lattice translations of the second grains, from positions inside the cell."""
    cell, (one, two) = packing.cell, pairs.T
    if listed.image is not None:
        image: IntArray = cast("image", listed.image, np.int64, (len(pairs), 3))
        if np.any(image[:, ~np.array((False,) * 3 if cell is None else cell.periodic)]):
            raise PackingError("image: a contact passes a face that is not periodic")
        return image if turns is None else image + turns[two] - turns[one]
    if cell is None:
        return np.zeros((len(pairs), 3), np.int64)
    image = cell.nearest_image(packing.position[two] - packing.position[one])
    # without images, a list cannot tell through which of several images a pair touches
    branch = branches(packing.position, pairs, image, cell)
    reach = packing.radius[pairs].sum(axis=1)
    close = np.flatnonzero((cell.lattice.shortest < 2.0 * reach) & (one != two))
    for step in cell.lattice.within(2.0 * float(reach[close].max(initial=0.0))):
        touches = np.linalg.norm(branch[close] + step, axis=1) < reach[close]
        if touches.any():
            first, second = packing.id[pairs[close[np.argmax(touches)]]]
            raise PackingError(
                f"the grains {first} and {second} touch through more than one image of this thin "
                f"cell, and the contact list does not say through which one: find the contacts by "
                f'geometry (`contacts="geometric"`)'
            )
    return image


def _refuse_itself(pairs: IntArray, image: IntArray, packing: Packing) -> None:
    """PackingError if a grain is listed as a contact of itself, not of an image of it."""
    itself = (pairs[:, 0] == pairs[:, 1]) & ~image.any(axis=1)
    if itself.any():
        advice = '; find contacts with own images by geometry (`contacts="geometric"`)'
        raise PackingError(
            f"{grains_named(packing.id[pairs[:, 0]], itself)}: in contact with itself"
            f"{advice if packing.is_periodic else ''}"
        )


def _refuse_long(pairs: RowArray, length: FloatArray, packing: Packing) -> None:
    """PackingError if the gap of a listed contact is larger than the smaller grain's radius."""
    radius = packing.radius[pairs]
    excess = length - radius.sum(axis=1) - radius.min(axis=1)
    if np.any(excess > 0):
        worst = int(np.argmax(excess))
        one, two = packing.id[pairs[worst]]
        cell = "if the sample is periodic, name its cell (`cell` and `periodic`)"
        if packing.is_periodic:
            cell = "does the cell (`cell` and `periodic`) belong to this sample?"
        advice = f"{cell}; or is this the contact list of another step?"
        raise PackingError(
            f"the grains {one} and {two} are listed as a contact, but their centres are "
            f"{length[worst]:g} apart and their radii add up to {radius[worst].sum():g}: {advice}"
        )


def _first_of_each(pairs: RowArray, image: RowArray) -> npt.NDArray[np.intp]:
    """Rows where each contact is listed first, whichever of its grains is named first."""
    low, high = pairs.min(axis=1).astype(np.int64), pairs.max(axis=1)
    # a number for each image; the opposite image has the same number with a minus
    base = 2 * int(np.abs(image).max(initial=0)) + 1
    code = image @ base ** np.arange(3)
    # the contact of a grain with its own image is the same as that with the opposite image
    swapped = (pairs[:, 0] > pairs[:, 1]) | ((pairs[:, 0] == pairs[:, 1]) & (code < 0))
    contact = (low * (high.max(initial=0) + 1) + high) * base**3 + np.where(swapped, -code, code)
    _, first = np.unique(contact, return_index=True)
    return np.sort(first)


class WallForces(NamedTuple):
    """
    Forces of walls on grains, K of them; a wall is a body that is not in the table.

    A source may give the points at any of their periodic images. In a packing, a point is next to
    the grain in the cell.
    """

    row: IntArray
    """Row of the grain (of a clump the row of the sphere that touches), shape (K,)."""
    point: FloatArray
    """Where the grain touches the wall, shape (K, 3); dump's length unit."""
    force: FloatArray
    """Force on the grain, shape (K, 3); dump's force unit."""
