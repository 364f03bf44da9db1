"""How small and how large a length may be."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

# the cubes of these are still numbers
LEAST, MOST = 1e-100, 1e100


def all_within(values: npt.NDArray[np.float64], least: float, most: float) -> bool:
    """Whether all are numbers from least to most; without a temporary array."""
    return values.size == 0 or bool(values.min() >= least and values.max() <= most)
