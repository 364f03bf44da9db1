"""Every kind of bad input: the message, the exit code, and the untouched output."""

from __future__ import annotations

import csv
import errno
import gzip
import io
import os
import shlex
import shutil
import subprocess
import sys
import time
import tracemalloc
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from scanfab.base import plugins
from scanfab.cli.main import run
from scanfab.io import reader
from scanfab.table.writing import ResultFile
from tests.helpers.dumps import (
    PAIRS,
    cubic_rows,
    dump_text,
    pairs_text,
    write,
    yade_lines,
    yade_spheres,
)
from tests.helpers.interruptions import PROGRAM

SCAN = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")
BOX = ((0, 4),) * 3
HEADER = 9
"""Lines before the first grain."""


class Answer:
    """What a command printed, and its exit code."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *words: object) -> None:
        self.code = run(["compute", *SCAN, *map(str, words)])
        self.out, self.err = capsys.readouterr()
        assert "Traceback" not in self.err

    @property
    def rows(self) -> list[dict[str, str]]:
        return list(csv.DictReader(io.StringIO(self.out)))


@pytest.fixture
def compute(capsys):
    return lambda *words: Answer(capsys, *words)


@pytest.fixture
def refusal(compute, tmp_path_factory):
    """The one message of a command that fails, with nothing printed and FILE untouched."""

    def ask(*words, code=1):
        output = tmp_path_factory.mktemp("out") / "table.csv"
        output.write_text("precious")
        printed, written = compute(*words), compute(*words, "-o", output)
        assert printed.code == written.code == code
        assert printed.out == written.out == ""
        assert printed.err == written.err
        assert output.read_text() == "precious"
        assert os.listdir(output.parent) == [output.name]
        last = printed.err.strip().rpartition("scanfab: error: ")[2]
        assert last
        return last

    return ask


def grains(folder: Path, rows=None, name="dump_0.txt", **options) -> Path:
    """A dump of a small cube of grains, or of the given rows."""
    text = dump_text(cubic_rows() if rows is None else rows, box=BOX, **options)
    return write(folder / name, text)


def changed(column: int, value: object) -> list[tuple[object, ...]]:
    """The cube's rows with another value for the grain 7."""
    return [
        (*row[:column], value, *row[column + 1 :]) if row[0] == 7 else row for row in cubic_rows()
    ]


# the text of a dump


@pytest.mark.parametrize("share", [0.3, 0.7, 0.99])
def test_a_truncated_file(tmp_path, refusal, share):
    file = grains(tmp_path)
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    message = refusal(file)
    assert str(file) in message


def test_a_header_without_grains(tmp_path, refusal):
    file = grains(tmp_path)
    write(file, "\n".join(file.read_text().splitlines()[:HEADER]) + "\n")
    message = refusal(file)
    assert str(file) in message
    assert "counts 64 rows" in message
    assert "incomplete" in message


@pytest.mark.parametrize("words", ["7 1 0.5", "7 1 0.5 0.5 0.5 0.5 0.5"])
def test_a_wrong_number_of_columns_names_the_line(tmp_path, refusal, words):
    file = grains(tmp_path, cubic_rows(11))
    lines = file.read_text().splitlines()
    lines[1233] = words
    write(file, "\n".join(lines) + "\n")
    assert f"{file}, line 1234: " in refusal(file)


def test_text_where_a_number_belongs_names_line_and_text(tmp_path, refusal):
    file = grains(tmp_path, changed(3, "abc"))
    where = f"{file}, line {HEADER + 7}"
    assert f"{where}: expected a number in the column y, found 'abc'" in refusal(file)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
@pytest.mark.parametrize("column", [2, 4, 5])
def test_a_number_that_is_not_finite_names_the_grain(tmp_path, refusal, value, column):
    file = grains(tmp_path, changed(column, value))
    message = refusal(file)
    assert str(file) in message
    assert "grain 7" in message
    assert "finite" in message
    assert value in message


@pytest.mark.parametrize("radius", [0, -0.5])
def test_a_radius_of_zero_or_less_names_the_grain(tmp_path, refusal, radius):
    file = grains(tmp_path, changed(5, radius))
    message = refusal(file)
    assert str(file) in message
    assert "grain 7: the radius must be larger than zero" in message


def test_no_radius_says_how_to_give_one(tmp_path, refusal):
    file = grains(tmp_path, names="id type x y z mass")
    message = refusal(file)
    assert str(file) in message
    assert "no radius: expected a column radius (or diameter), found" in message
    assert "--radius" in message


