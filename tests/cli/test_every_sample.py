"""Clumps, discs, sizes far apart, and grains at one place."""

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, compute, sphere
from scanfab.pipeline.state import cut_volumes
from tests.helpers.truth import SAMPLE_DATA


def test_that_each_sphere_is_a_grain_can_be_said(ask):
    """Of spheres and discs that changes nothing; of clumps it does, and they are not told of."""
    words = ("--directions", "9", "--spacing", "1rmin", "--variants", "a", "--frames", ":1")
    words += ("--with", "state,invariants", "--contacts", "geometric")
    for source in ("liggghts_periodic", "lammps_discs", "liggghts_clumps/dump_*"):
        given = ask("compute", SAMPLE_DATA / source, *words)
        single = ask("compute", SAMPLE_DATA / source, *words, "--bodies", "id")
        has_clumps = "clumps" in source
        assert (single.out == given.out) != has_clumps
        assert not has_clumps or "clump" not in single.err.replace("liggghts_clumps", "")


@pytest.mark.filterwarnings("ignore:.*no contact at all by geometry")
def test_size_ratio_of_a_thousand():
    """Large grains apart in a dust of small ones: void is what the volumes leave."""
    random = np.random.default_rng(0)
    lattice = np.stack(np.meshgrid(*3 * [np.arange(4.0)]), axis=-1).reshape(-1, 3) * 3.0
    dust = random.uniform(0, 9, (3000, 3))
    dust = dust[np.linalg.norm(dust[:, None] - lattice, axis=2).min(axis=1) > 1.01]
    radius = np.append(np.ones(len(lattice)), np.full(len(dust), 0.001))
    options = {"variants": "c", "tolerance": 1e-3, "cutoff": 0.5, "rv_radius": 4.0}
    row = compute(Packing(np.vstack([lattice, dust]), radius), **options)[0]
    assert row.alpha_vs_axial_se <= 1e-3
    window = sphere(4.0)
    inside = cut_volumes(lattice - 4.5, np.ones(len(lattice)), window).sum() / window.volume
    assert row.solid_fraction == pytest.approx(inside, abs=0.01)


def test_many_grains_at_nearly_one_place_end_as_their_union():
    """2,000 grains within a hair of one another: whole, no gap; in the RV no void."""
    random = np.random.default_rng(2)
    position = random.normal(size=(2_000, 3)) * 1e-6
    packing = Packing(position, random.uniform(0.5, 1.5, 2_000), contacts=[[0, 1]])
    with pytest.warns(ScanfabWarning, match="no void segment reaches the cut-off"):
        rows = compute(packing, variants="ac", tolerance=1e-2)
    assert [row.segments for row in rows] == [0, 0]
    assert [row.alpha_vs for row in rows] == [None, None]
    assert rows[1].solid_fraction == pytest.approx(1.0)
