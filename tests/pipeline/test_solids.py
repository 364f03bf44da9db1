"""A scan by hand, of what the public face gives: the numbers of compute()."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, PackingError, Sample, SettingsError, Window
from scanfab.packing.window import SurfaceBox
from tests.helpers.lattices import shaken_cubic

COUNT = 6
SPACING, CUTOFF = 0.2, 0.45
RULE = scanfab.direction_rule("lebedev:7")


def packing(periodic=False):
    spheres = shaken_cubic(np.random.default_rng(4), COUNT)
    cell = Cell([COUNT] * 3) if periodic else None
    kinds = {"type": np.where(spheres.position[:, 2] < 1, 2, 1)}
    return scanfab.find_contacts(
        Packing(spheres.position, spheres.radius, columns=kinds, cell=cell, step=30)
    )


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("variants", ["abcd", "b"])
@pytest.mark.parametrize("lines", [{"spacing": SPACING}, {"tolerance": 2e-3}])
def test_a_scan_by_hand_is_that_of_compute(periodic, variants, lines):
    """An auto scan is that of all its replicates, numbered from 0: none is drawn twice."""
    one = packing(periodic)
    if variants == "abcd" and "tolerance" in lines:
        variants = "cd"  # in an auto scan, the whole sample has lines of its own
    table = scanfab.compute(
        one, boundary="type=2", variants=variants, rv_radius=2.0, directions=RULE,
        cutoff=CUTOFF, seed=3, **lines,
    )  # fmt: skip
    sample = Sample(one, one.columns["type"] == 2)
    center = SurfaceBox.of(sample.packing, sample.gathered).center
    window = None if variants == "b" else Window(center, scanfab.sphere(2.0))
    solids = scanfab.solids_of(sample, window, variants=variants)
    if not periodic and "a" in variants:
        np.testing.assert_allclose(
            solids.position + solids.origin, one.position[sample.grains], atol=1e-14
        )
    replicates = table[0].replicates
    spacing = table[0].spacing * np.sqrt(replicates)
    sums = scanfab.scan_lines(
        solids, RULE, spacing=spacing, cutoff=CUTOFF, variants=variants,
        replicates=range(replicates), seed=3,
    )  # fmt: skip
    for row, tensor in zip(table, table.tensor("gvs"), strict=True):
        fabric = scanfab.void_fabric(sums.axes, RULE.weights, *sums.kept(row.variant))
        np.testing.assert_allclose(fabric.tensor.matrix, tensor, rtol=0, atol=1e-15)
        assert fabric.mean_length == pytest.approx(row.mean_length, rel=1e-14)


def test_wide_windows_and_missing_contacts_are_refused():
    """Without contacts nobody knows the rattlers."""
    sample = Sample(packing(periodic=True), np.zeros(COUNT**3, bool))
    with pytest.raises(SettingsError, match="overlaps its own image"):
        scanfab.solids_of(sample, Window([3.0, 3.0, 3.0], scanfab.sphere(3.1)))
    sample = Sample(Packing([[0, 0, 0]], 1.0), np.zeros(1, bool))
    with pytest.raises(PackingError, match=r"find_contacts\(packing\)"):
        scanfab.solids_of(sample)
