"""scanfab calibrate: rows or a table, words, and a command line that runs."""

import shlex
from dataclasses import replace
from functools import partial

import pytest

from scanfab.base.column import columns_of_fields
from scanfab.pipeline.calibration import Calibration, StepRow
from tests.cli.test_windows import surface
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.truth import TRIAXIAL

QUICK = ("--boundary", "mask=3", "--tolerance", "1e-2", "--max-chords", "3e6", "--workers", "1")
STEP = StepRow(
    source="s", frame=0, ladder="spacing", value=0.1, variant="c", rule="icosahedral:9", degree=5,
    rule_bias=1.2e-4, directions=46, replicates=16, spacing=1e-4, cutoff=1e-3, rv_radius=None,
    segments=123456789, seconds=1.234, mean_length=1e-3, alpha_vs_axial=0.123456,
    alpha_vs_axial_se=0.00123456, alpha_vs_axial_sample_se=0.0123456, steady=1, note="",
)  # fmt: skip
FOUND = Calibration((STEP, replace(STEP, ladder="cutoff")), ("nothing found",), {})


@pytest.fixture
def calibrate(ask):
    return partial(ask, "calibrate")


def command_of(text: str) -> list[str]:
    """The recommended command, which is the last line."""
    program, *words = shlex.split(text.splitlines()[-1])
    assert (program, words[0]) == ("scanfab", "compute")
    return words


def test_rows_on_one_stream_and_words_on_the_other(calibrate, ask, tmp_path):
    figure = tmp_path / "ladders.png"
    rows, told = (answer := calibrate(TRIAXIAL, *QUICK, "--plot", figure)).rows, answer.err
    assert list(rows[0]) == [column.name for column in columns_of_fields(StepRow)]
    assert {row["frame"] for row in rows} == {"6"}
    assert figure.stat().st_size > 10_000
    assert "cut-off: the anisotropy of variant c is largest" in told
    printed = ask(*command_of(told), "--workers", "1", "--frames", "6").rows
    best = [row for row in rows if row["ladder"] == "recommended"]
    for name in ("variant", "alpha_vs_axial", "alpha_vs_axial_se", "segments"):
        assert [row[name] for row in printed] == [row[name] for row in best]


@pytest.mark.parametrize("width", [70, 100, 160])
def test_tables_on_a_terminal_are_not_cut(calibrate, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr("scanfab.cli.calibrate.is_readable", lambda: True)
    monkeypatch.setattr("scanfab.pipeline.calibration.calibrate", lambda *_, **__: FOUND)
    out = calibrate(TRIAXIAL, *QUICK).out
    table = out.split("nothing found")[0].splitlines()
    assert "…" not in out
    assert max(map(len, table)) <= width
    heads = [line for line in table if "variant" in line]
    assert len(heads) == 2
    for title in ("rmin", "α_vs axial", "± scan", "± sample", "steady"):
        assert title in heads[0]
    assert {"0.123", "0.00123", "0.0123", "yes"} <= set(table[1].split())
    present = [title in heads[0] for title in ("time", "rule", "segments", "bias")]
    assert present == sorted(present, reverse=True)
    assert all(present) == (width == 160)
    head = calibrate(TRIAXIAL, *QUICK, "--fields", "ladder,value").out.splitlines()[0]
    assert head.split() == ["ladder", "value"]


def test_with_a_file_the_words_are_the_output(calibrate, cube, tmp_path):
    table = tmp_path / "steps.csv"
    out = calibrate(cube, *COARSE, "--verbose", "-o", table).out
    assert len(out.splitlines()) == 6
    assert {"--variants", "c", "--spacing"} <= set(command_of(out))
    assert "--verbose" not in out
    assert len(table.read_text().splitlines()) > 20


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (cubic_rows()[:1], "variant c has no void fabric at any cut-off"),
        ([], "no frame has grains, so there is nothing to calibrate"),
    ],
)
def test_a_dump_of_one_grain_or_none_is_one_message(calibrate, tmp_path, rows, message):
    answer = calibrate(write(tmp_path / "dump", dump_text(rows, box=((0, 4),) * 3)), code=1)
    assert answer.out == ""
    assert message in answer.err


@pytest.fixture
def cube(tmp_path, monkeypatch):
    """64 grains that overlap their neighbours, and ladders of two steps."""
    monkeypatch.setattr("scanfab.pipeline.calibration.SPACINGS", (2.0, 1.0))
    monkeypatch.setattr("scanfab.pipeline.calibration.DEGREES", (5, 9))
    return write(tmp_path / "dump_0.txt", dump_text(cubic_rows(), box=((0, 4),) * 3))


COARSE = ("--variants", "c", "--tolerance", "2e-2", "--max-chords", "1e6", "--cutoff", "0.2rmin")


def test_the_size_of_an_rv_that_a_file_draws_is_left_out(calibrate, cube, tmp_path):
    words = ("--rv-shape", surface(tmp_path / "box.stl", half=1.2), "--rv-center", "2,2,2")
    answer = calibrate(cube, *COARSE, *words, "--edge", "start")
    assert {row["ladder"] for row in answer.rows} >= {"spacing", "cutoff"}
    assert "rv" not in {row["ladder"] for row in answer.rows}
    assert "--edge start" in answer.err.splitlines()[-1]


def test_an_rv_follows_the_strain_that_is_named(calibrate, ask, cube, tmp_path):
    """Else it could follow the cell or a boundary alone."""
    follows = ("--rv-follows", "strain", "--strain", "grains")
    assert "--strain grains" in calibrate(cube, *COARSE, *follows).err
    ask("view", cube, *follows, "--screenshot", tmp_path / "view.png")
    assert (tmp_path / "view.png").exists()
