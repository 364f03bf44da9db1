"""YADE's files against its own truth: text, VTKExporter, VTKRecorder, O.save, and its cells."""

import itertools
import shutil
import warnings
from functools import cache

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabNote
from scanfab.io.reader import reader_for
from tests.helpers import truth
from tests.helpers.dumps import holds, refuses, small_save, write, yade_lines, yade_spheres
from tests.helpers.truth import (
    SAMPLE_DATA,
    SIX_DIGITS,
    YADE,
    assert_same_vectors,
    assert_true_contacts,
    centres,
    csv_rows,
)

TRUE_BODIES = csv_rows(YADE / "truth_bodies.csv")
TRUE_CONTACTS = csv_rows(YADE / "truth_contacts.csv")
TRUE_WALLS = csv_rows(YADE / "truth_walls.csv")
PERIODIC_BODIES = csv_rows(YADE / "periodic_truth_bodies.csv")
PERIODIC_CONTACTS = csv_rows(YADE / "periodic_truth_contacts.csv")
CELL = (0.02863940766875124, 0.03212233831079451, 0.03546973927065077)

HEAP = ["noid-spheres-00000000.vtk.gz", "id-spheres-00000000.vtk.gz"]
HEAP += ["ascii_spheres.30000.vtu", "zlib_spheres.30000.vtu", "text.txt", "x_y_z_r.txt"]
HEAP += ["x_y_z_r_matId.txt", "id_x_y_z_r_matId.txt", "x_y_z_r_attrs.txt"]
WITH_IDS = [*HEAP[1:4], *HEAP[7:]]
EXPORTED = ["noid-intrs-00000000.vtk.gz", "id-intrs-00000000.vtk.gz"]
PERIODIC_INTRS, PERIODIC_SPHERES = (
    f"periodic-{what}-00000000.vtk.gz" for what in ("intrs", "spheres")
)
PACK = "periodic_pack.txt"
# positions of the pack are not wrapped into the cell, unlike the ends of the lines
IN_CELL = [PERIODIC_SPHERES, "periodic_id_x_y_z_r_matId.txt", "periodic_x_y_z_r.txt", PACK]
RECORDED = ["ascii_intrs.30000.vtp", "zlib_intrs.30000.vtp"]


@pytest.mark.parametrize("name", HEAP)
def test_every_form_gives_the_same_grains(name):
    packing = scanfab.read(YADE / name, contacts="geometric")
    np.testing.assert_allclose(packing.radius, TRUE_BODIES["r"], rtol=SIX_DIGITS)
    np.testing.assert_allclose(packing.position, centres(TRUE_BODIES), rtol=SIX_DIGITS)
    if name in WITH_IDS:
        np.testing.assert_array_equal(packing.id, TRUE_BODIES["id"])


@pytest.mark.parametrize("name", IN_CELL)
def test_the_periodic_grains_are_the_same_in_every_form(name):
    packing = scanfab.read(YADE / name, contacts="geometric", cell=None if name == PACK else CELL)
    np.testing.assert_allclose(packing.radius, PERIODIC_BODIES["r"], rtol=SIX_DIGITS)
    assert truth.off_by(packing, centres(PERIODIC_BODIES)).max() < SIX_DIGITS * 0.036
    # SpherePack.save names its cell
    assert packing.cell.periodic == (True, True, True)
    np.testing.assert_allclose(np.diagonal(packing.cell.vectors), CELL, rtol=SIX_DIGITS)
    assert name != PACK or np.all(packing.columns["clumpId"] == -1)


JOINED = [
    *itertools.product(WITH_IDS, EXPORTED + RECORDED),
    (HEAP[0], EXPORTED[0]),
    *itertools.product(IN_CELL, [PERIODIC_INTRS]),
]


