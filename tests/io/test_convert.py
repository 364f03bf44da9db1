"""convert and companion files: nothing is lost through any format, nothing is half written."""

import os
import re
import signal
import subprocess
import warnings
from itertools import repeat
from pathlib import Path
from shutil import which

import numpy as np
import pytest
import pyvista
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, SettingsError, UnknownFormatError
from scanfab.io.writer import installed_writers
from scanfab.testing import differences, made_up_packings
from tests.helpers.dumps import dump_text, holds, pairs_text, refuses, write

ENDINGS = {name: one.plugin.extensions[0] for name, one in installed_writers().items()}
# the formats that hold everything
ALONE = ("npz", "vtp", "on-dem")
PACKINGS = made_up_packings()
EVERYTHING, PLAIN = PACKINGS["everything"], PACKINGS["plain"]
COUNT = len(EVERYTHING.contacts)
# what a cut leaves of each companion file, of a first line as much as tells whose it is
CUTS = (("contacts", 100), ("contacts", 4000), ("frame", 15), ("frame", 150), ("columns", 300))
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


@pytest.mark.parametrize("name", [name for name in ENDINGS if name not in ALONE])
def test_contacts_that_were_cut_or_left_behind_are_an_error(tmp_path, name):
    path, file = written(EVERYTHING, tmp_path, name), tmp_path / "a.contacts.csv"
    without_last_row(file)
    words = rf"a\.contacts\.csv: holds {COUNT - 1} contacts of a.*, but a\.frame\.csv counts"
    for contacts in ("auto", "file", file):
        refuses(path, words, contacts=contacts)
    file.write_bytes(b"")
    for found in ("expected a table, found no row", f"holds no contacts of {path.name}, but"):
        for source in (path, tmp_path):
            refuses(source, rf"a\.contacts\.csv: {found}")
            assert scanfab.read(source, contacts="geometric").contacts is None
        file.unlink(missing_ok=True)


@pytest.mark.parametrize("packing", ["a turned cell", "plain"])
def test_grains_cut_behind_a_line_are_an_error_unless_the_user_says_so(tmp_path, packing):
    path, frame = written(PACKINGS[packing], tmp_path, "csv"), tmp_path / "a.frame.csv"
    without_last_row(path)
    refuses(path, r"holds 39 grains, but a\.frame\.csv counts 40")
    frame.write_text(frame.read_text().replace(",40,", ",,"))
    assert len(scanfab.read(path)) == 39


DAMAGES = [
    *((kind, rf"(?s)(.{{{kept}}}).*", r"\1", "") for kind, kept in CUTS),
    ("contacts", "0,0,0,", ",0,0,", "whole numbers"),
    ("contacts", "0,0,0,", "x,0,0,", "found text"),
    ("contacts", "0,0,0,", "0,0,0,0,", "expected 8 columns"),
    ("frame", ",xy,", ",xq,", "found xq"),
    ("frame", ",xy,", ",", "expected 17 columns"),
    ("frame", ",1.1,", ",,", "ax"),
    ("frame", ",1.1,", ",0.0,", "no volume"),
    ("columns", "scanfab_id,.*\n[0-9]+", "scanfab_id,w\n7", "not those of the grains in a"),
]


@pytest.mark.parametrize(("kind", "old", "new", "words"), DAMAGES)
def test_a_companion_file_is_read_whole_or_not_at_all(tmp_path, kind, old, new, words):
    path, file = written(EVERYTHING, tmp_path, "xyz"), tmp_path / f"a.{kind}.csv"
    file.write_text(re.sub(old, new, file.read_text(), count=1))
    refuses(path, rf"a\.{kind}\.csv.*{words}", error=scanfab.ScanfabError)


def test_companions_of_an_earlier_packing_go_and_those_of_other_files_stay(tmp_path):
    written(EVERYTHING, tmp_path, "csv")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    for name in ("npz", "xyz", "tsv"):
        with pytest.raises(scanfab.SettingsError, match=r"contacts\.csv .* may belong to a\.csv"):
            written(PLAIN, tmp_path, name)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
    # a file that is removed leaves its companions to the next one
    (tmp_path / "a.csv").unlink()
    written(PLAIN, tmp_path, "csv")
    assert {file.name for file in tmp_path.iterdir()} == {"a.csv", "a.frame.csv"}
    (tmp_path / "a.contacts.csv").write_text("mine\n1\n")
    refuses(written(PLAIN, tmp_path, "csv"), r"a\.contacts\.csv: expected two columns of ids")
    assert (tmp_path / "a.contacts.csv").read_text() == "mine\n1\n"


