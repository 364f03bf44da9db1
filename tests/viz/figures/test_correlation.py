"""Void against contact fabric: the lines that are drawn are those of the comparison."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scanfab.table.compare import compare_tables
from scanfab.table.table import Table
from scanfab.viz.figures.correlation import PAPER_SLOPE, Correlation
from scanfab.viz.figures.groups import groups_of
from scanfab.viz.figures.page import drawn_page
from tests.helpers.figures import fitted, legend_of
from tests.helpers.tables import curve, sheared


@pytest.mark.parametrize("strain_max", [None, 0.025])
def test_the_drawn_slope_is_the_table_s(drawn, strain_max):
    rows = [*curve(), *curve(variant="d", factor=0.5)]
    figure = drawn(rows, "correlation", strain_max)
    lines = fitted(figure.axes[0])
    summary = compare_tables(rows, strain_max=strain_max).summary
    assert len(lines) == len(summary) == 2
    for line, one in zip(lines, summary, strict=True):
        (x0, x1), (y0, y1) = 1e-2 * line.get_xdata(), 1e-3 * line.get_ydata()
        assert (y1 - y0) / (x1 - x0) == pytest.approx(one.slope)
    labels = legend_of(figure.axes[1])
    assert labels[0].startswith(f"variant c: RV:\n{summary[0].slope:.3f}")
    assert f"= {summary[0].r2:.3f}" in labels[0]
    assert any(f"{PAPER_SLOPE}" in label for label in labels) == (x1 > 0)


def test_the_line_goes_through_the_least_squares_line(drawn):
    rows = curve()
    x = np.array([row["alpha_c_axial"] for row in rows])
    y = np.array([row["alpha_vs_axial"] for row in rows])
    (line,) = fitted(drawn(rows).axes[4])
    slope, intercept = np.polyfit(x, y, 1)
    assert 1e-3 * line.get_ydata() == pytest.approx(intercept + slope * 1e-2 * line.get_xdata())


def test_the_slope_s_error_is_in_the_legend():
    comparison = compare_tables(curve())
    (one,) = comparison.summary
    assert one.slope_se is None
    comparison = replace(comparison, summary=Table([{**one, "slope_se": 0.0123}]))
    with drawn_page([Correlation(Table(curve()), comparison)]) as page:
        assert r"$\pm$ 0.012" in legend_of(page.axes[1])[0]


def test_each_line_of_several_groups_is_that_of_its_curve(drawn):
    """The groups order the curves otherwise than the table."""
    rows = [*curve("x", "c"), *curve("y", "a", 2.0), *curve("x", "a", 3.0), *curve("y", "c", 4.0)]
    figure = drawn(rows, "correlation")
    summary = {(one.source, one.variant): one.slope for one in compare_tables(rows).summary}
    for axes, source in zip(figure.axes[::2], "xy", strict=True):
        found = [np.ptp(line.get_ydata()) / np.ptp(line.get_xdata()) for line in fitted(axes)]
        expected = [10 * slope for (one, _), slope in summary.items() if one == source]
        assert found == pytest.approx(expected)


@pytest.mark.filterwarnings("ignore:the loading axis")
def test_intensities_have_no_line(drawn):
    figure = drawn(sheared(), "correlation")
    assert not fitted(figure.axes[0])
    assert figure.axes[0].get_ylabel().endswith(", intensity")


@pytest.mark.parametrize(
    ("errors", "shape"),
    [
        ({"alpha_vs_axial_sample_se": 2e-3, "alpha_c_axial_sample_se": 1e-2}, "+"),
        ({"alpha_vs_axial_sample_se": 2e-3}, "|"),
        ({"alpha_c_axial_se": 1e-2}, "_"),
    ],
)
def test_errors_of_the_correlation_look_in_the_legend_as_they_are_drawn(drawn, errors, shape):
    """A grey line looked like the one through zero."""
    margin = drawn([{**row, **errors} for row in curve()], "correlation").axes[1]
    handle = margin.get_legend().legend_handles[-1]
    assert (handle.get_marker(), handle.get_linestyle()) == (shape, "None")
    assert legend_of(margin)[-1].startswith("one total standard error")


def test_eight_curves_of_three_rvs_look_different_and_have_room_for_their_legend(drawn):
    kinds = [("a", None), ("b", None), *((one, rv) for one in "cd" for rv in (0.4, 0.5, 0.7))]
    rows = [
        {**row, "rv": rv}
        for number, (variant, rv) in enumerate(kinds)
        for row in curve(variant=variant, factor=1.0 + number)
    ]
    looks = [tuple(one.look.items()) for group in groups_of(rows) for one in group.drawn]
    assert len(set(looks)) == len(looks) == 8
    page = drawn(rows)
    legend = page.axes[-1].get_legend().get_window_extent()
    above = [ax.get_tightbbox().y0 for ax in page.axes[:4]]
    assert 0 < legend.y0 < legend.y1 < min(above)
    # the panel is no strip beside it
    assert page.axes[4].get_window_extent().height > 0.7 * legend.height
