"""convert: nothing is lost on the way through any format, and nothing is written by halves."""

from __future__ import annotations

import subprocess
import warnings
from shutil import which

import numpy as np
import pytest
import pyvista
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, SettingsError, UnknownFormatError
from scanfab.io.writers.registry import installed_writers
from scanfab.testing import differences, made_up_packings
from tests.helpers.dumps import dump_text, pairs_text, write
from tests.helpers.truth import SAMPLE_DATA

WRITERS = {name: one.plugin for name, one in installed_writers().items()}
EVERYTHING = made_up_packings()["everything"]
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")


def written(packing, folder, name):
    (path,) = scanfab.convert(packing, folder / f"a{WRITERS[name].extensions[0]}", to=name)
    return path


def table(packing):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rows = scanfab.compute(
            packing, rv=0.6, directions=12, spacing=0.05, cutoff=0.02, with_="forces"
        )
    return [{key: row[key] for key in row if key != "source"} for row in rows]


@pytest.fixture(scope="module")
def expected():
    return table(EVERYTHING)


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_same_table(tmp_path, expected, name):
    assert table(scanfab.read(written(EVERYTHING, tmp_path, name))) == expected


@pytest.mark.parametrize("name", WRITERS)
def test_the_command_finds_what_lies_beside(tmp_path, name):
    from click.testing import CliRunner

    from scanfab.cli.group import cli

    path = written(EVERYTHING, tmp_path, name)
    found = CliRunner().invoke(cli, ["convert", str(path), str(tmp_path / "b" / "..." / "x.npz")])
    assert found.exit_code != 0  # there is no such folder
    found = CliRunner().invoke(cli, ["convert", str(path), str(tmp_path / "again.npz")])
    assert found.exit_code == 0, found.output
    assert differences(EVERYTHING, scanfab.read(tmp_path / "again.npz")) == []


@pytest.mark.parametrize("name", WRITERS)
def test_contacts_with_walls_are_there_however_the_contacts_are_named(tmp_path, name):
    path = written(EVERYTHING, tmp_path, name)
    assert EVERYTHING.wall_contacts.any()
    for contacts in ("auto", "file", tmp_path / "a.contacts.csv"):
        if contacts not in ("auto", "file") and not contacts.exists():
            continue
        packing = scanfab.read(path, contacts=contacts)
        np.testing.assert_array_equal(packing.wall_contacts, EVERYTHING.wall_contacts)


def test_what_lies_beside_another_file_of_the_name_is_not_lost(tmp_path):
    path = written(EVERYTHING, tmp_path, "csv")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    assert {"a.contacts.csv", "a.frame.csv"} <= before.keys()
    # without contacts: a format that holds all would remove those beside, others leave them
    without = scanfab.read(path, contacts="geometric")
    for ending in (".npz", ".xyz", ".tsv"):
        with pytest.raises(SettingsError, match=r"a\.csv of the same name lies there, whose a\.co"):
            scanfab.convert(without, tmp_path / f"a{ending}")
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_one_packing_in_several_formats_may_share_what_lies_beside(tmp_path):
    names = ["csv", "npz", "vtp", "parquet", "tsv"]
    for name in names:
        written(EVERYTHING, tmp_path, name)
    for name in names:
        path = tmp_path / f"a{WRITERS[name].extensions[0]}"
        assert differences(EVERYTHING, scanfab.read(path)) == [], name


def test_from_format_to_format_nothing_gets_lost(tmp_path):
    path = written(EVERYTHING, tmp_path, "vtp")
    for place, name in enumerate(WRITERS):
        folder = tmp_path / f"{place}"
        folder.mkdir()
        (path,) = scanfab.convert(path, folder / f"p{WRITERS[name].extensions[0]}", to=name)
    assert differences(EVERYTHING, scanfab.read(path)) == []


LENGTHS = st.floats(-1e99, 1e99)
RADII = st.floats(1e-99, 1e99)


@pytest.mark.parametrize("name", WRITERS)
@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_any_numbers_come_back(tmp_path, name, data):
    count = data.draw(st.integers(1, 4))
    packing = scanfab.Packing(
        data.draw(arrays(np.float64, (count, 3), elements=LENGTHS)),
        data.draw(arrays(np.float64, count, elements=RADII)),
        id=data.draw(arrays(np.int64, count, elements=st.integers(-1, 2**62), unique=True)),
        columns={
            "a": data.draw(arrays(np.float64, count)),
            "b": data.draw(arrays(np.int64, count)),
        },
        step=data.draw(st.none() | st.integers(0, 2**53)),
        time=data.draw(st.none() | st.floats(allow_nan=False, allow_infinity=False)),
        contacts=np.zeros((0, 2), np.int64),
    )
    assert differences(packing, scanfab.read(written(packing, tmp_path, name))) == []


