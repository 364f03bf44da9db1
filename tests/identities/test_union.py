"""Solids are a union: what lies inside a solid changes nothing, and a cut-off may leave nothing."""

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, compute
from tests.helpers.lattices import Spheres, separate_spheres, shaken_cubic
from tests.helpers.scanning import Z, scan_along, solids_of


def joined(*parts):
    return Spheres(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def same_sums(one, other):
    """The same gaps; the order in which they are added up may differ."""
    assert np.array_equal(one.segments, other.segments)
    assert np.array_equal(one.lines, other.lines)
    assert one.length == pytest.approx(other.length, rel=1e-12)


def test_grain_inside_another_changes_nothing():
    grains = separate_spheres(np.random.default_rng(0), 20, 5.0)
    inside = Spheres(grains.position + 0.1, grains.radius * 0.5)
    axes = [[0, 0, 1], [0.6, 0, 0.8]]
    plain = scan_along(solids_of(grains, 4.0), axes, 0.1, 0.3)
    same_sums(scan_along(solids_of(joined(grains, inside), 4.0), axes, 0.1, 0.3), plain)
    same_sums(scan_along(solids_of(joined(grains, grains), 4.0), axes, 0.1, 0.3), plain)


def test_chain_of_three_that_overlap_leaves_no_gap():
    """Along their axis, in any order of the middle one, large or small."""
    for middle in (0.8, 2.0):
        chain = Spheres(np.array([[0.0, 0, 0], [0, 0, 1.3], [0, 0, 2.6]]), np.array([1, middle, 1]))
        sums = scan_along(solids_of(chain), Z, 0.02)
        # beside a small middle grain the outer ones see one another
        assert (sums.kept("a")[1].sum() > 0) == (middle < 1)
        assert np.all(sums.kept("a")[0] <= (2.6 - 2 * np.sqrt(1 - 0.8**2)) * sums.kept("a")[1])


def test_grain_that_covers_the_window_leaves_no_void():
    grains = separate_spheres(np.random.default_rng(0), 20, 5.0)
    cover = Spheres(np.array([[0.3, 0, 0]]), np.array([4.4]))
    sums = scan_along(solids_of(joined(grains, cover), 4.0), Z, 0.1)
    assert sums.void[:, 2].sum() == pytest.approx(0, abs=1e-9)
    assert sums.line_length[:, 2].sum() > 0
    assert sums.kept("c")[1].sum() == 0


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
    # an auto scan does not go on for ever
    with pytest.warns(ScanfabWarning) as caught:
        rows = compute(packing, cutoff=10.0, tolerance=0.01)
    assert [row.segments for row in rows] == [0] * 4
    told = [w for w in caught if "no void segment reaches the cut-off 10" in str(w.message)]
    assert [str(w.message).split(":")[0] for w in told] == ["frame 0, variants a, b, c, d"]
