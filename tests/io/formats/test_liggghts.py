"""LIGGGHTS' dumps: its own files against their truth, and the layouts of contact columns."""

from __future__ import annotations

import bz2
import lzma

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from tests.helpers.dumps import PAIRS, ROWS, dump_text, local_text, pairs_text, write
from tests.helpers.truth import (
    FLOOR,
    PERIODIC,
    SIX_DIGITS,
    assert_same_vectors,
    csv_rows,
    forces_by_pair,
    id_pairs,
    normals_by_pair,
    off_by,
    true_pairs,
    vectors_by_pair,
)

FLOOR_CELL = {"cell": (0.014, 0.013, 0.04), "periodic": "xy"}
TEXT = ["tutorial.txt", "tutorial.txt.gz", "shuffled.txt", "scaled.txt", "unwrapped.txt"]
TEXT += ["diameter.txt", "blanks.txt", "label.txt", "padded_000030000.txt", "precise.txt"]
VTK = [f"grains_{kind}30000.{end}" for kind in ("", "binary_") for end in ("vtk", "vtp", "vtu")]
KEYWORDS = {
    "pairs_all.txt.gz": "pos vel id force torque history contactArea",
    "pairs_pos_id_force.txt": "force id pos",
    "pairs_id_force.txt": "id force",
    "pairs_contactpoint.txt": "pos id force delta contactPoint",
    "pairs_pos_id_force_30000.vtk": None,
    "pairs_all_30000.vtk.gz": None,
    "pairs_contactpoint_30000.vtk.gz": None,
}


def assert_true_grains(packing, folder, digits=SIX_DIGITS):
    """Ids and radii exactly, positions to the digits of the file."""
    grains = csv_rows(folder / "truth_grains.csv")
    order = np.argsort(packing.id)
    np.testing.assert_array_equal(packing.id[order], grains["id"])
    np.testing.assert_allclose(packing.radius[order], grains["radius"], rtol=1e-14)
    position = np.column_stack([grains["x"], grains["y"], grains["z"]])
    expected = np.empty_like(position)
    expected[order] = position
    assert off_by(packing, expected).max() < digits * 0.04


def assert_true_contacts(packing, folder):
    contacts = csv_rows(folder / "truth_contacts.csv")
    assert packing.contacts.source == "file"
    assert len(packing.contacts) == len(contacts)
    assert id_pairs(packing) == true_pairs(contacts)
    normals = np.column_stack([contacts["nx"], contacts["ny"], contacts["nz"]])
    expected = vectors_by_pair(contacts["id1"], contacts["id2"], normals)
    assert_same_vectors(normals_by_pair(packing), expected, atol=1e-4)


def assert_true_forces(packing):
    """As in the file with the fewest columns, which has the force on the first grain."""
    values = np.loadtxt(FLOOR / "pairs_id_force.txt", skiprows=9)
    ids = values[:, :2].astype(int)
    expected = vectors_by_pair(ids[:, 0], ids[:, 1], -values[:, 3:6])
    assert_same_vectors(forces_by_pair(packing), expected, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        *((name, {}) for name in TEXT),
        *((name, {"periodic": "xy"}) for name in VTK),
        ("atom_30000.vtu", FLOOR_CELL),
    ],
)
def test_every_form_gives_the_same_grains(name, options):
    packing = scanfab.read(FLOOR / name, **options)
    assert packing.step == 30000
    assert packing.cell.periodic == (True, True, False)
    assert_true_grains(packing, FLOOR, 1e-12 if name == "precise.txt" else SIX_DIGITS)
    if name == "shuffled.txt":
        assert sorted(packing.columns) == ["c_ca", "mass", "type", "vx"]


@pytest.mark.parametrize(
    "name", ["dump.txt", "scaled.txt", "unwrapped.txt", "precise.txt", "grains_30000.vtk"]
)
def test_the_periodic_state_has_the_same_grains_in_every_form(name):
    packing = scanfab.read(PERIODIC / name, periodic="xyz")
    assert_true_grains(packing, PERIODIC, 1e-12 if name == "precise.txt" else SIX_DIGITS)