def test_a_diameter_does_as_well(tmp_path, compute):
    rows = cubic_rows()
    by_radius = compute(grains(tmp_path, rows))
    doubled = [(*row[:5], 2 * row[5]) for row in rows]
    by_diameter = compute(grains(tmp_path, doubled, names="id type x y z diameter"))
    assert by_diameter.code == 0
    assert by_diameter.out == by_radius.out


def test_an_id_that_occurs_twice_is_named(tmp_path, refusal):
    message = refusal(grains(tmp_path, changed(0, 8)))
    assert "dump_0.txt: the id 8 occurs twice: 63 ids for 64 grains" in message


@pytest.mark.parametrize("count", ["65", "1000", "1000000000000000", "9" * 30])
def test_a_count_that_is_too_large_is_refused_at_once(tmp_path, refusal, count):
    file = grains(tmp_path)
    write(file, file.read_text().replace("\n64\n", f"\n{count}\n"))
    refusal(file)  # what is imported or compiled first does not count
    tracemalloc.start()
    start = time.perf_counter()
    message = refusal(file)
    seconds = time.perf_counter() - start
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    is_huge = len(count) > 18  # more than any whole number of the file can be
    words = "expected a whole number after ITEM: NUMBER OF" if is_huge else f"counts {count} rows"
    assert words in message
    assert seconds < 5
    assert most < 50e6


def test_the_last_snapshot_of_a_file_that_is_being_written_is_left_out(tmp_path, compute):
    whole = "".join(dump_text(cubic_rows(), step=step, box=BOX) for step in (0, 1, 2))
    answer = compute(write(tmp_path / "dump.txt", whole[:-500]))
    assert answer.code == 0
    assert {row["step"] for row in answer.rows} == {"0", "1"}
    assert "the last snapshot, number 3, is incomplete and is left out" in answer.err


@pytest.mark.parametrize("name", ["dump_0.txt", "dump_0.liggghts", "dump_0.vtk", "dump_0.vtu"])
def test_binary_junk_is_refused(tmp_path, refusal, name):
    file = tmp_path / name
    file.write_bytes(np.random.default_rng(0).bytes(10_000))
    assert str(file) in refusal(file)


