"""Strains of a frame: axial, 1 - L/L0 along the loading axis; and the shear of a periodic cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scanfab.base.errors import Note, SettingsError
from scanfab.base.typing import FloatArray
from scanfab.io.layout import FrameFile
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import STRAIN_MODES, Vector

# programs flip a cell when it leans by half a length, or a little later
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
    if mode != "cell":
        return float(np.ptp(centers_of(sample, mode) @ np.array(axis))) if mode else None
    along = _coordinate_of(axis)
    if along is None:
        raise SettingsError("strain: cell was asked for, but the axis is not x, y or z")
    return float(cell_of(sample).vectors[along, along])


def strain_mode(sample: Sample, mode: str, axis: Vector) -> str:
    """The mode, with ``auto`` replaced by what it finds in a frame; empty if it finds nothing."""
    if mode != "auto":
        return mode
    cell, along = sample.packing.cell, _coordinate_of(axis)
    if cell is not None and along is not None and cell.periodic[along]:
        return "cell"
    return "boundary" if sample.boundary.any() else ""


def _coordinate_of(axis: Vector) -> int | None:
    """Which of x, y, z the axis is; None for an oblique one."""
    along = int(np.argmax(np.abs(axis)))
    return along if abs(axis[along]) > 1 - 1e-12 else None


def cell_of(sample: Sample) -> Cell:
    """The cell that the strain is measured by; SettingsError without one."""
    if sample.packing.cell is None:
        raise SettingsError("strain: cell was asked for, but the dump has no cell")
    return sample.packing.cell


def centers_of(sample: Sample, mode: str) -> FloatArray:
    """The centres of boundary or grains, shape (K, 3); SettingsError without any."""
    chosen = sample.boundary if mode == "boundary" else sample.gathered
    if not chosen.any():
        raise SettingsError(
            f"strain: {mode} was asked for, but the frame has none"
            + (": name them with `boundary`" if mode == "boundary" else "")
        )
    return sample.packing.position[chosen]


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
    # written so that an unchanged cell gives 0.0, not -0.0
    return float(np.log(abs(before / now)))


def is_flipped(cell: Cell | None, before: Cell | None) -> bool:
    """
    Whether a cell seems to be described by other vectors of its lattice than in the frame before.

    It is if whole vectors, added to its own, bring these nearer to the vectors before, and if
    neither cell leans further than to the point where programs flip them.
    """
    if cell is None or before is None or not (cell.is_endless and before.is_endless):
        return False
    change = np.rint(np.linalg.solve(cell.own_vectors.T, before.own_vectors.T))
    if np.array_equal(change, np.eye(len(change))) or round(abs(np.linalg.det(change))) != 1:
        return False
    for vectors in (cell.own_vectors, before.own_vectors):
        # by how many lengths of another vector each vector leans
        leaning = (vectors @ vectors.T) / np.linalg.norm(vectors, axis=1) ** 2
        if np.abs(np.tril(leaning, -1)).max() > MOST_TILT:
            return False
    return True


@dataclass(frozen=True, eq=False)
class Strains:
    """What the strains of a series are measured by, since its first frame that has grains."""

    mode: str
    """As for :func:`axial_length`; unused if there is a file."""
    axis: Vector
    file: FrameFile | None = None
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
        is_file = settings.strain not in STRAIN_MODES
        file = FrameFile(Path(settings.strain), ["strain"]) if is_file else None
        return cls(settings.strain, settings.axis, file)

    def since(self, sample: Sample) -> Strains:
        """From a frame on; raises as :func:`axial_length`."""
        length = axial_length(sample, self.mode, self.axis) if self.file is None else None
        return replace(self, length=length, cell=sample.packing.cell)

    def at(self, number: int, sample: Sample) -> dict[str, float | None]:
        """Axial, shear and volumetric strain of a frame, by the names of their columns."""
        axial, has_grains = None, sample.grains.any()
        if self.file is not None:
            (axial,) = self.file.at(number, sample.packing.step) or (None,)
        elif self.length and has_grains:
            length = axial_length(sample, self.mode, self.axis)
            axial = None if length is None else 1.0 - length / self.length
        cell = sample.packing.cell if has_grains else None
        return {
            "strain": axial,
            "shear_strain": shear_strain(cell, self.cell),
            "volumetric_strain": volumetric_strain(cell, self.cell),
        }


class Flips:
    """Whether the cell of a series is flipped from one of its chosen frames to the next."""

    def __init__(self, step: int | None) -> None:
        """Frames are chosen with a step, as in a slice."""
        self.step = abs(step or 1)
        self.before: tuple[int, Cell | None] = -self.step, None

    def notes(self, number: int, cell: Cell | None) -> list[Note]:
        """What to tell of the cell of one more frame; frames come in their order."""
        (early, before), self.before = self.before, (number, cell)
        if early != number - self.step or not is_flipped(cell, before):
            return []
        text = (
            f"the cell seems to be flipped between the frames {early} and {number}: from there on "
            f"its vectors are others than in the first frame, and shear_strain is not the strain "
            f"since then (LAMMPS: fix deform ... flip no)"
        )
        return [Note("flipped_cell", text)]
