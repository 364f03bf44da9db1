"""Figures of frames: what is drawn is what the scan and the table say."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import SettingsError
from scanfab.pipeline.settings import Settings
from scanfab.table.reading import total_error
from scanfab.viz.figures import of_frames as plot_frame
from scanfab.viz.figures import scanned as frame_figures
from scanfab.viz.figures.of_frames import disk
from scanfab.viz.figures.scanned import FRAME_FIGURES, parse_figure, plot_frames
from tests.conftest import ROOT, SAMPLE
from tests.viz.figures.test_of_tables import BYTES

pytestmark = pytest.mark.filterwarnings("ignore:passed over:scanfab.base.errors.ScanfabNote")
SETTINGS = Settings(boundary="mask=3", tolerance=5e-4)


@pytest.fixture
def series(monkeypatch):
    monkeypatch.chdir(ROOT)
    return scanfab.read_series(SAMPLE)


@pytest.fixture
def caught(monkeypatch):
    """What goes to the figure."""
    found = {}
    for name in FRAME_FIGURES:
        monkeypatch.setattr(
            frame_figures,
            f"plot_{name}",
            lambda path, data, dpi, name=name: found.update({name: data}),
        )
    return found


@pytest.mark.parametrize(
    ("figure", "suffix"), list(zip(FRAME_FIGURES, [*BYTES, ".png"], strict=True)), ids=FRAME_FIGURES
)
def test_every_figure_of_the_sample_is_drawn(series, computed, tmp_path, figure, suffix):
    path = tmp_path / f"figure{suffix}"
    plot_frames(path, series, SETTINGS, computed.rows, figure)
    assert path.read_bytes().startswith(BYTES[suffix])


def row_of(computed, frame):
    return next(r for r in computed.rows if (r["frame"], r["variant"]) == (frame, "c"))


def test_the_curve_of_cut_offs_goes_through_the_table(series, computed, caught, tmp_path):
    plot_frames(tmp_path / "x.png", series, SETTINGS, computed.rows, "cutoffs")
    for curve, frame in zip(caught["cutoffs"], (0, 6), strict=True):
        row = row_of(computed, frame)
        (place,) = np.flatnonzero(curve.cutoff == 1.0)
        assert curve.chosen == pytest.approx(1.0)
        near = 4 * np.hypot(curve.error[place], row["alpha_vs_axial_se"])
        assert abs(curve.alpha[place] - row["alpha_vs_axial"]) < near


@pytest.mark.filterwarnings(
    "ignore:frame .* above the tolerance:scanfab.base.errors.ScanfabWarning"
)
def test_figures_have_the_moment_of_the_table(series, caught, tmp_path):
    """The mean of the squares over the mean is far more anisotropic than the mean."""
    words = {"boundary": "mask=3", "tolerance": 5e-4, "moment": 2}
    found = {}
    for frame in (0, 6):
        (row,) = scanfab.compute(series, **words, variants="c", frames=str(frame))
        found[frame] = dict(row)
    settings = Settings(**words)
    plot_frames(tmp_path / "x.png", series, settings, list(found.values()), "cutoffs")
    for curve, row in zip(caught["cutoffs"], found.values(), strict=True):
        (place,) = np.flatnonzero(curve.cutoff == 1.0)
        near = 4 * np.hypot(curve.error[place], row["alpha_vs_axial_se"])
        assert abs(curve.alpha[place] - row["alpha_vs_axial"]) < near


def test_lengths_have_the_mean_of_the_table(series, computed, caught, tmp_path):
    plot_frames(tmp_path / "x.png", series, SETTINGS, computed.rows, "histogram")
    for sample, frame in zip(caught["histogram"], (0, 6), strict=True):
        row = row_of(computed, frame)
        kept = sample.length[sample.length >= sample.cutoff]
        assert len(sample.length) > 10_000
        assert kept.mean() == pytest.approx(row["mean_length"] / row["cutoff"], rel=0.03)


def test_the_projection_is_the_distribution(series, computed, caught, tmp_path):
    plot_frames(tmp_path / "x.png", series, SETTINGS, computed.rows, "projection")
    first, last = caught["projection"]
    # in the middle is z, along which the sample was compressed
    assert last.void[0, 0] > 4 > np.abs(first.void[0, 0])
    assert last.void[-1].max() < -1
    assert last.contact[0, 0] > 10
    # second harmonic of the fabric tensor: mean of (l/mean - 1)(3 z^2 - 1)/2 is alpha_vs_axial
    row = row_of(computed, 6)
    _, n = disk()
    weight = np.repeat(np.linspace(0, 1, n.shape[0])[:, None], n.shape[1] - 1, axis=1)
    value = 0.01 * last.void[:, :-1] * (1.5 * n[:, :-1, 2] ** 2 - 0.5)
    assert np.average(value, weights=weight) == pytest.approx(row["alpha_vs_axial"], rel=0.05)


def test_the_rose_is_longer_near_the_axis(series, computed, caught, tmp_path):
    plot_frames(tmp_path / "x.png", series, SETTINGS, computed.rows, "rose:20,90")
    first, last = caught["rose"]
    assert [ring.phi for ring in last.void] == [20, 90]
    steep, flat = last.void
    assert steep.value.min() > 1.0 > flat.value.max()
    assert len(flat.theta) == len(steep.theta) == 24
    assert flat.value[:12] == pytest.approx(flat.value[12:])
    assert 0 < steep.error.max() < 0.02
    assert np.abs(first.void[0].value - 1).max() < 0.05
    steep, flat = last.contact
    assert steep.value.mean() > 1.1
    assert flat.value.mean() < 0.9
    assert steep.curve(np.array([0.0])) > 1.1


def test_contact_rings_of_isotropic_normals_are_one():
    normals = np.random.default_rng(0).standard_normal((200_000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for phi in (30.0, 90.0):
        ring = frame_figures._contact_ring(normals, phi)
        assert np.all(np.abs(ring.value - 1) < 5 * ring.error)
        assert ring.value.mean() == pytest.approx(1, abs=0.02)
    _, directions = disk()
    assert frame_figures._smoothed_density(normals, directions[::10, ::10]) == pytest.approx(
        np.ones(directions[::10, ::10].shape[:2]), abs=0.02
    )


def test_the_disk_is_equal_area():
    places, directions = disk()
    assert np.linalg.norm(directions, axis=-1) == pytest.approx(np.ones(directions.shape[:2]))
    # the cap within polar angle p has the share 1 - cos p of the hemisphere, as of the disk
    rho = np.linalg.norm(places, axis=-1)
    assert rho**2 == pytest.approx(1 - directions[..., 2], abs=1e-12)


def test_titles_name_variant_frame_and_strain(series, computed, caught, tmp_path):
    for name in FRAME_FIGURES:
        plot_frames(tmp_path / "x.png", series, SETTINGS, computed.rows, name)
        titles = [one.title for one in caught[name]]
        strain = 100 * row_of(computed, 6)["strain"]
        assert titles == [
            r"variant c, frame 0, $\varepsilon_a$ = 0 %",
            rf"variant c, frame 6, $\varepsilon_a$ = {strain:.3g} %",
        ]


def test_without_a_strain_titles_name_the_frame(series, computed, caught, tmp_path):
    rows = [{**row, "strain": 0.0} for row in computed.rows]
    plot_frames(tmp_path / "x.png", series, SETTINGS, rows, "histogram")
    assert [one.title for one in caught["histogram"]] == [
        "variant c, frame 0",
        "variant c, frame 6",
    ]


def test_the_strain_of_a_title_is_that_of_the_table(series, computed, caught, tmp_path):
    """The file that it came from may have lost a frame since, or say something else."""
    strains = tmp_path / "strain.csv"
    strains.write_text("frame,strain\n0,0.5\n")
    settings = Settings(boundary="mask=3", tolerance=5e-4, strain=str(strains))
    rows = [{**row, "strain": 0.01 * row["frame"]} for row in computed.rows]
    plot_frames(tmp_path / "x.png", series, settings, rows, "histogram")
    assert [one.title for one in caught["histogram"]] == [
        r"variant c, frame 0, $\varepsilon_a$ = 0 %",
        r"variant c, frame 6, $\varepsilon_a$ = 6 %",
    ]


def test_cut_offs_have_the_total_error_and_the_scan_s_part(series, computed, caught, tmp_path):
    """At the cut-off of the table what it says there, to the last digit but for rounding."""
    plot_frames(tmp_path / "x.png", series, SETTINGS, computed.rows, "cutoffs")
    for curve, frame in zip(caught["cutoffs"], (0, 6), strict=True):
        row = row_of(computed, frame)
        (place,) = np.flatnonzero(curve.cutoff == 1.0)
        assert curve.alpha[place] == pytest.approx(row["alpha_vs_axial"], rel=1e-9)
        assert curve.error[place] == pytest.approx(row["alpha_vs_axial_se"], rel=1e-9)
        total = total_error(row, "alpha_vs_axial")
        assert curve.total[place] == pytest.approx(total, rel=1e-9)
    assert np.all(curve.total > curve.error)


def test_the_band_of_cut_offs_does_not_vanish_in_a_rough_scan(series, computed, caught, tmp_path):
    """Nor is it told that errors grow with the cut-off, which is what the figure shows."""
    settings = Settings(boundary="mask=3", tolerance=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error", scanfab.ScanfabWarning)
        plot_frames(tmp_path / "x.png", series, settings, computed.rows, "cutoffs")
    for curve in caught["cutoffs"]:
        assert np.all(curve.total > curve.error)


def test_the_cut_off_of_the_table_is_one_of_the_curve(series, computed, caught, tmp_path):
    settings = Settings(boundary="mask=3", tolerance=2e-3, cutoff="0.8rmin")
    plot_frames(tmp_path / "x.png", series, settings, computed.rows, "cutoffs")
    assert all(one.chosen in one.cutoff for one in caught["cutoffs"])


def test_a_cut_off_without_a_total_error_is_told(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(plot_frame, "save_figure", lambda figure, *_: drawn.append(figure))
    values = np.array([1.0, 2.0, 3.0])
    for total in (values, np.array([1.0, np.nan, 3.0])):
        one = plot_frame.CutoffCurve("one", values, values, values, total, 1.0)
        plot_frame.plot_cutoffs(tmp_path / "x.png", [one])
    notes = [figure.legends[0].get_title().get_text() for figure in drawn]
    assert ["(none where either is not known)" in note for note in notes] == [False, True]


def rose_of(monkeypatch, tmp_path, angles, error=0.1):
    """The figure of one frame whose rings are told apart by their angles alone."""
    drawn = []
    monkeypatch.setattr(plot_frame, "save_figure", lambda figure, *_: drawn.append(figure))
    theta = np.arange(0.0, 360.0, 30.0)
    rings = [
        plot_frame.Ring(phi, theta, np.full(12, 1.0 + 0.001 * phi), np.full(12, error))
        for phi in angles
    ]
    plot_frame.plot_rose(tmp_path / "x.png", [plot_frame.Rose("one", rings, rings)])
    return drawn[0]


def colours(figure):
    """Of the lines of each polar angle, and of its words in the legend."""
    lines = {
        round(1000 * (line.get_ydata()[0] - 1)): line.get_color()
        for line in figure.axes[0].lines
        if line.get_marker() not in ("None", "_")
    }
    legend = figure.legends[0]
    texts = [text.get_text() for text in legend.get_texts()]
    named = {
        float(text.split("=")[1].split("^")[0]): handle.get_color()
        for text, handle in zip(texts, legend.legend_handles, strict=True)
    }
    assert named == lines
    return lines


def test_a_polar_angle_has_one_colour_in_all_figures(monkeypatch, tmp_path):
    usual = colours(rose_of(monkeypatch, tmp_path, (90.0, 60.0, 30.0)))
    assert colours(rose_of(monkeypatch, tmp_path, (30.0, 60.0, 90.0))) == usual
    assert colours(rose_of(monkeypatch, tmp_path, (30.0,))) == {30: usual[30]}
    for angles in ((20.0, 30.0, 45.0, 90.0), (10.0, 20.0, 40.0, 50.0)):
        found = colours(rose_of(monkeypatch, tmp_path, angles))
        assert len(set(found.values())) == 4
        assert all(found[phi] == usual[phi] for phi in found if phi in usual)


@pytest.mark.parametrize("error", [0.01, 0.3, 1.5])
def test_no_bar_of_a_rose_is_cut_and_its_circles_are_in_the_legend(monkeypatch, tmp_path, error):
    figure = rose_of(monkeypatch, tmp_path, (90.0, 30.0), error)
    for axes in figure.axes:
        assert axes.get_ylim()[1] > 1.09 + error
        assert not any(label.get_text() for label in axes.get_yticklabels())
    low, ticks = figure.axes[0].get_ylim()[0], figure.axes[0].get_yticks()
    assert all(tick > low for tick in ticks)
    said = f"circles: {', '.join(f'{tick:g}' for tick in ticks)} about {low:.3g} (left)"
    assert said in figure.legends[0].get_title().get_text()


@pytest.mark.parametrize("name", ["rose", "projection"])
def test_panels_are_lettered(series, computed, tmp_path, monkeypatch, name):
    drawn = []
    monkeypatch.setattr(plot_frame, "save_figure", lambda figure, *_: drawn.append(figure))
    plot_frames(tmp_path / "x.png", series, SETTINGS, computed.rows, name)
    titles = [axes.get_title(loc="left") for axes in drawn[0].axes[:4]]
    assert [title[:3] for title in titles] == ["(a)", "(b)", "(c)", "(d)"]
    assert all("variant c, frame " in title for title in titles)


def test_one_frame_and_other_variants(series, computed, tmp_path, caught):
    rows = [row for row in computed.rows if row["frame"] == 3]
    settings = Settings(boundary="mask=3", tolerance=1e-3, variants="b")
    plot_frames(tmp_path / "x.png", series, settings, rows, "histogram")
    assert len(caught["histogram"]) == 1


def test_ticks_are_round():
    assert plot_frame._round_down(0.0731) == pytest.approx(0.05)
    assert plot_frame._round_down(0.72) == pytest.approx(0.5)
    assert plot_frame._round_down(0.1) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "text", ["pie", "rose:", "rose:0", "rose:91", "rose:x", "histogram:3", "rose:1,2,3,4,5"]
)
def test_figures_that_do_not_exist_are_an_error(text):
    with pytest.raises(SettingsError, match="figure: "):
        parse_figure(text)


def test_a_table_without_void_fabric_is_an_error(series, computed, tmp_path):
    rows = [{**row, "alpha_vs_axial": None} for row in computed.rows]
    with pytest.raises(SettingsError, match="no frame has a void fabric of variant c"):
        plot_frames(tmp_path / "x.png", series, SETTINGS, rows, "rose")
