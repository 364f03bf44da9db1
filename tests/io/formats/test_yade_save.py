"""YADE's O.save, and the cells that YADE writes beside its VTK files."""

from __future__ import annotations

import shutil
import warnings
from functools import cache

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.io.reader import reader_for
from tests.helpers.dumps import holds, refuses, small_save, write
from tests.helpers.truth import SAMPLE_DATA, YADE, assert_true_contacts, centres, csv_rows

PERIODIC, BOX = YADE / "periodic.xml.bz2", YADE / "formats.xml.bz2"


read_once = cache(scanfab.read)


def truth(path, what):
    return csv_rows(YADE / f"{'periodic_' if path == PERIODIC else ''}truth_{what}.csv")


@pytest.mark.parametrize("path", [PERIODIC, BOX])
def test_spheres_and_real_contacts_are_those_that_yade_holds(path):
    packing, bodies, contacts = read_once(path), truth(path, "bodies"), truth(path, "contacts")
    place = centres(bodies) if packing.cell is None else packing.cell.wrap(centres(bodies))
    holds(packing, id=bodies["id"], radius=bodies["r"], position=place)
    assert_true_contacts(packing, contacts, normals=1e-12, forces=1e-12)


def test_cell_walls_step_time_and_mask():
    cell, packing, walls = read_once(PERIODIC).cell, read_once(BOX), truth(BOX, "walls")
    np.testing.assert_array_equal(cell.vectors, centres(truth(PERIODIC, "cell")))
    assert cell.periodic == (True, True, True)
    assert packing.cell is None
    expected = [np.count_nonzero(walls["sphere"] == id) for id in packing.id]
    np.testing.assert_array_equal(packing.wall_contacts, expected)
    assert (packing.step, packing.time) == (30000, pytest.approx(1.58959062636740689))
    assert set(packing.columns["mask"].tolist()) <= {1, 5}
    assert scanfab.read(BOX, contacts="geometric").wall_contacts.sum() == 0


def test_the_small_save_in_a_tilted_cell(tmp_path):
    packing = scanfab.read(write(tmp_path / "a.xml", small_save()))
    holds(packing.cell, vectors=[[1, 0, 0], [0.25, 2, 0], [0, 0, 3]])
    holds(packing, step=30, time=1.5e-3, mask=[1, 2, 3], wall_contacts=[0, 1, 0])
    contacts = packing.contacts
    holds(contacts, pairs=[[0, 1], [2, 0]], image=[[0] * 3, [1, 0, 0]], force=[[2, 3, 0]] * 2)
    np.testing.assert_allclose(contacts.normal, [[1, 0, 0]] * 2, atol=1e-15)
    # a contact that may become real is none
    contacts = ((0, 1, (0, 0, 0), 5), (2, 0, (1, 0, 0), -1))
    packing = scanfab.read(write(tmp_path / "a.xml", small_save(contacts)))
    assert packing.contacts.pairs.tolist() == [[0, 1]]


def test_entities_that_grow_are_an_error(tmp_path):
    bomb = "<!DOCTYPE boost_serialization [<!ENTITY a0 'aaaaaaaaaa'>" + "".join(
        f"<!ENTITY a{n} '{f'&a{n - 1};' * 10}'>" for n in range(1, 12)
    )
    text = small_save().replace("<!DOCTYPE boost_serialization", bomb + "]", 1)
    path = write(tmp_path / "a.xml", text.replace("<iter>30<", "<iter>&a11;<"))
    refuses(path, "cannot be read as a simulation")


def test_the_binary_format_is_refused_with_advice(tmp_path):
    path = tmp_path / "a.yade"
    path.write_bytes(b"\x16\x00\x00\x00\x00\x00\x00\x00serialization::archive\x12\x00\x04")
    assert reader_for(path).name == "yade"
    refuses(path, r"save it as XML: O.save\('name.xml.bz2'\)")


