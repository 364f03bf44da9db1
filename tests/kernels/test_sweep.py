"""The depth-ordered sweep equals its slow twin on random packings of every awkward kind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scanfab.kernels import sweep as kernel
from scanfab.scan import line_frames
from tests import naive
from tests.lattices import ball_points, poisson_spheres, rotation
from tests.uncompiled import run_uncompiled

RUNS_OF_A_KIND = 300


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


def fast_tallies(spheres, removed, frame, offset, spacing, cutoff, window, whole=True):
    """What the kernel tallies with all spheres, and with those that are not removed."""
    position, radius = spheres
    tallies = np.zeros((1, 2, kernel.TALLY_SIZE))
    kernel.scan_axes(
        np.ascontiguousarray(position, dtype=float),
        np.asarray(radius, dtype=float),
        removed,
        (True, True),
        whole,
        np.ascontiguousarray(frame[None]),
        offset[None],
        spacing,
        cutoff,
        window,
        tallies,
    )
    return naive.Tally(*tallies[0, 0]), naive.Tally(*tallies[0, 1])


def assert_equal(fast, slow):
    """Numbers identical, lengths to rounding."""
    for name in ("whole_kept", "whole_lines", "window_kept", "window_lines"):
        assert getattr(fast, name) == getattr(slow, name), name
    for name in ("whole_length", "window_length", "window_void", "window_line_length"):
        assert getattr(fast, name) == pytest.approx(getattr(slow, name), rel=1e-9, abs=1e-9), name


def assert_fast_equals_naive(spheres, removed, frame, offset, spacing, cutoffs, window):
    position, radius = spheres
    subsets = [
        naive.scan(position, radius, frame, offset, spacing, window),
        naive.scan(position[~removed], radius[~removed], frame, offset, spacing, window),
    ]
    for cutoff in cutoffs:
        fast = fast_tallies(spheres, removed, frame, offset, spacing, cutoff, window)
        for one, gaps in zip(fast, subsets, strict=True):
            assert_equal(one, naive.tally(gaps, cutoff))


def check_random_packing(kind, random):
    """One packing of a kind, with a random window, grid, cut-offs and removed grains."""
    position, radius = kind(random)
    window = random.choice([0.0, 1.0, random.uniform(0.3, 3.0)], p=[0.1, 0.3, 0.6])
    spacing = np.exp(random.uniform(np.log(0.4), np.log(2.5)))
    if random.random() < 0.02:
        spacing *= 0.2
    axis = random.integers(0, 3)
    frame = line_frames(np.eye(3))[axis] if random.random() < 0.2 else rotation(random)
    assert_fast_equals_naive(
        (position + random.uniform(-0.5, 0.5, 3), radius),
        random.random(len(radius)) < random.choice([0.0, 0.3, 1.0]),
        frame,
        random.random(2),
        spacing,
        [0.0, random.uniform(0.01, 0.5), random.uniform(0.5, 2.0), 2.0 * window + 1e-3],
        window,
    )


def suspect_lines(spheres, frame, offset, spacing, window):
    """How many lines the sweep of all spheres leaves to be solved again."""
    position, radius = spheres
    u, v, depth = (position @ frame.T).T
    order = np.argsort(depth)
    reach = np.abs(position).max() * 2 + radius.max() + window
    grid = kernel.cover(-reach, reach, -reach, reach, offset, spacing)
    state = kernel.line_state(grid, window)
    sorted_spheres = kernel.Spheres(u[order], v[order], depth[order], radius[order])
    tally = np.zeros(kernel.TALLY_SIZE)
    return kernel.sweep(sorted_spheres, np.arange(len(order)), grid, state, 1e-300, tally)


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
        line_frames(direction[None])[0],
        np.random.default_rng(seed).random(2),
        spacing,
        [cutoff * 1.0001 + 1e-7],
        window,
    )


def test_a_chord_that_reaches_back_past_the_last_gap_makes_its_line_suspect():
    """Two grains with a gap, and a third whose middle is behind them but that covers the gap."""
    position = np.array([[0.0, 0, 0], [0, 0, 1.0], [0, 0, 1.05]])
    spheres = position, np.array([0.2, 0.2, 2.0])
    frame, offset = np.eye(3), np.array([0.3, 0.4])
    assert suspect_lines(spheres, frame, offset, 0.05, 1.5) > 20
    assert_fast_equals_naive(spheres, np.zeros(3, bool), frame, offset, 0.05, [0.0, 0.3], 1.5)


def test_only_lines_that_need_it_are_suspect():
    """Grains in a row with gaps between them: each chord lies behind the one before."""
    spheres = np.array([[0.0, 0, z] for z in range(5)]), np.full(5, 0.4)
    assert suspect_lines(spheres, np.eye(3), np.array([0.3, 0.4]), 0.05, 1.5) == 0


@pytest.mark.parametrize("kind", [overlapping, size_ratio_fifty, covering_the_window])
def test_random_packings_have_suspect_lines(kind):
    """So the comparison with the slow twin covers their solution."""
    found = 0
    for seed in range(50):
        random = np.random.default_rng(seed)
        spheres = kind(random)
        found += suspect_lines(spheres, rotation(random), random.random(2), 0.2, 1.0) > 0
    assert found >= 10


def test_window_alone_gives_the_same_as_with_the_whole_sample():
    for seed in range(100):
        random = np.random.default_rng(seed)
        spheres = overlapping(random)
        removed = random.random(len(spheres.radius)) < 0.3
        line = removed, rotation(random), random.random(2), 0.3, 0.2, 1.2
        for both, alone in zip(
            fast_tallies(spheres, *line),
            fast_tallies(spheres, *line, whole=False),
            strict=True,
        ):
            assert both[3:] == pytest.approx(alone[3:], rel=1e-12)


def test_sets_of_solids_that_nobody_asks_for_stay_zero():
    position, radius = scattered(np.random.default_rng(0))
    for solids in [(True, False), (False, True)]:
        tallies = np.zeros((1, 2, kernel.TALLY_SIZE))
        kernel.scan_axes(
            position,
            radius,
            np.zeros(12, bool),
            solids,
            True,
            np.eye(3)[None],
            np.array([[0.2, 0.7]]),
            0.2,
            0.1,
            2.0,
            tallies,
        )
        assert [bool(tally.any()) for tally in tallies[0]] == list(solids)


def test_sweep_equals_the_slow_twin_uncompiled():
    """As plain Python the kernel also finds an index out of range."""
    code = (
        "import numpy as np\n"
        "from scanfab.kernels import sweep\n"
        "from tests.kernels import test_sweep as here\n"
        "assert not hasattr(sweep.scan_axes, 'py_func')\n"
        "for kind in here.KINDS:\n"
        "    for seed in range(4):\n"
        "        here.check_random_packing(kind, np.random.default_rng(seed))\n"
        "here.test_a_chord_that_reaches_back_past_the_last_gap_makes_its_line_suspect()\n"
    )
    run_uncompiled(code)
