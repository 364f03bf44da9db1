"""
Proof of what files do not say: what columns without names are, and on which grain a force acts.

The grains must touch, and forces push them apart.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.base.lengths import LEAST, MOST, all_within
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.io.reader import GrainTable

if TYPE_CHECKING:
    from scipy.spatial import KDTree


# grains by which nothing can be proved
TOO_FEW = 10
# grains around the middle among which neighbours are sought, those of them that are looked at, and
# neighbours of each
AROUND = 20_000
LOOKED_AT = 2000
NEIGHBOURS = 12
# of r1 + r2: a distance that is a contact's, and one that is no overlap of grains any more
CONTACT = 0.05
OVERLAP = 0.75
# of the grains, which touch another at least, and which overlap another at most
MOST_TOUCH = 0.5
FEW_OVERLAP = 0.01
# this part of those that are looked at comes first, and tells it where so many of it touch, and
# none overlaps: the others can then hardly say anything else
PART = 4
CLEARLY_MOST = 0.6
# grains that are looked at together, for which the processor's own memory is enough
BLOCK = 1 << 16
# of the contacts, which speak for a sign, or for the number of the first row
NEARLY_ALL = 0.9


def touch(x: FloatArray, y: FloatArray, z: FloatArray, radius: FloatArray) -> bool:
    """
    Whether most grains touch another and hardly any lies in another.

    Columns that are read as others (a diameter or a mass as the radius, a number as a coordinate)
    give no such packing. Of a large one the middle is looked at.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.io.formats.proof import touch
    >>> row = np.arange(20.0), np.zeros(20), np.zeros(20)
    >>> [touch(*row, np.full(20, radius)) for radius in (0.5, 1.0, 0.25)]
    [True, False, False]
    """
    from scipy.spatial import KDTree

    are_lengths = all(all_within(one, -MOST, MOST) for one in (x, y, z))
    if len(radius) < TOO_FEW or not are_lengths or not all_within(radius, LEAST, MOST):
        return False
    rows, inner = _around_middle(x, y, z)
    radius = radius[rows]
    # a tree for few questions
    tree = KDTree(
        np.column_stack([one[rows] for one in (x, y, z)]),
        leafsize=32,
        compact_nodes=False,
        balanced_tree=False,
    )
    chosen = _spread(inner)
    if len(chosen) == LOOKED_AT:
        # at random again: rows may be in any regular order
        first = np.random.default_rng(1).choice(chosen, LOOKED_AT // PART, replace=False)
        nearest = _nearest(tree, radius, first)
        if np.mean(_is_contact(nearest)) >= CLEARLY_MOST and not np.any(nearest < OVERLAP):
            return True
    nearest = _nearest(tree, radius, chosen)
    touching, overlapping = np.mean(_is_contact(nearest)), np.mean(nearest < OVERLAP)
    return bool(touching >= MOST_TOUCH and overlapping <= FEW_OVERLAP)


def _is_contact(ratio: FloatArray) -> BoolArray:
    return np.abs(ratio - 1.0) < CONTACT


def _spread(count: int) -> IntArray:
    """
    Some of so many rows, one of each part: all if these are few.

    Which of a part is random: every so many of grains in rows may be the same place of each row.
    """
    if count <= LOOKED_AT:
        return np.arange(count)
    within = np.random.default_rng(0).random(LOOKED_AT)
    places: IntArray = ((np.arange(LOOKED_AT) + within) * (count / LOOKED_AT)).astype(np.int64)
    return places


def _nearest(tree: KDTree, radius: FloatArray, chosen: IntArray) -> FloatArray:
    """The least distance of a neighbour of each of some grains, in r1 + r2."""
    distance, other = tree.query(tree.data[chosen], k=min(NEIGHBOURS, len(radius) - 1) + 1)
    with np.errstate(over="ignore"):
        ratio = distance / (radius[chosen, None] + radius[other])
    ratio[other == chosen[:, None]] = np.inf
    least: FloatArray = ratio.min(axis=1)
    return least


def _around_middle(*coordinates: FloatArray) -> tuple[IntArray | slice, int]:
    """
    Grains by which a packing of any size is told, and how many of them have all neighbours here.

    The latter come first.
    """
    count = len(coordinates[0])
    if count <= AROUND:
        return slice(None), count
    some = _spread(count)
    middle = [np.median(one[some]) for one in coordinates]

    def away(rows: IntArray | slice) -> FloatArray:
        x, y, z = (one[rows] - at for one, at in zip(coordinates, middle, strict=True))
        x *= x  # in place, which is several times as fast
        for part in (y, z):
            part *= part
            x += part
        return x

    # those that may be among them, by the sample: sorting all would take most of the time
    reach = np.quantile(away(some), min(2 * AROUND / count, 1.0))
    near = np.concatenate(
        [
            start + np.flatnonzero(away(slice(start, start + BLOCK)) <= reach)
            for start in range(0, count, BLOCK)
        ]
    )
    if len(near) < AROUND:
        near = np.arange(count)
    first = np.argpartition(away(near), (AROUND // 2, AROUND - 1))[:AROUND]
    return near[first], AROUND // 2


@np.errstate(over="ignore", invalid="ignore")
def _branches(grains: GrainTable, rows: IntArray) -> FloatArray:
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
        if rows.min(initial=0) < 0 or rows.max(initial=0) >= len(grains.radius):
            continue
        length = np.linalg.norm(_branches(grains, rows), axis=1)
        near = length < (1 + 2 * CONTACT) * grains.radius[rows].sum(axis=1)
        if np.mean(near) > NEARLY_ALL:
            fits.append(base)
    return fits[0] if len(fits) == 1 else None


@np.errstate(over="ignore", invalid="ignore")
def _share_of_push(grains: GrainTable, rows: IntArray, force: FloatArray) -> float | None:
    """Of the contacts with a force, those whose force pushes the second grain off the first."""
    along = np.sum(_branches(grains, rows) * force, axis=1)
    along = along[along != 0]
    return float(np.mean(along > 0)) if len(along) else None


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
    share = _share_of_push(grains, rows, force)
    if share is not None and 1 - NEARLY_ALL < share < NEARLY_ALL:
        warnings.warn(
            f"{path}: the forces are left out: {share:.0%} of them push the second grain off the "
            f"first, so it cannot be told on which of both they act{cure}",
            ScanfabWarning,
            stacklevel=2,
        )
        return None
    on_second = share is None or share >= NEARLY_ALL
    warnings.warn(
        f"the forces act on the {'second' if on_second else 'first'} grain of each "
        f"contact, since they push the grains apart",
        ScanfabNote,
        stacklevel=2,
    )
    return force if on_second else -force


def tell_left_out(names: Iterable[str]) -> None:
    """A note of arrays that may be forces too, but by no name that is known."""
    left_out = ", ".join(name for name in names if "force" in name.lower() and name != "force")
    if left_out:
        warnings.warn(
            f"left out of the contacts: {left_out}: a force is taken from an array `force` with "
            f"three components",
            ScanfabNote,
            stacklevel=2,
        )
