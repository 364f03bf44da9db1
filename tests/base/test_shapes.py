"""Polyhedra from surfaces: what is one, in whatever order and sense its triangles come."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from scanfab import SettingsError, box, polyhedron
from tests.helpers.lattices import rotation
from tests.helpers.windows import OF_A_BOX, box_by_corners, corners_of_a_box, hull_of

RANDOM = np.random.default_rng(5)
TURN = rotation(RANDOM)
HALF = np.array([0.5, 1.0, 1.7])
CORNERS = corners_of_a_box(HALF, TURN)


def test_a_box_by_its_corners_is_the_box():
    found, expected = box_by_corners(HALF, TURN), box(2 * HALF, TURN)
    assert found.planes.shape == (6, 4)
    order, same = (np.lexsort(np.round(one.planes, 6).T) for one in (found, expected))
    assert found.planes[order] == pytest.approx(expected.planes[same])
    assert found.volume == pytest.approx(expected.volume)
    assert found.reach == pytest.approx(expected.reach)
    assert (found.low, found.high) == (pytest.approx(expected.low), pytest.approx(expected.high))


@pytest.mark.parametrize("shift", [0.0, 1e3])
def test_the_sense_of_the_triangles_and_how_often_corners_are_listed_say_nothing(shift):
    triangles = np.array([RANDOM.permutation(one) for one in OF_A_BOX])
    soup = (CORNERS + shift)[triangles.ravel()]
    # as STL has it: three corners of its own for each triangle, 4 bytes a number
    shape, center = polyhedron(soup.astype(np.float32), np.arange(len(soup)).reshape(-1, 3))
    assert shape.planes.shape == (6, 4)
    assert shape.volume == pytest.approx(8 * HALF.prod(), rel=1e-6 + 2e-7 * shift)
    assert center == pytest.approx(np.full(3, shift), abs=1e-6 + 1e-7 * shift)
    # nor into how many triangles a face is cut: four about its middle
    middle = CORNERS[[0, 1, 3, 2]].mean(axis=0)
    fan = [[0, 1, 8], [1, 3, 8], [3, 2, 8], [2, 0, 8]]
    shape, _ = polyhedron(np.vstack([CORNERS, middle]), np.concatenate([OF_A_BOX[2:], fan]))
    assert shape.planes.shape == (6, 4)


def test_the_centroid_is_that_of_the_body():
    points = np.array([3.0, -4.0, 5.0]) + RANDOM.normal(size=(15, 3))
    shape, center = hull_of(points)
    hull = ConvexHull(points)
    inside = RANDOM.uniform(points.min(axis=0), points.max(axis=0), (200_000, 3))
    within = np.all(inside @ hull.equations[:, :3].T + hull.equations[:, 3] < 0, axis=1)
    assert np.array_equal(shape.contains(inside - center), within)
    assert center == pytest.approx(inside[within].mean(axis=0), abs=0.02)


# a corner pushed in, by little; and a hole in the middle
NOTCHED = np.vstack([CORNERS, 0.999 * CORNERS[0]]), np.where(OF_A_BOX == 0, 8, OF_A_BOX)
HOLLOW = np.vstack([CORNERS, 0.2 * CORNERS]), np.vstack([OF_A_BOX, OF_A_BOX + 8])


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        ((CORNERS, OF_A_BOX[1:]), "not closed, or not convex: .* 0.916667 times the volume"),
        (NOTCHED, "not closed, or not convex"),
        ((CORNERS * [1, 1, 0], OF_A_BOX), "encloses no volume"),
        ((CORNERS[:0], OF_A_BOX[:0]), "encloses no volume"),
        ((CORNERS, OF_A_BOX[:1]), "encloses no volume"),
        (HOLLOW, "not closed, or not convex: .* 1.008 times the volume"),
    ],
    ids=["open", "notched", "flat", "empty", "one triangle", "hollow"],
)
def test_what_is_no_convex_surface_is_refused_in_words(surface, words):
    with pytest.raises(SettingsError, match=words):
        polyhedron(*surface)


def test_a_surface_of_very_many_faces_is_refused():
    points = RANDOM.normal(size=(600, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    with pytest.raises(SettingsError, match="has 1196 faces, expected at most 1000"):
        hull_of(points)
