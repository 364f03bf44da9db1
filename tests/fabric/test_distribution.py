"""The even fit: exact for even harmonics up to its degree, careful where directions are few."""

import numpy as np
import pytest

from scanfab.base.space import Space
from scanfab.fabric.distribution import direction_points, fit_even, mean_length_function
from scanfab.scan.directions import direction_rule, plane_rule


def even(n):
    """Of degree 6."""
    x, y, z = np.moveaxis(n, -1, 0)
    return 1.0 + 0.3 * z**2 - 0.2 * x * y + 0.1 * x**2 * z**2 + 0.05 * z**6 + 0.04 * x**4 * y**2


@pytest.mark.parametrize(
    "rule",
    [
        direction_rule("lebedev:17"),
        direction_rule("product:13"),
        direction_rule("fibonacci:200"),
        plane_rule(20, Space(2)),
    ],
)
def test_even_polynomials_of_degree_six_come_back(rule):
    axes, weights = rule.axes, np.random.default_rng(0).uniform(1, 2, len(rule))
    function = fit_even(axes, even(axes), weights, rule.space)
    points, _ = direction_points(rule.space)
    assert function.degree == 6
    assert function(points) == pytest.approx(even(points), abs=1e-10)
    assert function(-points) == pytest.approx(function(points), abs=1e-12)


@pytest.mark.parametrize(
    ("axes", "degree"),
    [
        (direction_rule("design:9").axes, 4),
        (direction_rule("lebedev:3").axes, 0),
        # the corners of an icosahedron, as many as there are even terms of degree 2
        (direction_rule("icosahedral:9").axes[:6], 2),
    ],
)
def test_few_directions_take_a_low_degree(axes, degree):
    assert fit_even(axes, np.ones(len(axes)), np.ones(len(axes))).degree == degree


def test_directions_of_half_the_sphere_do_not_run_wild():
    axes = direction_rule("equal-angle:10").axes
    noise = 1 + 0.01 * np.random.default_rng(1).standard_normal(len(axes))
    function = fit_even(axes, noise, np.ones(len(axes)))
    assert np.abs(function(direction_points()[0]) - 1).max() < 0.05


def test_directions_without_a_segment_are_left_out():
    axes = direction_rule("lebedev:17").axes[None]
    segments = np.ones(axes.shape[:2], int)
    segments[0, 3] = 0
    function = mean_length_function(axes, 2.0 * segments, segments)
    assert function is not None
    assert function(axes) == pytest.approx(np.full(segments.shape, 2.0))
    assert mean_length_function(axes, 0.0 * segments, 0 * segments) is None


def test_the_points_are_a_rule_for_the_whole_sphere():
    points, weights = direction_points()
    assert weights.sum() == pytest.approx(1)
    second = np.einsum("p,pi,pj->ij", weights, points, points)
    assert second == pytest.approx(np.eye(3) / 3, abs=1e-13)
    assert weights @ points[:, 2] ** 8 == pytest.approx(1 / 9)
