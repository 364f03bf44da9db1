"""LIGGGHTS' dumps against their truth, its contact columns, and the syntax of text dumps."""

import itertools

import numpy as np
import pytest

import scanfab
from scanfab import ScanfabWarning
from scanfab.io.formats import shared
from tests.helpers import truth
from tests.helpers.dumps import NAMES, ROWS, dump_text, holds, refuses, write
from tests.helpers.made.lammps import yaml_text
from tests.helpers.truth import FLOOR, PERIODIC, SIX_DIGITS, assert_true_contacts, csv_rows

FLOOR_CELL = {"cell": (0.014, 0.013, 0.04), "periodic": "xy"}
TEXT = ["tutorial.txt", "tutorial.txt.gz", "shuffled.txt", "scaled.txt", "unwrapped.txt"]
TEXT += ["diameter.txt", "blanks.txt", "label.txt", "padded_000030000.txt", "precise.txt"]
VTK = [f"grains_{kind}30000.{end}" for kind in ("", "binary_") for end in ("vtk", "vtp", "vtu")]
OTHERS = ["dump.txt", "scaled.txt", "unwrapped.txt", "precise.txt", "grains_30000.vtk"]
KEYWORDS = {
    "pairs_all.txt.gz": "pos vel id force torque history contactArea",
    "pairs_pos_id_force.txt": "force id pos",
    "pairs_id_force.txt": "id force",
    "pairs_contactpoint.txt": "pos id force delta contactPoint",
    "pairs_pos_id_force_30000.vtk": None,
    "pairs_all_30000.vtk.gz": None,
    "pairs_contactpoint_30000.vtk.gz": None,
}


# the file with the fewest columns has the force on the first grain: from the second to the first
OF_FORCES = "id2,id1,crosses,fx,fy,fz"
FORCES = np.genfromtxt(FLOOR / "pairs_id_force.txt", skip_header=9, names=OF_FORCES)


def assert_true_grains(packing, folder, digits=SIX_DIGITS):
    """Ids and radii exactly, positions to the digits of the file."""
    grains = csv_rows(folder / "truth_grains.csv")
    order = np.argsort(packing.id)
    np.testing.assert_array_equal(packing.id[order], grains["id"])
    np.testing.assert_allclose(packing.radius[order], grains["radius"], rtol=1e-14)
    expected = truth.centres(grains)[np.argsort(order)]
    assert truth.off_by(packing, expected).max() < digits * 0.04


FORMS = [
    *((FLOOR, name, {}) for name in TEXT),
    *((FLOOR, name, {"periodic": "xy"}) for name in VTK),
    (FLOOR, "atom_30000.vtu", FLOOR_CELL),
    *((PERIODIC, name, {"periodic": "xyz"}) for name in OTHERS),
]


@pytest.mark.parametrize(("folder", "name", "options"), FORMS)
def test_every_form_gives_the_same_grains(folder, name, options):
    packing = scanfab.read(folder / name, **options)
    # VTK files have no step, and single ones none by their names
    assert (packing.step is None) == (".vt" in name)
    assert packing.cell.periodic == (True, True, folder is PERIODIC)
    assert_true_grains(packing, folder, 1e-12 if name == "precise.txt" else SIX_DIGITS)
    if name == "shuffled.txt":
        assert packing.step == 30000
        assert sorted(packing.columns) == ["c_ca", "mass", "type", "vx"]


@pytest.mark.parametrize("name", KEYWORDS)
@pytest.mark.parametrize("grains", ["tutorial.txt", "unwrapped.txt", "grains_30000.vtk"])
def test_every_contact_form_gives_the_same_contacts(grains, name):
    for keywords in {KEYWORDS[name], None}:
        options = {"contacts": FLOOR / name, "contact_columns": keywords}
        packing = scanfab.read(FLOOR / grains, periodic="xy", **options)
        assert_true_contacts(packing, csv_rows(FLOOR / "truth_contacts.csv"), normals=1e-4)
        assert_true_contacts(packing, FORCES, forces=1e-5)
    push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
    assert np.mean(push > 0) > 0.9


@pytest.mark.parametrize("name", ["pairs.txt", "pairs_30000.vtk.gz"])
def test_contacts_across_periodic_faces_are_true(name):
    packing = scanfab.read(PERIODIC / "dump.txt", contacts=PERIODIC / name)
    contacts = csv_rows(PERIODIC / "truth_contacts.csv")
    assert_true_contacts(packing, contacts, normals=1e-4)
    crossing = np.any(packing.contacts.image != 0, axis=1)
    assert crossing.sum() == contacts["crossing"].sum() == 114


@pytest.mark.parametrize("folder", [FLOOR, PERIODIC])
def test_geometry_finds_the_contacts_of_the_program(folder):
    packing = scanfab.find_contacts(scanfab.read(folder / "precise.txt"))
    assert truth.id_pairs(packing) == truth.true_pairs(csv_rows(folder / "truth_contacts.csv"))


