"""The boxes of LIGGGHTS and LAMMPS: two corners and a tilt, or three vectors and an origin."""

from __future__ import annotations

import re

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.lengths import MOST, all_within
from scanfab.base.typing import FloatArray
from scanfab.packing.cell import Cell

# the kind of box, and two letters for each axis: its lower and its upper face
BOX_KEY = re.compile(r"BOX BOUNDS(?: (abc origin|xy xz yz))?((?: (?:pp|[fsm]{2})){3})?")
# numbers in each line of a box of this kind
WIDTHS = {None: 2, "xy xz yz": 3, "abc origin": 4}


def dump_cell(where: str, sections: dict[str, list[str]]) -> Cell | None:
    """
    The box of a text dump, periodic along the axes with the flag pp.

    Parameters
    ----------
    where : str
        File and step, for messages.
    sections : dict
        The lines of the dump's header by their key, such as ``BOX BOUNDS pp pp ff``. Very old
        dumps have no flags: nothing is periodic then.

    Raises
    ------
    ReadError
        If the box cannot be read, or is periodic and has no volume.
    """
    key = next((key for key in sections if key.startswith("BOX BOUNDS")), None)
    if key is None:
        return None
    match = BOX_KEY.fullmatch(" ".join(key.split()))
    if match is None:
        raise ReadError(
            f"{where}: ITEM: {key}: expected three boundary flags such as pp, ff, fs or mm"
        )
    x, y, z = (flag == "pp" for flag in (match[2] or "ff ff ff").split())
    width = WIDTHS[match[1]]
    try:
        bounds = np.array([line.split() for line in sections[key][:3]], dtype=np.float64)
    except ValueError:
        bounds = np.zeros(0)
    if bounds.shape != (3, width):
        raise ReadError(f"{where}: ITEM: {key}: expected three lines of {width} numbers")
    return box_cell(f"{where}: ITEM: {key}", bounds, (x, y, z))


def box_cell(
    where: str, bounds: FloatArray, periodic: tuple[bool, bool, bool], *, is_around: bool = True
) -> Cell | None:
    """The cell of a box, see :func:`box_vectors`; None if it has no volume and is not periodic."""
    try:
        vectors, origin = box_vectors(bounds, is_around=is_around)
        return Cell(vectors, periodic, origin)
    except PackingError:
        if not any(periodic):
            return None
        raise ReadError(
            f"{where}: the box repeats, but its bounds {bounds.tolist()} span no volume"
        ) from None


def box_vectors(bounds: FloatArray, *, is_around: bool = True) -> tuple[FloatArray, FloatArray]:
    """
    Lattice vectors (rows) and origin; vectors of zero if a lower bound is above the upper one.

    Parameters
    ----------
    bounds : ndarray, shape (3, 2), (3, 3) or (3, 4)
        The lower and the upper bound of each axis, at times with the tilt (xy, xz, yz) behind; or
        three vectors (rows) with the coordinates of the origin behind. Dump's length unit.
    is_around : bool, optional
        Whether the bounds are those of the box *around* the tilted box, as in dumps. Data files
        have those of the box before it was tilted.
    """
    if not all_within(bounds, -MOST, MOST):
        return np.zeros((3, 3)), np.zeros(3)
    if bounds.shape[1] == 4:
        return bounds[:, :3], bounds[:, 3]
    low, high = bounds[:, 0].copy(), bounds[:, 1].copy()
    tilt = bounds[:, 2] if bounds.shape[1] == 3 else np.zeros(3)
    xy, xz, yz = tilt
    if is_around:
        low[:2] -= min(0.0, xy, xz, xy + xz), min(0.0, yz)
        high[:2] -= max(0.0, xy, xz, xy + xz), max(0.0, yz)
    edge = high - low
    if np.any(edge <= 0):
        return np.zeros((3, 3)), low
    vectors = np.diag(edge)
    vectors[[1, 2, 2], [0, 0, 1]] = tilt
    return vectors, low