NEIGHBOURS = [
    # the number of the second run is the step of the first
    ["run1_2.data", "run2_2.xyz", "run3_2.csv"],
    ["a.data", "a_fine.xyz"],
]


@pytest.mark.parametrize("count", [0, 1, None])
@pytest.mark.parametrize("names", NEIGHBOURS)
def test_each_file_finds_its_own_contacts_whatever_lies_beside(tmp_path, names, count):
    pairs = {name: np.array([[0, k]])[:count] for k, name in enumerate(names, start=1)}
    if count is None:
        pairs[names[0]] = None
    for name, one in pairs.items():
        scanfab.convert(scanfab.Packing(np.eye(4, 3), 1.0, contacts=one), tmp_path / name)
    for name, one in pairs.items():
        found = scanfab.read(tmp_path / name).contacts
        np.testing.assert_array_equal(None if found is None else found.pairs, one)
    # a name without an ending finds none
    path = write(tmp_path / "grains", (tmp_path / names[0]).read_text())
    assert scanfab.read(path).contacts is None


@pytest.mark.parametrize("name", ENDINGS)
@settings(max_examples=8, deadline=None, suppress_health_check=[*HealthCheck])
@given(data=st.data())
def test_any_numbers_come_back(tmp_path, name, data):
    count = data.draw(st.integers(1, 4))
    radius = data.draw(arrays(np.float64, count, elements=st.floats(1e-90, 1e90)))
    place = data.draw(arrays(np.float64, (count, 3), elements=st.floats(-1e6, 1e6)))
    packing = scanfab.Packing(
        place * radius.max(),
        radius,
        id=data.draw(arrays(np.int64, count, elements=st.integers(-1, 2**62), unique=True)),
        columns={
            "a": data.draw(arrays(np.float64, count)),
            "b": data.draw(arrays(np.int64, count)),
            'c<"&': data.draw(arrays(np.bool_, count)),
        },
        step=data.draw(st.none() | st.integers(0, 2**53)),
        time=data.draw(st.none() | st.floats(allow_nan=False, allow_infinity=False)),
        contacts=np.zeros((0, 2), np.int64),
    )
    assert differences(packing, scanfab.read(written(packing, tmp_path, name))) == []


def series(folder):
    folder.mkdir()
    for step in (0, 100, 2000):
        write(folder / f"dump_{step}.txt", dump_text(step=step))
        write(folder / f"pairs_{step}.txt", pairs_text(step=step))
    return folder


@pytest.mark.parametrize("name", ENDINGS)
def test_a_series_becomes_a_folder_in_its_order(tmp_path, name):
    """Packings without steps keep none, dumps are named by theirs."""
    dumps = scanfab.read_series(series(tmp_path / "dumps"))
    packings = [PACKINGS["normal forces"], PACKINGS["no contacts"]] * 6
    for out, source in (("no steps", packings), ("steps", [frame.read() for frame in dumps])):
        files = scanfab.convert(source, tmp_path / out, to=name)
        for one, two in zip(source, scanfab.read_series(tmp_path / out), strict=True):
            assert (two.step, differences(one, two.read())) == (one.step, [])
    assert [path.stem for path in files] == ["frame_0", "frame_100", "frame_2000"]


def test_frames_are_chosen_and_named_by_step_or_number(tmp_path):
    def names(source, frames=None):
        files = scanfab.convert(source, tmp_path / "g-{step}.npz", frames=frames)
        return [path.stem for path in files]

    source = series(tmp_path / "dumps")
    assert names(source, "1:") == ["g-100", "g-2000"]
    # those behind the chosen ones are not asked for
    packings = repeat(PLAIN, 5)
    assert names(packings, ":4:2") == ["g-0", "g-2"]
    assert list(packings) == [PLAIN]
    assert names(packing for packing in (EVERYTHING, PLAIN)) == ["g-123456789012", "g-1"]
    for one, step in ((source, 2000), ([PLAIN, EVERYTHING], EVERYTHING.step)):
        (path,) = scanfab.convert(one, tmp_path / "last.npz", frames=-1)
        assert scanfab.read(path).step == step
    # a device without a suffix is no folder
    assert scanfab.convert(source, "/dev/null", to="csv", frames=0) == [Path("/dev/null")]


