"""Axial strain of a frame: 1 - L/L0 along the loading axis, positive in compression."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.errors import SettingsError
from scanfab.frame_file import FrameFile
from scanfab.variants import Sample

__all__ = ["StrainFile", "axial_length"]

Vector = tuple[float, float, float]


def axial_length(sample: Sample, mode: str, axis: Vector) -> float | None:
    """
    The length L whose change is the axial strain.

    Parameters
    ----------
    sample : Sample
        One frame.
    mode : str
        ``cell``: the diagonal entry of the cell along the axis; ``boundary`` and ``grains``: the
        extent of those particles' centres; ``auto``: the cell if it is periodic along the axis,
        else the boundary if there is one, else none.
    axis : three floats
        Unit vector.

    Returns
    -------
    float or None
        In the dump's length unit; None where ``auto`` finds nothing to measure.

    Raises
    ------
    SettingsError
        If what the mode measures does not exist.
    """
    cell = sample.packing.cell
    along = int(np.argmax(np.abs(axis)))
    on_axis = abs(axis[along]) > 1 - 1e-12
    if mode == "auto":
        if cell is not None and on_axis and cell.periodic[along]:
            mode = "cell"
        elif sample.boundary.any():
            mode = "boundary"
        else:
            return None
    if mode == "cell":
        if cell is None or not on_axis:
            what = "the dump has no cell" if cell is None else "the axis is not x, y or z"
            raise SettingsError(f"strain: cell was asked for, but {what}")
        return float(cell.vectors[along, along])
    chosen = sample.boundary if mode == "boundary" else sample.grains
    if not chosen.any():
        raise SettingsError(
            f"strain: {mode} was asked for, but the frame has none"
            + (": name them with --boundary" if mode == "boundary" else "")
        )
    return float(np.ptp(sample.packing.position[chosen] @ np.array(axis)))


class StrainFile:
    """
    Strains from a CSV file with the columns ``step`` or ``frame``, and ``strain``.

    Raises
    ------
    ReadError
        If a column is missing or a value is no number.
    """

    def __init__(self, path: Path) -> None:
        self._file = FrameFile(path, ["strain"])

    def at(self, frame: int, step: int | None) -> float | None:
        """The strain of a frame; None if the file does not name it."""
        found = self._file.at(frame, step)
        return None if found is None else found[0]
