"""
Contact lists joined to rows of the grain table: by ids, or by the centres of both grains.

Where a file does not say on which grain its forces act, their sign is proved by the grains.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError, note, warn
from scanfab.base.typing import AnyArray, Columns, FloatArray, IntArray
from scanfab.io.columns import whole_numbers
from scanfab.io.reader import GrainTable, JoinedContacts
from scanfab.packing.contacts import ContactList

# an end of a contact within this fraction of a radius from a centre belongs to that grain
SAME_PLACE = 0.01
# two grains are neighbours if their distance is below (r1 + r2) times this
NEAR = 1.1
# a rule is taken to hold if it holds for this share of all contacts
NEARLY_ALL = 0.9
# what programs call a contact of two grains; whatever else is one with a wall
OF_GRAINS = ("ss", "ball-ball", "ball-pebble", "pebble-ball", "pebble-pebble", "rball-rball")


class NotContactsError(ReadError):
    """No column of a file can hold ids: if nobody named the file, it is skipped with a note."""


class OtherGrainsError(NotContactsError):
    """The ids of a file of contacts are not those of the grains."""


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
    walls: bool | Literal["unknown", "negative"],
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
    walls : bool, "unknown" or "negative"
        Whether an id that no grain has is a wall's. ``unknown``: probably; a warning counts them.
        ``negative``: if it is below 0.
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
    listed = ContactList(rows_of_ids(grains, ids), image, force, force_n=force_n)
    return _join(path, grains, listed, ids, "names the grain", walls)


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
    numbers = np.concatenate([points.ravel(), grains.position.ravel(), grains.radius])
    if not np.all(np.abs(numbers) < MOST) or not np.all(grains.radius > 0):
        raise ReadError(f"{path}: expected finite ends and centres, and finite radii above 0")
    rows = _grains_at(grains, points).reshape(-1, 2)
    if grains.cell is None or not grains.cell.is_periodic:
        _refuse_images(path, grains, rows, ends)
    listed = ContactList(rows, force=force, force_n=force_n)
    return _join(path, grains, listed, ends, "ends at a grain at", True)


def _grains_at(grains: GrainTable, points: FloatArray) -> IntArray:
    """Rows of the grains whose centres are at the points; -1 where there is none."""
    from scipy.spatial import KDTree

    position, radius, row = grains.position, grains.radius, np.arange(len(grains.position))
    if len(row) == 0 or len(points) == 0:
        return np.full(len(points), -1, dtype=np.int64)
    if grains.cell is not None and grains.cell.is_periodic:
        points, position = grains.cell.wrap(points), grains.cell.wrap(position)
        # rounding may put a point and its centre on opposite faces: images just outside help
        margin = min(SAME_PLACE * float(radius.max()), float(grains.cell.heights.min()))
        position, row, _ = grains.cell.with_images(position, margin)
    distance, nearest = KDTree(position).query(points)
    same = distance < SAME_PLACE * radius[row[nearest]]
    return np.where(same, row[nearest], -1)


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
    is_image = np.zeros(len(one), dtype=bool)
    for two in ([0, 1], [0, 2], [1, 2]):
        distance, other = KDTree(grains.position[:, two]).query(point[:, two], k=2)
        reach = grains.radius[partner][:, None] + grains.radius[other]
        is_same = distance < SAME_PLACE * float(grains.radius.min())
        is_contact = (length > 0.5 * reach) & (length < 1.05 * reach)
        is_image |= np.any(is_same & is_contact & (other != partner[:, None]), axis=1)
    if is_image.sum() > 0.5 * len(one):
        told = f"{is_image.sum()} contacts end at periodic images of grains, without a cell"
        raise ReadError(f"{path}: {told}: name it with `cell=(LX, LY, LZ)` (and `periodic`)")


def count_walls(rows: IntArray, count: int) -> IntArray:
    """How often each of ``count`` grains occurs."""
    return np.bincount(rows, minlength=count).astype(np.int64)


def _join(
    path: Path,
    grains: GrainTable,
    listed: ContactList,
    named: AnyArray,
    verb: str,
    walls: bool | Literal["unknown", "negative"],
) -> JoinedContacts:
    """
    Tell contacts of two grains from contacts with a wall (one row is -1) and from errors.

    Messages say with ``verb`` how the file names both ends (in ``named``).
    """
    rows = np.asarray(listed.pairs)
    lost = rows < 0
    both = ~lost.any(axis=1)
    wrong = lost.all(axis=1) if walls else ~both
    if walls == "negative":
        wrong |= np.any(lost & (named >= 0), axis=1)
    doubtful = ~both & (walls == "unknown") if not wrong.any() else wrong
    if doubtful.any():
        contact = int(np.argmax(doubtful))
        end = named[contact, np.argmax(lost[contact])].tolist()
        told = f"{path}: contact {contact + 1} {verb} {end}, which is not in the grain file "
        told += f"({np.count_nonzero(doubtful)} of {len(rows)} contacts)"
        if wrong.any():
            advice = "are both of the same step? A periodic sample also needs its `cell`"
            raise OtherGrainsError(f"{told}: {advice}")
        warn(f"{told}: these are counted as contacts with walls")
    image, force, force_n = (
        None if values is None else np.asarray(values)[both]
        for values in (listed.image, listed.force, listed.force_n)
    )
    kept = ContactList(rows[both], image, force, force_n=force_n)
    return JoinedContacts(kept, count_walls(rows[~both].max(axis=1), len(grains.radius)))


@np.errstate(over="ignore", invalid="ignore")
def branches(grains: GrainTable, rows: IntArray) -> FloatArray:
    """From the first to the second grain of each pair, to the nearest image."""
    branch: FloatArray = grains.position[rows[:, 1]] - grains.position[rows[:, 0]]
    if grains.cell is not None and grains.cell.is_periodic and np.all(np.isfinite(branch)):
        branch = branch + grains.cell.nearest_image(branch) @ grains.cell.vectors
    return branch


def _sign(values: FloatArray, what: str, doubt: str) -> float | None:
    """The sign that nearly all values have (1 without any); None, with a warning, without one."""
    share = float(np.mean(values[values != 0] > 0)) if values.any() else 1.0
    if 1 - NEARLY_ALL < share < NEARLY_ALL:
        warn(f"{what}: {share:.0%} {doubt}")
        return None
    return 1.0 if share >= NEARLY_ALL else -1.0


@np.errstate(over="ignore", invalid="ignore")
def proved_force(
    path: Path, grains: GrainTable, rows: IntArray, force: FloatArray, cure: str = ""
) -> FloatArray | None:
    """
    The force on the second grain: the sign by which nearly all forces push the grains apart.

    ``force`` acts on one of both grains, whose rows are in ``rows``, on the same in all contacts.
    Where the forces speak for neither, the answer is None, with a warning that ends in ``cure``:
    what the user can do.
    """
    doubt = f"of them push the second grain, so it cannot be told on which of both they act{cure}"
    along = np.sum(branches(grains, rows) * force, axis=1)
    sign = _sign(along, f"{path}: the forces are left out", doubt)
    if sign is None:
        return None
    which = "second" if sign > 0 else "first"
    note(f"the forces act on the {which} grain of each contact, since they push the grains apart")
    return sign * force


def join_table(path: Path, grains: GrainTable, found: Columns) -> JoinedContacts:
    """
    Join the contacts of a table to grains.

    Parameters
    ----------
    path : Path
        For messages.
    grains : GrainTable
        Of the same step; without ids their rows are numbered from 0 or 1, whichever makes pairs
        of neighbours.
    found : mapping
        Columns by what they are: ``id1 id2``, and if there are any ``kind``, ``ix iy iz`` (image
        of the second), ``fx2 fy2 fz2`` or ``fx1 fy1 fz1`` (force on the second or first), ``fx fy
        fz`` (on either), ``fnx`` to ``ftz`` (normal and tangential part), ``fn``.

    Raises
    ------
    ReadError
        If a pair names a grain that is not there.
    """
    ids = np.column_stack([whole_numbers(path, found[one]) for one in ("id1", "id2")])
    kind = found.get("kind")
    if kind is not None and kind.dtype.kind == "U":
        # the second end is the wall: its id counts walls, not grains
        ids[~np.isin(np.char.lower(np.char.strip(kind)), OF_GRAINS), 1] = -1
    walls = np.any(ids < 0, axis=1)
    found = {name: values[~walls] for name, values in found.items()}
    pairs = ids[~walls]
    grains = _with_ids(path, grains, pairs)
    rows = rows_of_ids(grains, pairs)
    force = _force(path, grains, rows, found) if (rows >= 0).all() else None
    force_n = found.get("fn") if force is None else None
    if force_n is not None:
        # compression is positive, and nearly all contacts are under compression
        doubt = "are above 0, so it cannot be told whether that means compression"
        sign = _sign(doubles(force_n), f"{path}: the normal forces are left out", doubt)
        force_n = None if sign is None else sign * doubles(force_n)
    shift = _vectors(path, grains, found, "ix iy iz")
    image = None if shift is None else whole_numbers(path, shift.ravel()).reshape(-1, 3)
    joined = join_ids(path, grains, pairs, force, walls=False, image=image, force_n=force_n)
    # a pair may be listed in either order; the image is that of the second grain
    keys = np.sort(pairs, axis=1)
    if image is not None:
        keys = np.hstack([keys, np.where(pairs[:, :1] > pairs[:, 1:], -image, image)])
    unique, counts = np.unique(keys, axis=0, return_counts=True)
    if np.any(counts > 1):
        first, second, *_ = unique[np.argmax(counts)]
        told = f"{path}: {np.count_nonzero(counts > 1)} of {len(unique)} pairs are listed more "
        warn(f"{told}than once, such as {first} and {second}: each row counts as a contact")
    touched = rows_of_ids(grains, ids[walls]).max(axis=1)
    count = count_walls(touched[touched >= 0], len(grains.radius))
    return joined._replace(wall_contacts=joined.wall_contacts + count)


def _with_ids(path: Path, grains: GrainTable, ids: IntArray) -> GrainTable:
    """
    Grains that the contacts can name: by their rows if they have no ids.

    Rows are counted from 0 or from 1: the pairs are neighbours under one of both numberings only.
    """
    if grains.id is not None:
        return grains
    fits, count = [], len(grains.radius)
    for base in (0, 1):
        rows = ids - base
        if len(rows) and rows.min() >= 0 and rows.max() < count:
            length = np.linalg.norm(branches(grains, rows), axis=1)
            near = length < NEAR * grains.radius[rows].sum(axis=1)
            fits += [base] * bool(np.mean(near) > NEARLY_ALL)
    if len(ids) and len(fits) != 1:
        told = 'the grains have no ids, and by rows are no neighbours: `columns={"id": ...}`'
        raise OtherGrainsError(f"{path}: names grains by numbers, but {told} names their ids")
    for base in fits:
        note(f"the grains have no ids: contacts name their rows, counted from {base}")
    return grains._replace(id=np.arange(count) + sum(fits))


def _vectors(path: Path, grains: GrainTable, found: Columns, names: str) -> FloatArray | None:
    """One vector a contact; what has no column is 0 where all grains lie at one place along it."""
    wanted = names.split()
    lacking = [name for name in wanted if name not in found]
    if len(lacking) == len(wanted):
        return None
    flat = (grains.position == grains.position[:1]).all(axis=0)
    if not all(flat[wanted.index(name)] for name in lacking):
        there = ", ".join(name for name in wanted if name in found)
        warn(f"{path}: {there} are left out, since there is no {' and no '.join(lacking)}")
        return None
    columns = [found.get(name, np.zeros(len(found["id1"]))) for name in wanted]
    if any(column.dtype.kind not in "biuf" for column in columns):
        raise ReadError(f"{path}: expected numbers in the columns {names}, found text")
    return np.column_stack(columns).astype(np.float64)


def _force(path: Path, grains: GrainTable, rows: IntArray, found: Columns) -> FloatArray | None:
    """The force on the second grain; None if there is none, or its sign cannot be told."""
    for names, sign in (("fx2 fy2 fz2", 1.0), ("fx1 fy1 fz1", -1.0)):
        named = _vectors(path, grains, found, names)
        if named is not None:
            return sign * named
    force = _vectors(path, grains, found, "fx fy fz")
    if force is None:
        normal = _vectors(path, grains, found, "fnx fny fnz")
        tangential = _vectors(path, grains, found, "ftx fty ftz")
        if normal is None or tangential is None:
            return None
        force = normal + tangential
    cure = ": name them as fx1, fy1, fz1 (on the first) or fx2, fy2, fz2 with `contact_columns`"
    return proved_force(path, grains, rows, force, cure)
