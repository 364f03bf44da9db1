"""What looks wrong in a frame is said, and nothing is said of what is right."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import PackingError
from scanfab.packing.cell import Cell
from scanfab.packing.doubts import cell_doubt, cell_hint, doubts_of, refuse_impossible
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample
from scanfab.packing.search import find_contacts
from tests.helpers.truth import BOX, CELL, FLOOR, SAMPLE_DATA, SHEAR, TRIAXIAL, YADE

CLUMPS, DISCS = SAMPLE_DATA / "clumps", SAMPLE_DATA / "lammps_discs"
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")


def sample_of(packing):
    packing = packing if packing.contacts is not None else find_contacts(packing)
    return Sample(packing, np.zeros(len(packing), bool))


def read(path, **options):
    return sample_of(scanfab.read(path, **options))


def columns_of(packing, **columns):
    return Packing(packing.position, packing.radius, columns=columns)


@pytest.fixture(scope="module")
def loose():
    """A packing without anything remarkable."""
    return scanfab.read(BOX / "dump_40000.txt.gz", contacts="geometric")


@pytest.mark.parametrize(
    "path",
    [
        BOX / "dump_40000.txt.gz",
        CELL / "dump_30000.txt.gz",
        SHEAR / "shear.200000.lammpstrj.gz",
        TRIAXIAL / "triaxial-spheres-00000000.vtk.gz",
        YADE / "formats.xml.bz2",
        FLOOR / "tutorial.txt",
    ],
)
def test_sound_samples_raise_no_doubt(path):
    sample = read(path, contacts="geometric")
    refuse_impossible(sample)
    assert doubts_of(sample) == []


@pytest.mark.parametrize("name", ["clumps.xml.bz2", "clumps_spheres.0.vtu", "multisphere_2.txt"])
def test_clumps_that_are_read_as_bodies_raise_no_doubt(name):
    codes = [one.code for one in doubts_of(read(CLUMPS / name))]
    assert "clumps" not in codes
    assert "spread_bodies" not in codes


def test_molecules_that_may_be_clumps_are_named():
    """They are never taken unasked: a program may number bonded spheres by them."""
    packing = scanfab.read(CLUMPS / "multisphere_2.txt", bodies="id")
    doubts = {one.code: one.text for one in doubts_of(sample_of(packing))}
    assert doubts["clumps"].startswith("the column mol names 40 clumps of 80 spheres, but each ")
    assert '`bodies="mol"`' in doubts["clumps"]


def clumps_in_a_row(count, **options):
    """Pairs of spheres in a row of 10 diameters and more, the last one through the face."""
    position = np.zeros((2 * count, 3))
    position[:, 0] = np.repeat(np.arange(count), 2) * 4.0 + np.tile([0.0, 1.5], count)
    length = 4.0 * count
    position[:, 0] = (position[:, 0] + 3.0) % length
    return Packing(position, 1.0, bodies=np.repeat(np.arange(count), 2), **options)


def test_bodies_that_a_periodic_face_cuts_are_told_without_the_cell():
    whole = clumps_in_a_row(12, cell=Cell([48.0, 10.0, 10.0]))
    assert "spread_bodies" not in [one.code for one in doubts_of(sample_of(whole))]
    doubts = {one.code: one.text for one in doubts_of(sample_of(clumps_in_a_row(12)))}
    text = doubts["spread_bodies"]
    assert text.startswith("1 body of several spheres, such as number 11, reach")
    assert "name its cell (`cell`, `periodic`)" in text


def test_numbers_that_spheres_all_over_the_sample_share_are_told(loose):
    for cell in (None, Cell([0.035, 0.035, 0.035])):
        number = np.arange(len(loose)) % 2
        packing = Packing(loose.position, loose.radius, bodies=number, cell=cell)
        doubts = {one.code: one.text for one in doubts_of(sample_of(packing))}
        assert "2 bodies of several spheres, such as number 0" in doubts["spread_bodies"]


def test_bodies_that_span_a_thin_sample_raise_no_doubt():
    """A layer one clump high."""
    steps = np.arange(16.0)
    base = np.column_stack([4 * (steps % 4), 4 * (steps // 4), 0 * steps])
    position = np.vstack([base, base + np.array([0, 0, 1.5])])
    packing = Packing(position, 1.0, bodies=np.tile(np.arange(16), 2))
    assert "spread_bodies" not in [one.code for one in doubts_of(sample_of(packing))]


@pytest.mark.parametrize(
    "mol",
    [
        lambda n: np.zeros(n),
        lambda n: np.ones(n),
        lambda n: 1 + np.arange(n) % 2,
        lambda n: np.arange(n),
        lambda n: np.full(n, -1.0),
    ],
    ids=["zero", "one", "two species", "each its own", "none"],
)
def test_molecules_that_are_no_clumps_raise_no_doubt(loose, mol):
    packing = columns_of(loose, mol=mol(len(loose)))
    assert doubts_of(sample_of(packing)) == []


@pytest.mark.parametrize("factor", [1e3, 30.0])
def test_radii_in_another_unit_are_refused_if_far_too_large(loose, factor):
    packing = Packing(loose.position, loose.radius * factor)
    with pytest.raises(PackingError, match="check the units of radius and position"):
        refuse_impossible(sample_of(packing))


@pytest.mark.parametrize(("gap", "words"), [(2e-6, "4e-06"), (8e-4, "0.002"), (25.0, None)])
def test_a_tolerance_that_closes_the_gaps_is_named_where_they_are_narrow(gap, words):
    grid = np.stack(np.meshgrid(*3 * [np.arange(5.0)]), axis=-1).reshape(-1, 3)
    (doubt,) = [one.text for one in doubts_of(sample_of(Packing(grid, 0.5 / (1.0 + gap))))]
    assert "no contact at all" in doubt
    assert (f"or use `contact_tolerance={words}`" in doubt) == (words is not None)
    assert ("contact_tolerance" in doubt) == (words is not None)


def test_contacts_among_the_boundary_alone_are_no_contacts_of_the_grains(loose):
    """Spheres of a boundary overlap; they must not hide that no grain touches anything."""
    shell = np.array([[1.0, 0, 0], [1.0001, 0, 0]])
    packing = Packing(
        np.vstack([loose.position, shell]), np.append(loose.radius * 0.5, [0.001, 0.001])
    )
    boundary = np.arange(len(packing)) >= len(loose)
    (doubt,) = [one.text for one in doubts_of(Sample(find_contacts(packing), boundary))]
    assert doubt.startswith("no contact at all by geometry")


def test_a_contact_list_says_itself_that_nothing_touches(loose):
    far = Packing(loose.position, loose.radius * 0.5, contacts=np.empty((0, 2), int))
    assert doubts_of(sample_of(far)) == []


def test_a_period_that_is_half_empty_is_named_if_it_is_the_user_s():
    dump = scanfab.read(BOX / "dump_40000.txt.gz", contacts="geometric", periodic="xyz")
    assert doubts_of(sample_of(dump)) == []
    (doubt,) = [one.text for one in doubts_of(sample_of(dump), cell_is_named=True)]
    assert "of the cell's period along x (0.04), the rest of it is empty" in doubt


@pytest.mark.parametrize("carries", ["nothing", "box"])
def test_a_format_without_a_cell_is_told_where_it_is_asked_for(loose, carries):
    sample = sample_of(loose)
    assert cell_doubt(sample, carries) == ""
    cure = {"nothing": "`cell=(LX, LY, LZ)`", "box": '`periodic="xyz"`'}[carries]
    assert f"{cure} if the sample is periodic" in cell_hint(sample, carries)
    assert cell_hint(sample, "cell") == ""


def test_a_periodic_sample_without_its_cell_is_found_out():
    sample = read(YADE / "periodic_x_y_z_r.txt")
    assert len(sample.contacts) < 261
    doubt = cell_doubt(sample, "nothing")
    assert "looks periodic" in doubt
    assert "0.02872 along x, 0.03223 along y, 0.03553 along z" in doubt


def test_a_periodic_sample_with_its_cell_raises_no_doubt():
    packing = scanfab.read(YADE / "periodic_x_y_z_r.txt")
    cell = Cell([0.0286394, 0.0321223, 0.0354697])
    whole = sample_of(Packing(packing.position, packing.radius, cell=cell))
    assert cell_doubt(whole, "nothing") == cell_hint(whole, "nothing") == ""


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (2.5, "contacts a grain by geometry (radii"),
        (1e-3, "no contact at all by geometry"),
        (0.5, "right for a gas, else check the units of radius and position"),
        (0.9, "right for a gas, else check the units of radius and position"),
    ],
)
def test_many_contacts_and_none_ask_for_the_units(loose, factor, words):
    packing = Packing(loose.position, loose.radius * factor)
    (doubt,) = [one.text for one in doubts_of(sample_of(packing))]
    assert words in doubt
    assert "check the units of radius and position" in doubt


def test_a_sheet_of_discs_is_told_where_they_are_read_as_spheres():
    sheet = DISCS / "sheet.3000.lammpstrj"
    doubts = {one.code: one.text for one in doubts_of(read(sheet, dim=3))}
    assert doubts["plane"].startswith("all 300 centres lie in the plane x-y (z = 0), but are taken")
    assert doubts["own_images"].startswith("300 grains touch themselves")
    with pytest.warns(scanfab.ScanfabNote, match=r"lie in the plane x-y \(z = 0\).*`dim=3`"):
        assert doubts_of(read(sheet)) == []
