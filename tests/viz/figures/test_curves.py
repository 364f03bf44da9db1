"""Figures of a table: what is drawn is what the table says, and captions say what is drawn."""

from dataclasses import replace

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabNote, SettingsError
from scanfab.table.compare import compare_tables
from scanfab.table.table import Table
from scanfab.viz.figures.anisotropy import PAPER_SLOPE, Correlation
from scanfab.viz.figures.curves import Columns, groups_of
from scanfab.viz.figures.figure import drawn_page, make_figures
from tests.helpers.figures import fitted
from tests.helpers.tables import curve, sheared

VOID_SAMPLE = {"alpha_vs_axial_sample_se": 2e-3}
CONTACT_SAMPLE = {"alpha_c_axial_sample_se": 1e-2}
SAMPLES = {**VOID_SAMPLE, **CONTACT_SAMPLE}
TURNED = "ignore:the loading axis|shear_strain stands"


def legend_of(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def titles_of(figure):
    return [axes.get_title(loc="left") for axes in figure.axes]


def with_all(rows, **values):
    return [{**row, **values} for row in rows]


def bars_of(axes):
    """Heights of the bars, those of the band of a point alone first."""
    found = [one for one in axes.collections if hasattr(one, "get_segments")]
    return [np.ptp(segment[:, 1]) for one in found for segment in one.get_segments()]


def test_rows_of_several_cut_offs_or_without_void_fabric_are_no_curve():
    several = [*with_all(curve(), cutoff=0.1), *with_all(curve(), cutoff=0.2)]
    empty = with_all(curve(), alpha_vs_axial=None)
    nothing = "there is nothing to draw"
    for rows, told in ((several, "cut-offs.*choose one"), (empty, nothing), ([], nothing)):
        with pytest.raises(SettingsError, match=told):
            groups_of(rows)


def with_state(rows):
    state = {"q": None, "acst_c_se": 0.02}
    return [{**row, **state, "p": 2.0 + k, "acst_c": 0.1 * k} for k, row in enumerate(rows)]


def band_of(axes):
    return axes.collections[0].get_paths()[0].vertices


def test_curves_are_the_table_s_numbers(drawn):
    rows = curve()
    void, contact = (axes.lines[0] for axes in drawn(rows, "evolution").axes)
    assert void.get_xdata() == pytest.approx([100 * row["strain"] for row in rows])
    assert void.get_ydata() == pytest.approx([1e3 * row["alpha_vs_axial"] for row in rows])
    assert contact.get_ydata() == pytest.approx([1e2 * row["alpha_c_axial"] for row in rows])
    normalised = drawn(rows, "normalised").axes[0].lines[0].get_ydata()
    assert normalised == pytest.approx([row["alpha_vs_axial"] / 0.05 for row in rows])


def test_bands_are_total_errors_and_bars_the_scan_s_part(drawn):
    """Of the contacts the sample's error is the total; the legend says all of it."""
    figure = drawn(with_all(curve(), **SAMPLES), "evolution")
    note = figure.legends[0].get_title().get_text()
    assert "one total standard error" in note
    assert "scan and sample together" in note
    assert r"the scan's part, at most $0.3\times10^{-3}$" in note
    assert bars_of(figure.axes[0]) == pytest.approx([2 * 1e3 * 3e-4] * 5)
    for axes, error in zip(figure.axes, (1e3 * np.hypot(3e-4, 2e-3), 1.0), strict=True):
        band = band_of(axes)
        assert np.ptp(band[band[:, 0] == 0, 1]) == pytest.approx(2 * error)


def test_without_the_scan_s_part_there_is_no_band(drawn):
    """The sample's part alone is no total: a single replicate may be off by far more."""
    figure = drawn(with_all(curve(), **VOID_SAMPLE, alpha_vs_axial_se=None), "evolution")
    assert not figure.axes[0].collections
    assert "standard error" not in figure.legends[0].get_title().get_text()


def test_one_frame_has_its_error_as_a_bar_and_no_line(drawn):
    """An area needs two points."""
    figure = drawn(with_all(curve()[2:3], **VOID_SAMPLE, alpha_vs_axial_se=0.0))
    assert figure.axes[0].get_xlim() == pytest.approx((1.0, 3.0))
    # the band, and the scan's part of nothing
    assert bars_of(figure.axes[0]) == pytest.approx([4.0, 0.0])
    assert "no line" in legend_of(figure.axes[5])[0]


@pytest.mark.parametrize("column", ["alpha_vs_axial", "alpha_vs_axial_se", "alpha_c_axial"])
def test_what_is_missing_or_too_large_to_draw_is_a_hole(drawn, column):
    for value in (None, 1e308):
        rows = curve()
        rows[2][column] = value
        holes = np.isnan(drawn(rows, "evolution").axes[0].lines[0].get_ydata())
        assert holes.tolist() == [k == 2 and column == "alpha_vs_axial" for k in range(5)]


def test_noise_does_not_fill_the_panel(drawn):
    for figure, column, middle, noise in (
        ("evolution", "alpha_vs_axial", 0.0, 1e-6), ("columns:p", "p", 1e5, 1e-8),
    ):  # fmt: skip
        rows = [{**row, column: middle + noise * row["frame"]} for row in curve()]
        low, high = drawn(rows, figure).axes[0].get_ylim()
        assert high - low >= 1.0
    rows = [{**row, "alpha_vs_axial": 5.0 + 0.1 * row["frame"]} for row in curve()]
    assert drawn(rows, "evolution").axes[0].get_ylim()[0] <= 0.0


def test_names_of_sources_are_no_formulas(drawn):
    rows = [*curve("one$x^$"), *curve("_two")]
    labels = [text.get_text() for text in drawn(rows, "evolution").legends[0].get_texts()]
    assert labels == [r"variant c, one\$x^\$", "variant c, _two"]


def looks_of(axes):
    # without the caps of error bars
    lines = [line for line in axes.lines if line.get_marker() not in ("None", "_")]
    return {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in lines}


def test_two_sources_of_four_variants_are_a_row_of_panels_each(drawn):
    rows = [row for source in ("x", "y") for v in "abcd" for row in curve(source, v)]
    figure = drawn(rows, "normalised")
    assert titles_of(figure) == ["(a) x", "(b)", "(c) y", "(d)"]
    assert [len(looks_of(axes)) for axes in figure.axes] == [4, 4, 4, 4]
    assert len(figure.legends[0].get_texts()) == 4
    assert figure.axes[0].get_ylim() == figure.axes[2].get_ylim()
    figure = drawn(rows, "correlation")
    assert titles_of(figure)[::2] == ["(a) x", "(b) y"]
    assert [len(fitted(axes)) for axes in figure.axes[::2]] == [4, 4]


def test_many_sources_are_a_row_of_panels_for_each_variant(drawn):
    rows = [row for source in "pqrstu" for v in "cd" for row in curve(source, v)]
    figure = drawn(rows, "evolution")
    assert titles_of(figure)[::2] == ["(a) variant c: RV", "(c) variant d: RV, rattlers void"]
    assert [len(looks_of(axes)) for axes in figure.axes[::2]] == [6, 6]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list("pqrstu")


@pytest.mark.filterwarnings(TURNED)
def test_a_sheared_cell_has_intensities_and_coaxiality_over_its_shear_and_no_line(drawn):
    with pytest.warns(ScanfabNote, match="the loading axis is not the axis of the contact") as told:
        figure = drawn(sheared(), "evolution")
    assert sum("the loading axis is not" in str(one.message) for one in told) == 1
    rows, columns = sheared(), {"alpha_vs": 1e3, "alpha_c": 1e2, "coaxiality_deg": 1.0}
    assert [axes.get_ylabel().count(", intensity") for axes in figure.axes] == [1, 1, 0]
    assert "shear strain" in figure.axes[0].get_xlabel()
    for axes, (name, factor) in zip(figure.axes, columns.items(), strict=True):
        line = axes.lines[0]
        assert line.get_xdata() == pytest.approx([100 * row["shear_strain"] for row in rows])
        assert line.get_ydata() == pytest.approx([factor * row[name] for row in rows])
    note = figure.legends[0].get_title().get_text()
    assert note == "without errors: the table has those of the axial values only"
    correlation = drawn(sheared(), "correlation").axes[0]
    assert not fitted(correlation)
    assert correlation.get_ylabel().endswith(", intensity")


def captions(rows, **values):
    return [one.caption for one in make_figures(with_all(rows, **values), "table")]


@pytest.mark.filterwarnings(TURNED)
@pytest.mark.parametrize(
    ("rows", "values", "number", "said"),
    [
        (curve(), {}, 0, "Void and contact anisotropy along the loading axis, over the axial"),
        (curve(), {"strain": None}, 0, ", over the number of the frame."),
        (curve(), {}, 1, ", each curve divided by its own largest absolute value."),
        (curve(), {}, 2, "Void against contact anisotropy along the loading axis."),
        (sheared(), SAMPLES, 0, "and the angle between their major axes, over the shear strain."),
        (sheared(), SAMPLES, 1, "Intensity of void and contact anisotropy, over"),
        (sheared(), SAMPLES, 2, "Void against contact intensity."),
        (with_state(curve()), {}, 3, "p, acst_c over the axial strain; bands are their standard"),
    ],
)
def test_captions_say_what_is_drawn(rows, values, number, said):
    assert said in captions(rows, **values)[number]


def test_columns_have_a_panel_each_with_the_table_s_numbers(drawn):
    rows = with_state(curve())
    first, second = drawn(rows, "columns:p,acst_c").axes
    assert first.get_ylabel() == "p"
    assert first.lines[0].get_ydata() == pytest.approx([row["p"] for row in rows])
    assert second.lines[0].get_xdata() == pytest.approx([100 * row["strain"] for row in rows])
    assert band_of(second)[:, 1].max() == pytest.approx(0.1 * (len(rows) - 1) + 0.02)


def test_by_default_columns_are_what_was_asked_for_with_the_table():
    table = Table(with_state(curve()))
    # a column without any value is none
    assert Columns(table).names == ["p", "acst_c"]
    assert any(isinstance(one, Columns) for one in make_figures(table, "table"))
    assert not any(isinstance(one, Columns) for one in make_figures(curve(), "table"))
    with pytest.raises(SettingsError, match="name those to draw"):
        Columns(Table(curve()))
    for of, message in (("pp", "there is no column 'pp'"), ("q", "holds no numbers")):
        with pytest.raises(SettingsError, match=message):
            Columns(table, of=of)


def test_several_sources_have_a_block_of_columns_each(drawn):
    rows = [row for source in ("x", "y") for v in "ac" for row in with_state(curve(source, v))]
    figure = drawn(rows, "columns:p,acst_c,alpha_c_axial")
    assert len(figure.axes) == 6
    with pytest.raises(SettingsError, match="too many for one Axes"):
        scanfab.Table(rows).plot.columns(ax=figure.axes[0], of="p")


@pytest.mark.parametrize("strain_max", [None, 0.025])
def test_the_drawn_slope_is_the_table_s(drawn, strain_max):
    rows = [*curve(), *curve(variant="d", factor=0.5)]
    figure = drawn(rows, "correlation", strain_max)
    lines = fitted(figure.axes[0])
    summary = compare_tables(rows, strain_max=strain_max).summary
    labels = legend_of(figure.axes[1])
    chosen = [row for row in curve() if strain_max is None or row["strain"] <= strain_max]
    x, y = ([row[name] for row in chosen] for name in ("alpha_c_axial", "alpha_vs_axial"))
    for line, one, factor in zip(lines, summary, (1.0, 0.5), strict=True):
        (x0, x1), (y0, y1) = 1e-2 * line.get_xdata(), 1e-3 * line.get_ydata()
        assert (y1 - y0) / (x1 - x0) == pytest.approx(one.slope)
        assert [y0, y1] == pytest.approx(factor * np.polyval(np.polyfit(x, y, 1), [x0, x1]))
    assert labels[0].startswith(f"variant c: RV:\n{summary[0].slope:.3f}")
    assert f"= {summary[0].r2:.3f}" in labels[0]
    assert any(f"{PAPER_SLOPE}" in label for label in labels) == (x1 > 0)


def test_the_slope_s_error_is_in_the_legend():
    comparison = compare_tables(curve())
    summary = Table([{**comparison.summary[0], "slope_se": 0.0123}])
    with drawn_page([Correlation(Table(curve()), replace(comparison, summary=summary))]) as page:
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


def test_errors_of_the_correlation_look_in_the_legend_as_they_are_drawn(drawn):
    """A grey line looked like the one through zero."""
    for errors, shape in ((SAMPLES, "+"), (VOID_SAMPLE, "|"), ({"alpha_c_axial_se": 1e-2}, "_")):
        margin = drawn(with_all(curve(), **errors), "correlation").axes[1]
        handle = margin.get_legend().legend_handles[-1]
        assert (handle.get_marker(), handle.get_linestyle()) == (shape, "None")
        assert legend_of(margin)[-1].startswith("one total standard error")


def test_eight_curves_of_three_rvs_look_different_and_have_room_for_their_legend(drawn):
    kinds = [("a", None), ("b", None), *((one, rv) for one in "cd" for rv in (0.4, 0.5, 0.7))]
    rows = [row for variant, rv in kinds for row in with_all(curve(variant=variant), rv=rv)]
    looks = [tuple(one.look.items()) for group in groups_of(rows) for one in group.drawn]
    assert len(set(looks)) == len(looks) == 8
    page = drawn(rows)
    legend = page.axes[-1].get_legend().get_window_extent()
    above = [ax.get_tightbbox().y0 for ax in page.axes[:4]]
    assert 0 < legend.y0 < legend.y1 < min(above)
    # the panel is no strip beside it
    assert page.axes[4].get_window_extent().height > 0.7 * legend.height
