"""What looks wrong in a frame is said, and nothing is said of what is right."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, PackingError, find_contacts
from scanfab.packing.doubts import (
    cell_doubt,
    cell_hint,
    doubts_of,
    fitting_periods,
    refuse_impossible,
)
from tests.helpers import truth
from tests.helpers.packed import along_x, cubic_grid, sample_of

BOX, CELL, FLOOR, TRIAXIAL, YADE = (
    truth.BOX / "dump_40000.txt.gz",
    truth.CELL / "dump_30000.txt.gz",
    truth.FLOOR / "tutorial.txt",
    truth.TRIAXIAL / "triaxial-spheres-00000000.vtk.gz",
    truth.YADE / "formats.xml.bz2",
)
CLUMPS = truth.SAMPLE_DATA / "clumps"
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")


def doubts(packing, **named):
    return {one.code: one.text for one in doubts_of(sample_of(packing), **named)}


@pytest.fixture(scope="module")
def loose():
    """A packing without anything remarkable."""
    return scanfab.read(BOX, contacts="geometric")


@pytest.mark.parametrize(
    "path", [BOX, CELL, FLOOR, TRIAXIAL, YADE, truth.SHEAR / "shear.200000.lammpstrj.gz"]
)
def test_sound_samples_raise_no_doubt(path):
    packing = scanfab.read(path, contacts="geometric")
    refuse_impossible(sample_of(packing))
    assert doubts(packing) == {}


@pytest.mark.parametrize("name", ["clumps.xml.bz2", "clumps_spheres.0.vtu", "multisphere_2.txt"])
def test_clumps_that_are_read_as_bodies_raise_no_doubt(name):
    assert not doubts(scanfab.read(CLUMPS / name)).keys() & {"clumps", "spread_bodies"}


def test_molecules_that_may_be_clumps_are_named():
    """They are never taken unasked: a program may number bonded spheres by them."""
    told = doubts(scanfab.read(CLUMPS / "multisphere_2.txt", bodies="id"))["clumps"]
    assert told.startswith("the column mol names 40 clumps of 80 spheres, but each ")
    assert '`bodies="mol"`' in told


def clumps_in_a_row(count, **options):
    """Pairs of spheres in a row of 10 diameters and more, the last one through the face."""
    number = np.repeat(np.arange(count), 2)
    x = (number * 4.0 + np.tile([3.0, 4.5], count)) % (4.0 * count)
    return Packing(along_x(x), 1.0, bodies=number, **options)


def test_bodies_that_a_periodic_face_cuts_are_told_without_the_cell():
    whole = clumps_in_a_row(12, cell=Cell([48.0, 10.0, 10.0]))
    assert "spread_bodies" not in doubts(whole)
    text = doubts(clumps_in_a_row(12))["spread_bodies"]
    assert text.startswith("1 body of several spheres, such as number 11, reach")
    assert "name its cell (`cell`, `periodic`)" in text


@pytest.mark.parametrize("cell", [None, Cell([0.035, 0.035, 0.035])])
def test_numbers_that_spheres_all_over_the_sample_share_are_told(loose, cell):
    number = np.arange(len(loose)) % 2
    packing = Packing(loose.position, loose.radius, bodies=number, cell=cell)
    text = doubts(packing)["spread_bodies"]
    assert "2 bodies of several spheres, such as number 0" in text
    assert f"reach through more than half of the {'sample' if cell is None else 'cell'}" in text


def test_bodies_that_span_a_thin_sample_raise_no_doubt():
    """A layer one clump high."""
    steps = np.arange(16.0)
    base = np.column_stack([4 * (steps % 4), 4 * (steps // 4), 0 * steps])
    position = np.vstack([base, base + np.array([0, 0, 1.5])])
    packing = Packing(position, 1.0, bodies=np.tile(np.arange(16), 2))
    assert "spread_bodies" not in doubts(packing)


@pytest.mark.parametrize(
    "mol",
    [np.zeros_like, np.ones_like, lambda row: 1 + row % 2, np.array, lambda row: -1.0 - 0 * row],
    ids=["zero", "one", "two species", "each its own", "none"],
)
def test_molecules_that_are_no_clumps_raise_no_doubt(loose, mol):
    columns = {"mol": mol(np.arange(len(loose)))}
    assert doubts(Packing(loose.position, loose.radius, columns=columns)) == {}


def test_radii_in_another_unit_are_refused_if_far_too_large(loose):
    packing = Packing(loose.position, loose.radius * 30.0)
    with pytest.raises(PackingError, match="check the units of radius and position"):
        refuse_impossible(sample_of(packing))


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (2.5, "contacts a grain by geometry (radii"),
        (1e-3, "no contact at all by geometry"),
        (0.9, "right for a gas, else check the units of radius and position"),
    ],
)
def test_many_contacts_and_none_ask_for_the_units(loose, factor, words):
    (doubt,) = doubts(Packing(loose.position, loose.radius * factor)).values()
    assert words in doubt
    assert "check the units of radius and position" in doubt


@pytest.mark.parametrize(("gap", "words"), [(2e-6, "4e-06"), (8e-4, "0.002"), (25.0, None)])
def test_a_tolerance_that_closes_the_gaps_is_named_where_they_are_narrow(gap, words):
    doubt = doubts(Packing(cubic_grid(5), 0.5 / (1.0 + gap)))["no_contacts"]
    assert (f"or use `contact_tolerance={words}`" in doubt) == (words is not None)
    assert ("contact_tolerance" in doubt) == (words is not None)


def test_contacts_among_the_boundary_alone_are_no_contacts_of_the_grains(loose):
    """Spheres of a boundary overlap; they must not hide that no grain touches anything."""
    position = np.vstack([loose.position, [[1.0, 0, 0], [1.0001, 0, 0]]])
    packing = Packing(position, np.append(loose.radius * 0.5, [0.001, 0.001]))
    sample = sample_of(packing, np.arange(len(loose), len(packing)))
    assert [one.code for one in doubts_of(sample)] == ["no_contacts"]
    # a contact list says itself that nothing touches
    assert doubts(Packing(loose.position, loose.radius * 0.5, contacts=[])) == {}


def test_a_period_that_is_half_empty_is_named_if_it_is_the_user_s():
    dump = scanfab.read(BOX, contacts="geometric", periodic="xyz")
    assert doubts(dump) == {}
    (doubt,) = doubts(dump, cell_is_named=True).values()
    assert "of the cell's period along x (0.04), the rest of it is empty" in doubt


def test_a_sheet_of_discs_is_told_where_they_are_read_as_spheres():
    sheet = truth.SAMPLE_DATA / "lammps_discs" / "sheet.3000.lammpstrj"
    told = doubts(scanfab.read(sheet, dim=3))
    assert told["plane"].startswith("all 300 centres lie in the plane x-y (z = 0), but are taken")
    assert told["own_images"].startswith("300 grains touch themselves")
    with pytest.warns(scanfab.ScanfabNote, match=r"lie in the plane x-y \(z = 0\).*`dim=3`"):
        assert doubts(scanfab.read(sheet)) == {}


# cells that formats do not have


@pytest.mark.parametrize(
    ("carries", "cure"), [("nothing", "`cell=(LX, LY, LZ)`"), ("box", '`periodic="xyz"`')]
)
def test_a_format_without_a_cell_is_told_where_it_is_asked_for(loose, carries, cure):
    sample = sample_of(loose)
    assert cell_doubt(sample, carries) == cell_hint(sample, "cell") == ""
    assert f"{cure} if the sample is periodic" in cell_hint(sample, carries)


def test_a_periodic_sample_without_its_cell_is_found_out():
    packing = scanfab.read(truth.YADE / "periodic_x_y_z_r.txt")
    doubt = cell_doubt(sample_of(packing), "nothing")
    assert "looks periodic" in doubt
    assert "0.02872 along x, 0.03223 along y, 0.03553 along z" in doubt
    cell = Cell([0.0286394, 0.0321223, 0.0354697])
    whole = sample_of(Packing(packing.position, packing.radius, cell=cell))
    assert cell_doubt(whole, "nothing") == cell_hint(whole, "nothing") == ""


def without_cell(path):
    """The grains alone, their contacts found without a cell; and the cell."""
    packing = scanfab.read(path, contacts="geometric")
    return find_contacts(Packing(packing.position, packing.radius)), packing.cell


OTHERS = truth.YADE / "periodic.xml.bz2", truth.PERIODIC / "precise.txt"


@pytest.mark.parametrize("path", [CELL, truth.CELL / "dump_150000.txt.gz", *OTHERS])
def test_the_periods_of_a_cell_that_is_lost_are_found(path):
    packing, cell = without_cell(path)
    # contacts overlap by some per cent of a radius
    np.testing.assert_allclose(fitting_periods(packing), np.diag(cell.vectors), rtol=0.015)


def test_a_sample_on_a_floor_repeats_sideways_only():
    x, y, z = fitting_periods(without_cell(FLOOR)[0])
    assert (x, y, z) == (pytest.approx(0.014, rel=0.01), pytest.approx(0.013, rel=0.01), None)


@pytest.mark.parametrize("path", [BOX, truth.BOX / "dump_280000.txt.gz", TRIAXIAL, YADE])
def test_walls_do_not_fit(path):
    assert fitting_periods(without_cell(path)[0]) == [None] * 3


def test_a_cloud_without_contacts_tells_nothing():
    cloud = Packing(np.random.default_rng(0).random((500, 3)), 1e-4)
    assert fitting_periods(find_contacts(cloud)) == [None] * 3
