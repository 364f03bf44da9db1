"""The cell: wrapping, nearest images, images outside it, and what cannot be a cell."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scanfab.base.errors import PackingError
from scanfab.packing.cell import Cell
from tests.helpers import naive

EDGES = np.array([2.0, 3.0, 4.0])
TILTED = np.array([[2.0, 0, 0], [0.7, 3, 0], [-0.5, 0.4, 4]])


def test_heights_are_distances_of_opposite_faces():
    np.testing.assert_allclose(Cell(EDGES).heights, EDGES)
    a, b, c = TILTED
    volume = np.dot(a, np.cross(b, c))
    faces = [np.cross(b, c), np.cross(c, a), np.cross(a, b)]
    expected = [volume / np.linalg.norm(face) for face in faces]
    np.testing.assert_allclose(Cell(TILTED).heights, expected)


@pytest.mark.parametrize("trap", [-1e-17, -1e-300, -0.0, np.nextafter(0, -1)])
@pytest.mark.parametrize("vectors", [EDGES, TILTED])
def test_a_rounding_error_below_a_face_is_not_on_the_opposite_face(vectors, trap):
    cell = Cell(vectors)
    wrapped, turns = cell.place([[trap, trap, trap]])
    assert np.all(cell.fractional(wrapped) < 1)
    np.testing.assert_allclose(wrapped, 0, atol=1e-15)
    assert np.all(turns == 0)


def random_cell(random):
    """Strongly tilted, flat or long cells, with any mix of vectors that repeat."""
    vectors = np.diag(random.uniform(0.5, 4.0, 3))
    vectors[[1, 2, 2], [0, 0, 1]] = random.uniform(-1.6, 1.6, 3) * vectors[0, 0]
    if random.random() < 0.3:
        vectors = vectors @ Rotation.random(rng=random).as_matrix()
    return Cell(vectors, tuple(random.random(3) < 0.7), random.uniform(-5, 5, 3))


def test_the_nearest_image_is_the_shortest_in_any_cell():
    random = np.random.default_rng(5)
    for _ in range(100):
        cell = random_cell(random)
        branches = random.normal(size=(5, 3)) * random.choice([0.3, 3.0, 30.0])
        image = cell.nearest_image(branches)
        assert not image[:, ~np.array(cell.periodic)].any()
        found = np.linalg.norm(branches + image @ cell.vectors, axis=1)
        shortest = [naive.nearest_length(b, cell.vectors, cell.periodic) for b in branches]
        np.testing.assert_allclose(found, shortest, rtol=1e-12, atol=1e-12)


def test_a_reduced_lattice_is_the_same_lattice_by_shorter_vectors():
    random = np.random.default_rng(6)
    for _ in range(100):
        cell = random_cell(random)
        lattice = cell.lattice
        np.testing.assert_allclose(lattice.combination @ cell.vectors, lattice.vectors)
        # whole combinations of each other: the same points
        whole = lattice.combination[:, list(cell.periodic)]
        assert abs(round(np.linalg.det(whole))) == 1
        lengths = np.linalg.norm(lattice.vectors, axis=1)
        for k, signs in product(range(len(whole)), product((-1, 0, 1), repeat=len(whole))):
            if signs[k]:
                other = np.linalg.norm(np.array(signs) @ lattice.vectors)
                assert other >= lengths[k] * (1 - 1e-6)


def test_positions_are_their_places_and_their_turns():
    random = np.random.default_rng(7)
    for _ in range(50):
        cell = random_cell(random)
        position = random.normal(size=(20, 3)) * 10
        place, turns = cell.place(position)
        np.testing.assert_allclose(place + turns @ cell.vectors, position, atol=1e-11)
        fractions = cell.fractional(place)[:, list(cell.periodic)]
        assert np.all((fractions > -1e-12) & (fractions < 1 + 1e-12))
        assert not turns[:, ~np.array(cell.periodic)].any()


@pytest.mark.parametrize("margin", [0.0, 0.3, 1.0, 2.5, 5.0])
@pytest.mark.parametrize("periodic", [(True, True, True), (True, False, True)])
@pytest.mark.parametrize("vectors", [np.diag(EDGES), TILTED])
def test_images_are_all_those_within_the_margin(vectors, periodic, margin):
    cell = Cell(vectors, periodic, origin=[-1, 0.5, 2])
    position = cell.origin + np.random.default_rng(3).random((20, 3)) @ vectors
    places, row, image = cell.images_outside(position, margin)
    np.testing.assert_allclose(places, position[row] + image @ cell.vectors)
    found = np.column_stack([row, image]).tolist()
    span = [range(-4, 5) if repeats else (0,) for repeats in periodic]
    shifts = np.array([shift for shift in product(*span) if any(shift)])
    inside = (
        np.abs(cell.fractional(position)[:, None] + shifts - 0.5) <= 0.5 + margin / cell.heights
    )
    among = np.argwhere((inside | ~np.array(periodic)).all(axis=2))
    assert sorted(found) == sorted([index, *shifts[k].tolist()] for index, k in among.tolist())


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (([1, 2],), r"cell: vectors: expected shape \(3, \.\.\.\), found \(2,\)"),
        (("x",), "cell: vectors: expected numbers"),
        (([[1, 2], [3]],), "cell: vectors: expected numbers"),
        ((EDGES, (True, True, True), [0, 0]), "cell: origin: expected shape"),
        (([1, 1, 1], True), r"cell: periodic: expected shape \(3\), found \(\)"),
        (([1, 1, 1], "xyz"), "cell: periodic: expected shape"),
        (([1, np.nan, 1],), "must be finite numbers"),
        (([[1, 0, 0], [0, 1, 0], [1, 1, 0]],), "span no volume"),
        (([[1, 0, 0], [0, 1, 0], [1e31, 0, 1e31]],), "times as long as it is high"),
    ],
)
def test_what_makes_no_cell_is_told(words, told):
    with pytest.raises(PackingError, match=told):
        Cell(*words)


def test_the_shortest_translation_of_a_lattice():
    assert Cell([[1, 0, 0], [5, 3, 0], [0, 0, 2]]).lattice.shortest == 1.0
    assert Cell(EDGES, (False, False, False)).lattice.shortest == np.inf
    # what does not repeat may be as long as it likes
    assert Cell([1, 1, 1e31], (True, True, False)).lattice.shortest == 1