@pytest.mark.parametrize(("grains", "contacts"), JOINED)
def test_every_form_gives_the_same_contacts_by_ids_or_places_and_walls(grains, contacts):
    """Across the faces of the cell as well, where normals are true if the images are."""
    bodies, pairs, count, cell, walls = TRUE_BODIES, TRUE_CONTACTS, 271, None, 107
    if contacts == PERIODIC_INTRS:
        bodies, pairs, count, cell, walls = PERIODIC_BODIES, PERIODIC_CONTACTS, 261, CELL, 0
    packing = scanfab.read(YADE / grains, contacts=YADE / contacts, cell=cell)
    assert len(packing.contacts) == len(pairs) == count
    ids = bodies["id"][packing.contacts.pairs]
    assert {tuple(sorted(pair)) for pair in ids.tolist()} == truth.true_pairs(pairs)
    if "r_matId" in grains or grains in (*WITH_IDS, PERIODIC_SPHERES):
        normals = truth.true_vectors(pairs, "n")
        assert_same_vectors(truth.normals_by_pair(packing), normals, atol=1e-4)
    # the recorder leaves out contacts with facets and boxes
    expected = np.bincount(TRUE_WALLS["sphere"], minlength=200)[bodies["id"]]
    expected *= bool(walls and contacts in EXPORTED)
    assert expected.sum() in (0, walls)
    np.testing.assert_array_equal(packing.wall_contacts, expected)


def test_the_periodic_force_acts_on_the_second_body():
    contacts = YADE / PERIODIC_INTRS
    packing = scanfab.read(YADE / PERIODIC_SPHERES, contacts=contacts, cell=CELL)
    expected = truth.true_vectors(PERIODIC_CONTACTS, "f")
    assert_same_vectors(truth.forces_by_pair(packing), expected, atol=2e-4)
    assert np.all(np.sum(packing.contacts.force * packing.contacts.normal, axis=1) > 0)


def test_normal_and_shear_force_add_up_and_more_forces_than_lines_are_refused(tmp_path):
    position = [[0, 0, 0], [1.9, 0, 0]]
    spheres = yade_spheres(tmp_path / "a-spheres-0.vtk", position, [1, 1], id=[5, 6])
    both = {"normalForce": [[2, 0, 0]], "shearForce": [[0, 3, 0]]}
    lines = yade_lines(tmp_path / "a-intrs-0.vtk", [position], both, id1=[5], id2=[6])
    packing = scanfab.read(spheres, contacts=lines, format="yade")
    np.testing.assert_array_equal(packing.contacts.force, [[2, 3, 0]])
    yade_lines(lines, [position], {"force": [[2, 0, 0]] * 2})
    refuses(spheres, r"a-intrs-0\.vtk", error=scanfab.ScanfabError, contacts=lines)


def test_a_contact_through_a_face_without_a_cell_asks_for_it(tmp_path):
    # away from the file of the cell
    spheres = shutil.copy(YADE / PERIODIC_SPHERES, tmp_path)
    refuses(spheres, "name its cell", error=scanfab.PackingError, contacts=YADE / PERIODIC_INTRS)


@pytest.mark.parametrize("name", ["ascii_boxes.30000.vtu", "zlib_facets.30000.vtu"])
def test_boxes_and_facets_are_no_grains(name):
    assert reader_for(YADE / name).kind(YADE / name) == "other"


@pytest.mark.parametrize("format", ["yade", None])
@pytest.mark.parametrize("name", RECORDED)
def test_values_of_lost_contacts_are_refused_with_advice(tmp_path, name, format):
    """In a periodic cell VTKRecorder loses lines, but not their values."""
    text = (YADE / name).read_text()
    contacts = write(tmp_path / name, text.replace('NumberOfLines="271"', 'NumberOfLines="270"'))
    told = r"271 values for 270 contacts.*VTKExporter.*geometric"
    refuses(YADE / "id-spheres-00000000.vtk.gz", told, contacts=contacts, format=format)


