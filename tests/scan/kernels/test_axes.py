"""A scan along an axis equals its slow twin on random packings of every awkward kind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from scanfab.base.convex import Convex
from scanfab.base.jit import LANES
from scanfab.base.shapes import sphere
from scanfab.scan.kernels import axes, lists, strips, sweep
from scanfab.scan.kernels.bins import no_bins
from scanfab.scan.kernels.edges import CLIPPED
from scanfab.scan.kernels.grid import cover, strip_of
from scanfab.scan.kernels.projection import order_of, project, range_of
from scanfab.scan.kernels.windows import section_along
from scanfab.scan.lines import line_triads
from scanfab.scan.solids import clip_of
from tests.helpers import naive
from tests.helpers.lattices import ball_points, poisson_spheres, rotation
from tests.helpers.uncompiled import run_uncompiled
from tests.helpers.windows import random_window

RUNS_OF_A_KIND = 300
# row by row, and over lists of chords
WAYS = (False, True)


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


KINDS = [
    scattered,
    overlapping,
    size_ratio_fifty,
    nested,
    concentric,
    chains_of_three,
    covering_the_window,
    nothing,
    lattice_points,
]


def line_words(spheres, removed, triad, offset, spacing):
    """What kernels want to know of spheres and the lines along one axis."""
    return (
        np.ascontiguousarray(spheres[0], dtype=float),
        np.asarray(spheres[1], dtype=float),
        removed,
        np.ascontiguousarray(triad[None]),
        offset[None],
        spacing,
    )


def region(window):
    """A window as a scan takes it, from a region, the radius of a sphere, or 0 for none."""
    if isinstance(window, Convex):
        return window
    return sphere(window) if window else None


def fast_tallies(
    spheres,
    removed,
    triad,
    offset,
    spacing,
    cutoff,
    window,
    *,
    by_lists=False,
    whole=True,
    clipped=True,
    second=True,
):
    """What the kernel tallies with all spheres, and with those that are not removed."""
    tallies = np.zeros((1, 2, sweep.TALLY_SIZE))
    axes.scan_axes(
        *line_words(spheres, removed, triad, offset, spacing),
        cutoff,
        clip_of(region(window)),
        tallies,
        by_lists,
        second or None,
        whole or None,
        CLIPPED if clipped else None,
        no_bins(1),
        None,
        False,
        np.inf,
    )
    return named(tallies[0, 0]), named(tallies[0, 1])


def named(tally):
    """The twin's names for the entries of a tally."""
    whole, window = tally[sweep.WHOLE :], tally[sweep.WINDOW :]
    return naive.Tally(
        *whole[[sweep.LENGTH, sweep.KEPT, sweep.LINES]],
        *window[[sweep.LENGTH, sweep.KEPT, sweep.LINES, sweep.VOID, sweep.LINE_LENGTH]],
    )


def assert_equal(fast, slow):
    """Numbers identical, lengths to rounding."""
    for name in ("whole_kept", "whole_lines", "window_kept", "window_lines"):
        assert getattr(fast, name) == getattr(slow, name), name
    for name in ("whole_length", "window_length", "window_void", "window_line_length"):
        assert getattr(fast, name) == pytest.approx(getattr(slow, name), rel=1e-9, abs=1e-9), name


def assert_fast_equals_naive(spheres, removed, triad, offset, spacing, cutoffs, window):
    position, radius = spheres
    subsets = [
        naive.scan(position, radius, triad, offset, spacing, window),
        naive.scan(position[~removed], radius[~removed], triad, offset, spacing, window),
    ]
    for cutoff in cutoffs:
        for by_lists in WAYS:
            line = removed, triad, offset, spacing, cutoff, window
            fast = fast_tallies(spheres, *line, by_lists=by_lists)
            for one, gaps in zip(fast, subsets, strict=True):
                assert_equal(one, naive.tally(gaps, cutoff))


