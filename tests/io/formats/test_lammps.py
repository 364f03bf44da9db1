"""LAMMPS' dumps: its own fabric of a tilted cell, contact columns, data files, bad input."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io.registry import reader_for
from tests.helpers.dumps import PAIRS, ROWS, dump_text, local_text, write
from tests.helpers.truth import FLOOR, SHEAR, id_pairs, lammps_fabric

FORMS = SHEAR / "forms"
COLUMNS = (
    "id1=c_ids[1],id2=c_ids[2],fx=c_pair[3],fy=c_pair[4],fz=c_pair[5],"
    "tx=c_pair[6],ty=c_pair[7],tz=c_pair[8]"
)
LAST = SHEAR / "shear.200000.lammpstrj.gz"
LAST_PAIRS = SHEAR / "pairs.200000.local.gz"
# LAMMPS computed its fabric in the state that is dumped, with 15 digits
GOLDEN = np.loadtxt(SHEAR / "fabric.txt")


def unpacked(path):
    return gzip.decompress(path.read_bytes()).decode()


@pytest.fixture(scope="module")
def frames():
    with pytest.warns(scanfab.ScanfabNote, match="passed over"):
        series = scanfab.read_series(SHEAR, contact_columns=COLUMNS)
    return [frame.read() for frame in series]


def test_frames_have_steps_times_and_tilts(frames):
    assert [packing.step for packing in frames] == [0, 40000, 80000, 120000, 160000, 200000]
    np.testing.assert_allclose([packing.time for packing in frames], 0.44 + 0.4 * np.arange(6))
    tilt = [packing.cell.vectors[1, 0] / packing.cell.vectors[0, 0] for packing in frames]
    assert tilt[0] == 0
    assert tilt[-1] > 1
    assert all(packing.cell.periodic == (True, True, True) for packing in frames)


@pytest.mark.parametrize("number", range(6))
def test_contacts_of_the_file_give_lammps_own_fabric(frames, number):
    np.testing.assert_allclose(lammps_fabric(frames[number]), GOLDEN[number, 1:], atol=1e-12)


@pytest.mark.parametrize("number", range(6))
def test_contacts_by_geometry_give_lammps_own_fabric(frames, number):
    found = scanfab.find_contacts(frames[number])
    np.testing.assert_allclose(lammps_fabric(found), GOLDEN[number, 1:], atol=1e-12)


@pytest.mark.parametrize("number", range(6))
def test_each_grain_has_as_many_contacts_as_lammps_counts(frames, number):
    packing = frames[number]
    for one in (packing, scanfab.find_contacts(packing)):
        ends = np.bincount(one.contacts.pairs.ravel(), minlength=len(packing))
        np.testing.assert_array_equal(ends, packing.columns["c_touch"])


def test_geometry_finds_the_images_that_the_list_means(frames):
    for packing in frames:
        found = scanfab.find_contacts(packing)
        assert id_pairs(found) == id_pairs(packing)
        assert packing.contacts.image.any(axis=1).sum() > 200


def test_the_force_acts_on_the_second_grain(frames):
    for packing in frames:
        push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
        assert np.all(push > 0)


def test_forces_are_the_sum_of_both_parts():
    packing = scanfab.read(LAST, contacts=LAST_PAIRS, contact_columns=COLUMNS)
    first = unpacked(LAST_PAIRS).splitlines()[9].split()
    one, two, *values = map(float, [*first[1:3], *first[5:11]])
    row = np.flatnonzero((packing.id[packing.contacts.pairs] == [one, two]).all(axis=1))
    expected = -(np.array(values[:3]) + values[3:])
    np.testing.assert_allclose(packing.contacts.force[row], [expected])


def test_ids_are_found_without_being_named_and_forces_are_not():
    packing = scanfab.read(LAST, contacts=LAST_PAIRS)
    named = scanfab.read(LAST, contacts=LAST_PAIRS, contact_columns=COLUMNS)
    assert id_pairs(packing) == id_pairs(named)
    assert packing.contacts.force is None


@pytest.mark.parametrize("columns", [None, "id1=c_wideids[1],id2=c_wideids[2]"])
def test_pairs_that_do_not_touch_are_left_out(columns):
    wide = scanfab.read(LAST, contacts=FORMS / "wide.local.gz", contact_columns=columns)
    assert id_pairs(wide) == id_pairs(scanfab.read(LAST, contacts=LAST_PAIRS))


def test_a_force_column_decides_which_pairs_touch(tmp_path):
    rows = [(1, 2, 0.5), (2, 3, 0.0), (1, 3, 0.0)]
    grains = write(tmp_path / "g.dump", dump_text())
    pairs = write(tmp_path / "c.dump", local_text(rows))
    columns = "id1=c_con[1],id2=c_con[2],fx=c_con[3],fy=c_con[3],fz=c_con[3]"
    packing = scanfab.read(grains, contacts=pairs, contact_columns=columns, format="lammps")
    assert id_pairs(packing) == {(1, 2)}


def test_the_same_lattice_by_another_vector_has_the_same_contacts():
    last = scanfab.find_contacts(scanfab.read(LAST))
    flipped = scanfab.find_contacts(scanfab.read(FORMS / "flipped.lammpstrj.gz"))
    assert flipped.cell.vectors[1, 0] < 0.1 * flipped.cell.vectors[0, 0]
    assert id_pairs(flipped) == id_pairs(last)
    np.testing.assert_allclose(lammps_fabric(flipped), lammps_fabric(last), atol=1e-10)


@pytest.mark.parametrize("name", ["scaled.lammpstrj.gz", "shear.data.gz"])
def test_other_forms_hold_the_same_grains(name):
    last = scanfab.read(LAST)
    other = scanfab.read(FORMS / name, periodic="xyz")
    assert other.step == 200000
    order, others = np.argsort(last.id), np.argsort(other.id)
    np.testing.assert_array_equal(last.radius[order], other.radius[others])
    np.testing.assert_allclose(other.cell.vectors, last.cell.vectors, rtol=1e-12, atol=1e-15)
    away = other.position[others] - last.position[order]
    away = away + last.cell.nearest_image(away) @ last.cell.vectors
    np.testing.assert_allclose(away, 0, atol=1e-15)


def test_a_data_file_has_no_boundary_flags():
    assert scanfab.read(FORMS / "shear.data.gz").cell.periodic == (False, False, False)


def test_a_file_with_many_snapshots_is_a_series():
    series = list(scanfab.read_series(FORMS / "multi.lammpstrj.gz"))
    packings = [frame.read() for frame in series]
    assert [packing.step for packing in packings] == [0, 80000, 160000]
    single = scanfab.read(SHEAR / "shear.80000.lammpstrj.gz")
    order, others = np.argsort(single.id), np.argsort(packings[1].id)
    np.testing.assert_array_equal(single.radius[order], packings[1].radius[others])
    assert id_pairs(scanfab.find_contacts(single)) == id_pairs(scanfab.find_contacts(packings[1]))


@pytest.mark.parametrize("path", [*sorted(SHEAR.glob("*.gz")), *sorted(FORMS.glob("*.gz"))])
def test_lammps_files_are_known_by_their_content(path):
    assert reader_for(path).name == "lammps"


@pytest.mark.parametrize("name", ["tutorial.txt", "precise.txt", "label.txt", "multi.txt"])
def test_dumps_of_liggghts_stay_its_own_and_read_the_same(name):
    assert reader_for(FLOOR / name).name == "liggghts"
    one, two = (scanfab.read(FLOOR / name, format=f) for f in ("liggghts", "lammps"))
    np.testing.assert_array_equal(one.position, two.position)
    np.testing.assert_array_equal(one.radius, two.radius)
    np.testing.assert_array_equal(one.id, two.id)


@pytest.mark.parametrize("format", ["lammps", "liggghts"])
def test_lammps_grains_read_the_same_either_way(format):
    # a reader of LIGGGHTS' dumps cannot read the contacts beside them
    packing = scanfab.read(LAST, format=format, contacts="geometric")
    np.testing.assert_array_equal(packing.position, scanfab.read(LAST).position)


def test_a_general_triclinic_header(tmp_path):
    box = ((1, 0.5, 0, -1), (-0.25, 1, 0, 2), (0, 0.125, 1, 3))
    text = dump_text([(1, 1, -1, 2, 3, 0.1)], flags=" abc origin pp pp ff", box=box)
    path = write(tmp_path / "general.dump", text)
    cell = scanfab.read(path).cell
    np.testing.assert_array_equal(cell.vectors, np.array(box)[:, :3])
    np.testing.assert_array_equal(cell.origin, [-1, 2, 3])
    assert cell.periodic == (True, True, False)
    assert reader_for(path).name == "lammps"


@pytest.mark.parametrize(
    "rows", ["1 0 0\n0 1 0\n0 0 1\n", "1 0 0 0\n0 1 0 0\n0 zero 1 0\n", "1 0 0 0\n0 1 0 0\n"]
)
def test_a_wrong_general_header_is_an_error(tmp_path, rows):
    head = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS abc origin pp pp pp\n"
    path = write(tmp_path / "a.dump", head + rows + "ITEM: ATOMS id x y z radius\n1 0 0 0 1\n")
    with pytest.raises(ReadError, match="expected three lines of 4 numbers"):
        scanfab.read(path)


@pytest.mark.parametrize(
    "columns",
    [
        "pos id force",
        "id1=c_con[1]",
        "id1=c_con[1],id2=c_con[2],fx=c_con[3]",
        "id1=c_con[1],id2=c_con[2],tx=c_con[3],ty=c_con[3],tz=c_con[3]",
        "id1=c_con[1],id2=c_con[2],size=c_con[3]",
        "id1,id2",
        "",
    ],
)
def test_wrong_contact_columns_say_what_is_expected(tmp_path, columns):
    grains = write(tmp_path / "g.dump", dump_text())
    pairs = write(tmp_path / "c.dump", local_text([(*pair, 1.5) for pair in PAIRS]))
    with pytest.raises(ReadError, match=r"expected id1=NAME,id2=NAME"):
        scanfab.read(grains, contacts=pairs, contact_columns=columns, format="lammps")


def test_a_contact_column_that_is_not_there(tmp_path):
    grains = write(tmp_path / "g.dump", dump_text())
    pairs = write(tmp_path / "c.dump", local_text([(*pair, 1.5) for pair in PAIRS]))
    with pytest.raises(ReadError, match=r"no column 'c_no\[1\]'; the columns are c_con\[1\]"):
        scanfab.read(
            grains, contacts=pairs, contact_columns="id1=c_no[1],id2=c_con[2]", format="lammps"
        )


@pytest.mark.parametrize(
    "rows",
    [
        [(1.5, 2.5), (2.5, 3.5)],  # no ids
        [(1, 2, 3), (2, 3, 1)],  # two choices
        [(1, 2), (1, 2), (1, 2), (1, 2), (1, 2)],  # types
        [(10, 20), (20, 30)],  # of other grains
    ],
)
def test_ids_that_are_in_doubt_are_asked_for(tmp_path, rows):
    grains = write(tmp_path / "g.dump", dump_text())
    pairs = write(tmp_path / "c.dump", local_text(rows))
    with pytest.raises(ReadError, match="cannot tell which columns are the two ids"):
        scanfab.read(grains, contacts=pairs, format="lammps")


def test_ids_of_other_grains_are_named(tmp_path):
    grains = write(tmp_path / "g.dump", dump_text())
    pairs = write(tmp_path / "c.dump", local_text([(1, 2), (2, 77)]))
    with pytest.raises(ReadError, match="contact 2 names the grain 77, which is not in the grain"):
        scanfab.read(
            grains, contacts=pairs, contact_columns="id1=c_con[1],id2=c_con[2]", format="lammps"
        )


def test_without_pairs_there_are_no_contacts(tmp_path):
    grains = write(tmp_path / "g.dump", dump_text())
    pairs = write(tmp_path / "c.dump", local_text([]))
    assert len(scanfab.read(grains, contacts=pairs, format="lammps").contacts) == 0


DATA = """LAMMPS data file via write_data, version 2 Aug 2023, timestep = 12

