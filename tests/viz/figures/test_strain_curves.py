"""Curves over the strain: what is drawn is what the table says, and captions say what is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.base.errors import ScanfabNote
from scanfab.table.curves import abscissa_label
from scanfab.table.row import total_error
from scanfab.viz.figures.page import make_figures
from tests.helpers.figures import fitted, legend_of, save_rows, titles_of, with_samples
from tests.helpers.tables import curve, sheared


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
    save_rows(tmp_path / "x.png", rows, "evolution")


def test_noise_does_not_fill_the_panel(drawn):
    rows = [{**row, "alpha_vs_axial": 1e-6 * row["frame"]} for row in curve()]
    low, high = drawn(rows, "evolution").axes[0].get_ylim()
    assert high - low >= 1.0


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


def captions(rows):
    return [one.caption for one in make_figures(rows, "table")]


def test_captions_say_what_is_drawn():
    evolution, normalised, correlation = captions(with_samples(curve()))
    errors = "with total standard errors of voids and contacts"
    assert evolution == (
        f"Void and contact anisotropy along the loading axis, over the axial strain; {errors}."
    )
    assert normalised.endswith(f"each curve divided by its own largest absolute value; {errors}.")
    assert correlation == (
        "Void against contact anisotropy along the loading axis, with fitted lines and the "
        "paper's slope."
    )


@pytest.mark.filterwarnings("ignore:the loading axis", "ignore:shear_strain stands")
def test_captions_of_turned_axes_promise_no_errors_and_no_line():
    evolution, normalised, correlation = captions(with_samples(sheared()))
    assert evolution == (
        "Intensity of void and contact anisotropy, and the angle between their major axes, over "
        "the shear strain; without total errors."
    )
    assert normalised.startswith("Intensity of void and contact anisotropy, over")
    assert correlation == "Void against contact intensity, without a line."


def test_captions_name_the_frame_where_there_is_no_strain():
    for caption in captions([{**row, "strain": None} for row in curve()])[:2]:
        assert ", over the number of the frame" in caption
        assert "strain" not in caption


def test_captions_promise_no_line_that_is_not_drawn():
    """One frame has none; nor is the paper's slope drawn where all contacts lie below zero."""
    assert captions(curve()[:1])[2].endswith(", without a line.")
    below = [{**row, "alpha_c_axial": row["alpha_c_axial"] - 1} for row in curve()]
    assert captions(below)[2].endswith(", with fitted lines.")


@pytest.mark.parametrize(
    ("errors", "named"),
    [
        ({}, "without total errors"),
        ({"alpha_vs_axial_sample_se": 2e-3}, "with total standard errors of voids"),
        ({"alpha_c_axial_sample_se": 2e-3}, "with total standard errors of contacts"),
    ],
)
def test_captions_name_the_errors_that_have_bands(errors, named):
    assert captions([{**row, **errors} for row in curve()])[0].endswith(f"; {named}.")


def test_without_the_scan_s_part_there_is_no_band(drawn):
    """The sample's part alone is no total: a single replicate may be off by far more."""
    rows = [{**row, "alpha_vs_axial_se": None} for row in with_samples(curve())]
    assert not drawn(rows, "evolution").axes[0].collections
    assert total_error(rows[0], "alpha_vs_axial") is None


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
