"""LIGGGHTS' dumps: its own files against their truth, and the layouts of contact columns."""

from __future__ import annotations

import bz2
import gzip
import lzma

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, UnknownFormatError
from scanfab.io.registry import reader_for
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
TEXT = [
    "tutorial.txt",
    "tutorial.txt.gz",
    "shuffled.txt",
    "scaled.txt",
    "unwrapped.txt",
    "diameter.txt",
    "blanks.txt",
    "label.txt",
    "padded_000030000.txt",
    "precise.txt",
]
VTK = [
    "grains_30000.vtk",
    "grains_30000.vtp",
    "grains_30000.vtu",
    "grains_binary_30000.vtk",
    "grains_binary_30000.vtp",
    "grains_binary_30000.vtu",
]


def truth(folder, what):
    return csv_rows(folder / f"truth_{what}.csv")


def assert_true_grains(packing, folder, digits=SIX_DIGITS):
    """Ids and radii exactly, positions to the digits of the file."""
    grains = truth(folder, "grains")
    order = np.argsort(packing.id)
    np.testing.assert_array_equal(packing.id[order], grains["id"])
    np.testing.assert_allclose(packing.radius[order], grains["radius"], rtol=1e-14)
    position = np.column_stack([grains["x"], grains["y"], grains["z"]])
    expected = np.empty_like(position)
    expected[order] = position
    assert off_by(packing, expected).max() < digits * 0.04


@pytest.mark.parametrize("name", TEXT)
def test_every_text_form_gives_the_same_grains(name):
    packing = scanfab.read(FLOOR / name)
    assert packing.step == 30000
    assert packing.cell.periodic == (True, True, False)
    assert_true_grains(packing, FLOOR, 1e-12 if name == "precise.txt" else SIX_DIGITS)


@pytest.mark.parametrize("name", VTK)
def test_every_vtk_form_gives_the_same_grains(name):
    packing = scanfab.read(FLOOR / name, periodic="xy")
    assert packing.step == 30000
    assert_true_grains(packing, FLOOR)


def test_dump_atom_vtk_calls_the_radius_radii():
    assert_true_grains(scanfab.read(FLOOR / "atom_30000.vtu", **FLOOR_CELL), FLOOR)


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


def test_other_columns_keep_their_names():
    packing = scanfab.read(FLOOR / "shuffled.txt")
    assert sorted(packing.columns) == ["c_ca", "mass", "type", "vx"]


def test_of_a_repeated_column_the_first_counts(tmp_path):
    rows = [(1, 5, 6, 0.1, 0.2, 0.3, 0.01)]
    path = write(tmp_path / "dump", dump_text(rows, "id type type x y z radius"))
    np.testing.assert_array_equal(scanfab.read(path).columns["type"], [5])


@pytest.mark.parametrize(
    ("name", "pack"), [("d.gz", gzip.compress), ("d.bz2", bz2.compress), ("d.xz", lzma.compress)]
)
def test_packed_dumps_are_read_like_plain_ones(tmp_path, name, pack):
    path = tmp_path / name
    path.write_bytes(pack((FLOOR / "tutorial.txt").read_bytes()))
    assert_true_grains(scanfab.read(path), FLOOR)


def test_no_radius_is_refused_with_advice():
    with pytest.raises(ReadError, match=r"noradius.txt, step 30000: no radius.*`columns.*`radius`"):
        scanfab.read(FLOOR / "noradius.txt")


def test_a_dump_without_a_radius_takes_the_users():
    packing = scanfab.read(FLOOR / "noradius.txt", radius=0.00125)
    np.testing.assert_array_equal(packing.radius, 0.00125)


def test_a_column_of_words_is_no_obstacle(tmp_path):
    rows = [(1, "Si", 0.1, 0.2, 0.3, 0.01), (2, "O", 0.2, 0.3, 0.4, 0.01)]
    packing = scanfab.read(write(tmp_path / "d", dump_text(rows, "id element x y z radius")))
    np.testing.assert_array_equal(packing.position[:, 0], [0.1, 0.2])


def test_a_dump_without_coordinates_is_refused(tmp_path):
    path = write(tmp_path / "d", dump_text([(1, 2)], "id type"))
    with pytest.raises(ReadError, match="no coordinates"):
        scanfab.read(path)


