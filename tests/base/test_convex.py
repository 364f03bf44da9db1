"""Regions as data: what lies in them, what follows from them, and polyhedra from surfaces."""

import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from scanfab import SettingsError, box, cylinder, direction_rule, ellipsoid, polyhedron, sphere
from tests.helpers.lattices import rotation, unit_vectors
from tests.helpers.windows import (
    OF_A_BOX,
    box_by_corners,
    corners_of_a_box,
    cut_ball,
    hull_of,
    leaning,
)

RANDOM = np.random.default_rng(3)
POINTS = RANDOM.uniform(-2, 2, (2000, 3))
TURN = rotation(RANDOM)
HALF = np.array([0.5, 1.0, 1.7])
AXES = direction_rule("lebedev:11").axes
GRADIENT = np.eye(3) + RANDOM.uniform(-0.3, 0.3, (3, 3))

SHAPES = {
    "sphere": sphere(1.3),
    "box": box(2 * HALF, TURN),
    "cylinder": cylinder(0.8, 2.8, TURN[0]),
    "ellipsoid": ellipsoid(HALF, TURN),
    "polyhedron": hull_of(RANDOM.normal(size=(12, 3)))[0],
    "deformed sphere": sphere(1.2).deformed(GRADIENT),
    "deformed box": box(2 * HALF).deformed(GRADIENT),
    "deformed cylinder": cylinder(0.8, 2.8).deformed(GRADIENT),
    "deformed polyhedron": leaning(hull_of(RANDOM.normal(size=(12, 3)))[0], RANDOM),
}


ALONG, ACROSS = POINTS @ TURN[0], np.linalg.norm(np.cross(POINTS, TURN[0]), axis=1)
BACK = np.linalg.solve(GRADIENT, POINTS.T).T
LENGTH = np.linalg.norm(POINTS, axis=1)
INSIDE = {
    "sphere": (sphere(1.3), LENGTH < 1.3),
    "box": (box(2 * HALF), np.all(np.abs(POINTS) < HALF, axis=1)),
    "turned box": (box(2 * HALF, TURN), np.all(np.abs(POINTS @ TURN.T) < HALF, axis=1)),
    "cylinder": (cylinder(0.8, 2.8, TURN[0]), (np.abs(ALONG) < 1.4) & (ACROSS < 0.8)),
    "ellipsoid": (ellipsoid(HALF, TURN), np.sum((POINTS @ TURN.T / HALF) ** 2, axis=1) < 1),
    "cut ball": (cut_ball(1.5, TURN[0], 0.2), (LENGTH < 1.5) & (ALONG < 0.2)),
    "leaning box": (box(2 * HALF).deformed(GRADIENT), np.all(np.abs(BACK) < HALF, axis=1)),
    "deformed sphere": (sphere(1.2).deformed(GRADIENT), np.linalg.norm(BACK, axis=1) < 1.2),
}


@pytest.mark.parametrize(("region", "inside"), INSIDE.values(), ids=INSIDE)
def test_points_inside_are_those_of_the_definition(region, inside):
    assert 20 < inside.sum() < 1500
    assert np.array_equal(region.contains(POINTS), inside)
    assert np.all(np.linalg.norm(POINTS[inside], axis=1) <= region.reach)
    assert np.all((region.low <= POINTS[inside]) & (POINTS[inside] <= region.high))
    # a point on the surface is outside
    for radius in RANDOM.uniform(0.1, 9.0, 100):
        assert not sphere(radius).contains(np.array([[0.0, 0.0, radius]])).any()


def test_rounding_puts_no_point_on_the_axis_of_a_cylinder_outside():
    for axis in np.random.default_rng(1).normal(size=(50, 3)):
        region = cylinder(1.0, 4.0, axis)
        places = np.linspace(-1.9, 1.9, 20)[:, None] * axis / np.linalg.norm(axis)
        assert region.contains(places).all()
        assert region.may_meet(places, np.full(20, 0.1)).all()