def test_a_file_with_several_snapshots_holds_them_all():
    frames = [frame.read() for frame in scanfab.read_series(FLOOR / "multi.txt")]
    assert len(frames[0]) == 0
    assert [frame.step for frame in frames] == [0, 15000, 30000]
    assert_true_grains(frames[-1], FLOOR)


def test_of_a_repeated_column_the_first_counts(tmp_path):
    rows = [(1, 5, 6, 0.1, 0.2, 0.3, 0.01)]
    path = write(tmp_path / "dump", dump_text(rows, "id type type x y z radius"))
    np.testing.assert_array_equal(scanfab.read(path).columns["type"], [5])


@pytest.mark.parametrize("module", [bz2, lzma])
def test_packed_dumps_are_read_like_plain_ones(tmp_path, module):
    path = tmp_path / "packed"
    path.write_bytes(module.compress((FLOOR / "tutorial.txt").read_bytes()))
    assert_true_grains(scanfab.read(path), FLOOR)


def test_a_dump_without_a_radius_takes_the_users(tmp_path):
    with pytest.raises(ReadError, match=r"noradius.txt, step 30000: no radius.*`columns.*`radius`"):
        scanfab.read(FLOOR / "noradius.txt")
    packing = scanfab.read(FLOOR / "noradius.txt", radius=0.00125)
    np.testing.assert_array_equal(packing.radius, 0.00125)
    with pytest.raises(ReadError, match="no coordinates"):
        scanfab.read(write(tmp_path / "d", dump_text([(1, 2)], "id type")))


@pytest.mark.parametrize("scale", [1e-9, 50.0])
def test_no_length_is_absolute(tmp_path, scale):
    rows = [(id, type, *(scale * value for value in rest)) for id, type, *rest in ROWS]
    text = dump_text(rows, box=[(0, scale)] * 3, flags=" pp pp pp")
    packing = scanfab.read(
        write(tmp_path / "d", text), contacts=write(tmp_path / "c", pairs_text())
    )
    assert id_pairs(packing) == set(PAIRS)
    assert id_pairs(scanfab.find_contacts(packing)) == set(PAIRS)


def test_a_tilted_header_becomes_a_tilted_cell(tmp_path):
    rows, box = [(1, 1, 0.5, 0.5, 0.5, 0.1)], [(0, 2.25, 0.25), (0, 3, 0), (0, 4, 0)]
    text = dump_text(rows, "id type xs ys zs radius", box=box, flags=" xy xz yz pp pp pp")
    packing = scanfab.read(write(tmp_path / "d", text))
    np.testing.assert_allclose(packing.cell.vectors, [[2, 0, 0], [0.25, 3, 0], [0, 0, 4]])
    np.testing.assert_allclose(packing.position, [[1.125, 1.5, 2.0]])


@pytest.mark.parametrize("name", KEYWORDS)
@pytest.mark.parametrize("grains", ["tutorial.txt", "unwrapped.txt", "grains_30000.vtk"])
def test_every_contact_form_gives_the_same_contacts(grains, name):
    for keywords in {KEYWORDS[name], None}:
        packing = scanfab.read(
            FLOOR / grains, contacts=FLOOR / name, periodic="xy", contact_columns=keywords
        )
        assert_true_contacts(packing, FLOOR)
        assert_true_forces(packing)
    push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
    assert np.mean(push > 0) > 0.9


@pytest.mark.parametrize("name", ["pairs.txt", "pairs_30000.vtk.gz"])
def test_contacts_across_periodic_faces_are_true(name):
    packing = scanfab.read(PERIODIC / "dump.txt", contacts=PERIODIC / name)
    assert_true_contacts(packing, PERIODIC)
    crossing = np.any(packing.contacts.image != 0, axis=1)
    truth = csv_rows(PERIODIC / "truth_contacts.csv")
    assert crossing.sum() == truth["crossing"].sum() == 114


@pytest.mark.parametrize("folder", [FLOOR, PERIODIC])
def test_geometry_finds_the_contacts_of_the_program(folder):
    packing = scanfab.find_contacts(scanfab.read(folder / "precise.txt"))
    assert id_pairs(packing) == true_pairs(csv_rows(folder / "truth_contacts.csv"))


