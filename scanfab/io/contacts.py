"""
Join contact lists to rows of the grain table, by ids or by the centres of both grains.

If a file does not say on which grain its forces act, their sign follows from the condition that
nearly all forces push the grains apart.
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

# an end of a contact belongs to the grain whose centre is within this fraction of the radius
SAME_PLACE = 0.01
# a rule counts as true if it holds for this share of all contacts
NEARLY_ALL = 0.9
# programs' words for a contact of two grains; any other word means a contact with a wall
OF_GRAINS = ("ss", "ball-ball", "ball-pebble", "pebble-ball", "pebble-pebble", "rball-rball")


class NotContactsError(ReadError):
    """No column of a file can hold ids; a file that the user did not name is then skipped."""


class OtherGrainsError(NotContactsError):
    """The ids in a contact file are not the ids of the grains."""


def rows_of_ids(grains: GrainTable, ids: npt.ArrayLike) -> IntArray:
    """The rows of the grains with these ids; -1 for an id that no grain has."""
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
        The contact file, for messages.
    grains : GrainTable
        The grains; they must have ids.
    ids : ndarray, shape (M, 2)
        The ids of both grains of each contact.
    force : ndarray, shape (M, 3), optional
        Force on the second grain, dump's force unit.
    walls : bool, "unknown" or "negative"
        Whether an id that no grain has means a wall. ``unknown``: yes, with a warning that counts
        them. ``negative``: only an id below 0.
    image : ndarray of int, shape (M, 3), optional
        Lattice translation of the second grain, relative to the positions in ``grains``.
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
    Join contacts that are lines between centres; an end without a grain belongs to a wall.

    Parameters
    ----------
    path : Path
        The contact file, for messages.
    grains : GrainTable
        The grains; centres and ends are wrapped into the cell before they are compared.
    ends : ndarray, shape (M, 2, 3)
        Both centres, dump's length unit.
    force : ndarray, shape (M, 3), optional
        Force on the second grain, dump's force unit.
    force_n : ndarray, shape (M,) or (M, 3), optional
        Normal force, for files that have no more of the force; see :class:`ContactList`.

    Raises
    ------
    ReadError
        If neither end of a contact is at a grain.
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
    """The row of the grain whose centre is at each point; -1 for a point without a grain."""
    from scipy.spatial import KDTree

    position, radius, row = grains.position, grains.radius, np.arange(len(grains.position))
    if len(row) == 0 or len(points) == 0:
        return np.full(len(points), -1, dtype=np.int64)
    if grains.cell is not None and grains.cell.is_periodic:
        points, position = grains.cell.wrap(points), grains.cell.wrap(position)
        # rounding may put a point and its centre at opposite faces: search images outside, too
        margin = min(SAME_PLACE * float(radius.max()), float(grains.cell.heights.min()))
        images, repeated, _ = grains.cell.images_outside(position, margin)
        position, row = np.concatenate([position, images]), np.append(row, repeated)
    distance, nearest = KDTree(position).query(points)
    same = distance < SAME_PLACE * radius[row[nearest]]
    return np.where(same, row[nearest], -1)


def _refuse_images(path: Path, grains: GrainTable, rows: IntArray, ends: FloatArray) -> None:
    """
    ReadError if most ends without a grain are periodic images of grains, not points of walls.

    In a cell that is not tilted, an image shares two coordinates with its grain and lies at contact
    distance from the partner. The reference point of a wall does both only by chance.
    """
    from scipy.spatial import KDTree

    partial = np.flatnonzero((rows < 0).sum(axis=1) == 1)
    if len(partial) == 0 or len(grains.radius) < 2:
        return
    lost = np.argmax(rows[partial] < 0, axis=1)
    partner, point = rows[partial, 1 - lost], ends[partial, lost]
    length = np.linalg.norm(point - ends[partial, 1 - lost], axis=1)[:, None]
    is_image = np.zeros(len(partial), dtype=bool)
    for two in ([0, 1], [0, 2], [1, 2]):
        distance, other = KDTree(grains.position[:, two]).query(point[:, two], k=2)
        reach = grains.radius[partner][:, None] + grains.radius[other]
        is_same = distance < SAME_PLACE * float(grains.radius.min())
        is_contact = (length > 0.5 * reach) & (length < 1.05 * reach)
        is_image |= np.any(is_same & is_contact & (other != partner[:, None]), axis=1)
    if is_image.sum() > 0.5 * len(partial):
        problem = f"{is_image.sum()} contacts end at periodic images, but there is no cell"
        raise ReadError(f"{path}: {problem}: name it with `cell=(LX, LY, LZ)` (and `periodic`)")


def _join(
    path: Path,
    grains: GrainTable,
    listed: ContactList,
    named: AnyArray,
    verb: str,
    walls: bool | Literal["unknown", "negative"],
) -> JoinedContacts:
    """
    Separate contacts of two grains from contacts with a wall (one row is -1) and from errors.

    ``named`` holds both ends as the file names them; messages join contact and end by ``verb``.
    """
    rows = np.asarray(listed.pairs)
    lost = rows < 0
    both = ~lost.any(axis=1)
    wrong = lost.all(axis=1) if walls else ~both
    if walls == "negative":
        wrong |= np.any(lost & (named >= 0), axis=1)
    doubtful = wrong if wrong.any() else ~both & (walls == "unknown")
    if doubtful.any():
        contact = int(np.argmax(doubtful))
        end = named[contact, np.argmax(lost[contact])].tolist()
        problem = f"{path}: contact {contact + 1} {verb} {end}, which is not in the grain file "
        problem += f"({np.count_nonzero(doubtful)} of {len(rows)} contacts)"
        if wrong.any():
            advice = "are both of the same step? A periodic sample also needs its `cell`"
            raise OtherGrainsError(f"{problem}: {advice}")
        warn(f"{problem}: these are counted as contacts with walls")
    image, force, force_n = (
        None if values is None else np.asarray(values)[both]
        for values in (listed.image, listed.force, listed.force_n)
    )
    kept = ContactList(rows[both], image, force, force_n=force_n)
    walls_of = np.bincount(rows[~both].max(axis=1), minlength=len(grains.radius))
    return JoinedContacts(kept, walls_of)


@np.errstate(over="ignore", invalid="ignore")
def branches(grains: GrainTable, rows: IntArray) -> FloatArray:
    """The vector from the first grain of each pair to the nearest image of the second."""
    branch: FloatArray = grains.position[rows[:, 1]] - grains.position[rows[:, 0]]
    if grains.cell is not None and grains.cell.is_periodic and np.all(np.isfinite(branch)):
        branch = branch + grains.cell.nearest_image(branch) @ grains.cell.vectors
    return branch


def _sign(values: FloatArray, what: str, doubt: str) -> float | None:
    """The sign of nearly all values (1 if all are zero); None, with a warning, if there is none."""
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
    The force on the second grain, with the sign for which nearly all forces push the grains apart.

    ``rows`` are the two grains of each contact, and ``force`` acts on the same one (first or
    second) in all contacts. If neither sign fits, the result is None, and a warning ends with
    ``cure``, the advice for the user.
    """
    doubt = f"of them push the second grain, so it is unclear on which grain they act{cure}"
    along = np.sum(branches(grains, rows) * force, axis=1)
    sign = _sign(along, f"{path}: the forces are left out", doubt)
    if sign is None:
        return None
    which = "second" if sign > 0 else "first"
    note(f"the forces act on the {which} grain of each contact, since they push the grains apart")
    return sign * force


