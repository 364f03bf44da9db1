"""What is said of a series: each note once, at its first frame, and in the end its frames."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import scanfab
from scanfab import Packing
from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.pipeline.compute import compute_rows
from tests.helpers.lattices import shaken_cubic

SCAN = {"directions": 9, "spacing": "0.5rmin", "variants": "a", "contact_tolerance": 0.1}


def bed(stretch=(1.0, 1.0, 1.0), grow=1.0, apart=1.0):
    position, radius = shaken_cubic(np.random.default_rng(1), 5)
    return Packing(apart * position * stretch, grow * radius)


def told(packings, **options):
    """All messages, and those that are warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scanfab.compute(packings, **{**SCAN, **options})
    kinds = {kind: [str(one.message) for one in caught if issubclass(one.category, kind)]
             for kind in (ScanfabNote, ScanfabWarning)}  # fmt: skip
    return kinds[ScanfabNote], kinds[ScanfabWarning]


def test_a_warning_comes_once_and_its_frames_in_the_end():
    gas, dense = bed(apart=2.0), bed()
    _, found = told([dense, gas, gas, dense, gas], boundary=(), frames="1:")
    words = [one for one in found if "no contact at all" in one]
    assert [one.partition(":")[0] for one in words] == ["frame 1", "frames 1 to 2, 4"]
    assert words[1] == "frames 1 to 2, 4: as in frame 1, no contact at all by geometry"
    # nothing is said of a frame that nobody asked for
    _, found = told([gas, dense, dense], frames="1:")
    assert not any("no contact" in one for one in found)


def test_the_frames_are_told_too_if_the_run_is_stopped():
    rows = compute_rows([bed(apart=2.0)] * 3, scanfab.Settings(workers=1, **SCAN))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        next(rows)
        next(rows)
        rows.close()
    assert "frames 0 to 1: as in frame 0, no contact at all by geometry" in [
        str(one.message) for one in caught
    ]


@pytest.mark.parametrize("grow", [1.005, 1.02])
def test_grains_that_grow(grow):
    notes, _ = told([bed(), bed(grow=grow)])
    found = [one for one in notes if "1rmin" in one]
    assert bool(found) == (grow > 1.01)
    assert all("in frame 0" in one and "`reference`" in one for one in found)


def test_a_strain_that_nobody_measures():
    notes, _ = told([bed(), bed(stretch=(1, 1, 0.98))])
    assert any("column strain is empty" in one and 'strain="grains"' in one for one in notes)
    for options in ({"strain": "grains"}, {"frames": 0}):
        notes, _ = told([bed(), bed(stretch=(1, 1, 0.98))], **options)
        assert not any("strain is empty" in one for one in notes)


def test_a_loading_axis_across_the_fabric():
    """The bed is stretched along x and z, so that grains touch along y."""
    packing = bed(stretch=(1.15, 1, 1.15))
    notes, _ = told([packing])
    assert any('is along y: `axis="y"`' in one for one in notes)
    notes, _ = told([packing], axis="y")
    assert not any("loading axis" in one for one in notes)


def test_rows_of_few_grains():
    few = Packing([[0, 0, 0], [1.9, 0, 0], [0, 1.9, 0], [0, 0, 1.9]], 1.0)
    notes, _ = told([few, few], cutoff=0)
    found = [one for one in notes if "fewer than 10 grains" in one]
    assert [one.partition(",")[0] for one in found] == ["frame 0", "frames 0 to 1"]


def test_grains_off_the_plane_of_all_others_are_named():
    grid = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0)), -1).reshape(-1, 2)
    position = np.column_stack([grid, np.zeros(len(grid))])
    position[[7, 42], 2] = 0.1
    _, found = told([Packing(position, 0.5)])
    assert any("but those of 2 grains (id 7, 42)" in one for one in found)
    with pytest.raises(scanfab.PackingError, match=r"2 grains \(id 7, 42\).*`dim=3`"):
        Packing(position, 0.5, dim=2)
