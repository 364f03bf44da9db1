"""Figures of tables: what is drawn is what the table says, and files are what their names say."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from scanfab.base.errors import ScanfabNote, SettingsError
from scanfab.table.compare import compare_tables
from scanfab.table.curves import abscissa_label, curves_of, is_turned, short_names
from scanfab.table.reading import total_error
from scanfab.viz.figures.correlation import PAPER_SLOPE
from scanfab.viz.figures.fitted import fits_of, plot_rows
from scanfab.viz.figures.of_tables import TABLE_FIGURES, draw_table
from scanfab.viz.figures.style import check_plot_file, new_figure
from tests.helpers.tables import curve, sheared

BYTES = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.fixture
def drawn():
    """Draw, and give the panels."""
    figures = []

    def draw(rows, name=None, strain_max=None):
        block = new_figure(7, 7)
        figures.append(block)
        figure = block.__enter__()
        draw_table(figure, rows, fits_of(compare_tables(rows, strain_max=strain_max)), name)
        figure.canvas.draw()
        return figure

    yield draw
    for block in reversed(figures):
        block.__exit__(None, None, None)


def fitted(axes):
    return [line for line in axes.lines if line.get_gid() == "fit"]


def legend_of(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


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


def test_the_slope_s_error_is_in_the_legend(drawn):
    rows = curve()
    (fit,) = fits_of(compare_tables(rows))
    assert fit is not None
    assert fit.slope_se is None
    from dataclasses import replace

    with new_figure(5, 3) as figure:
        draw_table(figure, rows, [replace(fit, slope_se=0.0123)], "correlation")
        assert r"$\pm$ 0.012" in legend_of(figure.axes[1])[0]


def test_curves_are_the_table_s_numbers(drawn):
    rows = curve()
    figure = drawn(rows, "evolution")
    void, contact = (axes.lines[0] for axes in figure.axes)
    assert void.get_xdata() == pytest.approx([100 * row["strain"] for row in rows])
    assert void.get_ydata() == pytest.approx([1e3 * row["alpha_vs_axial"] for row in rows])
    assert contact.get_ydata() == pytest.approx([1e2 * row["alpha_c_axial"] for row in rows])
    normalised = drawn(rows, "normalised").axes[0].lines[0].get_ydata()
    assert normalised == pytest.approx([row["alpha_vs_axial"] / 0.05 for row in rows])


def test_bands_are_total_errors_and_bars_the_scan_s_part(drawn):
    """Of the contacts the sample's error is the total; the legend says all of it."""
    rows = [
        {**row, "alpha_vs_axial_sample_se": 2e-3, "alpha_c_axial_sample_se": 1e-2}
        for row in curve()
    ]
    figure = drawn(rows, "evolution")
    note = figure.legends[0].get_title().get_text()
    assert "one total standard error" in note
    assert "scan and sample together" in note
    assert r"the scan's part, at most $0.3\times10^{-3}$" in note
    left, right = figure.axes
    (bars,) = (found for found in left.collections if hasattr(found, "get_segments"))
    heights = [segment[1, 1] - segment[0, 1] for segment in bars.get_segments()]
    assert heights == pytest.approx([2 * 1e3 * 3e-4] * 5)
    for axes, error in ((left, 1e3 * np.hypot(3e-4, 2e-3)), (right, 1.0)):
        band = axes.collections[0].get_paths()[0].vertices
        at_zero = band[band[:, 0] == 0, 1]
        assert np.ptp(at_zero) == pytest.approx(2 * error)


def test_tables_without_errors_have_neither(drawn):
    rows = [{**row, "alpha_vs_axial_se": None} for row in curve()]
    figure = drawn(rows, "evolution")
    assert not figure.axes[0].collections
    assert "standard error" not in figure.legends[0].get_title().get_text()


def test_without_strain_the_frame_is_the_abscissa(drawn):
    rows = [{**row, "strain": None} for row in curve()]
    assert abscissa_label(rows) == "frame"
    assert drawn(rows).axes[0].lines[0].get_xdata().tolist() == [0, 1, 2, 3, 4]


def test_a_missing_value_is_a_hole_and_one_frame_a_point(drawn):
    rows = curve()
    rows[2]["alpha_vs_axial"] = None
    assert np.isnan(drawn(rows).axes[0].lines[0].get_ydata()[2])
    figure = drawn(curve()[:1])
    assert len(figure.axes[0].lines[0].get_xdata()) == 1
    assert "no line" in legend_of(figure.axes[5])[0]


@pytest.mark.parametrize("column", ["alpha_vs_axial", "alpha_vs_axial_se", "alpha_c_axial"])
def test_what_is_too_large_to_draw_is_a_hole(tmp_path, column):
    rows = curve()
    rows[2][column] = 1e308
    plot_rows(tmp_path / "x.png", rows, "evolution")


