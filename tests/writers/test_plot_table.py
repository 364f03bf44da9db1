"""Figures of tables: what is drawn is what the table says, and files are what their names say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scanfab.compare import compare_tables
from scanfab.errors import SettingsError
from scanfab.figures import fits_of, plot_rows
from scanfab.writers.curves import abscissa_label, curves_of
from scanfab.writers.plot import check_plot_file, new_figure
from scanfab.writers.plot_table import PAPER_SLOPE, TABLE_FIGURES, draw_table
from tests.tables import curve

BYTES = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.fixture
def drawn():
    """Draw, and give the panels."""
    figures = []

    def draw(rows, name=None, strain_max=None):
        block = new_figure(7, 7)
        figures.append(block)
        figure = block.__enter__()
        draw_table(figure, rows, fits_of(rows, strain_max), name)
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
    assert labels[0].startswith(f"c: {summary[0].slope:.3f}")
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
    (fit,) = fits_of(rows)
    assert fit is not None
    assert fit.slope_se is None
    from dataclasses import replace

    with new_figure(5, 3) as figure:
        draw_table(figure, rows, [replace(fit, slope_se=0.0123)], "correlation")
        assert "± 0.012" in legend_of(figure.axes[1])[0]


def test_curves_are_the_table_s_numbers(drawn):
    rows = curve()
    figure = drawn(rows, "evolution")
    void, contact = (axes.lines[0] for axes in figure.axes)
    assert void.get_xdata() == pytest.approx([100 * row["strain"] for row in rows])
    assert void.get_ydata() == pytest.approx([1e3 * row["alpha_vs_axial"] for row in rows])
    assert contact.get_ydata() == pytest.approx([1e2 * row["alpha_c_axial"] for row in rows])
    normalised = drawn(rows, "normalised").axes[0].lines[0].get_ydata()
    assert normalised == pytest.approx([row["alpha_vs_axial"] / 0.05 for row in rows])


def test_errors_of_scan_and_sample_are_bars_and_bands(drawn):
    rows = [
        {**row, "alpha_vs_axial_sample_se": 2e-3, "alpha_c_axial_sample_se": 1e-2}
        for row in curve()
    ]
    left, right = drawn(rows, "evolution").axes
    (bars,) = (found for found in left.collections if hasattr(found, "get_segments"))
    heights = [segment[1, 1] - segment[0, 1] for segment in bars.get_segments()]
    assert heights == pytest.approx([2 * 1e3 * 3e-4] * 5)
    for axes, error in ((left, 2.0), (right, 1.0)):
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


def test_noise_does_not_fill_the_panel(drawn):
    rows = [{**row, "alpha_vs_axial": 1e-6 * row["frame"]} for row in curve()]
    low, high = drawn(rows, "evolution").axes[0].get_ylim()
    assert high - low >= 1.0


def test_names_of_sources_are_no_formulas(drawn):
    rows = [*curve("one$x^$"), *curve("_two")]
    labels = [text.get_text() for text in drawn(rows).legends[0].get_texts()]
    assert labels == [r"variant c, one\$x^\$", "variant c, _two"]


def test_sources_are_called_by_the_last_part_of_their_path():
    rows = [*curve("runs/dense"), *curve("runs/loose")]
    assert [one.source for one in curves_of(rows)] == ["dense", "loose"]
    rows = [*curve("one/dumps"), *curve("two/dumps")]
    assert [one.source for one in curves_of(rows)] == ["one/dumps", "two/dumps"]


def test_curves_look_different(drawn):
    rows = [row for v in "abcd" for source in ("x", "y") for row in curve(source, v)]
    lines = drawn(rows, "normalised").axes[0].lines[:8]
    looks = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in lines}
    assert len(looks) == 8


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
