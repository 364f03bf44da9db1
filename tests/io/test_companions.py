"""Companion files: no step, how many grains and contacts there must be, and whose they are."""

from __future__ import annotations

import re

import numpy as np
import pytest

import scanfab
from scanfab.io.writer import installed_writers
from scanfab.testing import differences, made_up_packings
from tests.helpers.dumps import dump_text, write

ENDINGS = {name: one.plugin.extensions[0] for name, one in installed_writers().items()}
# the formats that hold everything
ALONE = ("npz", "vtp", "on-dem")
PACKINGS = made_up_packings()
EVERYTHING, PLAIN = PACKINGS["everything"], PACKINGS["plain"]
COUNT = len(EVERYTHING.contacts)
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")


def written(packing, folder, name, stem="a"):
    (path,) = scanfab.convert(packing, folder / f"{stem}{ENDINGS[name]}", to=name)
    return path


def without_last_row(path):
    path.write_bytes(path.read_bytes().rstrip(b"\n").rpartition(b"\n")[0] + b"\n")


@pytest.mark.parametrize("stem", ["frame_10", "dump.100"])
@pytest.mark.parametrize("name", ENDINGS)
def test_a_number_in_the_name_of_a_packing_without_a_step_is_none(tmp_path, name, stem):
    for packing in (PLAIN, PACKINGS["a turned cell"]):
        path = written(packing, tmp_path, name, stem)
        assert differences(packing, scanfab.read(path)) == []
        assert [frame.step for frame in scanfab.read_series(path)] == [None]
    if name in ALONE:
        # it may be called anything, as it holds everything
        (file,) = tmp_path.iterdir()
        assert scanfab.read(file.rename(tmp_path / f"sample_7{path.suffix}")).step is None


@pytest.mark.parametrize("name", ENDINGS)
def test_a_series_without_steps_stays_one_in_its_order(tmp_path, name):
    packings = [PACKINGS["normal forces"], PACKINGS["no contacts"]] * 6
    scanfab.convert(packings, tmp_path / "out", to=name)
    for one, two in zip(packings, scanfab.read_series(tmp_path / "out"), strict=True):
        assert (two.step, differences(one, two.read())) == (None, [])


@pytest.mark.parametrize("name", [name for name in ENDINGS if name not in ALONE])
def test_contacts_that_were_cut_or_left_behind_are_an_error(tmp_path, name):
    path, file = written(EVERYTHING, tmp_path, name), tmp_path / "a.contacts.csv"
    without_last_row(file)
    words = rf"a\.contacts\.csv: holds {COUNT - 1} contacts, expected {COUNT} by a\.frame\.csv"
    for contacts in ("auto", "file", file):
        with pytest.raises(scanfab.ReadError, match=words):
            scanfab.read(path, contacts=contacts)
    file.write_bytes(b"")
    for found in ("an empty file", "no such file"):
        for source in (path, tmp_path):
            with pytest.raises(scanfab.ReadError, match=rf"contacts of {path.name}, found {found}"):
                scanfab.read(source)
            assert scanfab.read(source, contacts="geometric").contacts is None
        file.unlink(missing_ok=True)


@pytest.mark.parametrize("packing", ["a turned cell", "plain"])
def test_grains_cut_behind_a_line_are_an_error_unless_the_user_says_so(tmp_path, packing):
    path, frame = written(PACKINGS[packing], tmp_path, "csv"), tmp_path / "a.frame.csv"
    without_last_row(path)
    with pytest.raises(scanfab.ReadError, match=r"holds 39 grains, expected 40 by a\.frame\.csv"):
        scanfab.read(path)
    frame.write_text(frame.read_text().replace(",40,", ",,"))
    assert len(scanfab.read(path)) == 39


@pytest.mark.parametrize("suffix", ["contacts", "frame", "columns"])
@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.95])
def test_a_companion_file_is_read_whole_or_not_at_all(tmp_path, suffix, share):
    path = written(EVERYTHING, tmp_path, "lammps-data")
    file = tmp_path / f"a.{suffix}.csv"
    data = file.read_bytes()
    head = len(data.partition(b"\n")[0])
    # of a first line, as much as tells whose it is
    file.write_bytes(data[: max(int(share * len(data)), head if suffix == "contacts" else 15)])
    with pytest.raises(scanfab.ScanfabError, match=file.name):
        scanfab.read(path)