def test_wall_contacts_count_for_their_grains():
    names = ("tutorial.txt", "pairs_all.txt.gz", "walls_all.txt")
    packing = scanfab.read_series([FLOOR / name for name in names])[0].read()
    assert_true_contacts(packing, csv_rows(FLOOR / "truth_contacts.csv"), normals=1e-4)
    assert packing.wall_contacts.sum() == 25
    ids = np.loadtxt(FLOOR / "walls_all.txt", skiprows=9)[:, 14].astype(int)
    assert set(packing.id[packing.wall_contacts > 0].tolist()) == set(ids.tolist())


@pytest.mark.parametrize("columns", [None, "pos id force", "id1=c_a[1],id2=c_a[2]"])
@pytest.mark.parametrize("grains", ["tutorial.txt", "shuffled.txt", "precise.txt"])
def test_wall_contacts_alone_leave_the_contacts_to_geometry(grains, columns):
    walls = FLOOR / "walls_all.txt"
    with pytest.warns(scanfab.ScanfabWarning, match=r"walls_all.txt: lists contacts with walls on"):
        packing = scanfab.read(FLOOR / grains, contacts=walls, contact_columns=columns)
    assert (packing.contacts, packing.wall_contacts.sum()) == (None, 25)


NO_GRAINS = ["mesh_30000.vtk", "grains_boundingBox_30000.vtk", "grains_boundingBox_30000.vtr"]


WITHOUT_GRAINS = [
    *((name, "no grains: expected points with a radius") for name in NO_GRAINS),
    ("mesh_30000.stl", "no reader knows this format"),
    ("binary_30000.bin", "the 6 columns have no names: number them"),
    ("pairs_id_force.txt", r"no grains.*found contacts \(pairs_id_force.txt\)"),
    ("noradius.txt", r"noradius.txt, step 30000: no radius.*`columns.*`radius`"),
]


@pytest.mark.parametrize(("name", "told"), WITHOUT_GRAINS)
def test_files_without_grains_are_told(name, told):
    refuses(FLOOR / name, told)


@pytest.mark.parametrize("ending", [".vtk", ".vtr"])
@pytest.mark.parametrize("name", ["grains_30000.vtk", "grains_30000.vtp", "grains_30000.vtu"])
def test_the_box_beside_a_vtk_file_is_its_cell(tmp_path, name, ending):
    for file in (name, f"grains_boundingBox_30000{ending}", "mesh_30000.vtk"):
        (tmp_path / file).write_bytes((FLOOR / file).read_bytes())
    with pytest.warns(scanfab.ScanfabNote, match="boundingBox"):
        (frame,) = scanfab.read_series(tmp_path)
    assert frame.read().cell.periodic == (False, False, False)
    packing = scanfab.read(tmp_path / name, periodic="xy")
    assert_true_grains(packing, FLOOR)
    np.testing.assert_allclose(np.diagonal(packing.cell.vectors), [0.014, 0.013, 0.04], rtol=1e-6)
    np.testing.assert_allclose(packing.cell.origin, [-0.005, 0, 0], atol=1e-9)
    assert packing.cell.periodic == (True, True, False)


TIMES = "ITEM: UNITS\nsi\nITEM: TIME\n{}\n"
WORDS = [(*row[:2], word, *row[2:]) for row, word in zip(ROWS, ("Si", "1", "O"), strict=True)]


def read(tmp_path, text, **options):
    return scanfab.read(write(tmp_path / "dump", text), **options)


SPELLINGS = [
    dump_text(separator="   ", end="  \n"),
    dump_text(separator="\t", end="\n"),
    dump_text(rows=[(f"   {row[0]}", *row[1:]) for row in ROWS]),
    dump_text(after="ITEM: LABEL\nGRAINS\n"),
    dump_text(before=TIMES.format(0.5)).replace("\n", "\r\n"),
    dump_text(WORDS, "id type element x y z r"),
    dump_text(flags="", names=NAMES.replace("id", "tag")),
    yaml_text(0),
]


@pytest.mark.parametrize("text", SPELLINGS)
def test_grains_are_those_of_the_file(tmp_path, text):
    packing, rows = read(tmp_path, text), np.array(ROWS)
    holds(packing, step=0, id=rows[:, 0], type=rows[:, 1], radius=rows[:, 5])
    holds(packing, position=packing.cell.wrap(rows[:, 2:5]))
    if "element" in text:
        holds(packing, element=["Si", "1", "O"])
    if "---" not in text:
        holds(packing.cell, vectors=np.eye(3))


