"""Contacts in a text dump: which columns are ids and forces, as their names say nothing."""

from __future__ import annotations

from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.columns import refuse_named_twice, whole_numbers
from scanfab.io.contacts import branches, join_ids, rows_of_ids
from scanfab.io.reader import GrainTable, JoinedContacts

# values of LIGGGHTS' compute pair/gran/local in the order in which they are written, and how many
PAIR_VALUES = {"pos": 6, "vel": 6, "id": 3, "force": 3, "force_normal": 3, "force_tangential": 3}
PAIR_VALUES |= {"torque": 3, "torque_normal": 3, "torque_tangential": 3, "history": 3}
PAIR_VALUES |= {"contactArea": 1, "delta": 1, "contactPoint": 3, "ms_id": 2, "heatFlux": 1}
# names that users give columns: ids, force on the first grain, a part of it that is apart
IDS, FORCE, TANGENTIAL = ("id1", "id2"), ("fx", "fy", "fz"), ("tx", "ty", "tz")
# in r1 + r2: where no gap is wider, the list is one of contacts, and the rest is rounding
ROUNDING = 1e-3
# a rule that holds for more than this share of the rows tells what a column is
MOST_ROWS = 0.5
# LAMMPS lists pairs up to this distance, in r1 + r2, for nearly all rows
NEIGHBOURS, NEARLY_ALL = 2.0, 0.98


class Places(NamedTuple):
    """Which columns of a list of contacts are what, counted from 0."""

    ids: list[int]
    force: list[list[int]] = []  # noqa: RUF012
    """Triples of columns, which add up to the force on the first grain."""
    normal: list[int] | None = None
    """The triple that is the normal part of that force."""
    touch: bool = True
    """Whether all pairs in the list touch; LAMMPS lists all within a cut-off."""


@np.errstate(all="ignore")
def join_places(
    path: Path, values: FloatArray, places: Places, grains: GrainTable
) -> JoinedContacts:
    """
    The pairs that touch, and the force on the second grain of each.

    Of a list within a cut-off the pairs with a force touch, or if none is known those that overlap;
    all touch if no gap is wide.
    """
    first, second = places.ids
    where = f", columns {first + 1} and {second + 1}"
    ids = np.column_stack([whole_numbers(path, values[:, k], where) for k in places.ids])
    parts = [values[:, triple] for triple in places.force]
    force = -np.sum(parts, axis=0) if parts else None
    normal = None if places.normal is None else -values[:, places.normal]
    if not places.touch:
        rows = rows_of_ids(grains, ids)
        known, gap = (rows >= 0).all(axis=1), np.zeros(len(rows))
        gap[known] = _gaps(grains, rows[known])
        if np.any(gap > ROUNDING):
            # ids that no grain has stay, for the error that names them
            touches = ~known | (gap < 0 if force is None else force.any(axis=1))
            ids, force = ids[touches], None if force is None else force[touches]
    return join_ids(path, grains, ids, force, walls=False, force_n=normal)


def named_places(path: Path, told: str, names: list[str]) -> Places:
    """
    Columns as users name them.

    Parameters
    ----------
    path : Path
        For messages.
    told : str
        Names of columns, ``id1=c_ids[1],id2=c_ids[2],...``; or the keywords of LIGGGHTS' compute
        pair/gran/local, ``pos id force ...``, whose values have an order of their own.
    names : list of str
        Of all columns.
    """
    if "=" not in told:
        return _keyword_places(path, told, len(names))
    pairs = [part.partition("=") for part in told.split(",")]
    named = {key.strip(): own.strip() for key, _, own in pairs}
    known = ({*IDS}, {*IDS, *FORCE}, {*IDS, *FORCE, *TANGENTIAL})
    if set(named) not in known or len(named) < len(pairs) or not {*named.values()} <= {*names}:
        raise ReadError(
            f"{path}: `contact_columns`: expected id1=NAME,id2=NAME, and fx, fy, fz (tx, ty, tz) "
            f"for the force on the first grain, found {told!r}; the columns are {', '.join(names)}"
        )
    refuse_named_twice(path, {key: named[key] for key in IDS}, "contact_columns")
    triples = [triple for triple in (FORCE, TANGENTIAL) if triple[0] in named]
    ids, *force = ([names.index(named[key]) for key in keys] for keys in (IDS, *triples))
    return Places(ids, force, touch=False)