NOT_WRITTEN = [
    (PLAIN, "a.gif", None, UnknownFormatError, "expected one of .csv"),
    (PLAIN, "a.csv", "gif", UnknownFormatError, "no writer called 'gif'"),
    (PLAIN, "absent/a.csv", None, SettingsError, "there is no folder"),
    (PLAIN, ".", None, SettingsError, "a folder has no format"),
    ([3], "a.npz", None, SettingsError, "expected packings, found 3 among them"),
    ([PLAIN] * 2, "one.vtp", None, SettingsError, r"several frames.*\{step\}.*`frames`"),
    ([EVERYTHING] * 2, "{step}.npz", None, SettingsError, "frames 0 and 1 have the same step"),
    ("damaged.txt", "one.vtp", None, ReadError, "damaged.txt"),
]


@pytest.mark.parametrize(("source", "out", "to", "error", "told"), NOT_WRITTEN)
def test_a_failure_leaves_what_was_there(tmp_path, monkeypatch, source, out, to, error, told):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "damaged.txt", dump_text().replace("0.39", "x"))
    (tmp_path / "one.vtp").write_text("mine")
    with pytest.raises(error, match=told):
        scanfab.convert(source, out, to=to)
    assert (tmp_path / "one.vtp").read_text() == "mine"
    assert not list(tmp_path.glob("*.part*"))


@pytest.mark.parametrize("name", ENDINGS)
def test_a_name_that_means_something_else_is_told(tmp_path, name):
    columns = {"Radius": [2.0], "x": [3.0], "diameter": [5.0]}
    packing = scanfab.Packing(np.zeros((1, 3)), 1.0, columns=columns)
    with pytest.warns(ScanfabNote, match="the column Radius is renamed to Radius_of_dump"):
        again = scanfab.read(written(packing, tmp_path, name))
    holds(again, radius=[1.0], **{f"{name}_of_dump": values for name, values in columns.items()})


@pytest.mark.parametrize("name", ["time", "Step", "frame", "TimeStep", "Time [s]", "t", "cycle"])
@pytest.mark.parametrize("ending", [".csv", ".parquet", ".npz", ".vtp", ".xyz"])
def test_a_column_that_would_tell_frames_apart_comes_back(tmp_path, name, ending):
    """Numbers, or a text that numbers no frame."""
    for values in (np.array([1.5, 1.5, 3.0]), np.array(["a", "b", "c"])):
        columns = {name: values, f"{name}_of_dump": values[::-1], "step_of": [7, 7, 7]}
        scanfab.convert(scanfab.Packing(np.eye(3), 0.5, columns=columns), tmp_path / f"a{ending}")
        own = scanfab.read(tmp_path / f"a{ending}").columns
        assert len(own) == 3
        assert any(one.startswith(name) and np.array_equal(own[one], values) for one in own)


@pytest.mark.parametrize("name", ENDINGS)
def test_clumps_that_were_left_apart_stay_apart(tmp_path, name):
    apart = {"columns": {"clump": [4, 4]}, "bodies": None, "contacts": [[0, 1]]}
    packing = scanfab.Packing([[0, 0, 0], [1, 0, 0]], 1.0, **apart)
    again = scanfab.read(written(packing, tmp_path, name))
    assert again.bodies is None
    assert len(again.contacts) == 1


def test_vtk_reads_what_is_written(tmp_path):
    for name in ("vtp", "on-dem"):
        mesh = pyvista.read(written(EVERYTHING, tmp_path, name, stem=name))
        holds(EVERYTHING, position=mesh.points, radius=mesh["radius"], velocity=mesh["velocity"])
    mesh = pyvista.read(tmp_path / "vtp.vtp")
    holds(EVERYTHING.contacts, pairs=mesh.lines.reshape(-1, 3)[:, 1:], force=mesh["force"])
    assert mesh.field_data["TimeValue"] == [EVERYTHING.time]


