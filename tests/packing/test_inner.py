"""The ellipsoid within a sample: of the sample's shape, and no unknown grain reaches into it."""

import numpy as np
import pytest

from scanfab.packing.window import inner_ellipsoid
from tests.helpers.lattices import ball_points, rotation


def test_that_of_a_stretched_and_turned_ball_is_stretched_and_turned_likewise():
    random = np.random.default_rng(0)
    points, turn = ball_points(random, 20_000, 10.0), rotation(random)
    stretched = points * [1.0, 1.5, 0.7] @ turn
    found = inner_ellipsoid(stretched, 0.0)
    isotropic, deviator, level = found.shape.quadric
    form = (isotropic * np.eye(3) + deviator) / level
    half = np.linalg.eigvalsh(form)[::-1] ** -0.5
    assert half == pytest.approx([7.0, 10.0, 15.0], rel=0.05)
    assert np.abs(turn @ form @ turn.T - np.diag(np.diag(turn @ form @ turn.T))).max() < 2e-4


def test_it_touches_the_hull_moved_inwards_by_the_largest_radius():
    from scipy.spatial import ConvexHull

    random = np.random.default_rng(1)
    points = ball_points(random, 300, 5.0) * [1.0, 1.2, 0.8]
    found = inner_ellipsoid(points, 0.6)
    isotropic, deviator, level = found.shape.quadric
    inverse = level * np.linalg.inv(isotropic * np.eye(3) + deviator)
    facets = ConvexHull(points - found.center).equations
    # how far the ellipsoid reaches along each normal
    reach = np.sqrt(np.einsum("fi,ij,fj->f", facets[:, :3], inverse, facets[:, :3]))
    room = -facets[:, 3] - 0.6 - reach
    assert room.min() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.zeros((3, 3)),
        np.random.default_rng(0).random((50, 3)) * [1.0, 1.0, 0.0],
        np.random.default_rng(0).random((50, 3)),
    ],
    ids=["none", "one place", "flat", "small"],
)
def test_what_is_flat_or_small_has_none(points):
    assert inner_ellipsoid(points, 1.0) is None
