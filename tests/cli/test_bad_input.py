"""Every kind of bad input: the message, the exit code, and the untouched output."""

from __future__ import annotations

import errno
import gzip
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
import tracemalloc
from functools import partial
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from scanfab.base import plugins
from scanfab.io import reader
from scanfab.pipeline.record import PartFile
from tests.helpers.dumps import (
    cubic_rows,
    dump_text,
    write,
)
from tests.helpers.interruptions import PROGRAM

SCAN = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")
BOX = ((0, 4),) * 3
HEADER = 9
"""Lines before the first grain."""


@pytest.fixture
def compute(ask):
    return partial(ask, "compute", *SCAN)


@pytest.fixture
def refusal(compute, tmp_path_factory):
    """The one message of a command that fails, with nothing printed and FILE untouched."""

    def say(*words):
        output = tmp_path_factory.mktemp("out") / "table.csv"
        output.write_text("precious")
        answers = {compute(*words, *more, code=1) for more in ((), ("-o", output))}
        ((out, err),) = answers
        assert out == ""
        assert output.read_text() == "precious"
        assert os.listdir(output.parent) == [output.name]
        last = err.strip().rpartition("scanfab: error: ")[2]
        assert last
        return last

    return say


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


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        *((column, value, f"grain 7.*{value}") for column in (2, 5) for value in ("nan", "-inf")),
        (3, "abc", f"line {HEADER + 7}: expected a number in the column y, found 'abc'"),
        (5, 0, "grain 7: the radius"),
        (5, -0.5, "grain 7: the radius"),
        (0, 8, "the id 8 occurs twice"),
    ],
)
def test_a_value_that_cannot_be_names_file_and_grain(tmp_path, refusal, column, value, words):
    file = grains(tmp_path, changed(column, value))
    assert re.search(f"{file}.*{words}", refusal(file))


def _cut(share, data):
    return data[: int(share * len(data))]


def _line(words, data):
    lines = data.splitlines(keepends=True)
    return b"".join([*lines[:33], words, *lines[34:]])


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        *((partial(_cut, share), "") for share in (0.3, 0.7, 0.99)),
        (lambda data: b"".join(data.splitlines(keepends=True)[:HEADER]), "counts 64 rows"),
        (partial(_line, b"7 1 0.5\n"), ", line 34: "),
        (partial(_line, b"7 1 0.5 0.5 0.5 0.5 0.5\n"), ", line 34: "),
        (lambda data: gzip.compress(data)[:600], ""),
        (lambda data: np.random.default_rng(0).bytes(10_000), ""),
    ],
)
def test_damaged_text_names_the_file(tmp_path, refusal, damage, words):
    file = grains(tmp_path)
    file.write_bytes(damage(file.read_bytes()))
    assert re.search(f"{file}.*{words}", refusal(file))


@pytest.mark.parametrize("count", ["65", "1000000000000000", "9" * 30])
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
    assert ("expected a whole number" if is_huge else f"counts {count} rows") in message
    assert seconds < 5
    assert most < 50e6


# folders and series


@pytest.mark.parametrize(
    ("names", "lines"),
    [
        ([], [": the folder holds no files"]),
        (["one_0.txt", "one_1.txt", "two_0.txt"], ["/one_*.txt", "/two_0.txt"]),
        (
            ["dump_1.txt", "dump_1_big.txt", "dump_2.txt", "dump_2_big.txt"],
            ["/dump_1.txt FOLDER/dump_2.txt", "/dump_*_big.txt"],
        ),
        (["dump_7.txt", "dump_07.txt"], ["/dump_07.txt", "/dump_7.txt"]),
    ],
)
def test_a_folder_without_a_series_or_with_several(tmp_path, refusal, names, lines):
    for name in names:
        grains(tmp_path, name=name)
    message = refusal(tmp_path)
    for line in lines:
        assert f"{tmp_path}{line}".replace("FOLDER", str(tmp_path)) in message


@pytest.fixture
def partly_broken(tmp_path):
    """Three frames, the second one with a radius of zero."""
    for frame in range(3):
        rows = changed(5, 0) if frame == 1 else cubic_rows()
        grains(tmp_path, rows, name=f"dump_{frame}.txt", step=frame)
    return tmp_path


def test_a_broken_frame_stops_and_keeps_the_rows_before(partly_broken, compute, tmp_path_factory):
    output = tmp_path_factory.mktemp("out") / "table.csv"
    answer = compute(partly_broken, "-o", output, code=1)
    assert "dump_1.txt: grain 7: the radius" in answer.err
    assert not output.exists()
    # the settings, and the frame before the broken one
    assert len(Path(f"{output}.part").read_text().splitlines()) == 2


@pytest.mark.parametrize("workers", [1, 2])
def test_a_broken_frame_can_be_skipped_also_the_first(partly_broken, compute, workers):
    words = ("--on-error", "skip", "--workers", workers)
    answer = compute(partly_broken, *words, code=1)
    assert [row["frame"] for row in answer.rows] == list("00002222")
    assert f"frame 1 skipped: {partly_broken}/dump_1.txt: grain 7" in answer.err
    grains(partly_broken, changed(5, 0), step=0)
    assert {row["frame"] for row in compute(partly_broken, *words, code=1).rows} == {"2"}


# what does not fit the sample


