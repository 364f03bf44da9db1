"""scanfab calibrate: rows or a table, words, and a command line that runs."""

import shlex

import pytest

from scanfab.pipeline.calibration import STEP_COLUMNS, Calibration
from scanfab.table.formats import read_rows
from scanfab.table.row import Row
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.truth import TRIAXIAL
from tests.helpers.windows import corners_of_a_box, surface

QUICK = ("--boundary", "mask=3", "--tolerance", "1e-2", "--max-chords", "3e6", "--workers", "1")
STEP = Row(
    source="s", frame=0, ladder="spacing", value=0.1, variant="c", rule="icosahedral:9", degree=5,
    rule_bias=1.2e-4, directions=46, replicates=16, spacing=1e-4, cutoff=1e-3, rv_radius=None,
    segments=123456789, seconds=1.234, mean_length=1e-3, alpha_vs_axial=0.123456,
    alpha_vs_axial_se=0.00123456, alpha_vs_axial_sample_se=0.0123456, steady=1, note="",
)  # fmt: skip
FOUND = Calibration((STEP, Row(**{**STEP, "ladder": "cutoff"})), ("nothing found",), {})


@pytest.mark.parametrize("width", [70, 100, 160])
def test_tables_on_a_terminal_are_not_cut(ask, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr("scanfab.cli.calibrate.is_readable", lambda: True)
    monkeypatch.setattr("scanfab.pipeline.calibration.calibrate", lambda *_, **__: FOUND)
    out = ask("calibrate", TRIAXIAL, *QUICK).out
    table = out.split("nothing found")[0].splitlines()
    assert "…" not in out
    assert max(map(len, table)) <= width
    heads = [line for line in table if "variant" in line]
    assert len(heads) == 2
    for title in ("rmin", "α_vs axial", "± scan", "± sample", "steady"):
        assert title in heads[0]
    assert {"0.123", "0.00123", "0.0123", "yes"} <= set(table[1].split())
    assert all(one in heads[0] for one in ("rule", "segments", "bias")) == (width == 160)
    head = ask("calibrate", TRIAXIAL, *QUICK, "--fields", "ladder,value").out.splitlines()[0]
    assert head.split() == ["ladder", "value"]


def test_with_a_file_the_words_are_the_output(ask, tmp_path, monkeypatch):
    """The size of an RV that a file draws is left out; it follows the strain that is named."""
    monkeypatch.setattr("scanfab.pipeline.calibration.SPACINGS", (2.0, 1.0))
    monkeypatch.setattr("scanfab.pipeline.calibration.DEGREES", (5, 9))
    cube = write(tmp_path / "dump_0.txt", dump_text(cubic_rows(), box=((0, 4),) * 3))
    table, figure = tmp_path / "steps.csv", tmp_path / "ladders.png"
    words = ("--variants", "c", "--tolerance", "2e-2", "--max-chords", "1e6", "--cutoff", "0.2rmin")
    words += ("--rv-shape", surface(tmp_path / "box.stl", 2 + corners_of_a_box(1.2)))
    words += ("--rv-follows", "strain", "--strain", "grains", "--edge", "start")
    out = ask("calibrate", cube, *words, "--verbose", "-o", table, "--plot", figure).out
    assert figure.stat().st_size > 10_000
    assert len(out.splitlines()) == 5
    *_, command = out.splitlines()
    for one in ("--variants c ", "--spacing ", "--strain grains", "--edge start"):
        assert one in command
    assert "--verbose" not in out
    rows = read_rows(table)
    assert list(rows[0]) == [column.name for column in STEP_COLUMNS]
    assert {row["ladder"] for row in rows} == {"spacing", "directions", "cutoff", "recommended"}
    (best,) = (row for row in rows if row["ladder"] == "recommended")
    program, *words = shlex.split(command)
    (printed,) = ask(*words).rows
    assert program == "scanfab"
    for name in ("alpha_vs_axial", "alpha_vs_axial_se", "segments"):
        assert float(printed[name]) == best[name]
