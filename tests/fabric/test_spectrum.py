"""The void fabric that near contacts predict, against closed forms and against scans."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

import scanfab
from scanfab import Packing
from scanfab.base.space import SPACE, Space
from scanfab.fabric.predicted import LONGEST_GAP, predicted_alpha
from scanfab.packing.search import NearPairs
from scanfab.scan.directions import direction_rule

NAME = "alpha_vs_axial_contacts"


def isotropic_pairs(count=4000):
    """So many normals on a spiral over the sphere."""
    return np.asarray(direction_rule(f"fibonacci:{count}").axes)


def test_weak_overlap_of_a_second_order_density_gives_an_eighth():
    """|n·m| takes P2 of the normals' density to P2 times 1/8; α of ℓ (1 + e P2) is e/5."""
    normal = isotropic_pairs()
    weight = 1 + 0.3 * (1.5 * normal[:, 2] ** 2 - 0.5)
    # as many gaps as weights say are closed: in the overlap, which enters linearly
    overlap, reduced = 1e-4 * weight, np.full(len(normal), 0.25)
    closed = 2 * np.pi * 0.25 * 1e-4 * len(normal)
    pairs = NearPairs(normal, overlap, reduced, shadow=100 * closed, volume=1.0)
    expected = closed * 0.3 / 8 / (100 * closed - closed / 2) / 5
    assert predicted_alpha(pairs, 0.4, 0.0, (0, 0, 1)) == pytest.approx(expected, rel=5e-3)


def test_touching_pairs_give_their_second_order_and_no_fourth():
    """(n·m)² takes P2 to 2/15 and P4 to nothing: dα/dc at 0 is φ B₂ / (5 N²)."""
    normal = isotropic_pairs()
    second = 1.5 * normal[:, 2] ** 2 - 0.5
    fourth = (35 * normal[:, 2] ** 4 - 30 * normal[:, 2] ** 2 + 3) / 8
    for density, part in ((1 + 0.3 * second, 0.3 * 2 / 15), (1 + 0.3 * fourth, 0.0)):
        pairs = NearPairs(normal, np.zeros(len(normal)), 0.25 * density, 4e3, 1.0)
        cutoff, number, porosity = 1e-6, 4e3, 0.4
        added = 2 * np.pi * 0.25 * len(normal) * part
        expected = cutoff * added / number / 5
        found = predicted_alpha(pairs, porosity, cutoff, (0, 0, 1))
        assert found == pytest.approx(expected, rel=0.02, abs=1e-12)


@pytest.mark.parametrize("cutoff", [0.0, 0.1])
@pytest.mark.parametrize("space", [SPACE, Space(2)])
def test_a_pair_that_overlaps(space, cutoff):
    """It closes 2 |n·m| √(2 R* o) of gaps in a plane, 2π R* |n·m| o in space, o = δ + c |n·m|."""
    along = np.array([0.0, 1.0, 0.0])
    pairs = NearPairs(along[None], np.array([0.2]), np.array([0.25]), 1.0, 1.0, space)
    even = (np.arange(1000) + 0.5) / 1000
    cosine = np.sin(even * np.pi / 2) if space.is_plane else even
    upto = np.linspace(0.0, cutoff, 201)[:, None]
    overlap = 0.2 + upto * cosine
    closed = cosine * (np.sqrt(2 * overlap) if space.is_plane else 0.5 * np.pi * overlap)
    void = 0.2 - trapezoid(1 - closed, upto, axis=0)
    length = cutoff + void / (1 - closed[-1])
    expected = length @ space.axial(cosine**2) / length.sum()
    assert predicted_alpha(pairs, 0.2, cutoff, along) == pytest.approx(expected, rel=5e-3)


def test_it_stands_beside_the_sheared_sample():
    """A real, periodic run: without a cut-off within 15 % where there is anisotropy, as at 0.1."""
    series = scanfab.read_series("sample_data/liggghts_periodic")
    words = {"variants": "a", "tolerance": 2e-4, "frames": "::2"}
    table = scanfab.compute(series, cutoffs="0,0.1rmin,1rmin", **words)
    for row in table:
        smallest = table[2]["cutoff"]
        if row["cutoff"] > LONGEST_GAP * smallest:
            assert row[NAME] is None
        elif row["frame"] > 0:
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
