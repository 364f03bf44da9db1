"""Interrupted runs that are resumed give the bytes of a run that nobody interrupted."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
import threading
from pathlib import Path
from random import Random

import pytest

from scanfab.cli.main import run
from scanfab.table.formats import JsonArray
from scanfab.table.writing import ResultFile
from tests.helpers.interruptions import Interrupter, interrupted_at_row, write_series

# about a second of scanning
OPTIONS = ("--tolerance", "1e-3")
FAST = (
    "--workers",
    "2",
    "--directions",
    "9",
    "--spacing",
    "0.5rmin",
    "--cutoff",
    "0.2rmin",
    "--variants",
    "ac",
)


@pytest.fixture(scope="module")
def tool(tmp_path_factory):
    folder = tmp_path_factory.mktemp("interrupted")
    return Interrupter(write_series(folder / "series"), OPTIONS, Random(1))


@pytest.fixture(scope="module")
def short_series(tmp_path_factory):
    return write_series(tmp_path_factory.mktemp("short") / "series", 4)


@pytest.fixture
def compute(short_series, tmp_path):
    """The exit code of a run in this process."""

    def compute(output: Path, *words: str) -> int:
        return run(["compute", str(short_series), *FAST, "-o", str(output), *words])

    return compute


def _wait_for_frames_under_way() -> None:
    """An interrupted process ends without its threads; in this one they go on for a while."""
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join()


@pytest.fixture
def stopped(compute, monkeypatch, tmp_path):
    """A FILE, of which FILE.part holds two frames and a half."""

    def stop(name: str = "table.csv") -> Path:
        output = tmp_path / name
        with interrupted_at_row(monkeypatch, 6) as rows:
            assert compute(output) == 130
        _wait_for_frames_under_way()
        assert not output.exists()
        assert len(rows) == 6
        return output

    return stop


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_runs_stopped_by_signals_at_random_moments_give_the_same_bytes(tool, tmp_path):
    expected, seconds = tool.whole(tmp_path / "whole.csv")
    for attempt in range(5):
        place = tmp_path / str(attempt)
        place.mkdir()
        assert tool.interrupted(place / "table.csv", seconds, 2) == expected
    known = {0, 130, 143, *(-sent for sent in signal.Signals)}
    assert set(tool.codes) <= known
    assert sum(tool.codes.values()) >= 5


@pytest.mark.parametrize("suffix", [".csv", ".tsv", ".json", ".jsonl", ".parquet"])
def test_every_format_is_the_same_when_resumed(compute, stopped, tmp_path, suffix):
    whole = tmp_path / f"whole{suffix}"
    assert compute(whole) == 0
    output = stopped(f"table{suffix}")
    assert compute(output, "--resume", "--workers", "1") == 0
    assert output.read_bytes() == whole.read_bytes()
    assert not Path(f"{output}.part").exists()


def test_finished_frames_are_not_computed_again(compute, stopped, short_series, monkeypatch):
    output, computed = stopped(), []
    from scanfab.pipeline import measurement

    scan = measurement.scan_to_tolerance
    monkeypatch.setattr(
        measurement, "scan_to_tolerance", lambda *words: computed.append(1) or scan(*words)
    )
    assert compute(output, "--resume") == 0
    assert len(computed) == 2


@pytest.mark.parametrize(
    ("words", "named"),
    [(["--seed", "1"], "seed"), (["--rv", "0.6"], "rv"), (["--contacts", "geometric"], "contacts")],
)
def test_other_settings_are_wrong_usage(compute, stopped, capsys, words, named):
    output = stopped()
    part = Path(f"{output}.part")
    before = part.read_bytes()
    assert compute(output, "--resume", *words) == 2
    assert f"was made with other settings ({named})" in capsys.readouterr().err
    assert part.read_bytes() == before
    assert not output.exists()


@pytest.mark.parametrize("workers", ["1", "2", "5"])
def test_other_workers_are_no_other_settings(compute, stopped, workers):
    assert compute(stopped(), "--resume", "--workers", workers) == 0


@pytest.mark.parametrize("words", [[], ["--rattlers", "recursive"]])
def test_a_part_older_than_a_setting_was_made_with_its_default(compute, stopped, tmp_path, words):
    output = stopped()
    record = Path(f"{output}.manifest.json.part")
    first, *inputs = record.read_text("utf-8").splitlines(keepends=True)
    settings = json.loads(first)
    del settings["settings"]["rattlers"]
    record.write_text("".join([json.dumps(settings) + "\n", *inputs]), "utf-8")
    assert compute(output, "--resume", *words) == (2 if words else 0)


def test_without_a_part_everything_is_computed(compute, tmp_path):
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    assert compute(one) == compute(two, "--resume") == 0
    assert one.read_bytes() == two.read_bytes()


@pytest.mark.parametrize("words", [[], ["--seed", "1"], ["--frames", ":1"]])
def test_without_resume_the_part_is_kept_under_another_name(
    compute, stopped, tmp_path, capsys, words
):
    """And what made it goes on with it there."""
    output = stopped()
    part = Path(f"{output}.part").read_bytes()
    assert compute(output, *words) == 0
    kept = tmp_path / "table.1.csv"
    told = capsys.readouterr().err
    assert f"scanfab: note: {output}.part: 5 finished rows of an earlier run are kept as" in told
    assert f"by -o {kept} --resume" in told
    assert Path(f"{kept}.part").read_bytes() == part
    whole = tmp_path / "whole.csv"
    assert compute(whole, *words) == 0
    assert output.read_bytes() == whole.read_bytes()
    assert compute(kept, "--resume") == 0
    assert compute(whole) == 0
    assert kept.read_bytes() == whole.read_bytes()


def test_every_part_gets_a_name_of_its_own(compute, monkeypatch, tmp_path):
    output = tmp_path / "table.csv"
    for seed in ("1", "2", "3"):
        with interrupted_at_row(monkeypatch, 4):
            assert compute(output, "--seed", seed) == 130
        _wait_for_frames_under_way()
    parts = {path.name for path in tmp_path.glob("*.csv.part")}
    assert parts == {"table.csv.part", "table.1.csv.part", "table.2.csv.part"}


def test_an_interrupted_run_says_how_far_it_is_and_how_to_go_on(compute, stopped, capsys):
    output = stopped()
    told = capsys.readouterr().err
    assert told.endswith(
        "scanfab: interrupted after 2 of 4 frames; the same command with --resume goes on\n"
    )
    assert compute(output, "--resume") == 0
    assert "interrupted" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "; the rows printed so far are all: with -o FILE, --resume could go on"),
        (["-o", "-"], "; the rows printed so far are all: with -o FILE, --resume could go on"),
    ],
)
def test_without_a_file_an_interruption_keeps_nothing(
    short_series, monkeypatch, capsys, words, said
):
    with interrupted_at_row(monkeypatch, 4):
        assert run(["compute", str(short_series), *FAST, *words]) == 130
    _wait_for_frames_under_way()
    assert f"interrupted after 1 of 4 frames{said}" in capsys.readouterr().err


def test_an_interruption_before_the_first_frame_is_done_says_so(
    compute, monkeypatch, tmp_path, capsys
):
    with interrupted_at_row(monkeypatch, 2):
        assert compute(tmp_path / "table.csv") == 130
    _wait_for_frames_under_way()
    told = capsys.readouterr().err
    assert "interrupted before the first frame was finished: nothing is kept" in told


def test_a_part_whose_settings_are_lost_is_refused(compute, stopped, capsys):
    output = stopped()
    Path(f"{output}.manifest.json.part").unlink()
    assert compute(output, "--resume") == 2
    assert "was made with other settings" in capsys.readouterr().err


def test_frames_that_an_earlier_run_skipped_are_not_forgotten(short_series, tmp_path, monkeypatch):
    """Exit code 1, as without the interruption."""
    damaged = shutil.copytree(short_series, tmp_path / "damaged")
    second = sorted(path for path in damaged.iterdir() if path.is_file())[1]
    second.write_text("ITEM: TIMESTEP\n")
    output = tmp_path / "table.csv"
    words = ["compute", str(damaged), *FAST, "--on-error", "skip", "-o", str(output)]

    with interrupted_at_row(monkeypatch, 5):
        assert run(words) == 130
    _wait_for_frames_under_way()
    assert run([*words, "--resume"]) == 1
    whole = tmp_path / "whole.csv"
    assert run([*words[:-1], str(whole)]) == 1
    assert output.read_bytes() == whole.read_bytes()


def test_resume_needs_a_file(short_series, capsys):
    assert run(["compute", str(short_series), "--resume"]) == 2
    assert "--resume goes with -o FILE" in capsys.readouterr().err


def test_an_error_says_how_to_go_on_too(short_series, tmp_path, capsys):
    """Once the broken dump is mended."""
    dumps = shutil.copytree(short_series, tmp_path / "dumps")
    broken = dumps / "dump_200.txt"
    good = broken.read_text()
    broken.write_text("ITEM: TIMESTEP\n")
    output, whole = tmp_path / "table.csv", tmp_path / "whole.csv"
    words = ["compute", str(dumps), *FAST, "-o"]
    assert run([*words, str(output), "--workers", "1"]) == 1
    told = capsys.readouterr().err
    assert "stopped after 2 of 4 frames; the same command with --resume goes on\n" in told
    assert told.splitlines()[-1].startswith("scanfab: error: ")
    broken.write_text(good)
    assert run([*words, str(output), "--resume"]) == run([*words, str(whole)]) == 0
    assert output.read_bytes() == whole.read_bytes()


def test_a_second_run_into_the_same_file_is_refused(compute, tmp_path, capsys, monkeypatch):
    """However it begins; and the first goes on undisturbed."""
    output, whole, codes = tmp_path / "table.csv", tmp_path / "whole.csv", []
    write_row = ResultFile.write

    def second_run_meanwhile(self, row):
        write_row(self, row)
        if not codes:
            codes.append(None)
            codes[:] = [compute(output, *more) for more in (["--resume"], ["--rv", "0.4"], [])]

    assert compute(whole) == 0
    monkeypatch.setattr(ResultFile, "write", second_run_meanwhile)
    assert compute(output) == 0
    assert codes == [1, 1, 1]
    told = capsys.readouterr().err
    assert f"error: {output}.part: another run is writing to it: wait until that one has" in told
    assert output.read_bytes() == whole.read_bytes()
    assert {path.name for path in tmp_path.glob("table*")} == {
        "table.csv",
        "table.csv.manifest.json",
    }


def test_where_there_are_no_locks_runs_go_on(compute, tmp_path, monkeypatch):
    fcntl = pytest.importorskip("fcntl", reason="such locks are POSIX")

    def none(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", none)
    assert compute(tmp_path / "table.csv") == 0


@pytest.mark.parametrize("text", ["{", "[1]", "", '{"settings": 3}', '{"settings": {}}\n7\n', "ü"])
def test_a_damaged_record_is_refused_and_the_rows_are_kept(
    compute, stopped, tmp_path, capsys, text
):
    output = stopped()
    part = Path(f"{output}.part").read_bytes()
    Path(f"{output}.manifest.json.part").write_bytes(text.encode("latin-1") + b"\n")
    assert compute(output, "--resume") == 1
    told = capsys.readouterr().err
    assert f"error: {output}.manifest.json.part: expected what an interrupted run" in told
    assert Path(f"{output}.part").read_bytes() == part
    assert compute(output) == 0
    assert (tmp_path / "table.1.csv.part").read_bytes() == part


@pytest.fixture
def dumps(short_series, tmp_path):
    """A copy of the series, whose files may change."""
    return shutil.copytree(short_series, tmp_path / "dumps")


@pytest.fixture
def stopped_run(dumps, tmp_path, monkeypatch):
    """Stops a run after two frames of four; the words of its command."""

    def stop(*words: str, sources: tuple[Path, ...] = ()) -> list[str]:
        output = str(tmp_path / "table.csv")
        command = ["compute", *map(str, sources or (dumps,)), *FAST, *words, "-o", output]
        with interrupted_at_row(monkeypatch, 6):
            assert run(command) == 130
        _wait_for_frames_under_way()
        return [*command, "--resume"]

    return stop


def is_refused(command: list[str], capsys, said: str) -> bool:
    """Whether going on is wrong usage, for this reason."""
    code = run(command)
    told = capsys.readouterr().err
    return code == 2 and "table.csv.part: --resume cannot go on with it: " in told and said in told


def test_a_part_of_other_dumps_is_refused(stopped_run, dumps, capsys):
    command = stopped_run()
    for path in dumps.iterdir():
        path.write_text(path.read_text().replace(" 0.5", " 0.49", 1))
    assert is_refused(command, capsys, "dump_0.txt has changed since")


def test_a_part_with_a_new_frame_between_is_refused(stopped_run, dumps, capsys):
    command = stopped_run()
    shutil.copy(dumps / "dump_100.txt", dumps / "dump_50.txt")
    assert is_refused(command, capsys, "dump_50.txt is new, and not behind the last frame")


def test_dumps_behind_the_rows_of_a_part_may_change(stopped_run, dumps, tmp_path):
    command = stopped_run()
    last = dumps / "dump_300.txt"
    last.write_text(last.read_text().replace(" 0.5", " 0.49", 1))
    shutil.copy(last, dumps / "dump_400.txt")
    assert run(command) == 0
    whole = tmp_path / "whole.csv"
    assert run([*command[:-2], str(whole)]) == 0
    assert (tmp_path / "table.csv").read_bytes() == whole.read_bytes()


@pytest.mark.parametrize(
    ("option", "header", "row"),
    [("--strain", "step,strain", "0.1"), ("--cell", "step,lx,ly,lz", "4,4,4")],
)
def test_a_part_of_other_numbers_is_refused(stopped_run, tmp_path, capsys, option, header, row):
    numbers = tmp_path / "numbers.csv"
    numbers.write_text("\n".join([header, *(f"{step},{row}" for step in (0, 100, 200, 300))]))
    command = stopped_run(option, str(numbers))
    numbers.write_text(numbers.read_text().replace(f"100,{row}", f"100,{row}1"))
    assert is_refused(command, capsys, f"{numbers} has changed since")


def test_frames_that_a_part_has_and_nobody_chooses_now_are_refused(stopped_run, dumps, capsys):
    command = stopped_run("--frames=-3:")
    for step in (400, 500):
        shutil.copy(dumps / "dump_300.txt", dumps / f"dump_{step}.txt")
    assert is_refused(command, capsys, "it holds frame 1, which is not chosen now")


def test_a_frame_may_come_behind_a_source_whose_rows_are_over(stopped_run, dumps, tmp_path):
    first = tmp_path / "first"
    first.mkdir()
    shutil.copy(dumps / "dump_0.txt", first)
    command = stopped_run(sources=(first, dumps))
    shutil.copy(dumps / "dump_100.txt", first)
    assert run(command) == 0
    whole = tmp_path / "whole.csv"
    assert run([*command[:-2], str(whole)]) == 0
    assert (tmp_path / "table.csv").read_bytes() == whole.read_bytes()


def test_a_part_that_is_a_pipe_is_refused_at_once(compute, tmp_path, capsys):
    output = tmp_path / "table.csv"
    os.mkfifo(f"{output}.part")
    assert compute(output) == 2
    assert f"{output}.part: is a pipe, expected a file or nothing" in capsys.readouterr().err


def test_a_table_that_is_replaced_is_told_of(compute, tmp_path, capsys):
    output = tmp_path / "table.csv"
    note = f"{output}: the table that is there will be replaced at the end of this run; --resume"
    assert compute(output) == 0
    assert note not in capsys.readouterr().err
    assert compute(output, "--resume") == 0
    assert note not in capsys.readouterr().err
    assert compute(output) == 0
    assert note in capsys.readouterr().err


def test_a_failure_behind_the_last_frame_says_so(compute, tmp_path, capsys, monkeypatch):
    def full(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(JsonArray, "write", full)
    assert compute(tmp_path / "table.json") == 1
    said = "stopped after the last frame, before the table was complete; the same command with"
    assert said in capsys.readouterr().err
