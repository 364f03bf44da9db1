"""Discs in a plane: what is known in closed form, the naive twin, and planes that are alike."""

from itertools import product
from math import asin, pi, sqrt

import numpy as np
import pytest

from scanfab import Cell, Packing, Sample, Window, box, compute, ellipsoid, find_contacts, sphere
from scanfab.base.space import Space
from scanfab.fabric.void import void_fabric
from scanfab.pipeline.measurement import solids_of
from scanfab.scan.directions import DirectionRule, plane_rule
from scanfab.scan.lines import drawn_lines, turned_triads
from scanfab.scan.scan import scan_lines, sums_of
from scanfab.scan.solids import Solids
from scanfab.scan.tallies import tally_triads
from tests.helpers import naive
from tests.helpers.scanning import ratio

XY = Space(2)
WINDOWS = {
    "circle": sphere(4.0, XY),
    "box": box([7.0, 4.0], None, XY),
    "ellipse": ellipsoid([4.5, 2.5], None, XY),
}
ANGLES = (0.1, 0.9, 2.0, 2.7)


def flat(discs):
    """Discs (x, y, r) as solids have them."""
    x, y, r = np.array(discs, dtype=float).reshape(-1, 3).T
    return np.column_stack([x, y, 0 * x]), r


def solids_in(discs, window=None, removed=False):
    position, radius = flat(discs)
    return Solids(position, radius, np.full(len(radius), removed), window=window, space=XY)


def along(*angles):
    """A rule of these angles, which replicates do not turn."""
    axes = np.array([[np.cos(a), np.sin(a), 0.0] for a in angles])
    weights = np.full(len(axes), 1 / len(axes))
    return DirectionRule("these", axes, weights, None, turned=False, space=XY)


def mean_lengths(solids, rule, variant, **lines):
    """ℓ of each axis and its standard error over 32 replicates."""
    sums = scan_lines(solids, rule, variants=variant, replicates=range(32), **lines)
    return ratio(*sums.kept(variant))


def poisson(random, density, reach):
    count = random.poisson(density * (2 * reach) ** 2)
    place = random.uniform(-reach, reach, (count, 2))
    return np.column_stack([place, random.uniform(0.4, 0.8, count)])


@pytest.mark.parametrize("cutoff", [0.0, 0.7, 1.6])
def test_empty_circle(cutoff):
    """ℓ = (R²(π/2 - asin(c/2R)) + (c/2)√(R² - c²/4)) / √(R² - c²/4)."""
    solids = solids_in([], sphere(1.0, XY))
    found = mean_lengths(solids, along(*ANGLES), "c", spacing=0.005, cutoff=cutoff)
    h = sqrt(1 - cutoff**2 / 4)
    assert found.agrees((pi / 2 - asin(cutoff / 2) + cutoff / 2 * h) / h)


def test_discs_without_overlap_in_a_circle():
    """ℓ = (πR² - Σπr²)/(2R + Σ2r) in every direction, whatever the arrangement."""
    r = np.random.default_rng(3).uniform(0.3, 1.0, 25)
    discs = np.column_stack([2.0 * np.array(list(product(range(-2, 3), repeat=2))), r])
    solids = solids_in(discs, sphere(8.0, XY))
    found = mean_lengths(solids, along(*ANGLES), "c", spacing=0.01, cutoff=0.0)
    assert found.agrees((pi * 64 - np.sum(pi * r**2)) / (16 + np.sum(2 * r)))


@pytest.mark.parametrize(("distance", "cutoff"), [(2.0, 0.0), (2.0, 0.5), (3.0, 0.0), (3.0, 1.8)])
def test_two_discs_along_their_axis(distance, cutoff):
    """ℓ = d - (r² asin(h/r) - h√(r²-h²))/(r - √(r²-h²)), with h = min(r, (d - c)/2)."""
    discs = [(-distance / 2, 0.0, 1.0), (distance / 2, 0.0, 1.0)]
    found = mean_lengths(solids_in(discs), along(0.0), "a", spacing=0.002, cutoff=cutoff)
    h = min(1.0, (distance - cutoff) / 2)
    # lines at the height y leave d - 2√(r²-y²); those with at least c lie beyond √(r²-h²)
    root = sqrt(1 - h**2)
    assert found.agrees(distance - (asin(h) - h * root) / (1 - root))


@pytest.mark.parametrize("name", WINDOWS)
def test_an_empty_window_has_the_mean_chord_of_its_shape(name):
    """ℓ(n) = area / width; at the cut-off c its covariogram: c + g(c)/-g'(c)."""
    window = WINDOWS[name]
    rule = along(*ANGLES)
    for cutoff in (0.0, 1.0):
        shared, slope = window.overlap(rule.axes, cutoff)
        found = [fine_length(solids_in([], window), axis, cutoff) for axis in rule_triads(rule)]
        np.testing.assert_allclose(found, cutoff + shared / slope, rtol=1e-4)


