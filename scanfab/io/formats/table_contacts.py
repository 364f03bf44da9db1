"""Contacts in a table: pairs by id, with forces whose sign is proved before it is believed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.io.formats.columns import whole_numbers
from scanfab.io.formats.join import count_walls, join_ids, rows_of_ids
from scanfab.io.formats.proof import NEARLY_ALL, proved_force, row_base
from scanfab.io.reader import GrainTable, JoinedContacts

Columns = Mapping[str, npt.NDArray[Any]]

# what programs call a contact of two grains; whatever else is one with a wall
OF_GRAINS = ("ss", "ball-ball", "ball-pebble", "pebble-ball", "pebble-pebble", "rball-rball")


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
    walls = _with_walls(found, ids)
    ids_of_walls, ids = ids[walls], ids[~walls]
    grains = _with_ids(path, grains, ids)
    rows = rows_of_ids(grains, ids)
    known = bool((rows >= 0).all())
    force = _force(path, grains, rows, found, ~walls) if known else None
    force_n = _normal_force(path, found, ~walls) if force is None else None
    image = _image(path, grains, found, ~walls)
    joined = join_ids(path, grains, ids, force, walls=False, image=image, force_n=force_n)
    touched = rows_of_ids(grains, ids_of_walls)
    count = count_walls(touched.max(axis=1)[touched.max(axis=1) >= 0], len(grains.radius))
    return joined._replace(wall_contacts=joined.wall_contacts + count)


def _with_walls(found: Columns, ids: IntArray) -> BoolArray:
    """Contacts with something that is no grain: named as such, or by an id below 0."""
    walls: BoolArray = np.any(ids < 0, axis=1)
    kind = found.get("kind")
    if kind is not None and kind.dtype.kind == "U":
        is_wall = ~np.isin(np.char.lower(np.char.strip(kind)), OF_GRAINS)
        # the wall is the second; its id is of another kind than those of grains
        ids[is_wall, 1] = -1
        walls = walls | is_wall
    return walls


def _with_ids(path: Path, grains: GrainTable, ids: IntArray) -> GrainTable:
    """Grains that the contacts can name."""
    if grains.id is not None or len(ids) == 0:
        return grains if grains.id is not None else _numbered(grains, 0)
    base = row_base(grains, ids)
    if base is None:
        raise ReadError(
            f"{path}: names grains by numbers, but the grain file has no ids, and as rows, counted "
            f"from 0 or from 1, they are no neighbours (or both ways): name the ids of grains "
            f'with `columns={{"id": ...}}`'
        )
    warnings.warn(
        f"the grains have no ids: contacts name their rows, counted from {base}, since these are "
        f"neighbours",
        ScanfabNote,
        stacklevel=2,
    )
    return _numbered(grains, base)


def _numbered(grains: GrainTable, base: int) -> GrainTable:
    return grains._replace(id=np.arange(base, base + len(grains.radius)))


def _vectors(
    path: Path, grains: GrainTable, found: Columns, names: str, kept: BoolArray
) -> FloatArray | None:
    """One vector a contact; what has no column is 0 where all grains lie at one place along it."""
    wanted = names.split()
    lacking = [name for name in wanted if name not in found]
    if len(lacking) == 3:
        return None
    flat = np.ptp(grains.position, axis=0) == 0 if len(grains.radius) else np.ones(3, bool)
    if not all(flat[wanted.index(name)] for name in lacking):
        warnings.warn(
            f"{path}: {', '.join(name for name in wanted if name in found)} are left out, since "
            f"there is no {' and no '.join(lacking)}",
            ScanfabWarning,
            stacklevel=2,
        )
        return None
    columns = [found.get(name, np.zeros(len(kept))) for name in wanted]
    if any(column.dtype.kind not in "biuf" for column in columns):
        raise ReadError(f"{path}: expected numbers in the columns {names}, found text")
    return np.column_stack(columns).astype(np.float64)[kept]


def _image(path: Path, grains: GrainTable, found: Columns, kept: BoolArray) -> IntArray | None:
    image = _vectors(path, grains, found, "ix iy iz", kept)
    return None if image is None else whole_numbers(path, image.ravel()).reshape(-1, 3)


def _force(
    path: Path, grains: GrainTable, rows: IntArray, found: Columns, kept: BoolArray
) -> FloatArray | None:
    """The force on the second grain; None if there is none, or its sign cannot be told."""
    second = _vectors(path, grains, found, "fx2 fy2 fz2", kept)
    if second is not None:
        return second
    first = _vectors(path, grains, found, "fx1 fy1 fz1", kept)
    if first is not None:
        return -first
    force = _vectors(path, grains, found, "fx fy fz", kept)
    if force is None:
        normal = _vectors(path, grains, found, "fnx fny fnz", kept)
        tangential = _vectors(path, grains, found, "ftx fty ftz", kept)
        if normal is None or tangential is None:
            return None
        force = normal + tangential
    cure = (
        ": name them as fx1, fy1, fz1 (on the first) or fx2, fy2, fz2 (on the second) with "
        "`contact_columns`"
    )
    return proved_force(path, grains, rows, force, cure)


def _normal_force(path: Path, found: Columns, kept: BoolArray) -> FloatArray | None:
    """The normal force, compression positive: the sign that nearly all have."""
    values = found.get("fn")
    if values is None or values.dtype.kind not in "biuf":
        return None
    normal = values.astype(np.float64)[kept]
    signs = normal[normal != 0] > 0
    share = float(np.mean(signs)) if len(signs) else 1.0
    if 1 - NEARLY_ALL < share < NEARLY_ALL:
        warnings.warn(
            f"{path}: the normal forces are left out: {share:.0%} are above 0, so it cannot be "
            f"told whether that means compression",
            ScanfabWarning,
            stacklevel=2,
        )
        return None
    return normal if share >= NEARLY_ALL else -normal