def test_contact_fabric_is_what_yade_computes_itself():
    """utils.fabricTensor() of YADE 2023.02a, after O.load of the same file."""
    packing = read_once(PERIODIC)
    yades = [
        [0.3447425639495811933, 0.01556076543761630675, 0.01238750215078152084],
        [0.01556076543761630675, 0.3262522875107742859, -0.009056572267288032566],
        [0.01238750215078152084, -0.009056572267288032566, 0.3290051485396444098],
    ]
    # YADE takes the normals of the last step, scanfab the saved positions
    found = scanfab.contact_fabric(packing.contacts.normal).matrix
    assert found == pytest.approx(np.array(yades), abs=5e-7)


def normal_forces(packing):
    pairs = map(frozenset, packing.id[packing.contacts.pairs].tolist())
    return dict(zip(pairs, packing.contacts.force_n.tolist(), strict=True))


NORMAL_FORCES = [
    ("zlib_spheres.30000.vtu", "ascii_intrs.30000.vtp", 1e-6),
    ("zlib_spheres.30000.vtu", "zlib_intrs.30000.vtp", 1e-6),
    ("id-spheres-00000000.vtk.gz", "id-intrs-00000000.vtk.gz", 1e-5),
]


@pytest.mark.parametrize(("grains", "contacts", "rtol"), NORMAL_FORCES)
def test_vtk_files_of_yade_have_the_normal_force(grains, contacts, rtol):
    packing = scanfab.read(YADE / grains, contacts=YADE / contacts)
    assert packing.contacts.force is None
    found, expected = normal_forces(packing), normal_forces(read_once(BOX))
    assert found == pytest.approx(expected, rel=20 * rtol, abs=rtol * np.mean([*expected.values()]))


STRAINED = SAMPLE_DATA / "yade_strained"
TRUTH = csv_rows(STRAINED / "truth.csv")
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")


def vectors():
    """The true cells, shape (frames, 3, 3)."""
    cells = np.zeros((len(TRUTH["step"]), 3, 3))
    numbers = np.column_stack([TRUTH[name] for name in ("lx", "ly", "lz", "xy", "xz", "yz")])
    cells[:, [0, 1, 2, 1, 2, 2], [0, 1, 2, 0, 0, 1]] = numbers
    return cells


def frames(pattern, **options):
    return [frame.read() for frame in scanfab.read_series(STRAINED / pattern, **options)]


@pytest.mark.parametrize("pattern", ["before-spheres-*", "after-spheres-*", "rec_*", "saved_*"])
def test_every_frame_has_its_own_cell_and_all_contacts(pattern):
    packings = frames(pattern.replace("_*", "_spheres.*"))
    for packing, cell, contacts in zip(packings, vectors(), TRUTH["contacts"], strict=True):
        np.testing.assert_allclose(packing.cell.vectors, cell, rtol=0, atol=1e-7)
        assert packing.cell.periodic == (True, True, True)
        # positions have six or seven digits
        geometric = scanfab.find_contacts(packing).contacts
        assert abs(len(geometric) - contacts) <= 3
        # those of the exporter come along
        assert not pattern.startswith("after") or len(packing.contacts) == contacts


def test_one_file_has_its_own_cell():
    packing = scanfab.read(STRAINED / "after-spheres-00000001.vtk.gz")
    np.testing.assert_allclose(packing.cell.vectors, vectors()[1], rtol=0, atol=1e-7)


def test_cells_that_were_overwritten_are_not_taken():
    """Without files of interactions all cells have the number 0: the last one is left."""
    with pytest.warns(ScanfabWarning, match=r"lone-periCell.*not each file of spheres has one"):
        packings = frames("lone-spheres-*")
    assert [packing.cell for packing in packings] == [None] * 3


def test_the_cell_of_another_frame_is_refused(tmp_path):
    """One file of spheres and one cell, whose number fits, but it is that of the last frame."""
    for name in ("lone-spheres-00000000.vtk.gz", "lone-periCell-00000000.vtk.gz"):
        shutil.copy(STRAINED / name, tmp_path)
    refuses(tmp_path / "lone-spheres-00000000.vtk.gz", r"outside the cell of .*`cell=.FILE.csv")


