"""All directions on a disk: the picture is that of the distribution in the table."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from scanfab.base.errors import SettingsError
from scanfab.pipeline.settings import Settings
from scanfab.viz.figures.hemisphere import disk
from scanfab.viz.scanned_frames import ScannedFrames
from tests.helpers.figures import frame_figure, row_of

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")
SETTINGS = Settings(boundary="mask=3", tolerance=5e-4)


def test_the_projection_is_the_distribution(series, computed):
    figure = frame_figure(series, SETTINGS, computed.rows, "projection")
    first, last = figure.hemispheres
    # in the middle is z, along which the sample was compressed
    assert last.voids[0, 0] > 4 > np.abs(first.voids[0, 0])
    assert last.voids[-1].max() < -1
    assert last.contacts[0, 0] > 10
    # second harmonic of the fabric tensor: mean of (l/mean - 1)(3 z^2 - 1)/2 is alpha_vs_axial
    row = row_of(computed, 6)
    _, n = disk()
    weight = np.repeat(np.linspace(0, 1, n.shape[0])[:, None], n.shape[1] - 1, axis=1)
    value = 0.01 * last.voids[:, :-1] * (1.5 * n[:, :-1, 2] ** 2 - 0.5)
    assert np.average(value, weights=weight) == pytest.approx(row["alpha_vs_axial"], rel=0.05)


def test_one_disk_is_drawn_on_the_axes_that_it_gets(series, computed):
    plot = ScannedFrames(series, SETTINGS, computed.rows).plot
    page = Figure()
    ax = page.subplots()
    assert plot.projection(ax=ax, of="contacts") is ax
    assert ax.get_title().startswith("contact normals\nvariant c, frame 6")
    # beside it the scale
    assert page.axes[1].get_ylabel() == "deviation from the mean in %"
    with pytest.raises(SettingsError, match="of: expected voids or contacts, found 'void'"):
        plot.projection(ax=ax, of="void")
