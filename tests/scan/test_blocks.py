"""Blocks of every kind: a place's block, and every gap in the block of its middle, by cut-off."""

from functools import partial
from itertools import pairwise, product

import numpy as np
import pytest

from scanfab import Cell, direction_rule, scan_lines
from scanfab.base.shapes import sphere
from scanfab.scan.blocks import Blocks, partition_of
from scanfab.scan.edges import CLIP, EDGES, START
from scanfab.scan.kernels.strips import Bins
from scanfab.scan.lines import line_triads, turned_triads
from scanfab.scan.scan import scan_gaps
from scanfab.scan.solids import Solids
from scanfab.scan.tallies import tally_triads
from tests.helpers import naive
from tests.helpers.lattices import Spheres, poisson_spheres, rotation
from tests.helpers.scanning import solids_of
from tests.helpers.windows import random_window
from tests.scan.kernels.test_axes import KINDS, overlapping
from tests.scan.kernels.test_periodic import lines_of, random_medium
from tests.scan.test_edges import open_solids, periodic_solids

RUNS_OF_A_KIND = 30
RULE = direction_rule("lebedev:5")
TILTED = np.array([[5.0, 0, 0], [1.3, 4.0, 0], [-0.7, 0.9, 4.5]])
LEAST = np.array([0.02, 0.4])


def some_blocks(random, repeats=(False, False, False)):
    """A grid, slices and shells of a parallelepiped that holds part of a sample."""
    edges = TILTED @ rotation(random).T if random.random() < 0.7 else np.diag([4.0, 5.0, 3.5])
    corner = -0.5 * edges.sum(axis=0) + random.uniform(-0.5, 0.5, 3)
    grid = Blocks(corner, edges, (3, 2, 4), repeats)
    slices = Blocks(corner, edges, (1, 5, 1), repeats)
    radius = random.uniform(0.8, 1.0) * 0.5 * grid.heights @ np.array([0, 2, 0])
    shells = Blocks(corner, edges, (1, 1, 1), repeats, radius, 3)
    return grid, slices, shells, slices.finer()


@pytest.mark.parametrize(
    "repeats", [(False, False, False), (True, True, True), (True, False, True)]
)
def test_blocks_are_those_of_the_naive_twin(repeats):
    random = np.random.default_rng(1)
    places = random.uniform(-4, 4, (400, 3))
    for _ in range(5):
        for blocks in some_blocks(random, repeats):
            found = blocks.of(places)
            assert found.tolist() == [naive.block(place, blocks) for place in places]
            assert -1 <= found.min() < found.max() < len(blocks)
            if all(repeats) and not blocks.radius:
                assert found.min() == 0


def test_a_place_just_below_a_period_lies_in_the_last_block():
    blocks = Blocks(np.zeros(3), np.eye(3), (3, 1, 4), (True, True, True))
    assert blocks.of(np.full((1, 3), -1e-20)).tolist() == [11]


def test_a_finer_block_is_a_part_of_the_block_that_holds_it():
    random = np.random.default_rng(2)
    places = random.uniform(-3, 3, (500, 3))
    for blocks in some_blocks(random):
        fine, coarse = blocks.finer(), blocks.of(places)
        assert np.prod(blocks.splits) == 8
        # each finer block once, in the row of the block that holds it
        rows = blocks.by_part(np.arange(8 * len(blocks)))
        assert np.array_equal(np.sort(rows, axis=None), np.arange(8 * len(blocks)))
        inside = coarse >= 0
        assert np.all((rows[coarse[inside]] == fine.of(places)[inside, None]).any(axis=1))
        assert np.array_equal(fine.of(places) < 0, ~inside)
        both = blocks.by_part(np.stack([fine.volumes, 2 * fine.volumes]))
        np.testing.assert_allclose(both.sum(axis=-1), [blocks.volumes, 2 * blocks.volumes])


def test_the_longest_edge_is_split_first():
    for parts, splits in [((2, 1, 1), (2, 2, 2)), ((1, 1, 5), (4, 2, 1)), ((9, 1, 9), (1, 8, 1))]:
        assert Blocks(np.zeros(3), 4.0 * np.eye(3), parts).splits == splits


def test_volumes_middles_and_corners_are_those_of_the_places_inside():
    random = np.random.default_rng(3)
    for blocks in some_blocks(random):
        low, high = -6.0, 6.0
        found = blocks.of(random.uniform(low, high, (400_000, 3)))
        counted = np.bincount(found[found >= 0], minlength=len(blocks)) / 400_000
        np.testing.assert_allclose(counted * (high - low) ** 3, blocks.volumes, rtol=0.2)
        if not blocks.radius:
            np.testing.assert_allclose(blocks.corners.mean(axis=1), blocks.middles)


