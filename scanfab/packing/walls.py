"""What walls press on grains with, where a source says it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import cast
from scanfab.base.errors import PackingError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.cell import Cell


class ListedWallForces(NamedTuple):
    """
    Contacts with walls as a source names them; a wall is a body that is not in the table.

    Parameters
    ----------
    row : array_like of int, shape (K,)
        Of the grain.
    point : array_like, shape (K, 3)
        Where the wall is touched, dump's length unit; at any of its periodic images.
    force : array_like, shape (K, 3)
        On the grain, dump's force unit.
    """

    row: npt.ArrayLike
    point: npt.ArrayLike
    force: npt.ArrayLike


class WallForces(NamedTuple):
    """The forces of walls on grains, K of them."""

    row: IntArray
    """Of the grain (of a clump the sphere that touches), shape (K,)."""
    point: FloatArray
    """Where it touches the wall, next to where the grain is, shape (K, 3); dump's length unit."""
    force: FloatArray
    """On the grain, shape (K, 3); dump's force unit."""


def resolve_wall_forces(
    listed: ListedWallForces, position: FloatArray, cell: Cell | None
) -> WallForces:
    """
    Listed forces of walls, each beside its grain.

    Raises
    ------
    PackingError
        If a contact names a row that does not exist, or a number is not finite.
    """
    row = cast("wall_forces: row", listed.row, np.int64, (None,))
    point = cast("wall_forces: point", listed.point, np.float64, (len(row), 3))
    force = cast("wall_forces: force", listed.force, np.float64, (len(row), 3))
    if np.any((row < 0) | (row >= len(position))):
        raise PackingError(f"wall_forces: names a row that is none of {len(position)} grains")
    if not (np.isfinite(point).all() and np.isfinite(force).all()):
        raise PackingError("wall_forces: expected finite points and forces")
    if cell is not None and cell.is_periodic:
        point = point + cell.nearest_image(point - position[row]) @ cell.vectors
    return WallForces(row, point, force)
