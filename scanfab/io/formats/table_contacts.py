"""Contacts in a table: pairs by id, with forces whose sign is proved before it is believed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.columns import whole_numbers
from scanfab.io.contacts import (
    NEARLY_ALL,
    count_walls,
    join_ids,
    proved_force,
    row_base,
    rows_of_ids,
)
from scanfab.io.reader import GrainTable, JoinedContacts, OtherGrainsError

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
    kind = found.get("kind")
    if kind is not None and kind.dtype.kind == "U":
        # the second is the wall; its id is of another kind than those of grains
        ids[~np.isin(np.char.lower(np.char.strip(kind)), OF_GRAINS), 1] = -1
    walls = np.any(ids < 0, axis=1)
    found = {name: values[~walls] for name, values in found.items()}
    pairs = ids[~walls]
    grains = _with_ids(path, grains, pairs)
    rows = rows_of_ids(grains, pairs)
    force = _force(path, grains, rows, found) if (rows >= 0).all() else None
    force_n = _normal_force(path, found) if force is None else None
    shift = _vectors(path, grains, found, "ix iy iz")
    image = None if shift is None else whole_numbers(path, shift.ravel()).reshape(-1, 3)
    joined = join_ids(path, grains, pairs, force, walls=False, image=image, force_n=force_n)
    _tell_twice(path, pairs, image)
    touched = rows_of_ids(grains, ids[walls]).max(axis=1)
    count = count_walls(touched[touched >= 0], len(grains.radius))
    return joined._replace(wall_contacts=joined.wall_contacts + count)


def _tell_twice(path: Path, pairs: IntArray, image: IntArray | None) -> None:
    """A warning for pairs that are listed twice, where no column says that images differ."""
    turned = (pairs[:, :1] > pairs[:, 1:]) if image is not None else np.zeros((0, 1))
    sides = [] if image is None else [np.where(turned, -image, image)]
    keys = np.concatenate([np.sort(pairs, axis=1), *sides], axis=1)
    unique, counts = np.unique(keys, axis=0, return_counts=True)
    if len(unique) < len(keys):
        first = unique[np.argmax(counts > 1), :2]
        warnings.warn(
            f"{path}: {np.count_nonzero(counts > 1)} of {len(unique)} pairs are listed more than "
            f"once, such as {first[0]} and {first[1]}: each row counts as a contact",
            ScanfabWarning,
            stacklevel=3,
        )


def _with_ids(path: Path, grains: GrainTable, ids: IntArray) -> GrainTable:
    """Grains that the contacts can name: by their rows if they have no ids."""
    if grains.id is not None:
        return grains
    base = row_base(grains, ids) if len(ids) else 0
    if base is None:
        raise OtherGrainsError(
            f"{path}: names grains by numbers, but the grain file has no ids, and as rows, counted "
            f"from 0 or from 1, they are no neighbours (or both ways): name the ids of grains "
            f'with `columns={{"id": ...}}`'
        )
    if len(ids):
        warnings.warn(
            f"the grains have no ids: contacts name their rows, counted from {base}, since these "
            f"are neighbours",
            ScanfabNote,
            stacklevel=3,
        )
    return grains._replace(id=np.arange(base, base + len(grains.radius)))


def _vectors(path: Path, grains: GrainTable, found: Columns, names: str) -> FloatArray | None:
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
    columns = [found.get(name, np.zeros(len(found["id1"]))) for name in wanted]
    if any(column.dtype.kind not in "biuf" for column in columns):
        raise ReadError(f"{path}: expected numbers in the columns {names}, found text")
    return np.column_stack(columns).astype(np.float64)


def _force(path: Path, grains: GrainTable, rows: IntArray, found: Columns) -> FloatArray | None:
    """The force on the second grain; None if there is none, or its sign cannot be told."""
    second = _vectors(path, grains, found, "fx2 fy2 fz2")
    if second is not None:
        return second
    first = _vectors(path, grains, found, "fx1 fy1 fz1")
    if first is not None:
        return -first
    force = _vectors(path, grains, found, "fx fy fz")
    if force is None:
        normal = _vectors(path, grains, found, "fnx fny fnz")
        tangential = _vectors(path, grains, found, "ftx fty ftz")
        if normal is None or tangential is None:
            return None
        force = normal + tangential
    cure = (
        ": name them as fx1, fy1, fz1 (on the first) or fx2, fy2, fz2 (on the second) with "
        "`contact_columns`"
    )
    return proved_force(path, grains, rows, force, cure)


def _normal_force(path: Path, found: Columns) -> FloatArray | None:
    """The normal force, compression positive: the sign that nearly all have."""
    values = found.get("fn")
    if values is None or values.dtype.kind not in "biuf":
        return None
    normal = values.astype(np.float64)
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