def join_table(path: Path, grains: GrainTable, columns: Columns) -> JoinedContacts:
    """
    Join the contacts of a table to grains.

    Parameters
    ----------
    path : Path
        The contact file, for messages.
    grains : GrainTable
        The grains of the same step. If they have no ids, contacts name their rows, counted from 0
        if a 0 is listed, else from 1.
    columns : mapping
        Columns by quantity: ``id1 id2``; optional are ``kind``, ``ix iy iz`` (image of the second
        grain), ``fx2 fy2 fz2`` or ``fx1 fy1 fz1`` (force on the second or first grain), ``fx fy
        fz`` (force on either), ``fnx`` to ``ftz`` (its normal and tangential part), ``fn``.

    Raises
    ------
    ReadError
        If a pair names a grain that does not exist.
    """
    ids = np.column_stack([whole_numbers(path, columns[end]) for end in ("id1", "id2")])
    kind = columns.get("kind")
    if kind is not None and kind.dtype.kind == "U":
        # the second end is the wall, and its id numbers walls, not grains
        ids[~np.isin(np.char.lower(np.char.strip(kind)), OF_GRAINS), 1] = -1
    walls = np.any(ids < 0, axis=1)
    columns = {name: values[~walls] for name, values in columns.items()}
    pairs = ids[~walls]
    if grains.id is None:
        first = int(pairs.min(initial=1) > 0)
        note(f"the grains have no ids: contacts name their rows, counted from {first}")
        grains = grains._replace(id=np.arange(len(grains.radius)) + first)
    rows = rows_of_ids(grains, pairs)
    force = _force(path, grains, rows, columns) if (rows >= 0).all() else None
    force_n = columns.get("compression") if force is None else None
    if force is None and force_n is None and (force_n := columns.get("fn")) is not None:
        if force_n.dtype.kind not in "biuf":
            raise ReadError(f"{path}: expected numbers in the column fn, found text")
        # compression is positive, and nearly all contacts are under compression
        doubt = "are above 0, so it is unclear which sign means compression"
        sign = _sign(doubles(force_n), f"{path}: the normal forces are left out", doubt)
        force_n = None if sign is None else sign * doubles(force_n)
    shift = _vectors(path, grains, columns, "ix iy iz")
    image = None if shift is None else whole_numbers(path, shift.ravel()).reshape(-1, 3)
    joined = join_ids(path, grains, pairs, force, walls=False, image=image, force_n=force_n)
    # not contacts of two walls
    with_walls = ids[walls & np.any(ids >= 0, axis=1)]
    counted = join_ids(path, grains, with_walls, None, walls="negative")
    return joined._replace(wall_contacts=counted.wall_contacts)


