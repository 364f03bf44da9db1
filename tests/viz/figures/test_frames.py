"""Figures of scanned frames: which frames, and that what is drawn is what table and scan say."""

import warnings

import numpy as np
import pytest
from matplotlib.figure import Figure

import scanfab
from scanfab.base.errors import SettingsError
from scanfab.base.space import SPACE
from scanfab.fabric.distribution import direction_points, fit_even
from scanfab.fabric.tensor import axial_error
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.settings import Settings
from scanfab.table.row import column_of, total_errors
from scanfab.viz.figures import projection
from scanfab.viz.figures.figure import drawn_page, make_figures
from scanfab.viz.figures.rose import contact_ring
from scanfab.viz.scanned_frames import ScannedFrames
from tests.conftest import ROOT, SAMPLE
from tests.helpers.dumps import write
from tests.helpers.figures import row_of
from tests.helpers.lattices import unit_vectors

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")
WORDS = {"boundary": "mask=3", "tolerance": 5e-4}
ROUGH = {"boundary": "mask=3", "tolerance": 1e-2}
DENSITY = projection.places_of(SPACE)[1][::8, ::12]


@pytest.fixture(scope="module")
def scanned(computed):
    """The first and the last frame, scanned once for all tests."""
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        warnings.simplefilter("ignore", scanfab.ScanfabNote)
        patch.chdir(ROOT)
        frames = ScannedFrames(scanfab.read_series(SAMPLE), Settings(**WORDS), computed.rows)
        assert len(frames.frames) == 2
        yield frames


def figure_of(frames, name):
    (figure,) = make_figures(frames, "frames", name)
    return figure


@pytest.fixture(scope="module")
def figures(scanned):
    """All of them by name, which find what they draw once."""
    return {type(one).__name__: one for one in make_figures(scanned, "frames")}


def points_of(axes):
    return [line for line in axes.lines if line.get_marker() not in ("None", "_")]


def test_every_figure_of_the_sample_is_drawn(scanned, figures):
    for name, figure in figures.items():
        assert scanned.name in figure.caption
        assert figure.caption.endswith(".")
        with drawn_page([figure]) as page:
            titles = [axes.get_title(loc="left") for axes in page.axes[:4]]
        if name in ("Rose", "Projection"):
            assert [title[:3] for title in titles] == ["(a)", "(b)", "(c)", "(d)"]
            assert all("variant c, frame " in title for title in titles)
        else:
            assert titles == [""]


def test_frames_are_scanned_once_for_all_figures_and_when_one_needs_them(
    series, computed, monkeypatch
):
    """Both in one pass, so that the frame that fixes all lengths is not read for each of them."""
    asked = []

    def remember(source, settings, **more):
        asked.append(settings.frames)
        return compute_rows(source, settings, **more)

    monkeypatch.setattr("scanfab.viz.scanned_frames.compute_rows", remember)
    frames = ScannedFrames(series, Settings(**ROUGH), computed.rows)
    assert repr(frames) == f"ScannedFrames(variant c of {SAMPLE}, frames 0 and 6)"
    assert not asked
    frames.plot.histogram(Figure())
    frames.plot.projection(Figure())
    assert asked == [slice(0, 7, 6)]


def test_the_strain_of_a_title_is_that_of_the_table(series, computed, tmp_path):
    """The file that it came from may have lost a frame since."""
    strains = write(tmp_path / "strain.csv", "frame,strain\n0,0.5\n")
    rows = [{**row, "strain": 0.01 * row["frame"]} for row in computed.rows]
    frames = ScannedFrames(series, Settings(**ROUGH, strain=str(strains)), rows).frames
    titles = [rf"variant c, frame {k}, $\varepsilon_a$ = {k} %" for k in (0, 6)]
    assert [one.title for one in frames] == titles


def test_a_notebook_scans_frames_by_the_options_of_compute(series, computed):
    """With the table its frames and strains; without one the first and the last frame."""
    table = scanfab.load(computed.table)
    other = [{**row, "source": "other", "frame": 99} for row in computed.rows]
    for more in ({"table": table}, {}, {"table": [*other, *computed.rows]}):
        frames = scanfab.scan_frames(series, **more, **ROUGH)
        assert repr(frames) == f"ScannedFrames(variant c of {SAMPLE}, frames 0 and 6)"
    middle = scanfab.scan_frames(series, **ROUGH, frames="2:4", variants="b")
    assert repr(middle) == f"ScannedFrames(variant b of {SAMPLE}, frames 2 and 3)"
    (frame,) = scanfab.scan_frames(series, **ROUGH, frames=6).frames
    assert frame.title.startswith(r"variant c, frame 6, $\varepsilon_a$ = 15")
    with pytest.raises(TypeError, match="Settings has no option 'tolerence': did you mean"):
        scanfab.scan_frames(series, tolerence=1e-3)
    rows = [{**row, "alpha_vs_axial": None} for row in computed.rows]
    with pytest.raises(SettingsError, match="no frame has a void fabric of variant c"):
        ScannedFrames(series, Settings(**ROUGH), rows)


