"""The whole of a periodic packing: the medium without an edge."""

import numpy as np
import pytest

from scanfab import Cell, Packing, ScanfabWarning, Solids, compute, direction_rule, scan_lines
from scanfab.scan.kernels.grid import CellGrains
from tests.helpers.scanning import ratio

LOOK = {"variants": "ab", "tolerance": 1.0, "contact_tolerance": 1e-4, "seed": 3}
CRYSTAL = {**LOOK, "variants": "a", "spacing": 1e-4, "directions": 60}
BASES = {
    "simple cubic": [[0, 0, 0]],
    "body-centred": [[0, 0, 0], [0.5, 0.5, 0.5]],
    "face-centred": [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]],
}
TOUCHING = {"simple cubic": 0.5, "body-centred": 3**0.5 / 4, "face-centred": 2**0.5 / 4}


def crystal(basis, radius):
    return Packing(0.01 * (np.array(basis) + 0.1), 0.01 * radius, cell=Cell(3 * [0.01]))


def sums_of(random, count, radius, removed, variants, **options):
    """A scan of grains at random places in a periodic cube."""
    grains = random.random((count, 3)), np.full(count, radius), removed
    medium = CellGrains(*grains, np.eye(3), np.ones(3, bool))
    solids = Solids(np.zeros((0, 3)), np.zeros(0), np.zeros(0, bool), None, medium)
    words = {"spacing": 0.1, "cutoff": 0.0, "variants": variants, **options}
    return scan_lines(solids, direction_rule("lebedev:5"), **words)


def loose(seed=4, count=150):
    """Grains in a tilted cell that overlap a little, some of them without contacts."""
    random = np.random.default_rng(seed)
    vectors = np.array([[5.0, 0, 0], [2.4, 4.5, 0], [-1.0, 0.7, 5.2]])
    return random.random((count, 3)) @ vectors, random.uniform(0.3, 0.6, count), vectors


def agree(one, other):
    """Within the standard errors of both scans; 4.5 of them, for all rows."""
    error = np.hypot(one["alpha_vs_axial_se"], other["alpha_vs_axial_se"])
    assert np.all(np.abs(one["alpha_vs_axial"] - other["alpha_vs_axial"]) < 4.5 * error)
    assert other["alpha_c"] == pytest.approx(one["alpha_c"])


@pytest.mark.parametrize("name", BASES)
def test_crystals_have_the_mean_length_of_stereology(name):
    """Without overlap, at cut-off 0: porosity / (N_V π r²). No length is absolute."""
    radius = 0.96 * TOUCHING[name]
    packing = crystal(BASES[name], radius)
    row = compute(packing, cutoff=0.0, **CRYSTAL)[0]
    count = len(BASES[name])
    porosity = 1 - count * 4 / 3 * np.pi * radius**3
    expected = 0.01 * porosity / (count * np.pi * radius**2)
    assert row.mean_length == pytest.approx(expected, rel=0.02)
    assert row.solid_fraction == pytest.approx(1 - porosity, rel=0.02)
    assert row.rattlers == count


def test_shifted_and_wrapped_grains_are_the_same_medium():
    position, radius, vectors = loose()
    options = {**LOOK, "tolerance": 2e-3}
    before = compute(Packing(position, radius, cell=Cell(vectors)), **options)
    turns = np.random.default_rng(1).integers(-2, 3, position.shape) @ vectors
    others = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 1]]) @ vectors
    for places, edges in (
        (position + np.array([3.3, -7.1, 2.2]), vectors),
        (position + turns, vectors),
        (position, others),
    ):
        after = compute(Packing(places, radius, cell=Cell(edges)), **options | {"seed": 11})
        agree(before, after)
        assert list(after["rattlers"]) == list(before["rattlers"])
        assert after["mean_length"] == pytest.approx(before["mean_length"], rel=0.01)
        assert after["solid_fraction"] == pytest.approx(before["solid_fraction"], abs=0.01)


def test_freely_overlapping_spheres_have_their_known_mean_length():
    """ℓ = c + 1/β for every cut-off, over many packings."""
    vectors = np.array([[10.0, 0, 0], [3.0, 10, 0], [2.0, -2.4, 12]])
    volume = abs(np.linalg.det(vectors))
    cutoffs, expected = np.array([0.0, 0.3, 0.8]), 1600
    beta = expected / volume * np.pi * (0.45**2 + 0.3**2 / 12)
    sums, counts = np.zeros(3), np.zeros(3)
    for seed in range(4):
        random = np.random.default_rng(seed)
        number = random.poisson(expected)
        position, radius = random.random((number, 3)) @ vectors, random.uniform(0.3, 0.6, number)
        lines = {"variants": "a", "spacing": 0.25, "directions": 9, "seed": seed}
        packing = Packing(position, radius, cell=Cell(vectors))
        table = compute(packing, cutoffs="0,0.3,0.8", **lines)
        sums += table["mean_length"] * table["segments"]
        counts += table["segments"]
    assert sums / counts - cutoffs == pytest.approx(np.full(3, 1 / beta), rel=0.03)


def test_lines_in_a_dilute_medium_meet_a_grain_at_last():
    """Porosity / (N_V π r²) at cut-off 0: 50 cells, far more than between near grains."""
    random, radius = np.random.default_rng(0), 0.02
    found = []
    for seed in range(60):
        sums = sums_of(random, 16, radius, np.zeros(16, bool), "a", replicates=[seed])
        found.append([values.sum() for values in sums.kept("a")])
        assert sums.channels.sum() < 0.05 * sums.line_length.sum()
    mean = ratio(*np.array(found, dtype=float).T)
    porosity = 1 - 16 * 4 / 3 * np.pi * radius**3
    assert mean.agrees(porosity / (16 * np.pi * radius**2), within=0.1)


def test_grains_that_are_removed_do_not_shorten_the_search():
    """One of thirty is left: the same segments, whether all thirty are scanned too or not."""
    grains = 30, 0.03, np.arange(30) > 0
    alone, beside = (
        sums_of(np.random.default_rng(1), *grains, names, replicates=range(3))
        for names in ("b", "ab")
    )
    assert alone.kept("b")[1].sum() > 0
    assert np.array_equal(alone.kept("b")[1], beside.kept("b")[1])
    assert np.array_equal(alone.channels[:, 1], beside.channels[:, 1])


def test_lines_in_channels_are_counted_in_a_warning():
    """Simple cubic along its edges, which the literal rules look along."""
    packing = crystal(BASES["simple cubic"], 0.3)
    with pytest.warns(ScanfabWarning, match="lines stay in a channel and meet no grain"):
        compute(
            packing, variants="a", directions="equal-angle-full:45", spacing=1e-3, cutoff=0.0,
            tolerance=10.0,
        )  # fmt: skip
