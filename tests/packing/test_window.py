"""The RV: what lies in it, its default place and size, and periodic faces."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from scanfab import Cell, Packing, SettingsError, box, sphere
from scanfab.packing.window import SurfaceBox, Window, inner_ellipsoid
from tests.helpers.lattices import ball_points, rotation

CELL = Cell([10.0, 8.0, 6.0], origin=(-1.0, 2.0, 3.0))
ONE = Packing([[0, 3, 4]], 1.0, cell=CELL)
SLAB = Packing([[0, 3, 4]], 1.0, cell=Cell([10.0, 80.0, 6.0], (True, False, True)))
ALL = np.ones(4, bool)
BALL = Window(np.array([-0.5, 2.5, 3.5]), sphere(1.0))
PLACES = np.array([[8.9, 2.5, 3.5], [-0.5, 9.8, 3.5], [-0.5, 2.5, 8.9], [4.5, 6.5, 6.5]])


def four_grains(**options):
    """Surfaces from -1 to 10.5 along x, 8.25 along y, 9 along z."""
    position = [[0, 0, 0], [10, 0, 0], [0, 8, 0], [0, 0, 8.75]]
    return Packing(position, [1.0, 0.5, 0.25, 0.25], **options)


def test_many_points_are_looked_at_some_at_a_time():
    """The 300,000th as the first."""
    rows = np.arange(300_000) % 4
    assert np.array_equal(BALL.contains(PLACES[rows], ONE), rows != 3)
    assert np.array_equal(BALL.may_meet(PLACES[rows], 0.1 * rows, ONE), rows != 3)


def test_distance_is_to_the_nearest_image():
    distance = np.linalg.norm(BALL.branches(PLACES, ONE), axis=1)
    assert distance == pytest.approx([0.6, 0.7, 0.6, np.sqrt(25 + 16 + 9)])


def test_window_must_not_meet_its_own_image():
    """It may lie across a face, and in another image of the cell."""
    for center, radius in (((4.0, 6, 6), 2.999), ((0.5, 6, 6), 1.6), ((40.0, 6, 6), 1.0)):
        Window(np.array(center), sphere(radius)).check_fits(ONE)
    with pytest.raises(SettingsError, match="overlaps its own image"):
        Window(np.array([4.0, 6, 6]), sphere(3.001)).check_fits(ONE)


def test_room_around_the_window_is_to_the_nearest_surface_that_is_no_periodic_face():
    window = Window(np.array([4.0, 4.0, 4.0]), sphere(3.0))
    beyond = Window(np.array([4.0, 4.0, 4.0]), sphere(6.0))
    # along y the surfaces lie at -1 and 8.25, along x and z farther away
    assert SurfaceBox.of(four_grains(), ALL).room_around(window) == pytest.approx(8.25 - 7)
    assert SurfaceBox.of(four_grains(), ALL).room_around(beyond) == pytest.approx(8.25 - 10)
    assert SurfaceBox.of(four_grains(cell=CELL), ALL).room_around(beyond) == np.inf


def test_a_window_as_data_is_looked_through_periodic_faces_too():
    """A box of which no code knows, about a corner of the cell."""
    window = Window(np.array([-1.0, 2.0, 3.0]), box([1.0, 2.0, 4.0]))
    points = np.array([[8.6, 2.9, 3.0], [8.4, 2.0, 3.0], [-1.0, 9.1, 7.1], [-1.0, 8.9, 3.0]])
    assert window.contains(points, ONE).tolist() == [True, False, True, False]
    assert window.may_meet(points, np.full(4, 0.15), ONE).tolist() == [True] * 4
    assert window.may_meet(points, np.full(4, 0.05), ONE).tolist() == [True, False, True, False]
    assert str(window) == "RV (box 1 x 2 x 4 about [-1.0, 2.0, 3.0])"


def test_a_rod_is_met_by_an_image_that_is_not_the_nearest():
    """It leans, so that the nearest image, beyond its other end, lies aside."""
    along = np.array([np.cos(0.15), np.sin(0.15), 0.0])
    turn = np.array([along, [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])
    center = np.array([5.0, 10.0, 10.0])
    packing = Packing([[0, 0, 0]], 0.5, cell=Cell([10.0, 20.0, 20.0]))
    for half, place in ((6.0, 5.56), (4.8, 5.1)):
        window = Window(center, box([2 * half, 0.02, 0.02], turn))
        point = (center + place * along)[None]
        assert point[0, 0] > 10.0
        assert window.may_meet(point, np.full(1, 0.5), packing).all()
        assert window.contains(point, packing).all() == (place < half)


def test_room_around_a_window_is_that_of_its_own_box():
    """Flat regions fit into flat samples, where the ball that holds them would not."""
    flat = box([8.0, 8.0, 1.0])
    flat.high = np.array([4.0, 4.0, 3.0])
    surfaces = SurfaceBox.of(Packing([[-4, -5, 0], [4.5, 5, 2.2]], 1.0), ALL[:2])
    assert surfaces.room_around(Window(np.zeros(3), flat)) == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("packing", "grains", "center", "extent"),
    [
        (four_grains(), [1, 1, 1, 1], [4.75, 3.625, 4.0], 9.25),
        (four_grains(), [1, 1, 0, 1], [4.75, 0.0, 4.0], 2.0),  # without one that is boundary
        (ONE, [1], [4.0, 6.0, 6.0], 6.0),
        # along y it is the grain: from 2 to 4
        (SLAB, [1], [5.0, 3.0, 3.0], 2.0),
    ],
)
def test_center_and_extent_are_those_of_the_surfaces_or_of_the_periodic_cell(
    packing, grains, center, extent
):
    surfaces = SurfaceBox.of(packing, np.array(grains, bool))
    assert surfaces.center == pytest.approx(center)
    assert surfaces.smallest_extent == pytest.approx(extent)


def test_that_of_a_stretched_and_turned_ball_is_stretched_and_turned_likewise():
    random = np.random.default_rng(0)
    points, turn = ball_points(random, 20_000, 10.0), rotation(random)
    stretched = points * [1.0, 1.5, 0.7] @ turn
    found = inner_ellipsoid(stretched, 0.0)
    form = found.shape.quadric.form / found.shape.quadric.level
    half = np.linalg.eigvalsh(form)[::-1] ** -0.5
    assert half == pytest.approx([7.0, 10.0, 15.0], rel=0.05)
    assert np.abs(turn @ form @ turn.T - np.diag(np.diag(turn @ form @ turn.T))).max() < 2e-4


def test_it_touches_the_hull_moved_inwards_by_the_largest_radius():
    random = np.random.default_rng(1)
    points = ball_points(random, 300, 5.0) * [1.0, 1.2, 0.8]
    found = inner_ellipsoid(points, 0.6)
    inverse = found.shape.quadric.level * np.linalg.inv(found.shape.quadric.form)
    facets = ConvexHull(points - found.center).equations
    # how far the ellipsoid reaches along each normal
    reach = np.sqrt(np.einsum("fi,ij,fj->f", facets[:, :3], inverse, facets[:, :3]))
    room = -facets[:, 3] - 0.6 - reach
    assert room.min() == pytest.approx(0.0, abs=1e-9)


def test_what_is_flat_or_small_has_none():
    points = np.random.default_rng(0).random((50, 3))
    for some in (np.zeros((0, 3)), np.zeros((3, 3)), points * [1.0, 1.0, 0.0], points):
        assert inner_ellipsoid(some, 1.0) is None
