"""Scans that cannot succeed, or only with effort: an answer or a reason, and always an end."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, compute
from tests.helpers.dumps import cubic_rows, dump_text, write


def test_target_out_of_reach_is_told_with_the_error_that_was_reached(ask, tmp_path):
    write(tmp_path / "dump_0.txt", dump_text(cubic_rows(), box=((0, 4),) * 3))
    words = ("--tolerance", "1e-9", "--max-chords", "1e6", "--cutoff", "0.1rmin")
    found = ask("compute", tmp_path, *words)
    assert "where the tolerance is 1e-09: the scan stopped after" in found.err
    assert " times as many lines would be needed: choose a larger --tolerance" in found.err
    assert all(float(row["alpha_vs_axial_se"]) > 1e-9 for row in found.rows)


@pytest.mark.filterwarnings("ignore:.*no contact at all by geometry")
def test_size_ratio_of_a_thousand():
    """Large grains apart in a dust of small ones: void is what the volumes leave."""
    random = np.random.default_rng(0)
    lattice = np.stack(np.meshgrid(*3 * [np.arange(4.0)]), axis=-1).reshape(-1, 3) * 3.0
    dust = random.uniform(0, 9, (3000, 3))
    dust = dust[np.linalg.norm(dust[:, None] - lattice, axis=2).min(axis=1) > 1.01]
    position = np.vstack([lattice, dust])
    radius = np.append(np.ones(len(lattice)), np.full(len(dust), 0.001))
    options = {"variants": "c", "tolerance": 1e-3, "cutoff": 0.5, "rv_radius": 4.0}
    row = compute(Packing(position, radius), **options)[0]
    assert row.alpha_vs_axial_se <= 1e-3
    inside = solid_in_ball(lattice - 4.5, 1.0, 4.0)
    assert row.solid_fraction == pytest.approx(inside, abs=0.01)


def solid_in_ball(position, radius, reach):
    """Fraction of a ball that spheres without overlap fill, by random points."""
    random = np.random.default_rng(1)
    points = random.uniform(-reach, reach, (400_000, 3))
    points = points[np.linalg.norm(points, axis=1) < reach]
    solid = np.zeros(len(points), bool)
    for center in position:
        solid |= np.linalg.norm(points - center, axis=1) < radius
    return solid.mean()


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
