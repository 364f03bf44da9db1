"""Shear strain of periodic cells: known answers, and cells that their program flips."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabWarning
from scanfab.packing.cell import Cell
from scanfab.pipeline.strain import shear_strain
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.lattices import rotation
from tests.helpers.truth import SHEAR

EDGE = 4.0
SCAN = {"variants": "a", "directions": 9, "spacing": "1rmin", "cutoff": 0}


def sheared(gamma: float, periodic=(True, True, True)) -> Cell:
    return Cell(np.array([[2.0, 0, 0], [3 * gamma, 3, 0], [0.2, 0.1, 4]]), periodic)


FIRST = sheared(0.0)


@pytest.mark.parametrize("gamma", [-0.3, 1e-6, 0.1, 0.5, 1.07, 4.0])
def test_simple_shear_has_its_known_strain(gamma):
    """Principal logarithmic stretches ± asinh(γ/2), 0; F = I + γ x⊗y of all of space."""
    cell = Cell(FIRST.vectors @ (np.eye(3) + gamma * np.outer([0, 1, 0], [1, 0, 0])))
    assert shear_strain(cell, FIRST) == pytest.approx(
        2 / np.sqrt(3) * np.arcsinh(abs(gamma) / 2), rel=1e-9
    )


def test_triaxial_compression_has_its_known_strain():
    """Stretches -e, e/2, e/2 give √(2/3 · 3/2) e; what the volume does does not count."""
    gradient = 1.7 * np.diag(np.exp([0.05, 0.05, -0.1]))
    assert shear_strain(Cell(FIRST.vectors @ gradient), FIRST) == pytest.approx(0.1, rel=1e-9)


def test_turning_and_scaling_are_no_shear():
    turned = Cell(0.8 * FIRST.vectors @ rotation(np.random.default_rng(1)))
    assert shear_strain(turned, FIRST) == pytest.approx(0, abs=1e-12)
    assert shear_strain(FIRST, FIRST) == 0.0


def test_the_frame_that_is_turned_sees_the_same_shear():
    cell, turn = sheared(0.4), rotation(np.random.default_rng(2))
    assert shear_strain(Cell(cell.vectors @ turn), Cell(FIRST.vectors @ turn)) == pytest.approx(
        shear_strain(cell, FIRST), rel=1e-9
    )


@pytest.mark.parametrize("cell", [None, sheared(0.1, (True, True, False))])
def test_without_a_cell_that_repeats_in_all_directions_there_is_none(cell):
    assert shear_strain(cell, FIRST) is None
    assert shear_strain(FIRST, cell) is None


def test_the_sample_has_the_strain_of_its_deck():
    series = scanfab.read_series(sorted(SHEAR.glob("shear.*.lammpstrj.gz")))
    table = scanfab.compute(series, **SCAN, frames="::2")
    # of erate 0.5 for 0, 0.8 and 1.6 s less the ten steps of rest before each frame
    gamma = np.array([0.0, 0.4, 0.8])
    expected = 2 / np.sqrt(3) * np.arcsinh(gamma / 2)
    assert table["shear_strain"] == pytest.approx(expected, rel=1e-3, abs=0)
    assert set(table["strain"]) == {0.0}


# flipping


def tilted_series(folder, tilts):
    """Snapshots as LAMMPS writes them: the bounds are those of the box about the cell."""
    texts = []
    for step, tilt in enumerate(tilts):
        lean = EDGE * tilt
        box = ((min(0, lean), EDGE + max(0, lean), lean), (0, EDGE, 0), (0, EDGE, 0))
        rows = cubic_rows(int(EDGE))
        texts.append(dump_text(rows, step=step, box=box, flags=" xy xz yz pp pp pp"))
    return scanfab.read_series(write(folder / "dump.txt", "".join(texts)))


@pytest.mark.parametrize("workers", [1, 2])
def test_a_cell_that_is_flipped_under_way_is_a_warning(tmp_path, workers):
    series = tilted_series(tmp_path, [0.0, 0.2, 0.45, -0.35, -0.2])
    with pytest.warns(ScanfabWarning, match="flipped between the frames 2 and 3: ") as caught:
        scanfab.compute(series, **SCAN, workers=workers)
    assert len({str(one.message) for one in caught if "flipped" in str(one.message)}) == 1


def test_a_cell_that_leans_ever_further_is_none(tmp_path):
    table = scanfab.compute(tilted_series(tmp_path, [0.0, 0.5, 1.0]), **SCAN)
    assert table["shear_strain"][2] == pytest.approx(2 / np.sqrt(3) * np.arcsinh(0.5))