def check_random_packing(kind, random):
    """One packing of a kind, with a random window, grid, cut-offs and removed grains."""
    position, radius = kind(random)
    window = random_window(random)
    spacing = np.exp(random.uniform(np.log(0.4), np.log(2.5)))
    if random.random() < 0.02:
        spacing *= 0.2
    axis = random.integers(0, 3)
    triad = line_triads(np.eye(3))[axis] if random.random() < 0.2 else rotation(random)
    assert_fast_equals_naive(
        (position + random.uniform(-0.5, 0.5, 3), radius),
        random.random(len(radius)) < random.choice([0.0, 0.3, 1.0]),
        triad,
        random.random(2),
        spacing,
        [
            0.0,
            random.uniform(0.01, 0.5),
            random.uniform(0.5, 2.0),
            2.0 * (region(window).reach if window else 0.0) + 1e-3,
        ],
        window,
    )


@njit
def closed_lines(position, radius, triad, grid, clip):
    """How many lines of one strip the sweep of all spheres leaves to be solved again."""
    projected = project(position, radius, np.zeros(radius.size, np.bool_), triad, grid, 0.0, None)
    pitch = grid.columns + LANES
    strip = strip_of(grid, 0, grid.rows, pitch)
    state, tally = np.empty(strips.STATE_SIZE), np.zeros((2, sweep.TALLY_SIZE))
    every = np.arange(projected.u.size)
    section = section_along(clip, triad)
    strips.begin(state, strip, section, None, True, CLIPPED)

    axes.visit_all(
        state, strip, projected, every, section, 1e-300, tally, None, True, CLIPPED, None
    )
    return sweep.settle(state, strip, 0, 1e-300, tally, True, CLIPPED, None)


@njit
def square_grid(reach, offset, spacing):
    return cover(-reach, reach, -reach, reach, offset, spacing)


def suspect_lines(spheres, triad, offset, spacing, window):
    """How many lines about the packing the sweep leaves to be solved again."""
    position, radius = spheres
    reach = np.linalg.norm(position, axis=1).max() + radius.max() + window
    grid = square_grid(reach, offset, spacing)
    assert grid.rows * (grid.columns + LANES) <= strips.MOST_LINES
    triad = np.ascontiguousarray(triad)
    return closed_lines(position, radius, triad, grid, clip_of(sphere(window)))


@njit
def sorted_order(values):
    return order_of(values, *range_of(values))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_sweep_equals_the_slow_twin(kind):
    for seed in range(RUNS_OF_A_KIND):
        check_random_packing(kind, np.random.default_rng([seed, KINDS.index(kind)]))


@given(
    grains=st.lists(
        st.tuples(*3 * [st.integers(-8, 8)], st.integers(1, 12), st.booleans()), max_size=12
    ),
    axis=st.tuples(*3 * [st.integers(-3, 3)]).filter(any),
    seed=st.integers(0, 2**32 - 1),
    cutoff=st.floats(0.0, 4.0),
    window=st.floats(0.25, 3.0),
    spacing=st.floats(0.4, 3.0),
)
@settings(max_examples=300, deadline=None, derandomize=True)
def test_sweep_equals_the_slow_twin_for_any_grains(grains, axis, seed, cutoff, window, spacing):
    table = np.array(grains, dtype=float).reshape(-1, 5)
    direction = np.array(axis) / np.linalg.norm(axis)
    assert_fast_equals_naive(
        (0.25 * table[:, :3], 0.25 * table[:, 3]),
        table[:, 4] > 0,
        line_triads(direction[None])[0],
        np.random.default_rng(seed).random(2),
        spacing,
        [cutoff * 1.0001 + 1e-7],
        window,
    )


def test_a_chord_that_reaches_back_past_the_last_gap_makes_its_line_suspect():
    """Two grains with a gap, and a third whose middle is behind them but that covers the gap."""
    position = np.array([[0.0, 0, 0], [0, 0, 1.0], [0, 0, 1.05]])
    spheres = position, np.array([0.2, 0.2, 2.0])
    triad, offset = np.eye(3), np.array([0.3, 0.4])
    assert suspect_lines(spheres, triad, offset, 0.1, 1.5) > 5
    assert_fast_equals_naive(spheres, np.zeros(3, bool), triad, offset, 0.05, [0.0, 0.3], 1.5)


def test_only_lines_that_need_it_are_suspect():
    """Grains in a row with gaps between them: each chord lies behind the one before."""
    spheres = np.array([[0.0, 0, z] for z in range(5)]), np.full(5, 0.4)
    assert suspect_lines(spheres, np.eye(3), np.array([0.3, 0.4]), 0.1, 1.5) == 0


