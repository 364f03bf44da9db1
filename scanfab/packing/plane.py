"""Discs: whether all centres lie in one coordinate plane, and what a cell is there."""

from __future__ import annotations

import numpy as np

from scanfab.base.errors import PackingError
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.packing.cell import Cell

# centres below which to lie in one plane may be chance
FEWEST = 10


def space_of(position: FloatArray) -> Space:
    """
    The plane in which centres surely lie; all space where that is not sure.

    They lie in one if they are ten at least, and all share exactly one coordinate.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.packing.plane import space_of
    >>> line = np.arange(12.0)
    >>> space_of(np.column_stack([line, line**2, np.ones(12)]))
    Space: the plane x-y
    """
    if len(position) < FEWEST:
        return SPACE
    shared = np.flatnonzero((position == position[0]).all(axis=0))
    return Space(int(shared[0])) if len(shared) == 1 else SPACE


def flat_space(position: FloatArray) -> Space:
    """
    The plane of discs; of several that hold all centres the one across z, or else y.

    Raises
    ------
    PackingError
        If they do not share a coordinate.
    """
    shared = np.flatnonzero((position == position[:1]).all(axis=0))
    if len(shared) == 0:
        extents = ", ".join(f"{edge:.4g}" for edge in np.ptp(position, axis=0))
        raise PackingError(
            f"the centres do not lie in one coordinate plane (they take {extents} along x, y, z): "
            f"expected discs that share one coordinate exactly; `dim=3` reads them as spheres"
        )
    return Space(int(shared[-1]))


def spelt_plane(position: FloatArray, space: Space) -> str:
    """Where the plane of some centres lies: ``z = 0``."""
    assert space.across is not None
    return f"{'xyz'[space.across]} = {position[0, space.across]:g}"


def refuse_outside(position: FloatArray, space: Space) -> None:
    """
    Refuse centres that do not lie in the plane of a series.

    Raises
    ------
    PackingError
        If one leaves it.
    """
    if space.across is None or not len(position):
        return
    along, name = position[:, space.across], "xyz"[space.across]
    elsewhere = along[along != along[0]]
    if not elsewhere.size:
        return
    raise PackingError(
        f"the series is read as discs in {space}, as its first frame has them, but here centres "
        f"lie at {name} = {along[0]:g} and at {name} = {elsewhere[0]:g}: `dim=3` reads all "
        f"frames as spheres"
    )


def cell_in_plane(cell: Cell, space: Space) -> Cell:
    """
    The cell of discs: it does not repeat across their plane.

    There it has one vector, along the normal. Its other vectors lie in the plane.

    Raises
    ------
    PackingError
        If more than one of its vectors leads out of the plane.
    """
    leaving = np.flatnonzero(cell.vectors[:, space.across])
    if len(leaving) != 1:
        raise PackingError(
            f"the cell's vectors {cell.vectors.tolist()} do not fit discs in {space}: expected two "
            f"of them in the plane, and one that leads out of it"
        )
    out = int(leaving[0])
    vectors = cell.vectors.copy()
    vectors[out] *= space.normal
    one, two, three = (repeats and k != out for k, repeats in enumerate(cell.periodic))
    return Cell(vectors, (one, two, three), cell.origin, space)
