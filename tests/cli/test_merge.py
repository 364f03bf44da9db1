"""The parts of a job array, merged: the bytes of one run, or an error that names the part."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest

import scanfab
from scanfab.cli.main import run
from scanfab.table.formats import OWN_FORMATS
from tests.helpers.interruptions import FAST, write_series


def compute(source: Path, output: Path, *words: str) -> str:
    code = run(["compute", str(source), *FAST, "-o", str(output), *words])
    assert code == 0 or "skip" in words
    return str(output)


def merge(*parts: str, output: Path) -> bytes:
    """The bytes of the merged table."""
    assert run(["merge", *parts, "-o", str(output)]) == 0
    return output.read_bytes()


def as_parts(source: Path, folder: Path, jobs: int, *words: str, suffix: str = ".csv") -> list[str]:
    return [
        compute(source, folder / f"part_{job}{suffix}", "--frames", f"{job}::{jobs}", *words)
        for job in range(jobs)
    ]


@pytest.fixture(scope="module")
def whole(series, tmp_path_factory):
    return Path(compute(series, tmp_path_factory.mktemp("merge") / "whole.csv"))


@pytest.fixture(scope="module")
def finished(series, tmp_path_factory):
    folder = tmp_path_factory.mktemp("merge")
    as_parts(series, folder, 3)
    return folder


@pytest.fixture
def parts(finished, tmp_path):
    """Three parts that a test may spoil."""
    return sorted(map(str, shutil.copytree(finished, tmp_path / "parts").glob("*.csv")))


@pytest.fixture
def refused(tmp_path, ask):
    """What is said where nothing is written."""

    def refused(*words: str) -> str:
        said = ask("merge", *words, "-o", tmp_path / "merged.csv", code=1).err
        assert not list(tmp_path.glob("merged.csv*"))
        assert said.startswith("scanfab: error: ")
        assert said.count("\n") == 1
        return said

    return refused


@pytest.mark.parametrize("suffix", [".json", ".parquet"])
def test_the_bytes_are_those_of_one_run(series, tmp_path, suffix):
    """A job that no frame was left for has a table without rows."""
    words = ("--with", "harmonics", "--digits", "9")
    parts = as_parts(series, tmp_path, 6, *words, suffix=suffix)
    assert len(scanfab.load(parts[5])) == 0
    whole, merged = tmp_path / f"whole{suffix}", tmp_path / f"merged{suffix}"
    compute(series, whole, *words)
    assert merge(*reversed(parts), output=merged) == whole.read_bytes()
    one, other = (json.loads(Path(f"{name}.manifest.json").read_text()) for name in (merged, whole))
    assert {**one, "notes": []} == {**other, "notes": []}


def test_several_series_become_one_table(series, tmp_path):
    """Also one of columns without the void fabric."""
    other, both = write_series(tmp_path / "other", 2), tmp_path / "both.csv"
    few = ("--fields", "source,frame,variant,mean_length")
    compute(other, both, str(series), *few)
    parts = [compute(other, tmp_path / "other.csv", *few), *as_parts(series, tmp_path, 2, *few)]
    assert merge(*parts, output=tmp_path / "merged.csv") == both.read_bytes()


def test_without_any_void_fabric_the_exit_code_is_1(series, tmp_path):
    part = str(tmp_path / "part.csv")
    words = ("--frames", "0", "--cutoff", "100", "-o", part)
    assert run(["compute", str(series), *FAST, *words]) == 1
    assert run(["merge", part, "--frames", "0"]) == 1


def test_maps_are_merged_too(series, tmp_path):
    names = [tmp_path / name for name in ("whole.csv", "part_0.csv", "part_1.csv")]
    for name, frames in zip(names, (":2", "0:1", "1:2"), strict=True):
        words = ["map", str(series), "--slices", "2", *FAST, "--variants", "a"]
        assert run([*words, "--frames", frames, "-o", str(name)]) == 0
    words = [str(names[1]), str(names[2]), "--frames", ":2"]
    assert merge(*words, output=tmp_path / "merged.csv") == names[0].read_bytes()


def test_a_merged_table_can_be_gone_on_with(parts, series, whole, tmp_path):
    some = tmp_path / "some.csv"
    merge(parts[0], "--frames", "0::3", output=some)
    compute(series, some, "--resume")
    assert some.read_bytes() == whole.read_bytes()


def test_skipped_frames_stay_out(series, tmp_path, capsys):
    broken = shutil.copytree(series, tmp_path / "broken")
    (broken / "dump_300.txt").write_text("ITEM: TIMESTEP\n300\nITEM: NUMBER OF ATOMS\n7\n")
    whole = tmp_path / "whole.csv"
    compute(broken, whole, "--on-error", "skip")
    parts = as_parts(broken, tmp_path, 2, "--on-error", "skip")
    assert merge(*parts, output=tmp_path / "merged.csv") == whole.read_bytes()
    assert f"{parts[1]}: frame 3 of {broken} was skipped" in capsys.readouterr().err


def test_other_settings_and_missing_parts_are_named(parts, series, tmp_path, refused):
    other = compute(series, tmp_path / "other.csv", "--frames", "2::3", "--seed", "3")
    said = refused(*parts[:2], other)
    assert f"{other}: has other settings (seed) than {parts[0]}" in said
    assert "frame 1 of " in refused(parts[0], parts[2])
    # those of the other parts make a slice, but not the series
    assert "frame 1 of " in refused(parts[0])


def test_a_frame_twice_is_to_have_the_same_values(parts, whole, series, tmp_path, refused):
    again = Path(compute(series, tmp_path / "again.csv", "--frames", "1:3"))
    assert merge(*parts, str(again), output=tmp_path / "once.csv") == whole.read_bytes()
    with_value("lines", "7")(again)
    said = refused(*parts, str(again))
    assert f"{again}: frame 1 of " in said
    assert f"has other values than in {parts[1]}: lines is 7 here" in said


def cut(kept: int) -> Callable[[Path], object]:
    """Leaves so many lines of a part."""
    return lambda part: part.write_text("".join(part.read_text().splitlines(True)[:kept]))


def told(old: str, new: str) -> Callable[[Path], object]:
    """Puts other words into the manifest of a part."""

    def spoil(part: Path) -> None:
        manifest = Path(f"{part}.manifest.json")
        manifest.write_text(manifest.read_text().replace(old, new))

    return spoil


def with_value(column: str, value: str) -> Callable[[Path], object]:
    """Puts a value into all rows of a part."""
    cell = pl.lit(value).alias(column)
    return lambda part: pl.read_csv(part, infer_schema=False).with_columns(cell).write_csv(part)


SPOILT = [
    (1, cut(-1), "expected 2 rows of frame 4"),
    (1, cut(-2), "lacks frame 4"),
    (1, lambda part: Path(f"{part}.manifest.json").unlink(), "there is no part_1.csv.manifest"),
    (1, lambda part: part.rename(f"{part}.part"), "is not finished"),
    (1, Path.unlink, "cannot be read: No such file"),
    (1, with_value("mean_length", "nan"), "found nan in the column mean_length"),
    (0, with_value("mine", "1"), "nothing here makes its columns mine"),
    (0, told('"strain": "auto"', '"strain": "gone.csv"'), "the manifest cannot be used: strain"),
    (2, told('"sha256": "', '"sha256": "0'), "dump_0.txt has changed between the jobs"),
]


@pytest.mark.parametrize(("number", "spoil", "said"), SPOILT)
def test_a_part_that_cannot_be_used_is_named(parts, refused, number, spoil, said):
    spoil(Path(parts[number]))
    message = refused(*parts)
    assert parts[number] in message
    assert said in message


@pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])
def test_a_part_that_lost_its_end_is_named(series, tmp_path, suffix, refused):
    """Copied not quite to its end: the last number of a text would read well."""
    (part,) = as_parts(series, tmp_path, 1, "--variants", "a", suffix=suffix)
    Path(part).write_bytes(Path(part).read_bytes()[:-4])
    assert part in refused(part)
    # nor is it gone on with
    words = ["--variants", "a", "-o", part, "--resume"]
    assert run(["compute", str(series), *FAST, *words]) == 1


def test_without_a_name_the_table_is_printed_and_without_parts_there_is_none(parts, whole, ask):
    assert ask("merge", *parts).out == whole.read_text()
    with pytest.raises(scanfab.SettingsError, match="found none"):
        scanfab.merge_tables([])