def test_one_grain_far_away_is_too_far_for_the_whole_alone(tmp_path, refusal, compute):
    file = grains(tmp_path, changed(4, 4000.0))
    assert "far away from all others" in refusal(file)
    found = compute(file, "--variants", "c")
    assert '--boundary "id=7"' in found.err
    assert found.rows[0]["grains"] == compute(grains(tmp_path), "--variants", "c").rows[0]["grains"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--rv-radius", "1", "--rv-center", "50", "2", "2"], "holds no grain"),
        (["--rv-radius", "2", "--rv-center", "6", "2", "2"], "beyond the sample"),
        (["--rv-radius", "4"], "beyond the sample"),
        (["--rv", "70"], "--rv, which is a fraction"),
    ],
)
def test_an_rv_without_grains_or_larger_than_the_sample(tmp_path, refusal, options, words):
    message = refusal(grains(tmp_path), *options)
    assert message.startswith("the RV (radius ")
    assert words in message
    assert "--rv-center" in message


def test_an_rv_at_the_surface_is_a_warning(tmp_path, compute):
    file = grains(tmp_path, cubic_rows(8))
    told = [compute(file, "--rv", rv).err for rv in ("0.9", "0.7")]
    assert ["comes within one of the largest radii" in one for one in told] == [True, False]


def test_a_boundary_on_a_missing_column_names_those_that_exist(tmp_path, refusal):
    message = refusal(grains(tmp_path), "--boundary", "mask=3")
    assert "--boundary: there is no column 'mask'; the columns are id, radius" in message


def test_a_boundary_that_is_everything(tmp_path, compute):
    output = write(tmp_path / "table.csv", "precious")
    words = (grains(tmp_path), "--boundary", "type=1")
    printed, written = compute(*words, code=1), compute(*words, "-o", output, code=1)
    for answer in (printed, written):
        assert "error: --boundary: type=1 selects all particles" in answer.err
    assert printed.rows == []
    assert output.read_text() == "precious"


def test_a_cut_off_that_no_segment_reaches_leaves_empty_cells(tmp_path, compute):
    answer = compute(grains(tmp_path), "--cutoff", "1000", code=1)
    assert [row["alpha_vs"] for row in answer.rows] == [""] * 4
    assert float(answer.rows[0]["alpha_c"]) > 0
    # one word for all variants
    assert answer.err.count("no void segment reaches the cut-off 1000") == 1
    assert answer.err.count("did you mean 1rmin?") == 1


def test_only_rattlers_leave_variant_b_empty(tmp_path, compute):
    answer = compute(grains(tmp_path), "--min-contacts", "99", "--variants", "ab")
    whole, without = answer.rows
    assert whole["alpha_vs"] != ""
    assert without["alpha_vs"] == without["coordination"] == without["alpha_c"] == ""
    assert (without["grains"], without["rattlers"], without["contacts"]) == ("0", "64", "0")
    assert "variant b: no grain is left, all 64 are rattlers" in answer.err


def test_one_grain_leaves_no_void_and_no_solid_if_it_is_removed(tmp_path, compute):
    file = grains(tmp_path, [cubic_rows()[0]])
    answer = compute(file, "--variants", "abc", code=1)
    assert {row["alpha_vs"] for row in answer.rows} == {""}
    assert "nan" not in answer.out.lower()
    removed = compute(file, "--variants", "d", code=1)
    assert removed.rows[0]["solid_fraction"] == "0.0"
    assert removed.rows[0]["alpha_vs"] == removed.rows[0]["mean_length"] == ""
    assert "variant d: no grain is left" in removed.err


# the machine


@pytest.mark.parametrize(
    ("where", "name", "is_reading"),
    [("scanfab.io.files", "open", True), (Path, "iterdir", True), (Path, "write_text", False)],
)
def test_what_nobody_may_read_or_write(tmp_path, compute, monkeypatch, where, name, is_reading):
    def forbidden(path, *_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    grains(tmp_path)
    target = (f"{where}.{name}",) if isinstance(where, str) else (where, name)
    monkeypatch.setattr(*target, forbidden, raising=False)
    words = () if is_reading else ("-o", tmp_path / "table.csv")
    answer = compute(tmp_path, *words, code=1)
    assert answer.out == ""
    assert re.search(rf"error: {tmp_path}.*Permission denied", answer.err)
    assert not (tmp_path / "table.csv").exists()


def test_a_full_disk_leaves_the_old_result(tmp_path, compute, monkeypatch):
    file, output = grains(tmp_path), write(tmp_path / "table.csv", "precious")

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(PartFile, "add", full)
    answer = compute(file, "-o", output, code=1)
    assert os.strerror(errno.ENOSPC) in answer.err
    assert output.read_text() == "precious"


@pytest.mark.skipif(shutil.which("sh") is None, reason="needs a POSIX shell to close a stream")
@pytest.mark.parametrize(
    ("words", "stream", "message"),
    [
        (["compute", *SCAN, "FILE"], ">&-", "standard output is closed"),
        (["formats"], ">&-", "standard output is closed"),
        (["compute", "-", "--format", "liggghts"], "<&-", "standard input: expected a dump"),
        (["inspect", "--json", "FILE"], ">/dev/full", os.strerror(errno.ENOSPC)),
    ],
)
def test_a_standard_stream_that_is_closed_or_full(tmp_path, words, stream, message):
    file = grains(tmp_path)
    command = [*PROGRAM, *(str(file) if word == "FILE" else word for word in words)]
    shell = ["sh", "-c", f"{shlex.join(command)} {stream}"]
    done = subprocess.run(shell, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr


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
    assert len(answer.rows) == 4
    assert "warning: the reader 'pfc'" in answer.err
