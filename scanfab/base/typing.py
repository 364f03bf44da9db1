"""Types of arrays; functions state shapes and units where they use these types."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
AnyArray = npt.NDArray[Any]
Columns = dict[str, AnyArray]
"""Columns by name, numbers or texts, with a row for each grain or contact."""
RowArray = npt.NDArray[np.integer[Any]]
"""Whole numbers that may be stored in four bytes: rows of grains, images."""
