"""The curve over the cut-off goes through the table, with the errors that it has there."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from matplotlib.figure import Figure

import scanfab
from scanfab.pipeline.settings import Settings
from scanfab.table.row import total_error
from scanfab.viz.figures.cutoffs import CutoffCurve, Cutoffs
from scanfab.viz.figures.page import drawn_page
from scanfab.viz.scanned_frames import ScannedFrames
from tests.helpers.figures import frame_figure, row_of

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")
SETTINGS = Settings(boundary="mask=3", tolerance=5e-4)


def test_the_curve_of_cut_offs_goes_through_the_table(series, computed):
    figure = frame_figure(series, SETTINGS, computed.rows, "cutoffs")
    for curve, frame in zip(figure.curves, (0, 6), strict=True):
        row = row_of(computed, frame)
        (place,) = np.flatnonzero(curve.cutoff == 1.0)
        assert curve.chosen == pytest.approx(1.0)
        near = 4 * np.hypot(curve.error[place], row["alpha_vs_axial_se"])
        assert abs(curve.alpha[place] - row["alpha_vs_axial"]) < near


@pytest.mark.filterwarnings(
    "ignore:frame .* above the tolerance:scanfab.base.errors.ScanfabWarning"
)
def test_figures_have_the_moment_of_the_table(series):
    """The mean of the squares over the mean is far more anisotropic than the mean."""
    words = {"boundary": "mask=3", "tolerance": 5e-4, "moment": 2}
    found = {}
    for frame in (0, 6):
        (row,) = scanfab.compute(series, **words, variants="c", frames=str(frame))
        found[frame] = dict(row)
    settings = Settings(**words)
    figure = frame_figure(series, settings, list(found.values()), "cutoffs")
    for curve, row in zip(figure.curves, found.values(), strict=True):
        (place,) = np.flatnonzero(curve.cutoff == 1.0)
        near = 4 * np.hypot(curve.error[place], row["alpha_vs_axial_se"])
        assert abs(curve.alpha[place] - row["alpha_vs_axial"]) < near


def test_cut_offs_have_the_total_error_and_the_scan_s_part(series, computed):
    """At the cut-off of the table what it says there, to the last digit but for rounding."""
    figure = frame_figure(series, SETTINGS, computed.rows, "cutoffs")
    for curve, frame in zip(figure.curves, (0, 6), strict=True):
        row = row_of(computed, frame)
        (place,) = np.flatnonzero(curve.cutoff == 1.0)
        assert curve.alpha[place] == pytest.approx(row["alpha_vs_axial"], rel=1e-9)
        assert curve.error[place] == pytest.approx(row["alpha_vs_axial_se"], rel=1e-9)
        total = total_error(row, "alpha_vs_axial")
        assert curve.total[place] == pytest.approx(total, rel=1e-9)
    assert np.all(curve.total > curve.error)


def test_the_band_of_cut_offs_does_not_vanish_in_a_rough_scan(series, computed):
    """Nor is it told that errors grow with the cut-off, which is what the figure shows."""
    settings = Settings(boundary="mask=3", tolerance=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error", scanfab.ScanfabWarning)
        curves = frame_figure(series, settings, computed.rows, "cutoffs").curves
    for curve in curves:
        assert np.all(curve.total > curve.error)


def test_the_cut_off_of_the_table_is_one_of_the_curve(series, computed):
    settings = Settings(boundary="mask=3", tolerance=2e-3, cutoff="0.8rmin")
    figure = frame_figure(series, settings, computed.rows, "cutoffs")
    assert all(one.chosen in one.cutoff for one in figure.curves)


def test_a_cut_off_without_a_total_error_is_told():
    values = np.array([1.0, 2.0, 3.0])
    for total, told in ((values, False), (np.array([1.0, np.nan, 3.0]), True)):
        figure = Cutoffs(None)
        figure.curves = [CutoffCurve("one", values, values, values, total, 1.0, values)]
        with drawn_page([figure]) as page:
            note = page.legends[0].get_title().get_text()
        assert ("(none where either is not known)" in note) == told


def test_it_says_what_the_table_says_without_other_words(series, computed):
    """On the Axes of a notebook."""
    ax = Figure().subplots()
    frames = ScannedFrames(series, SETTINGS, computed.rows)
    assert frames.plot.cutoffs(ax=ax, frame=6) is ax
    row = row_of(computed, 6)
    at = next(line for line in ax.lines if len(line.get_xdata()) > 2)
    (place,) = np.flatnonzero(at.get_xdata() == 1.0)
    assert at.get_ydata()[place] == pytest.approx(1e3 * row["alpha_vs_axial"])
    assert "bands: one total standard error" in ax.get_legend().get_title().get_text()
