"""Whether the radii and the diameters of one file say the same, as exactly as they are printed."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray

# rows that show with how many digits a column was printed, the least exact printing that is
# believed, and the rounding of numbers of four bytes; the latter relative
PRINTED, MOST_PRINTED, SINGLE = 1000, 0.05, 1e-6


def refuse_other_size(
    path: Path,
    radius: FloatArray,
    diameter: npt.NDArray[Any],
    names: tuple[str, str],
    where: str,
) -> None:
    """
    Of a file with radii and diameters, which are believed together or not at all.

    Parameters
    ----------
    path : Path
        For messages.
    radius, diameter : ndarray, shape (N,)
        Dump's length unit.
    names : tuple of str
        The file's own names of both.
    where : str
        For messages.

    Raises
    ------
    ReadError
        If they say different sizes of a grain.
    """
    row = other_size(radius, diameter)
    if row is not None:
        own, other = names
        raise ReadError(
            f"{path}{where}: the columns {own!r} and {other!r} contradict each other: grain "
            f"{row + 1} has {radius[row]:g} and {diameter[row]:g}, expected a diameter of twice "
            f'the radius: say which is right: `columns={{"radius": "{own}"}}`, or '
            f'`columns={{"diameter": "{other}"}}`'
        )


def other_size(radius: FloatArray, diameter: npt.NDArray[Any]) -> int | None:
    """
    The first grain whose diameter is not twice its radius, as exactly as they are printed.

    Parameters
    ----------
    radius : ndarray, shape (N,)
        Dump's length unit.
    diameter : ndarray
        A column that may be one of diameters.

    Returns
    -------
    int or None
        Its row; None if all agree, or the column is none of lengths.
    """
    if diameter.shape != radius.shape or diameter.dtype.kind not in "iuf" or not len(radius):
        return None
    twice = 2.0 * radius
    with np.errstate(over="ignore", invalid="ignore"):
        printed = 2.0 * _last_digit(radius) + _last_digit(diameter)
        allowed = np.minimum(printed, MOST_PRINTED * twice) + SINGLE * twice
        differ = np.abs(twice - diameter) > allowed
    return int(np.argmax(differ)) if differ.any() else None


def _last_digit(values: npt.NDArray[Any]) -> FloatArray:
    """Half of the last digit of each number, as some of them show what they were printed with."""
    shown = values[:PRINTED].astype(np.float64)
    parts = [Decimal(repr(one)).normalize().as_tuple() for one in shown[shown > 0].tolist()]
    exponents = [one.exponent for one in parts if isinstance(one.exponent, int)]
    if not exponents or min(exponents) >= 0:
        return np.zeros(len(values))  # whole numbers are exact
    digits = max(len(one.digits) for one in parts)
    unit: FloatArray = np.maximum(10.0 ** min(exponents), np.abs(values) * 10.0 ** (1 - digits))
    return 0.5 * unit
