"""Scans that cannot succeed, or only with effort: an answer or a reason, and always an end."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, compute, sphere
from scanfab.pipeline.state import cut_volumes


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
