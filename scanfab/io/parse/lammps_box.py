"""The boxes of LIGGGHTS and LAMMPS: two corners and a tilt."""

from __future__ import annotations

import re

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.lengths import MOST
from scanfab.base.typing import FloatArray
from scanfab.packing.cell import Cell

# of the lower and the upper face
BOUNDARY = re.compile("pp|[fsm][fsm]")


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


def dump_cell(where: str, sections: dict[str, list[str]]) -> Cell | None:
    """The box, periodic along the axes flagged pp; None if it has no volume and does not repeat."""
    key = next((key for key in sections if key.startswith("BOX BOUNDS")), None)
    if key is None:
        return None
    words = key.removeprefix("BOX BOUNDS").split()
    is_general = words[:2] == ["abc", "origin"]
    is_tilted = words[:3] == ["xy", "xz", "yz"]
    width = 4 if is_general else 3 if is_tilted else 2
    try:
        bounds = np.array([line.split() for line in sections[key][:3]], dtype=np.float64)
    except ValueError:
        bounds = np.zeros(0)
    if bounds.shape != (3, width):
        raise ReadError(f"{where}: ITEM: {key}: expected three lines of {width} numbers")
    flags = _periodic(where, key, words[(2 if is_general else 3 if is_tilted else 0) :])
    try:
        if not np.all(np.abs(bounds) < MOST):
            raise PackingError
        vectors, origin = (
            (bounds[:, :3], bounds[:, 3]) if is_general else box_vectors(*box_of_bounds(bounds))
        )
        return Cell(vectors, flags, origin)
    except PackingError:
        if not any(flags):
            return None
        found = "; ".join(sections[key][:3])
        raise ReadError(
            f"{where}: ITEM: {key}: the box repeats, but its bounds {found} span no volume"
        ) from None


def _periodic(where: str, key: str, flags: list[str]) -> tuple[bool, bool, bool]:
    """Which axes repeat; very old files do not say, and have none that do."""
    if not flags:
        return False, False, False
    if len(flags) != 3 or not all(BOUNDARY.fullmatch(flag) for flag in flags):
        raise ReadError(
            f"{where}: ITEM: {key}: expected three boundary flags such as pp, ff, fs or mm"
        )
    return flags[0] == "pp", flags[1] == "pp", flags[2] == "pp"