def test_a_comparison_is_made_and_told_once(tmp_path):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        comparison = compare_tables(sheared())
        plot_rows(tmp_path / "x.png", sheared(), "evolution", comparison)
    for text in ("shear_strain stands in", "the loading axis is not"):
        assert sum(text in str(one.message) for one in told) == 1


def test_noise_does_not_fill_the_panel(drawn):
    rows = [{**row, "alpha_vs_axial": 1e-6 * row["frame"]} for row in curve()]
    low, high = drawn(rows, "evolution").axes[0].get_ylim()
    assert high - low >= 1.0


def test_names_of_sources_are_no_formulas(drawn):
    rows = [*curve("one$x^$"), *curve("_two")]
    labels = [text.get_text() for text in drawn(rows, "evolution").legends[0].get_texts()]
    assert labels == [r"variant c, one\$x^\$", "variant c, _two"]


def test_sources_are_called_by_the_last_part_of_their_path():
    rows = [*curve("runs/dense"), *curve("runs/loose")]
    assert [one.source for one in curves_of(rows)] == ["dense", "loose"]
    rows = [*curve("one/dumps"), *curve("two/dumps")]
    assert [one.source for one in curves_of(rows)] == ["one/dumps", "two/dumps"]


def looks_of(axes):
    # without the caps of error bars
    lines = [line for line in axes.lines if line.get_marker() not in ("None", "_")]
    return {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in lines}


def titles_of(figure):
    return [axes.get_title(loc="left") for axes in figure.axes]


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


def test_each_line_of_several_groups_is_that_of_its_curve(drawn):
    """The groups order the curves otherwise than the table."""
    rows = [*curve("x", "c"), *curve("y", "a", 2.0), *curve("x", "a", 3.0), *curve("y", "c", 4.0)]
    figure = drawn(rows, "correlation")
    summary = {(one.source, one.variant): one.slope for one in compare_tables(rows).summary}
    for axes, source in zip(figure.axes[::2], "xy", strict=True):
        found = [np.ptp(line.get_ydata()) / np.ptp(line.get_xdata()) for line in fitted(axes)]
        expected = [10 * slope for (one, _), slope in summary.items() if one == source]
        assert found == pytest.approx(expected)


@pytest.mark.parametrize("name", [None, *TABLE_FIGURES])
def test_all_panels_are_lettered_and_say_which_alpha(drawn, name):
    figure = drawn(curve(), name)
    panels = [axes for axes in figure.axes if axes.axison]
    letters = [axes.get_title(loc="left") for axes in panels]
    assert letters == [f"({letter})" for letter in "abcde"[: len(panels)]]
    assert all(axes.get_ylabel().count(", axial") == 1 for axes in panels)


def test_a_sheared_cell_has_intensities_and_coaxiality_over_its_shear(drawn):
    with pytest.warns(ScanfabNote, match="the loading axis is not the axis of the contact fabric"):
        figure = drawn(sheared(), "evolution")
    void, contact, angle = figure.axes
    assert [axes.get_ylabel().count(", intensity") for axes in figure.axes] == [1, 1, 0]
    assert "shear strain" in void.get_xlabel()
    rows = sheared()
    for axes, name, factor in (
        (void, "alpha_vs", 1e3), (contact, "alpha_c", 1e2), (angle, "coaxiality_deg", 1.0)
    ):  # fmt: skip
        line = axes.lines[0]
        assert line.get_xdata() == pytest.approx([100 * row["shear_strain"] for row in rows])
        assert line.get_ydata() == pytest.approx([factor * row[name] for row in rows])
    note = figure.legends[0].get_title().get_text()
    assert note == "without errors: the table has those of the axial values only"


@pytest.mark.filterwarnings("ignore:the loading axis")
def test_intensities_have_no_line(drawn):
    figure = drawn(sheared(), "correlation")
    assert not fitted(figure.axes[0])
    assert figure.axes[0].get_ylabel().endswith(", intensity")


def captions(rows):
    with new_figure(5, 3) as figure:
        return draw_table(figure, rows, fits_of(compare_tables(rows)))


def with_samples(rows):
    return [
        {**row, "alpha_vs_axial_sample_se": 2e-3, "alpha_c_axial_sample_se": 1e-2} for row in rows
    ]


def test_captions_say_what_is_drawn():
    evolution, normalised, correlation = captions(with_samples(curve()))
    errors = "with total standard errors of voids and contacts"
    assert evolution == (
        f"Void and contact anisotropy along the loading axis, over the axial strain; {errors}"
    )
    assert normalised.endswith(f"each curve divided by its own largest absolute value; {errors}")
    assert correlation == (
        "Void against contact anisotropy along the loading axis, with fitted lines and the "
        "paper's slope"
    )


