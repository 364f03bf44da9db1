"""Mean lengths of void segments that are known in closed form."""

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, compute
from tests.helpers.lattices import Spheres, poisson_spheres, shaken_cubic
from tests.helpers.scanning import Z, fabric, mean_lengths, ratio, scan_along, solids_of

AXES = np.array([[0, 0, 1], [1, 0, 0], [0.6, 0, 0.8], [-0.48, 0.6, 0.64]])


def touching_pair(distance=2.0, radius=1.0):
    return Spheres(np.array([[0.0, 0, 0], [0, 0, distance]]), np.full(2, radius))


@pytest.mark.parametrize("thinner", [1e-15, 1e-12])
def test_between_surfaces_that_coincide_there_is_no_segment(thinner):
    """A sphere that fills its window but for rounding: at c = 0 lines keep nothing of it."""
    solids = solids_of(Spheres(np.zeros((1, 3)), np.array([1.0 - thinner])), 1.0)
    assert scan_along(solids, AXES, 0.02, 0.0).kept("c")[1].sum() < 4
    half = Spheres(np.zeros((1, 3)), np.array([1.0 - 1e-6]))
    assert scan_along(solids_of(half, 1.0), AXES, 0.02, 0.0).kept("c")[1].sum() > 1000


class Lens:
    """The common part of the unit spheres at 0 and (0, 0, 1.2)."""

    distance = 1.2
    spheres = touching_pair(distance, 1.0).moved([0, 0, -0.6])
    height = 1.0 - distance / 2
    volume = 2 * np.pi * height**2 * (3 - height) / 3
    # seen along the axis a disc, from the side what two discs share, in the mean a quarter
    # of the surface (Cauchy)
    along = np.pi * (1 - 0.6**2)
    across = 2 * np.arccos(0.6) - 2 * 0.6 * np.sqrt(1 - 0.6**2)
    mean = 2 * (2 * np.pi * height) / 4

    @classmethod
    def mean_length(cls, shadow, window=2.0):
        void = 4 / 3 * np.pi * (window**3 - 2) + cls.volume
        return void / (np.pi * (window**2 + 2) - shadow)


@pytest.mark.parametrize(
    ("axis", "shadow"), [((0, 0, 1), Lens.along), ((1, 0, 0), Lens.across), ((0.6, 0.8, 0), None)]
)
def test_two_overlapping_spheres(axis, shadow):
    """V_void/(πR² + 2πr² - A(n)), A the projected area of the common lens."""
    sums = scan_along(solids_of(Lens.spheres, 2.0), [axis], 0.03, replicates=32)
    expected = Lens.mean_length(Lens.across if shadow is None else shadow)
    assert mean_lengths(sums, "c").agrees(expected)


def test_two_overlapping_spheres_in_all_directions():
    """The mean length over all directions holds the lens' mean shadow; α_axial is positive."""
    result = fabric(
        solids_of(Lens.spheres, 2.0), "lebedev:17", spacing=0.05, cutoff=0.0, replicates=range(32)
    )
    assert result.mean_length == pytest.approx(Lens.mean_length(Lens.mean), rel=3e-4)
    # A is the larger along the axis, and so is ℓ
    assert result.tensor.axial((0, 0, 1)) > 10 * result.axial_error((0, 0, 1))


@pytest.mark.parametrize(
    ("distance", "cutoff"), [(2.0, 0.0), (2.0, 1.0), (2.0, 1.9), (3.0, 0.0), (3.0, 1.5), (2.6, 2.0)]
)
def test_two_equal_spheres_whole_along_their_axis(distance, cutoff):
    """ℓ = d - 4h/3, h = min(r, (d - c)/2)."""
    sums = scan_along(solids_of(touching_pair(distance)), Z, 0.01, cutoff, 32, variants="a")
    h = min(1.0, (distance - cutoff) / 2)
    # the few lines between touching spheres that a long cut-off leaves
    assert mean_lengths(sums, "a").agrees(distance - 4 * h / 3)


def test_rattlers_between_the_first_and_the_last_solid_are_void():
    """In b the removed grain at the end is no solid either: only the gap in the middle is left."""
    row = Spheres(np.array([[0.0, 0, 3.0 * k] for k in range(4)]), np.ones(4))
    removed = np.array([False, True, False, True])
    sums = scan_along(solids_of(row, removed=removed), Z, 0.02, replicates=32, variants="ab")
    assert mean_lengths(sums, "a").agrees(3 - 4 / 3)
    assert mean_lengths(sums, "b").agrees(6 - 4 / 3)
    assert np.all(sums.kept("a")[1] == 3 * sums.kept("b")[1])


@pytest.mark.parametrize("cutoff", [0.0, 1.5])
def test_poisson_spheres_in_a_clipped_window(cutoff):
    """ℓ = c + A1/(A0 + βA1): union, clipping and cut-off at once."""
    window, density = 8.0, 0.08
    beta = density * np.pi * 13 / 12  # <r²> of radii uniform in [0.5, 1.5]
    a0 = 1 - cutoff**2 / (4 * window**2)
    a1 = 4 * window / 3 - cutoff + cutoff**3 / (12 * window**2)
    length, segments = [], []
    for seed in range(1500):
        spheres = poisson_spheres(np.random.default_rng([seed, 7]), density, window)
        sums = scan_along(solids_of(spheres, window), AXES, 0.8, cutoff, replicates=1, seed=seed)
        length.append(sums.kept("c")[0].sum())
        segments.append(sums.kept("c")[1].sum())
    estimate = ratio(np.array(length), np.array(segments))
    assert estimate.error < 2e-3 * estimate.value
    assert estimate.agrees(cutoff + a1 / (a0 + beta * a1), within=2e-3)


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
    times = f"{10 / packing.radius.min():.4g} times the smallest radius"
    told = f"variant c: no void segment reaches the cut-off 10, {times}"
    with pytest.warns(ScanfabWarning, match=told):
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
