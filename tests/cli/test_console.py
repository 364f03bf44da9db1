"""What people are shown: tables of which no head or cell is cut, progress, --quiet, --verbose."""

import logging
import re
import time

import pytest

from scanfab.cli import console
from scanfab.cli.compare import print_comparison
from scanfab.cli.console import OFTEN_SAME, SHOWN, STAY, print_table, working
from scanfab.table.columns import table_columns
from scanfab.table.compare import compare_tables
from scanfab.table.row import Row
from scanfab.table.writing import Excerpt
from tests.helpers.dumps import write
from tests.helpers.interruptions import FAST, write_series
from tests.helpers.tables import curve, sheared
from tests.table.test_table import a_row

VALUES = {
    "variant": "d", "strain": 0.0123456, "grains": 123456, "contacts": 1234567,
    "coordination": 4.98765, "solid_fraction": 0.61234, "mean_length": 0.00123456,
    "alpha_vs": 0.0123456, "alpha_vs_axial": -0.0123456, "alpha_vs_axial_se": 3e-4,
    "alpha_vs_axial_sample_se": 4e-4, "alpha_c_axial": -0.0876543,
}  # fmt: skip
ROWS = [a_row(frame=frame, **VALUES) for frame in range(3)]
ERRORS = {"alpha_vs_axial_sample_se": 4e-4, "alpha_c_axial_sample_se": 2.34567e-3}


@pytest.fixture
def lines(capsys, monkeypatch):
    """What is printed on a terminal of some width."""

    def show(width, function, *arguments):
        monkeypatch.setenv("COLUMNS", str(width))
        function(*arguments)
        return capsys.readouterr().out.splitlines()

    return show


def heads(line: str) -> list[str]:
    return re.split(" {2,}", line.strip())


def test_what_does_not_fit_is_left_out_least_telling_first(lines):
    counts = []
    # only maps have blocks, and these rows have one source and cut-off
    always = [name for name in SHOWN[:STAY] if name in {*ROWS[0], "total"} - {*OFTEN_SAME}]
    optional = [name for name in SHOWN[STAY:] if name in ROWS[0]]
    for width in (40, 60, 80, 119, 120, 121, 200):
        head, *rows = lines(width, print_table, ROWS, Excerpt())
        assert "…" not in head + "".join(rows)
        columns = heads(head)
        assert {len(row.split()) for row in rows} == {len(columns)}
        assert width < 80 or len(head) <= width
        counts.append(len(columns) - len(always))
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, len(optional))
    assert columns[6:8] == ["± total", "α_c axial"]
    # the error is that of scan and sample together
    cells = dict(zip(columns, rows[0].split(), strict=True))
    errors = [cells[name] for name in ("± total", "± scan", "± sample")]
    assert errors == ["0.0005", "0.0003", "0.0004"]


def test_what_tells_rows_apart_is_shown_only_where_it_differs(lines):
    other = a_row(**VALUES, source="a/folder/" * 9 + "other", rv=0.4, cutoff=0.5)
    head, _, row = lines(60, print_table, [a_row(**VALUES, rv=0.7), other], Excerpt())
    shown = dict(zip(heads(head), row.split(), strict=True))
    assert (shown["source"], shown["rv"], shown["cutoff"]) == ("other", "0.4", "0.5")
    (head, *_) = lines(200, print_table, ROWS, Excerpt())
    assert not {"source", "rv", "cutoff"} & set(heads(head))


def test_a_map_says_which_block_a_row_is_of(lines):
    place = {"block": 7, "x": 1.0, "y": 2.0, "z": 3.0, "at_surface": 0}
    head, row = lines(200, print_table, [Row(**ROWS[0], **place)], Excerpt())
    assert dict(zip(heads(head), row.split(), strict=True))["block"] == "7"
    assert {"x", "y", "z", "at surface"} <= set(heads(head))
    assert "r inner" not in heads(head)


def test_columns_and_digits_that_were_asked_for_are_shown(lines):
    excerpt = Excerpt.make(table_columns(), "variant,alpha_vs_axial", 5)
    head, row, *_ = lines(80, print_table, ROWS, excerpt)
    assert (heads(head), row.split()) == (["variant", "α_vs axial"], ["d", "-0.012346"])


def compared(*sources):
    every = [row for name in sources for v in "abcd" for row in curve(name, v, 0.0123456)]
    return compare_tables([{**row, **ERRORS} for row in every])


@pytest.mark.parametrize("width", [60, 80, 120])
@pytest.mark.parametrize("sources", [["one"], ["x" * 70 + "one", "x" * 70 + "two"]])
def test_no_part_of_a_comparison_is_cut(lines, width, sources):
    shown = lines(width, print_comparison, compared(*sources))
    assert max(map(len, shown)) <= width
    assert "…" not in "".join(shown)
    assert sum("variant" in line.split() for line in shown) == 2
    assert any("slope" in line for line in shown)


