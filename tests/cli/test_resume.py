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
from scanfab.pipeline import measurement
from scanfab.pipeline.part import PartFile
from scanfab.pipeline.record import read_manifest
from scanfab.table.formats import OWN_FORMATS, Json
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import PROGRAM, interrupted_at_row, write_series
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")
every_format = pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])


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
    """Runs the command; says its exit code, and how many frames it has scanned."""
    scan, scanned = measurement.scan_to_tolerance, []
    monkeypatch.setattr(
        measurement, "scan_to_tolerance", lambda *words: scanned.append(1) or scan(*words)
    )

    def compute(output: str, *words: str, sources: tuple[str, ...] = ("dumps",)):
        scanned.clear()
        return run(["compute", *sources, *FAST, "-o", output, *words]), len(scanned)

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
def test_a_run_stopped_by_signals_again_and_again(dumps, compute, is_whole):
    part = Path("t.csv.part")
    for sent, code in ((signal.SIGTERM, 143), (signal.SIGKILL, -9), (signal.SIGINT, 130)):
        before = part.stat().st_size if part.exists() else 0
        words = ["compute", "dumps", *FAST, "--tolerance", "1e-3", "--workers", "1"]
        with subprocess.Popen(
            [*PROGRAM, *words, "--resume", "-o", "t.csv"], stderr=subprocess.DEVNULL
        ) as process:
            end = time.monotonic() + 60
            while (
                not part.exists()
                or part.read_bytes().count(b"\n") < 2
                or before == (part.stat().st_size)
            ):
                assert time.monotonic() < end
                time.sleep(0.002)
            process.send_signal(sent)
            assert process.wait(60) in (code, 0)
        if not part.exists():
            break
    assert compute("t.csv", "--tolerance", "1e-3", "--resume")[0] == 0
    assert is_whole("t.csv", "--tolerance", "1e-3")


@every_format
def test_an_interrupted_run_is_gone_on_with(compute, stop, is_whole, capsys, suffix):
    table = f"table{suffix}"
    stop(table)
    told = capsys.readouterr().err
    assert told.endswith(
        "interrupted after 2 of 4 frames; the same command with --resume goes on\n"
    )
    assert not Path(table).exists()
    assert compute(table, "--resume", "--workers", "1") == (0, 2)
    assert "interrupted" not in capsys.readouterr().err
    assert is_whole(table)


def test_without_a_part_everything_is_computed(compute, is_whole, capsys):
    assert compute("table.csv", "--resume") == (0, 4)
    assert is_whole("table.csv")
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