@pytest.mark.parametrize("kind", [overlapping, size_ratio_fifty, covering_the_window])
def test_random_packings_have_suspect_lines(kind):
    """So the comparison with the slow twin covers their solution."""
    found = 0
    for seed in range(50):
        random = np.random.default_rng(seed)
        spheres = kind(random)
        found += suspect_lines(spheres, rotation(random), random.random(2), 0.2, 1.0) > 0
    assert found >= 10


@pytest.mark.parametrize("by_lists", WAYS)
def test_less_that_is_wanted_is_the_same(by_lists):
    """Each choice of what is tallied is a loop of its own."""

    def fast(*line, **choice):
        return fast_tallies(*line, by_lists=by_lists, **choice)

    for seed in range(100):
        random = np.random.default_rng(seed)
        spheres = overlapping(random)
        removed = random.random(len(spheres.radius)) < 0.3
        line = removed, rotation(random), random.random(2), 0.3, 0.2, 1.2
        all_of_it = fast(spheres, *line)
        window = fast(spheres, *line, whole=False)
        whole = fast(spheres, *line, clipped=False)
        first = fast(spheres, *line, second=False)
        for number in range(2):
            assert window[number][3:] == pytest.approx(all_of_it[number][3:], rel=1e-12)
            assert whole[number][:3] == pytest.approx(all_of_it[number][:3], rel=1e-12)
            assert not any(window[number][:3])
            assert not any(whole[number][3:])
        assert first[0] == pytest.approx(all_of_it[0], rel=1e-12)
        assert not any(first[1])
        alone = fast(spheres, *line, second=False, whole=False)
        assert alone[0][3:] == pytest.approx(all_of_it[0][3:], rel=1e-12)


@pytest.mark.parametrize("by_lists", WAYS)
def test_rows_that_fit_no_strip_are_cut(by_lists):
    """A wide sample: more columns than a strip holds."""
    position = np.array([[-700.0, 0, 0], [0, 0, 0], [700, 0, 1], [0.5, 0, 5]])
    spheres = position, np.array([3.0, 2, 3, 2])
    grid = np.eye(3), np.array([0.3, 0.4])
    assert strips.MOST_LINES < 1400 / 0.05
    line = *grid, 0.05, 0.1, 2.0
    fine = fast_tallies(spheres, np.zeros(4, bool), *line, by_lists=by_lists)[0]
    near = position[[1, 3]], spheres[1][[1, 3]]
    fine_near = fast_tallies(near, np.zeros(2, bool), *line, by_lists=by_lists)[0]
    ends = fine.whole_lines - fine_near.whole_lines
    assert ends == pytest.approx(2 * np.pi * 9 / 0.05**2, rel=0.01)
    assert fine[:2] == pytest.approx(fine_near[:2])
    assert fine[3:] == pytest.approx(fine_near[3:])


def test_lists_that_are_full_are_swept_and_filled_again():
    """A column of many small grains: far more chords on a line than a list has room for."""
    random = np.random.default_rng(3)
    count = 1500
    position = random.uniform([-0.5, -0.5, -6.0], [0.5, 0.5, 6.0], (count, 3))
    spheres = position, random.uniform(0.1, 0.2, count)
    chords_per_line = np.pi * np.sum(spheres[1] ** 2)
    assert chords_per_line > 1.5 * lists.ROOM
    removed = random.random(count) < 0.3
    grid = np.eye(3), random.random(2), 0.2
    assert_fast_equals_naive(spheres, removed, *grid, [0.0, 0.1], 5.0)


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


def test_sweep_equals_the_slow_twin_uncompiled():
    """As plain Python the kernel also finds an index out of range."""
    code = (
        "import numpy as np\n"
        "from scanfab.scan.kernels import axes\n"
        "from tests.scan.kernels import test_axes as here\n"
        "assert not hasattr(axes.scan_axes, 'py_func')\n"
        "np.seterr(invalid='ignore')\n"
        "for kind in here.KINDS:\n"
        "    for seed in range(4):\n"
        "        here.check_random_packing(kind, np.random.default_rng(seed))\n"
        "here.test_a_chord_that_reaches_back_past_the_last_gap_makes_its_line_suspect()\n"
    )
    run_uncompiled(code)