def test_a_comparison_shows_total_errors_and_curves_where_there_is_room(lines):
    narrow, wide = (lines(width, print_comparison, compared("one")) for width in (80, 140))
    assert narrow[0] == "one"
    assert sum("one" in line for line in narrow) == 1
    assert any("α_c axial  ± total" in line for line in narrow)
    # that of the scan is 0.0003
    assert any("0.0005" in line and "0.00235" in line for line in narrow)
    for part in ("± scan", "█"):
        assert part in "".join(wide)


@pytest.mark.filterwarnings("ignore:shear_strain is used in place")
def test_a_sheared_cell_has_its_shear(lines):
    shown = lines(80, print_comparison, compare_tables(sheared()))
    assert any("shear strain" in line for line in shown)


def test_merged_tables_and_differences_are_shown_as_tables(
    ask, series, table, tmp_path, monkeypatch
):
    monkeypatch.setenv("COLUMNS", "100")
    for module in ("merge", "compare"):
        monkeypatch.setattr(f"scanfab.cli.{module}.is_readable", lambda: True)
    ask("compute", series, *FAST, "-o", tmp_path / "t.csv")
    for command in (("merge",), ("compare", "--differences"), ("compare", "--digits", "2")):
        lines = ask(command[0], tmp_path / "t.csv", *command[1:]).out.splitlines()
        assert len(lines) > 5
        assert not any("," in line for line in lines)
        assert command[0] != "merge" or max(map(len, lines)) <= 100
    asked = ("--fields", "variant,alpha_vs_axial", "--digits", "8")
    head, row, *_ = ask("compare", table(curve(factor=1 / 3)), *asked).out.splitlines()
    assert (heads(head), row.split()) == (["variant", "α_vs axial"], ["c", "0.0033333333"])


@pytest.fixture
def said(tmp_path, ask):
    """Standard output, and what was said, as lines, of a series with a settings file."""
    series = write_series(tmp_path / "series", 3)
    write(series / "scanfab.toml", "[compute]\nrv = 0.6\n")

    def call(*words: str, code: int = 0) -> tuple[str, list[str]]:
        answer = ask("compute", series, *words, code=code)
        return answer.out, answer.err.splitlines()

    return call


def notes(lines: list[str]) -> list[str]:
    return [line for line in lines if line.startswith("scanfab: note: ")]


def test_quiet_leaves_out_notes_but_no_warning_and_no_error(said):
    words = (*FAST[2:], "--directions", "equal-angle:30")
    # first, as kernels that no earlier run has needed are compiled with a word
    quiet_result, quiet = said(*words, "--quiet")
    result, lines = said(*words)
    assert result == quiet_result
    assert len(notes(lines)) > 1
    assert [line for line in lines if line not in notes(lines)] == quiet
    assert any("an isotropic sample would get alpha = " in line for line in quiet)
    _, lines = said("--quiet", "--boundary", "type=9", code=1)
    assert lines[-1].startswith("scanfab: error: --boundary: no particle of any frame has type=9")


def test_verbose_says_what_is_used_and_how_long_each_frame_takes(said, tmp_path):
    result, lines = said(*FAST, "--verbose", "--workers", "2")
    text, series = "\n".join(lines), tmp_path / "series"
    assert re.search(r"scanfab: scanfab \S+, numpy [\d.]+, numba [\d.]+, Python .*; 2 work", text)
    assert f"scanfab: {series}: grains from {series}/dump_*.txt by liggghts, 3 files" in lines
    found = re.findall(rf"scanfab: {series}: frame (\d): 64 grains in [\d.e-]+ s", text)
    assert sorted(found) == ["0", "1", "2"]
    assert result == said(*FAST)[0]


PROGRESS = [((), 0.002, True), (("--quiet",), 0.002, False), ((), 60.0, False)]


@pytest.mark.parametrize(("words", "every", "says"), PROGRESS)
def test_a_log_gets_a_line_of_progress_each_minute(said, monkeypatch, words, every, says):
    """Here of a few milliseconds; nothing in a run that takes less."""
    monkeypatch.setattr(console, "EVERY", every)
    _, lines = said("--tolerance", "2e-3", "--workers", "1", "--variants", "ac", *words)
    states = [line for line in lines if re.match(r"scanfab: \d of 3 frames", line)]
    assert bool(states) == says
    if says:
        assert states[0].startswith("scanfab: 0 of 3 frames")
        assert any(re.match(r"scanfab: [12] of 3 frames, about \d+ s; ", line) for line in states)


def test_time_that_is_left_follows_from_the_frames_of_this_run(monkeypatch):
    """Those that an earlier run has finished took no time."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    with working(lambda: 20, 8) as advance:
        work = advance.__self__
        now[0] = 30.0
        advance()
        logging.getLogger("scanfab").info("frame 9: done")
        assert work.state() == "9 of 20 frames, about 6 min; frame 9: done"
    # the library is listened to no longer than it works
    assert work not in logging.getLogger("scanfab").handlers


def test_a_terminal_has_no_bar_where_each_step_is_a_line(monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr(console, "level", lambda: "verbose")
    with working(lambda: 3) as advance:
        assert advance.__self__.bar is None