@pytest.mark.parametrize("scale", [1e-9, 50.0])
def test_no_length_is_absolute(tmp_path, scale):
    rows = [(id, type, *(scale * value for value in rest)) for id, type, *rest in ROWS]
    box = [(0, scale)] * 3
    path = write(tmp_path / "d", dump_text(rows, box=box, flags=" pp pp pp"))
    local = write(tmp_path / "c", pairs_text())
    packing = scanfab.read(path, contacts=local)
    assert id_pairs(packing) == set(PAIRS)
    assert id_pairs(scanfab.find_contacts(packing)) == set(PAIRS)


def test_a_tilted_header_becomes_a_tilted_cell(tmp_path):
    text = dump_text(
        [(1, 1, 0.5, 0.5, 0.5, 0.1)],
        "id type xs ys zs radius",
        box=[(0, 2.25, 0.25), (0, 3, 0), (0, 4, 0)],
        flags=" xy xz yz pp pp pp",
    )
    packing = scanfab.read(write(tmp_path / "d", text))
    np.testing.assert_allclose(packing.cell.vectors, [[2, 0, 0], [0.25, 3, 0], [0, 0, 4]])
    np.testing.assert_allclose(packing.position, [[1.125, 1.5, 2.0]])


# contacts

TEXT_CONTACTS = [
    "pairs_all.txt.gz",
    "pairs_pos_id_force.txt",
    "pairs_id_force.txt",
    "pairs_contactpoint.txt",
]
VTK_CONTACTS = [
    "pairs_pos_id_force_30000.vtk",
    "pairs_all_30000.vtk.gz",
    "pairs_contactpoint_30000.vtk.gz",
]
KEYWORDS = {
    "pairs_all.txt.gz": "pos vel id force torque history contactArea",
    "pairs_pos_id_force.txt": "force id pos",
    "pairs_id_force.txt": "id force",
    "pairs_contactpoint.txt": "pos id force delta contactPoint",
}


def forces_of_file():
    """Force on the second grain, from the file with the fewest columns."""
    values = np.loadtxt(FLOOR / "pairs_id_force.txt", skiprows=9)
    ids = values[:, :2].astype(int)
    return vectors_by_pair(ids[:, 0], ids[:, 1], -values[:, 3:6])


def assert_true_contacts(packing, folder):
    contacts = truth(folder, "contacts")
    assert packing.contacts.source == "file"
    assert len(packing.contacts) == len(contacts)
    assert id_pairs(packing) == true_pairs(contacts)
    normals = np.column_stack([contacts["nx"], contacts["ny"], contacts["nz"]])
    expected = vectors_by_pair(contacts["id1"], contacts["id2"], normals)
    assert_same_vectors(normals_by_pair(packing), expected, atol=1e-4)


@pytest.mark.parametrize("name", TEXT_CONTACTS + VTK_CONTACTS)
@pytest.mark.parametrize("grains", ["tutorial.txt", "unwrapped.txt", "grains_30000.vtk"])
def test_every_contact_form_gives_the_same_contacts(grains, name):
    packing = scanfab.read(FLOOR / grains, contacts=FLOOR / name, periodic="xy")
    assert_true_contacts(packing, FLOOR)


@pytest.mark.parametrize("name", TEXT_CONTACTS + VTK_CONTACTS)
def test_the_force_acts_on_the_second_grain(name):
    packing = scanfab.read(FLOOR / "tutorial.txt", contacts=FLOOR / name)
    assert_same_vectors(forces_by_pair(packing), forces_of_file(), atol=1e-5)
    push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
    assert np.mean(push > 0) > 0.9


@pytest.mark.parametrize("name", KEYWORDS)
def test_the_keywords_of_the_compute_name_the_columns(name):
    packing = scanfab.read(
        FLOOR / "tutorial.txt", contacts=FLOOR / name, contact_columns=KEYWORDS[name]
    )
    assert_true_contacts(packing, FLOOR)
    assert_same_vectors(forces_by_pair(packing), forces_of_file(), atol=1e-5)


@pytest.mark.parametrize("name", ["pairs.txt", "pairs_30000.vtk.gz"])
def test_contacts_across_periodic_faces_are_true(name):
    packing = scanfab.read(PERIODIC / "dump.txt", contacts=PERIODIC / name)
    assert_true_contacts(packing, PERIODIC)
    crossing = np.any(packing.contacts.image != 0, axis=1)
    assert crossing.sum() == truth(PERIODIC, "contacts")["crossing"].sum() == 114


def test_geometry_finds_the_contacts_of_the_program():
    for folder in (FLOOR, PERIODIC):
        packing = scanfab.find_contacts(scanfab.read(folder / "precise.txt"))
        assert id_pairs(packing) == true_pairs(truth(folder, "contacts"))


