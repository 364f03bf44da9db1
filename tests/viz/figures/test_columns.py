"""Any columns over the strain: what is drawn is what the table says."""

from __future__ import annotations

import pytest

import scanfab
from scanfab.base.errors import SettingsError
from scanfab.table.table import Table
from scanfab.viz.figures.columns import Columns
from scanfab.viz.figures.page import find_figure, make_figures
from tests.helpers.tables import curve


def with_state(rows):
    return [
        {**row, "p": 2.0 + k, "q": None, "acst_c": 0.1 * k, "acst_c_se": 0.02}
        for k, row in enumerate(rows)
    ]


def test_a_panel_for_each_column_with_the_table_s_numbers(drawn):
    rows = with_state(curve())
    figure = drawn(rows, "columns:p,acst_c")
    first, second = figure.axes
    assert first.get_ylabel() == "p"
    assert first.lines[0].get_ydata() == pytest.approx([row["p"] for row in rows])
    assert second.lines[0].get_xdata() == pytest.approx([100 * row["strain"] for row in rows])
    vertices = second.collections[0].get_paths()[0].vertices
    assert vertices[:, 1].max() == pytest.approx(0.1 * (len(rows) - 1) + 0.02)


def test_by_default_it_draws_what_was_asked_for_with_the_table():
    table = Table(with_state(curve()))
    # a column without any value is none
    assert Columns(table).names == ["p", "acst_c"]
    assert "acst_c" in Columns(table).caption
    assert any(isinstance(one, Columns) for one in make_figures(table, "table"))
    assert not any(isinstance(one, Columns) for one in make_figures(curve(), "table"))


@pytest.mark.parametrize(
    ("of", "message"),
    [("pp", "there is no column 'pp'"), ("variant", "holds no numbers"), ("q", "holds no numbers")],
)
def test_columns_that_cannot_be_drawn(of, message):
    with pytest.raises(SettingsError, match=message):
        Columns(Table(with_state(curve())), of=of)


def test_a_table_without_groups_says_what_to_name():
    with pytest.raises(SettingsError, match="name those to draw"):
        Columns(Table(curve()))


def test_names_stand_behind_a_colon():
    assert find_figure("columns:p,q", "table") == (Columns, {"of": "p,q"})


def test_several_sources_have_a_block_of_panels_each(drawn):
    rows = [
        {**row, "source": source, "variant": variant}
        for source in ("one", "two")
        for variant in "ac"
        for row in with_state(curve())
    ]
    figure = drawn(rows, "columns:p,acst_c,alpha_c_axial")
    assert len(figure.axes) == 6
    with pytest.raises(SettingsError, match="too many for one Axes"):
        scanfab.Table(rows).plot.columns(ax=figure.axes[0], of="p")