def series(folder, steps=(0, 100, 2000)):
    folder.mkdir()
    for step in steps:
        write(folder / f"dump_{step}.txt", dump_text(step=step))
        write(folder / f"pairs_{step}.txt", pairs_text(step=step))
    return folder


@pytest.mark.parametrize("name", WRITERS)
def test_a_series_becomes_a_folder(tmp_path, name):
    source = scanfab.read_series(series(tmp_path / "dumps"))
    out = tmp_path / "out"
    files = scanfab.convert(source, out, to=name)
    assert [path.stem for path in files] == ["frame_0", "frame_100", "frame_2000"]
    again = scanfab.read_series(out)
    assert len(again) == 3
    for one, two in zip(source, again, strict=True):
        assert differences(one.read(), two.read()) == []


def test_a_name_with_step_takes_a_series_and_frames_are_chosen(tmp_path):
    source = series(tmp_path / "dumps")
    files = scanfab.convert(source, tmp_path / "g-{step}.vtp", frames="1:")
    assert [path.name for path in files] == ["g-100.vtp", "g-2000.vtp"]
    (path,) = scanfab.convert(source, tmp_path / "last.vtp", frames=-1)
    assert scanfab.read(path).step == 2000


def test_packings_without_steps_go_by_their_number(tmp_path):
    packings = (packing for packing in (EVERYTHING, made_up_packings()["plain"]))
    files = scanfab.convert(packings, tmp_path / "{step}.npz")
    assert [path.name for path in files] == ["123456789012.npz", "1.npz"]


def test_packings_come_one_by_one(tmp_path):
    def endless():
        while True:
            yield made_up_packings()["plain"]

    files = scanfab.convert(endless(), tmp_path / "{step}.npz", frames="1:4:2")
    assert [path.name for path in files] == ["1.npz", "3.npz"]
    (path,) = scanfab.convert([EVERYTHING] * 3, tmp_path / "last.npz", frames=-1)
    assert scanfab.read(path).step == EVERYTHING.step
    with pytest.raises(SettingsError, match="expected packings, found 3 among them"):
        scanfab.convert([3], tmp_path / "a.npz")


def test_several_frames_do_not_go_into_one_file(tmp_path):
    (tmp_path / "one.vtp").write_text("mine")
    with pytest.raises(SettingsError, match=r"several frames for one file.*\{step\}.*`frames`"):
        scanfab.convert(series(tmp_path / "dumps"), tmp_path / "one.vtp")
    assert (tmp_path / "one.vtp").read_text() == "mine"


def test_frames_of_one_step_do_not_overwrite_each_other(tmp_path):
    with pytest.raises(SettingsError, match="the frames 0 and 1 have the same step"):
        scanfab.convert([EVERYTHING, EVERYTHING], tmp_path / "{step}.npz")


@pytest.mark.parametrize(
    ("out", "to", "error", "reason"),
    [
        ("a.gif", None, UnknownFormatError, "expected one of .csv"),
        ("a.csv", "gif", UnknownFormatError, "no writer called 'gif'"),
        ("absent/a.csv", None, SettingsError, "there is no folder"),
        (".", None, SettingsError, "a folder has no format"),
    ],
)
def test_what_cannot_be_written_is_told_before_anything_is_read(tmp_path, out, to, error, reason):
    with pytest.raises(error, match=reason):
        scanfab.convert(tmp_path / "not there", tmp_path / out, to=to)


def test_a_frame_that_cannot_be_read_leaves_what_was_there(tmp_path):
    path = write(tmp_path / "a.txt", dump_text().replace("0.39", "x"))
    (tmp_path / "b.csv").write_text("mine")
    with pytest.raises(ReadError):
        scanfab.convert(path, tmp_path / "b.csv")
    assert [one.name for one in sorted(tmp_path.iterdir())] == ["a.txt", "b.csv"]
    assert (tmp_path / "b.csv").read_text() == "mine"


