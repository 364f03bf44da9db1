"""What counts at the window's surface: each rule equals its slow twin, and has no bias."""

from itertools import product

import numpy as np
import pytest

import scanfab.scan.solids
from scanfab import Cell, Solids, direction_rule, sphere
from scanfab.scan.edges import EDGES, START
from scanfab.scan.kernels.grid import CellGrains
from scanfab.scan.lines import line_triads
from scanfab.scan.solids import margin_of, shortest_gap
from tests.helpers import naive
from tests.helpers.lattices import rotation
from tests.helpers.scanning import ratio, scan_triads
from tests.helpers.windows import random_window
from tests.scan.kernels.test_axes import KINDS

RUNS_OF_A_KIND = 15
# sums of a scan
SUMS = "length", "segments", "left_out", "void", "line_length", "lines"


@pytest.fixture
def narrow_margin(monkeypatch):
    """So that segments reach beyond what is listed often."""
    monkeypatch.setattr(scanfab.scan.solids, "MARGIN", 0.3)


def open_solids(position, radius, removed, window, edge):
    """Spheres about a window, and all of them around it."""
    around = CellGrains(position, radius, removed, np.eye(3), np.zeros(3, bool))
    return Solids(position, radius, removed, window, edge=edge, around=around)


def periodic_solids(cell, position, radius, removed, window, edge):
    """Images of grains about a window, and the grains, each once."""
    position, _ = cell.place(position)
    around = CellGrains(position, radius, removed, cell.vectors, np.array(cell.periodic))
    reach = radius + window.reach + margin_of(around)
    images, row = cell.images_near_origin(position, reach)
    return Solids(images, radius[row], removed[row], window, edge=edge, around=around)


def slow_sums(line_solids, triad, offset, spacing, window, cutoff, edge):
    """Of all lines of one axis that meet the window, in the order of SUMS."""
    total, most = np.zeros(6), int(window.reach / spacing) + 2
    places = np.array(list(product(range(-most, most + 1), repeat=2)))
    feet = (places + offset) * spacing @ triad[:2]
    enters, leaves = naive.within(window, feet, triad[2])
    for line in np.flatnonzero(enters < leaves):
        solids = line_solids(feet[line], triad[2])
        ends = enters[line], leaves[line]
        void = sum(naive.lengths(naive.gaps_within(solids, *ends)))
        total += *naive.edge_sums(solids, *ends, cutoff, edge), void, ends[1] - ends[0], 1
    return total


def assert_equals(sums, variant, expected):
    found = [getattr(sums, name)[:, "abcd".index(variant)].sum() for name in SUMS]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def check_open(kind, random, edge, choices=("cd",)):
    position, radius = kind(random)
    window = random_window(random) or sphere(2.0)
    position = position + random.uniform(-0.5, 0.5, 3)
    removed = random.random(len(radius)) < 0.3
    triad, offset = rotation(random), random.random(2)
    spacing, cutoff = random.uniform(0.3, 1.5), random.choice([0.0, random.uniform(0.01, 1.0)])
    solids = open_solids(position, radius, removed, window, edge)
    # 0 stands for what rounding leaves between surfaces that coincide
    words = triad, offset, spacing, window, max(cutoff, shortest_gap(solids)), edge
    expected = {}
    for variant, solid in (("c", removed < 2), ("d", ~removed)):

        def on_line(foot, direction, solid=solid):
            return naive.union(naive.chords(position[solid], radius[solid], foot, direction))

        # without any grain, all lines leave the sample by the rule start, and none is scanned
        scanned = edge != START or len(radius) > 0
        expected[variant] = slow_sums(on_line, *words) * scanned
    for variants in choices:
        sums = scan_triads(solids, triad[None], offset[None], spacing, cutoff, variants)
        for variant in variants:
            assert_equals(sums, variant, expected[variant])


@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_rules_equal_the_slow_twin_on_any_packing(kind, edge, narrow_margin):
    """Overlapping, nested, of unlike sizes; windows of any shape, at the sample's end, too."""
    for seed in range(RUNS_OF_A_KIND):
        check_open(kind, np.random.default_rng([seed, KINDS.index(kind)]), edge)


