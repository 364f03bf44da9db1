"""Regions as data: what lies in them, told by the numbers alone."""

import math

import numpy as np
import pytest

from scanfab import SettingsError, sphere
from tests.helpers.lattices import rotation
from tests.helpers.windows import box, cut_ball, cylinder, ellipsoid

RANDOM = np.random.default_rng(3)
POINTS = RANDOM.uniform(-2, 2, (2000, 3))
TURN = rotation(RANDOM)
HALF = np.array([0.5, 1.0, 1.7])


def of_axis(points):
    """Places along the first row of TURN, and distances from it."""
    along = points @ TURN[0]
    return along, np.linalg.norm(points - np.outer(along, TURN[0]), axis=1)


@pytest.mark.parametrize(
    ("region", "inside"),
    [
        (sphere(1.3), np.linalg.norm(POINTS, axis=1) < 1.3),
        (box(HALF), np.all(np.abs(POINTS) < HALF, axis=1)),
        (box(HALF, TURN), np.all(np.abs(POINTS @ TURN.T) < HALF, axis=1)),
        (
            cylinder(TURN[0], 0.8, 1.4),
            (np.abs(of_axis(POINTS)[0]) < 1.4) & (of_axis(POINTS)[1] < 0.8),
        ),
        (ellipsoid(HALF, TURN), np.sum((POINTS @ TURN.T / HALF) ** 2, axis=1) < 1),
        (
            cut_ball(1.5, TURN[0], 0.2),
            (np.linalg.norm(POINTS, axis=1) < 1.5) & (POINTS @ TURN[0] < 0.2),
        ),
    ],
    ids=["sphere", "box", "turned box", "cylinder", "ellipsoid", "cut ball"],
)
def test_points_inside_are_those_of_the_definition(region, inside):
    assert 20 < inside.sum() < 1500
    assert np.array_equal(region.contains(POINTS), inside)
    assert np.all(np.linalg.norm(POINTS[inside], axis=1) <= region.reach)
    assert np.all((region.low <= POINTS[inside]) & (POINTS[inside] <= region.high))
    # a sphere about a point reaches inside if any of its own points does
    radius = np.full(len(POINTS), 0.3)
    for shift in 0.3 * np.concatenate([TURN, -TURN]):
        assert np.all(region.may_meet(POINTS, radius)[region.contains(POINTS + 0.999 * shift)])


def test_only_spheres_that_reach_into_a_sphere_meet_it():
    points = np.array([[0.0, 0.0, 1.4], [0.0, 1.6, 0.0], [0.1, 0.0, 0.0]])
    assert sphere(1.0).may_meet(points, np.array([0.5, 0.5, 0.0])).tolist() == [True, False, True]


def test_a_point_on_the_surface_is_outside():
    for radius in RANDOM.uniform(0.1, 9.0, 100):
        assert not sphere(radius).contains(np.array([[0.0, 0.0, radius]]))[0]


@pytest.mark.parametrize("radius", [-1, 0, math.inf, math.nan, "x"])
def test_a_sphere_has_a_radius_above_0(radius):
    with pytest.raises(SettingsError, match="radius: expected a length above 0, found"):
        sphere(radius)