def test_all_panels_are_drawn_on_the_figure_that_they_get(scanned):
    page = Figure(figsize=(12, 6))
    left, right = page.subfigures(1, 2)
    assert scanned.plot.projection(left) is left
    assert scanned.plot.rose(right, angles=(90,)) is right
    # four disks, the scales of both columns, and four roses
    assert len(page.axes) == 10
    alone = Figure()
    scanned.plot.projection(alone, frame=6, of="voids")
    assert [axes.get_title(loc="left")[:16] for axes in alone.axes] == ["mean void length", ""]


def test_one_panel_is_drawn_on_the_axes_that_it_gets(scanned):
    """The last frame, or the one that is asked for; a rose on polar Axes only."""
    plot, polar = scanned.plot, {"subplot_kw": {"projection": "polar"}}
    ax = Figure().subplots(**polar)
    assert plot.rose(ax=ax, angles=(90,), of="contacts", frame=0) is ax
    assert ax.get_title().startswith("contact normals\nvariant c, frame 0")
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == [r"polar angle $\varphi=90^\circ$"]
    page = Figure()
    assert plot.projection(ax=page.subplots(), of="contacts") is page.axes[0]
    assert page.axes[0].get_title().startswith("contact normals\nvariant c, frame 6")
    # beside it the scale
    assert page.axes[1].get_ylabel() == "deviation from the mean in %"
    for error, message, words in (
        (SettingsError, r"angles: expected one to four .*found \(95,\)", {"angles": (95,)}),
        (SettingsError, "frame: expected 0 and 6, found 3", {"frame": 3}),
        (SettingsError, "of: expected voids or contacts, found 'void'", {"of": "void"}),
        (TypeError, "the figure rose has no option 'angel': did you mean", {"angel": (90,)}),
    ):
        with pytest.raises(error, match=message):
            plot.rose(ax=ax, **words)
    with pytest.raises(SettingsError, match="ax: expected polar Axes, found rectilinear: make"):
        plot.rose(ax=Figure().subplots())


def test_the_rose_is_longer_near_the_axis_and_its_legend_tells_its_circles(scanned):
    """The values of the rings are read off the page."""
    angles = (20, 90)
    with drawn_page([figure_of(scanned, "rose:20,90")]) as page:
        ends = points_of(page.axes[2])
        steep, flat = (line.get_ydata() for line in ends)
        assert steep.min() > 1.0 > flat.max()
        assert len(flat) == len(steep) == 25
        assert flat[:12] == pytest.approx(flat[12:24])
        assert np.abs(points_of(page.axes[0])[0].get_ydata() - 1).max() < 0.05
        steep, flat = (line.get_ydata() for line in points_of(page.axes[3]))
        assert steep.mean() > 1.1
        assert flat.mean() < 0.9
        legend = page.legends[0]
        named = [handle.get_color() for handle in legend.legend_handles]
        assert named == [line.get_color() for line in ends]
        texts = [text.get_text() for text in legend.get_texts()]
        assert texts == [rf"polar angle $\varphi={phi}^\circ$" for phi in angles]
        for axes, side in zip(page.axes[2:], ("left", "right"), strict=True):
            assert not any(label.get_text() for label in axes.get_yticklabels())
            (low, high), ticks = axes.get_ylim(), axes.get_yticks()
            assert all(low < tick < high for tick in ticks)
            said = f"{', '.join(f'{tick:g}' for tick in ticks)} about {low:.3g} ({side})"
            assert said in legend.get_title().get_text()
            # no value is cut, nor its bar
            bars = [end for one in axes.collections for end in one.get_segments()]
            assert max(end[:, 1].max() for end in bars) < high


def test_a_polar_angle_has_one_colour_in_all_figures(scanned):
    def colours(*angles):
        looks = figure_of(scanned, f"rose:{','.join(map(str, angles))}").looks
        return {phi: look["color"] for phi, look in looks.items()}

    usual = colours(90, 60, 30)
    assert colours(30, 60, 90) == usual
    assert colours(30) == {30: usual[30]}
    for angles in ((20, 30, 45, 90), (10, 20, 40, 50)):
        found = colours(*angles)
        assert len(set(found.values())) == 4
        assert all(found[phi] == usual[phi] for phi in found if phi in usual)


def test_rings_and_density_of_isotropic_normals_are_one():
    normals = unit_vectors(np.random.default_rng(0), 200_000)
    for phi in (30.0, 90.0):
        ring = contact_ring(normals, phi)
        assert np.all(np.abs(ring.value - 1) < 5 * ring.error)
        assert ring.value.mean() == pytest.approx(1, abs=0.02)
        assert ring.curve == pytest.approx(1, abs=0.02)
    assert projection.smoothed_density(normals, DENSITY) == pytest.approx(1, abs=0.02)


def test_the_disk_is_equal_area():
    places, directions = projection.places_of(SPACE)
    assert np.linalg.norm(directions, axis=-1) == pytest.approx(1)
    # the cap within polar angle p has the share 1 - cos p of the hemisphere, as of the disk
    rho = np.linalg.norm(places, axis=-1)
    assert rho**2 == pytest.approx(1 - directions[..., 2], abs=1e-12)