def _keyword_places(path: Path, told: str, width: int) -> Places:
    """Columns by the keywords of compute pair/gran/local; history:N says how many values it has."""
    asked = dict(word.partition(":")[::2] for word in told.split())
    sizes = {name: size for name, size in PAIR_VALUES.items() if name in asked}
    if asked.get("history", "").isdecimal():
        sizes["history"] = int(asked["history"])
    count = sum(sizes.values())
    if len(sizes) < len(asked) or "id" not in asked or count != width:
        raise ReadError(
            f"{path}: `contact_columns`: expected id1=NAME,id2=NAME, or keywords, id among them "
            f"({', '.join(PAIR_VALUES)}), for {width} columns; {told!r} is for {count}"
        )
    starts = dict(zip(sizes, accumulate(sizes.values(), initial=0), strict=False))
    triple = {name: [start, start + 1, start + 2] for name, start in starts.items()}
    normal, tangential = triple.get("force_normal"), triple.get("force_tangential")
    parts = [normal, tangential] if normal and tangential else []
    return Places(triple["id"][:2], [triple["force"]] if "force" in triple else parts, normal)


def are_whole(values: FloatArray) -> bool:
    """Whether all are whole numbers."""
    return bool(np.all(values == np.rint(values)))


def are_ids(values: FloatArray, grains: GrainTable) -> bool:
    """Whether nearly all are ids of grains: a wrong one among them is reported by its name."""
    return are_whole(values) and bool(np.mean(rows_of_ids(grains, values) >= 0) > MOST_ROWS)


@np.errstate(over="ignore", invalid="ignore")
def id_column(values: FloatArray, grains: GrainTable, *, is_flagged: bool) -> int | None:
    """
    The first of two neighbouring columns of ids; None unless there is one choice.

    Parameters
    ----------
    values : ndarray, shape (M, columns)
        The rows of contacts.
    grains : GrainTable
        With ids.
    is_flagged : bool
        Whether a flag 0 or 1 stands behind the ids, as LIGGGHTS writes it. Else the two ids must
        name grains that lie side by side, and hardly any pair may occur twice: the types of two
        grains do so all the time, a pair that touches through several images does not.
    """
    found = []
    for place in range(values.shape[1] - 1 - is_flagged):
        pairs = values[:, place : place + 2]
        if not all(are_ids(column, grains) for column in pairs.T):
            continue
        if is_flagged:
            is_pair = np.isin(values[:, place + 2], (0, 1)) & (pairs[:, 0] != pairs[:, 1])
            fits = bool(is_pair.all())
        else:
            rows = rows_of_ids(grains, pairs)
            gaps = _gaps(grains, rows[(rows >= 0).all(axis=1)])
            single = len(np.unique(np.sort(pairs, axis=1), axis=0))
            is_near = bool(np.mean(gaps < NEIGHBOURS - 1) > NEARLY_ALL)
            fits = is_near and single >= 0.5 * len(pairs)
        if fits:
            found.append(place)
    return found[0] if len(found) == 1 else None


def refuse_rounded_ids(path: Path, values: FloatArray, grains: GrainTable) -> None:
    """ReadError for ids of a million or more that %g has rounded to six digits."""
    assert grains.id is not None
    longer = grains.id[grains.id >= 1_000_000]
    digits = 10 ** (np.floor(np.log10(np.maximum(longer, 1))).astype(np.int64) - 5)
    longer = longer[longer % digits != 0]
    large = np.any(values >= 1e6, axis=0) & np.all(values == np.rint(values), axis=0)
    if longer.size and large.any() and not np.isin(values[:, large], longer).any():
        advice = 'write them with dump_modify ... format "%.0f ..."'
        raise ReadError(f"{path}: its ids above 999999 are rounded to six digits: {advice}")


def _gaps(grains: GrainTable, rows: IntArray) -> FloatArray:
    """Gaps between the surfaces of pairs of grains, nearest image, in r1 + r2."""
    length = np.linalg.norm(branches(grains, rows), axis=1)
    gaps: FloatArray = length / grains.radius[rows].sum(axis=1) - 1.0
    return gaps
