"""Tables in files from Python: the files of the command line, and each goes on with the other's."""

import json
import shutil
import warnings
from collections.abc import Sequence
from pathlib import Path

import pytest

import scanfab
from scanfab.base.errors import SkippedFrameWarning
from scanfab.cli.main import run
from tests.helpers.dumps import write
from tests.helpers.interruptions import FAST, interrupted_at_row, write_series

# the same as FAST
OPTIONS = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "variants": "ac"}


@pytest.fixture(scope="module")
def short_series(tmp_path_factory):
    return write_series(tmp_path_factory.mktemp("short") / "series", 4)


@pytest.fixture
def dumps(short_series, tmp_path):
    """A copy of the series, whose files may change."""
    return shutil.copytree(short_series, tmp_path / "dumps")


def commanded(output: Path, *words: str, sources: Sequence[Path]) -> int:
    return run(["compute", *map(str, sources), *FAST, "-o", str(output), *words])


def from_python(output: Path, source, **options) -> scanfab.Table:
    return scanfab.compute_file(source, output, **{**OPTIONS, **options})


def manifest_of(output: Path) -> bytes:
    return Path(f"{output}.manifest.json").read_bytes()


def assert_same(*outputs: Path) -> None:
    """Tables and manifests, to the last byte."""
    for file_of in (Path.read_bytes, manifest_of):
        assert len({file_of(one) for one in outputs}) == 1


def test_a_part_of_a_series_makes_the_files_of_its_frames(short_series, tmp_path):
    """Its first frame is not computed, but RV and rmin are of it."""
    part, frames = tmp_path / "part.csv", tmp_path / "frames.csv"
    series = scanfab.read_series(short_series)
    from_python(part, series[1:3])
    from_python(frames, series, frames="1:3")
    assert_same(part, frames)
    from_python(part, series[1:], resume=True)
    table = from_python(frames, series, frames="1:")
    assert part.read_bytes() == frames.read_bytes()
    assert table == scanfab.compute(series, frames="1:", **OPTIONS)


@pytest.mark.parametrize(
    ("suffix", "sources"),
    [(".jsonl", "folder"), (".parquet", "files"), (".csv", "two series")],
)
def test_paths_open_series_and_the_command_leave_the_same_files(
    short_series, dumps, tmp_path, capsys, suffix, sources
):
    """The manifest names the options by which a series was opened, so that it can be resumed."""
    given = {"folder": [short_series], "files": sorted(short_series.iterdir())}.get(sources)
    reading = {"contacts": "geometric", "cell": [4, 4, 4]}
    words = ("--contacts", "geometric", "--cell", "4", "4", "4", "--frames", ":1")
    if given:
        series = scanfab.read_series(given, **reading)
    else:
        given = [short_series, dumps]
        series = [scanfab.read_series(one, **reading) for one in given]
    ours, opened, other = (tmp_path / f"{name}{suffix}" for name in ("ours", "opened", "other"))
    assert commanded(other, *words, sources=given) == 0
    capsys.readouterr()
    from_python(ours, given, manifest=tmp_path / "copy.json", frames=":1", **reading)
    from_python(opened, series, frames=":1")
    assert capsys.readouterr() == ("", "")
    assert_same(ours, opened, other)
    assert (tmp_path / "copy.json").read_bytes() == manifest_of(ours)
    from_python(ours, series, frames=":2", resume=True)


def test_python_goes_on_with_what_the_command_has_left(short_series, tmp_path, monkeypatch):
    output, computed = tmp_path / "table.csv", []
    with interrupted_at_row(monkeypatch, 6):
        assert commanded(output, sources=(short_series,)) == 130
    from_python(output, short_series, resume=True, progress=lambda *now: computed.append(now))
    assert computed == [(3, 4), (4, 4)]
    assert scanfab.load(output) == from_python(tmp_path / "whole.csv", short_series)


