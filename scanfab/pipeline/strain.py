"""Strains of a frame: axial, 1 - L/L0 along the loading axis; and the shear of a periodic cell."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from scanfab.base.errors import ScanfabWarning, SettingsError
from scanfab.io.frame_csv import FrameFile
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.pipeline.settings import STRAIN_MODES, Settings, Vector

__all__ = ["StrainFile", "Strains", "axial_length", "is_flipped", "shear_strain"]

# programs that flip their cells do so when it leans by half a length or a little later
MOST_TILT = 0.61


def axial_length(sample: Sample, mode: str, axis: Vector) -> float | None:
    """
    The length L whose change is the axial strain.

    Parameters
    ----------
    sample : Sample
        One frame.
    mode : str
        ``cell``: the diagonal entry of the cell along the axis; ``boundary`` and ``grains``: the
        extent of those particles' centres (without grains that have escaped); ``auto``: the cell
        if it is periodic along the axis, else the boundary if there is one, else none.
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
    chosen = sample.boundary if mode == "boundary" else sample.gathered
    if not chosen.any():
        raise SettingsError(
            f"strain: {mode} was asked for, but the frame has none"
            + (": name them with `boundary`" if mode == "boundary" else "")
        )
    return float(np.ptp(sample.packing.position[chosen] @ np.array(axis)))


def shear_strain(cell: Cell | None, first: Cell | None) -> float | None:
    """
    How much a periodic cell was sheared, whichever way.

    Parameters
    ----------
    cell, first : Cell or None
        Of this frame and of the first.

    Returns
    -------
    float or None
        √(2/3 e:e) of the deviator e of the logarithmic strain, dimensionless, never negative; None
        unless both cells repeat along all three vectors. Each vector is taken for the one that it
        was in the first frame.

    Examples
    --------
    >>> from scanfab import Cell
    >>> from scanfab.pipeline.strain import shear_strain
    >>> sheared = Cell([[1, 0, 0], [0.5, 1, 0], [0, 0, 1]])
    >>> round(shear_strain(sheared, Cell([1.0, 1.0, 1.0])), 4)
    0.2857
    """
    if cell is None or first is None or not all(cell.periodic + first.periodic):
        return None
    if np.array_equal(cell.vectors, first.vectors):
        return 0.0
    # H = F H0 with lattice vectors as columns; here they are rows
    gradient = np.linalg.solve(first.vectors, cell.vectors)
    # ln B has twice the logarithms of the stretches as principal values
    stretch = np.log(np.linalg.svd(gradient, compute_uv=False))
    return float(np.sqrt(2.0 / 3.0) * np.linalg.norm(stretch - stretch.mean()))


def is_flipped(cell: Cell | None, before: Cell | None) -> bool:
    """
    Whether a cell seems to be described by other vectors of its lattice than in the frame before.

    Then whole vectors were added to some, which also brings them nearer to those before, and
    neither cell leans further than where programs flip them.
    """
    if cell is None or before is None or not all(cell.periodic + before.periodic):
        return False
    change = np.linalg.solve(cell.vectors.T, before.vectors.T)
    whole = np.rint(change)
    return bool(
        np.any(whole != np.eye(3))
        and round(abs(np.linalg.det(whole))) == 1
        and max(_tilt(cell), _tilt(before)) <= MOST_TILT
    )


def _tilt(cell: Cell) -> float:
    """By how many lengths of another vector a vector leans, at most."""
    lengths = np.linalg.norm(cell.vectors, axis=1)
    leaning = (cell.vectors @ cell.vectors.T) / lengths**2
    return float(np.abs(leaning[np.tril_indices(3, -1)]).max())


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


class Strains:
    """Strains of the frames of a series, from its first frame that has grains."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.file = None if settings.strain in STRAIN_MODES else StrainFile(Path(settings.strain))
        self.first: float | None = None
        self.first_cell: Cell | None = None
        self.cells: dict[int, Cell | None] = {}

    def start(self, sample: Sample) -> None:
        """Take the lengths of the first frame that has grains."""
        self.first_cell = sample.packing.cell
        if self.file is None:
            self.first = axial_length(sample, self.settings.strain, self.settings.axis)

    def at(self, number: int, sample: Sample) -> tuple[float | None, float | None]:
        """Axial and shear strain of a frame."""
        if not sample.grains.any():
            return self._axial(number, sample), None
        cell = sample.packing.cell
        self._warn_of_flips(number, cell)
        return self._axial(number, sample), shear_strain(cell, self.first_cell)

    def _axial(self, number: int, sample: Sample) -> float | None:
        if self.file is not None:
            return self.file.at(number, sample.packing.step)
        if self.first is None or not sample.grains.any():
            return None
        length = axial_length(sample, self.settings.strain, self.settings.axis)
        return None if length is None or self.first == 0 else 1.0 - length / self.first

    def _warn_of_flips(self, number: int, cell: Cell | None) -> None:
        """Frames come in any order: each is held against both neighbours that are known."""
        self.cells[number] = cell
        step = abs(self.settings.frames.step or 1)
        for early in (number - step, number):
            late = early + step
            if is_flipped(self.cells.get(late), self.cells.get(early)):
                warnings.warn(
                    f"the cell seems to be flipped between the frames {early} and {late}: from "
                    f"there on its vectors are others than in the first frame, and shear_strain is "
                    f"not the strain since then (LAMMPS: fix deform ... flip no)",
                    ScanfabWarning,
                    stacklevel=2,
                )
