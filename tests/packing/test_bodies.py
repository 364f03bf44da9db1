"""Clumps: which spheres are one grain, what touches it, where it is; a twin that tries it all."""

import numpy as np
import pytest

from scanfab import Cell, ContactList, Packing, find_contacts, sphere
from scanfab.packing.bodies import bodies_of
from scanfab.packing.rattlers import recursive
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import Window
from tests.helpers import naive
from tests.helpers.naive_bodies import NaiveBodies
from tests.helpers.packed import along_x, cubic_grid, sample_of

A, B, C, D = (VARIANTS[name] for name in "abcd")


def grains(position, number, radius=1.0, *, boundary=(), **options):
    """Spheres that are put together, with their contacts by geometry."""
    return sample_of(Packing(position, radius, bodies=number, **options), boundary)


def test_bodies_of_one_sphere_each_are_no_bodies():
    packing = Packing(along_x([0, 1, 2]), 1.0, bodies=[7, 3, -1])
    assert packing.bodies is None
    assert len(find_contacts(packing).contacts) == 2


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


def test_a_body_through_a_face_has_its_place_next_to_its_first_sphere():
    cell = Cell([10.0, 10.0, 10.0])
    packing = Packing([[9.5, 5, 5], [0.5, 5, 5], [5, 5, 5]], [1, 2, 1], bodies=[1, 1, 2], cell=cell)
    assert packing.bodies.place[:2, 0] == pytest.approx([9.5 + 8 / 9] * 2)
    assert packing.bodies.turns.tolist() == [[0, 0, 0], [1, 0, 0], [0, 0, 0]]
    assert len(find_contacts(packing).contacts) == 0


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
    "box": np.diag([6.0, 6.5, 7.0]),
    "tilted": np.array([[6.0, 0, 0], [2.5, 6.5, 0], [-1.5, 2.0, 7.0]]),
    "thin": np.array([[6.0, 0, 0], [0.0, 6.5, 0], [0.4, 0.2, 2.6]]),
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


def test_places_do_not_suffer_from_the_unit():
    for unit in (1e-100, 1e100):
        bodies = bodies_of(
            np.array([1, 1]), along_x([0, 1]) * unit, np.array([1.0, 2.0]) * unit, None
        )
        assert bodies.place[0, 0] / unit == pytest.approx(8 / 9)


def test_a_clump_of_many_spheres_that_flew_away_is_one_grain_that_did():
    clump = np.array([30.0, 2.0, 2.0]) + 0.1 * np.random.default_rng(0).random((40, 3))
    number = np.concatenate([np.full(216, -1), np.full(40, 7)])
    sample = grains(np.vstack([cubic_grid(6), clump]), number, 0.5)
    assert np.flatnonzero(~sample.gathered).tolist() == list(range(216, 256))


def test_a_body_that_touches_its_own_image_has_two_neighbours():
    """As a sphere that does; the inner contact of the body is none."""
    cell = Cell([4.0, 20.0, 20.0])
    sample = grains([[0.5, 5, 5], [2.2, 5, 5]], [6, 6], 1.2, cell=cell)
    assert sample.contacts.pairs.tolist() == [[0, 1]]
    assert sample.contact_numbers.tolist() == [2, 2]
    assert not sample.rattlers.any()
