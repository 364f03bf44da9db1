"""Faces that fit together tell a periodic sample from an open one."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.packing.doubts import fitting_periods
from scanfab.packing.packing import Packing
from tests.helpers.truth import BOX, CELL, FLOOR, PERIODIC, TRIAXIAL, YADE

pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")


def without_cell(path):
    """The grains alone, their contacts found without a cell; and the cell."""
    packing = scanfab.read(path, contacts="geometric")
    return scanfab.find_contacts(Packing(packing.position, packing.radius)), packing.cell


@pytest.mark.parametrize(
    "path",
    [
        CELL / "dump_30000.txt.gz",
        CELL / "dump_150000.txt.gz",
        YADE / "periodic.xml.bz2",
        PERIODIC / "precise.txt",
    ],
)
def test_the_periods_of_a_cell_that_is_lost_are_found(path):
    packing, cell = without_cell(path)
    # contacts overlap by some per cent of a radius
    np.testing.assert_allclose(fitting_periods(packing), np.diag(cell.vectors), rtol=0.015)


def test_a_sample_on_a_floor_repeats_sideways_only():
    x, y, z = fitting_periods(without_cell(FLOOR / "tutorial.txt")[0])
    assert (x, y) == (pytest.approx(0.014, rel=0.01), pytest.approx(0.013, rel=0.01))
    assert z is None


@pytest.mark.parametrize(
    "path",
    [
        BOX / "dump_40000.txt.gz",
        BOX / "dump_280000.txt.gz",
        TRIAXIAL / "triaxial-spheres-00000000.vtk.gz",
        YADE / "formats.xml.bz2",
    ],
)
def test_walls_do_not_fit(path):
    assert fitting_periods(without_cell(path)[0]) == [None] * 3


def test_a_cloud_without_contacts_tells_nothing():
    rng = np.random.default_rng(0)
    packing = scanfab.find_contacts(Packing(rng.random((500, 3)), 1e-4))
    assert fitting_periods(packing) == [None] * 3
