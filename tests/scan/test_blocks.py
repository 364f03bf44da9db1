"""Blocks of every kind: a place's block, and the segments with their middle in each."""

from itertools import pairwise, product

import numpy as np
import pytest

from scanfab import Cell, direction_rule, scan_lines
from scanfab.base.shapes import sphere
from scanfab.scan.blocks import Blocks, partition_of
from scanfab.scan.edges import START
from scanfab.scan.kernels.strips import Bins
from scanfab.scan.scan import scan_gaps
from scanfab.scan.solids import Solids
from scanfab.scan.tallies import tally_triads
from tests.helpers import naive
from tests.helpers.lattices import poisson_spheres, rotation
from tests.helpers.scanning import solids_of
from tests.helpers.windows import random_window
from tests.scan.kernels.test_periodic import lines_of, random_medium
from tests.scan.test_edges import open_solids

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


def fast_sums(solids, blocks, triad, offset, spacing, variants="abcd"):
    """Sums of the variants, shape (V, B, C, 3), by the largest cut-off reached and above."""
    bins = Bins(partition_of(blocks, blocks), LEAST, np.zeros((1, 2, 2, len(blocks) * 2, 3)))
    tally_triads(solids, triad[None], offset[None], spacing, LEAST[0], variants, bins)
    sums = bins.sums.reshape(4, len(blocks), 2, 3)[["abcd".index(one) for one in variants]]
    sums[:, :, 0] += sums[:, :, 1]
    return sums


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


def check_window_and_whole(random):
    """Every segment of an overlapping packing is in the block of its middle, or in none."""
    spheres = poisson_spheres(random, 0.15, 2.5)
    window, removed = random_window(random), random.random(len(spheres.radius)) < 0.2
    triad, offset, spacing = rotation(random), random.random(2), 0.5
    solids = solids_of(spheres, window, removed)
    for blocks in some_blocks(random):
        fast = fast_sums(solids, blocks, triad, offset, spacing)
        for which, solid in enumerate([removed < 2, ~removed]):
            chosen = spheres.position[solid], spheres.radius[solid]
            found = naive.void_segments(*chosen, triad, offset, spacing, window)
            for kind, segments in enumerate(found):
                slow = naive.gap_sums(segments, blocks, LEAST)
                np.testing.assert_allclose(fast[2 * kind + which], slow, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_segments_are_in_the_block_of_their_middle(seed):
    check_window_and_whole(np.random.default_rng([seed, 3]))


def check_periodic_whole(random, periods):
    """The same of a periodic medium, of which middles lie in any image."""
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
        fast = fast_sums(solids, blocks, triad, offset, spacing, "a")[0]
        np.testing.assert_allclose(
            fast, naive.gap_sums(segments, blocks, LEAST), rtol=1e-9, atol=1e-9
        )


@pytest.mark.parametrize("periods", [(1, 1, 1), (1, 0, 1), (0, 0, 1)])
def test_segments_of_a_periodic_whole_are_in_the_block_of_their_middle(periods):
    for seed in range(3):
        check_periodic_whole(np.random.default_rng([seed, 5]), periods)


def check_start(random):
    """By the rule start, half of a segment is in the block of each end that is in the window."""
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
        fast = fast_sums(solids, blocks, triad, offset, spacing, "c")[0]
        np.testing.assert_allclose(
            fast, naive.gap_sums(segments, blocks, LEAST), rtol=1e-9, atol=1e-9
        )


@pytest.mark.parametrize("seed", range(3))
def test_by_the_rule_start_each_end_is_in_its_own_block(seed):
    check_start(np.random.default_rng([seed, 4]))


@pytest.mark.parametrize(("edge", "variants"), [("clip", "abcd"), ("start", "c"), ("ends", "c")])
def test_all_blocks_together_are_the_scan_of_the_same_lines(edge, variants):
    random = np.random.default_rng(6)
    spheres = poisson_spheres(random, 0.15, 4.0)
    solids = open_solids(*spheres, random.random(len(spheres.radius)) < 0.2, sphere(2.0), edge)
    blocks = Blocks(np.zeros(3), 14.0 * rotation(random), (5, 6, 3))
    blocks = blocks.moved(blocks.middles.mean(axis=0))
    words = {"spacing": 0.3, "replicates": range(3), "variants": variants}
    found = scan_gaps(solids, RULE, cutoffs=[0.1, 0.5], blocks=(blocks, blocks), **words)
    for place, cutoff in enumerate([0.1, 0.5]):
        sums = scan_lines(solids, RULE, cutoff=cutoff, **words)
        for variant in variants:
            length, number = (one.sum(axis=2) for one in found.in_blocks(variant, place))
            np.testing.assert_allclose(number, sums.kept(variant)[1], rtol=1e-12)
            np.testing.assert_allclose(length, sums.kept(variant)[0], rtol=1e-9)
    assert np.all(found.scan.chords > 0)
