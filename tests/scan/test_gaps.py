"""The gap scan: the lines of the scan, kept apart by octant and cut-off."""

import numpy as np
import pytest

from scanfab import direction_rule
from scanfab.scan.blocks import Blocks
from scanfab.scan.lines import line_triads, turned_triads
from scanfab.scan.scan import scan_gaps
from tests.helpers import naive
from tests.helpers.lattices import poisson_spheres
from tests.helpers.scanning import solids_of

RULE = direction_rule("lebedev:5")
CUTOFFS = [0.0, 0.3, 0.8, 1.7]
ORIGIN = Blocks.about(np.zeros(3), 20.0), Blocks.about(np.zeros(3), 20.0)


@pytest.fixture(scope="module")
def solids():
    random = np.random.default_rng(0)
    spheres = poisson_spheres(random, 0.15, 4.0)
    return solids_of(spheres, 3.0, random.random(len(spheres.radius)) < 0.2)


def gaps_of(solids, **options):
    words = {"spacing": 0.3, "cutoffs": CUTOFFS, "blocks": ORIGIN, "replicates": range(3)}
    return scan_gaps(solids, RULE, **{**words, **options})


def test_octant_left_out_is_that_of_the_slow_twin(solids):
    """The second moment too: Σ l² and Σ l of the segments with their middle elsewhere."""
    triads, offsets = turned_triads(RULE, line_triads(RULE.axes), 0, 0)
    gaps = gaps_of(solids, spacing=0.8, replicates=range(1))
    _, window = naive.void_segments(
        solids.position, solids.radius, triads[2], offsets[2], 0.8, solids.reach
    )
    sums = naive.gap_sums(window, ORIGIN[1], CUTOFFS)
    for place in range(len(CUTOFFS)):
        for block in range(8):
            rest = np.delete(sums[:, place], block, axis=0).sum(axis=0)
            over, under = gaps.kept("c", place, without=block)
            assert (under[0, 2], over[0, 2]) == pytest.approx(tuple(rest[:2]))
            over, under = gaps.kept("c", place, moment=2, without=block)
            assert (under[0, 2], over[0, 2]) == pytest.approx(tuple(rest[1:]))


def test_octants_about_an_oblique_axis_have_it_as_one_of_their_axes():
    axis = np.array([0.6, 0.0, 0.8])
    blocks = Blocks.about(np.array([1.0, 2.0, 3.0]), 5.0, axis)
    places = np.random.default_rng(0).uniform(-2, 2, (200, 3))
    found = blocks.of(places + np.array([1.0, 2.0, 3.0]))
    assert set(found) == set(range(8))
    # the last four lie on the far side of the plane normal to the axis
    assert np.array_equal(found >= 4, places @ axis >= 0)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0, -1, 0)])
def test_octants_about_a_coordinate_are_those_of_the_coordinates(axis):
    center = np.array([0.1, 0.2, 0.3])
    places = np.random.default_rng(1).uniform(-2, 2, (100, 3))
    expected = (places >= center) @ [1, 2, 4]
    assert Blocks.about(center, 3.0, axis).of(places).tolist() == expected.tolist()
