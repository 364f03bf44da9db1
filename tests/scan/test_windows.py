"""Windows as data: regions made up from half-spaces and a quadric, of which no code knows."""

import numpy as np
import pytest

from scanfab import box, cylinder, direction_rule, scan_lines, sphere
from scanfab.scan.blocks import Blocks
from scanfab.scan.kernels.strips import section_along
from scanfab.scan.lines import line_triads
from scanfab.scan.scan import scan_gaps
from tests.helpers import naive
from tests.helpers.lattices import Spheres, poisson_spheres, rotation
from tests.helpers.scanning import solids_of
from tests.helpers.windows import cut_ball, random_window

NOTHING = Spheres(np.zeros((0, 3)), np.zeros(0))
TURN = rotation(np.random.default_rng(4))
HALF = np.array([0.8, 1.1, 1.5])
RULE = direction_rule("lebedev:5")
ENDLESS = (True, True, True)
# with volume and surface
WINDOWS = {
    "sphere": (sphere(1.2), 4 / 3 * np.pi * 1.2**3, 4 * np.pi * 1.2**2),
    "box": (box(2 * HALF, TURN), 8 * HALF.prod(), 8 * (0.8 * 1.1 + 1.1 * 1.5 + 1.5 * 0.8)),
    "cylinder": (cylinder(0.7, 2.6, TURN[0]), np.pi * 0.49 * 2.6, 2 * np.pi * (0.49 + 0.7 * 2.6)),
    "half a ball": (cut_ball(1.3, TURN[1], 0.0), 2 / 3 * np.pi * 1.3**3, 3 * np.pi * 1.3**2),
}


@pytest.mark.parametrize("name", WINDOWS)
def test_lines_measure_the_volume_along_every_axis_and_the_surface_over_all(name):
    """Σ length * spacing² = V; and by Cauchy's formula the mean shadow is a quarter of S."""
    window, volume, surface = WINDOWS[name]
    rule = direction_rule("lebedev:41")
    sums = scan_lines(
        solids_of(NOTHING, window), rule, spacing=0.02, cutoff=0.0, variants="c", replicates=[0]
    )
    assert sums.line_length[0, 2] * 0.02**2 == pytest.approx(volume, rel=2e-3)
    assert sums.length[0, 2] == pytest.approx(sums.line_length[0, 2])
    assert rule.weights @ sums.lines[0, 2] * 0.02**2 == pytest.approx(surface / 4, rel=2e-3)


def test_a_sphere_has_the_same_numbers_along_all_axes():
    section = section_along(line_triads(direction_rule("lebedev:11").axes), sphere(1.7))
    for numbers in section.quadric:
        assert numbers == pytest.approx((1.7 * 1.7, 1.0, 0.0, 1.0, 0.0, 0.0), abs=1e-14)


def test_spans_are_those_of_the_naive_twin():
    random = np.random.default_rng(6)
    for _ in range(300):
        window = random_window(random)
        if not isinstance(window, float):
            triad, points = rotation(random), random.uniform(-2.0, 2.0, (40, 2))
            way = np.broadcast_to(2.0 * window.reach * triad[2], (40, 3))
            ends = np.column_stack(window.cut(points @ triad[:2] - 0.5 * way, way))
            ends = np.where(ends[:, :1] < ends[:, 1:], window.reach * (2.0 * ends - 1.0), np.nan)
            low, high = naive.within(window, points @ triad[:2], triad[2])
            expected = np.where(low < high, [low, high], np.nan).T
            np.testing.assert_allclose(ends, expected, rtol=0, atol=1e-7)


def test_a_place_just_below_a_period_lies_in_the_last_block():
    blocks = Blocks(np.zeros(3), np.eye(3), (3, 1, 4), ENDLESS)
    assert blocks.of(np.full((1, 3), -1e-20)).tolist() == [11]


def test_whole_and_window_may_have_blocks_of_their_own():
    spheres = poisson_spheres(np.random.default_rng(2), 0.4, 2.5)
    solids = solids_of(spheres, 2.0, np.arange(len(spheres.radius)) % 5 == 0)
    cells = Blocks(np.full(3, -4.5), 9.0 * np.eye(3), (3, 1, 1), ENDLESS)
    about = Blocks.about(np.zeros(3), 3.0)
    gaps, octants = (
        scan_gaps(solids, RULE, spacing=0.1, cutoffs=[0.0], blocks=blocks, replicates=[0])
        for blocks in ((cells, about), (about, about))
    )
    found = gaps.number.sum(axis=(0, 2, 4)) > 0
    assert found[0].tolist() == [True] * 3 + [False] * 5
    assert found[2].all()
    assert np.array_equal(gaps.number[:, 2:], octants.number[:, 2:])