def fine_length(solids, triad, cutoff, spacing=0.05, grids=400):
    """ℓ in a window along one axis, from grids that lie evenly between one another."""
    offsets = (np.arange(grids)[:, None] + 0.5) / grids
    triads = np.tile(triad, (grids, 1, 1))
    tallies = tally_triads(solids, triads, offsets, spacing, cutoff, "c")
    length, number = sums_of(triads[None], tallies[None], "c").kept("c")
    return length.sum() / number.sum()


@pytest.mark.parametrize("edge", ["clip", "start", "ends"])
def test_poisson_discs(edge):
    """ℓ = c + 1/β with β = 2ρ⟨r⟩; clipped to a window c + A1/(A0 + βA1)."""
    random, density, cutoff, found = np.random.default_rng(11), 0.6, 0.5, []
    window = sphere(5.0, XY)
    for _ in range(60):
        position, radius = flat(poisson(random, density, 25.0))
        packing = Packing(position, radius, dim=2)
        sample = Sample(find_contacts(packing), np.zeros(len(radius), bool))
        solids = solids_of(sample, Window(np.zeros(3), window), variants="c", edge=edge)
        words = {"spacing": 0.2, "cutoff": cutoff, "variants": "c", "replicates": range(2)}
        sums = scan_lines(solids, plane_rule(8, XY), **words)
        found.append([one.sum() for one in sums.kept("c")])
    value, error = ratio(*np.array(found).T)
    beta = density * 2 * 0.6
    expected = cutoff + 1 / beta
    if edge == "clip":
        shared, slope = window.overlap(np.eye(3)[:1], cutoff)
        expected = cutoff + shared[0] / (slope[0] + beta * shared[0])
    assert abs(value - expected) < 4 * error
    assert error < 0.02 * expected


def test_a_periodic_poisson_medium():
    """ℓ = c + 1/β, α about 0, and the solid fraction 1 - exp(-ρπ⟨r²⟩)."""
    random, density, edge = np.random.default_rng(4), 0.5, 60.0
    found = []
    for _ in range(6):
        count = random.poisson(density * edge**2)
        position, radius = random.uniform(0, edge, (count, 2)), random.uniform(0.4, 0.8, count)
        packing = Packing(position, radius, cell=Cell([edge, edge, 1.0]))
        (row,) = compute(packing, variants="a", cutoff=0.5, spacing=0.3, directions=32, workers=1)
        found.append([row.mean_length, row.solid_fraction, row.alpha_vs_axial])
    mean, error = np.mean(found, axis=0), np.std(found, axis=0, ddof=1) / sqrt(len(found))
    expected = [0.5 + 1 / (density * 1.2), 1 - np.exp(-density * pi * 1.12 / 3), 0.0]
    assert np.all(np.abs(mean - expected) < 4 * error)
    assert np.all(error < [0.03, 0.01, 0.005])


