"""The parts of a job array, merged: the bytes of one run, or an error that names the part."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import scanfab
from scanfab.cli.main import run
from scanfab.table.formats import OWN_FORMATS
from tests.helpers.interruptions import write_series

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--workers", "1")
SUFFIXES = [one.suffix for one in OWN_FORMATS]


def compute(source: Path, output: Path, *words: str) -> Path:
    assert run(["compute", str(source), *FAST, "-o", str(output), *words]) == 0
    return output


def as_parts(source: Path, folder: Path, jobs: int, *words: str, suffix: str = ".csv") -> list[str]:
    names = [folder / f"part_{job}{suffix}" for job in range(jobs)]
    for job, name in enumerate(names):
        compute(source, name, "--frames", f"{job}::{jobs}", *words)
    return [str(name) for name in names]


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    return write_series(tmp_path_factory.mktemp("merge") / "series", 5)


@pytest.fixture(scope="module")
def whole(series, tmp_path_factory):
    return compute(series, tmp_path_factory.mktemp("merge") / "whole.csv")


@pytest.fixture(scope="module")
def finished(series, tmp_path_factory):
    folder = tmp_path_factory.mktemp("merge")
    as_parts(series, folder, 3)
    return folder


@pytest.fixture
def parts(finished, tmp_path):
    """Three parts that a test may spoil."""
    folder = shutil.copytree(finished, tmp_path / "parts")
    return sorted(str(one) for one in folder.glob("*.csv"))


@pytest.fixture
def refused(tmp_path, capsys):
    """What is said where nothing is written."""

    def refused(*words: str) -> str:
        output = tmp_path / "merged.csv"
        capsys.readouterr()
        code = run(["merge", *words, "-o", str(output)])
        said = capsys.readouterr().err
        assert code == 1
        assert not list(tmp_path.glob("merged.csv*"))
        assert said.startswith("scanfab: error: ")
        assert said.count("\n") == 1
        return said

    return refused


@pytest.mark.parametrize("suffix", [".csv", ".json", ".parquet"])
def test_the_bytes_are_those_of_one_run(series, tmp_path, suffix):
    """A job that no frame was left for has a table without rows."""
    words = ("--with", "harmonics", "--digits", "9")
    parts = as_parts(series, tmp_path, 6, *words, suffix=suffix)
    assert scanfab.load(parts[5]).rows == ()
    whole = compute(series, tmp_path / f"whole{suffix}", *words)
    merged = tmp_path / f"merged{suffix}"
    assert run(["merge", *reversed(parts), "-o", str(merged)]) == 0
    assert merged.read_bytes() == whole.read_bytes()
    one, other = (json.loads(Path(f"{name}.manifest.json").read_text()) for name in (merged, whole))
    assert {**one, "notes": []} == {**other, "notes": []}


def test_parts_without_the_void_fabric_are_merged_like_others(series, tmp_path):
    parts = as_parts(series, tmp_path, 2, "--fields", "source,frame,variant,mean_length")
    assert run(["merge", *parts, "-o", str(tmp_path / "merged.csv")]) == 0


def test_several_series_become_one_table(series, tmp_path):
    other = write_series(tmp_path / "other", 2)
    both = tmp_path / "both.csv"
    assert run(["compute", str(other), str(series), *FAST, "-o", str(both)]) == 0
    parts = [str(compute(other, tmp_path / "other.csv")), *as_parts(series, tmp_path, 2)]
    merged = tmp_path / "merged.csv"
    assert run(["merge", *parts, "-o", str(merged)]) == 0
    assert merged.read_bytes() == both.read_bytes()


def test_maps_are_merged_too(series, tmp_path):
    names = ["whole.csv", "part_0.csv", "part_1.csv"]
    for name, frames in zip(names, (":2", "0:1", "1:2"), strict=True):
        words = ["map", str(series), "--slices", "2", "--tolerance", "0.05", "--frames", frames]
        assert run([*words, "-o", str(tmp_path / name)]) == 0
    parts = [str(tmp_path / name) for name in names[1:]]
    merged = tmp_path / "merged.csv"
    assert run(["merge", *parts, "-o", str(merged), "--frames", ":2"]) == 0
    assert merged.read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_a_merged_table_can_be_gone_on_with(parts, series, whole, tmp_path):
    some = tmp_path / "some.csv"
    assert run(["merge", *parts[:1], "-o", str(some), "--frames", "0::3"]) == 0
    compute(series, some, "--resume")
    assert some.read_bytes() == whole.read_bytes()


def test_skipped_frames_stay_out(series, tmp_path, capsys):
    broken = tmp_path / "broken"
    shutil.copytree(series, broken)
    (broken / "dump_300.txt").write_text("ITEM: TIMESTEP\n300\nITEM: NUMBER OF ATOMS\n7\n")
    names = [tmp_path / name for name in ("whole.csv", "part_0.csv", "part_1.csv")]
    for name, frames in zip(names, (":", "0::2", "1::2"), strict=True):
        words = [*FAST, "--on-error", "skip", "--frames", frames]
        assert run(["compute", str(broken), *words, "-o", str(name)]) in (0, 1)
    merged = tmp_path / "merged.csv"
    assert run(["merge", str(names[1]), str(names[2]), "-o", str(merged)]) == 0
    assert merged.read_bytes() == names[0].read_bytes()
    assert f"{names[2]}: frame 3 of {broken} was skipped" in capsys.readouterr().err


def test_other_settings_and_missing_parts_are_named(parts, series, tmp_path, refused):
    other = compute(series, tmp_path / "other.csv", "--frames", "2::3", "--seed", "3")
    said = refused(*parts[:2], str(other))
    assert f"{other}: has other settings (seed) than {parts[0]}" in said
    assert "frame 1 of " in refused(parts[0], parts[2])
    # those of the other parts make a slice, but not the series
    assert "frame 1 of " in refused(parts[0])


def test_a_frame_twice_is_to_have_the_same_values(parts, whole, series, tmp_path, refused):
    again = compute(series, tmp_path / "again.csv", "--frames", "1:3")
    merged = tmp_path / "once.csv"
    assert run(["merge", *parts, str(again), "-o", str(merged)]) == 0
    assert merged.read_bytes() == whole.read_bytes()
    lines = again.read_text().splitlines(keepends=True)
    cells = lines[1].split(",")
    cells[14] = str(int(cells[14]) + 1)
    again.write_text(lines[0] + ",".join(cells) + "".join(lines[2:]))
    said = refused(*parts, str(again))
    assert f"{again}: frame 1 of " in said
    assert f"has other values than in {parts[1]}: lines is {cells[14]} here" in said


def test_unfinished_parts_are_named(parts, refused):
    part = Path(parts[1])
    manifest = Path(f"{part}.manifest.json")
    text = manifest.read_text()
    lines = part.read_text().splitlines(keepends=True)

    part.write_text("".join(lines[:-1]))
    assert f"{part}: expected 4 rows of frame 4" in refused(*parts)
    part.write_text("".join(lines[:-4]))
    assert f"{part}: lacks frame 4" in refused(*parts)
    part.write_text("".join(lines))
    manifest.unlink()
    assert f"{part}: there is no {manifest.name}" in refused(*parts)
    manifest.write_text(text)
    part.rename(f"{part}.part")
    assert f"{part}: is not finished" in refused(*parts)
    Path(f"{part}.part").unlink()
    assert f"{part}: there is no such part" in refused(*parts)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_part_that_lost_its_end_is_named(series, tmp_path, suffix, capsys):
    """Copied not quite to its end: the last number of a text would read well."""
    parts = as_parts(series, tmp_path, 1, suffix=suffix)
    last = Path(parts[0])
    last.write_bytes(last.read_bytes()[:-4])
    assert run(["merge", *parts, "-o", str(tmp_path / "t.csv")]) == 1
    assert str(last) in capsys.readouterr().err
    assert not (tmp_path / "t.csv").exists()
    # nor is it gone on with
    assert run(["compute", str(series), *FAST, "-o", str(last), "--resume"]) == 1


def test_a_file_that_has_changed_between_jobs_is_named(parts, refused):
    path = Path(f"{parts[2]}.manifest.json")
    manifest = json.loads(path.read_text())
    manifest["inputs"][1]["sha256"] = "0" * 64
    path.write_text(json.dumps(manifest))
    name = manifest["inputs"][1]["path"]
    assert f"{parts[2]}: {name} has changed between the jobs" in refused(*parts)


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (("inputs", 0), 5, "expected a manifest of scanfab compute"),
        (("settings", "strain"), "gone.csv", "settings of the manifest cannot be used: strain: "),
    ],
)
def test_a_manifest_that_cannot_be_used_is_named(parts, refused, place, value, said):
    path = Path(f"{parts[0]}.manifest.json")
    manifest = json.loads(path.read_text())
    manifest[place[0]][place[1]] = value
    path.write_text(json.dumps(manifest))
    message = refused(*parts)
    assert parts[0] in message
    assert said in message


def test_a_part_is_not_replaced(parts):
    before = Path(parts[0]).read_bytes()
    assert run(["merge", *parts, "-o", parts[0]]) == 2
    assert Path(parts[0]).read_bytes() == before
    assert run(["merge", *parts, "-o", "merged.doc"]) == 2
    assert run(["merge", *parts, "-o", "no/such/folder.csv"]) == 2


def test_the_library_merges(parts, whole, tmp_path, capsys):
    output = tmp_path / "merged.csv"
    table = scanfab.merge_tables(parts, output)
    assert table == scanfab.load(whole)
    assert output.read_bytes() == whole.read_bytes()
    assert run(["merge", *parts]) == 0
    assert capsys.readouterr().out == whole.read_text()
    with pytest.raises(scanfab.SettingsError, match="found none"):
        scanfab.merge_tables([])
