"""Lines through a periodic medium equal a slow twin with explicit images, and known answers."""

import numpy as np
import pytest

from scanfab import Solids
from scanfab.base.jit import kernel
from scanfab.scan.kernels import periodic, sweep
from scanfab.scan.kernels.grid import CellGrains
from scanfab.scan.lines import line_triads
from scanfab.scan.tallies import FollowedTooFarError, Following, tally_triads
from tests.helpers import naive
from tests.helpers.lattices import simple_cubic, unit_vectors
from tests.scan.kernels.test_axes import WAYS, by_lists

PERIODS = [(1, 1, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 0, 0), (0, 0, 1)]


def medium_of(position, radius, vectors, removed=False, periods=(1, 1, 1)):
    """Grains of radii of their own or of one, all of them solid unless some are removed."""
    position = np.array(position, dtype=float)
    radius, removed = (np.full(len(position), each) for each in (radius, removed))
    return CellGrains(position, radius, removed, vectors, np.array(periods, dtype=bool))


def random_cell(random):
    """Edges of unlike lengths, tilted by up to more than a length."""
    vectors = np.diag(random.uniform(1.5, 4.0, 3))
    vectors[1, 0], vectors[2, 0], vectors[2, 1] = random.uniform(-3.0, 3.0, 3)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    return vectors @ turn


def random_medium(random, periods=(1, 1, 1)):
    count = random.integers(1, 12)
    vectors = random_cell(random)
    position = random.uniform(-1, 2, (count, 3)) @ vectors
    radius = random.uniform(0.2, 0.9, count)
    return medium_of(position, radius, vectors, random.random(count) < 0.3, periods)


def sparse_medium(random, periods=(1, 1, 1)):
    """Gaps longer than what is listed at once; a large grain begins before small ones, aside."""
    vectors = 1.5 * random_cell(random)
    position = random.uniform(0, 1, (40, 3)) @ vectors
    radius = np.append(random.uniform(0.1, 0.2, 39), random.uniform(1.0, 2.0))
    return medium_of(position, radius, vectors, random.random(40) < 0.3, periods)


# kept on disk with the package's kernels, so that another body needs another name
@kernel
def grid_of(medium, triad, prism, offset, spacing):
    return periodic.cell_grid(medium, triad, prism, offset, spacing)[1]


def lines_of(medium, normal, offset, spacing):
    """Where the kernel's lines start, and how long they are measured (0: from end to end)."""
    triads = np.stack([*np.zeros((2, 3)), normal])[None]
    (triad,), section, prisms = periodic.prism_along(triads, medium, len(offset) == 1)
    prism = periodic.Prism(*(numbers[0] for numbers in prisms))
    grid = grid_of(medium, triad, prism, offset, spacing)
    feet = []
    for row in range(grid.rows):
        for column in range(grid.low[row], grid.high[row]):
            u = grid.first_u + column * grid.spacing
            v = grid.first_v + row * grid.spacing
            feet.append(np.array([u, v, section.quadric[0, 4:] @ [u, v]]) @ triad)
    measured = 1.0 / prism.climb[2] if prism.repeats[2] else 0.0
    return np.array(feet), measured


def tallies_of(medium, normal, offset, spacing, cutoff, most_steps=np.inf):
    solids = Solids(np.zeros((0, 3)), np.zeros(0), np.zeros(0, bool), medium=medium)
    triad = np.stack([*np.zeros((2, 3)), normal])[None]
    words = solids, triad, offset[None], spacing, cutoff, "ab"
    return tally_triads(*words, following=Following(most_steps))[0]


def check_equals_naive(random, periods, make=random_medium):
    medium, normal = make(random, periods), unit_vectors(random)
    offset, spacing, cutoff = random.random(2), random.uniform(0.3, 0.9), random.choice([0.0, 0.4])
    assert_equals_naive(medium, normal, offset, spacing, cutoff)


def assert_equals_naive(medium, normal, offset, spacing, cutoff):
    feet, measured = lines_of(medium, normal, offset, spacing)
    fast = []
    for way in WAYS:
        with by_lists(way):
            fast.append(tallies_of(medium, normal, offset, spacing, cutoff))
    for which, kept in enumerate([np.ones(len(medium.radius), bool), ~medium.removed]):
        grains = medium.position[kept], medium.radius[kept], medium.vectors, medium.periodic
        gaps = [naive.periodic_segments(*grains, foot, normal, measured) for foot in feet]
        lengths = [one.length for line in gaps for one in line]
        long_enough = [length for length in lengths if length >= max(cutoff, 1e-300)]
        for tally in fast:
            length = pytest.approx(sum(long_enough), rel=1e-9, abs=1e-9)
            assert tally[which, sweep.KEPT] == len(long_enough)
            assert tally[which, sweep.LENGTH] == length


