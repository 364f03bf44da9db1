"""--resume: what FILE.part or a complete FILE holds is taken over, what is missing is computed."""

import gzip
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from scanfab.cli.main import run
from scanfab.pipeline.frame import compute_frame
from scanfab.pipeline.record import read_manifest
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text, write
from tests.helpers.interruptions import FAST, PROGRAM, interrupted_at_row
from tests.helpers.truth import SAMPLE_DATA
from tests.helpers.windows import corners_of_a_box, surface


@pytest.fixture
def dumps(series, tmp_path, monkeypatch):
    """A folder whose last frame is not written yet, in the working directory."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(series, "dumps", ignore=lambda *_: ["dump_400.txt"])
    return Path("dumps")


@pytest.fixture
def last_frame(series, dumps):
    """Adds the last frame."""
    return lambda: shutil.copy(series / "dump_400.txt", dumps)


@pytest.fixture
def compute(dumps, monkeypatch, capsys):
    """Runs the command; says its exit code, and how many frames it has tried to compute."""
    counted = Mock(wraps=compute_frame)
    monkeypatch.setattr("scanfab.pipeline.compute.compute_frame", counted)

    def compute(output: str, *words: str, sources: tuple[str, ...] = ("dumps",), told: str = ""):
        counted.reset_mock()
        capsys.readouterr()
        code = run(["compute", *sources, *FAST, "-o", output, *words])
        assert told in capsys.readouterr().err
        return code, counted.call_count

    return compute


@pytest.fixture
def stop(compute, monkeypatch):
    """Runs a command that is interrupted in the middle of its third frame, or before a row."""

    def stop(output: str, *words: str, row: int = 6, **more: Any) -> None:
        with interrupted_at_row(monkeypatch, row):
            assert compute(output, *words, **more)[0] == 130

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


@pytest.fixture
def resumes(compute, is_whole):
    """Whether --resume computes so many frames, and ends with what one run makes."""

    def resumes(output: str, frames: int, *words: str, code: int = 0, **more: Any) -> bool:
        found = compute(output, *words, "--resume", **more)
        more.pop("told", None)
        return found == (code, frames) and is_whole(output, *words, **more)

    return resumes


# FILE.part


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_a_run_that_is_killed(dumps, compute, is_whole):
    """tests.campaigns.interrupt does it at random, again and again, by other signals too."""
    part, words = Path("t.csv.part"), ("--tolerance", "5e-3", "--workers", "1")
    command = [*PROGRAM, "compute", "dumps", *FAST, *words, "-o", "t.csv"]
    with subprocess.Popen(command) as process:
        while process.poll() is None and (not part.exists() or part.read_bytes().count(b"\n") < 2):
            time.sleep(0.002)
        process.kill()
        assert process.wait(60) in (-signal.SIGKILL, 0)
    assert compute("t.csv", *words, "--resume")[0] == 0
    assert is_whole("t.csv", *words)


INTERRUPTED = [
    (".csv", 6, ("--rv-shape", "box", "--rv-follows", "strain", "--strain", "grains")),
    # equal cut-offs too: every frame has as many rows as were asked for
    (".json", 15, ("--cutoffs", "0.2rmin,0.05,0.2rmin", "--seed", "3")),
    (".parquet", 8, ("--rv", "0.5,0.7")),
]


@pytest.mark.parametrize(("suffix", "row", "words"), INTERRUPTED)
def test_an_interrupted_run_is_gone_on_with(stop, last_frame, resumes, suffix, row, words):
    """And frames that come later are added to the complete table."""
    table, told = f"table{suffix}", "after 2 of 4 frames; the same command with --resume goes on\n"
    stop(table, *words, row=row, told=f"interrupted {told}")
    assert not Path(table).exists()
    with open(f"{table}.part", "ab") as part:
        part.write(b'{"inputs": [], "rows"')  # killed while it wrote a frame
    assert resumes(table, 2, *words, "--workers", "1")
    last_frame()
    assert resumes(table, 1, *words, "--workers", "1")


def test_without_resume_the_part_is_kept_under_another_name(compute, stop, resumes):
    """And what made it goes on with it there."""
    told = "note: table.csv.part: the finished frames of an earlier run are kept as table.1.csv"
    stop("table.csv", "--seed", "1")
    stop("table.csv", "--seed", "2", told=told)
    assert compute("table.csv", told="by -o table.2.csv --resume") == (0, 4)
    for number in ("1", "2"):
        assert resumes(f"table.{number}.csv", 2, "--seed", number)


def test_how_far_an_interrupted_run_is_is_told(dumps, stop, compute, capsys):
    stop("-", row=4, told="after 1 of 4 frames: with -o FILE, --resume could go on")
    stop("t.csv", row=2, told="interrupted after 0 of 4 frames; the same command with --resume")
    assert not list(Path().glob("t.csv*"))
    (dumps / "dump_200.txt").write_text("ITEM: TIMESTEP\n")
    told = "stopped after 2 of 4 frames; the same command with --resume goes on\nscanfab: error: "
    assert compute("t.csv", "--workers", "1", told=told)[0] == 1
    write(dumps / "dump_200.txt", dump_text(cubic_rows()[8:], step=200))
    words = ("--boundary", "id<=8", "--strain", "boundary", "--workers", "1", "-o", "wrong.csv")
    assert run(["compute", "dumps", *FAST, *words]) == 1
    told = capsys.readouterr().err
    assert "error: --strain: boundary was asked for" in told
    assert "goes on" not in told


def test_where_there_are_no_locks_runs_go_on(compute, monkeypatch):
    fcntl = pytest.importorskip("fcntl", reason="such locks are POSIX")
    monkeypatch.setattr(fcntl, "flock", Mock(side_effect=OSError(95, "Operation not supported")))
    assert compute("table.csv")[0] == 0


def test_a_damaged_part_is_refused_and_kept(compute, stop):
    stop("table.csv")
    part, told = Path("table.csv.part"), "table.csv.part: expected what an interrupted run has"
    _, frames = part.read_bytes().split(b"\n", 1)
    for first in (b"{", b'{"settings": 3}', b"\xfc"):
        before = b"%b\n%b" % (first, frames)
        part.write_bytes(before)
        assert compute("table.csv", "--resume", told=told) == (1, 0)
        assert part.read_bytes() == before
    assert compute("table.csv")[0] == 0
    assert Path("table.1.csv.part").read_bytes() == before


def test_frames_that_a_part_has_and_nobody_chooses_now_stay(dumps, compute, stop, is_whole):
    stop("table.csv", "--frames=-3:")
    shutil.copy(dumps / "dump_300.txt", dumps / "dump_500.txt")
    assert compute("table.csv", "--frames=-3:", "--resume") == (0, 2)
    assert is_whole("table.csv", "--frames=1:")


def test_dumps_behind_the_rows_of_a_part_may_change(dumps, stop, resumes):
    """Those of an earlier source too, if they are new there."""
    Path("first").mkdir()
    shutil.copy(dumps / "dump_0.txt", "first")
    both = {"sources": ("first", "dumps")}
    stop("table.csv", **both)
    last = dumps / "dump_300.txt"
    last.write_text(last.read_text().replace(" 0.5", " 0.49", 1))
    shutil.copy(last, dumps / "dump_400.txt")
    shutil.copy(dumps / "dump_100.txt", "first")
    assert resumes("table.csv", 5, **both)


# a complete FILE


JOINED = [("-1:", "-2:", "-2:"), ("::2", "1", "0:3")]


@pytest.mark.parametrize(("first", "then", "every"), JOINED)
def test_other_frames_join_those_of_the_table(compute, is_whole, first, then, every):
    """No frame of the table is lost."""
    assert compute("table.csv", f"--frames={first}")[0] == 0
    assert compute("table.csv", "--resume", f"--frames={then}") == (0, 1)
    assert is_whole("table.csv", f"--frames={every}")


def test_frames_that_nobody_has_chosen_stay_out(compute, last_frame, is_whole):
    """Those that make no slice with the frames of the table are refused."""
    assert compute("table.csv") == (0, 4)
    last_frame()
    assert compute("table.csv", "--resume", "--frames=:1") == (0, 0)
    assert is_whole("table.csv", "--frames=:4")
    assert read_manifest(Path("table.csv"))["settings"]["frames"] == "0:4"
    assert compute("few.csv", "--frames=:2")[0] == 0
    told = "holds frames 0 to 1, which with those chosen now make no slice"
    assert compute("few.csv", "--resume", "--frames=4:", told=told) == (2, 0)
    assert is_whole("few.csv", "--frames=:2")


def test_a_table_that_does_not_tell_what_made_it_is_refused(compute):
    few = ("few.csv", "--fields", "strain,alpha_vs")
    assert compute(*few)[0] == 0
    assert compute(*few, "--resume", told="it lacks the columns source and frame") == (2, 0)
    Path("few.csv.manifest.json").unlink()
    assert compute("few.csv", "--resume", told="there is no few.csv.manifest.json") == (2, 0)


def test_a_frame_that_was_skipped_is_tried_again(compute, dumps, stop, resumes):
    """As long as it cannot be read the exit code is 1; once it can, its rows are there."""
    second, skip = dumps / "dump_100.txt", ("--on-error", "skip")
    good = second.read_text()
    second.write_text("ITEM: TIMESTEP\n")
    stop("table.csv", *skip, row=5)
    for tried in (2, 1):
        assert resumes("table.csv", tried, *skip, code=1, told="frame 1 skipped")
    # with two frames in place of one, later frames would have other numbers
    second.write_text(good + good.replace("TIMESTEP\n100", "TIMESTEP\n150"))
    assert compute("table.csv", *skip, "--resume") == (2, 0)
    second.write_text(good)
    assert resumes("table.csv", 1, *skip)


def test_part_and_table_are_gone_on_with_together(compute, stop, last_frame, resumes):
    assert compute("table.csv", "--frames=2:4") == (0, 2)
    before, more = Path("table.csv").read_bytes(), ("--resume", "--workers", "1")
    last_frame()
    for row, done in ((5, 2), (4, 3)):
        told = f"interrupted after {done} of 5 frames; the same command goes on"
        stop("table.csv", *more, row=row, told=told)
    assert Path("table.csv").read_bytes() == before
    assert resumes("table.csv", 2)


def test_columns_digits_and_warnings_are_those_of_the_table(compute, last_frame, resumes):
    """Columns that were left out are no failure."""
    words = ("--fields", "source,frame,variant,strain", "--digits", "4")
    path = Path("table.csv.manifest.json")
    assert compute("table.csv", *words) == (0, 4)
    path.write_text(json.dumps({**json.loads(path.read_text()), "warnings": ["frame 1: this"]}))
    last_frame()
    assert resumes("table.csv", 1, *words)
    assert read_manifest(Path("table.csv"))["warnings"] == ["frame 1: this"]


def test_a_figure_is_drawn_of_the_columns_that_the_rows_have(compute):
    """One of frames is drawn of the dumps."""
    few = ("--fields", "source,frame,variant,alpha_vs_axial")
    assert compute("table.csv", *few) == (0, 4)
    figure = ("--resume", "--plot", "plot.PNG", "--figure", "histogram")
    assert compute("table.csv", *few, *figure)[0] == 0
    assert Path("plot.PNG").stat().st_size > 1000


@pytest.mark.parametrize("last", ["job.write_rows", "job.write_manifest", "record.PartFile.remove"])
def test_a_run_killed_before_its_last_step(compute, monkeypatch, resumes, capsys, last):
    """FILE.part is still there: merge refuses the table, and --resume gives the same bytes."""
    # a table of other settings is not to be taken for one of these
    assert compute("t.csv", "--seed", "3") == (0, 4)
    with monkeypatch.context() as patch:
        patch.setattr(f"scanfab.pipeline.{last}", Mock(side_effect=KeyboardInterrupt))
        assert compute("t.csv") == (130, 4)
    assert run(["merge", "t.csv", "-o", "merged.csv"]) == 1
    assert "t.csv: is not finished" in capsys.readouterr().err
    assert resumes("t.csv", 0)


# what both have in common


@pytest.fixture(params=["part", "table"])
def begun(request, compute, stop):
    """Leaves a FILE.part or a FILE behind, and says which."""

    def begin(*words: str, **sources: tuple[str, ...]) -> str:
        if request.param == "table":
            assert compute("t.csv", *words, **sources)[0] == 0
            return "t.csv"
        stop("t.csv", *words, **sources)
        return "t.csv.part"

    return begin


@pytest.fixture
def is_refused(compute):
    def is_refused(left: str, reason: str, *words: str) -> bool:
        before = Path(left).read_bytes()
        told = f"{left}: --resume cannot go on with it: {reason}"
        assert compute("t.csv", *words, "--resume", told=told) == (2, 0)
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
    for new, content in (("dump_50.txt", text), ("pairs_100.txt", pairs_text(step=100))):
        write(dumps / new, content.replace("TIMESTEP\n0", "TIMESTEP\n50"))
        assert is_refused(left, f"dumps/{new} is new, and not behind the last frame")
        (dumps / new).unlink()
    first.unlink()
    assert is_refused(left, "dumps/dump_0.txt is not among the files that are read")


def test_a_dump_of_many_snapshots_may_grow(begun, compute, series, is_whole):
    texts = [(series / f"dump_{100 * k}.txt").read_text() for k in range(5)]
    dump = {"sources": (str(write(Path("dump.txt"), "".join(texts[:3]))),)}
    begun(**dump)
    Path("dump.txt").write_text("".join(texts))
    assert compute("t.csv", "--resume", **dump)[0] == 0
    assert is_whole("t.csv", **dump)


@pytest.mark.parametrize("begun", ["table"], indirect=True)
def test_a_surface_that_has_changed_is_refused(begun, is_refused):
    words = ("--rv-shape", surface("box.ply", 2 + corners_of_a_box(1.2)))
    left = begun(*words)
    surface("box.ply", 2 + corners_of_a_box(1.1))
    assert is_refused(left, "box.ply has changed since", *words)


NUMBERS = [
    ("part", "--strain", "step,strain", "0.1"),
    ("table", "--cell", "step,lx,ly,lz", "4,4,4"),
]


@pytest.mark.parametrize(("begun", "option", "header", "row"), NUMBERS, indirect=["begun"])
def test_numbers_of_the_frames_may_only_get_more_lines(
    begun, compute, last_frame, is_refused, is_whole, option, header, row
):
    text = "\n".join([header, *(f"{step},{row}" for step in (0, 100, 200, 300))])
    file, words, told = write(Path("n.csv"), text), (option, "n.csv"), "n.csv has changed since"
    left = begun(*words)
    # the second is the last number with one digit more
    for changed in (text.replace(f"100,{row}", f"100,{row}1"), text + "5"):
        file.write_text(changed)
        assert is_refused(left, told, *words)
    file.write_text(f"{text}\n400,{row}\n")
    last_frame()
    assert compute("t.csv", *words, "--resume")[0] == 0
    assert is_whole("t.csv", *words)
    # rows whose frame had no strain then would have one now
    if option == "--strain":
        file.write_text("step,strain\n0,0\n")
        left = begun(*words, "--seed", "2")
        file.write_text("step,strain\n0,0\n100,0.2\n")
        assert is_refused(left, told, *words, "--seed", "2")


def test_what_is_read_beside_the_grains_is_an_input(compute):
    """The cell, as YADE has it."""
    shutil.copytree(SAMPLE_DATA / "yade_strained", "yade")
    words = ("--contacts", "geometric", "--resume")
    source = {"sources": ("yade/before-spheres-*",)}
    assert compute("t.csv", *words, **source) == (0, 3)
    assert compute("t.csv", *words, **source) == (0, 0)
    cell, *_ = sorted(Path("yade").glob("before-periCell-*"))
    cell.write_bytes(gzip.compress(b"something else"))
    assert compute("t.csv", *words, **source) == (2, 0)


def test_series_have_references_of_their_own_and_must_be_named_again(compute, resumes):
    """The last frame of each, whose number would be another in a longer series."""
    Path("few").mkdir()
    shutil.copy("dumps/dump_0.txt", "few")
    both = {"sources": ("dumps", "few")}
    assert compute("table.csv", "--reference=-1", **both) == (0, 5)
    assert read_manifest(Path("table.csv"))["settings"]["references"] == [3, 0]
    assert resumes("table.csv", 0, "--reference=-1", **both)
    assert compute("alone.csv", "--reference=-1") == (0, 4)
    assert read_manifest(Path("alone.csv"))["settings"]["reference"] == 3
    assert compute("table.csv", "--reference=3", "--resume", told="settings (reference") == (2, 0)
    assert compute("t.csv", **both) == (0, 5)
    assert compute("t.csv", "--resume", told="its source few is not named now") == (2, 0)
