"""The cell: wrapping, nearest images, and what cannot be a cell."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scanfab.base.errors import PackingError
from scanfab.packing.cell import Cell
from tests.helpers import naive

EDGES = np.array([2.0, 3.0, 4.0])
TILTED = np.array([[2.0, 0, 0], [0.7, 3, 0], [-0.5, 0.4, 4]])


def test_heights_are_distances_of_opposite_faces():
    faces = np.linalg.norm(np.cross(TILTED[[1, 2, 0]], TILTED[[2, 0, 1]]), axis=1)
    np.testing.assert_allclose(Cell(TILTED).heights, np.linalg.det(TILTED) / faces)


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


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (([1, 2],), r"cell: vectors: expected shape \(3, \.\.\.\), found \(2,\)"),
        (([[1, 2], [3]],), "cell: vectors: expected numbers"),
        ((EDGES, (True, True, True), [0, 0]), "cell: origin: expected shape"),
        (([1, 1, 1], True), r"cell: periodic: expected shape \(3\), found \(\)"),
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