def assert_naive(solids, around, window, variants, spacing, cutoff, edge="clip"):
    """Each direction's length and number are those of the twin, which takes all discs around."""
    rule = along(*ANGLES)
    triads, offsets = turned_triads(rule, rule_triads(rule), 7, 0)
    tallies = tally_triads(solids, triads, offsets, spacing, cutoff, variants)
    sums = sums_of(triads[None], tallies[None], variants, edge)
    for d, angle in enumerate(ANGLES):
        # along the twin's u, which may point the other way
        shift = offsets[d, 0] * round(triads[d][0] @ [-np.sin(angle), np.cos(angle), 0.0])
        # b and d are scanned beside them, so that the kernels are those of other tests
        for variant in set("ac").intersection(variants):
            limit = window if variant == "c" else None
            words = (*around, angle, shift, spacing, cutoff, limit, edge)
            found = [one[0, d] for one in sums.kept(variant)]
            np.testing.assert_allclose(found, naive.plane_sums(*words), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", WINDOWS)
@pytest.mark.parametrize("cutoff", [0.0, 0.6])
def test_the_naive_twin_of_open_samples(name, cutoff):
    """Overlapping discs, by lines row by row and by lists: whole and window, to rounding."""
    discs = poisson(np.random.default_rng(5), 0.5, 6.0)
    solids = solids_in(discs, WINDOWS[name])
    for spacing in (0.05, 1.1):
        assert_naive(solids, flat(discs), WINDOWS[name], "abcd", spacing, cutoff)


@pytest.mark.parametrize("name", WINDOWS)
@pytest.mark.parametrize("edge", ["start", "ends"])
@pytest.mark.parametrize("tilt", [0.0, 3.0])
def test_the_naive_twin_of_edge_rules_in_periodic_cells(name, edge, tilt):
    """All discs with their images, from a cell that leans, too."""
    random = np.random.default_rng(6)
    vectors = np.array([[13.0, 0, 0], [tilt, 12.0, 0], [0, 0, 0.5]])
    position, radius = random.random((40, 3)) * [1, 1, 0] @ vectors, random.uniform(0.4, 0.9, 40)
    packing = Packing(position[:, :2], radius, cell=Cell(vectors))
    sample, middle = Sample(find_contacts(packing), np.zeros(40, bool)), np.array([5.0, 6.0, 0.0])
    solids = solids_of(sample, Window(middle, WINDOWS[name]), variants="cd", edge=edge)
    # images far enough for the longest segment
    shifts = np.array(list(product(range(-8, 9), range(-8, 9), [0]))) @ vectors
    around = (position - middle + shifts[:, None]).reshape(-1, 3), np.tile(radius, len(shifts))
    assert_naive(solids, around, WINDOWS[name], "cd", 0.4, 0.5, edge)
    periodic = (True, True, False)
    expected = naive.contacts(position, radius, vectors=vectors, periodic=periodic)
    assert len(sample.contacts) == len(expected)


def rule_triads(rule):
    """The triads of a rule that is not turned."""
    return drawn_lines(rule, 0, [0])[0][0]


def test_equal_steps_are_exact():
    """An isotropic ℓ has the tensor I/2 with two axes, and N serve harmonics to cos 2(N - 2)θ."""
    for count in (2, 3, 7):
        rule = plane_rule(count, XY)
        assert rule.bias < 1e-15
        assert rule.degree == 2 * count - 2
    for count, order in ((4, 2), (6, 4)):
        rule = plane_rule(count, XY)
        theta = np.arctan2(rule.axes[:, 1], rule.axes[:, 0])
        length = 1 + 0.3 * np.cos(2 * theta) + 0.2 * np.cos(2 * order * theta)
        ones = np.ones((1, count))
        fabric = void_fabric(rule.axes[None], rule.weights, length[None], ones, XY)
        assert np.isclose(fabric.tensor.axial((1, 0, 0)), 0.15, atol=1e-12)
        assert np.isclose(fabric.tensor.alpha, 0.15, atol=1e-12)


def turned_table(across, **options):
    """The same discs in another coordinate plane, with the axis turned along with them."""
    random = np.random.default_rng(9)
    place = random.random((300, 2)) * [16.0, 14.0]
    position = np.roll(np.column_stack([place, np.full(300, 0.25)]), across + 1, axis=1)
    vectors = np.roll(np.diag([16.0, 14.0, 0.7]), (across + 1, across + 1), axis=(0, 1))
    axis = np.roll([0.6, 0.8, 0.0], across + 1)
    cell = Cell(vectors) if options.pop("periodic") else None
    packing = Packing(position, random.uniform(0.3, 0.6, 300), cell=cell, dim=2)
    assert packing.space == Space(across)
    return compute(packing, axis=axis, tolerance=0.02, workers=1, **options)


@pytest.mark.parametrize(
    "options",
    [
        {"periodic": True, "variants": "abcd"},
        {"periodic": False, "variants": "abcd", "edge": "ends"},
        {"periodic": True, "variants": "cd", "edge": "start", "rv_shape": "ellipsoid"},
    ],
    ids=str,
)
def test_all_planes_are_alike(options):
    """x-y, y-z and z-x give the same numbers after relabelling; across the plane all is 0."""
    names = {2: ("xx", "yy", "xy"), 0: ("yy", "zz", "yz"), 1: ("zz", "xx", "xz")}
    tables = {across: turned_table(across, **options) for across in (2, 0, 1)}
    for across in (0, 1):
        for one, other in zip(tables[2], tables[across], strict=True):
            for name, value in one.items():
                # components and blocks have other names there
                if not {"gvs", "gc", "without", "half"} & set(name.split("_")):
                    if isinstance(value, float):
                        value = pytest.approx(value, rel=1e-9, abs=1e-12)
                    assert other[name] == value, name
            for prefix in ("gvs", "gc"):
                for mine, theirs in zip(names[2], names[across], strict=True):
                    found = one[f"{prefix}_{mine}"], other[f"{prefix}_{theirs}"]
                    assert found[0] == pytest.approx(found[1], rel=1e-12, abs=1e-15)
    for row in tables[2]:
        for name in ("zz", "xz", "yz"):
            assert row[f"gvs_{name}"] == row[f"gc_{name}"] == 0.0
        # quarters take the place of octants
        assert row["alpha_vs_axial_without_4"] is not None
        assert row["alpha_vs_axial_without_5"] is None