def test_octants_about_an_oblique_axis_have_it_as_one_of_their_axes():
    axis = np.array([0.6, 0.0, 0.8])
    blocks = Blocks.about(np.array([1.0, 2.0, 3.0]), 5.0, axis)
    places = np.random.default_rng(0).uniform(-2, 2, (200, 3))
    found = blocks.of(places + np.array([1.0, 2.0, 3.0]))
    assert set(found) == set(range(8))
    # the last four lie on the far side of the plane normal to the axis
    assert np.array_equal(found >= 4, places @ axis >= 0)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0, -1, 0)])
def test_octants_about_a_coordinate_are_those_of_the_coordinates(axis):
    center = np.array([0.1, 0.2, 0.3])
    places = np.random.default_rng(1).uniform(-2, 2, (100, 3))
    expected = (places >= center) @ [1, 2, 4]
    assert Blocks.about(center, 3.0, axis).of(places).tolist() == expected.tolist()


def fast_sums(solids, lines, blocks, cutoffs, variants="abcd"):
    """What the kernel adds up: shape (whole or window, set of solids, block, bin, sum)."""
    triad, offset, spacing = lines
    shape = 2, 2, max(map(len, blocks)), len(cutoffs), 3
    sums = np.zeros((1, 2, 2, shape[2] * shape[3], 3))
    bins = Bins(partition_of(*blocks), np.array(cutoffs), sums)
    tally_triads(solids, triad[None], offset[None], spacing, 0.0, variants, bins)
    return bins.sums.reshape(shape)


def assert_binned(fast, segments, blocks, cutoffs):
    """Each segment is in the block of its middle, in the bin of the largest cut-off it reaches."""
    slow = naive.gap_sums(segments, blocks, cutoffs)
    slow[:, :-1] -= slow[:, 1:]
    np.testing.assert_allclose(fast[: len(blocks)], slow, rtol=1e-9, atol=1e-9)
    assert not fast[len(blocks) :].any()


def check_random_packing(kind, random):
    """One packing of a kind, with random window, grid, cut-offs, blocks and removed grains."""
    position, radius = kind(random)
    position = position + random.uniform(-0.5, 0.5, 3)
    removed = random.random(len(radius)) < random.choice([0.0, 0.3, 1.0])
    window = random_window(random)
    cutoffs = np.sort(random.uniform(0.003, 2.0, random.integers(1, 5)))
    triad = line_triads(np.eye(3))[0] if random.random() < 0.2 else rotation(random)
    lines = triad, random.random(2), np.exp(random.uniform(np.log(0.4), np.log(2.5)))
    octants = [Blocks.about(random.uniform(-1.0, 1.0, 3), 30.0) for _ in "ac"]
    repeats = tuple(random.random(3) < 0.5)
    others = [some_blocks(random, repeats)[random.integers(4)] for _ in "ac"]
    solids = solids_of(Spheres(position, radius), window, removed)
    for which, solid in enumerate([removed < 2, ~removed]):
        found = naive.void_segments(position[solid], radius[solid], *lines, window)
        for both in (octants, others):
            fast = fast_sums(solids, lines, both, cutoffs)
            for kind, (segments, blocks) in enumerate(zip(found, both, strict=True)):
                assert_binned(fast[kind, which], segments, blocks, cutoffs)
    return fast_sums(solids, lines, octants, cutoffs)[..., 0].sum(axis=3)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_binned_gaps_equal_the_slow_twin(kind):
    runs = [np.random.default_rng([seed, 8]) for seed in range(RUNS_OF_A_KIND)]
    found = sum(check_random_packing(kind, random) for random in runs)
    if kind.__name__ != "nothing":
        # whole and window, with and without the removed grains; every octant
        assert np.all(found.sum(axis=2) > 0)
        assert np.all(found.sum(axis=(0, 1)) > 0)