3 atoms
2 atom types

0 1 xlo xhi
0 2 ylo yhi
-1 3 zlo zhi
0.5 0 0.25 xy xz yz

Atoms # sphere

""" + "".join(f"{i} {t} {2 * r} 2500 {x} {y} {z} 0 0 0\n" for i, t, x, y, z, r in ROWS)
VELOCITIES = "\nVelocities\n\n1 9 9 9 9 9 9\n2 9 9 9 9 9 9\n3 9 9 9 9 9 9\n"


@pytest.mark.parametrize("end", ["", VELOCITIES])
def test_a_data_file_is_its_atoms(tmp_path, end):
    packing = scanfab.read(write(tmp_path / "a.data", DATA + end))
    assert packing.step == 12
    np.testing.assert_array_equal(packing.position, np.array(ROWS)[:, 2:5])
    np.testing.assert_array_equal(packing.radius, np.array(ROWS)[:, 5])
    np.testing.assert_array_equal(packing.id, [1, 2, 3])
    np.testing.assert_array_equal(packing.columns["type"], [1, 1, 2])
    np.testing.assert_array_equal(packing.cell.vectors, [[1, 0, 0], [0.5, 2, 0], [0, 0.25, 4]])
    np.testing.assert_array_equal(packing.cell.origin, [0, 0, -1])


def test_a_data_file_with_three_vectors(tmp_path):
    box = DATA[DATA.index("0 1 xlo") : DATA.index("Atoms")]
    vectors = "1 0.5 0 avec\n0 2 0 bvec\n0 0 4 cvec\n0 0 -1 abc origin\n\n"
    packing = scanfab.read(write(tmp_path / "a.data", DATA.replace(box, vectors)))
    np.testing.assert_array_equal(packing.cell.vectors, [[1, 0.5, 0], [0, 2, 0], [0, 0, 4]])
    np.testing.assert_array_equal(packing.cell.origin, [0, 0, -1])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Atoms # sphere", "Atoms # full", "expected 'Atoms # sphere'.*found 'Atoms # full'"),
        ("Atoms # sphere", "Masses", "expected a section Atoms, found none"),
        ("3 atoms\n", "4 atoms\n", "counts 4 atoms, found 3"),
        ("3 atoms\n", "999999999999 atoms\n", "counts 999999999999 atoms, found 3"),
        ("3 atoms\n", "", "expected a line 'N atoms'"),
        ("xlo xhi", "xlo", "expected the box in the header"),
        ("0 1 xlo", "0 xlo", "expected the box in the header"),
        ("2 1 0.2", "2 1 word", "line 14: expected a number .* found 'word'"),
        ("2 1 0.2 2500", "2 1 0.2", "line 14: expected 10 columns, found 9"),
        ("2 1 0.2", "2 1 nan", "grain 2: position and radius must be finite"),
    ],
)
def test_what_is_wrong_with_a_data_file(tmp_path, old, new, message):
    assert old in DATA
    path = write(tmp_path / "a.data", DATA.replace(old, new))
    with pytest.raises(scanfab.ScanfabError, match=message):
        scanfab.read(path)


def test_a_data_file_holds_no_contacts(tmp_path):
    path = write(tmp_path / "a.data", DATA)
    with pytest.raises(ReadError, match="expected contacts, found grains"):
        scanfab.read(LAST, contacts=path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "\n700\n",
            "\n701\n",
            "the header counts 701 rows, but the file ends after 700 complete lines",
        ),
        ("\n700\n", "\n999999999999\n", "the header counts 999999999999 rows"),
        ("0.0013", "text", r"line \d+: expected a number .* found 'text'"),
        ("0.0013", "nan", "position and radius must be finite numbers"),
        ("0.0013", "-1", "the radius must be larger than zero"),
        ("ITEM: TIMESTEP\n200000", "ITEM: TIMESTEP\nsoon", "expected a whole number after ITEM"),
    ],
)
def test_what_is_wrong_with_a_dump(tmp_path, old, new, message):
    text = unpacked(LAST)
    assert old in text
    path = write(tmp_path / "bad.lammpstrj", text.replace(old, new, 1))
    with pytest.raises(scanfab.ScanfabError, match=message):
        scanfab.read(path)


@pytest.mark.parametrize("part", [0.001, 0.01, 0.5, 0.99])
def test_a_truncated_dump_is_an_error(tmp_path, part):
    data = unpacked(LAST).encode()
    path = tmp_path / "cut.lammpstrj"
    path.write_bytes(data[: int(part * len(data))])
    with pytest.raises(scanfab.ScanfabError):
        scanfab.read(path, format="lammps")


def test_a_header_of_many_digits_is_read_at_once(tmp_path):
    """Its lines once took longer by a factor of two for each digit."""
    path = tmp_path / "grains.data"
    head = "LAMMPS data file via write_data\n\n1 atoms\n"
    path.write_text(f"{head}0 {'9' * 4000}\n\nAtoms # sphere\n\n")
    with pytest.raises(ReadError):
        scanfab.read(path)