def test_the_projection_is_the_distribution(figures, computed):
    first, last = figures["Projection"].deviations
    voids = last["voids"]
    # in the middle is z, along which the sample was compressed
    assert voids[0, 0] > 4 > np.abs(first["voids"][0, 0])
    assert voids[-1].max() < -1
    assert last["contacts"][0, 0] > 10
    # second harmonic of the fabric tensor: mean of (l/mean - 1)(3 z^2 - 1)/2 is alpha_vs_axial
    _, n = projection.places_of(SPACE)
    weight = np.repeat(np.linspace(0, 1, n.shape[0])[:, None], n.shape[1] - 1, axis=1)
    value = np.average(0.01 * voids[:, :-1] * (1.5 * n[:, :-1, 2] ** 2 - 0.5), weights=weight)
    assert value == pytest.approx(row_of(computed, 6)["alpha_vs_axial"], rel=0.05)


def test_the_noise_of_the_scan_is_that_of_fits_to_noise():
    """Mean lengths that differ from line to line alone, fitted as those of a scan are."""
    rng = np.random.default_rng(1)
    points, weights = direction_points()
    second = 1.5 * points[:, 2] ** 2 - 0.5
    alphas, deviations = [], []
    for _ in range(25):
        axes = unit_vectors(rng, 150)
        fitted = fit_even(axes, 1 + 0.1 * rng.standard_normal(150), np.ones(150))
        deviation = fitted(points) / (weights @ fitted(points)) - 1
        alphas.append(weights @ (deviation * second))
        deviations.append(deviation)
    row = {"alpha_vs_axial_se": float(np.std(alphas)), "alpha_vs_axial_sample_se": 0.0}
    assert projection.void_noise(row) == pytest.approx(100 * np.std(deviations), rel=0.25)


def test_the_noise_of_contacts_is_that_of_isotropic_ones():
    rng = np.random.default_rng(2)
    deviations = [
        projection.smoothed_density(unit_vectors(rng, 500), DENSITY) - 1 for _ in range(40)
    ]
    alone = axial_error(unit_vectors(rng, 500), (0, 0, 1))
    row = {"contacts": 500, "alpha_c_axial_se": alone}
    noise = projection.contact_noise({**row, "alpha_c_axial_sample_se": alone})
    assert noise == pytest.approx(100 * np.std(deviations), rel=0.1)
    # as neighbours are not independent, less of it is chance
    half = projection.contact_noise({**row, "alpha_c_axial_sample_se": 0.5 * alone})
    assert half == pytest.approx(0.5 * noise)


def test_lengths_have_the_mean_of_the_table(figures, computed):
    """The cut-off is one smallest radius, the unit of the lengths."""
    for length, frame in zip(figures["Histogram"].lengths, (0, 6), strict=True):
        row = row_of(computed, frame)
        assert len(length) > 10_000
        mean = length[length >= 1.0].mean()
        assert mean == pytest.approx(row["mean_length"] / row["cutoff"], rel=0.03)


def assert_bands_are_wider_than_bars(rows):
    total = total_errors(rows, "alpha_vs_axial")
    assert np.all(total > column_of(rows, "alpha_vs_axial_se"))


def test_cut_offs_have_the_values_and_errors_of_the_table(figures, computed):
    """At the cut-off of the table what it says there, to the last digit but for rounding."""
    figure = figures["Cutoffs"]
    ax = figure.on(Figure().subplots())
    for curve, line, frame in zip(figure.curves, points_of(ax), (0, 6), strict=True):
        row = row_of(computed, frame)
        (place,) = np.flatnonzero(column_of(curve, "value") == 1.0)
        for name in ("alpha_vs_axial", "alpha_vs_axial_se", "alpha_vs_axial_sample_se"):
            assert curve[place][name] == pytest.approx(row[name], rel=1e-9)
        assert line.get_ydata()[place] == pytest.approx(1e3 * row["alpha_vs_axial"])
        assert_bands_are_wider_than_bars(curve)
    assert "bands: standard error of scan and sample" in ax.get_legend().get_title().get_text()


def test_a_rough_scan_of_squares_has_their_fabric_at_its_own_cut_off_and_tells_nothing(series):
    """Nor is it told that errors grow with the cut-off, which is what the figure shows."""
    words = {**ROUGH, "moment": 2, "cutoff": "0.8rmin", "variants": "c"}
    (row,) = scanfab.compute(series, **words, frames="6")
    with warnings.catch_warnings():
        warnings.simplefilter("error", scanfab.ScanfabWarning)
        figure = figure_of(ScannedFrames(series, Settings(**words), [dict(row)]), "cutoffs")
        (curve,) = figure.curves
    assert_bands_are_wider_than_bars(curve)
    (found,) = (one for one in curve if one["value"] == figure.frames[0].cutoff)
    for name in ("alpha_vs_axial", "alpha_vs_axial_se"):
        assert found[name] == pytest.approx(row[name], rel=1e-9)
