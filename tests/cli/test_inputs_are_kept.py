"""No command writes over a file that it reads, by whatever name or link."""

import shutil
import sys

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, write

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--variants", "a", "--quiet")


@pytest.fixture
def files(tmp_path, monkeypatch, ask):
    """A packing as CSV with a link to it, and its table."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "dump.1", dump_text(cubic_rows(), box=((0, 4),) * 3))
    ask("convert", "dump.1", "g.csv", "--quiet")
    (tmp_path / "link.csv").symlink_to("g.csv")
    ask("compute", "g.csv", *FAST, "-o", "t.csv")
    return {path.name: path.read_bytes() for path in tmp_path.iterdir()}


OVER_INPUTS = [
    ("compute", "g.csv", *FAST, "-o", "g.csv"),
    ("compute", "link.csv", *FAST, "-o", "./g.csv"),
    ("compute", "g.csv", *FAST, "-o", "u.csv", "--manifest", "g.csv"),
    ("map", "g.csv", "--slices", "1", *FAST, "-o", "g.csv"),
    ("calibrate", "g.csv", "-o", "g.csv"),
    ("compare", "t.csv", "-o", "t.csv"),
    ("merge", "t.csv", "-o", "t.csv"),
    ("convert", "g.csv", "g.csv", "--frames", "0:0"),
    ("compute", "dump.1", "--strain", "t.csv", *FAST, "-o", "t.csv"),
]


@pytest.mark.parametrize("command", OVER_INPUTS)
def test_an_output_that_is_an_input_is_refused(files, tmp_path, ask, command):
    answer = ask(*command, code=2)
    assert "input" in answer.told or "chooses none" in answer.told
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == files


def test_a_whole_series_may_be_rewritten_and_a_device_takes_a_table(files, tmp_path, ask):
    ask("convert", "g.csv", "g.csv", "--quiet")
    assert (tmp_path / "g.csv").read_bytes() == files["g.csv"]
    before = sys.stdout
    ask("compute", "g.csv", *FAST, "-o", "/dev/null")
    ask("compute", "g.csv", *FAST, "-o", "/dev/null", "--plot", "x.doc", code=2)
    assert sys.stdout is before
    assert not sys.stdout.closed
    # an old table beside the dumps is no input
    (tmp_path / "dumps").mkdir()
    shutil.copy("dump.1", "dumps")
    for _ in range(2):
        ask("compute", "dumps", *FAST, "-o", "dumps/t.csv")