def test_wall_contacts_count_for_their_grains():
    with_walls = scanfab.read_series(
        [FLOOR / "tutorial.txt", FLOOR / "pairs_all.txt.gz", FLOOR / "walls_all.txt"]
    )
    (frame,) = with_walls
    packing = frame.read()
    assert_true_contacts(packing, FLOOR)
    assert packing.wall_contacts.sum() == 25
    ids = np.loadtxt(FLOOR / "walls_all.txt", skiprows=9)[:, 14].astype(int)
    assert set(packing.id[packing.wall_contacts > 0].tolist()) == set(ids.tolist())


def test_wall_contacts_alone_leave_the_contacts_to_geometry():
    with pytest.warns(
        scanfab.ScanfabWarning, match=r"walls_all.txt: lists contacts with walls only"
    ):
        packing = scanfab.read(FLOOR / "tutorial.txt", contacts=FLOOR / "walls_all.txt")
    assert packing.contacts is None
    assert packing.wall_contacts.sum() == 25


def test_walls_files_are_not_taken_for_pairs():
    with pytest.warns(scanfab.ScanfabWarning, match="lists contacts with walls only"):
        packing = scanfab.read(FLOOR / "precise.txt", contacts=FLOOR / "walls_all.txt")
    assert packing.contacts is None


def series_of(tmp_path, rows, names=None, local=None):
    write(tmp_path / "dump_0.txt", dump_text(rows) if names is None else dump_text(rows, names))
    return scanfab.read(tmp_path / "dump_0.txt", contacts=write(tmp_path / "pairs_0.txt", local))


def test_pairs_that_are_listed_twice_are_one_contact(tmp_path):
    local = local_text([(1, 2, 0), (2, 1, 0), (2, 3, 0), (1, 2, 0)])
    packing = series_of(tmp_path, ROWS, local=local)
    assert len(packing.contacts) == 2
    assert id_pairs(packing) == set(PAIRS)


def test_no_contacts_at_all_are_an_empty_list(tmp_path):
    packing = series_of(tmp_path, ROWS, local=local_text([]))
    assert len(packing.contacts) == 0
    assert packing.contacts.source == "file"


def test_no_contacts_among_no_grains_are_an_empty_list(tmp_path):
    packing = series_of(tmp_path, [], local=local_text([]))
    assert len(packing) == len(packing.contacts) == 0


def test_a_wrong_id_among_right_ones_is_named(tmp_path):
    rows = [(k, 1, 0.1 * k, 0.5, 0.5, 0.06) for k in range(1, 9)]
    local = local_text([(1, 2, 0), (2, 3, 0), (3, 4, 0), (4, 99, 0)])
    with pytest.raises(ReadError, match=r"contact 4 names the grain 99.*same step"):
        series_of(tmp_path, rows, local=local)


def test_contacts_of_another_step_are_refused(tmp_path):
    with pytest.raises(ReadError, match=r"another step|same step"):
        series_of(tmp_path, ROWS, local=local_text([(101, 102, 0), (102, 103, 0)]))


def test_contacts_by_id_need_ids_in_the_grain_file(tmp_path):
    rows = [row[1:] for row in ROWS]
    with pytest.raises(ReadError, match="the grain file has no ids"):
        series_of(tmp_path, rows, names="type x y z radius", local=pairs_text())


def test_columns_that_could_be_either_are_asked_for(tmp_path):
    local = local_text([(1, 2, 0, 2, 3, 0), (2, 3, 0, 1, 2, 0)])
    with pytest.raises(ReadError, match=r"cannot tell which columns.*`contact_columns="):
        series_of(tmp_path, ROWS, local=local)


def test_history_may_have_any_number_of_values(tmp_path):
    grains = write(tmp_path / "dump_0.txt", dump_text())
    rows = [(one, two, 0, -1, 0, 0, 7, 7, 7, 7, 7, 0.5) for one, two in PAIRS]
    local = write(tmp_path / "pairs_0.txt", local_text(rows))
    packing = scanfab.read(grains, contacts=local, contact_columns="contactArea id force history:5")
    assert id_pairs(packing) == set(PAIRS)
    np.testing.assert_array_equal(packing.contacts.force, [[1, 0, 0], [1, 0, 0]])


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ("pos force", "id among them"),
        ("id forces", "expected keywords of compute pair/gran/local"),
        ("id force torque", "makes 9 columns, the file has 6"),
        ("id force history:2", "makes 8 columns, the file has 6"),
        ("", "id among them"),
    ],
)
def test_keywords_that_cannot_be_right_are_refused(tmp_path, keywords, message):
    grains = write(tmp_path / "dump_0.txt", dump_text())
    local = write(tmp_path / "pairs_0.txt", pairs_text())
    with pytest.raises(ReadError, match=f"`contact_columns.*{message}"):
        scanfab.read(grains, contacts=local, contact_columns=keywords)


