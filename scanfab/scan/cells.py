"""Grains sorted into the cells of a grid, for rays that look for the next one."""

from __future__ import annotations

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.cells import Cells, fill_cells
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.kernels.strips import FAR

# A ray through periodic grains that has met nothing along so many periods and mean free paths stays
# in a channel.
MOST_PERIODS, MOST_FREE_PATHS = 64.0, 20.0
# cells of the grid that grains are sorted into, for each of them at most
MOST_CELLS = 4.0


def cells_of(grains: CellGrains) -> Cells:
    """
    Grains sorted into the cells of a grid, whose edges are about as long as a grain is wide.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.scan.cells import cells_of
    >>> from scanfab.scan.solids import CellGrains
    >>> position, one = np.array([[0.5, 0.5, 0.5], [2.5, 0.5, 0.5]]), np.full(2, 0.5)
    >>> cells_of(CellGrains(position, one, one < 0, np.eye(3), np.zeros(3, bool))).parts
    array([3, 1, 1])
    """
    vectors: FloatArray = grains.vectors.astype(np.float64)
    corner = np.zeros(3)
    once = np.linalg.inv(vectors)
    along = grains.position @ once
    reach = grains.radius[:, None] * np.linalg.norm(once, axis=0)
    for k in np.flatnonzero(~grains.periodic):
        # the box of the grains' surfaces
        low, high = (along - reach)[:, k].min(), (along + reach)[:, k].max()
        corner = corner + low * vectors[k]
        vectors[k] *= high - low
    inverse = np.linalg.inv(vectors).astype(np.float64)
    per_length = np.linalg.norm(inverse, axis=0)
    volume = abs(float(np.linalg.det(vectors)))
    wide = max(
        2.0 * float(grains.radius.mean()), (volume / (MOST_CELLS * len(grains.radius))) ** (1 / 3)
    )
    parts = np.maximum(np.rint(1.0 / (per_length * wide)), 1.0).astype(np.int64)
    middle = (grains.position - corner) @ inverse * parts
    reach = grains.radius[:, None] * per_length * parts
    low, high = (np.floor(edge).astype(np.int64) for edge in (middle - reach, middle + reach))
    # the last face of the box belongs to the last cell
    low, high = (np.where(grains.periodic, x, np.clip(x, 0, parts - 1)) for x in (low, high))
    start, nothing = np.zeros(int(np.prod(parts)) + 1, np.int64), np.zeros(0, np.int64)
    fill_cells(low, high, grains.periodic, parts, start, nothing, nothing.reshape(0, 3))
    start = np.cumsum(start)
    grain, image = np.empty(start[-1], np.int64), np.empty((start[-1], 3), np.int64)
    fill_cells(low, high, grains.periodic, parts, start[:-1].copy(), grain, image)
    sphere = np.vstack([(grains.position[grain] + image @ vectors).T, grains.radius[grain]])
    return Cells(
        sphere, grains.removed[grain], vectors, inverse, corner, grains.periodic, parts, start,
        _farthest(grains, volume),
    )  # fmt: skip


def _farthest(grains: CellGrains, volume: float) -> float:
    """How far to follow a ray that meets nothing: out of an open sample, or not for ever."""
    if not grains.periodic.any():
        return FAR
    periods = float(np.linalg.norm(grains.vectors[grains.periodic], axis=1).sum())
    free_path = volume / (np.pi * float(np.sum(grains.radius**2)))
    return MOST_PERIODS * periods + MOST_FREE_PATHS * free_path
