"""The triads of scan lines, and lines cut exactly: against the naive twin and closed forms."""

import numpy as np
import pytest

from scanfab import direction_rule
from scanfab.base.shapes import sphere
from scanfab.scan.lines import cut_lines, grid_points, line_triads, sample_segments
from tests.helpers import naive
from tests.helpers.lattices import rotation, shaken_cubic
from tests.helpers.windows import random_window


@pytest.fixture
def spheres():
    random = np.random.default_rng(5)
    packing = shaken_cubic(random, 4)
    # overlap, and one grain inside another
    radius = packing.radius * random.uniform(0.4, 1.4, len(packing.radius))
    return packing.position - packing.position.mean(axis=0), radius


@pytest.mark.parametrize("seed", range(60))
def test_void_segments_are_those_of_the_naive_twin_in_any_window(spheres, seed):
    random = np.random.default_rng(seed)
    window, triad, points = random_window(random), rotation(random), grid_points(2.0, 60)
    found = cut_lines(*spheres, triad, points, window or None)
    for number, foot in enumerate(points @ triad[:2]):
        solids = naive.union(naive.chords(*spheres, foot, triad[2]))
        low, high = naive.within(window, foot, triad[2])
        if window:
            expected = naive.gaps_within(solids, low, high) if low < high else []
        else:
            expected = naive.gaps_between(solids)
        lengths = found.length[(found.line == number) & found.void]
        np.testing.assert_allclose(lengths, naive.lengths(expected), atol=1e-7)


def test_pieces_of_a_line_join_alternate_and_lie_on_it(spheres):
    triad = line_triads(np.array([[0.0, 0.6, 0.8]]))[0]
    found = cut_lines(*spheres, triad, np.array([[0.25, -0.5]]), sphere(1.5))
    assert found.ends[1:, 0] == pytest.approx(found.ends[:-1, 1])
    assert np.all(found.void[1:] != found.void[:-1])
    assert found.length.sum() == pytest.approx(2 * np.sqrt(1.5**2 - 0.25**2 - 0.5**2))
    assert found.ends @ triad[0] == pytest.approx(np.full(found.ends.shape[:2], 0.25))
    assert found.ends @ triad[1] == pytest.approx(np.full(found.ends.shape[:2], -0.5))


def test_an_empty_window_is_one_segment():
    found = cut_lines(np.zeros((0, 3)), np.zeros(0), np.eye(3), np.zeros((1, 2)), sphere(2.0))
    assert found.length.tolist() == [4.0]
    assert found.void.all()


def test_lines_that_meet_nothing_have_no_pieces():
    for points in (np.zeros((0, 2)), np.array([[5.0, 0.0]])):
        for window in (None, sphere(2.0)):
            found = cut_lines(np.zeros((1, 3)), np.ones(1), np.eye(3), points, window)
            assert len(found.length) == 0
    assert len(sample_segments(np.zeros((0, 3)), np.zeros(0), np.eye(3)[None], 9).length) == 0


def test_lines_of_several_directions_are_numbered_on(spheres):
    found = sample_segments(*spheres, line_triads(np.eye(3)), 90, sphere(1.5))
    numbers = np.unique(found.line)
    assert numbers.tolist() == list(range(len(numbers)))
    assert 60 < len(numbers) < 120


def test_triads_are_orthonormal_and_right_handed():
    triads = line_triads(direction_rule("lebedev:41").axes)
    assert np.abs(triads @ triads.transpose(0, 2, 1) - np.eye(3)).max() < 1e-14
    assert np.linalg.det(triads) == pytest.approx(np.ones(len(triads)))
    assert np.array_equal(triads[:, 2], direction_rule("lebedev:41").axes)