def test_wall_contacts_count_for_their_grains():
    names = ("tutorial.txt", "pairs_all.txt.gz", "walls_all.txt")
    packing = scanfab.read_series([FLOOR / name for name in names])[0].read()
    assert_true_contacts(packing, FLOOR)
    assert packing.wall_contacts.sum() == 25
    ids = np.loadtxt(FLOOR / "walls_all.txt", skiprows=9)[:, 14].astype(int)
    assert set(packing.id[packing.wall_contacts > 0].tolist()) == set(ids.tolist())


@pytest.mark.parametrize("columns", [None, "pos id force", "id1=c_a[1],id2=c_a[2]"])
@pytest.mark.parametrize("grains", ["tutorial.txt", "shuffled.txt", "precise.txt"])
def test_wall_contacts_alone_leave_the_contacts_to_geometry(grains, columns):
    with pytest.warns(scanfab.ScanfabWarning, match=r"walls_all.txt: lists contacts with walls on"):
        packing = scanfab.read(
            FLOOR / grains, contacts=FLOOR / "walls_all.txt", contact_columns=columns
        )
    assert packing.contacts is None
    assert packing.wall_contacts.sum() == 25


def joined(tmp_path, local, rows=ROWS, columns=None, **options):
    grains = write(tmp_path / "dump_0.txt", dump_text(rows, **options))
    contacts = write(tmp_path / "pairs_0.txt", local)
    return scanfab.read(grains, contacts=contacts, contact_columns=columns)


def chain(first, step=0.1):
    """Eight grains in a row with ids from a number on, and the seven pairs that touch."""
    rows = [(first + k, 1, step * k, 0.5, 0.5, 0.06) for k in range(1, 9)]
    return rows, [(first + k, first + k + 1) for k in range(1, 8)]


def test_pairs_that_are_listed_twice_are_one_contact(tmp_path):
    packing = joined(tmp_path, local_text([(1, 2, 0), (2, 1, 0), (2, 3, 0), (1, 2, 0)]))
    assert len(packing.contacts) == 2
    assert id_pairs(packing) == set(PAIRS)


@pytest.mark.parametrize("rows", [ROWS, []])
def test_no_contacts_at_all_are_an_empty_list(tmp_path, rows):
    packing = joined(tmp_path, local_text([]), rows)
    assert (len(packing.contacts), packing.contacts.source) == (0, "file")


WIDE = local_text([(1, 2, 0, -1, 0, 0), (2, 3, 0, -1, 0, 0)])
ROUNDED = local_text([(f"{one:g}", f"{two:g}", 0, -1, 0, 0) for one, two in chain(1234561)[1]])


@pytest.mark.parametrize(
    ("local", "rows", "columns", "told"),
    [
        (local_text([(1, 2, 0), (2, 3, 0), (3, 4, 0), (4, 99, 0)]), chain(0)[0], None, "grain 99"),
        (local_text([(101, 102, 0), (102, 103, 0)]), ROWS, None, "another step"),
        (local_text([(1, 2, 0, 2, 3, 0), (2, 3, 0, 1, 2, 0)]), ROWS, None, "cannot tell which col"),
        (WIDE, ROWS, "pos force", "id among them"),
        (WIDE, ROWS, "", "id among them"),
        (WIDE, ROWS, "id forces", "keywords of compute pair/gran/local"),
        (WIDE, ROWS, "id force torque", "makes 9 columns, the file has 6"),
        (WIDE, ROWS, "id force history:2", "makes 8 columns, the file has 6"),
        (WIDE, ROWS, "id1=c_con[2],id2=c_con[9]", r"found 'id1=c_con\[2\],id2=c_con\[9\]'"),
        (ROUNDED, chain(1234561)[0], None, r"rounded to six digits.*%\.0f"),
        # each rounded id is that of another grain
        (ROUNDED, chain(1234560, 0.01)[0], "id force", r"rounded to six digits.*%\.0f"),
    ],
)
def test_contacts_that_cannot_be_right_are_refused(tmp_path, local, rows, columns, told):
    with pytest.raises(ReadError, match=told):
        joined(tmp_path, local, rows, columns)


