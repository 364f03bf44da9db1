"""Volumes, branches and stress of clumps: closed forms."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import qmc

from scanfab import Cell, ContactList, Packing
from scanfab.packing.bodies import own_shares
from scanfab.packing.sample import VARIANTS
from scanfab.pipeline.state import _rays, contact_forces, sample_state
from tests.helpers.packed import sample_of

BALL = 4.0 / 3.0 * np.pi


def lens(d):
    """What two unit spheres at this distance share."""
    return np.pi * (2 - d) ** 2 * (d * d + 4 * d) / (12 * d)


def shares(position, radius, number, **options):
    return own_shares(Packing(position, radius, bodies=number, **options), _rays)


def test_what_two_spheres_of_a_clump_share_counts_once():
    for d in (0.3, 1.0, 1.7):
        found = shares([[0, 0, 0], [d, 0, 0], [9, 9, 9]], 1.0, [2, 2, -1])
        assert found[[0, 2]].tolist() == [1.0, 1.0]
        assert found[1] == pytest.approx(1 - lens(d) / BALL, rel=1e-12)


def test_a_sphere_in_a_sphere_and_many_at_one_place_are_the_largest():
    assert shares([[0, 0, 0], [0.2, 0, 0]], [1.0, 0.5], [1, 1]) == pytest.approx([1, 0])
    assert shares(np.zeros((10, 3)), 1.0, np.ones(10, int)).sum() == pytest.approx(1.0)
    # the inner one comes first: all of it counts, and of the outer one the rest
    found = shares([[0.2, 0, 0], [0, 0, 0]], [0.5, 1.0], [1, 1])
    assert found @ [0.125, 1.0] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.48, 0.64]])
def test_a_rod_of_overlapping_spheres(axis):
    """Equal spheres in a row share what neighbours share, and no more: n V - (n - 1) lenses."""
    d, n = 0.6, 5
    found = shares(d * np.outer(np.arange(n), axis), 1.0, np.ones(n, int))
    assert found.sum() == pytest.approx((n * BALL - (n - 1) * lens(d)) / BALL, rel=1e-12)


def test_a_row_of_overlapping_discs():
    d = 0.6
    shared = 2 * np.arccos(d / 2) - d / 2 * np.sqrt(4 - d * d)
    row = Packing(d * np.outer(np.arange(4), [0.6, 0.8, 0]), 1.0, bodies=np.ones(4, int), dim=2)
    found = own_shares(row, partial(_rays, space=row.space))
    assert found.sum() == pytest.approx((4 * np.pi - 3 * shared) / np.pi, rel=1e-12)


def test_what_three_spheres_share_counts_once():
    """In one another's middle: by points that fill their box evenly."""
    position, radius = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0.1]]), np.array([1.0, 0.9, 0.8])
    points = [-1, -1, -1] + [3.0, 2.7, 2.0] * qmc.Sobol(3, seed=0).random(1 << 19)
    inside = (np.linalg.norm(points[:, None] - position, axis=2) < radius).any(axis=1)
    union = inside.mean() * 3.0 * 2.7 * 2.0
    found = shares(position, radius, [1, 1, 1])
    assert BALL * found @ radius**3 == pytest.approx(union, rel=4e-4)


def test_spheres_of_different_clumps_cover_nothing():
    assert shares(np.zeros((3, 3)), 1.0, [1, 2, -1]).tolist() == [1, 1, 1]


def test_through_a_face_it_is_the_same():
    apart = [[5.0, 5, 5], [6.0, 5, 5], [4.0, 5.5, 5]]
    moved = np.array(apart) + np.array([4.5, 0, 0])
    cell = Cell([10.0, 10, 10])
    one, two = (shares(x, [1.0, 0.9, 0.8], [1, 1, 1], cell=cell) for x in (apart, moved))
    np.testing.assert_allclose(one, two, atol=1e-12)


@pytest.fixture
def dumbbells():
    """Two of them in a cell, that press on each other at two points, each with a force of 3."""
    position = [[2, 2, 2], [2, 5, 2], [3.9, 2, 2], [3.9, 5, 2]]
    listed = ContactList([[0, 2], [3, 1]], force=[[3.0, 0.2, 0], [-3.0, 0, 0]])
    more = {"bodies": [0, 0, 1, 1], "contacts": listed, "cell": Cell([9.0] * 3)}
    return sample_of(Packing(position, [1.0, 0.9, 1.0, 1.1], **more))


def test_stress_and_branches_run_from_body_to_body(dumbbells):
    """A body's place has y = 2 + 3 v for the volume v of its upper sphere over that of both."""
    y = [2 + 3 * r**3 / (1 + r**3) for r in (0.9, 1.1)]
    state = sample_state(dumbbells, VARIANTS["a"], None)
    branch = np.array([1.9, y[1] - y[0], 0.0])
    product = np.outer([6.0, 0.2, 0.0], branch) / 9.0**3
    np.testing.assert_allclose(state.stress, 0.5 * (product + product.T), atol=1e-15)
    forces = contact_forces(dumbbells, np.ones(2, bool))
    np.testing.assert_allclose(forces.branch, [1.9, 1.9])
    solid = BALL * (2.0 + 0.9**3 + 1.1**3)
    assert state.void_ratio == pytest.approx(9.0**3 / solid - 1)
    assert state.coordination_mechanical is None


def test_mechanical_coordination_is_of_bodies():
    """A ring of three dumbbells, each touching both others, and one that hangs on it."""
    angle = np.radians([0, 120, 240])
    inner = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * 1.1
    position = np.vstack([inner, inner + np.array([0, 0, 1.0]), [[3.0, 0, 0], [4.5, 0, 0]]])
    number = [0, 1, 2, 0, 1, 2, 3, 3]
    sample = sample_of(Packing(position, 1.0, bodies=number, cell=Cell([20.0] * 3)))
    state = sample_state(sample, VARIANTS["a"], None)
    assert state.coordination_mechanical == pytest.approx((3 + 2 + 2) / 3)
