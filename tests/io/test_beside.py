"""What lies beside a file of grains: no step, and how many grains and contacts there must be."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.io.writers.registry import installed_writers
from scanfab.testing import differences, made_up_packings
from tests.helpers.dumps import dump_text, write

WRITERS = {name: one.plugin for name, one in installed_writers().items()}
# those whose contacts lie beside
BESIDE = ("csv", "tsv", "parquet", "xyz", "lammps", "lammps-data")
# those that do not count their rows
UNCOUNTED = ("csv", "tsv")
PACKINGS = made_up_packings()
NO_COUNT = "step,time,ax,ay,az,bx,by,bz,cx,cy,cz,ox,oy,oz,periodic\n"
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")


def written(packing, folder, name, stem="a"):
    (path,) = scanfab.convert(packing, folder / f"{stem}{WRITERS[name].extensions[0]}", to=name)
    return path


def without_last_row(path):
    path.write_bytes(path.read_bytes().rstrip(b"\n").rpartition(b"\n")[0] + b"\n")


@pytest.mark.parametrize("stem", ["frame_10", "n7", "dump.100"])
@pytest.mark.parametrize("name", WRITERS)
def test_a_number_in_the_name_of_a_packing_without_a_step_is_none(tmp_path, name, stem):
    for packing in (PACKINGS["plain"], PACKINGS["a turned cell"]):
        assert packing.step is None
        path = written(packing, tmp_path, name, stem)
        assert differences(packing, scanfab.read(path)) == []
        assert [frame.step for frame in scanfab.read_series(path)] == [None]


@pytest.mark.parametrize("name", WRITERS)
def test_a_series_without_steps_stays_one_in_its_order(tmp_path, name):
    normal, plain = PACKINGS["normal forces"], PACKINGS["no contacts"]
    packings = [normal, plain] * 6
    scanfab.convert(packings, tmp_path / "out", to=name)
    again = scanfab.read_series(tmp_path / "out")
    assert [frame.step for frame in again] == [None] * 12
    for one, two in zip(packings, again, strict=True):
        assert differences(one, two.read()) == []


@pytest.mark.parametrize("name", ["npz", "vtp", "on-dem"])
def test_a_file_that_holds_everything_may_be_called_anything(tmp_path, name):
    path = written(PACKINGS["plain"], tmp_path, name)
    moved = path.rename(tmp_path / f"sample_7{path.suffix}")
    assert [one.name for one in tmp_path.iterdir()] == [moved.name]
    assert scanfab.read(moved).step is None


def test_the_step_of_other_files_is_still_the_number_in_their_names(tmp_path):
    path = tmp_path / "frame_10.csv"
    path.write_text("x,y,z,radius\n0,0,0,1\n2,0,0,1\n")
    assert scanfab.read(path).step == 10


@pytest.mark.parametrize("name", BESIDE)
def test_contacts_cut_behind_a_line_are_an_error(tmp_path, name):
    path = written(PACKINGS["everything"], tmp_path, name)
    without_last_row(tmp_path / "a.contacts.csv")
    count = len(PACKINGS["everything"].contacts)
    words = rf"a\.contacts\.csv: holds {count - 1} contacts, expected {count} by a\.frame\.csv"
    for contacts in ("auto", "file", tmp_path / "a.contacts.csv"):
        with pytest.raises(scanfab.ReadError, match=words):
            scanfab.read(path, contacts=contacts)
    assert scanfab.read(path, contacts="geometric").contacts is None


@pytest.mark.parametrize("name", UNCOUNTED)
def test_grains_cut_behind_a_line_are_an_error(tmp_path, name):
    path = written(PACKINGS["a turned cell"], tmp_path, name)
    without_last_row(path)
    with pytest.raises(scanfab.ReadError, match=r"holds 39 grains, expected 40 by a\.frame\.csv"):
        scanfab.read(path)


@pytest.mark.parametrize("contacts", ["auto", "folder"])
@pytest.mark.parametrize("name", BESIDE)
def test_contacts_that_were_left_behind_are_an_error(tmp_path, name, contacts):
    path = written(PACKINGS["everything"], tmp_path, name)
    source = tmp_path if contacts == "folder" else path
    file = tmp_path / "a.contacts.csv"
    for found in ("an empty file", "no such file"):
        file.write_bytes(b"") if found == "an empty file" else file.unlink()
        with pytest.raises(scanfab.ReadError, match=rf"contacts of {path.name}, found {found}"):
            scanfab.read(source)
        assert scanfab.read(source, contacts="geometric").contacts is None


@pytest.mark.filterwarnings("ignore:.*no contact file for frame 0 among")
def test_contacts_of_one_frame_of_a_series_that_are_lost_are_an_error_of_that_frame(tmp_path):
    packings = [PACKINGS["everything"], PACKINGS["normal forces"]]
    scanfab.convert(packings, tmp_path / "g-{step}.csv")
    file = tmp_path / "g-1.contacts.csv"
    for words in (r"g-1\.contacts\.csv: expected one of the line", "of g-1.csv, found no such"):
        file.write_bytes(b"") if "line" in words else file.unlink()
        first, second = scanfab.read_series(tmp_path)
        with pytest.raises(scanfab.ReadError, match=words):
            first.read()
        assert second.read().step == PACKINGS["everything"].step


def test_of_contacts_known_to_be_none_the_file_must_be_there_too(tmp_path):
    path = written(PACKINGS["no contacts"], tmp_path, "csv")
    (tmp_path / "a.contacts.csv").unlink()
    with pytest.raises(scanfab.ReadError, match=r"expected the 0 contacts of a\.csv"):
        scanfab.read(path)


def test_files_of_earlier_versions_have_no_counts_and_are_read(tmp_path):
    packing = PACKINGS["everything"]
    path = written(packing, tmp_path, "xyz")
    (tmp_path / "a.frame.csv").unlink()
    assert differences(packing, scanfab.read(path)) == []
    path = written(packing, tmp_path, "csv", "b")
    frame = tmp_path / "b.frame.csv"
    row = frame.read_text().splitlines()[1]
    frame.write_text(NO_COUNT + ",".join(row.split(",")[:-2]) + "\n")
    assert differences(packing, scanfab.read(path)) == []
    without_last_row(tmp_path / "b.contacts.csv")
    assert len(scanfab.read(path).contacts) == len(packing.contacts) - 1


@pytest.mark.parametrize("source", ["csv", "dump"])
def test_contacts_of_0_bytes_are_an_error_in_any_case(tmp_path, source):
    path = written(PACKINGS["plain"], tmp_path, "csv")
    if source == "dump":
        path = write(tmp_path / "a.dump", dump_text())
    (tmp_path / "a.contacts.csv").write_bytes(b"")
    with pytest.raises(scanfab.ReadError, match=r"a\.contacts\.csv: expected the contacts of a\."):
        scanfab.read(path)


def test_rows_that_users_take_out_are_theirs_to_tell(tmp_path):
    path = written(PACKINGS["a turned cell"], tmp_path, "csv")
    without_last_row(path)
    frame = tmp_path / "a.frame.csv"
    frame.write_text(frame.read_text().replace(",40,", ",,"))
    assert len(scanfab.read(path)) == 39


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.parametrize(
    "names",
    [
        ["run1_700.data", "run2_700.xyz"],
        # the number of the second run is the step of the first
        ["run1_2.data", "run2_2.xyz", "run3_2.csv"],
        ["g0_700.xyz", "g1_700.csv"],
        ["a.data", "a_fine.xyz"],
    ],
)
def test_each_file_finds_its_own_contacts_whatever_lies_beside(tmp_path, names, count):
    pairs = [np.array([[0, 1 + k]])[:count].reshape(-1, 2) for k in range(len(names))]
    packings = [scanfab.Packing(np.eye(4, 3), 1.0, contacts=one) for one in pairs]
    for name, packing in zip(names, packings, strict=True):
        scanfab.convert(packing, tmp_path / name)
    for name, packing in zip(names, packings, strict=True):
        again = scanfab.read(tmp_path / name)
        np.testing.assert_array_equal(again.contacts.pairs, packing.contacts.pairs)
    path = write(tmp_path / "grains", (tmp_path / names[0]).read_text())
    assert scanfab.read(path).contacts is None


def test_contacts_of_another_file_are_not_taken_for_its_own(tmp_path):
    contacts_of = {"run1_2.data": None, "run2_2.xyz": [[0, 1]], "run3_2.csv": [[1, 2]]}
    for name, contacts in contacts_of.items():
        scanfab.convert(scanfab.Packing(np.eye(3), 1.0, contacts=contacts), tmp_path / name)
    assert scanfab.read(tmp_path / "run1_2.data").contacts is None
