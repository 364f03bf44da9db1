"""Every gap equals that of the slow twin: by octant, by cut-off, with squares."""

import numpy as np
import pytest

from scanfab import Solids
from scanfab.scan.blocks import Blocks, partition_of
from scanfab.scan.kernels.strips import Bins
from scanfab.scan.lines import line_triads
from scanfab.scan.tallies import tally_triads
from tests.helpers import naive
from tests.helpers.lattices import rotation
from tests.helpers.windows import random_window
from tests.scan.kernels.test_axes import KINDS, overlapping, region

RUNS_OF_A_KIND = 30
REACH = 30.0


def fast_sums(line, centers, *, halves=True, variants="abcd"):
    """What the kernel adds up: shape (whole or window, set of solids, octant, bin, sum)."""
    spheres, removed, triad, offset, spacing, window, cutoffs = line
    partition = partition_of(*(Blocks.about(center, REACH) for center in centers))
    sums = np.zeros((1, 2, 2, 8 * len(cutoffs), 3))
    bins = Bins(partition._replace(halves=halves or None), np.array(cutoffs), sums)
    solids = Solids(*spheres, removed, region(window))
    tally_triads(solids, triad[None], offset[None], spacing, 0.0, variants, bins)
    return bins.sums.reshape(2, 2, 8, len(cutoffs), 3)


def slow_sums(line, centers):
    """The same from the list of all segments, each in the bin of the largest cut-off it reaches."""
    (position, radius), removed, triad, offset, spacing, window, cutoffs = line
    sums = np.zeros((2, 2, 8, len(cutoffs), 3))
    for which, solid in enumerate([np.ones(len(radius), bool), ~removed]):
        grid = position[solid], radius[solid], triad, offset, spacing, window
        for kind, segments in enumerate(naive.void_segments(*grid)):
            reached = naive.gap_sums(segments, Blocks.about(centers[kind], REACH), cutoffs)
            sums[kind, which] = reached
            sums[kind, which, :, :-1] -= reached[:, 1:]
    return sums


def check_random_packing(kind, random):
    """One packing of a kind, with random window, grid, cut-offs, octants and removed grains."""
    position, radius = kind(random)
    triad = line_triads(np.eye(3))[0] if random.random() < 0.2 else rotation(random)
    line = (
        (position + random.uniform(-0.5, 0.5, 3), radius),
        random.random(len(radius)) < random.choice([0.0, 0.3, 1.0]),
        triad,
        random.random(2),
        np.exp(random.uniform(np.log(0.4), np.log(2.5))),
        random_window(random),
        np.sort(random.uniform(0.003, 2.0, random.integers(1, 5))),
    )
    centers = random.uniform(-1.0, 1.0, (2, 3))
    slow = slow_sums(line, centers)
    # as octants, and as blocks of any number
    for halves in (True, False):
        fast = fast_sums(line, centers, halves=halves)
        assert np.array_equal(fast[..., 0], np.round(slow[..., 0]))
        np.testing.assert_allclose(fast, slow, rtol=1e-9, atol=1e-9)
    return slow[..., 0].sum(axis=3)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_binned_gaps_equal_the_slow_twin(kind):
    runs = [np.random.default_rng([seed, 7]) for seed in range(RUNS_OF_A_KIND)]
    found = sum(check_random_packing(kind, random) for random in runs)
    if kind.__name__ != "nothing":
        # whole and window, with and without the removed grains; every octant
        assert np.all(found.sum(axis=2) > 0)
        assert np.all(found.sum(axis=(0, 1)) > 0)


def check_only_what_is_wanted_is_added():
    random = np.random.default_rng(0)
    spheres = overlapping(random)
    removed = random.random(len(spheres.radius)) < 0.3
    line = spheres, removed, rotation(random), random.random(2), 0.3, 2.0, [0.0]
    centers = np.zeros((2, 3))
    every = fast_sums(line, centers)
    assert np.all(every.sum(axis=(2, 3, 4)) > 0)
    for variants in ("ab", "cd", "ac", "a", "d"):
        alone = fast_sums(line, centers, variants=variants)
        wanted = np.isin([["a", "b"], ["c", "d"]], list(variants))[..., None, None, None]
        np.testing.assert_allclose(alone, every * wanted, rtol=1e-9, atol=1e-12)