def test_a_gzip_file_that_is_cut_short_is_refused(tmp_path, refusal):
    file = tmp_path / "dump_0.txt.gz"
    packed = gzip.compress(dump_text(cubic_rows(8), box=BOX).encode())
    file.write_bytes(packed[: len(packed) // 2])
    message = refusal(file)
    assert str(file) in message
    assert "Compressed file ended before the end-of-stream marker" in message


@pytest.mark.parametrize("format", ["yade", "vtk"])
def test_the_wrong_format_is_refused(tmp_path, refusal, format):
    file = grains(tmp_path)
    assert str(file) in refusal(file, "--format", format)


def test_a_format_that_does_not_exist_is_wrong_usage(tmp_path, compute):
    answer = compute(grains(tmp_path), "--format", "rocky")
    assert (answer.code, answer.out) == (2, "")
    assert "there is no reader called 'rocky'; the readers are " in answer.err


# contacts


def test_a_contact_that_names_a_missing_grain(tmp_path, refusal):
    grains(tmp_path)
    pairs = [(row, row + 1) for row in range(1, 60)]
    write(tmp_path / "pairs_0.txt", pairs_text([*pairs, (1, 9999)]))
    message = refusal(tmp_path)
    assert f"{tmp_path}/pairs_0.txt: contact 60 names the grain 9999" in message
    assert "not in the grain file" in message


def test_a_wall_is_no_missing_grain(tmp_path, compute):
    rows = np.array(cubic_rows())
    yade_spheres(tmp_path / "spheres-0.vtk", rows[:, 2:5], rows[:, 5])
    ends = [[rows[0, 2:5], rows[1, 2:5]], [rows[0, 2:5], rows[0, 2:5] - [0, 0, 0.5]]]
    yade_lines(tmp_path / "intrs-0.vtk", ends)
    answer = compute(tmp_path, "--variants", "a")
    assert answer.code == 0
    assert answer.rows[0]["contacts"] == "1"


def test_a_contact_file_of_another_step_is_not_taken(tmp_path, compute, refusal):
    grains(tmp_path, step=500)
    pairs = write(tmp_path / "pairs_0.txt", pairs_text(step=600))
    answer = compute(tmp_path)
    assert answer.code == 0
    assert "no contact file for step 500" in answer.err
    assert {row["contacts_from"] for row in answer.rows} == {"geometric"}
    assert "no contact file for step 500" in refusal(tmp_path, "--contacts", pairs)


def test_contacts_between_grains_far_apart_are_of_another_step(tmp_path, refusal):
    grains(tmp_path)
    write(tmp_path / "pairs_0.txt", pairs_text([*PAIRS, (1, 64)]))
    message = refusal(tmp_path)
    assert "the grains 1 and 64 are listed as a contact, but their centres are" in message
    assert "contact list belongs to another step" in message


def test_a_contact_file_of_other_ids(tmp_path, refusal):
    grains(tmp_path)
    pairs = [(row + 5000, row + 5001) for row in range(60)]
    write(tmp_path / "pairs_0.txt", pairs_text(pairs))
    message = refusal(tmp_path)
    assert f"{tmp_path}/pairs_0.txt: " in message
    assert "no two columns are surely the ids of grains of this step" in message


# folders and series


def test_an_empty_folder(tmp_path, refusal):
    assert refusal(tmp_path) == f"{tmp_path}: the folder holds no files"


def test_a_folder_that_nobody_can_read(tmp_path, refusal, monkeypatch):
    def forbidden(path):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "iterdir", forbidden)
    assert refusal(tmp_path) == f"{tmp_path}: Permission denied"


def test_two_series_in_a_folder_are_listed(tmp_path, refusal):
    for name in ("one_0.txt", "one_1.txt", "two_0.txt"):
        grains(tmp_path, name=name)
    message = refusal(tmp_path)
    assert "several series of grains: choose one of" in message
    assert f"{tmp_path}/one_*.txt" in message
    assert f"{tmp_path}/two_0.txt" in message
    assert "--contacts" not in message


def test_the_globs_of_two_series_match_their_own_files_only(tmp_path, refusal):
    for name in ("one_0.txt", "one_1.txt", "one_more_0.txt", "one_more_1.txt"):
        grains(tmp_path, name=name)
    write(tmp_path / "pairs_0.txt", pairs_text())
    lines = [line.strip() for line in refusal(tmp_path).splitlines()]
    found = [sorted(tmp_path.glob(Path(line).name)) for line in lines[1:3]]
    assert [[file.name for file in files] for files in found] == [
        ["one_0.txt", "one_1.txt"],
        ["one_more_0.txt", "one_more_1.txt"],
    ]
    assert len(lines) == 3


def test_files_that_no_glob_can_tell_apart_are_named(tmp_path, refusal):
    for name in ("dump_1.txt", "dump_1_big.txt", "dump_2.txt", "dump_2_big.txt"):
        grains(tmp_path, name=name)
    lines = [line.strip() for line in refusal(tmp_path).splitlines()]
    assert lines[1:] == [
        f"{tmp_path}/dump_1.txt {tmp_path}/dump_2.txt",
        f"{tmp_path}/dump_*_big.txt",
    ]


def test_two_files_for_one_step_are_both_named(tmp_path, refusal):
    for name in ("dump_7.txt", "dump_07.txt"):
        grains(tmp_path, name=name)
    message = refusal(tmp_path)
    assert "two files for one step" in message
    assert "dump_7.txt" in message
    assert "dump_07.txt" in message


@pytest.fixture
def partly_broken(tmp_path):
    """Three frames, the second one with a radius of zero."""
    for frame in range(3):
        rows = changed(5, 0) if frame == 1 else cubic_rows()
        grains(tmp_path, rows, name=f"dump_{frame}.txt", step=frame)
    return tmp_path


def test_a_broken_frame_stops_and_keeps_the_rows_before(partly_broken, compute, tmp_path_factory):
    output = tmp_path_factory.mktemp("out") / "table.csv"
    answer = compute(partly_broken, "-o", output)
    assert (answer.code, answer.out) == (1, "")
    assert "dump_1.txt: grain 7: the radius must be larger than zero" in answer.err
    assert not output.exists()
    assert len(Path(f"{output}.part").read_text().splitlines()) == 4


@pytest.mark.parametrize("workers", [1, 2])
def test_a_broken_frame_can_be_skipped(partly_broken, compute, workers):
    answer = compute(partly_broken, "--on-error", "skip", "--workers", workers)
    assert answer.code == 1
    assert [row["frame"] for row in answer.rows] == list("00002222")
    assert f"frame 1 skipped: {partly_broken}/dump_1.txt: grain 7" in answer.err


def test_the_first_frame_can_be_skipped(partly_broken, compute):
    grains(partly_broken, changed(5, 0), step=0)
    answer = compute(partly_broken, "--on-error", "skip")
    assert answer.code == 1
    assert {row["frame"] for row in answer.rows} == {"2"}


# what does not fit the sample


def test_positions_outside_a_box_that_is_not_periodic_are_fine(tmp_path, compute):
    """The box of such a direction enters nowhere: programs let grains leave it."""
    shifted = [(*row[:4], row[4] + 1024, row[5]) for row in cubic_rows()]
    near, far = compute(grains(tmp_path)), compute(grains(tmp_path, shifted))
    assert far.code == 0
    for one, other in zip(near.rows, far.rows, strict=True):
        assert float(one["alpha_vs"]) == pytest.approx(float(other["alpha_vs"]), rel=1e-6)
        assert one["contacts"] == other["contacts"]


def test_one_grain_far_away_is_too_far_for_the_whole_alone(tmp_path, refusal, compute):
    file = grains(tmp_path, changed(4, 4000.0))
    assert "leave out grains that are far away from all others" in refusal(file)
    found = compute(file, "--variants", "c")
    assert found.code == 0
    assert '--boundary "id=7"' in found.err
    assert found.rows[0]["grains"] == compute(grains(tmp_path), "--variants", "c").rows[0]["grains"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--rv-radius", "0.01", "--rv-center", "2", "2", "-1.2"], "holds no grain"),
        (["--rv-radius", "1", "--rv-center", "50", "2", "2"], "holds no grain"),
        (["--rv-radius", "2", "--rv-center", "6", "2", "2"], "beyond the sample"),
        (["--rv-radius", "4"], "beyond the sample"),
        (["--rv", "3"], "beyond the sample"),
        (
            ["--rv", "70"],
            "--rv, which is a fraction of half the sample's smallest extent, such as 0.7",
        ),
    ],
)
def test_an_rv_without_grains_or_larger_than_the_sample(tmp_path, refusal, options, message):
    said = refusal(grains(tmp_path), *options)
    assert said.startswith("the RV (radius ")
    assert message in said
    assert "--rv-center" in said


