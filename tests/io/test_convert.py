"""convert: nothing is lost on the way through any format, and nothing is written by halves."""

from __future__ import annotations

import subprocess
import warnings
from itertools import repeat
from shutil import which

import numpy as np
import pytest
import pyvista
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, SettingsError, UnknownFormatError
from scanfab.cli.main import run
from scanfab.io.writer import installed_writers
from scanfab.testing import differences, made_up_packings
from tests.helpers.dumps import dump_text, pairs_text, write

ENDINGS = {name: one.plugin.extensions[0] for name, one in installed_writers().items()}
PACKINGS = made_up_packings()
EVERYTHING, PLAIN = PACKINGS["everything"], PACKINGS["plain"]
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")


def written(packing, folder, name):
    """In a folder of its own, as companion files belong to one file."""
    own = folder / name
    own.mkdir(exist_ok=True)
    (path,) = scanfab.convert(packing, own / f"a{ENDINGS[name]}", to=name)
    return path


@pytest.mark.parametrize("name", ENDINGS)
def test_every_format_gives_the_same_packing_and_finds_its_companions(tmp_path, name):
    path = written(EVERYTHING, tmp_path, name)
    assert run(["convert", str(path), str(tmp_path / "again.npz")]) == 0
    assert differences(EVERYTHING, scanfab.read(tmp_path / "again.npz")) == []
    for contacts in ("auto", "file", *path.parent.glob("*.contacts.csv")):
        assert differences(EVERYTHING, scanfab.read(path, contacts=contacts)) == []


@pytest.mark.parametrize("name", ENDINGS)
@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
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
def test_a_series_becomes_a_folder(tmp_path, name):
    source = scanfab.read_series(series(tmp_path / "dumps"))
    files = scanfab.convert(source, tmp_path / "out", to=name)
    assert [path.stem for path in files] == ["frame_0", "frame_100", "frame_2000"]
    for one, two in zip(source, scanfab.read_series(tmp_path / "out"), strict=True):
        assert differences(one.read(), two.read()) == []


def test_frames_are_chosen_and_named_by_step_or_number(tmp_path):
    def names(source, frames=None):
        files = scanfab.convert(source, tmp_path / "g-{step}.npz", frames=frames)
        return [path.stem for path in files]

    source = series(tmp_path / "dumps")
    assert names(source, "1:") == ["g-100", "g-2000"]
    assert names(repeat(PLAIN), "1:4:2") == ["g-1", "g-3"]
    assert names(packing for packing in (EVERYTHING, PLAIN)) == ["g-123456789012", "g-1"]
    for one, step in ((source, 2000), ([PLAIN, EVERYTHING], EVERYTHING.step)):
        (path,) = scanfab.convert(one, tmp_path / "last.npz", frames=-1)
        assert scanfab.read(path).step == step


@pytest.mark.parametrize(
    ("source", "out", "to", "error", "reason"),
    [
        (PLAIN, "a.gif", None, UnknownFormatError, "expected one of .csv"),
        (PLAIN, "a.csv", "gif", UnknownFormatError, "no writer called 'gif'"),
        (PLAIN, "absent/a.csv", None, SettingsError, "there is no folder"),
        (PLAIN, ".", None, SettingsError, "a folder has no format"),
        ([3], "a.npz", None, SettingsError, "expected packings, found 3 among them"),
        ([PLAIN] * 2, "one.vtp", None, SettingsError, r"several frames.*\{step\}.*`frames`"),
        ([EVERYTHING] * 2, "{step}.npz", None, SettingsError, "frames 0 and 1 have the same step"),
        ("damaged.txt", "one.vtp", None, ReadError, "damaged.txt"),
    ],
)
def test_what_cannot_be_written_leaves_what_was_there(
    tmp_path, monkeypatch, source, out, to, error, reason
):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "damaged.txt", dump_text().replace("0.39", "x"))
    (tmp_path / "one.vtp").write_text("mine")
    with pytest.raises(error, match=reason):
        scanfab.convert(source, out, to=to)
    assert (tmp_path / "one.vtp").read_text() == "mine"
    assert not list(tmp_path.glob("*.part*"))


def test_a_name_that_means_something_else_is_told(tmp_path):
    columns = {"Radius": [2.0], "x": [3.0], "diameter": [5.0]}
    packing = scanfab.Packing(np.zeros((1, 3)), 1.0, columns=columns)
    with pytest.warns(ScanfabNote, match="the column Radius is called Radius_of_dump"):
        scanfab.convert(packing, tmp_path / "a.npz")
    again = scanfab.read(tmp_path / "a.npz")
    assert again.radius == [1.0]
    assert {f"{name}_of_dump": values for name, values in columns.items()} == dict(again.columns)


@pytest.mark.parametrize("name", ["time", "Step", "frame", "TimeStep", "Time [s]", "t", "cycle"])
@pytest.mark.parametrize("ending", [".csv", ".parquet", ".npz", ".vtp", ".xyz"])
def test_a_column_that_would_tell_frames_apart_comes_back(tmp_path, name, ending):
    values = np.array([1.5, 1.5, 3.0])
    columns = {name: values, f"{name}_of_dump": 2 * values, "step_of": [7, 7, 7]}
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
    mesh = pyvista.read(written(EVERYTHING, tmp_path, "vtp"))
    np.testing.assert_array_equal(mesh.points, EVERYTHING.position)
    np.testing.assert_array_equal(mesh["radius"], EVERYTHING.radius)
    np.testing.assert_array_equal(mesh["velocity"], EVERYTHING.columns["velocity"])
    assert list(mesh["element"]) == list(EVERYTHING.columns["element"])
    np.testing.assert_array_equal(mesh.lines.reshape(-1, 3)[:, 1:], EVERYTHING.contacts.pairs)
    np.testing.assert_array_equal(mesh.cell_data["force"], EVERYTHING.contacts.force)
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
        f"read_dump {written(packing, tmp_path, 'lammps')} 50 x y z replace yes\n"
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


def test_that_columns_of_contacts_have_no_place_is_told_once(tmp_path):
    # of our own files nothing is lost
    for source, told in (
        (series(tmp_path / "dumps"), "pairs_*.txt: of contacts"),
        (tmp_path / "out", ""),
    ):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            scanfab.convert(source, tmp_path / "out", to="csv")
        found = [str(one.message) for one in caught if "of contacts" in str(one.message)]
        assert [one.endswith("only pairs, images and forces are written") for one in found] == [
            True
        ] * bool(told)
        assert all(told in one for one in found)


def test_a_device_without_a_suffix_is_no_folder(tmp_path):
    source = series(tmp_path / "dumps")
    (written,) = scanfab.convert(source, "/dev/null", to="csv", frames=0)
    assert str(written) == "/dev/null"
