"""Scenes and their views: what is known of grains and contacts, sections, camera, report."""

from unittest.mock import MagicMock

import numpy as np
import pytest

import scanfab
from scanfab.base.shapes import sphere
from scanfab.packing.window import Window
from scanfab.viz.figures.style import rounded_down
from scanfab.viz.meshes import contact_mesh, grain_mesh
from scanfab.viz.report.page import MOST_GRAINS, view_data
from scanfab.viz.scene import (
    Grains,
    Scene,
    grains_of,
    look_at,
    scene_of,
    section_lines,
)
from scanfab.viz.window3d import BOTTOM, SIZE, TOP, aim
from tests.helpers.lattices import simple_cubic
from tests.helpers.packed import sample_of
from tests.helpers.truth import SAMPLE_DATA


@pytest.fixture
def sample():
    """Five in a row, the last one is boundary."""
    position = [[0.0, 0, 0], [2, 0, 0], [4, 0, 0], [9, 0, 0], [6, 0, 0]]
    packing = scanfab.Packing(position, 1.0, contacts=[[0, 1], [1, 2], [2, 4]], id=[5, 6, 7, 8, 9])
    return sample_of(packing, [4])


WINDOW = Window(np.array([1.0, 0.0, 0.0]), sphere(2.5))
CELL = scanfab.Cell([10.0, 10.0, 10.0])


def test_grains_are_told_apart(sample):
    grains = grains_of(sample, WINDOW)
    assert grains.contacts.tolist() == [1, 2, 2, 0, 1]
    assert grains.rattler.tolist() == [True, False, False, True, False]
    assert grains.boundary.tolist() == [False] * 4 + [True]
    assert grains.in_window.tolist() == [True, True, False, False, False]
    assert not grains_of(sample, None).in_window.any()
    assert grains.body is None
    np.testing.assert_array_equal(grains.places, sample.packing.position)


def test_contacts_are_lines_between_centres_and_stay_short_through_a_face(sample):
    mesh = contact_mesh(sample, WINDOW)
    assert mesh.points.reshape(-1, 2, 3)[:, :, 0].tolist() == [[0, 2], [2, 4], [4, 6]]
    assert mesh["boundary"].tolist() == [False, False, True]
    assert mesh["in_window"].tolist() == [True, True, False]
    through = sample_of(
        scanfab.Packing([[0.5, 5, 5], [9.5, 5, 5]], 0.5, contacts=[[0, 1]], cell=CELL)
    )
    one, two = contact_mesh(through, None).points
    assert np.linalg.norm(two - one) == pytest.approx(1.0)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0.6, 0.0, 0.8)])
def test_a_section_lies_in_one_plane_and_in_the_window(sample, axis):
    scene = scene_of(sample, WINDOW)
    lines = section_lines(scene, axis)
    flat = lines.ends.reshape(-1, 3) - scene.center
    values = np.linalg.svd(flat, compute_uv=False)
    assert values[2] < 1e-9 * values[0]
    assert np.linalg.norm(flat, axis=1).max() < WINDOW.radius + 1e-9
    assert lines.void.any()


def test_a_section_cuts_periodic_images_too():
    """A crystal looks the same about each of its grains, also one at the corner of the cell."""
    sample = sample_of(scanfab.Packing(*simple_cubic(4), cell=scanfab.Cell([4.0, 4.0, 4.0])))
    middle, corner = (
        section_lines(scene_of(sample, Window(np.array(one), sphere(1.6))), (0, 0, 1))
        for one in ([2.5, 2.5, 2.5], [0.5, 3.5, 0.5])
    )
    np.testing.assert_allclose(np.sort(corner.length), np.sort(middle.length), atol=1e-9)
    assert corner.length[corner.void].max() < 1.6


def test_a_section_without_grains_is_no_error():
    nothing = sample_of(scanfab.Packing(np.zeros((0, 3)), 1.0))
    assert section_lines(scene_of(nothing, WINDOW), (0, 0, 1)).void.all()


