"""The void fabric that near contacts predict, against closed forms and against scans."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

import scanfab
from scanfab import Packing
from scanfab.base.space import SPACE, Space
from scanfab.fabric.predicted import LONGEST_GAP, predicted_alpha
from scanfab.packing.search import NearPairs

NAME = "alpha_vs_axial_contacts"


@pytest.mark.parametrize("cutoff", [0.0, 0.1])
@pytest.mark.parametrize("space", [SPACE, Space(2)])
def test_a_pair_that_overlaps_and_one_that_nearly_touches(space, cutoff):
    """Each closes 2 |n·m| √(2 R* o) of gaps in a plane, 2π R* |n·m| o in space, o = δ + c |n·m|."""
    along, overlaps = np.array([0.0, 1.0, 0.0]), np.array([0.2, -0.05])
    pairs = NearPairs(np.array([along, -along]), overlaps, np.full(2, 0.25), 3.0, 2.0, space)
    even = (np.arange(1000) + 0.5) / 1000
    cosine = np.sin(even * np.pi / 2) if space.is_plane else even
    upto = np.linspace(0.0, cutoff, 201)[:, None]
    overlap = np.maximum(overlaps[:, None, None] + upto * cosine, 0.0)
    each = cosine * (np.sqrt(2 * overlap) if space.is_plane else 0.5 * np.pi * overlap)
    number = (3.0 - each.sum(axis=0)) / 2.0
    length = cutoff + (0.4 - trapezoid(number, upto, axis=0)) / number[-1]
    expected = length @ space.axial(cosine**2) / length.sum()
    assert predicted_alpha(pairs, 0.4, cutoff, along) == pytest.approx(expected, rel=5e-3)


def test_it_stands_beside_the_sheared_sample():
    """A real, periodic run: without a cut-off within 15 % where there is anisotropy, as at 0.1."""
    series = scanfab.read_series("sample_data/liggghts_periodic")
    words = {"variants": "a", "tolerance": 2e-4, "frames": "2::2"}
    table = scanfab.compute(series, cutoffs="0,0.1rmin,1rmin", **words)
    for row in table:
        smallest = table[2]["cutoff"]
        if row["cutoff"] > LONGEST_GAP * smallest:
            assert row[NAME] is None
        else:
            error = row["alpha_vs_axial_se"]
            assert row[NAME] == pytest.approx(row["alpha_vs_axial"], rel=0.15, abs=3 * error)


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
def test_where_there_is_none():
    """Of an open whole no porosity is known; without cut-offs there is no column."""
    packing = Packing(np.stack(np.meshgrid(*3 * [np.arange(6.0)]), -1).reshape(-1, 3), 0.5)
    scan = {"contact_tolerance": 1e-6, "directions": 9, "spacing": 0.2, "variants": "ac"}
    table = scanfab.compute(packing, cutoffs="0", **scan)
    assert [row[NAME] is None for row in table] == [True, False]
    assert NAME not in scanfab.compute(packing, **scan).columns
    second = scanfab.compute(packing, cutoffs="0", moment=2, **scan)
    assert all(row[NAME] is None for row in second)
