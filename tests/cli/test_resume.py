"""--resume: what FILE.part or a complete FILE holds is taken over, what is missing is computed."""

from __future__ import annotations

import gzip
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from scanfab.cli.main import run
from scanfab.pipeline.frame import compute_frame
from scanfab.pipeline.record import read_manifest
from scanfab.table.formats import Json
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text, write
from tests.helpers.interruptions import PROGRAM, interrupted_at_row, write_series
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")


@pytest.fixture(scope="module")
def five_frames(tmp_path_factory):
    return write_series(tmp_path_factory.mktemp("five") / "series", 5)


@pytest.fixture
def dumps(five_frames, tmp_path, monkeypatch):
    """A folder whose last frame is not written yet, in the working directory."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dumps").mkdir()
    for step in (0, 100, 200, 300):
        shutil.copy(five_frames / f"dump_{step}.txt", "dumps")
    return Path("dumps")


@pytest.fixture
def last_frame(five_frames, dumps):
    """Adds the last frame."""
    return lambda: shutil.copy(five_frames / "dump_400.txt", dumps)


@pytest.fixture
def compute(dumps, monkeypatch):
    """Runs the command; says its exit code, and how many frames it has computed."""
    computed = []

    def counted(*words, **more):
        found = compute_frame(*words, **more)
        computed.append(1)
        return found

    monkeypatch.setattr("scanfab.pipeline.compute.compute_frame", counted)

    def compute(output: str, *words: str, sources: tuple[str, ...] = ("dumps",)):
        computed.clear()
        return run(["compute", *sources, *FAST, "-o", output, *words]), len(computed)

    return compute


@pytest.fixture
def stop(compute, monkeypatch):
    """Runs a command that is interrupted in the middle of its third frame, or before a row."""

    def stop(output: str, *words: str, row: int = 6, **sources: tuple[str, ...]) -> None:
        with interrupted_at_row(monkeypatch, row):
            assert compute(output, *words, **sources)[0] == 130

    return stop


@pytest.fixture
def is_whole(compute):
    """Whether a table, its manifest and nothing else are there, as one run makes them."""

    def is_whole(output: str, *words: str, **sources: tuple[str, ...]) -> bool:
        whole = f"whole{Path(output).suffix}"
        assert compute(whole, *words, **sources)[0] in (0, 1)
        left = {one.name for one in Path().glob(f"{Path(output).stem}.*")}
        assert left == {output, f"{output}.manifest.json"}
        one, other = read_manifest(Path(output)), read_manifest(Path(whole))
        assert one["inputs"] == other["inputs"]
        return Path(output).read_bytes() == Path(whole).read_bytes()

    return is_whole


# FILE.part


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_a_run_that_is_stopped_by_a_signal(dumps, compute, is_whole, sent, code):
    """tests.campaigns.interrupt does it at random, again and again."""
    part, words = Path("t.csv.part"), [*FAST, "--tolerance", "1e-3", "--workers", "1"]
    with subprocess.Popen([*PROGRAM, "compute", "dumps", *words, "-o", "t.csv"]) as process:
        while process.poll() is None and (not part.exists() or part.read_bytes().count(b"\n") < 2):
            time.sleep(0.002)
        process.send_signal(sent)
        assert process.wait(60) in (code, 0)
    assert compute("t.csv", "--tolerance", "1e-3", "--resume")[0] == 0
    assert is_whole("t.csv", "--tolerance", "1e-3")


@pytest.mark.parametrize("suffix", [".csv", ".json", ".parquet"])
def test_an_interrupted_run_is_gone_on_with(compute, stop, last_frame, is_whole, capsys, suffix):
    """And frames that come later are added to the complete table."""
    table = f"table{suffix}"
    stop(table)
    told = capsys.readouterr().err
    assert told.endswith(
        "interrupted after 2 of 4 frames; the same command with --resume goes on\n"
    )
    assert not Path(table).exists()
    with open(f"{table}.part", "ab") as part:
        part.write(b'{"inputs": [], "rows"')  # killed while it wrote a frame
    assert compute(table, "--resume", "--workers", "1") == (0, 2)
    assert "interrupted" not in capsys.readouterr().err
    assert is_whole(table)
    last_frame()
    assert compute(table, "--resume", "--workers", "1") == (0, 1)
    assert is_whole(table)
    assert compute(table, "--resume") == (0, 0)
    assert is_whole(table)


def test_without_a_part_everything_is_computed(compute, is_whole, capsys):
    assert compute("table.csv", "--resume") == (0, 4)
    assert "will be replaced at the end" not in capsys.readouterr().err
    assert is_whole("table.csv")
    assert compute("table.csv") == (0, 4)
    assert "table.csv: the table that is there will be replaced" in capsys.readouterr().err
    assert run(["compute", "dumps", "--resume"]) == 2
    assert "--resume needs -o FILE" in capsys.readouterr().err


def test_without_resume_the_part_is_kept_under_another_name(compute, stop, is_whole, capsys):
    """And what made it goes on with it there."""
    for seed in ("1", "2"):
        stop("table.csv", "--seed", seed)
    assert compute("table.csv") == (0, 4)
    told = capsys.readouterr().err
    assert (
        "note: table.csv.part: 2 finished frames of an earlier run are kept as table.1.csv" in told
    )
    assert "by -o table.2.csv --resume" in told
    for number in ("1", "2"):
        assert compute(f"table.{number}.csv", "--seed", number, "--resume") == (0, 2)
        assert is_whole(f"table.{number}.csv", "--seed", number)
    Path("table.1.csv").unlink()
    assert compute("other.csv") == (0, 4)
    assert Path("table.csv").read_bytes() == Path("other.csv").read_bytes()


def test_how_far_an_interrupted_run_is_is_told(dumps, stop, compute, monkeypatch, capsys):
    with interrupted_at_row(monkeypatch, 4):
        assert run(["compute", "dumps", *FAST]) == 130
    told = capsys.readouterr().err
    assert "after 1 of 4 frames; the rows printed so far are all: with -o FILE, --resume" in told
    stop("t.csv", row=2)
    told = capsys.readouterr().err
    assert "interrupted before the first frame was finished: nothing is kept" in told
    assert not list(Path().glob("t.csv*"))
    (dumps / "dump_200.txt").write_text("ITEM: TIMESTEP\n")
    assert compute("t.csv", "--workers", "1")[0] == 1
    told = capsys.readouterr().err
    assert "stopped after 2 of 4 frames; the same command with --resume goes on\n" in told
    assert told.splitlines()[-1].startswith("scanfab: error: ")


def test_where_there_are_no_locks_runs_go_on(compute, monkeypatch):
    fcntl = pytest.importorskip("fcntl", reason="such locks are POSIX")

    def none(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", none)
    assert compute("table.csv")[0] == 0


def test_a_failure_behind_the_last_frame_says_so(compute, capsys, monkeypatch):
    def full(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(Json, "write", full)
    assert compute("table.json")[0] == 1
    assert "stopped after the last frame, before the table was" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["{", "[1]", '{"settings": 3}', '{"settings": {}}\n7', "\xfc"])
def test_a_damaged_part_is_refused_and_kept(compute, stop, capsys, text):
    stop("table.csv")
    part = Path("table.csv.part")
    lines = part.read_bytes().splitlines(keepends=True)
    part.write_bytes(text.encode("latin-1") + b"\n" + b"".join(lines[1:]))
    before = part.read_bytes()
    assert compute("table.csv", "--resume") == (1, 0)
    assert "table.csv.part: expected what an interrupted run has" in capsys.readouterr().err
    assert part.read_bytes() == before
    assert compute("table.csv")[0] == 0
    assert Path("table.1.csv.part").read_bytes() == before


def test_frames_that_a_part_has_and_nobody_chooses_now_are_left_out(dumps, stop, compute, is_whole):
    stop("table.csv", "--frames=-3:")
    shutil.copy(dumps / "dump_300.txt", dumps / "dump_500.txt")
    assert compute("table.csv", "--frames=-3:", "--resume") == (0, 2)
    assert is_whole("table.csv", "--frames=-3:")


def test_dumps_behind_the_rows_of_a_part_may_change(dumps, stop, compute, is_whole):
    """Those of an earlier source too, if they are new there."""
    Path("first").mkdir()
    shutil.copy(dumps / "dump_0.txt", "first")
    both = {"sources": ("first", "dumps")}
    stop("table.csv", **both)
    last = dumps / "dump_300.txt"
    last.write_text(last.read_text().replace(" 0.5", " 0.49", 1))
    shutil.copy(last, dumps / "dump_400.txt")
    shutil.copy(dumps / "dump_100.txt", "first")
    assert compute("table.csv", "--resume", **both) == (0, 5)
    assert is_whole("table.csv", **both)


# a complete FILE


@pytest.mark.parametrize(
    ("first", "then", "every", "computed"),
    [
        (":2", "2:", ":", 2),
        (":", ":1", ":", 0),
        ("-1:", "-2:", "-2:", 1),
        ("::2", "1", "0:3", 1),
    ],
)
def test_other_frames_join_those_of_the_table(compute, is_whole, first, then, every, computed):
    """No frame of the table is lost, and a report can be made of it."""
    assert compute("table.csv", f"--frames={first}")[0] == 0
    assert compute("table.csv", "--resume", f"--frames={then}") == (0, computed)
    assert is_whole("table.csv", f"--frames={every}")
    assert run(["report", "table.csv", "-o", "report.html"]) == 0


def test_frames_that_nobody_has_chosen_stay_out(compute, last_frame, is_whole):
    assert compute("table.csv") == (0, 4)
    last_frame()
    assert compute("table.csv", "--resume", "--frames=:1") == (0, 0)
    assert is_whole("table.csv", "--frames=:4")


def test_frames_that_make_no_slice_are_refused(compute, last_frame, capsys):
    last_frame()
    assert compute("table.csv", "--frames=:2")[0] == 0
    before = Path("table.csv").read_bytes()
    assert compute("table.csv", "--resume", "--frames=4:") == (2, 0)
    said = "holds frames 0 to 1, which with those chosen now make no slice"
    assert said in capsys.readouterr().err
    assert Path("table.csv").read_bytes() == before


def test_a_table_that_does_not_tell_what_made_it_is_refused(compute, capsys):
    assert compute("few.csv", "--fields", "strain,alpha_vs")[0] == 0
    assert compute("few.csv", "--fields", "strain,alpha_vs", "--resume") == (2, 0)
    assert "it lacks the columns source and frame" in capsys.readouterr().err
    Path("few.csv.manifest.json").unlink()
    assert compute("few.csv", "--resume") == (2, 0)
    assert "there is no few.csv.manifest.json" in capsys.readouterr().err


def test_a_frame_that_was_skipped_is_tried_again(compute, dumps, stop, is_whole, capsys):
    """As long as it cannot be read the exit code is 1; once it can, its rows are there."""
    second, skip = dumps / "dump_100.txt", ("--on-error", "skip")
    good = second.read_text()
    second.write_text("ITEM: TIMESTEP\n")
    stop("table.csv", *skip, row=5)
    assert compute("table.csv", *skip, "--resume") == (1, 1)
    assert is_whole("table.csv", *skip)
    assert compute("table.csv", *skip, "--resume") == (1, 0)
    assert "frame 1 skipped" in capsys.readouterr().err
    # with two frames in place of one, later frames would have other numbers
    second.write_text(good + good.replace("TIMESTEP\n100", "TIMESTEP\n150"))
    assert compute("table.csv", *skip, "--resume") == (2, 0)
    second.write_text(good)
    assert compute("table.csv", *skip, "--resume") == (0, 1)
    assert is_whole("table.csv", *skip)


def test_part_and_table_are_gone_on_with_together(compute, stop, last_frame, is_whole, capsys):
    assert compute("table.csv", "--frames=2:4") == (0, 2)
    before = Path("table.csv").read_bytes()
    last_frame()
    stop("table.csv", "--resume", "--workers", "1", row=1)
    told = capsys.readouterr().err
    said = "interrupted before the first new frame was finished: table.csv is as it was; the same"
    assert said in told
    stop("table.csv", "--resume", "--workers", "1", row=4)
    assert "interrupted after 3 of 5 frames; the same command goes on" in capsys.readouterr().err
    assert Path("table.csv").read_bytes() == before
    assert compute("table.csv", "--resume") == (0, 2)
    assert is_whole("table.csv")


def test_columns_digits_and_warnings_are_those_of_the_table(compute, last_frame, is_whole):
    """Columns that were left out are no failure."""
    words = ("--fields", "source,frame,variant,strain", "--digits", "4")
    path = Path("table.csv.manifest.json")
    assert compute("table.csv", *words) == (0, 4)
    path.write_text(json.dumps({**json.loads(path.read_text()), "warnings": ["frame 1: this"]}))
    last_frame()
    assert compute("table.csv", *words, "--resume") == (0, 1)
    assert read_manifest(Path("table.csv"))["warnings"] == ["frame 1: this"]
    assert is_whole("table.csv", *words)


def test_a_figure_needs_its_columns(compute, capsys):
    few = ("--fields", "source,frame,variant,alpha_vs_axial")
    figure = ("--resume", "--plot", "plot.png")
    assert compute("table.csv", *few) == (0, 4)
    assert compute("table.csv", *few, *figure) == (2, 0)
    said = (
        "its rows lack strain, alpha_c_axial (--fields), which the figure needs: leave out --plot"
    )
    assert said in capsys.readouterr().err
    assert not Path("plot.png").exists()
    # one of frames is drawn of the dumps
    assert compute("table.csv", *few, *figure, "--figure", "histogram")[0] == 0
    assert Path("plot.png").stat().st_size > 1000


@pytest.mark.parametrize("last", ["job.write_rows", "job.write_manifest", "record.PartFile.remove"])
@pytest.mark.parametrize("is_new", [True, False])
def test_a_run_killed_before_its_last_step(compute, monkeypatch, is_whole, capsys, last, is_new):
    """FILE.part is still there: merge refuses the table, and --resume gives the same bytes."""
    # a table of other settings is not to be taken for one of these
    assert is_new or compute("t.csv", "--seed", "3") == (0, 4)

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(f"scanfab.pipeline.{last}", killed)
        assert compute("t.csv") == (130, 4)
    assert run(["merge", "t.csv", "-o", "merged.csv"]) == 1
    assert "t.csv: is not finished" in capsys.readouterr().err
    assert compute("t.csv", "--resume") == (0, 0)
    assert is_whole("t.csv")


# what both have in common


@pytest.fixture(params=["part", "table"])
def begun(request, compute, stop):
    """Leaves a FILE.part or a FILE behind, and says which."""

    def begin(*words: str, **sources: tuple[str, ...]) -> str:
        if request.param == "part":
            stop("t.csv", *words, **sources)
            return "t.csv.part"
        assert compute("t.csv", *words, **sources)[0] == 0
        return "t.csv"

    return begin


@pytest.fixture
def is_refused(compute, capsys):
    def is_refused(left: str, reason: str, *words: str, **sources: tuple[str, ...]) -> bool:
        before = Path(left).read_bytes()
        assert compute("t.csv", *words, "--resume", **sources) == (2, 0)
        assert f"{left}: --resume cannot go on with it: {reason}" in capsys.readouterr().err
        return Path(left).read_bytes() == before

    return is_refused


def test_other_settings_are_refused_and_named(begun, is_refused):
    words = ("--digits", "5", "--rv", "0.6", "--contacts", "geometric")
    assert is_refused(begun(), "it was made with other settings (contacts, digits, rv)", *words)


def test_other_inputs_are_refused(begun, is_refused, dumps):
    left, first = begun(), dumps / "dump_0.txt"
    text = first.read_text()
    for changed in (text.replace("0.5", "0.49"), text + text):
        first.write_text(changed)
        assert is_refused(left, "dumps/dump_0.txt has changed since")
    first.write_text(text)
    for new in ("dump_50.txt", "pairs_100.txt"):
        content = dump_text(cubic_rows(), step=50) if new == "dump_50.txt" else pairs_text(step=100)
        write(dumps / new, content)
        assert is_refused(left, f"dumps/{new} is new, and not behind the last frame")
        (dumps / new).unlink()
    first.unlink()
    assert is_refused(left, "dumps/dump_0.txt is not among the files that are read")


def test_a_dump_of_many_snapshots_may_grow(begun, compute, five_frames, is_whole):
    texts = [(five_frames / f"dump_{100 * k}.txt").read_text() for k in range(5)]
    dump = {"sources": (str(write(Path("dump.txt"), "".join(texts[:3]))),)}
    begun(**dump)
    Path("dump.txt").write_text("".join(texts))
    assert compute("t.csv", "--resume", **dump)[0] == 0
    assert is_whole("t.csv", **dump)


TABLES = [("--strain", "step,strain", "0.1"), ("--cell", "step,lx,ly,lz", "4,4,4")]


@pytest.mark.parametrize(("option", "header", "row"), TABLES)
def test_numbers_of_the_frames_may_only_get_more_lines(
    begun, compute, last_frame, is_refused, is_whole, option, header, row
):
    lines = [header, *(f"{step},{row}" for step in (0, 100, 200, 300))]
    file = write(Path("numbers.csv"), "\n".join(lines))
    left, text = begun(option, "numbers.csv"), file.read_text()
    # the second is the last number with one digit more
    for changed in (text.replace(f"100,{row}", f"100,{row}1"), text + "5"):
        file.write_text(changed)
        assert is_refused(left, "numbers.csv has changed since", option, "numbers.csv")
    file.write_text(f"{text}\n400,{row}\n")
    last_frame()
    assert compute("t.csv", option, "numbers.csv", "--resume")[0] == 0
    assert is_whole("t.csv", option, "numbers.csv")


def test_strains_that_frames_get_later_are_refused(begun, is_refused):
    """Their rows have none."""
    file = write(Path("s.csv"), "step,strain\n0,0\n")
    left = begun("--strain", "s.csv")
    file.write_text(f"{file.read_text()}100,0.2\n")
    assert is_refused(left, "s.csv has changed since", "--strain", "s.csv")


def test_what_is_read_beside_the_grains_is_an_input(compute):
    """The cell, as YADE has it."""
    shutil.copytree(SAMPLE_DATA / "yade_strained", "yade")
    words = ("--contacts", "geometric", "--resume")
    source = {"sources": ("yade/before-spheres-*",)}
    assert compute("t.csv", *words, **source) == (0, 3)
    cells = sorted(Path("yade").glob("before-periCell-*"))
    listed = {one["path"] for one in read_manifest(Path("t.csv"))["inputs"]}
    assert {str(path) for path in cells} <= listed
    assert compute("t.csv", *words, **source) == (0, 0)
    cells[0].write_bytes(gzip.compress(b"something else"))
    assert compute("t.csv", *words, **source) == (2, 0)


def test_a_run_without_rows_leaves_the_table_that_is_there(compute, capsys):
    """In an array of more jobs than frames, a job without frames still writes its own table."""
    assert compute("table.csv")[0] == 0
    before = Path("table.csv").read_bytes()
    capsys.readouterr()
    assert compute("table.csv", "--frames", "9:")[0] == 1
    assert (
        "this run has no rows, so the table that is there stays as it is" in capsys.readouterr().err
    )
    assert Path("table.csv").read_bytes() == before
    assert [compute("other.csv", "--frames", "9:")[0] for _ in range(2)] == [0, 0]