def test_an_rv_at_the_surface_is_a_warning(tmp_path, compute):
    file = grains(tmp_path, cubic_rows(8))
    near, inside = compute(file, "--rv", "0.9"), compute(file, "--rv", "0.7")
    assert near.code == inside.code == 0
    assert "comes within one of the largest radii" in near.err
    assert "comes within" not in inside.err


def test_a_boundary_on_a_missing_column_names_those_that_exist(tmp_path, refusal):
    message = refusal(grains(tmp_path), "--boundary", "mask=3")
    assert message == (
        "--boundary: there is no column 'mask'; the columns are id, radius, x, y, z, type"
    )


def test_a_boundary_that_is_everything(tmp_path, compute):
    """Known only at the end: the first frames of a series may be of boundary alone."""
    output = tmp_path / "table.csv"
    output.write_text("precious")
    printed, written = (
        compute(grains(tmp_path), "--boundary", "type=1", *more) for more in ((), ("-o", output))
    )
    for answer in (printed, written):
        assert answer.code == 1
        assert answer.err == (
            "scanfab: error: --boundary: type=1 selects all particles of every frame: "
            "no grain is left\n"
        )
    assert [row["alpha_vs"] for row in printed.rows] == [""] * 4
    assert output.read_text() == "precious"


def test_a_cut_off_that_no_segment_reaches_leaves_empty_cells(tmp_path, compute):
    answer = compute(grains(tmp_path), "--cutoff", "1000")
    assert answer.code == 1
    assert [row["alpha_vs"] for row in answer.rows] == [""] * 4
    assert float(answer.rows[0]["alpha_c"]) > 0
    told = "frame 0, variants a, b, c, d: no void segment reaches the cut-off 1000, "
    assert told in answer.err
    # one word for all variants
    assert answer.err.count("no void segment") == answer.err.count("did you mean 1rmin?") == 1


def test_only_rattlers_leave_variant_b_empty(tmp_path, compute):
    answer = compute(grains(tmp_path), "--min-contacts", "99", "--variants", "ab")
    assert answer.code == 0
    whole, without = answer.rows
    assert whole["alpha_vs"] != ""
    assert without["alpha_vs"] == without["coordination"] == without["alpha_c"] == ""
    assert (without["grains"], without["rattlers"], without["contacts"]) == ("0", "64", "0")
    assert "variant b: no grain is left, all 64 are rattlers" in answer.err


