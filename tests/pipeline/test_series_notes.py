"""What is said of a series: each note once, at its first frame, and in the end its frames."""

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


def texts(caught, kind):
    return [str(one.message) for one in caught if issubclass(one.category, kind)]


def told(packings, kind=ScanfabNote, **options):
    """The notes, or the warnings, of a computation."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scanfab.compute(packings, **{**SCAN, **options})
    return texts(caught, kind)


def test_a_warning_comes_once_and_its_frames_in_the_end():
    gas, dense = bed(apart=2.0), bed()
    found = told([dense, gas, gas, dense, gas], ScanfabWarning, boundary=(), frames="1:")
    words = [one for one in found if "no contact at all" in one]
    assert [one.partition(":")[0] for one in words] == ["frame 1", "frames 1 to 2, 4"]
    assert words[1] == "frames 1 to 2, 4: as in frame 1, no contact at all by geometry"
    # nothing is said of a frame that nobody asked for
    found = told([gas, dense, dense], ScanfabWarning, frames="1:")
    assert not any("no contact" in one for one in found)


def test_the_frames_are_told_too_if_the_run_is_stopped():
    rows = compute_rows([bed(apart=2.0)] * 3, scanfab.Settings(workers=1, **SCAN))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        next(rows)
        next(rows)
        rows.close()
    said = "frames 0 to 1: as in frame 0, no contact at all by geometry"
    assert said in texts(caught, ScanfabWarning)


@pytest.mark.parametrize("grow", [1.005, 1.02])
def test_grains_that_grow(grow):
    notes = told([bed(), bed(grow=grow)])
    found = [one for one in notes if "1rmin" in one]
    assert bool(found) == (grow > 1.01)
    assert all("in frame 0" in one and "`reference`" in one for one in found)


def test_a_strain_that_nobody_measures():
    squeezed = [bed(), bed(stretch=(1, 1, 0.98))]
    said = [one for one in told(squeezed) if "column strain is empty" in one]
    assert 'strain="grains"' in said[0]
    for options in ({"strain": "grains"}, {"frames": 0}):
        assert not any("strain is empty" in one for one in told(squeezed, **options))


def test_a_loading_axis_across_the_fabric():
    """The bed is stretched along x and z, so that grains touch along y."""
    packing = bed(stretch=(1.15, 1, 1.15))
    assert any('of the contact fabric, y: choose `axis="y"`' in one for one in told([packing]))
    assert not any("loading axis" in one for one in told([packing], axis="y"))


def test_rows_of_few_grains():
    few = Packing([[0, 0, 0], [1.9, 0, 0], [0, 1.9, 0], [0, 0, 1.9]], 1.0)
    notes = told([few, few], cutoff=0)
    found = [one for one in notes if "fewer than 10 grains" in one]
    assert [one.partition(",")[0] for one in found] == ["frame 0", "frames 0 to 1"]


def test_grains_off_the_plane_of_all_others_are_named():
    grid = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0)), -1).reshape(-1, 2)
    position = np.column_stack([grid, np.zeros(len(grid))])
    position[[7, 42], 2] = 0.1
    found = told([Packing(position, 0.5)], ScanfabWarning)
    assert any("but those of 2 grains (id 7, 42)" in one for one in found)
    with pytest.raises(scanfab.PackingError, match=r"2 grains \(id 7, 42\).*`dim=3`"):
        Packing(position, 0.5, dim=2)