@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.parametrize("periodic", [(True, True, True), (True, False, True), (False, True, True)])
def test_rules_equal_the_slow_twin_in_tilted_cells(periodic, edge, narrow_margin):
    for seed in range(4):
        random = np.random.default_rng([seed, 5])
        cell = Cell([[4.0, 0, 0], [1.7, 3.5, 0], [-0.9, 1.2, 3.2]], periodic)
        position = random.uniform(0, 1, (14, 3)) @ cell.vectors
        radius = random.uniform(0.25, 0.6, 14)
        removed = random.random(14) < 0.2
        triad, offset = rotation(random), random.random(2)
        solids = periodic_solids(cell, position, radius, removed, sphere(1.2), edge)
        sums = scan_triads(solids, triad[None], offset[None], 0.4, 0.2, "cd")
        for variant, solid in (("c", removed < 2), ("d", ~removed)):

            def on_line(foot, direction, solid=solid, cell=cell, place=position, size=radius):
                words = place[solid], size[solid], cell.vectors, np.array(periodic)
                return naive.periodic_solids(*words, foot, direction, -70.0, 70.0)

            words = triad, offset, 0.4, sphere(1.2), 0.2, edge
            assert_equals(sums, variant, slow_sums(on_line, *words))


def of_poisson(edge, cutoff, packings=120):
    """Mean length in windows of six largest radii, of freely overlapping spheres."""
    length, number = [], []
    edge_length, density, rule = 26.0, 0.2, direction_rule("lebedev:5")
    triads, cell = line_triads(rule.axes), Cell([edge_length] * 3)
    for seed in range(packings):
        random = np.random.default_rng([seed, 9])
        count = random.poisson(density * edge_length**3)
        position, radius = edge_length * random.random((count, 3)), random.uniform(0.5, 1.5, count)
        solids = periodic_solids(cell, position, radius, radius < 0, sphere(9.0), edge)
        sums = scan_triads(solids, triads, random.random((len(rule), 2)), 1.2, cutoff, "c")
        length.append(sums.length[0, 2].sum())
        number.append(sums.segments[0, 2].sum())
    return ratio(np.array(length), np.array(number, dtype=float))


@pytest.mark.parametrize("edge", ["start", "ends"])
def test_poisson_spheres_have_their_mean_length_in_small_windows(edge):
    """ℓ = c + 1/β; clipped to the window it would be c + A1/(A0 + βA1)."""
    cutoff, window, beta = 0.5, 9.0, 0.2 * np.pi * 13 / 12
    a0 = 1 - cutoff**2 / (4 * window**2)
    a1 = 4 * window / 3 - cutoff + cutoff**3 / (12 * window**2)
    found = of_poisson(edge, cutoff)
    assert found.error < 6e-3 * (cutoff + 1 / beta)
    assert found.agrees(cutoff + 1 / beta, within=2e-2)
    # what clip misses is seen
    assert not found.agrees(cutoff + a1 / (a0 + beta * a1), within=1.0)


def test_a_segment_that_reaches_through_many_cells_is_followed():
    """One small grain in a long cell: nearly all segments leave the window, few the medium."""
    cell = Cell([[3.0, 0, 0], [0, 3.0, 0], [0, 0, 3.0]])
    position, radius = np.zeros((1, 3)), np.full(1, 0.5)
    triad, offset = np.eye(3), np.array([0.13, 0.29])
    window = sphere(1.3)
    solids = periodic_solids(cell, position, radius, radius < 0, window, "start")
    sums = scan_triads(solids, triad[None], offset[None], 0.1, 0.0, "c")
    # along z lines that meet the grain have segments of 3 - chord, whose two ends are inside
    length, number = (float(one.sum()) for one in sums.kept("c"))
    points = (np.arange(-20, 20) + offset[:, None]) * 0.1
    square = 0.25 - points[0][:, None] ** 2 - points[1] ** 2
    expected = 3.0 - 2.0 * np.sqrt(square[square > 0])
    assert number == len(expected)
    assert length == pytest.approx(expected.sum(), rel=1e-9)
    assert sums.left_out.sum() == 0.0
