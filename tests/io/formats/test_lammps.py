"""LAMMPS' dumps: its own fabric of a tilted cell, contact columns, data files, bad input."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io.registry import reader_for
from tests.helpers.dumps import PAIRS, dump_text, local_text, write
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
    with pytest.warns(scanfab.ScanfabNote, match="passed over|skipped"):
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
def test_contacts_of_the_file_and_by_geometry_give_lammps_own_fabric(frames, number):
    packing = frames[number]
    found = scanfab.find_contacts(packing)
    for one in (packing, found):
        np.testing.assert_allclose(lammps_fabric(one), GOLDEN[number, 1:], atol=1e-12)
        ends = np.bincount(one.contacts.pairs.ravel(), minlength=len(packing))
        np.testing.assert_array_equal(ends, packing.columns["c_touch"])
    assert id_pairs(found) == id_pairs(packing)
    assert packing.contacts.image.any(axis=1).sum() > 200
    push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
    assert np.all(push > 0)


def test_forces_are_the_sum_of_both_parts():
    packing = scanfab.read(LAST, contacts=LAST_PAIRS, contact_columns=COLUMNS)
    first = unpacked(LAST_PAIRS).splitlines()[9].split()
    one, two, *values = map(float, [*first[1:3], *first[5:11]])
    row = np.flatnonzero((packing.id[packing.contacts.pairs] == [one, two]).all(axis=1))
    expected = -(np.array(values[:3]) + values[3:])
    np.testing.assert_allclose(packing.contacts.force[row], [expected])


@pytest.mark.parametrize(
    ("contacts", "columns"),
    [
        (LAST_PAIRS, None),
        # pairs that do not touch are left out
        (FORMS / "wide.local.gz", None),
        (FORMS / "wide.local.gz", "id1=c_wideids[1],id2=c_wideids[2]"),
    ],
)
def test_ids_are_found_without_being_named_and_forces_are_not(contacts, columns):
    named = scanfab.read(LAST, contacts=LAST_PAIRS, contact_columns=COLUMNS)
    packing = scanfab.read(LAST, contacts=contacts, contact_columns=columns)
    assert id_pairs(packing) == id_pairs(named)
    assert packing.contacts.force is None


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


def test_a_file_with_many_snapshots_is_a_series():
    packings = [frame.read() for frame in scanfab.read_series(FORMS / "multi.lammpstrj.gz")]
    assert [packing.step for packing in packings] == [0, 80000, 160000]
    single = scanfab.read(SHEAR / "shear.80000.lammpstrj.gz")
    assert id_pairs(scanfab.find_contacts(single)) == id_pairs(scanfab.find_contacts(packings[1]))


@pytest.mark.parametrize("path", [*sorted(SHEAR.glob("*.gz")), *sorted(FORMS.glob("*.gz"))])
def test_lammps_files_are_known_by_their_content(path):
    assert reader_for(path).name == "lammps"


@pytest.mark.parametrize(
    "path", [LAST, *(FLOOR / f"{n}.txt" for n in ("tutorial", "label", "multi"))]
)
def test_dumps_read_the_same_by_the_reader_of_either_program(path):
    assert reader_for(path).name == ("lammps" if path == LAST else "liggghts")
    # the reader of LIGGGHTS cannot read the contacts beside LAMMPS' grains
    one, two = (
        scanfab.read(path, format=name, contacts="geometric") for name in ("liggghts", "lammps")
    )
    np.testing.assert_array_equal(one.position, two.position)
    np.testing.assert_array_equal(one.radius, two.radius)
    np.testing.assert_array_equal(one.id, two.id)


def joined(tmp_path, rows, columns=None):
    grains = write(tmp_path / "g.dump", dump_text())
    pairs = write(tmp_path / "c.dump", local_text(rows))
    return scanfab.read(grains, contacts=pairs, contact_columns=columns, format="lammps")


def test_a_force_column_decides_which_pairs_touch(tmp_path):
    columns = "id1=c_con[1],id2=c_con[2],fx=c_con[3],fy=c_con[3],fz=c_con[3]"
    rows = [(1, 2, 0.5), (2, 3, 0.0), (1, 3, 0.0)]
    assert id_pairs(joined(tmp_path, rows, columns)) == {(1, 2)}
    assert len(joined(tmp_path, []).contacts) == 0


TWO = "id1=c_con[1],id2=c_con[2]"
TRIPLES = [(*pair, 1.5) for pair in PAIRS]


@pytest.mark.parametrize(
    ("rows", "columns", "told"),
    [
        *(
            (TRIPLES, columns, "expected id1=NAME,id2=NAME")
            for columns in (
                "id1=c_con[1]",
                f"{TWO},fx=c_con[3]",
                f"{TWO},tx=c_con[3],ty=c_con[3],tz=c_con[3]",
                f"{TWO},size=c_con[3]",
                "id1,id2",
                "",
            )
        ),
        (TRIPLES, "id1=c_no[1],id2=c_con[2]", r"found 'id1=c_no\[1\].* the columns are c_con\[1\]"),
        ([(1.5, 2), (2.5, 3)], TWO, "expected ids in the columns 1 and 2"),
        ([(1, 2), (2, 77)], TWO, "contact 2 names the grain 77, which is not in the grain"),
        *(
            (rows, None, "cannot tell which columns are the two ids")
            for rows in (
                [(1.5, 2.5), (2.5, 3.5)],  # no ids
                [(1, 2, 3), (2, 3, 1)],  # two choices
                [(1, 2)] * 5,  # types
                [(10, 20), (20, 30)],  # of other grains
            )
        ),
    ],
)
def test_contacts_that_cannot_be_told_are_asked_for(tmp_path, rows, columns, told):
    with pytest.raises(ReadError, match=told):
        joined(tmp_path, rows, columns)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("\n700\n", "\n701\n", "counts 701 rows, found 700"),
        ("\n700\n", "\n999999999999\n", "the header counts 999999999999 rows"),
        ("0.0013", "text", r"line \d+: expected a number .* found 'text'"),
        ("0.0013", "nan", "position and radius must be finite numbers"),
        ("0.0013", "-1", "the radius must be larger than zero"),
    ],
)
def test_what_is_wrong_with_a_dump(tmp_path, old, new, told):
    text = unpacked(LAST)
    assert old in text
    path = write(tmp_path / "bad.lammpstrj", text.replace(old, new, 1))
    with pytest.raises(scanfab.ScanfabError, match=told):
        scanfab.read(path)


@pytest.mark.parametrize("part", [0.001, 0.01, 0.5, 0.99])
def test_a_truncated_dump_is_an_error(tmp_path, part):
    text = unpacked(LAST)
    with pytest.raises(scanfab.ScanfabError):
        scanfab.read(write(tmp_path / "a", text[: int(part * len(text))]), format="lammps")