def _vectors(path: Path, grains: GrainTable, table: Columns, names: str) -> FloatArray | None:
    """A vector for each contact; a missing component is 0 if all grains share that coordinate."""
    wanted = names.split()
    lacking = [name for name in wanted if name not in table]
    if len(lacking) == len(wanted):
        return None
    flat = (grains.position == grains.position[:1]).all(axis=0)
    if not all(flat[wanted.index(name)] for name in lacking):
        present = ", ".join(name for name in wanted if name in table)
        warn(f"{path}: {present} are left out, since there is no {' and no '.join(lacking)}")
        return None
    columns = [table.get(name, np.zeros(len(table["id1"]))) for name in wanted]
    if any(column.dtype.kind not in "biuf" for column in columns):
        raise ReadError(f"{path}: expected numbers in the columns {names}, found text")
    return np.column_stack(columns).astype(np.float64)


def _force(path: Path, grains: GrainTable, rows: IntArray, table: Columns) -> FloatArray | None:
    """The force on the second grain; None if there is none, or its sign is unclear."""
    for names, sign in (("fx2 fy2 fz2", 1.0), ("fx1 fy1 fz1", -1.0)):
        named = _vectors(path, grains, table, names)
        if named is not None:
            return sign * named
    force = _vectors(path, grains, table, "fx fy fz")
    if force is None:
        normal = _vectors(path, grains, table, "fnx fny fnz")
        tangential = _vectors(path, grains, table, "ftx fty ftz")
        if normal is None or tangential is None:
            return None
        force = normal + tangential
    cure = ": name them as fx1, fy1, fz1 (on the first) or fx2, fy2, fz2 with `contact_columns`"
    return proved_force(path, grains, rows, force, cure)
