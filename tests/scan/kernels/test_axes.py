"""A scan along an axis equals its slow twin on random packings of every awkward kind."""

import itertools
from unittest.mock import patch

import numpy as np
import pytest

from scanfab import Solids, sphere
from scanfab.base.jit import kernel
from scanfab.scan import tallies
from scanfab.scan.kernels import lists, strips
from scanfab.scan.kernels.grid import fill_order
from scanfab.scan.lines import line_triads
from scanfab.scan.solids import shortest_gap
from tests.helpers import naive
from tests.helpers.lattices import Spheres, ball_points, poisson_spheres, rotation
from tests.helpers.scanning import scan_triads, solids_of
from tests.helpers.windows import random_window

RUNS_OF_A_KIND = 60
# row by row, and over lists of chords
WAYS = (False, True)
# sums of a scan
SUMS = "segments", "lines", "length", "void", "line_length"


def by_lists(way):
    """Scan over lists of chords, or row by row, wherever either may be."""
    return patch.object(tallies, "FEW_LINES", np.inf if way else 0.0)


def scattered(random):
    return ball_points(random, 12, 3.0), random.uniform(0.2, 0.6, 12)


def overlapping(random):
    return poisson_spheres(random, 0.25, 1.5)


def size_ratio_fifty(random):
    count = 25
    return ball_points(random, count, 1.5), np.exp(random.uniform(np.log(0.03), np.log(1.5), count))


def nested(random):
    position, radius = scattered(random)
    inner = position[:6] + random.uniform(-0.1, 0.1, (6, 3))
    return np.concatenate([position, inner]), np.concatenate([radius, radius[:6] * 0.4])


def concentric(random):
    position, radius = scattered(random)
    return np.concatenate([position, position]), np.concatenate([radius, radius * 1.3])


def chains_of_three(random):
    start = ball_points(random, 5, 2.0)
    step = ball_points(random, 5, 1.0)
    position = np.concatenate([start, start + step, start + 2 * step])
    return position, random.uniform(0.4, 0.7, 15)


def covering_the_window(random):
    position, radius = scattered(random)
    return np.vstack([position, [0.1, 0, 0]]), np.append(radius, random.uniform(1.0, 5.0))


def nothing(random):
    return np.zeros((0, 3)), np.zeros(0)


def lattice_points(random):
    position = random.integers(-3, 4, (10, 3)) * 0.5
    return position, random.integers(1, 4, 10) * 0.25


KINDS = [scattered, overlapping, size_ratio_fifty, nested, concentric]
KINDS += [chains_of_three, covering_the_window, nothing, lattice_points]


def assert_fast_equals_naive(spheres, removed, triad, offset, spacing, cutoffs, window):
    """Numbers identical, lengths to rounding, of all four variants, row by row and over lists."""
    solids = solids_of(Spheres(*spheres), window, removed)
    line = triad, offset, spacing, window, np.maximum(cutoffs, shortest_gap(solids))
    every = naive.tallies(*spheres, *line)
    left = naive.tallies(*(part[~removed] for part in spheres), *line)
    for cutoff, *slow in zip(cutoffs, every, left, strict=True):
        # alone, an open whole is scanned by the kernel of a window
        for way, variants in itertools.product(WAYS, ("abcd", "ab")):
            with by_lists(way):
                sums = scan_triads(solids, triad[None], offset[None], spacing, cutoff, variants)
            for variant, tally in zip(variants, (*slow, *slow), strict=False):
                kind = "whole" if variant in "ab" else "window"
                for name in SUMS:
                    found = getattr(sums, name)[0, "abcd".index(variant), 0]
                    # an open whole has neither void nor length of its lines
                    expected = tally.get(f"{kind}_{name}", 0)
                    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9), name


def check_random_packing(kind, random):
    """One packing of a kind, with a random window, grid, cut-offs and removed grains."""
    position, radius = kind(random)
    window = random_window(random)
    spacing = np.exp(random.uniform(np.log(0.4), np.log(2.5)))
    if random.random() < 0.02:
        spacing *= 0.2
    axis = random.integers(0, 3)
    triad = line_triads(np.eye(3))[axis] if random.random() < 0.2 else rotation(random)
    spheres = position + random.uniform(-0.5, 0.5, 3), radius
    removed = random.random(len(radius)) < random.choice([0.0, 0.3, 1.0])
    grid = triad, random.random(2), spacing
    cutoffs = [0.0, random.uniform(0.01, 0.5), random.uniform(0.5, 2.0)]
    cutoffs += [2.0 * getattr(window, "reach", 0.0) + 1e-3]
    assert_fast_equals_naive(spheres, removed, *grid, cutoffs, window)