def test_a_failure_behind_the_last_frame_says_so(compute, capsys, monkeypatch):
    def full(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(Json, "write", full)
    assert compute("table.json")[0] == 1
    said = "stopped after the last frame, before the table was complete; the same command with"
    assert said in capsys.readouterr().err


def test_frames_that_an_earlier_run_skipped_are_not_forgotten(compute, dumps, stop, is_whole):
    """Exit code 1, as without the interruption."""
    (dumps / "dump_100.txt").write_text("ITEM: TIMESTEP\n")
    stop("table.csv", "--on-error", "skip", row=5)
    assert compute("table.csv", "--on-error", "skip", "--resume") == (1, 1)
    assert is_whole("table.csv", "--on-error", "skip")


def test_a_second_run_into_the_same_file_is_refused(compute, capsys, monkeypatch, is_whole):
    """However it begins; and the first goes on undisturbed."""
    add, codes = PartFile.add, []

    def second_run_meanwhile(self, *words):
        add(self, *words)
        if not codes:
            codes.append(None)
            codes[:] = [compute("table.csv", *more)[0] for more in (["--resume"], [])]

    with monkeypatch.context() as patch:
        patch.setattr(PartFile, "add", second_run_meanwhile)
        assert compute("table.csv")[0] == 0
    assert codes == [1, 1]
    assert "error: table.csv.part: another run is writing to it" in capsys.readouterr().err
    assert is_whole("table.csv")


def test_where_there_are_no_locks_runs_go_on(compute, monkeypatch):
    fcntl = pytest.importorskip("fcntl", reason="such locks are POSIX")

    def none(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", none)
    assert compute("table.csv")[0] == 0


@pytest.mark.parametrize("text", ["{", "[1]", "", '{"settings": 3}', '{"settings": {}}\n7', "ü"])
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


def test_a_part_that_is_a_pipe_is_refused_at_once(compute, capsys):
    os.mkfifo("table.csv.part")
    assert compute("table.csv") == (2, 0)
    assert "table.csv.part: is a pipe, expected a file or nothing" in capsys.readouterr().err


def test_frames_that_a_part_has_and_nobody_chooses_now_are_refused(dumps, stop, compute, capsys):
    stop("table.csv", "--frames=-3:")
    shutil.copy(dumps / "dump_300.txt", dumps / "dump_500.txt")
    assert compute("table.csv", "--frames=-3:", "--resume") == (2, 0)
    assert "it holds frame 1, which is not chosen now" in capsys.readouterr().err


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


@every_format
def test_frames_that_came_later_are_added(compute, last_frame, is_whole, suffix):
    table = f"table{suffix}"
    assert compute(table) == (0, 4)
    last_frame()
    assert compute(table, "--resume", "--workers", "1") == (0, 1)
    assert is_whole(table)
    assert compute(table, "--resume") == (0, 0)
    assert is_whole(table)


def test_a_table_that_is_replaced_is_told_of(compute, capsys):
    note = "table.csv: the table that is there will be replaced at the end of this run; --resume"
    for words, is_told in (((), False), (("--resume",), False), ((), True)):
        assert compute("table.csv", *words)[0] == 0
        assert (note in capsys.readouterr().err) == is_told


def test_rows_of_several_sources_stay_in_their_order(compute, five_frames, last_frame, is_whole):
    both = {"sources": ("dumps", str(five_frames))}
    assert compute("table.csv", **both) == (0, 9)
    last_frame()
    assert compute("table.csv", "--resume", **both) == (0, 1)
    assert is_whole("table.csv", **both)


@pytest.mark.parametrize(
    ("first", "then", "every", "computed"),
    [
        ("1:3", ":3", ":3", 1),
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


def test_frames_that_make_no_slice_are_refused(compute, last_frame, capsys):
    last_frame()
    assert compute("table.csv", "--frames=:2")[0] == 0
    before = Path("table.csv").read_bytes()
    assert compute("table.csv", "--resume", "--frames=4:") == (2, 0)
    said = "holds frames 0 to 1, which with those chosen now make no slice"
    assert said in capsys.readouterr().err
    assert Path("table.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("first", "spoil", "said"),
    [
        ((), lambda: Path("table.csv.manifest.json").unlink(), "there is no table.csv.manifest"),
        (("--fields", "strain,alpha_vs"), lambda: None, "it lacks the columns source and frame"),
    ],
)
def test_a_table_that_does_not_tell_what_made_it_is_refused(compute, capsys, first, spoil, said):
    assert compute("table.csv", *first)[0] == 0
    spoil()
    assert compute("table.csv", *first, "--resume") == (2, 0)
    assert said in capsys.readouterr().err


def test_a_frame_that_was_skipped_is_tried_again(compute, dumps, is_whole, capsys):
    """As long as it cannot be read the exit code is 1; once it can, its rows are there."""
    second, skip = dumps / "dump_100.txt", ("--on-error", "skip")
    good = second.read_text()
    second.write_text("ITEM: TIMESTEP\n")
    assert compute("table.csv", *skip) == (1, 3)
    assert compute("table.csv", *skip, "--resume") == (1, 0)
    assert "frame 1 skipped" in capsys.readouterr().err
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


def test_warnings_of_the_first_run_stay_in_the_manifest(compute, last_frame):
    assert compute("table.csv")[0] == 0
    path = Path("table.csv.manifest.json")
    found = json.loads(path.read_text())
    path.write_text(json.dumps({**found, "warnings": ["frame 1: something was told"]}))
    last_frame()
    assert compute("table.csv", "--resume")[0] == 0
    assert read_manifest(Path("table.csv"))["warnings"][0] == "frame 1: something was told"


@pytest.mark.parametrize(
    "words",
    [
        ("--fields", "source,frame,variant,alpha_vs_axial", "--digits", "4"),
        # columns that were left out are no failure
        ("--fields", "source,frame"),
    ],
)
def test_columns_and_digits_are_those_of_the_table(compute, last_frame, is_whole, words):
    assert compute("table.csv", *words) == (0, 4)
    last_frame()
    assert compute("table.csv", *words, "--resume") == (0, 1)
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
    Path("plot.png").unlink()
    all_of_it = ("--fields", "source,frame,variant,strain,alpha_vs_axial,alpha_c_axial")
    assert compute("table.csv", *all_of_it) == (0, 4)
    assert compute("table.csv", *all_of_it, *figure) == (0, 0)
    assert Path("plot.png").stat().st_size > 1000


@pytest.mark.parametrize(
    "last",
    ["pipeline.job.write_rows", "pipeline.job.write_manifest", "pipeline.part.PartFile.remove"],
)
@pytest.mark.parametrize("is_new", [True, False])
def test_a_run_killed_before_its_last_step(compute, monkeypatch, is_whole, capsys, last, is_new):
    """FILE.part is still there; a table that is complete counts, others go on to the same bytes."""
    # a table of other settings is not to be taken for one of these
    assert is_new or compute("t.csv", "--seed", "3") == (0, 4)

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(f"scanfab.{last}", killed)
        assert compute("t.csv") == (130, 4)
    is_finished = last.endswith("remove")
    assert run(["merge", "t.csv", "-o", "merged.csv"]) == (0 if is_finished else 1)
    assert ("t.csv: is not finished" in capsys.readouterr().err) != is_finished
    assert compute("t.csv", "--resume") == (0, 0)
    assert is_whole("t.csv")
    assert not is_finished or Path("merged.csv").read_bytes() == Path("t.csv").read_bytes()


# what both have in common


@pytest.fixture(params=["part", "table"])
def begun(request, compute, stop, capsys):
    """A FILE.part or a FILE; says whether it is left alone by a run, for some reason."""

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


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--seed", "1"], "seed"),
        (["--digits", "5", "--rv", "0.6"], "digits, rv"),
        (["--contacts", "geometric"], "contacts"),
    ],
)
def test_other_settings_are_refused_and_named(begun, is_refused, words, named):
    assert is_refused(begun(), f"it was made with other settings ({named})", *words)


def _changed() -> None:
    path = Path("dumps/dump_100.txt")
    path.write_text(path.read_text().replace("0.5", "0.49"))


def _earlier() -> None:
    write(Path("dumps/dump_50.txt"), dump_text(cubic_rows(), step=50, box=((0, 4),) * 3))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_changed, "dumps/dump_100.txt has changed since"),
        (_earlier, "dumps/dump_50.txt is new, and not behind the last frame"),
        (Path("dumps/dump_0.txt").unlink, "dumps/dump_0.txt is not among the files that are read"),
    ],
)
def test_other_inputs_are_refused(begun, is_refused, change, said):
    left = begun()
    change()
    assert is_refused(left, said)


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


@pytest.mark.parametrize(
    ("grains", "beside"),
    [("before-spheres-*", "before-periCell-*"), ("saved_spheres.*", "saved_*.xml*")],
)
def test_what_is_read_beside_the_grains_is_an_input(compute, is_refused, grains, beside):
    """The cell, as YADE has it."""
    shutil.copytree(SAMPLE_DATA / "yade_strained", "yade")
    words, source = ("--contacts", "geometric"), {"sources": (f"yade/{grains}",)}
    assert compute("t.csv", *words, **source) == (0, 3)
    cells = sorted(Path("yade").glob(beside))
    listed = {one["path"] for one in read_manifest(Path("t.csv"))["inputs"]}
    assert {str(path) for path in cells} <= listed
    assert compute("t.csv", *words, "--resume", **source) == (0, 0)
    cells[0].write_bytes(gzip.compress(b"something else"))
    assert compute("t.csv", *words, "--resume", **source) == (2, 0)