def test_a_disk_that_is_full_leaves_what_was_there(tmp_path, monkeypatch):
    from scanfab.io import convert

    def fails(packing):
        raise OSError(28, "No space left on device")

    (tmp_path / "b.csv").write_text("mine")
    monkeypatch.setattr(convert, "contacts_csv", fails)
    with pytest.raises(OSError, match="No space left"):
        scanfab.convert(EVERYTHING, tmp_path / "b.csv")
    assert [one.name for one in tmp_path.iterdir()] == ["b.csv"]
    assert (tmp_path / "b.csv").read_text() == "mine"


def test_what_an_earlier_packing_left_beside_goes(tmp_path):
    scanfab.convert(EVERYTHING, tmp_path / "a.xyz")
    assert (tmp_path / "a.contacts.csv").exists()
    plain = made_up_packings()["plain"]
    scanfab.convert(plain, tmp_path / "a.xyz")
    assert [one.name for one in tmp_path.iterdir()] == ["a.xyz"]
    assert differences(plain, scanfab.read(tmp_path / "a.xyz")) == []


def test_a_file_of_the_users_own_beside_stays(tmp_path):
    (tmp_path / "a.contacts.csv").write_text("mine\n1\n")
    scanfab.convert(made_up_packings()["plain"], tmp_path / "a.xyz")
    assert (tmp_path / "a.contacts.csv").read_text() == "mine\n1\n"


def test_columns_of_other_grains_are_refused(tmp_path):
    scanfab.convert(EVERYTHING, tmp_path / "a.xyz")
    (tmp_path / "a.columns.csv").write_text("scanfab_id,text\n1,x\n")
    with pytest.raises(ReadError, match=r"columns of other grains than a\.xyz"):
        scanfab.read(tmp_path / "a.xyz")


@pytest.mark.parametrize("suffix", ["contacts", "frame", "columns"])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_what_lies_beside_is_read_whole_or_not_at_all(tmp_path, suffix, share):
    scanfab.convert(EVERYTHING, tmp_path / "a.data")
    path = tmp_path / f"a.{suffix}.csv"
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(scanfab.ScanfabError, match=path.name):
        scanfab.read(tmp_path / "a.data")


def test_a_name_that_means_something_else_is_told(tmp_path):
    packing = scanfab.Packing(np.zeros((1, 3)), 1.0, columns={"Radius": [2.0], "x": [3.0]})
    with pytest.warns(ScanfabNote, match="the column Radius is called Radius_of_dump"):
        scanfab.convert(packing, tmp_path / "a.npz")
    again = scanfab.read(tmp_path / "a.npz")
    assert again.radius == [1.0]
    assert again.columns["Radius_of_dump"] == [2.0]
    assert again.columns["x_of_dump"] == [3.0]


@pytest.mark.parametrize("name", ["time", "Step", "frame", "TimeStep", "Time [s]", "t", "cycle"])
@pytest.mark.parametrize("ending", [".csv", ".tsv", ".parquet", ".npz", ".vtp", ".xyz"])
def test_a_column_that_would_tell_frames_apart_comes_back(tmp_path, name, ending):
    values = np.array([1.5, 1.5, 3.0])
    packing = scanfab.Packing(np.eye(3), 0.5, columns={name: values, f"{name}_of_dump": 2 * values})
    (path,) = scanfab.convert(packing, tmp_path / f"a{ending}")
    own = scanfab.read(path).columns
    found = [one for one in own if np.array_equal(own[one], values)]
    assert len(own) == 2
    assert found[0].startswith(name)


def test_so_its_other_name_is_told_and_one_of_one_value_stays(tmp_path):
    columns = {"time": [1.0, 2.0, 3.0], "step": [7, 7, 7]}
    packing = scanfab.Packing(np.eye(3), 0.5, columns=columns)
    with pytest.warns(ScanfabNote, match="the column time is called time_of_dump: time tells"):
        scanfab.convert(packing, tmp_path / "a.csv")
    assert set(scanfab.read(tmp_path / "a.csv").columns) == {"time_of_dump", "step"}


