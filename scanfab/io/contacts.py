"""Contact lists joined to rows of the grain table: by ids, or by the centres of both grains."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import MOST
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.reader import GrainTable, JoinedContacts, OtherGrainsError
from scanfab.packing.contacts import ContactList

# an end of a contact within this fraction of a radius from a centre belongs to that grain
SAME_PLACE = 0.01
# two grains are neighbours if their distance is below (r1 + r2) times this
NEAR = 1.1
# a rule that holds for this share of all contacts holds
NEARLY_ALL = 0.9


def rows_of_ids(grains: GrainTable, ids: npt.ArrayLike) -> IntArray:
    """Rows of the grains with these ids; -1 where no grain has the id."""
    wanted = np.asarray(ids)
    if grains.id is None or len(grains.id) == 0:
        return np.full(wanted.shape, -1, dtype=np.int64)
    order = np.argsort(grains.id)
    place = np.minimum(np.searchsorted(grains.id[order], wanted), len(order) - 1)
    rows = order[place]
    return np.where(grains.id[rows] == wanted, rows, -1)


def join_ids(
    path: Path,
    grains: GrainTable,
    ids: IntArray,
    force: FloatArray | None,
    *,
    walls: bool | Literal["unknown"],
    image: IntArray | None = None,
    force_n: FloatArray | None = None,
) -> JoinedContacts:
    """
    Join contacts that name grains by id.

    Parameters
    ----------
    path : Path
        For messages.
    grains : GrainTable
        With ids.
    ids : ndarray, shape (M, 2)
        As the file names them.
    force : ndarray, shape (M, 3), optional
        Force on the second grain.
    walls : bool or "unknown"
        Whether an id that no grain has is a wall's. ``unknown``: probably; a warning counts them.
    image : ndarray of int, shape (M, 3), optional
        Lattice translation of the second grain, from the positions of the table.
    force_n : ndarray, shape (M,) or (M, 3), optional
        Normal force, for files that have no more of the force; see :class:`ContactList`.

    Raises
    ------
    ReadError
        If a contact names a grain that does not exist.
    """
    if grains.id is None:
        raise ReadError(f"{path}: names grains by id, but the grain file has no ids")
    rows = rows_of_ids(grains, ids)
    return _join(
        path,
        ContactList(rows, image, force, force_n=force_n),
        walls,
        lambda contact, end: f"names the grain {ids[contact, end]}",
        len(grains.radius),
    )


def join_positions(
    path: Path,
    grains: GrainTable,
    ends: FloatArray,
    force: FloatArray | None,
    force_n: FloatArray | None = None,
) -> JoinedContacts:
    """
    Join contacts that are lines between centres; an end where no grain is belongs to a wall.

    Parameters
    ----------
    path : Path
        For messages.
    grains : GrainTable
        Wrapped into the cell here, as the ends are.
    ends : ndarray, shape (M, 2, 3)
        Both centres, dump's length unit.
    force : ndarray, shape (M, 3), optional
        Force on the second grain.
    force_n : ndarray, shape (M,) or (M, 3), optional
        Normal force, for files that have no more of the force; see :class:`ContactList`.

    Raises
    ------
    ReadError
        If both ends of a contact are where no grain is.
    """
    points = ends.reshape(-1, 3)
    for what, numbers in (("a contact ends", points), ("a grain is", grains.position)):
        if not np.all(np.abs(numbers) < MOST):
            raise ReadError(f"{path}: {what} at coordinates that are no finite numbers")
    if not np.all((grains.radius > 0) & (grains.radius < MOST)):
        raise ReadError(f"{path}: the radii of the grains must be finite and larger than zero")
    rows = np.full(len(points), -1, dtype=np.int64)
    if len(grains.position) and len(points):
        rows = _grains_at(grains, points)
        if grains.cell is None or not grains.cell.is_periodic:
            _refuse_images(path, grains, rows.reshape(-1, 2), ends)
    return _join(
        path,
        ContactList(rows.reshape(-1, 2), force=force, force_n=force_n),
        True,
        lambda contact, end: f"ends at {ends[contact, end].tolist()}, where no grain is",
        len(grains.radius),
    )


def _refuse_images(path: Path, grains: GrainTable, rows: IntArray, ends: FloatArray) -> None:
    """
    ReadError if ends without a grain are periodic images of grains, and no ends at walls.

    An image has two coordinates in common with its grain (in a cell that is not tilted), and lies
    at the distance of a contact; a wall's reference point does so by chance at most.
    """
    from scipy.spatial import KDTree

    one = np.flatnonzero((rows < 0).sum(axis=1) == 1)
    if len(one) == 0 or len(grains.radius) < 2:
        return
    lost = np.argmax(rows[one] < 0, axis=1)
    partner, point = rows[one, 1 - lost], ends[one, lost]
    length = np.linalg.norm(point - ends[one, 1 - lost], axis=1)[:, None]
    image = np.zeros(len(one), dtype=bool)
    for two in ([0, 1], [0, 2], [1, 2]):
        distance, other = KDTree(grains.position[:, two]).query(point[:, two], k=2)
        reach = grains.radius[partner][:, None] + grains.radius[other]
        is_same = distance < SAME_PLACE * float(grains.radius.min())
        is_contact = (length > 0.5 * reach) & (length < 1.05 * reach)
        image |= np.any(is_same & is_contact & (other != partner[:, None]), axis=1)
    if image.sum() > 0.5 * len(one):
        raise ReadError(
            f"{path}: {image.sum()} contacts end at periodic images of grains, but the sample has "
            f"no cell: name it with `cell=(LX, LY, LZ)` (and `periodic`)"
        )


def count_walls(rows: IntArray, count: int) -> IntArray:
    """How often each of ``count`` grains occurs."""
    return np.bincount(rows, minlength=count).astype(np.int64)


def _grains_at(grains: GrainTable, points: FloatArray) -> IntArray:
    """Rows of the grains whose centres are at the points; -1 where there is none."""
    from scipy.spatial import KDTree

    position, radius, row = grains.position, grains.radius, np.arange(len(grains.position))
    if grains.cell is not None and grains.cell.is_periodic:
        points, position = grains.cell.wrap(points), grains.cell.wrap(position)
        # rounding may put a point and its centre on opposite faces: images just outside help
        margin = min(SAME_PLACE * float(radius.max()), float(grains.cell.heights.min()))
        images, of, _ = grains.cell.images(position, margin)
        position = np.concatenate([position, images])
        row = np.concatenate([row, of])
    distance, nearest = KDTree(position).query(points)
    same = distance < SAME_PLACE * radius[row[nearest]]
    return np.where(same, row[nearest], -1)


def _join(
    path: Path,
    listed: ContactList,
    walls: bool | Literal["unknown"],
    describe: Callable[[int, int], str],
    count: int,
) -> JoinedContacts:
    """Tell contacts of two grains from contacts with a wall (one row is -1) and from errors."""
    rows = np.asarray(listed.pairs)
    unknown = rows < 0
    wrong = unknown.all(axis=1) if walls else unknown.any(axis=1)
    if wrong.any():
        contact = int(np.argmax(wrong))
        end = int(np.argmax(unknown[contact]))
        raise OtherGrainsError(
            f"{path}: contact {contact + 1} {describe(contact, end)}, which is not in the grain "
            f"file ({np.count_nonzero(wrong)} of {len(rows)} contacts): do both files belong to "
            f"the same step? A periodic sample also needs its cell (`cell`)"
        )
    both = ~unknown.any(axis=1)
    if walls == "unknown" and not both.all():
        first = int(np.argmin(both))
        warnings.warn(
            f"{path}: {np.count_nonzero(~both)} of {len(rows)} contacts name a grain that is not "
            f"in the grain file and are counted as contacts with walls: contact {first + 1} "
            f"{describe(first, int(np.argmax(unknown[first])))}",
            ScanfabWarning,
            stacklevel=4,
        )
    image, force, force_n = (
        None if values is None else np.asarray(values)[both]
        for values in (listed.image, listed.force, listed.force_n)
    )
    kept = ContactList(rows[both], image, force, force_n=force_n)
    return JoinedContacts(kept, count_walls(rows[~both].max(axis=1), count))


@np.errstate(over="ignore", invalid="ignore")
def branches(grains: GrainTable, rows: IntArray) -> FloatArray:
    """From the first to the second grain of each pair, to the nearest image."""
    branch: FloatArray = grains.position[rows[:, 1]] - grains.position[rows[:, 0]]
    if grains.cell is not None and grains.cell.is_periodic and np.all(np.isfinite(branch)):
        branch = branch + grains.cell.nearest_image(branch) @ grains.cell.vectors
    return branch


def row_base(grains: GrainTable, ids: IntArray) -> int | None:
    """
    Whether contacts number the rows of grains from 0 or from 1; None if that cannot be told.

    By the pairs, which are neighbours under one of both numberings only.
    """
    fits = []
    for base in (0, 1):
        rows = ids - base
        if rows.min(initial=0) >= 0 and rows.max(initial=0) < len(grains.radius):
            length = np.linalg.norm(branches(grains, rows), axis=1)
            if np.mean(length < NEAR * grains.radius[rows].sum(axis=1)) > NEARLY_ALL:
                fits.append(base)
    return fits[0] if len(fits) == 1 else None


@np.errstate(over="ignore", invalid="ignore")
def proved_force(
    path: Path, grains: GrainTable, rows: IntArray, force: FloatArray, cure: str = ""
) -> FloatArray | None:
    """
    The force on the second grain: the sign by which nearly all forces push the grains apart.

    Parameters
    ----------
    path : Path
        For messages.
    grains : GrainTable
        Of the same step.
    rows : ndarray, shape (M, 2)
        Both grains of each contact.
    force : ndarray, shape (M, 3)
        On one of both, the same for all contacts.
    cure : str, optional
        What the user can do where that cannot be told, for the warning.

    Returns
    -------
    ndarray, shape (M, 3), or None
        None, with a warning, where the forces speak for neither.
    """
    along = np.sum(branches(grains, rows) * force, axis=1)
    along = along[along != 0]
    share = float(np.mean(along > 0)) if len(along) else 1.0
    if 1 - NEARLY_ALL < share < NEARLY_ALL:
        warnings.warn(
            f"{path}: the forces are left out: {share:.0%} of them push the second grain off the "
            f"first, so it cannot be told on which of both they act{cure}",
            ScanfabWarning,
            stacklevel=2,
        )
        return None
    on_second = share >= NEARLY_ALL
    warnings.warn(
        f"the forces act on the {'second' if on_second else 'first'} grain of each "
        f"contact, since they push the grains apart",
        ScanfabNote,
        stacklevel=2,
    )
    return force if on_second else -force