@pytest.mark.parametrize("periods", PERIODS, ids=str)
@pytest.mark.parametrize(("make", "times"), [(random_medium, 5), (sparse_medium, 2)])
def test_gaps_equal_those_of_explicit_images(make, times, periods):
    for seed in range(times):
        check_equals_naive(np.random.default_rng([seed, *periods]), periods, make)


def test_a_large_grain_aside_does_not_end_a_gap_before_a_small_one():
    """It begins before what is listed ends, but on this line behind the small one, which is not."""
    fillers = [[4.0 + 0.4 * (k % 4), 3.0, 1.0 + 0.4 * (k // 4)] for k in range(36)]
    position = [[1.9, 0, 19.8], [1.9, 0, 3.6], [0, 0, 4.9], *fillers]
    radius = [0.15, 0.15, 2.0] + 36 * [0.15]
    medium = medium_of(position, radius, np.diag([6.0, 6.0, 20.0]))
    assert_equals_naive(medium, np.array([0.0, 0, 1]), np.array([0.8, 0.0]), 0.5, 0.0)


def test_lines_spread_evenly_over_the_face_and_fill_the_cell():
    """Number of lines times their measured length times the area of each: the cell's volume."""
    random = np.random.default_rng(1)
    for _ in range(8):
        medium, normal = random_medium(random), unit_vectors(random)
        volumes = []
        for _ in range(20):
            tally = tallies_of(medium, normal, random.random(2), 0.1, 0.0)[0]
            volumes.append(tally[sweep.LINE_LENGTH] * 0.1**2)
        volume = abs(np.linalg.det(medium.vectors))
        assert np.mean(volumes) == pytest.approx(volume, rel=0.02)


def test_every_direction_crosses_its_face_steeply():
    """So that a line leaves the cell after little more than its height."""
    random = np.random.default_rng(2)
    medium = medium_of(np.zeros((1, 3)), 1.0, np.diag([1.0, 2.0, 3.0]))
    triads = line_triads(unit_vectors(random, 50))
    _, _, prisms = periodic.prism_along(triads, medium, in_plane=False)
    assert (1.0 / prisms.climb[:, 2] <= np.sqrt(3) * 3.0 + 1e-9).all()


def test_simple_cubic_along_an_edge():
    """d - 4h/3 with h = min(r, (d - c)/2); lines in channels are counted."""
    medium = medium_of([[0.2, 0.7, 0.4]], 0.4, np.eye(3))
    normal = np.array([0.0, 0.0, 1.0])
    for cutoff in (0.0, 0.3, 0.5):
        tally = tallies_of(medium, normal, np.array([0.3, 0.8]), 0.004, cutoff)[0]
        height = min(0.4, (1 - cutoff) / 2)
        mean = tally[sweep.LENGTH] / tally[sweep.KEPT]
        assert mean == pytest.approx(1 - 4 / 3 * height, rel=2e-3)
        lines = tally[sweep.LINES] + tally[sweep.WHOLE + sweep.ASTRAY]
        assert tally[sweep.WHOLE + sweep.ASTRAY] / lines == pytest.approx(
            1 - np.pi * 0.4**2, rel=5e-3
        )


@pytest.fixture
def corner():
    """A thousand grains in an eighth of their cell."""
    position = simple_cubic(10).position
    position += np.random.default_rng(4).uniform(-0.2, 0.2, position.shape)
    return medium_of(position, 0.4, 20.0 * np.eye(3), np.arange(1000) % 5 == 0)


def test_following_ends_when_it_has_taken_the_steps_that_it_may(corner):
    line = np.array([0.48, 0.6, 0.64]), np.array([0.3, 0.4]), 0.5, 0.0
    every = tallies_of(corner, *line)[0, sweep.STEPS]
    assert every > 5000
    for most in (1, 500, 5000, every):
        with pytest.raises(FollowedTooFarError, match=r"^void segments that leave the cell"):
            tallies_of(corner, *line, most_steps=most)
    assert np.array_equal(
        tallies_of(corner, *line, most_steps=every + 1), tallies_of(corner, *line)
    )


def test_without_solids_all_lines_are_channels(corner):
    """At once: no line is followed to its end."""
    none = corner._replace(removed=np.ones(1000, bool))
    tally = tallies_of(none, np.array([0.48, 0.6, 0.64]), np.array([0.3, 0.4]), 0.5, 0.0)[1]
    assert tally[sweep.LINES] == tally[sweep.KEPT] == 0
    assert tally[sweep.VOID] == pytest.approx(tally[sweep.LINE_LENGTH])
    assert tally[sweep.WHOLE + sweep.ASTRAY] > 1000
