"""Superquadrics in the columns of a dump: refused, as lines would meet their bounding spheres."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray

# LIGGGHTS' names, the newer and the older: half axes, and exponents
HALF_AXES = ("shapex", "shapey", "shapez")
EXPONENTS = ("blockiness1", "blockiness2", "roundness1", "roundness2")
# a superquadric of these exponents and of equal half axes is a sphere
ROUND = 2.0
# relative, of numbers that are written with six digits
ROUNDING = 1e-5


def refuse_superquadrics(
    path: Path, columns: Mapping[str, npt.NDArray[Any]], radius: FloatArray, where: str = ""
) -> None:
    """ReadError if some particles are no spheres: their radius is that of a sphere around them."""
    expected = dict.fromkeys(HALF_AXES, radius) | dict.fromkeys(EXPONENTS, ROUND)
    for name in [name for name in columns if name.lower() in expected]:
        value = expected[name.lower()]
        count = np.count_nonzero(np.abs(columns[name] - value) > ROUNDING * np.abs(value))
        if count:
            raise ReadError(
                f"{path}{where}: {count} of {len(radius)} particles are superquadrics (by the "
                f"column {name}), whose radius is that of the sphere around them: scanfab measures "
                f"spheres, and clumps of spheres; fill them with spheres, and say with `bodies` "
                f"which of these are one particle"
            )