@pytest.mark.parametrize(
    ("kind", "old", "new", "words"),
    [
        ("contacts", "0,0,0,", ",0,0,", "incomplete"),
        ("contacts", "0,0,0,", "0.5,0,0,", "whole numbers"),
        ("contacts", "0,0,0,", "x,0,0,", "other words"),
        ("contacts", "0,0,0,", "0,0,0,0,", "cannot be read"),
        ("frame", ",xy,", ",xq,", "expected the line"),
        ("frame", ",xy,", ",", "expected the line"),
        ("frame", ",1.1,", ",,", "ax"),
        ("frame", ",1.1,", ",soon,", "soon"),
        ("frame", ",1.1,", ",0.0,", "no volume"),
        ("columns", "a b", "", "incomplete"),
        ("columns", "scanfab_id,.*\n[0-9]+", "scanfab_id,w\n7", r"other grains than a\.xyz"),
    ],
)
def test_a_damaged_word_is_an_error(tmp_path, kind, old, new, words):
    path, file = written(EVERYTHING, tmp_path, "xyz"), tmp_path / f"a.{kind}.csv"
    file.write_text(re.sub(old, new, file.read_text(), count=1))
    with pytest.raises(scanfab.ReadError, match=rf"a\.{kind}\.csv: .*{words}"):
        scanfab.read(path)


@pytest.mark.filterwarnings("ignore:.*no contact file for step 1 among")
def test_contacts_of_one_frame_of_a_series_that_are_lost_are_an_error_of_that_frame(tmp_path):
    scanfab.convert([EVERYTHING, PACKINGS["normal forces"]], tmp_path / "g-{step}.csv")
    (tmp_path / "g-1.contacts.csv").unlink()
    first, second = scanfab.read_series(tmp_path)
    with pytest.raises(scanfab.ReadError, match=r"of g-1\.csv, found no such file"):
        first.read()
    assert second.read().step == EVERYTHING.step


def test_contacts_of_0_bytes_are_an_error_beside_any_file(tmp_path):
    write(tmp_path / "a.contacts.csv", "")
    with pytest.raises(scanfab.ReadError, match=r"expected the contacts of a\.dump"):
        scanfab.read(write(tmp_path / "a.dump", dump_text()))


def test_companions_of_an_earlier_packing_go_and_those_of_other_files_stay(tmp_path):
    written(EVERYTHING, tmp_path, "csv")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    for name in ("npz", "xyz", "tsv"):
        with pytest.raises(scanfab.SettingsError, match=r"a\.contacts\.csv .* belong to a\.csv"):
            written(PLAIN, tmp_path, name)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
    written(PLAIN, tmp_path, "csv")
    assert {file.name for file in tmp_path.iterdir()} == {"a.csv", "a.frame.csv"}
    (tmp_path / "a.contacts.csv").write_text("mine\n1\n")
    assert differences(PLAIN, scanfab.read(written(PLAIN, tmp_path, "csv"))) == []
    assert (tmp_path / "a.contacts.csv").read_text() == "mine\n1\n"


@pytest.mark.parametrize("count", [0, 1, None])
@pytest.mark.parametrize(
    "names",
    [
        ["run1_700.data", "run2_700.xyz"],
        # the number of the second run is the step of the first
        ["run1_2.data", "run2_2.xyz", "run3_2.csv"],
        ["a.data", "a_fine.xyz"],
    ],
)
def test_each_file_finds_its_own_contacts_whatever_lies_beside(tmp_path, names, count):
    pairs = [np.array([[0, 1 + k]])[:count].reshape(-1, 2) for k in range(len(names))]
    if count is None:
        pairs[0] = None
    for name, one in zip(names, pairs, strict=True):
        scanfab.convert(scanfab.Packing(np.eye(4, 3), 1.0, contacts=one), tmp_path / name)
    for name, one in zip(names, pairs, strict=True):
        found = scanfab.read(tmp_path / name).contacts
        np.testing.assert_array_equal(None if found is None else found.pairs, one)
    # a name without an ending finds none
    path = write(tmp_path / "grains", (tmp_path / names[0]).read_text())
    assert scanfab.read(path).contacts is None
