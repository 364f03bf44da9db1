"""The boxes of LIGGGHTS and LAMMPS: two corners and a tilt."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["box_of_bounds", "box_vectors"]

FloatArray = npt.NDArray[np.float64]


def box_of_bounds(bounds: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Low and high corner and tilt, from the bounds of a dump.

    Parameters
    ----------
    bounds : ndarray, shape (3, 2) or (3, 3)
        Those of the box *around* a tilted box, with its tilt (xy, xz, yz) behind; dump's length
        unit.
    """
    low, high = bounds[:, 0].copy(), bounds[:, 1].copy()
    tilt = bounds[:, 2] if bounds.shape[1] == 3 else np.zeros(3)
    xy, xz, yz = tilt
    low[0] -= min(0.0, xy, xz, xy + xz)
    high[0] -= max(0.0, xy, xz, xy + xz)
    low[1] -= min(0.0, yz)
    high[1] -= max(0.0, yz)
    return low, high, tilt


def box_vectors(
    low: FloatArray, high: FloatArray, tilt: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Vectors (rows) and origin of a LAMMPS box; vectors of zero if it is no box."""
    edge = high - low
    if np.any(edge <= 0):
        return np.zeros((3, 3)), low
    vectors = np.diag(edge)
    vectors[[1, 2, 2], [0, 0, 1]] = tilt
    return vectors, low
