"""Tables of a comparison on a terminal: nothing is cut, and what matters most stays."""

from __future__ import annotations

import pytest
from scanfab.cli.comparison_tables import print_comparison

from scanfab.table.compare import compare_tables
from tests.helpers.tables import curve, sheared

HEADS = {
    *("source", "variant", "slope", "±", "R²", "peak", "final", "frames", "α_vs", "α_c"),
    *("frame", "strain", "shear", "axial", "total", "scan", "α_vs/max", "α_c/max"),
}
ERRORS = {
    "alpha_vs_axial_se": 1.23456e-4,
    "alpha_vs_axial_sample_se": 1.34567e-3,
    "alpha_c_axial_sample_se": 2.34567e-3,
}
FACTOR = 0.0123456


def rows_of(*sources):
    return [{**row, **ERRORS} for name in sources for v in "abcd" for row in curve(name, v, FACTOR)]


@pytest.fixture
def printed(capsys, monkeypatch):
    """The lines on a terminal of some width."""

    def show(rows, width):
        monkeypatch.setenv("COLUMNS", str(width))
        print_comparison(compare_tables(rows))
        return capsys.readouterr().out.splitlines()

    return show


@pytest.mark.parametrize("width", [60, 80, 100, 120])
@pytest.mark.parametrize("sources", [["one"], ["x" * 70 + "one", "x" * 70 + "two"]])
def test_no_head_and_no_cell_is_cut(printed, width, sources):
    lines = printed(rows_of(*sources), width)
    assert max(map(len, lines)) <= width
    assert not any("…" in line for line in lines)
    heads = [line.split() for line in lines if "variant" in line.split()]
    assert len(heads) == 2
    assert all(set(head) <= HEADS for head in heads)


@pytest.mark.parametrize("sources", [["one"], ["one", "two"]])
def test_values_and_their_total_errors_stand_on_eighty_columns(printed, sources):
    lines = printed(rows_of(*sources), 80)
    head = next(line for line in lines if "axial" in line)
    assert "α_c axial  ± total" in head
    assert any("0.0014" in line and "0.0023" in line for line in lines)


def test_the_scan_s_part_and_the_curves_stand_on_wider_ones(printed):
    lines = printed(rows_of("one", "two"), 120)
    text = "\n".join(lines)
    assert "scan" in next(line for line in lines if "± total" in line)
    assert "0.00012" in text
    assert "█" in text


def test_one_source_is_named_once(printed):
    lines = printed(rows_of("one"), 80)
    assert lines[0] == "one"
    assert sum("one" in line for line in lines) == 1


@pytest.mark.filterwarnings("ignore:shear_strain stands")
def test_a_sheared_cell_has_its_shear(printed):
    assert any("shear strain" in line for line in printed(sheared(), 80))