@pytest.mark.filterwarnings("ignore:the loading axis", "ignore:shear_strain stands")
def test_captions_of_turned_axes_promise_no_errors_and_no_line():
    evolution, normalised, correlation = captions(with_samples(sheared()))
    assert evolution == (
        "Intensity of void and contact anisotropy, and the angle between their major axes, over "
        "the shear strain; without total errors"
    )
    assert normalised.startswith("Intensity of void and contact anisotropy, over")
    assert correlation == "Void against contact intensity, without a line"


def test_captions_name_the_frame_where_there_is_no_strain():
    for caption in captions([{**row, "strain": None} for row in curve()])[:2]:
        assert ", over the number of the frame" in caption
        assert "strain" not in caption


def test_captions_promise_no_line_that_is_not_drawn():
    """One frame has none; nor is the paper's slope drawn where all contacts lie below zero."""
    assert captions(curve()[:1])[2].endswith(", without a line")
    below = [{**row, "alpha_c_axial": row["alpha_c_axial"] - 1} for row in curve()]
    assert captions(below)[2].endswith(", with fitted lines")


@pytest.mark.parametrize(
    ("errors", "named"),
    [
        ({}, "without total errors"),
        ({"alpha_vs_axial_sample_se": 2e-3}, "with total standard errors of voids"),
        ({"alpha_c_axial_sample_se": 2e-3}, "with total standard errors of contacts"),
    ],
)
def test_captions_name_the_errors_that_have_bands(errors, named):
    assert captions([{**row, **errors} for row in curve()])[0].endswith(f"; {named}")


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


def test_without_the_scan_s_part_there_is_no_band(drawn):
    """The sample's part alone is no total: a single replicate may be off by far more."""
    rows = [{**row, "alpha_vs_axial_se": None} for row in with_samples(curve())]
    assert not drawn(rows, "evolution").axes[0].collections
    assert total_error(rows[0], "alpha_vs_axial") is None


@pytest.mark.parametrize(("axial", "turned"), [(0.9, False), (0.4, True)])
def test_the_most_certain_frame_tells_whether_the_axes_are_turned(axial, turned):
    rows = [{**row, "alpha_c_axial": axial * row["alpha_c"]} for row in sheared()]
    rows[0].update(alpha_c=1.0, alpha_c_axial=0.0, alpha_c_axial_se=1.0)
    assert is_turned(rows) == turned
    assert is_turned(curve()) is False


def test_one_frame_has_its_error_as_a_bar(drawn):
    """An area needs two points."""
    row = {**curve()[2], "alpha_vs_axial_sample_se": 2e-3, "alpha_vs_axial_se": 0.0}
    figure = drawn([row], "evolution")
    assert figure.axes[0].get_xlim() == pytest.approx((1.0, 3.0))
    heights = [
        np.ptp(segment[:, 1])
        for found in figure.axes[0].collections
        if hasattr(found, "get_segments")
        for segment in found.get_segments()
    ]
    # the band, and the scan's part of nothing
    assert heights == pytest.approx([4.0, 0.0])


def test_long_names_are_cut_in_the_middle_and_stay_different():
    names = [f"{'a' * 60}{end}" for end in "xy"]
    assert short_names(names) == {name: f"{'a' * 14}...{'a' * 13}{name[-1]}" for name in names}
    alike = [f"{'a' * 30}{end}{'b' * 30}" for end in "xy"]
    assert len(set(short_names(alike).values())) == 2


def test_the_words_of_a_figure_fit_its_width(drawn):
    """Nothing is cut off, whatever the sources are called."""
    rows = [row for source in ("p" * 90, "q" * 90) for v in "abcd" for row in curve(source, v)]
    for name in TABLE_FIGURES:
        figure = drawn(rows, name)
        box = figure.get_tightbbox()
        width, height = figure.get_size_inches()
        assert box.x0 > -0.02
        assert box.y0 > -0.02
        assert box.x1 < width + 0.02
        assert box.y1 < height + 0.02


@pytest.mark.parametrize("rows", [[], [{**row, "alpha_vs_axial": None} for row in curve()]])
def test_nothing_to_draw_is_an_error(rows, tmp_path):
    with pytest.raises(SettingsError, match="nothing to draw"):
        plot_rows(tmp_path / "x.png", rows)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", BYTES)
@pytest.mark.parametrize("name", [None, *TABLE_FIGURES])
def test_files_are_what_their_names_say_and_repeat(tmp_path, suffix, name):
    one, two = tmp_path / f"one{suffix}", tmp_path / f"two{suffix}"
    for path in (one, two):
        plot_rows(path, curve(), name)
    assert one.read_bytes().startswith(BYTES[suffix])
    assert one.read_bytes() == two.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("name", "message"),
    [("x.docx", "not as .docx"), ("x", "without a suffix"), ("no/x.png", "there is no folder")],
)
def test_files_that_cannot_be_written_are_told_before(tmp_path, name, message):
    with pytest.raises(SettingsError, match=message):
        check_plot_file(tmp_path / name)
    check_plot_file(Path(tmp_path / "x.PNG"))