def test_one_grain_leaves_no_void_and_no_solid_if_it_is_removed(tmp_path, compute):
    file = grains(tmp_path, [cubic_rows()[0]])
    answer = compute(file, "--variants", "abc")
    assert answer.code == 1
    assert {row["alpha_vs"] for row in answer.rows} == {""}
    assert "nan" not in answer.out.lower()
    assert "variants a, c: no void segment reaches the cut-off" in answer.err
    removed = compute(file, "--variants", "d")
    assert removed.code == 1
    assert removed.rows[0]["solid_fraction"] == "0.0"
    assert removed.rows[0]["alpha_vs"] == removed.rows[0]["mean_length"] == ""
    assert "variant d: no grain is left, all 1 that reach into the RV are rattlers" in removed.err


# the machine


def test_a_file_that_nobody_may_read(tmp_path, refusal, monkeypatch):
    file = grains(tmp_path)

    def forbidden(path, *_):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr("scanfab.io.files.open", forbidden, raising=False)
    assert refusal(file) == f"{file}: cannot be read: Permission denied"


def test_a_folder_that_nobody_may_write_to(tmp_path, compute, monkeypatch):
    def forbidden(path, *_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    file = grains(tmp_path)
    monkeypatch.setattr(Path, "write_text", forbidden)
    answer = compute(file, "-o", tmp_path / "table.csv")
    assert (answer.code, answer.out) == (1, "")
    assert "Permission denied" in answer.err
    assert not (tmp_path / "table.csv").exists()


def test_a_folder_that_does_not_exist_is_wrong_usage(tmp_path, compute):
    answer = compute(grains(tmp_path), "-o", tmp_path / "nowhere" / "table.csv")
    assert (answer.code, answer.out) == (2, "")
    assert f"there is no folder {tmp_path}/nowhere to write to" in answer.err


def test_a_full_disk_leaves_the_old_result(tmp_path, compute, monkeypatch):
    file, output = grains(tmp_path), tmp_path / "table.csv"
    output.write_text("precious")
    write_row = ResultFile.write

    def full(writer, row):
        if row["variant"] == "c":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write_row(writer, row)

    monkeypatch.setattr(ResultFile, "write", full)
    answer = compute(file, "-o", output)
    assert (answer.code, answer.out) == (1, "")
    assert "scanfab: error: " in answer.err
    assert os.strerror(errno.ENOSPC) in answer.err
    assert output.read_text() == "precious"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("command", [["compute", *SCAN], ["inspect", "--json"]])
def test_a_full_disk_behind_standard_output(tmp_path, command):
    words = [*PROGRAM, *command, str(grains(tmp_path))]
    with open("/dev/full", "w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert os.strerror(errno.ENOSPC) in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr


@pytest.mark.skipif(shutil.which("sh") is None, reason="needs a POSIX shell to close a stream")
@pytest.mark.parametrize(
    ("words", "stream", "message"),
    [
        (["compute", *SCAN, "FILE"], ">&-", "standard output is closed"),
        (["formats"], ">&-", "standard output is closed"),
        (["compute", "-", "--format", "liggghts"], "<&-", "standard input: expected a dump"),
    ],
)
def test_a_standard_stream_that_the_shell_closed(tmp_path, words, stream, message):
    file = grains(tmp_path)
    command = [*PROGRAM, *(str(file) if word == "FILE" else word for word in words)]
    done = subprocess.run(
        ["sh", "-c", f"{shlex.join(command)} {stream}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("failure", ["raise ImportError('no libpfc')", "import sys; sys.exit(3)"])
def test_a_plugin_that_fails_is_a_warning(tmp_path, compute, monkeypatch, failure):
    write(tmp_path / "brokenplugin.py", failure)
    file = grains(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "brokenplugin", raising=False)
    broken = EntryPoint("pfc", "brokenplugin:Reader", reader.GROUP)
    points = plugins.entry_points
    monkeypatch.setattr(plugins, "entry_points", lambda group: [*points(group=group), broken])
    reader.installed_readers.cache_clear()
    try:
        answer = compute(file)
    finally:
        reader.installed_readers.cache_clear()
    assert answer.code == 0
    assert len(answer.rows) == 4
    assert "warning: the reader 'pfc' of unknown package cannot be loaded" in answer.err