def test_of_a_repeated_column_the_first_counts_and_ids_keep_all_digits(tmp_path):
    ids = [2**53 + 1, 2**62 + 1, 7]
    rows = [(id, 5, *row[1:]) for id, row in zip(ids, ROWS, strict=True)]
    wide = " ".join(f"c_{number}" for number in range(3000))
    text = dump_text([(*row, *range(3000)) for row in rows], f"id type {NAMES[3:]} {wide}")
    holds(read(tmp_path, text), id=ids, type=[5, 5, 5], c_2999=[2999] * 3)


def test_a_dump_that_names_no_columns(tmp_path):
    text = dump_text(names="", flags="").replace("ATOMS  \n", "ATOMS\n")
    refuses(write(tmp_path / "dump", text), "the 6 columns have no names", format="lammps")
    packing = read(tmp_path, text, columns={"id": 1, "x": 3, "y": 4, "z": 5, "radius": 6})
    holds(packing, position=np.array(ROWS)[:, 2:5], **{"2": [1, 1, 2]})


@pytest.mark.parametrize("piece", [1, 64, 1 << 20])
@pytest.mark.parametrize("place", ["before", "after"])
def test_every_snapshot_is_found_in_the_order_of_its_step(tmp_path, monkeypatch, piece, place):
    monkeypatch.setattr(shared, "PIECE", piece)
    text = ""
    for step in (8, 10, 9):
        text += dump_text(ROWS[: step % 4], step=step, **{place: TIMES.format(step / 4)})
    frames = list(scanfab.read_series(write(tmp_path / "dump", text)))
    assert [frame.step for frame in frames] == [8, 9, 10]
    assert [frame.snapshot.time for frame in frames] == [2.0, 2.25, 2.5]
    assert [len(frame.read()) for frame in frames] == [0, 1, 2]


@pytest.mark.parametrize("keep", [0.97, 0.8, 0.6, 0.2])
@pytest.mark.parametrize("make", [dump_text, yaml_text])
def test_an_incomplete_last_snapshot_is_left_out_with_a_warning(tmp_path, make, keep):
    last = make(step=10)
    path = write(tmp_path / "dump", make(step=0) + last[: int(keep * len(last))])
    with pytest.warns(ScanfabWarning, match="the last snapshot, number 2, is incomplete"):
        assert [frame.step for frame in scanfab.read_series(path)] == [0]


def test_only_pp_is_periodic(tmp_path):
    for flags, periodic in ((" pp ff mm", (1, 0, 0)), (" fm ms pp", (0, 0, 1)), ("", (0, 0, 0))):
        assert read(tmp_path, dump_text(flags=flags)).cell.periodic == periodic


@pytest.mark.parametrize("form", ["text", "yaml", "general"])
@pytest.mark.parametrize("tilt", [(0.4, 0.2, -0.3), (-0.4, 0.2, 0.3), (-0.4, -0.2, 0.1)])
def test_the_bounds_are_those_of_the_box_around_a_tilted_one(tmp_path, tilt, form):
    vectors = np.diag([2.0, 3.0, 4.0])
    vectors[[1, 2, 2], [0, 0, 1]] = tilt
    origin = np.array([-0.5, 0.25, 1.0])
    corners = origin + np.array(list(itertools.product((0, 1), repeat=3))) @ vectors
    box = np.column_stack([corners.min(axis=0), corners.max(axis=0), tilt]).tolist()
    text = dump_text(box=box, flags=" xy xz yz pp ff mm")
    if form == "general":
        text = dump_text(box=np.column_stack([vectors, origin]), flags=" abc origin pp ff mm")
    if form == "yaml":
        lines = "".join(f"  - [ {low}, {high} ]\n" for low, high, _ in box)
        text, old = yaml_text(), yaml_text().partition("box:\n")[2].partition("keywords")[0]
        text = text.replace(old, f"{lines}  - [ {', '.join(map(str, tilt))} ]\n")
    cell = read(tmp_path, text).cell
    np.testing.assert_allclose(cell.vectors, vectors, atol=1e-15)
    np.testing.assert_allclose(cell.origin, origin, atol=1e-15)
    assert cell.periodic == (True, False, False)


@pytest.mark.parametrize("edge", [(0, 0), (1, 0), ("nan", "nan"), (0, "inf"), (0, 1e200)])
def test_only_a_periodic_box_must_have_a_volume(tmp_path, edge):
    box = (edge, (0, 1), (0, 1))
    assert read(tmp_path, dump_text(box=box)).cell is None
    path = write(tmp_path / "dump", dump_text(box=box, flags=" ff pp ff"))
    refuses(path, r"dump, step 0: ITEM: BOX BOUNDS ff pp ff: the cell")


def test_a_bad_line_of_a_later_snapshot_is_counted_from_the_first(tmp_path):
    text = dump_text(step=-1) + dump_text().replace("0.58", "oops")
    refuses(write(tmp_path / "dump", text), r"dump, line 24: .* found 'oops'", frame=-1)
