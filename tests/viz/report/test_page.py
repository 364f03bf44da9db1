"""The data of the view inside the page of a report."""

import numpy as np
import pytest

import scanfab
from scanfab.viz.report.page import MOST_GRAINS, view_data
from scanfab.viz.scene import Grains, Scene, look_at
from tests.helpers.truth import SAMPLE_DATA


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_all_spheres_of_a_clump_have_its_shade():
    series = scanfab.read_series(SAMPLE_DATA / "liggghts_clumps", contacts="geometric")
    clumps = look_at(series, scanfab.Settings(), 2)
    data = view_data(clumps.scene, clumps.axis)
    body = clumps.sample.packing.bodies.number
    away = np.linalg.norm(clumps.scene.grains.places - clumps.scene.center, axis=1)
    shades = {}
    for number, sphere in zip(body[np.argsort(away, kind="stable")], data["spheres"], strict=True):
        shades.setdefault(number, set()).add(sphere[5])
    assert max(len(found) for found in shades.values()) == 1
    assert set.union(*shades.values()) == {0, 1, 2}
    assert len(data["shades"]) == 3


def test_a_large_sample_is_thinned():
    count = 3 * MOST_GRAINS
    position = np.random.default_rng(0).uniform(-1, 1, (count, 3))
    no = np.zeros(count, bool)
    grains = Grains(position, np.full(count, 0.01), np.arange(count), no * 1, no, no, no)
    data = view_data(Scene(grains, np.zeros(3)), (0, 0, 1))
    assert (len(data["spheres"]), data["left_out"]) == (MOST_GRAINS, 2 * MOST_GRAINS)
    assert max(abs(number) for sphere in data["spheres"] for number in sphere) <= 1000
    # spheres alone have no shades
    assert {len(sphere) for sphere in data["spheres"]} == {5}
    assert len(data["shades"]) == 1