@pytest.mark.skipif(which("lmp") is None, reason="needs LAMMPS")
@pytest.mark.parametrize("tilt", [0.5, 0])
def test_lammps_reads_the_data_file_and_the_dump(tmp_path, tilt):
    cell = scanfab.Cell([[2.0, 0, 0], [tilt, 3, 0], [0, 0, 2]], (True, True, False), (1, 0, -1))
    random = np.random.default_rng(3)
    place, id = random.random((20, 3)) @ cell.vectors + cell.origin, random.permutation(20) + 11
    columns = {"type": np.arange(20) % 2 + 1, "density": random.uniform(1, 2, 20)}
    radius = random.uniform(0.1, 0.2, 20)
    packing = scanfab.Packing(place, radius, id=id, columns=columns, cell=cell, step=50)
    deck = (
        "units si\natom_style sphere\nboundary p p f\n"
        f"read_data {written(packing, tmp_path, 'lammps-data')}\n"
        "pair_style zero 0.1\npair_coeff * *\n"
        f"read_dump {written(packing, tmp_path, 'lammps', 'b')} 50 x y z replace yes\n"
        "dump 1 all custom 1 out.dump id type radius mass x y z\n"
        "dump_modify 1 format float %.17g\nrun 0\n"
    )
    words = ["lmp", "-in", write(tmp_path / "in.lammps", deck), "-log", "none"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:]
    again = scanfab.read(tmp_path / "out.dump", contacts="geometric")
    order, other = np.argsort(id), np.argsort(again.id)
    assert again.step == 50
    np.testing.assert_array_equal(again.radius[other], packing.radius[order])
    np.testing.assert_allclose(again.position[other], packing.position[order], atol=1e-14)
    mass = columns["density"] * 4 / 3 * np.pi * packing.radius**3
    np.testing.assert_allclose(again.columns["mass"][other], mass[order], rtol=1e-14)
    np.testing.assert_allclose(again.cell.vectors, cell.vectors, atol=1e-14)


@pytest.mark.parametrize("values", [[b"a", b"b"], ["a", None], np.zeros(2, np.float16), [1j, 2]])
def test_a_column_that_few_formats_can_hold_is_left_out(tmp_path, values):
    packing = scanfab.Packing([[0, 0, 0], [2, 0, 0]], 1.0, columns={"odd": values})
    for suffix in (".csv", ".vtp", ".npz", ".xyz"):
        with pytest.warns(ScanfabNote, match="the column odd is left out: it holds"):
            scanfab.convert(packing, tmp_path / f"{suffix[1:]}_out{suffix}")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_process_reads_tables_and_has_a_worker_of_its_own(tmp_path):
    """Polars, which this process has used, would wait there for ever."""
    paths = [written(EVERYTHING, tmp_path, "csv"), written(PLAIN, tmp_path, "vtp", "b")]
    expected = [len(scanfab.read(path)) for path in paths]
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        os._exit([len(scanfab.read(path)) for path in paths] != expected)
    assert os.waitpid(child, 0)[1] == 0
    assert len(scanfab.read(paths[1])) == expected[1]


def test_that_columns_of_contacts_have_no_place_is_told_once(tmp_path):
    with pytest.warns(ScanfabNote, match="only pairs, images and forces of the con") as caught:
        scanfab.convert(series(tmp_path / "dumps"), tmp_path / "out", to="csv")
    assert [str(one.message).count("pairs_*.txt: only pairs") for one in caught].count(1) == 1
    # of our own files nothing is lost
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".* of the contacts are written")
        scanfab.convert(tmp_path / "out", tmp_path / "again", to="csv")


@pytest.mark.filterwarnings("ignore:.*no contact file for step 1 among")
def test_contacts_of_one_frame_of_a_series_that_are_lost_are_an_error_of_that_frame(tmp_path):
    scanfab.convert([EVERYTHING, PACKINGS["normal forces"]], tmp_path / "g-{step}.csv")
    (tmp_path / "g-1.contacts.csv").unlink()
    first, second = scanfab.read_series(tmp_path)
    with pytest.raises(scanfab.ReadError, match=r"holds no contacts of g-1\.csv, but g-1\.frame"):
        first.read()
    assert second.read().step == EVERYTHING.step
