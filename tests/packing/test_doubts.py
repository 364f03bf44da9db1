"""What looks wrong in a frame is said, and nothing is said of what is right."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing
from scanfab.packing.doubts import cell_hint, doubts_of
from tests.helpers import truth
from tests.helpers.packed import along_x, sample_of

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
    assert doubts(packing) == {}


@pytest.mark.parametrize("name", ["clumps.xml.bz2", "clumps_spheres.0.vtu", "multisphere_2.txt"])
def test_clumps_that_are_read_as_bodies_raise_no_doubt(name):
    assert "spread_bodies" not in doubts(scanfab.read(CLUMPS / name))


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
    ("factor", "words"),
    [
        (2.5, "contacts a grain by geometry (radii"),
        (30.0, "contacts a grain by geometry (radii"),
        (1e-3, "no contact at all by geometry: right for a gas, else check the units"),
    ],
)
def test_many_contacts_and_none_ask_for_the_units(loose, factor, words):
    (doubt,) = doubts(Packing(loose.position, loose.radius * factor)).values()
    assert words in doubt
    assert "check the units of radius and position" in doubt


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


@pytest.mark.parametrize(
    ("carries", "cure"), [("nothing", "`cell=(LX, LY, LZ)`"), ("box", '`periodic="xyz"`')]
)
def test_a_format_without_a_cell_is_told(loose, carries, cure):
    assert cell_hint(sample_of(loose), "cell") == ""
    assert f"{cure} if the sample is periodic" in cell_hint(sample_of(loose), carries)
    whole = Packing(loose.position, loose.radius, cell=Cell([1.0, 1.0, 1.0]))
    assert cell_hint(sample_of(whole), carries) == ""
