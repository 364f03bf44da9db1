"""Strains of a frame: axial, 1 - L/L0 along the loading axis; and the shear of a periodic cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scanfab.base.errors import Note, SettingsError
from scanfab.io.layout import FrameFile
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import STRAIN_MODES, Vector

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
    mode = strain_mode(sample, mode, axis)
    if not mode:
        return None
    cell = sample.packing.cell
    along, on_axis = _along(axis)
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


def strain_mode(sample: Sample, mode: str, axis: Vector) -> str:
    """What ``auto`` stands for in a frame, empty where it finds nothing; else the mode itself."""
    if mode != "auto":
        return mode
    cell, (along, on_axis) = sample.packing.cell, _along(axis)
    if cell is not None and on_axis and cell.periodic[along]:
        return "cell"
    return "boundary" if sample.boundary.any() else ""


def _along(axis: Vector) -> tuple[int, bool]:
    """Which of x, y, z is nearest to the axis, and whether that is the axis itself."""
    along = int(np.argmax(np.abs(axis)))
    return along, abs(axis[along]) > 1 - 1e-12


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
        √(2/3 e:e) of the deviator e of the logarithmic strain, in a plane √(1/2 e:e):
        dimensionless, never negative, and what the deviator stress works on. None unless both cells
        repeat along all vectors. Each vector is taken for the one that it was in the first frame.

    Examples
    --------
    >>> from scanfab import Cell
    >>> from scanfab.pipeline.strain import shear_strain
    >>> sheared = Cell([[1, 0, 0], [0.5, 1, 0], [0, 0, 1]])
    >>> round(shear_strain(sheared, Cell([1.0, 1.0, 1.0])), 4)
    0.2857
    """
    if cell is None or first is None or not (cell.is_endless and first.is_endless):
        return None
    now, before = cell.own_vectors, first.own_vectors
    if np.array_equal(now, before):
        return 0.0
    # H = F H0 with lattice vectors as columns; here they are rows
    gradient = np.linalg.solve(before, now)
    # ln B has twice the logarithms of the stretches as principal values
    stretch = np.log(np.linalg.svd(gradient, compute_uv=False))
    dimension = cell.space.dimension
    of_norm = np.sqrt((dimension - 1.0) / dimension)
    return float(of_norm * np.linalg.norm(stretch - stretch.mean()))


def volumetric_strain(cell: Cell | None, first: Cell | None) -> float | None:
    """
    How much a periodic cell was compressed: -ln(V/V0), the trace of the logarithmic strain.

    Parameters
    ----------
    cell, first : Cell or None
        Of this frame and of the first.

    Returns
    -------
    float or None
        Dimensionless, positive in compression; None unless both cells repeat along all vectors.

    Examples
    --------
    >>> from scanfab import Cell
    >>> from scanfab.pipeline.strain import volumetric_strain
    >>> round(volumetric_strain(Cell([1, 1, 0.9]), Cell([1, 1, 1])), 4)
    0.1054
    """
    if cell is None or first is None or not (cell.is_endless and first.is_endless):
        return None
    now, before = (np.linalg.det(one.own_vectors) for one in (cell, first))
    # no -0.0 of a cell that is as it was
    return float(np.log(abs(before / now)))


def is_flipped(cell: Cell | None, before: Cell | None) -> bool:
    """
    Whether a cell seems to be described by other vectors of its lattice than in the frame before.

    Then whole vectors were added to some, which also brings them nearer to those before, and
    neither cell leans further than where programs flip them.
    """
    if cell is None or before is None or not (cell.is_endless and before.is_endless):
        return False
    change = np.linalg.solve(cell.own_vectors.T, before.own_vectors.T)
    whole = np.rint(change)
    return bool(
        np.any(whole != np.eye(len(whole)))
        and round(abs(np.linalg.det(whole))) == 1
        and max(_tilt(cell), _tilt(before)) <= MOST_TILT
    )


def _tilt(cell: Cell) -> float:
    """By how many lengths of another vector a vector leans, at most."""
    vectors = cell.own_vectors
    lengths = np.linalg.norm(vectors, axis=1)
    leaning = (vectors @ vectors.T) / lengths**2
    return float(np.abs(leaning[np.tril_indices(len(vectors), -1)]).max())


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


@dataclass(frozen=True, eq=False)
class Strains:
    """Strains of the frames of a series, since its first frame that has grains."""

    mode: str
    """As for :func:`axial_length`; of no meaning if there is a file."""
    axis: Vector
    file: StrainFile | None = None
    length: float | None = None
    """Of the first frame that has grains, dump's length unit."""
    cell: Cell | None = None
    """Of that frame."""

    @classmethod
    def of(cls, settings: Settings) -> Strains:
        """
        Before the first frame is known.

        Raises
        ------
        ReadError
            If the file of strains cannot be read.
        """
        file = None if settings.strain in STRAIN_MODES else StrainFile(Path(settings.strain))
        return cls(settings.strain, settings.axis, file)

    def since(self, sample: Sample) -> Strains:
        """From a frame on; raises as :func:`axial_length`."""
        length = axial_length(sample, self.mode, self.axis) if self.file is None else None
        return replace(self, length=length, cell=sample.packing.cell)

    def at(self, number: int, sample: Sample) -> dict[str, float | None]:
        """Axial, shear and volumetric strain of a frame, by the names of their columns."""
        cells = (sample.packing.cell if sample.grains.any() else None, self.cell)
        return {
            "strain": self._axial(number, sample),
            "shear_strain": shear_strain(*cells),
            "volumetric_strain": volumetric_strain(*cells),
        }

    def _axial(self, number: int, sample: Sample) -> float | None:
        if self.file is not None:
            return self.file.at(number, sample.packing.step)
        if self.length is None or not sample.grains.any():
            return None
        length = axial_length(sample, self.mode, self.axis)
        return None if length is None or self.length == 0 else 1.0 - length / self.length


class Flips:
    """The cells of a series, each held against those of the frames before and behind it."""

    def __init__(self, step: int | None) -> None:
        """Frames are chosen with a step, as in a slice."""
        self.step = abs(step or 1)
        self.cells: dict[int, Cell | None] = {}

    def notes(self, number: int, cell: Cell | None) -> list[Note]:
        """What to tell once the cell of one more frame is known."""
        self.cells[number] = cell
        pairs = [(early, early + self.step) for early in (number - self.step, number)]
        flipped = [p for p in pairs if is_flipped(self.cells.get(p[1]), self.cells.get(p[0]))]
        return [Note("flipped_cell", _flipped(*pair)) for pair in flipped]


def _flipped(early: int, late: int) -> str:
    return (
        f"the cell seems to be flipped between the frames {early} and {late}: from there on its "
        f"vectors are others than in the first frame, and shear_strain is not the strain since "
        f"then (LAMMPS: fix deform ... flip no)"
    )