@pytest.mark.parametrize("name", SHAPES)
def test_spheres_meet_a_region_whose_nearest_place_they_hold(name):
    """Of many places of the surface the nearest one is almost the nearest of all."""
    shape = SHAPES[name]
    axes = direction_rule("fibonacci:10000").axes
    axes = np.concatenate([axes, -axes])
    # by halving between a place inside and one outside
    inner, outer = np.zeros(len(axes)), np.full(len(axes), 2.0 * shape.reach)
    for _ in range(40):
        middle = 0.5 * (inner + outer)
        inside = shape.contains(axes * middle[:, None])
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    surface = axes * inner[:, None]
    points = RANDOM.uniform(-3, 3, (200, 3))
    points = points[~shape.contains(points)]
    nearest = np.array([np.linalg.norm(surface - one, axis=1).min() for one in points])
    assert np.all(shape.may_meet(points, nearest * 1.0001))
    # The nearest of these places is further away by half a step between two, at most. Besides
    # spheres that miss a region narrowly are kept, the more the longer it is.
    off = nearest > 0.08
    radius = (nearest[off] - 0.08) * (1.0 if shape.is_sphere else 0.25)
    assert not np.any(shape.may_meet(points[off], radius))
    # the box along x, y, z that holds it is the least
    assert shape.high == pytest.approx(surface.max(axis=0), rel=0.03)
    assert shape.low == pytest.approx(surface.min(axis=0), rel=0.03)
    assert np.all(surface <= shape.high + 1e-9)
    assert np.all(surface >= shape.low - 1e-9)
    reach = np.linalg.norm(surface, axis=1).max()
    assert reach <= shape.reach * (1 + 1e-9)
    assert shape.reach < (1.3 if "deformed" in name else 1.03) * reach


@pytest.mark.parametrize("radius", [-1, 0, math.inf, math.nan, "x"])
def test_a_sphere_has_a_radius_above_0(radius):
    with pytest.raises(SettingsError, match="radius: expected a length above 0, found"):
        sphere(radius)


@pytest.mark.parametrize("sizes", [(0, 1, 1), (1, 1), (1, 2, math.nan), (-1, 2, 3)])
@pytest.mark.parametrize("shape", [box, ellipsoid])
def test_a_box_and_an_ellipsoid_have_three_sizes_above_0(shape, sizes):
    name = "edges" if shape is box else "semi_axes"
    with pytest.raises(SettingsError, match=f"{name}: expected 3 lengths above 0, found"):
        shape(sizes)


def test_a_box_that_fills_a_period_meets_its_image_by_rounding_only():
    shift = np.array([0.0, 0.0, 4.0])
    assert not box([2.0, 3.0, 4.0]).meets_itself((1 - 1e-12) * shift)
    assert box([2.0, 3.0, 4.0]).meets_itself((1 - 1e-6) * shift)


def test_a_cylinder_has_an_axis():
    with pytest.raises(SettingsError, match="axis: expected a vector that is not 0"):
        cylinder(1.0, 2.0, (0, 0, 0))


SINE = np.sqrt(1 - (AXES @ TURN[0]) ** 2)
TUBE = np.pi * 0.64 * np.abs(AXES @ TURN[0]) + 2 * 0.8 * 2.8 * SINE
SHADE = np.pi * np.linalg.norm(AXES * HALF.prod() / HALF, axis=1)
BOOKS = {
    "sphere": (sphere(1.3), 4 / 3 * np.pi * 1.3**3, np.pi * 1.3**2 + 0 * SINE),
    "box": (box(2 * HALF), 8 * HALF.prod(), 4 * np.abs(AXES) @ (HALF.prod() / HALF)),
    "cylinder": (cylinder(0.8, 2.8, TURN[0]), np.pi * 0.64 * 2.8, TUBE),
    "ellipsoid": (ellipsoid(HALF), 4 / 3 * np.pi * HALF.prod(), SHADE),
}