OTHER_STEPS = [
    ("saved_spheres.27500.vtu", "saved_spheres.27500.vtu", "saved_27500.xml.bz2"),
    # the exporter counts its files: their numbers are no steps
    ("after-spheres-00000001.vtk.gz", "x-spheres-00017500.vtk.gz", "x_17500.xml.bz2"),
]


@pytest.mark.parametrize(("spheres", "own", "saved"), OTHER_STEPS)
def test_a_saved_state_of_another_step_is_not_taken(tmp_path, spheres, own, saved):
    shutil.copy(STRAINED / spheres, tmp_path / own)
    shutil.copy(STRAINED / "saved_17500.xml.bz2", tmp_path / saved)
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "the cell is read from")
        assert scanfab.read(tmp_path / own).cell is None


def test_the_user_s_own_cell_comes_first():
    packing = scanfab.read(STRAINED / "rec_spheres.17500.vtu", cell=(1.0, 1.0, 1.0))
    assert np.diag(packing.cell.vectors).tolist() == [1.0, 1.0, 1.0]
    assert scanfab.read(STRAINED / "rec_spheres.17500.vtu", periodic="").is_periodic is False


def test_the_file_of_a_cell_is_not_passed_over_and_told(tmp_path):
    for name in ("rec_spheres.17500.vtu", "rec_pericell.17500.vtu"):
        shutil.copy(STRAINED / name, tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        series = scanfab.read_series(tmp_path)
    with pytest.warns(ScanfabNote, match=r"the cell is read from .*rec_pericell"):
        series[0].read()


@pytest.mark.parametrize("key", ["frame", "step"])
def test_cells_of_the_frames_come_from_a_csv_file(tmp_path, key):
    """By frame, or by the step in the names of the recorder's files."""
    header, *rows = (STRAINED / "truth.csv").read_text().splitlines()
    path = tmp_path / "cells.csv"
    if key == "frame":
        header = header.replace("step", "frame")
        rows = [f"{number},{row.partition(',')[2]}" for number, row in enumerate(rows)]
    path.write_text("\n".join([header, *rows]) + "\n")
    packings = frames("lone-spheres-*" if key == "frame" else "rec_spheres.*", cell=path)
    for packing, cell in zip(packings, vectors(), strict=True):
        np.testing.assert_array_equal(packing.cell.vectors, cell)


WRONG_CELLS = [
    ("step,lx,ly\n0,1,1\n", "expected .*step or frame, and lx, ly, lz.*found step, lx"),
    ("frame,lx,ly,lz,xy\n0,1,1,1,0\n", "lx, ly, lz, xy, xz, yz, found"),
    ("frame,lx,ly,lz\n0,1,0,1\n", "line 2: expected .*above 0: lx, ly, lz"),
    ("frame,lx,ly,lz\n0,1,1,1\n0,1,1,2\n", "line 3: frame 0 occurs twice"),
    ("step,lx,ly,lz\n17500,1,1,1\n37500,1,1,1\n", "no row .* step 27500.*27500.vtu"),
]


@pytest.mark.parametrize(("text", "message"), WRONG_CELLS)
def test_a_csv_file_of_cells_that_is_wrong_is_an_error_that_says_where(tmp_path, text, message):
    path = write(tmp_path / "cells.csv", text)
    refuses(STRAINED / "rec_spheres.*", f"cells.csv.*{message}", cell=path, frame=1)


@pytest.mark.parametrize("file", ["after-periCell-00000002.vtk.gz", "rec_pericell.27500.vtu"])
def test_a_cell_of_yade_is_no_file_of_the_cells_of_all_frames(file):
    told = f"{file}: expected the columns step or frame, and lx"
    refuses(STRAINED / "rec_spheres.27500.vtu", told, cell=STRAINED / file)