def test_contacts_by_id_need_ids_in_the_grain_file(tmp_path):
    with pytest.raises(ReadError, match="the grain file has no ids"):
        joined(tmp_path, WIDE, [row[1:] for row in ROWS], names="type x y z radius")


def test_history_may_have_any_number_of_values(tmp_path):
    local = local_text([(*pair, 0, -1, 0, 0, 7, 7, 7, 7, 7, 0.5) for pair in PAIRS])
    packing = joined(tmp_path, local, columns="contactArea id force history:5")
    assert id_pairs(packing) == set(PAIRS)
    np.testing.assert_array_equal(packing.contacts.force, [[1, 0, 0], [1, 0, 0]])


def test_large_ids_that_lost_nothing_are_read(tmp_path):
    rows, pairs = chain(1234560)
    packing = joined(tmp_path, local_text([(*pair, 0) for pair in pairs]), rows)
    assert id_pairs(packing) == set(pairs)
    # %g writes a million as 1e+06
    rows = [(id, *rest) for id, (_, *rest) in zip((999999, 1000000, 7), ROWS, strict=True)]
    packing = joined(tmp_path, local_text([(999999, "1e+06", 0), ("1e+06", 7, 0)]), rows)
    assert id_pairs(packing) == {(999999, 1000000), (7, 1000000)}


def test_columns_of_any_compute_are_named(tmp_path):
    # a number, both ids apart, the force on the first grain; no periodic flag
    local = local_text([(0.5, first, 7, second, -1.5, 0, 2) for first, second in PAIRS])
    named = "id1=c_con[2],id2=c_con[4],fx=c_con[5],fy=c_con[6],fz=c_con[7]"
    packing = joined(tmp_path, local, columns=named)
    assert packing.contacts.pairs.tolist() == [[0, 1], [1, 2]]
    np.testing.assert_array_equal(packing.contacts.force, [[1.5, 0, -2]] * 2)


def test_pairs_apart_are_left_out_of_named_columns(tmp_path):
    rows = [*ROWS[:2], (3, 2, 0.61, 0.5, 0.5, 0.1)]
    local = local_text([(*pair, 0.0) for pair in PAIRS])
    packing = joined(tmp_path, local, rows, "id1=c_con[1],id2=c_con[2]")
    assert packing.contacts.pairs.tolist() == [[0, 1]]


BOXES = [
    f"grains_{kind}boundingBox_30000.{end}" for kind in ("", "binary_") for end in ("vtk", "vtr")
]


@pytest.mark.parametrize(
    ("name", "told"),
    [
        *((name, "no grains: expected points with a radius") for name in BOXES),
        ("mesh_30000.vtk", "no grains: expected points with a radius"),
        ("decomposition_30000.vtk", "no grains: expected points with a radius"),
        ("mesh_30000.stl", "no reader knows the format"),
        ("binary_30000.bin", "does not name its 6 columns: name them"),
        ("pairs_id_force.txt", r"no grains.*pairs_id_force.txt \(contacts\)"),
    ],
)
def test_files_without_grains_are_told(name, told):
    with pytest.raises(ReadError, match=told):
        scanfab.read(FLOOR / name)


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


def test_the_pieces_of_a_vtm_file_are_read_by_themselves():
    folder = FLOOR / "vtm" / "all_30000"
    contacts = folder / "all_30000_0.vtp"
    packing = scanfab.read(folder / "all_30000_1.vtu", contacts=contacts, **FLOOR_CELL)
    assert_true_grains(packing, FLOOR)
    assert_true_contacts(packing, FLOOR)


def test_a_contact_across_a_face_without_a_cell_asks_for_it():
    contacts = FLOOR / "pairs_pos_id_force_30000.vtk"
    with pytest.raises(scanfab.PackingError, match="name its cell \\(`cell` and `periodic`\\)"):
        scanfab.read(FLOOR / "grains_30000.vtk", contacts=contacts)
