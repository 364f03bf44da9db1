"""scanfab compare: what it writes, in every format, from tables of every format."""

import pytest

from scanfab.table.formats import OWN_FORMATS, read_rows
from tests.helpers.dumps import write
from tests.helpers.tables import curve

FRAMES = (
    "source frame strain variant alpha_vs_axial alpha_c_axial "
    "alpha_vs_axial_norm alpha_c_axial_norm alpha_vs_axial_se alpha_vs_axial_sample_se "
    "alpha_vs_axial_total_se alpha_c_axial_sample_se shear_strain"
)
SUMMARY = "source variant frames slope slope_origin r2 slope_se peak peak_strain final"
DIFFERENCES = "source frame strain variants difference difference_se"


TABLES = [([], FRAMES, 10), (["--summary"], SUMMARY, 2), (["--differences"], DIFFERENCES, 5)]


@pytest.mark.parametrize(("words", "columns", "count"), TABLES)
def test_columns_are_the_same_in_every_format(tmp_path, ask, table, words, columns, count):
    given = table([*curve(), *curve(variant="d")])
    printed = ask("compare", given, *words)
    assert list(printed.rows[0]) == columns.split()
    assert len(printed.rows) == count
    expected = read_rows(write(tmp_path / "printed.csv", printed.out))
    for own in OWN_FORMATS:
        output = tmp_path / f"out{own.suffix}"
        assert ask("compare", given, *words, "-o", output).out == ""
        assert read_rows(output) == expected


def test_several_tables_stand_side_by_side_under_their_labels(ask, table):
    given = [table(curve(factor=k), f"{k}.jsonl") for k in (1.0, 2.0)]
    labels = ("--label", "coarse", "--label", "fine")
    rows = ask("compare", *given, "--summary", *labels).rows
    assert [row["source"] for row in rows] == ["coarse", "fine"]
    assert "with --label NAME" in ask("compare", *given, code=1).err


def test_the_rows_of_one_cutoff_are_chosen(ask, table):
    given = table([{**row, "cutoff": c} for row in curve() for c in (0.0, 0.5, 1.0)])
    assert "choose one cut-off with --cutoff" in ask("compare", given, code=1).err
    assert len(ask("compare", given, "--cutoff", "0.5").rows) == 5


def test_variants_are_chosen(ask, table):
    given = table([row for variant in "acd" for row in curve(variant=variant)])
    alone = table([row for variant in "ad" for row in curve(variant=variant)], "alone.jsonl")
    for words in ([], ["--summary"], ["--differences"]):
        chosen = ask("compare", given, "--variants", "da", *words).out
        assert chosen == ask("compare", alone, *words).out


def test_the_line_of_the_paper_can_be_left_out(ask, table, tmp_path):
    given, plot = table(curve()), tmp_path / "plot.svg"
    for words, is_drawn in ([], True), (["--no-paper-line"], False):
        ask("compare", given, "--figure", "correlation", "--plot", plot, *words)
        assert ("2017 paper: 0.096" in plot.read_text(encoding="utf-8")) == is_drawn
    assert ask("compare", given, "--summary", "--strain-max", "0.03").rows[0]["frames"] == "4"


@pytest.mark.parametrize("is_empty", [False, True])
def test_a_dash_is_standard_input(ask, table, is_empty):
    """An empty one is what a command that failed before it leaves."""
    data = b"" if is_empty else table(curve()).read_bytes()
    answer = ask("compare", "-", code=int(is_empty), stdin=data)
    told = "scanfab: error: -: expected a table, found an empty file\n"
    assert len(answer.rows) == (0 if is_empty else 5)
    assert (answer.err == told) == is_empty


def test_a_table_of_compare_is_called_so_and_one_without_a_void_fabric_fails(ask, table, tmp_path):
    rows = [{**row, "alpha_vs_axial": None} for row in curve()]
    assert len(ask("compare", table(rows), code=1).rows) == 5
    output = tmp_path / "compared.csv"
    ask("compare", table(curve()), "-o", output)
    assert f"{output}: this is a table of scanfab compare" in ask("compare", output, code=1).err
