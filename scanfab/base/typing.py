"""Names for the arrays of the package; shapes and units stand where they are used."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
AnyArray = npt.NDArray[Any]
Columns = dict[str, AnyArray]
"""The columns of a table by their names: numbers or texts, a row for each grain or contact."""
RowArray = npt.NDArray[np.integer[Any]]
"""Whole numbers that may be stored in four bytes: rows of grains, images."""