def test_grains_of_clumps_have_their_numbers_and_places_and_are_seen_whole():
    """Two of them, one through the face x = 10, and a sphere alone."""
    position = [[9.6, 5, 5], [0.8, 5, 5], [4.0, 5, 5], [5.2, 5, 5], [2.6, 5, 5]]
    sample = sample_of(scanfab.Packing(position, 1.0, bodies=[3, 3, 8, 8, -1], cell=CELL))
    grains = grains_of(sample, Window(np.array([0.2, 5.0, 5.0]), sphere(0.1)))
    # for ParaView
    assert grain_mesh(grains)["body"].tolist() == [3, 3, 8, 8, -1]
    assert grains.contacts.tolist() == [1, 1, 1, 1, 2]
    assert grains.in_window.tolist() == [True, True, False, False, False]
    np.testing.assert_allclose(grains.places[:, 0], [10.2, 0.2, 4.6, 4.6, 2.6])
    # next to a window
    window = Window(np.array([4.7, 5.0, 5.0]), sphere(2.0))
    grains = scene_of(sample, window).grains
    assert len(np.unique(grains.position, axis=0)) == len(grains.position)
    first = grains.position[grains.body == 3]
    assert np.ptp(first[:, 0]) == pytest.approx(1.2)
    assert grains.in_window[grains.body == 8].all()
    assert not grains.in_window[grains.body == 3].any()


@pytest.mark.parametrize("shape", [(9, 1, 1), (1, 1, 9)])
def test_all_balls_are_in_the_picture_between_words_and_scale(shape):
    points = np.random.default_rng(0).uniform(-1, 1, (300, 3)) * shape + [5, 6, 7]
    plotter = MagicMock()
    aim(plotter, points, np.full(300, 0.1), np.array([0.0, 0.0, 1.0]), np.array([0.3, -1.0, 0.4]))
    (place, middle, upright), half = plotter.camera_position, plotter.camera.parallel_scale
    toward = (place - middle) / np.linalg.norm(place - middle)
    high, wide = (points - middle) @ upright, (points - middle) @ np.cross(upright, toward)
    assert (high + 0.1).max() <= (1 - 2 * TOP) * half + 1e-9
    assert (high - 0.1).min() >= (2 * BOTTOM - 1) * half - 1e-9
    assert np.abs(wide).max() + 0.1 <= half * SIZE[0] / SIZE[1]


def test_scales_are_round():
    for value, length in ((0.0129, 0.01), (0.49, 0.2), (0.5, 0.5), (7.0, 5.0), (1e-9, 1e-9)):
        assert rounded_down(value) == pytest.approx(length)


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_all_spheres_of_a_clump_have_its_shade():
    series = scanfab.read_series(SAMPLE_DATA / "liggghts_clumps", contacts="geometric")
    clumps = look_at(series, scanfab.Settings(), 2)
    data = view_data(clumps.scene, clumps.axis)
    body = clumps.sample.packing.bodies.number
    away = np.linalg.norm(clumps.scene.grains.places - clumps.scene.center, axis=1)
    numbers = body[np.argsort(away, kind="stable")].tolist()
    shades = [one[5] for one in data["spheres"]]
    assert len(set(zip(numbers, shades, strict=True))) == len(set(numbers))
    assert set(shades) == {0, 1, 2}
    assert len(data["shades"]) == 3


def test_a_large_sample_is_thinned():
    count = 3 * MOST_GRAINS
    position = np.random.default_rng(0).uniform(-1, 1, (count, 3))
    no = np.zeros(count, bool)
    grains = Grains(position, np.full(count, 0.01), np.arange(count), no * 1, no, no, no)
    data = view_data(Scene(grains, np.zeros(3), (sphere(1.0),)), (0, 0, 1))
    assert (len(data["spheres"]), data["left_out"]) == (MOST_GRAINS, 2 * MOST_GRAINS)
    assert max(abs(number) for sphere in data["spheres"] for number in sphere) <= 1000
    # spheres alone have no shades
    assert {len(sphere) for sphere in data["spheres"]} == {5}
    assert len(data["shades"]) == 1