def test_clumps_that_were_left_apart_stay_apart(tmp_path):
    packing = scanfab.Packing(
        [[0, 0, 0], [1, 0, 0]], 1.0, columns={"clump": [4, 4]}, bodies=None, contacts=[[0, 1]]
    )
    for name in WRITERS:
        again = scanfab.read(written(packing, tmp_path, name))
        assert again.bodies is None, name
        assert len(again.contacts) == 1, name


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
@pytest.mark.parametrize("tilted", [True, False])
def test_lammps_reads_the_data_file_and_the_dump(tmp_path, tilted):
    cell = scanfab.Cell(
        [[2.0, 0, 0], [0.5 if tilted else 0, 3, 0], [0, 0, 2]], (True, True, False), (1, 0, -1)
    )
    random = np.random.default_rng(3)
    packing = scanfab.Packing(
        random.random((20, 3)) @ cell.vectors + cell.origin,
        random.uniform(0.1, 0.2, 20),
        id=random.permutation(20) + 11,
        columns={"type": np.arange(20) % 2 + 1, "density": random.uniform(1, 2, 20)},
        cell=cell,
        step=50,
    )
    data = written(packing, tmp_path, "lammps-data")
    dump = written(packing, tmp_path, "lammps")
    deck = (
        "units si\natom_style sphere\nboundary p p f\n"
        f"read_data {data}\npair_style zero 0.1\npair_coeff * *\n"
        f"read_dump {dump} 50 x y z replace yes\n"
        "dump 1 all custom 1 out.dump id type radius mass x y z\n"
        "dump_modify 1 format float %.17g\nrun 0\n"
    )
    done = subprocess.run(
        ["lmp", "-in", write(tmp_path / "in.lammps", deck), "-log", "none"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    again = scanfab.read(tmp_path / "out.dump", contacts="geometric")
    order, other = np.argsort(packing.id), np.argsort(again.id)
    assert again.step == 50
    np.testing.assert_array_equal(again.radius[other], packing.radius[order])
    np.testing.assert_allclose(again.position[other], packing.position[order], atol=1e-14)
    mass = packing.columns["density"] * 4 / 3 * np.pi * packing.radius**3
    np.testing.assert_allclose(again.columns["mass"][other], mass[order], rtol=1e-14)
    np.testing.assert_allclose(again.cell.vectors, cell.vectors, atol=1e-14)


def test_forces_and_tilted_cells_of_the_sample_data_come_through(tmp_path):
    source = SAMPLE_DATA / "liggghts_periodic/dump_30000.txt.gz"
    packing = scanfab.read(source)
    for name in WRITERS:
        assert differences(packing, scanfab.read(written(packing, tmp_path, name))) == [], name


def test_contacts_cut_within_their_first_line_are_an_error(tmp_path):
    made = made_up_packings()["everything"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scanfab.convert(made, tmp_path / "a.xyz")
    (tmp_path / "a.contacts.csv").write_text("id1,id2,ix,iy,iz")
    with pytest.raises(ReadError, match="the last line has no end"):
        scanfab.read(tmp_path / "a.xyz")


def notes(source, out, **reading):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scanfab.convert(source, out, **reading)
    return [str(one.message) for one in caught if "left out" in str(one.message)]


def test_columns_of_contacts_that_have_no_place_are_named_once(tmp_path):
    for step in (1, 2):
        write(tmp_path / f"g{step}.csv", "id,x,y,z,radius\n1,0,0,0,1\n2,1.9,0,0,1\n")
        write(tmp_path / f"g{step}.contacts.csv", "id1,id2,fn,area,x,fn2\n1,2,3.5,7,8,1\n")
    source = scanfab.read_series([tmp_path / f"g{step}.csv" for step in (1, 2)])
    (told,) = notes(source, tmp_path / "{step}.npz")
    assert told.endswith("*.contacts.csv: contacts are kept as pairs, images and forces; left out: "
                         "area, x, fn2")  # fmt: skip
    assert scanfab.read(tmp_path / "2.npz").contacts.force_n == [3.5]
    # what is used, by whatever name, is not left out; nor is anything of contacts that are not read
    named = {"contact_columns": "id1=id1,id2=id2,fn=fn2"}
    (told,) = notes(tmp_path / "g1.csv", tmp_path / "a.npz", **named)
    assert told.endswith("left out: fn, area, x")
    assert notes(tmp_path / "g1.csv", tmp_path / "a.npz", contacts="geometric") == []


def test_of_other_contact_files_it_is_told_that_there_may_be_more(tmp_path):
    source = series(tmp_path / "dumps")
    (told,) = notes(source, tmp_path / "out", to="csv")
    assert "pairs_*.txt: contacts are kept as pairs, images and forces" in told
    # what scanfab writes has nothing else
    assert notes(tmp_path / "out", tmp_path / "again", to="npz") == []