# kept on disk with the package's kernels, so that another body needs another name
@kernel
def sorted_order(values):
    order = np.empty(values.size + 2, np.int64)
    fill_order(values, order, np.empty(values.size + 3, np.int64))
    return order[: values.size]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_sweep_equals_the_slow_twin(kind):
    for seed in range(RUNS_OF_A_KIND):
        check_random_packing(kind, np.random.default_rng([seed, KINDS.index(kind)]))


def test_a_chord_that_reaches_back_past_the_last_gap():
    """Two grains with a gap, and a third whose middle is behind them but that covers the gap."""
    position = np.array([[0.0, 0, 0], [0, 0, 1.0], [0, 0, 1.05]])
    spheres = position, np.array([0.2, 0.2, 2.0])
    line = np.eye(3), np.array([0.3, 0.4]), 0.1
    assert_fast_equals_naive(spheres, np.zeros(3, bool), *line, [0.0, 0.3], 1.5)


def check_less_that_is_wanted(seed):
    """Each choice of what is counted is a loop of its own, and gives the same."""
    random = np.random.default_rng(seed)
    spheres = overlapping(random)
    removed = random.random(len(spheres.radius)) < 0.3
    solids = Solids(*spheres, removed, sphere(1.2))
    line = rotation(random)[None], random.random((1, 2)), 0.3, 0.2
    for way in WAYS:
        with by_lists(way):
            every = scan_triads(solids, *line)
            for variants in ("a", "b", "c", "d", "ab", "cd", "ac", "bd"):
                sums = scan_triads(solids, *line, variants)
                wanted = np.array([variant in variants for variant in "abcd"])[None, :, None]
                for name in SUMS:
                    expected = np.where(wanted, getattr(every, name), 0.0)
                    np.testing.assert_allclose(getattr(sums, name), expected, rtol=1e-12)


@pytest.mark.parametrize("way", WAYS)
def test_rows_that_fit_no_strip_are_cut(way):
    """A wide sample: more columns than a strip holds."""
    position = np.array([[-700.0, 0, 0], [0, 0, 0], [700, 0, 1], [0.5, 0, 5]])
    radius, line = np.array([3.0, 2, 3, 2]), (np.eye(3)[None], np.array([[0.3, 0.4]]), 0.05, 0.1)
    assert strips.MOST_LINES < 1400 / 0.05
    every, near = slice(None), [1, 3]
    with by_lists(way):
        both = [
            scan_triads(Solids(position[k], radius[k], radius[k] < 0, sphere(2.0)), *line)
            for k in (every, near)
        ]
    ends = both[0].lines[0, 0, 0] - both[1].lines[0, 0, 0]
    assert ends == pytest.approx(2 * np.pi * 9 / 0.05**2, rel=0.01)
    for name in ("length", "segments", "void", "line_length"):
        assert getattr(both[0], name) == pytest.approx(getattr(both[1], name))


def test_lists_that_are_full_are_swept_and_filled_again():
    """A column of many small grains: far more chords on a line than a list has room for."""
    random = np.random.default_rng(3)
    count = 1500
    position = random.uniform([-0.5, -0.5, -6.0], [0.5, 0.5, 6.0], (count, 3))
    spheres = position, random.uniform(0.1, 0.2, count)
    chords_per_line = np.pi * np.sum(spheres[1] ** 2)
    assert chords_per_line > 1.5 * lists.ROOM
    grid = np.eye(3), random.random(2), 0.2
    assert_fast_equals_naive(spheres, random.random(count) < 0.3, *grid, [0.0, 0.1], 5.0)


@pytest.mark.parametrize(
    "values",
    [
        [],
        [1.0],
        [2.0, 2.0, 2.0],
        np.random.default_rng(0).normal(size=1000),
        np.repeat([3.0, 1.0, 2.0], 500) + np.tile([0, 1e-16, 2e-16], 500),
        np.append(np.random.default_rng(1).random(2000) * 1e-9, 1e6),
    ],
)
def test_order_of_depths(values):
    values = np.array(values, dtype=float)
    order = sorted_order(values)
    assert sorted(order) == list(range(len(values)))
    assert np.all(np.diff(values[order]) >= 0)