@pytest.mark.parametrize("keywords", [None, "id force"])
def test_ids_that_were_rounded_are_refused_with_advice(tmp_path, keywords):
    # each rounded id is that of another grain
    first = 1234560
    rows = [(first + k, 1, 0.01 * k, 0.5, 0.5, 0.06) for k in range(30)]
    pairs = [(first + k, first + k + 9, 0, -1, 0, 0) for k in range(1, 19)]
    local = local_text([(f"{one:g}", f"{two:g}", *rest) for one, two, *rest in pairs])
    write(tmp_path / "dump_0.txt", dump_text(rows))
    contacts = write(tmp_path / "pairs_0.txt", local)
    with pytest.raises(ReadError, match=r"rounded to six digits.*%\.0f"):
        scanfab.read(tmp_path / "dump_0.txt", contacts=contacts, contact_columns=keywords)


def test_ids_that_were_rounded_are_named_even_if_no_grain_has_them(tmp_path):
    first = 1234561
    rows = [(first + k, 1, 0.1 * k, 0.5, 0.5, 0.06) for k in range(1, 9)]
    pairs = [(first + k, first + k + 1) for k in range(1, 8)]
    local = local_text([(f"{one:g}", f"{two:g}", 0, -1, 0, 0) for one, two in pairs])
    with pytest.raises(ReadError, match="rounded to six digits"):
        series_of(tmp_path, rows, local=local)


def test_a_million_is_not_rounded(tmp_path):
    # %g writes it as 1e+06, and loses nothing
    rows = [(id, *rest) for id, (_, *rest) in zip((999999, 1000000, 7), ROWS, strict=True)]
    packing = series_of(tmp_path, rows, local=local_text([(999999, "1e+06", 0), ("1e+06", 7, 0)]))
    assert id_pairs(packing) == {(999999, 1000000), (7, 1000000)}


def test_large_ids_with_all_digits_are_read(tmp_path):
    first = 1234560
    rows = [(first + k, 1, 0.1 * k, 0.5, 0.5, 0.06) for k in range(1, 9)]
    pairs = [(first + k, first + k + 1) for k in range(1, 8)]
    packing = series_of(tmp_path, rows, local=local_text([(*pair, 0) for pair in pairs]))
    assert id_pairs(packing) == set(pairs)


# files that hold neither grains nor contacts


@pytest.mark.parametrize(
    "name",
    [
        "mesh_30000.vtk",
        "decomposition_30000.vtk",
        "grains_boundingBox_30000.vtk",
        "grains_boundingBox_30000.vtr",
        "grains_binary_boundingBox_30000.vtk",
        "grains_binary_boundingBox_30000.vtr",
    ],
)
def test_walls_and_boxes_are_neither_grains_nor_contacts(name):
    reader = reader_for(FLOOR / name)
    assert reader.kind(FLOOR / name) == "other"
    with pytest.raises(ReadError, match="no grains: expected points with a radius"):
        scanfab.read(FLOOR / name)


def test_a_mesh_is_not_known():
    with pytest.raises(UnknownFormatError, match="no reader knows the format"):
        scanfab.read(FLOOR / "mesh_30000.stl")


def test_a_binary_dump_asks_for_the_names_of_its_columns():
    with pytest.raises(ReadError, match="does not name its 6 columns: name them"):
        scanfab.read(FLOOR / "binary_30000.bin")


def test_contacts_alone_are_no_grains():
    with pytest.raises(ReadError, match=r"no grains.*pairs_id_force.txt \(contacts\)"):
        scanfab.read(FLOOR / "pairs_id_force.txt")


