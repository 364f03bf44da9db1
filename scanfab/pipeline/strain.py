"""Strains: axial strain 1 - L/L0, and shear and volumetric strain of a periodic cell."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import Note, SettingsError
from scanfab.base.typing import FloatArray
from scanfab.io.layout import FrameFile
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import STRAIN_MODES, Vector

# simulation programs flip a cell when it leans by half a length, or slightly more
MOST_TILT = 0.61


def axial_length(sample: Sample, mode: str, axis: Vector) -> float | None:
    """
    The length L in the axial strain 1 - L/L0.

    Parameters
    ----------
    sample : Sample
        A frame.
    mode : str
        ``cell``: the diagonal entry of the cell along the axis; ``boundary`` and ``grains``: the
        extent of the centres of these particles, without escaped grains; ``auto``: the cell if it
        is periodic along the axis, else the boundary if there is one.
    axis : three floats
        Loading axis, a unit vector.

    Returns
    -------
    float or None
        Dump's length unit; None if ``auto`` finds nothing to measure.

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
    """The mode, with ``auto`` replaced by what the frame has; empty if it has neither."""
    if mode != "auto":
        return mode
    cell, along = sample.packing.cell, _coordinate_of(axis)
    if cell is not None and along is not None and cell.periodic[along]:
        return "cell"
    return "boundary" if sample.boundary.any() else ""


def _coordinate_of(axis: Vector) -> int | None:
    """Index of the coordinate along the axis; None for an oblique axis."""
    along = int(np.argmax(np.abs(axis)))
    return along if abs(axis[along]) > 1 - 1e-12 else None


def cell_of(sample: Sample) -> Cell:
    """The cell of a frame; SettingsError if there is none."""
    if sample.packing.cell is None:
        raise SettingsError("strain: cell was asked for, but the dump has no cell")
    return sample.packing.cell


def centers_of(sample: Sample, mode: str) -> FloatArray:
    """Centres of boundary particles or grains, shape (K, 3); SettingsError without boundary."""
    chosen = sample.boundary if mode == "boundary" else sample.gathered
    if not chosen.any():
        text = "boundary was asked for, but the frame has no boundary particles: name them"
        raise SettingsError(f"strain: {text} with `boundary`")
    return sample.packing.position[chosen]


def cell_strains(cell: Cell | None, first: Cell | None) -> tuple[float | None, float | None]:
    """
    Shear and volumetric strain of a periodic cell since the first frame.

    The shear strain, in any direction, is √(2/3 e:e) of the deviator e of the logarithmic strain,
    in a plane √(1/2 e:e), and is work-conjugate to the deviator stress. The volumetric strain is
    -ln(V/V0). The vectors of both cells must correspond to each other.

    Parameters
    ----------
    cell, first : Cell or None
        Cell of this frame and of the first frame.

    Returns
    -------
    shear : float or None
        Dimensionless, never negative.
    volumetric : float or None
        Dimensionless, positive in compression. Both are None unless both cells are periodic along
        all vectors.

    Examples
    --------
    >>> from scanfab import Cell
    >>> from scanfab.pipeline.strain import cell_strains
    >>> shear, volumetric = cell_strains(Cell([1, 1, 0.9]), Cell([1, 1, 1]))
    >>> round(shear, 4), round(volumetric, 4)
    (0.0702, 0.1054)
    """
    if cell is None or first is None or not (cell.is_endless and first.is_endless):
        return None, None
    now, before = cell.own_vectors, first.own_vectors
    if np.array_equal(now, before):
        return 0.0, 0.0
    # deformation gradient F from H = F H0; the lattice vectors are rows here, so this is transposed
    gradient = np.linalg.solve(before, now)
    # the logarithmic principal strains are the logarithms of the singular values of F
    stretch = np.log(np.linalg.svd(gradient, compute_uv=False))
    dimension = cell.space.dimension
    of_norm = np.sqrt((dimension - 1.0) / dimension)
    shear = of_norm * np.linalg.norm(stretch - stretch.mean())
    return float(shear), float(np.log(abs(np.linalg.det(before) / np.linalg.det(now))))


def is_flipped(cell: Cell | None, before: Cell | None) -> bool:
    """
    Whether a cell seems to be flipped, that is described by other vectors of the same lattice.

    The cell is flipped if adding whole lattice vectors to its vectors brings them nearer to the
    vectors of the frame before, and if neither cell leans more than programs allow before a flip.
    """
    if cell is None or before is None or not (cell.is_endless and before.is_endless):
        return False
    change = np.rint(np.linalg.solve(cell.own_vectors.T, before.own_vectors.T))
    if np.array_equal(change, np.eye(len(change))) or round(abs(np.linalg.det(change))) != 1:
        return False
    for vectors in (cell.own_vectors, before.own_vectors):
        # lean of each vector along every other vector, in lengths of the latter
        leaning = (vectors @ vectors.T) / np.linalg.norm(vectors, axis=1) ** 2
        if np.abs(np.tril(leaning, -1)).max() > MOST_TILT:
            return False
    return True


class Strains(NamedTuple):
    """Reference of the strains of a series: its reference frame, or a file."""

    mode: str
    """Mode of :func:`axial_length`; unused if there is a file."""
    axis: Vector
    file: FrameFile | None = None
    length: float | None = None
    """Length L0 in the reference frame, dump's length unit."""
    cell: Cell | None = None
    """Cell of the reference frame."""

    @classmethod
    def of(cls, settings: Settings, first: Sample) -> Strains:
        """
        Start from settings and the reference frame.

        Raises
        ------
        ReadError
            If the file of strains cannot be read.
        SettingsError
            As :func:`axial_length`.
        """
        mode, axis = settings.strain, settings.axis
        is_file = mode not in STRAIN_MODES
        file = FrameFile(Path(mode), ["strain"]) if is_file else None
        length = None if is_file else axial_length(first, mode, axis)
        return cls(mode, axis, file, length, first.packing.cell)

    def at(self, number: int, sample: Sample) -> dict[str, float | None]:
        """Axial, shear and volumetric strain of a frame, by column."""
        axial, has_grains = None, sample.grains.any()
        if self.file is not None:
            (axial,) = self.file.at(number, sample.packing.step) or (None,)
        elif self.length and has_grains:
            length = axial_length(sample, self.mode, self.axis)
            axial = None if length is None else 1.0 - length / self.length
        cell = sample.packing.cell if has_grains else None
        shear, volumetric = cell_strains(cell, self.cell)
        return {"strain": axial, "shear_strain": shear, "volumetric_strain": volumetric}


def flip_notes(early: int, before: Cell | None, number: int, cell: Cell | None) -> list[Note]:
    """A note if the cell of frame ``number`` seems to be flipped since the frame ``early``."""
    if not is_flipped(cell, before):
        return []
    text = (
        f"the cell seems to be flipped between the frames {early} and {number}: from there on its "
        f"vectors do not correspond to those of the first frame, so shear_strain is wrong (LAMMPS: "
        f"use fix deform ... flip no)"
    )
    # each flip is a note of its own
    return [Note(text, text)]