def test_attributes_have_the_names_of_the_second_line_or_are_numbered(tmp_path):
    named = scanfab.read(YADE / "x_y_z_r_attrs.txt", contacts="geometric")
    assert sorted(named.columns) == ["mask", "vx", "vy", "vz"]
    path = write(tmp_path / "a.txt", "#format x_y_z_r_attrs\r\n1\t2\t3\t0.5\t7\t8\r\n")
    assert sorted(scanfab.read(path).columns) == ["attr1", "attr2"]
    write(path, "#format x_y_z_r_clumpId\n1\t2\t3\t0.5\t7\n")
    np.testing.assert_array_equal(scanfab.read(path).columns["clumpId"], [7])
    assert len(scanfab.read(write(path, "#format x_y_z_r\n"))) == 0


PERIODIC, BOX = YADE / "periodic.xml.bz2", YADE / "formats.xml.bz2"


read_once = cache(scanfab.read)


def held(path, what):
    return csv_rows(YADE / f"{'periodic_' if path == PERIODIC else ''}truth_{what}.csv")


@pytest.mark.parametrize("path", [PERIODIC, BOX])
def test_spheres_and_real_contacts_are_those_that_yade_holds(path):
    packing, bodies, contacts = read_once(path), held(path, "bodies"), held(path, "contacts")
    place = centres(bodies) if packing.cell is None else packing.cell.wrap(centres(bodies))
    holds(packing, id=bodies["id"], radius=bodies["r"], position=place)
    assert_true_contacts(packing, contacts, normals=1e-12, forces=1e-12)


def test_cell_walls_step_time_and_mask():
    cell, packing, walls = read_once(PERIODIC).cell, read_once(BOX), held(BOX, "walls")
    np.testing.assert_array_equal(cell.vectors, centres(held(PERIODIC, "cell")))
    assert cell.periodic == (True, True, True)
    assert packing.cell is None
    expected = [np.count_nonzero(walls["sphere"] == id) for id in packing.id]
    np.testing.assert_array_equal(packing.wall_contacts, expected)
    assert (packing.step, packing.time) == (30000, pytest.approx(1.58959062636740689))
    assert set(packing.columns["mask"].tolist()) <= {1, 5}


def test_the_small_save_in_a_tilted_cell(tmp_path):
    packing = scanfab.read(write(tmp_path / "a.xml", small_save()))
    assert scanfab.read(tmp_path / "a.xml", contacts="geometric").wall_contacts.sum() == 0
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
    bomb = "".join(f"<!ENTITY a{n} '{f'&a{n - 1};' * 10}'>" for n in range(1, 12))
    head = "<!DOCTYPE boost_serialization"
    text = small_save().replace(head, f"{head} [<!ENTITY a0 'aaaaaaaaaa'>{bomb}]", 1)
    path = write(tmp_path / "a.xml", text.replace("<iter>30<", "<iter>&a11;<"))
    refuses(path, "cannot be read as a simulation")


def test_the_binary_format_is_refused_with_advice(tmp_path):
    path = tmp_path / "a.yade"
    path.write_bytes(b"\x16\x00\x00\x00\x00\x00\x00\x00serialization::archive\x12\x00\x04")
    assert reader_for(path).name == "yade"
    refuses(path, r"save it as XML: O.save\('name.xml.bz2'\)")


def normal_forces(packing):
    pairs = map(frozenset, packing.id[packing.contacts.pairs].tolist())
    return dict(zip(pairs, packing.contacts.force_n.tolist(), strict=True))


NORMAL_FORCES = [
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


def test_cells_that_were_overwritten_are_not_taken():
    """Without files of interactions all cells have the number 0: the last one is left."""
    assert [packing.cell for packing in frames("lone-spheres-*")] == [None] * 3


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
    options = {"cell": path, "frame": 1, "contacts": "geometric"}
    refuses(STRAINED / "rec_spheres.*", f"cells.csv.*{message}", **options)


def test_one_file_has_its_own_cell():
    packing = scanfab.read(STRAINED / "after-spheres-00000001.vtk.gz")
    np.testing.assert_allclose(packing.cell.vectors, vectors()[1], rtol=0, atol=1e-7)