def test_each_of_several_series_has_a_folder_of_paraview_files(short_series, dumps, tmp_path):
    words = {"vtk": tmp_path / "vtk", "frames": ":2", "variants": "c"}
    from_python(tmp_path / "table.csv", [short_series, dumps], **words)
    for number in (1, 2):
        grains = tmp_path / f"vtk/series-{number}/grains.pvd"
        assert grains.read_text().count("<DataSet ") == 2


def test_skipped_frames_are_warned_of_and_stand_in_the_manifest(dumps, tmp_path):
    """Whatever filters of warnings hide."""
    write(dumps / "dump_100.txt", "ITEM: TIMESTEP\n")
    ours, hidden, other = (tmp_path / f"{name}.csv" for name in ("ours", "hidden", "other"))
    with pytest.warns(SkippedFrameWarning, match="frame 1 skipped") as caught:
        table = from_python(ours, dumps, on_error="skip")
    assert len([one for one in caught if one.category is SkippedFrameWarning]) == 1
    assert sorted(set(table["frame"])) == [0, 2, 3]
    (told,) = json.loads(manifest_of(ours))["warnings"]
    assert told.startswith("frame 1 skipped")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from_python(hidden, dumps, on_error="skip")
    assert commanded(other, "--on-error", "skip", sources=(dumps,)) == 1
    assert manifest_of(ours) == manifest_of(hidden) == manifest_of(other)


def test_a_second_computation_into_the_same_file_is_refused(short_series, tmp_path):
    output, told = tmp_path / "table.csv", "another run is writing.* another `output=FILE`$"
    refused = []

    def second(*_):
        with pytest.raises(scanfab.ScanfabError, match=told) as caught:
            from_python(output, short_series)
        refused.append(caught)

    assert len(from_python(output, short_series, progress=second)) == 8
    assert refused


def test_what_cannot_be_resumed_names_arguments(short_series, tmp_path):
    output = tmp_path / "table.csv"
    from_python(output, short_series)
    with pytest.raises(scanfab.SettingsError, match=r"other settings \(seed\).*leave out `resume`"):
        from_python(output, short_series, seed=1, resume=True)


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"toleranc": 1e-3}, TypeError, "compute_file has no option 'toleranc': did you mean 'tol"),
        ({"radius": -1}, scanfab.SettingsError, "radius: expected a .* above 0, found -1"),
        ({"manifest": "none/here.json"}, scanfab.SettingsError, "none"),
        ({"vtk": "v", "cutoff": "1rmin", "cutoffs": "1,2"}, scanfab.SettingsError, "one cut-off"),
        ({"vtk": "v", "executor": object()}, scanfab.SettingsError, "cannot be written with"),
        ({"source": [3]}, scanfab.SettingsError, "expected a Series or the path of dumps"),
        ({"source": scanfab.Packing([[0, 0, 0]], 1.0)}, scanfab.SettingsError, r"save\(\)"),
    ],
)
def test_wrong_arguments_are_named(short_series, tmp_path, monkeypatch, change, error, said):
    monkeypatch.chdir(tmp_path)
    given = {"source": short_series, "output": "table.csv", **change}
    with pytest.raises(error, match=said):
        scanfab.compute_file(given.pop("source"), given.pop("output"), **given)
    assert not Path("table.csv.part").exists()


def test_series_that_make_no_table_are_refused(short_series, dumps, tmp_path):
    series = scanfab.read_series(short_series)
    other = scanfab.read_series(dumps, contacts="geometric")
    for sources, options, said in (
        ([series, series], {}, "named twice among the series"),
        ([series, other], {}, "read with the same options"),
        ([series[1:], scanfab.read_series(dumps)[:2]], {}, "parts of the same frames"),
        (series, {"radius": 1.0}, "radius: the series is open already"),
        (series, {"vtk": short_series}, "vtk: .* holds the dumps: name another folder"),
    ):
        with pytest.raises(scanfab.SettingsError, match=said):
            from_python(tmp_path / "table.csv", sources, **options)