def check_only_what_is_wanted_is_added():
    random = np.random.default_rng(0)
    spheres = overlapping(random)
    solids = solids_of(spheres, 2.0, random.random(len(spheres.radius)) < 0.3)
    octants = (Blocks.about(np.zeros(3), 30.0),) * 2
    of_lines = partial(fast_sums, solids, (rotation(random), random.random(2), 0.3), octants, [0.0])
    every = of_lines()
    assert np.all(every.sum(axis=(2, 3, 4)) > 0)
    for variants in ("ab", "cd", "ac", "a", "d"):
        wanted = np.isin([["a", "b"], ["c", "d"]], list(variants))[..., None, None, None]
        np.testing.assert_allclose(of_lines(variants), every * wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("periods", [(1, 1, 1), (1, 0, 1), (0, 0, 1)])
@pytest.mark.parametrize("seed", range(3))
def test_segments_of_a_periodic_whole_are_in_the_block_of_their_middle(seed, periods):
    """The middles lie in any image."""
    random = np.random.default_rng([seed, 5])
    medium, offset, spacing = random_medium(random, periods), random.random(2), 0.4
    normal = rotation(random)[0]
    feet, measured = lines_of(medium, normal, offset, spacing)
    grains = medium.position, medium.radius, medium.vectors, medium.periodic
    found = [naive.periodic_segments(*grains, foot, normal, measured) for foot in feet]
    segments = [one for line in found for one in line]
    cell = Cell(medium.vectors, tuple(map(bool, periods)))
    solids = Solids(np.zeros((0, 3)), np.zeros(0), np.zeros(0, bool), None, medium)
    triad = np.stack([*np.zeros((2, 3)), normal])
    corner = random.uniform(-1, 1, 3)
    grid = Blocks(corner, cell.vectors, (2, 3, 4), cell.periodic)
    radius = 0.5 * float(cell.heights.min())
    shells = Blocks(corner, cell.vectors, (1, 1, 1), cell.periodic, radius, 3)
    for blocks in (grid, shells):
        fast = fast_sums(solids, (triad, offset, spacing), (blocks, blocks), LEAST, "ab")
        assert_binned(fast[0, 0], segments, blocks, LEAST)


@pytest.mark.parametrize("seed", range(3))
def test_by_the_rule_start_each_end_is_in_its_own_block(seed):
    """Half of a segment is in the block of each end that is in the window."""
    random = np.random.default_rng([seed, 4])
    spheres, window = poisson_spheres(random, 0.12, 4.0), sphere(1.8)
    triad, offset, spacing = rotation(random), random.random(2), 0.4
    solids = open_solids(*spheres, spheres.radius < 0, window, START)
    segments = []
    for place in product(range(-6, 7), repeat=2):
        foot = spacing * (place + offset) @ triad[:2]
        enters, leaves = naive.within(window, foot, triad[2])
        solid = naive.union(naive.chords(*spheres, foot, triad[2]))
        for (_, low), (high, _) in pairwise(solid):
            ends = [end for end in (low, high) if enters < end < leaves]
            segments += [(high - low, foot + end * triad[2], 0.5) for end in ends]
    for blocks in some_blocks(random):
        fast = fast_sums(solids, (triad, offset, spacing), (blocks, blocks), LEAST, "cd")
        assert_binned(fast[1, 0], segments, blocks, LEAST)


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("edge", EDGES)
def test_all_blocks_together_are_the_scan_of_the_same_lines(edge, periodic):
    """At each of several cut-offs."""
    random = np.random.default_rng(6)
    spheres = poisson_spheres(random, 0.15, 4.0)
    removed = random.random(len(spheres.radius)) < 0.2
    make = partial(periodic_solids, Cell([8.0, 9.0, 10.0])) if periodic else open_solids
    # images of grains reach beyond the blocks, and an open whole has no rule `start`
    variants = "abcd" if edge == CLIP and not periodic else "cd"
    solids = make(*spheres, removed, sphere(2.0), edge)
    blocks = Blocks(np.zeros(3), 14.0 * rotation(random), (5, 6, 3))
    blocks = blocks.moved(blocks.middles.mean(axis=0))
    words = {"spacing": 0.3, "replicates": range(3), "variants": variants}
    cutoffs = [0.0, 0.1, 0.5]
    found = scan_gaps(solids, RULE, cutoffs=cutoffs, blocks=(blocks, blocks), **words)
    for place, cutoff in enumerate(cutoffs):
        sums = scan_lines(solids, RULE, cutoff=cutoff, **words)
        for variant in variants:
            length, number = (one.sum(axis=2) for one in found.in_blocks(variant, place))
            np.testing.assert_allclose(number, sums.kept(variant)[1], rtol=1e-12)
            np.testing.assert_allclose(length, sums.kept(variant)[0], rtol=1e-9)
    assert np.all(found.scan.chords > 0)


def test_octant_left_out_is_that_of_the_slow_twin():
    """The second moment too: Σ l² and Σ l of the segments with their middle elsewhere."""
    spheres = poisson_spheres(np.random.default_rng(0), 0.15, 4.0)
    octants, cutoffs = Blocks.about(np.zeros(3), 20.0), [0.0, 0.3, 0.8, 1.7]
    words = {"spacing": 0.8, "cutoffs": cutoffs, "blocks": (octants, octants), "replicates": [3]}
    gaps = scan_gaps(solids_of(spheres, 3.0), RULE, seed=5, **words)
    triads, offsets = turned_triads(RULE, line_triads(RULE.axes), 5, 3)
    _, window = naive.void_segments(*spheres, triads[2], offsets[2], 0.8, 3.0)
    sums = naive.gap_sums(window, octants, cutoffs)
    for place, block in product(range(len(cutoffs)), range(8)):
        rest = np.delete(sums[:, place], block, axis=0).sum(axis=0)
        for moment in (1, 2):
            over, under = gaps.kept("c", place, moment, without=block)
            assert (under[0, 2], over[0, 2]) == pytest.approx(tuple(rest[moment - 1 : moment + 1]))
