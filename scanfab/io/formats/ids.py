"""Ids and forces in a contact dump: numbers in columns whose names say nothing by themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.columns import refuse_named_twice
from scanfab.io.contacts import rows_of_ids
from scanfab.io.formats.text_dump import Dump
from scanfab.io.reader import GrainTable

# names of contact_columns: ids, force on the first grain, its tangential part if apart from it
IDS = ("id1", "id2")
FORCE = ("fx", "fy", "fz")
TANGENTIAL = ("tx", "ty", "tz")

# in r1 + r2: where no gap is wider, the list is one of contacts, and the rest is rounding
ROUNDING = 1e-3
# of the rows of a contact file: enough to know a column by its values
MOST_ROWS = 0.5


def are_whole(values: FloatArray) -> bool:
    """Whether all are whole numbers."""
    return bool(np.all(values == np.rint(values)))


def are_ids(values: FloatArray, grains: GrainTable) -> bool:
    """Whether nearly all are ids of grains: a wrong one among them is reported by its name."""
    return are_whole(values) and bool(np.mean(rows_of_ids(grains, values) >= 0) > MOST_ROWS)


def refuse_rounded_ids(path: Path, values: FloatArray, grains: GrainTable) -> None:
    """%g keeps six digits: from a million on ids may be rounded."""
    assert grains.id is not None
    longer = grains.id[grains.id >= 1_000_000]
    digits = 10 ** (np.floor(np.log10(np.maximum(longer, 1))).astype(np.int64) - 5)
    longer = longer[longer % digits != 0]
    large = np.any(values >= 1e6, axis=0) & np.all(values == np.rint(values), axis=0)
    if longer.size and large.any() and not np.isin(values[:, large], longer).any():
        raise ReadError(
            f"{path}: ids above 999999 are rounded to six digits, so contacts name wrong grains: "
            f'write them with dump_modify ... format "%.0f ..."'
        )


def named_places(path: Path, text: str | None, block: Dump) -> dict[str, int]:
    """Columns by their meaning, from ``id1=c_ids[1],id2=c_ids[2],...``; empty without it."""
    if text is None:
        return {}
    pairs = [part.partition("=") for part in text.split(",")]
    named = {key.strip(): own.strip() for key, _, own in pairs}
    known = ({*IDS}, {*IDS, *FORCE}, {*IDS, *FORCE, *TANGENTIAL})
    if set(named) not in known or not all(named.values()) or len(named) < len(pairs):
        raise ReadError(
            f"{path}: `contact_columns`: expected id1=NAME,id2=NAME, and fx, fy, fz (with tx, ty, "
            f"tz) for the force on the first grain, found {text!r}; "
            f"the columns are {', '.join(block.names)}"
        )
    refuse_named_twice(path, {key: named[key] for key in IDS}, "contact_columns")
    for own in named.values():
        if own not in block.names:
            raise ReadError(
                f"{path}: `contact_columns`: there is no column {own!r}; "
                f"the columns are {', '.join(block.names)}"
            )
    return {key: block.names.index(own) for key, own in named.items()}


def named_force(block: Dump, places: dict[str, int]) -> FloatArray | None:
    """The force on the second grain, where the named columns have that on the first."""
    if FORCE[0] not in places:
        return None
    force = block.values[:, [places[key] for key in FORCE]]
    if TANGENTIAL[0] in places:
        force = force + block.values[:, [places[key] for key in TANGENTIAL]]
    return -force


def gaps(grains: GrainTable, rows: IntArray) -> FloatArray:
    """Gaps between the surfaces of pairs of grains, nearest image, in r1 + r2."""
    branch = grains.position[rows[:, 1]] - grains.position[rows[:, 0]]
    if grains.cell is not None and np.all(np.isfinite(branch)):
        branch = branch + grains.cell.nearest_image(branch) @ grains.cell.vectors
    gaps: FloatArray = np.linalg.norm(branch, axis=1) / grains.radius[rows].sum(axis=1) - 1.0
    return gaps


@np.errstate(all="ignore")
def touching_pairs(
    grains: GrainTable, rows: IntArray, force: FloatArray | None
) -> npt.NDArray[np.bool_]:
    """
    Which pairs are contacts, of a list that may hold all pairs within a cut-off.

    Without a wide gap all are. Else those with a force, or without a force column those that
    overlap. What is no grain stays, for the error that names it.
    """
    known = (rows >= 0).all(axis=1)
    gap = np.zeros(len(rows))
    gap[known] = gaps(grains, rows[known])
    if not np.any(gap > ROUNDING):
        return np.ones(len(rows), dtype=bool)
    touches = gap < 0 if force is None else force.any(axis=1)
    return np.asarray(touches | ~known)