@pytest.mark.parametrize("ending", [".vtk", ".vtr"])
@pytest.mark.parametrize("name", ["grains_30000.vtk", "grains_30000.vtp", "grains_30000.vtu"])
def test_the_box_beside_a_vtk_file_is_its_cell(tmp_path, name, ending):
    for file in (name, f"grains_boundingBox_30000{ending}"):
        (tmp_path / file).write_bytes((FLOOR / file).read_bytes())
    packing = scanfab.read(tmp_path / name, periodic="xy")
    np.testing.assert_allclose(np.diagonal(packing.cell.vectors), [0.014, 0.013, 0.04], rtol=1e-6)
    np.testing.assert_allclose(packing.cell.origin, [-0.005, 0, 0], atol=1e-9)
    assert packing.cell.periodic == (True, True, False)


def test_the_box_beside_a_vtk_file_does_not_make_it_periodic():
    assert scanfab.read(FLOOR / "grains_30000.vtk").cell.periodic == (False, False, False)


@pytest.mark.parametrize("ending", [".vtk", ".vtr"])
def test_the_box_in_a_folder_is_passed_over(tmp_path, ending):
    for file in ("grains_30000.vtk", f"grains_boundingBox_30000{ending}"):
        (tmp_path / file).write_bytes((FLOOR / file).read_bytes())
    with pytest.warns(scanfab.ScanfabNote, match="passed over"):
        (frame,) = scanfab.read_series(tmp_path, periodic="xy")
    assert_true_grains(frame.read(), FLOOR)


def test_wall_meshes_in_a_folder_are_passed_over(tmp_path):
    for file in ("grains_30000.vtk", "mesh_30000.vtk"):
        (tmp_path / file).write_bytes((FLOOR / file).read_bytes())
    with pytest.warns(scanfab.ScanfabNote, match="passed over"):
        (frame,) = scanfab.read_series(tmp_path)
    assert len(frame.read()) == 150


def test_the_pieces_of_a_vtm_file_are_read_by_themselves():
    folder = FLOOR / "vtm" / "all_30000"
    packing = scanfab.read(
        folder / "all_30000_1.vtu", contacts=folder / "all_30000_0.vtp", **FLOOR_CELL
    )
    assert_true_grains(packing, FLOOR)
    assert_true_contacts(packing, FLOOR)


def test_a_contact_across_a_face_without_a_cell_asks_for_it():
    with pytest.raises(scanfab.PackingError, match="name its cell \\(`cell` and `periodic`\\)"):
        scanfab.read(FLOOR / "grains_30000.vtk", contacts=FLOOR / VTK_CONTACTS[0])


def test_columns_of_any_compute_are_named(tmp_path):
    grains = write(tmp_path / "dump.0", dump_text())
    # a number, both ids apart, the force on the first grain; no periodic flag
    rows = [(0.5, first, 7, second, -1.5, 0, 2) for first, second in PAIRS]
    pairs = write(tmp_path / "pairs.0", local_text(rows))
    named = "id1=c_con[2],id2=c_con[4],fx=c_con[5],fy=c_con[6],fz=c_con[7]"
    packing = scanfab.read(grains, contacts=pairs, contact_columns=named)
    assert packing.contacts.pairs.tolist() == [[0, 1], [1, 2]]
    np.testing.assert_array_equal(packing.contacts.force, [[1.5, 0, -2]] * 2)
    with pytest.raises(ReadError, match=r"there is no column 'c_con\[9\]'"):
        scanfab.read(grains, contacts=pairs, contact_columns="id1=c_con[2],id2=c_con[9]")


def test_pairs_apart_are_left_out_of_named_columns(tmp_path):
    rows = [*ROWS[:2], (3, 2, 0.61, 0.5, 0.5, 0.1)]
    grains = write(tmp_path / "dump.0", dump_text(rows))
    pairs = write(tmp_path / "pairs.0", local_text([(*pair, 0.0) for pair in PAIRS]))
    named = "id1=c_con[1],id2=c_con[2]"
    packing = scanfab.read(grains, contacts=pairs, contact_columns=named)
    assert packing.contacts.pairs.tolist() == [[0, 1]]


@pytest.mark.filterwarnings("ignore:.*lists contacts with walls only")
def test_walls_are_known_whatever_the_columns_of_pairs_are_called():
    for named in ("pos id force", "id1=c_a[1],id2=c_a[2]"):
        packing = scanfab.read(
            FLOOR / "shuffled.txt", contacts=FLOOR / "walls_all.txt", contact_columns=named
        )
        plain = scanfab.read(FLOOR / "shuffled.txt", contacts=FLOOR / "walls_all.txt")
        assert packing.wall_contacts.sum() > 0
        np.testing.assert_array_equal(packing.wall_contacts, plain.wall_contacts)
