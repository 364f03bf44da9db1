"""Roses: what is drawn is what the scan says, and legends say what is drawn."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from scanfab.base.errors import SettingsError
from scanfab.pipeline.settings import Settings
from scanfab.viz.figures.page import drawn_page, find_figure
from scanfab.viz.figures.rings import Ring, Rings
from scanfab.viz.figures.rose import Rose
from scanfab.viz.figures.style import rounded_down
from scanfab.viz.scanned_frames import ScannedFrames
from tests.helpers.figures import frame_figure

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")
SETTINGS = Settings(boundary="mask=3", tolerance=5e-4)


def test_the_rose_is_longer_near_the_axis(series, computed):
    figure = frame_figure(series, SETTINGS, computed.rows, "rose:20,90")
    first, last = figure.rings
    assert [ring.phi for ring in last.voids] == [20, 90]
    steep, flat = last.voids
    assert steep.value.min() > 1.0 > flat.value.max()
    assert len(flat.theta) == len(steep.theta) == 24
    assert flat.value[:12] == pytest.approx(flat.value[12:])
    assert 0 < steep.error.max() < 0.02
    assert np.abs(first.voids[0].value - 1).max() < 0.05
    steep, flat = last.contacts
    assert steep.value.mean() > 1.1
    assert flat.value.mean() < 0.9
    assert steep.curve(np.array([0.0])) > 1.1


@pytest.fixture
def rose_of():
    """Draws one frame whose rings are told apart by their angles alone."""
    pages = []

    def draw(angles, error=0.1):
        theta = np.arange(0.0, 360.0, 30.0)
        rings = [
            Ring(phi, theta, np.full(12, 1.0 + 0.001 * phi), np.full(12, error)) for phi in angles
        ]
        figure = Rose(None, angles)
        figure.rings = [Rings("one", rings, rings)]
        pages.append(drawn_page([figure]))
        return pages[-1].__enter__()

    yield draw
    for page in reversed(pages):
        page.__exit__(None, None, None)


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


def test_a_polar_angle_has_one_colour_in_all_figures(rose_of):
    usual = colours(rose_of((90.0, 60.0, 30.0)))
    assert colours(rose_of((30.0, 60.0, 90.0))) == usual
    assert colours(rose_of((30.0,))) == {30: usual[30]}
    for angles in ((20.0, 30.0, 45.0, 90.0), (10.0, 20.0, 40.0, 50.0)):
        found = colours(rose_of(angles))
        assert len(set(found.values())) == 4
        assert all(found[phi] == usual[phi] for phi in found if phi in usual)


@pytest.mark.parametrize("error", [0.01, 0.3, 1.5])
def test_no_bar_of_a_rose_is_cut_and_its_circles_are_in_the_legend(rose_of, error):
    figure = rose_of((90.0, 30.0), error)
    for axes in figure.axes:
        assert axes.get_ylim()[1] > 1.09 + error
        assert not any(label.get_text() for label in axes.get_yticklabels())
    low, ticks = figure.axes[0].get_ylim()[0], figure.axes[0].get_yticks()
    assert all(tick > low for tick in ticks)
    said = f"circles: {', '.join(f'{tick:g}' for tick in ticks)} about {low:.3g} (left)"
    assert said in figure.legends[0].get_title().get_text()


def test_ticks_are_round():
    assert rounded_down(0.0731) == pytest.approx(0.05)
    assert rounded_down(0.72) == pytest.approx(0.5)
    assert rounded_down(0.1) == pytest.approx(0.1)


@pytest.mark.parametrize("text", ["rose:", "rose:0", "rose:91", "rose:x", "rose:1,2,3,4,5"])
def test_angles_that_cannot_be_are_an_error(text):
    with pytest.raises(SettingsError, match=f"figure: expected one to four .*'{text}'"):
        find_figure(text, "frames")


def test_one_panel_is_drawn_on_the_axes_that_it_gets(series, computed):
    """The last frame, or the one that is asked for; on polar Axes only."""
    plot = ScannedFrames(series, SETTINGS, computed.rows).plot
    ax = Figure().subplots(subplot_kw={"projection": "polar"})
    assert plot.rose(ax=ax, angles=(90,), of="contacts", frame=0) is ax
    assert ax.get_title().startswith("contact normals\nvariant c, frame 0")
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        r"polar angle $\varphi=90^\circ$"
    ]
    with pytest.raises(SettingsError, match="ax: expected polar Axes, found rectilinear: make"):
        plot.rose(ax=Figure().subplots())
    with pytest.raises(SettingsError, match=r"angles: expected one to four .*found \(95,\)"):
        plot.rose(ax=ax, angles=(95,))
    with pytest.raises(SettingsError, match="frame: expected 0 and 6, found 3"):
        plot.rose(ax=ax, frame=3)
    with pytest.raises(TypeError, match="the figure rose has no option 'angel': did you mean"):
        plot.rose(ax=ax, angel=(90,))
