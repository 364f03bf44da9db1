"""scanfab compare: what it writes, in every format, from tables of every format."""

from __future__ import annotations

import csv
import io
import json
import sys
from pathlib import Path

import pytest

from scanfab.cli.main import run
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


def table(folder: Path, rows, name: str = "table.jsonl") -> str:
    return str(write(folder / name, "".join(json.dumps(row) + "\n" for row in rows)))


@pytest.fixture
def compare(capsys):
    """The rows printed by a comparison that succeeds."""

    def ask(*words: str) -> list[dict[str, str]]:
        assert run(["compare", *words]) == 0
        return list(csv.DictReader(io.StringIO(capsys.readouterr().out)))

    return ask


@pytest.mark.parametrize(
    ("words", "columns", "count"),
    [([], FRAMES, 10), (["--summary"], SUMMARY, 2), (["--differences"], DIFFERENCES, 5)],
)
def test_the_columns_are_those_that_scripts_rely_on(tmp_path, compare, words, columns, count):
    rows = compare(table(tmp_path, [*curve(), *curve(variant="d")]), *words)
    assert list(rows[0]) == columns.split()
    assert len(rows) == count


def test_several_tables_stand_side_by_side(tmp_path, compare):
    tables = [table(tmp_path, curve(name), f"{name}.jsonl") for name in ("one", "two")]
    assert [row["source"] for row in compare(*tables, "--summary")] == ["one", "two"]


def test_the_largest_strain_is_that_of_the_fit(tmp_path, compare):
    (row,) = compare(table(tmp_path, curve()), "--summary", "--strain-max", "0.02")
    assert row["frames"] == "3"
    assert row["slope_se"] == ""


@pytest.mark.parametrize("words", [[], ["--summary"], ["--differences"]])
@pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])
def test_every_format_holds_the_same(tmp_path, capsys, suffix, words):
    given, output = table(tmp_path, [*curve(), *curve(variant="d")]), tmp_path / f"out{suffix}"
    assert run(["compare", given, *words]) == 0
    printed = write(tmp_path / "printed.csv", capsys.readouterr().out)
    assert run(["compare", given, *words, "-o", str(output)]) == 0
    assert capsys.readouterr().out == ""
    assert read_rows(output) == read_rows(printed)


@pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])
def test_the_tables_of_compute_are_read_in_every_format(tmp_path, compare, suffix):
    sample = "sample_data/yade_triaxial/triaxial-spheres-00000000.vtk.gz"
    root, output = Path(__file__).parents[2], tmp_path / f"table{suffix}"
    fast = ["--directions", "9", "--spacing", "1rmin", "--boundary", "mask=3"]
    assert run(["compute", str(root / sample), *fast, "-o", str(output)]) == 0
    rows = compare(str(output))
    assert [row["variant"] for row in rows] == list("abcd")
    assert {abs(float(row["alpha_vs_axial_norm"])) for row in rows} == {1.0}


def test_the_rows_of_one_cutoff_are_chosen(tmp_path, compare, capsys):
    rows = [{**row, "cutoff": c, "frame": row["frame"]} for row in curve() for c in (0.0, 0.5, 1.0)]
    given = table(tmp_path, rows)
    assert run(["compare", given]) == 1
    assert "choose one cut-off with --cutoff" in capsys.readouterr().err
    assert len(compare(given, "--cutoff", "0.5")) == 5
    assert run(["compare", given, "--cutoff", "0.7"]) == 1
    assert "no row has the cut-off 0.7: expected one of the table's: 0, 0.5, 1" in (
        capsys.readouterr().err
    )


def test_labels_name_the_tables(tmp_path, compare, capsys):
    given = [table(tmp_path, curve(factor=k), f"{k}.jsonl") for k in (1.0, 2.0)]
    assert run(["compare", *given]) == 1
    assert "by --label NAME" in capsys.readouterr().err
    rows = compare(*given, "--summary", "--label", "coarse", "--label", "fine")
    assert [row["source"] for row in rows] == ["coarse", "fine"]
    assert run(["compare", *given, "--label", "coarse"]) == 2
    assert "--label: expected one a table: 2, found 1" in capsys.readouterr().err


def test_the_same_table_twice_counts_once(tmp_path, compare, capsys):
    given = table(tmp_path, curve())
    assert run(["compare", given, given]) == 0
    printed = capsys.readouterr()
    assert len(printed.out.splitlines()) == 6
    assert printed.err.count("warning") == 1
    assert "rows of one that" in printed.err


def test_a_table_of_compare_is_called_so(tmp_path, capsys):
    given, output = table(tmp_path, curve()), tmp_path / "compared.csv"
    assert run(["compare", given, "-o", str(output)]) == 0
    assert run(["compare", str(output)]) == 1
    assert f"{output}: this is a table of scanfab compare: " in capsys.readouterr().err


def test_a_dash_is_standard_input(tmp_path, compare, monkeypatch):
    data = Path(table(tmp_path, curve())).read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    assert len(compare("-")) == 5


def test_tables_without_a_void_fabric_are_exit_code_1(tmp_path, capsys):
    rows = [{**row, "alpha_vs_axial": None} for row in curve()]
    assert run(["compare", table(tmp_path, rows)]) == 1
    assert len(capsys.readouterr().out.splitlines()) == 6


@pytest.mark.parametrize(
    ("text", "words", "message"),
    [
        ("source,frame\n", [], "there is nothing to compare: the tables hold no frames"),
        ("a,b\n1,2\n", [], "there is no column source, frame"),
        ("a,b\n1\n", [], "line 2: expected 2 cells, found 1"),
        (json.dumps(curve()[0]), ["--differences"], "hold no two variants of one frame"),
    ],
)
def test_what_cannot_be_compared_is_one_message(tmp_path, capsys, text, words, message):
    output = write(tmp_path / "out.csv", "precious")
    broken = str(write(tmp_path / "table.csv", text))
    for more in ([], ["-o", str(output)]):
        assert run(["compare", broken, *words, *more]) == 1
        printed = capsys.readouterr()
        assert printed.out == ""
        assert printed.err.startswith("scanfab: error: ")
        assert message in printed.err
    assert output.read_text() == "precious"


@pytest.mark.parametrize(
    "words", [["--summary", "--differences"], ["-o", "out.docx"], ["nowhere.csv"]]
)
def test_wrong_usage(tmp_path, capsys, words, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = run(["compare", table(tmp_path, curve()), *words])
    assert code == 2
    assert capsys.readouterr().out == ""