@pytest.mark.parametrize(("shape", "volume", "shadow"), BOOKS.values(), ids=BOOKS)
def test_volume_and_projected_area_are_those_of_the_books(shape, volume, shadow):
    shared, area = shape.overlap(AXES, 0.0)
    assert shape.volume == pytest.approx(volume)
    assert shared == pytest.approx(np.full(len(AXES), volume))
    assert area == pytest.approx(shadow)
    finer = shape.overlap(direction_rule("lebedev:41").axes, 0.0)[1]
    assert shape.mean_shadow == pytest.approx(finer.mean(), 0.02)


@pytest.mark.parametrize("name", SHAPES)
def test_overlap_with_itself_is_what_points_say(name):
    """g by counting points in both; -g' is its slope, and 0 where both have come apart."""
    shape = SHAPES[name]
    points = RANDOM.uniform(shape.low, shape.high, (100_000, 3))
    points = points[shape.contains(points)]
    for length in (0.3, 1.0):
        shared, slope = shape.overlap(AXES, length)
        for n, g in zip(AXES[:6], shared, strict=False):
            share = shape.contains(points + length * n).mean()
            assert g == pytest.approx(share * shape.volume, abs=0.01 * shape.volume)
        more, less = (shape.overlap(AXES, length + step)[0] for step in (1e-5, -1e-5))
        assert slope == pytest.approx((less - more) / 2e-5, abs=1e-4)
    assert not np.any(shape.overlap(AXES, 2.1 * shape.reach))


@pytest.mark.parametrize("name", SHAPES)
def test_a_region_meets_itself_until_it_has_been_moved_off(name):
    shape = SHAPES[name]
    for n in AXES[:4]:
        # half way between where the overlap is something and where it is nothing
        low, high = 0.0, 2.1 * shape.reach
        for _ in range(25):
            middle = 0.5 * (low + high)
            apart = not shape.meets_itself(middle * n)
            low, high = (low, middle) if apart else (middle, high)
        points = shape.support(np.array([n, -n]))
        assert high <= (points[0] - points[1]) @ n + 1e-6
        assert shape.overlap(n[None], 0.99 * high)[0][0] > 0.0
        assert shape.overlap(n[None], 1.01 * high)[0][0] == 0.0


@pytest.mark.parametrize("name", SHAPES)
def test_a_deformed_region_keeps_its_share_of_the_volume(name):
    shape = SHAPES[name]
    changed = shape.deformed(GRADIENT)
    assert changed.volume == pytest.approx(shape.volume * np.linalg.det(GRADIENT))
    assert np.array_equal(changed.contains(POINTS @ GRADIENT.T), shape.contains(POINTS))
    assert shape.deformed(np.eye(3)) is shape
    # its outline has the volume of the region
    assert ConvexHull(shape.outline).volume == pytest.approx(shape.volume, rel=6e-3)


CORNERS = corners_of_a_box(HALF, TURN)


def test_a_box_by_its_corners_is_the_box():
    found, expected = box_by_corners(HALF, TURN), box(2 * HALF, TURN)
    assert found.planes.shape == (6, 4)
    order, same = (np.lexsort(np.round(one.planes, 6).T) for one in (found, expected))
    assert found.planes[order] == pytest.approx(expected.planes[same])
    a, b, c = 2 * HALF
    # Cauchy: a quarter of the surface
    assert found.mean_shadow == pytest.approx((a * b + b * c + c * a) / 2, rel=1e-3)


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
        (HOLLOW, "not closed, or not convex: .* 1.008 times the volume"),
    ],
    ids=["open", "notched", "flat", "empty", "hollow"],
)
def test_what_is_no_convex_surface_is_refused_in_words(surface, words):
    with pytest.raises(SettingsError, match=words):
        polyhedron(*surface)


def test_a_surface_of_very_many_faces_is_refused():
    with pytest.raises(SettingsError, match="has 1196 faces, expected at most 1000"):
        hull_of(unit_vectors(RANDOM, 600))
