"""Which spheres of a dump are one body, by a column that the dump or its user names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import IntArray
from scanfab.io.reader import GrainTable
from scanfab.packing.bodies import CLUMP_COLUMNS, MOLECULE_COLUMNS


def body_numbers(path: Path, grains: GrainTable, named: str | None) -> IntArray | None:
    """
    Number of the body that each sphere is of, shape (N,); negative: a grain of its own.

    Parameters
    ----------
    path : Path
        For messages.
    grains : GrainTable
        Of one frame.
    named : str, optional
        The column that says it; ``id``: each sphere is a grain. Without it a column that numbers
        clumps whatever the format; one of molecules is never taken unasked, as these may be bonded
        spheres that move against one another.

    Returns
    -------
    ndarray of int, shape (N,), or None
        None if each sphere is a grain.

    Raises
    ------
    ReadError
        If there is no such column, or it does not hold whole numbers.
    """
    if named is None and grains.bodies is not None:
        return grains.bodies
    name = _clump_column(grains.columns) if named is None else named
    # an empty frame may have lost its columns
    if name is None or len(grains.radius) == 0:
        return None
    if name == "id" and name not in grains.columns:
        # there need not be ids to say that each sphere is a grain
        return None
    if name not in grains.columns:
        known = ", ".join(["id", *grains.columns])
        raise ReadError(
            f"{path}: there is no column {name!r} to say which spheres are one body (`bodies`); "
            f"the columns are {known}"
        )
    return _numbers(path, name, np.asarray(grains.columns[name]))


def numbers_in_columns(columns: Mapping[str, npt.NDArray[Any]]) -> IntArray | None:
    """The bodies that columns number by themselves; None if none does, or its numbers are none."""
    name = _clump_column(columns)
    try:
        return None if name is None else _numbers(Path(), name, np.asarray(columns[name]))
    except ReadError:
        return None


def _numbers(path: Path, name: str, values: npt.NDArray[Any]) -> IntArray:
    if values.ndim != 1 or values.dtype.kind not in "biuf":
        raise ReadError(f"{path}: `bodies`: the column {name} does not hold a number a sphere")
    wrong = np.flatnonzero(~(np.abs(values) < 2.0**53) | (values != np.round(values)))
    if wrong.size:
        raise ReadError(
            f"{path}: `bodies`: expected whole numbers in the column {name}, found "
            f"{values[wrong[0]]:g} (sphere {wrong[0] + 1} of {len(values)})"
        )
    numbers = values.astype(np.int64)
    if name.lower() in MOLECULE_COLUMNS:
        numbers = np.where(numbers > 0, numbers, -1)
    return numbers


def _clump_column(columns: Iterable[str]) -> str | None:
    """The first column whose name says that it numbers clumps."""
    lower = {name.lower(): name for name in reversed(list(columns))}
    return next((lower[name] for name in CLUMP_COLUMNS if name in lower), None)
