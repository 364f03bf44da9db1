"""How much of a map's blocks lies in an RV, and so their solid fraction: closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from scanfab import Cell, Packing, Window, compute, fabric_map, find_contacts, sphere
from scanfab.base.shapes import box, cylinder
from scanfab.pipeline.maps.blocks import volumes_inside
from scanfab.scan.blocks import Blocks
from tests.helpers.lattices import shaken_cubic

CENTER = np.array([1.0, -2.0, 0.5])


def tiling(half, parts):
    """A box about the centre in equal parts."""
    half = np.asarray(half)
    return Blocks(CENTER - half, np.diag(2 * half), parts)


@pytest.mark.parametrize("slices", [1, 3, 5, 16])
def test_slices_of_a_ball_have_their_volume(slices):
    blocks = tiling([2.0, 2.0, 2.0], (1, 1, slices))
    found = volumes_inside(blocks, Window(CENTER, sphere(2.0)))
    z = np.linspace(-2, 2, slices + 1)
    below = np.pi * (4 * z - z**3 / 3)
    np.testing.assert_allclose(found.sum(axis=1), np.diff(below), rtol=5e-4)


@pytest.mark.parametrize("parts", [(1, 1, 1), (2, 2, 2), (3, 2, 1), (4, 5, 6)])
def test_a_grid_fills_its_window(parts):
    for half, shape, volume in [
        ([2.0, 2.0, 2.0], sphere(2.0), 32 / 3 * np.pi),
        ([1.0, 1.0, 1.5], cylinder(1.0, 3.0), 3 * np.pi),
        ([1.0, 2.0, 3.0], box([2.0, 4.0, 6.0]), 48.0),
    ]:
        blocks = tiling(half, parts)
        found = volumes_inside(blocks, Window(CENTER, shape))
        assert found.sum() == pytest.approx(volume, rel=1e-3)
        assert np.all(found <= blocks.volumes[:, None] / 8 * (1 + 1e-12))
        # blocks on opposite sides of the centre
        np.testing.assert_allclose(found.sum(axis=1), found.sum(axis=1)[::-1], rtol=1e-9)


def test_shells_end_at_the_surface_of_a_box():
    """The ball of radius 1 in a cube of edge 2 is whole; beyond its corners there is nothing."""
    reach = np.sqrt(3.0)
    blocks = replace(tiling([reach] * 3, (1, 1, 1)), radius=reach, shells=4)
    found = volumes_inside(blocks, Window(CENTER, box([2.0, 2.0, 2.0])))
    assert found.sum() == pytest.approx(8.0, rel=1e-3)
    within = 4 / 3 * np.pi * (reach * np.array([1, 2]) / 4) ** 3
    np.testing.assert_allclose(found[:2].sum(axis=1), np.diff(within, prepend=0.0), rtol=1e-9)
    np.testing.assert_allclose(found, found[:, :1].repeat(8, axis=1), rtol=1e-9)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
@pytest.mark.parametrize("kind", [{"slices": 5}, {"grid": (1, 1, 1)}, {"shells": 3}])
def test_the_solid_in_all_blocks_of_an_rv_is_what_is_in_the_rv(kind):
    position, radius = shaken_cubic(np.random.default_rng(0), 9, overlap=1.0)
    packing = find_contacts(Packing(position, radius, cell=Cell([9.0] * 3)))
    words = {"variants": "c", "rv": 0.8, "spacing": 0.1, "directions": "lebedev:11"}
    table = fabric_map(packing, **words, **kind)
    z = np.linspace(-1, 1, 6)
    volumes = {"slices": np.diff(3 * z - z**3), "grid": [1], "shells": np.diff([0, 1, 8, 27])}
    mean = np.average(table["solid_fraction"], weights=volumes[next(iter(kind))])
    assert mean == pytest.approx(compute(packing, **words)[0].solid_fraction, abs=2e-3)
