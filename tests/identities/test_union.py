"""Grains that the window cuts, and cut-offs that leave nothing."""

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, compute
from tests.helpers.lattices import Spheres, shaken_cubic
from tests.helpers.scanning import scan_along, solids_of


def test_grains_cut_by_the_window_are_solid_inside_it():
    """Half a sphere in the window: void and lines give its volume."""
    grain = Spheres(np.array([[0.0, 0, 2.0]]), np.array([1.0]))
    sums = scan_along(solids_of(grain, 2.0), [[1, 0, 0], [0, 0.6, 0.8]], 0.02, replicates=32)
    fraction = 1 - sums.void[:, 2] / sums.line_length[:, 2]
    # two spherical caps over the circle in which the surfaces meet, at z = 7/4
    caps = np.pi * (0.25**2 * (3 * 2 - 0.25) + 0.75**2 * (3 * 1 - 0.75)) / 3
    assert fraction.mean(axis=0) == pytest.approx(caps / (4 / 3 * np.pi * 8), rel=1e-3)


def test_cutoff_larger_than_the_window_gives_no_fabric_and_says_so():
    packing = Packing(*shaken_cubic(np.random.default_rng(0), 5))
    with pytest.warns(ScanfabWarning, match=r"variant c: no void segment reaches the cut-off 10\b"):
        row = compute(packing, variants="c", cutoff=10.0, spacing=0.3, directions="lebedev:5")[0]
    assert row.segments == 0
    assert row.lines > 0
    void = ("mean_length", "gvs_xx", "gvs_yz", "alpha_vs", "alpha_vs_axial", "alpha_vs_axial_se")
    assert [getattr(row, name) for name in void] == [None] * len(void)
    assert 0.3 < row.solid_fraction < 0.7
    assert row.alpha_c is not None


def test_cutoff_that_ends_an_auto_scan():
    """It does not go on for ever, and warns of what was found in no replicate."""
    packing = Packing(*shaken_cubic(np.random.default_rng(0), 5))
    with pytest.warns(ScanfabWarning) as caught:
        rows = compute(packing, cutoff=10.0, tolerance=0.01)
    assert [row.segments for row in rows] == [0] * 4
    told = [w for w in caught if "no void segment reaches the cut-off 10" in str(w.message)]
    assert [str(w.message).split(":")[0] for w in told] == ["frame 0, variants a, b, c, d"]
