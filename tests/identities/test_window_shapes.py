"""Windows of every shape: mean lengths that are known in closed form, direction by direction."""

import numpy as np
import pytest

from scanfab import box, cylinder, direction_rule, ellipsoid, sphere
from scanfab.fabric.predicted import window_alpha
from scanfab.fabric.void import void_fabric
from scanfab.scan.scan import scan_lines
from tests.helpers.lattices import Spheres, ball_points, poisson_spheres, rotation, separate_spheres
from tests.helpers.scanning import mean_lengths, scan_along, solids_of
from tests.helpers.windows import hull_of

NOTHING = Spheres(np.zeros((0, 3)), np.zeros(0))
RANDOM = np.random.default_rng(11)
TURN = rotation(RANDOM)
# along the edges and oblique to them
AXES = np.array([[0, 0, 1], [1, 0, 0], [0.6, 0, 0.8], [-0.48, 0.6, 0.64]])
OBLIQUE = np.array([1.0, 2.0, -2.0]) / 3.0
SHAPES = {
    "sphere": sphere(1.0),
    "box": box([1.6, 2.0, 2.4]),
    "turned box": box([1.6, 2.0, 2.4], TURN),
    "cylinder along x": cylinder(0.9, 2.2, [1, 0, 0]),
    "cylinder along z": cylinder(0.9, 2.2),
    "oblique cylinder": cylinder(0.9, 2.2, OBLIQUE),
    "ellipsoid": ellipsoid([0.8, 1.0, 1.3]),
    "turned ellipsoid": ellipsoid([0.8, 1.0, 1.3], TURN),
    "polyhedron": hull_of(ball_points(np.random.default_rng(8), 14, 1.5))[0],
    "leaning box": box([1.6, 2.0, 2.4]).deformed(np.eye(3) + 0.3 * TURN),
    "leaning cylinder": cylinder(0.9, 2.2).deformed(np.eye(3) + 0.3 * TURN),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("cutoff", [0.0, 0.6])
def test_empty_window(name, cutoff):
    """ℓ(n) = V / A(n); with a cut-off c + A₁ / A₀."""
    shape = SHAPES[name]
    # many grids: whole rows of lines along an edge come and go with the shift
    sums = scan_along(solids_of(NOTHING, shape), AXES, 0.06, cutoff, replicates=600)
    found = mean_lengths(sums, "c")
    shared, slope = shape.overlap(AXES, cutoff)
    # some lines are all equally long, but for rounding; the covariogram of hulls is a sum
    within = 5e-3 if name == "polyhedron" and cutoff else 1e-9
    assert np.all(np.abs(found.value - cutoff - shared / slope) < 4 * found.error + within)
    assert np.all(found.error < 1e-3 * found.value)


@pytest.mark.parametrize("name", SHAPES)
def test_spheres_without_overlap_wholly_inside(name):
    """ℓ(n) = (V - Σv) / (A(n) + Σπr²), whatever the arrangement."""
    shape = SHAPES[name]
    large = shape.deformed(10.0 * np.eye(3))
    spheres = separate_spheres(np.random.default_rng(2), 40, 7.5)
    # those that the surface does not cut
    axes = direction_rule("fibonacci:200").axes
    whole = np.ones(len(spheres.radius), bool)
    for axis in np.concatenate([axes, -axes]):
        whole &= large.contains(spheres.position + 1.001 * spheres.radius[:, None] * axis)
    spheres = Spheres(spheres.position[whole], spheres.radius[whole])
    assert len(spheres.radius) > 10
    found = mean_lengths(scan_along(solids_of(spheres, large), AXES, 0.2, replicates=256), "c")
    void = large.volume - 4 / 3 * np.pi * np.sum(spheres.radius**3)
    expected = void / (large.overlap(AXES, 0.0)[1] + np.pi * np.sum(spheres.radius**2))
    assert np.all(np.abs(found.value - expected) < 4 * found.error)
    assert np.all(found.error < 1e-3 * expected)


@pytest.mark.parametrize(
    ("shape", "alpha"),
    [
        (box([1.0, 1.0, 2.0]), 0.06433),
        (box([1.0, 1.0, 0.8]), -0.02189),
        (ellipsoid([1.0, 1.0, 2.0]), 0.08650),
        (ellipsoid([1.0, 1.0, 0.8]), -0.02997),
        (cylinder(1.0, 2.0), 0.00122),
        (cylinder(1.0, 1.5), -0.02711),
        (box([1.0, 1.0, 1.0]), 0.0),
        (sphere(1.0), 0.0),
    ],
)
def test_anisotropy_of_an_empty_window(shape, alpha):
    """In the limit of many directions."""
    axes = direction_rule("fibonacci:20000").axes
    shared, slope = shape.overlap(axes, 0.0)
    length = shared / slope
    along = length @ axes[:, 2] ** 2 / length.sum()
    assert 1.5 * along - 0.5 == pytest.approx(alpha, abs=2e-5)


@pytest.mark.parametrize(
    "shape", [box([7.0, 7.0, 14.0]), cylinder(4.0, 12.0), ellipsoid([4.0, 4.0, 8.0])]
)
def test_freely_overlapping_spheres_have_the_anisotropy_of_the_window_alone(shape):
    """A medium without any direction: what is measured is what the column says of the window."""
    random = np.random.default_rng(4)
    rule = direction_rule("design:15")
    axis = np.array([0.0, 0.0, 1.0])
    off, alone = [], []
    for seed in range(24):
        spheres = poisson_spheres(random, 0.5, shape.reach, radii=(0.3, 0.7))
        words = {"spacing": 0.4, "cutoff": 0.5, "variants": "c", "replicates": range(4)}
        sums = scan_lines(solids_of(spheres, shape), rule, seed=seed, **words)
        fabric = void_fabric(sums.axes, rule.weights, *sums.kept("c"))
        alone.append(window_alpha(shape, fabric, 0.5, axis))
        off.append(fabric.tensor.axial(axis) - alone[-1])
    error = np.std(off, ddof=1) / np.sqrt(len(off))
    assert error < 2e-3
    assert abs(np.mean(off)) < 4 * error
    assert abs(np.mean(alone)) > 8 * error
