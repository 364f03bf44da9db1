"""Clumps: which spheres are one grain, what touches it, where it is; volumes, branches, stress."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import qmc

from scanfab import Cell, ContactList, Packing, sphere
from scanfab.packing.bodies import own_shares
from scanfab.packing.rattlers import recursive
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import Window
from scanfab.pipeline.state import _rays, contact_forces, sample_state
from tests.helpers import naive
from tests.helpers.lattices import simple_cubic
from tests.helpers.naive_bodies import NaiveBodies
from tests.helpers.packed import along_x, sample_of

A, B, C, D = (VARIANTS[name] for name in "abcd")


def grains(position, number, radius=1.0, *, boundary=(), **options):
    """Spheres that are put together, with their contacts by geometry."""
    return sample_of(Packing(position, radius, bodies=number, **options), boundary)


@pytest.mark.filterwarnings("error")
def test_ten_spheres_at_one_place_are_one_grain_and_no_warning():
    """Those that touch another grain at ten points are one neighbour of it."""
    sample = grains(along_x([0] * 10 + [1.5]), [4] * 10 + [-1])
    assert sample.number(sample.grains) == 2
    assert len(sample.contacts) == 10
    assert sample.contact_numbers.tolist() == [1] * 11


def test_a_rattler_goes_whole_with_the_contacts_of_all_its_spheres():
    """Bodies in a row, each of two spheres: the ends have one neighbour."""
    sample = grains(along_x([0, 2.5, 4.4, 7, 8.9, 11]), [0, 0, 1, 1, 2, 2])
    assert sample.rattlers.tolist() == [True, True, False, False, True, True]
    assert sample.fabric_contacts(B, None).sum() == 0
    assert sample.coordination(B, None) == 0.0
    assert sample.numbers_of(B)[2:4].tolist() == [0, 0]


def test_a_body_is_boundary_if_one_of_its_spheres_is():
    sample = grains(along_x([0, 2.5, 4.4]), [0, 0, -1], boundary=[1])
    assert sample.boundary.tolist() == [True, True, False]
    assert sample.fabric_contacts(A, None).sum() == 0
    assert sample.contact_numbers.tolist() == [1, 1, 1]


def test_the_place_of_a_body_decides_for_the_window():
    sample = grains(along_x([0, 3, 9]), [0, 0, -1])
    for x, radius, inside in ((1.5, 0.1, [True, True, False]), (0.0, 1.0, [False] * 3)):
        assert sample.counted(C, Window(np.array([x, 0, 0]), sphere(radius))).tolist() == inside


def test_contacts_of_a_file_within_a_body_do_not_exist():
    """The force stays with its contact."""
    listed = ContactList([[0, 1], [1, 2]], force=[[5, 0, 0], [7, 0, 0]])
    packing = Packing(along_x([0, 1.5, 3]), 1.0, bodies=[3, 3, -1], contacts=listed)
    assert packing.contacts.pairs.tolist() == [[1, 2]]
    assert packing.contacts.force.tolist() == [[7, 0, 0]]
    assert packing.contacts.force_n.tolist() == [7]


def small_clumps(random, size):
    """Spheres a few of which, close together, are one body each, shaken all over a cube."""
    position, radius, number = [], [], []
    for name in range(size):
        centre, many = random.random(3) * 6.0, int(random.integers(1, 4))
        position += list(centre + random.uniform(-0.6, 0.6, (many, 3)))
        radius += list(random.uniform(0.3, 0.7, many))
        number += [name if many > 1 else -1] * many
    turn = random.permutation(len(radius))
    return np.array(position)[turn], np.array(radius)[turn], np.array(number)[turn]


CELLS = {
    "open": None,
    "tilted": np.array([[6.0, 0, 0], [2.5, 6.5, 0], [-1.5, 2.0, 7.0]]),
    "thin": np.array([[6.0, 0, 0], [0.0, 6.5, 0], [0.4, 0.2, 1.7]]),
}


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", CELLS)
def test_counts_rattlers_and_places_are_those_of_the_naive_twin(name, seed):
    random, vectors = np.random.default_rng(seed), CELLS[name]
    position, radius, number = small_clumps(random, 20)
    walls = random.integers(0, 2, len(radius)) * random.integers(0, 2, len(radius))
    cell = None if vectors is None else Cell(vectors)
    sample = grains(position, number, radius, wall_contacts=walls, cell=cell)
    packing = sample.packing
    twin = NaiveBodies(packing.position, radius, number, vectors)
    expected = twin.numbers(walls.tolist())
    assert len(sample.contacts) == twin.contacts
    bodies = [twin.body[row] for row in range(len(radius))]
    assert sample.contact_numbers.tolist() == [expected[body] for body in bodies]
    assert sample.number(sample.rattlers) == sum(n < 2 for n in expected)
    assert sample.coordination(A, None) == pytest.approx(np.mean(expected))
    for row, place in enumerate(packing.bodies.place):
        off = place - twin.place(row)
        turns = off if vectors is None else off @ np.linalg.inv(vectors)
        np.testing.assert_allclose(turns, np.round(turns) * (vectors is not None), atol=1e-9)
    body_walls = [sum(walls[row] for row in rows) for rows in twin.members]
    held = naive.held_grains(twin.pairs(), body_walls, [True] * len(twin.members), 3)
    strict = Sample(packing, sample.boundary, 3, recursive)
    left = {twin.body[row] for row in np.flatnonzero(~strict.rattlers).tolist()}
    assert left == held


def test_a_clump_of_many_spheres_that_flew_away_is_one_grain_that_did():
    clump = np.array([30.0, 2.0, 2.0]) + 0.1 * np.random.default_rng(0).random((40, 3))
    number = np.concatenate([np.full(216, -1), np.full(40, 7)])
    sample = grains(np.vstack([simple_cubic(6).position, clump]), number, 0.5)
    assert np.flatnonzero(~sample.gathered).tolist() == list(range(216, 256))


# volumes, branches and stress: closed forms

BALL = 4.0 / 3.0 * np.pi


def lens(d):
    """What two unit spheres at this distance share."""
    return np.pi * (2 - d) ** 2 * (d * d + 4 * d) / (12 * d)


def shares(position, radius, number, **options):
    return own_shares(Packing(position, radius, bodies=number, **options), _rays)


def test_a_sphere_in_a_sphere_and_many_at_one_place_are_the_largest():
    assert shares([[0, 0, 0], [0.2, 0, 0]], [1.0, 0.5], [1, 1]) == pytest.approx([1, 0])
    assert shares(np.zeros((10, 3)), 1.0, np.ones(10, int)).sum() == pytest.approx(1.0)
    # the inner one comes first: all of it counts, and of the outer one the rest
    found = shares([[0.2, 0, 0], [0, 0, 0]], [0.5, 1.0], [1, 1])
    assert found @ [0.125, 1.0] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("axis", "d", "n"), [([0, 0, 1], 1.7, 2), ([0.6, 0.48, 0.64], 0.6, 5)])
def test_a_rod_of_overlapping_spheres(axis, d, n):
    """Equal spheres in a row share what neighbours share, and no more: n V - (n - 1) lenses."""
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


def test_stress_and_branches_run_from_body_to_body():
    """
    Two dumbbells in a cell press on each other at two points, each with a force of 3.

    A body's place has y = 2 + 3 v for the volume v of its upper sphere over that of both.
    """
    position = [[2, 2, 2], [2, 5, 2], [3.9, 2, 2], [3.9, 5, 2]]
    listed = ContactList([[0, 2], [3, 1]], force=[[3.0, 0.2, 0], [-3.0, 0, 0]])
    more = {"bodies": [0, 0, 1, 1], "contacts": listed, "cell": Cell([9.0] * 3)}
    dumbbells = sample_of(Packing(position, [1.0, 0.9, 1.0, 1.1], **more))
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
