"""``.xyzd``: binary packings of PackingGeneration, whose diameters may need a factor."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError, ScanfabNote
from scanfab.io.files import bare_name
from scanfab.io.formats.proof import touch
from scanfab.io.parse.sheet_binary import read_xyzd

POROSITY = r"(?i)^\s*{}\s*porosity\s*:?\s*([0-9.eE+-]+)"


def is_xyzd(path: Path) -> bool:
    """By the ending: the content is nothing but doubles."""
    return bare_name(path).lower().endswith(".xyzd")


def read_xyzd_columns(path: Path) -> dict[str, npt.NDArray[Any]]:
    """
    The columns x, y, z and diameter.

    The program writes the diameters that it began with. Those that it ended with are larger by
    ((1 - final porosity) / (1 - theoretical porosity))^(1/3), which stand in ``packing.nfo``.
    """
    rows = read_xyzd(path)
    factor = _factor(path)
    if factor != 1.0:
        warnings.warn(
            f"{path}: diameters are multiplied by {factor:.6g}, from the porosities in packing.nfo",
            ScanfabNote,
            stacklevel=2,
        )
    columns = dict(zip("xyz", rows[:, :3].T, strict=True))
    return {**columns, "diameter": factor * rows[:, 3]}


def prove_xyzd(path: Path, columns: Mapping[str, npt.NDArray[Any]]) -> None:
    """ReadError if the grains do not touch, so that the file may be something else."""
    x, y, z, diameter = (columns[name] for name in ("x", "y", "z", "diameter"))
    if len(x) and not touch(x, y, z, 0.5 * diameter):
        raise ReadError(
            f"{path}: as x y z d, in little-endian doubles, its grains do not touch: the file is "
            f"something else, or packing.nfo with the porosities, by which PackingGeneration "
            f"means diameters to be scaled, is not beside it; if they need not touch, say so: "
            f'`columns="x=1,y=2,z=3,diameter=4"`'
        )


def _factor(path: Path) -> float:
    """What diameters are to be multiplied by."""
    info = path.with_name("packing.nfo")
    if not info.is_file():
        return 1.0
    text = info.read_bytes()[:10_000].decode("utf-8", "replace")
    found = [
        re.search(POROSITY.format(word), text, re.MULTILINE) for word in ("final", "theoretical")
    ]
    try:
        final, theoretical = (float(one[1]) if one else np.nan for one in found)
        factor = ((1.0 - final) / (1.0 - theoretical)) ** (1.0 / 3.0)
        if 0.5 < factor < 2.0:
            return float(factor)
    except (ValueError, ZeroDivisionError, TypeError):
        pass
    raise ReadError(
        f"{info}: expected a theoretical and a final porosity between 0 and 1, by which the "
        f"diameters of {path.name} are scaled"
    )
