"""What columns without names are, by the grains that they make."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.io.formats import proof


def block(*edges: int) -> np.ndarray:
    """Centres of grains of diameter 1 that touch, row by row."""
    return np.indices(edges).reshape(len(edges), -1).T.astype(float)


def lattice(edge: int) -> np.ndarray:
    """The same of a cube, in no order."""
    return np.random.default_rng(2).permutation(block(edge, edge, edge))


@pytest.mark.parametrize("away", [0, 100])
def test_a_large_packing_is_told_by_the_grains_around_its_middle(away):
    place = lattice(32)
    place[:away] += 1e9  # thrown out of the sample
    radius = np.full(len(place), 0.5)
    assert proof.touch(*place.T, radius)
    assert not proof.touch(*place.T, 2 * radius)
    assert not proof.touch(*place.T, 0.5 * radius)
    assert not proof.touch(*place.T[[0, 1, 1]], radius)
    assert not proof.touch(*np.random.default_rng(3).permuted(place, axis=0).T, radius / 2)


@pytest.mark.parametrize("edge", [9, 24, 40])
@pytest.mark.parametrize(("share", "are_told"), [(0.0, True), (0.004, True), (0.05, False)])
def test_hardly_any_grain_lies_in_another(edge, share, are_told):
    place = lattice(edge)
    moved = np.flatnonzero(np.random.default_rng(3).random(len(place)) < share / 2)
    # half-way into a neighbour along x
    place[moved, 0] += 0.5
    assert proof.touch(*place.T, np.full(len(place), 0.5)) == are_told


@pytest.mark.parametrize("edge", [9, 24, 40])
@pytest.mark.parametrize(("share", "are_told"), [(0.3, True), (0.45, True), (0.7, False)])
def test_most_grains_touch_another_in_loose_packings(edge, share, are_told):
    place = lattice(edge)
    radius = np.full(len(place), 0.5)
    # rows of small grains, which touch nothing, beside rows of grains that touch each other
    is_small = np.random.default_rng(4).random((edge, edge)) < share
    radius[is_small[tuple(place[:, 1:].astype(int).T)]] = 0.2
    assert proof.touch(*place.T, radius) == are_told


def test_frames_one_below_the_other_are_no_packing():
    # a column that is filled: only its lower part lies in that of the early frame
    late = block(12, 12, 70)
    both = np.vstack([late[late[:, 2] < 17], late + np.array([0.3, 0.3, 0])])
    assert not proof.touch(*both.T, np.full(len(both), 0.5))


def test_grains_that_two_workers_wrote_are_seen():
    whole = block(80, 12, 12)
    parts = [
        (whole[:, 0] >= a - 1) & (whole[:, 0] < b + 1) for a, b in ((0, 26), (26, 54), (54, 80))
    ]
    ghosts = np.vstack([whole[part] for part in parts])
    assert not proof.touch(*ghosts.T, np.full(len(ghosts), 0.5))


@pytest.mark.parametrize("count", [1498, 1999 * 3 + 1, 40_001])
def test_a_regular_order_of_grains_hides_none(count):
    # in threes: one of a chain of grains that touch, and two that lie in others
    place = np.zeros((count, 3))
    kind = np.arange(count) % 3
    place[:, 0] = np.arange(count) // 3
    place[:, 1] = np.where(kind > 0, 9, 0)
    place[:, 2] = 0.5 * kind
    assert not proof.touch(*place.T, np.full(count, 0.5))


@pytest.mark.parametrize("period", [4, 8, 12, 20, 40])
def test_a_part_of_each_row_that_lies_in_itself_is_seen(period):
    # as many rows as are looked at first: the beginning of each may not stand for all of it
    place = block(25, 20, period)[:, ::-1].copy()
    far = place[:, 0] >= period // 4
    place[far, 0] = period // 4 + 0.5 * (place[far, 0] - period // 4)
    assert not proof.touch(*place.T, np.full(len(place), 0.5))


@pytest.mark.parametrize("share", [0.5, 0.51])
def test_the_middle_of_a_bed_below_a_gas_is_that_of_the_bed(share):
    count = int(60_000 * share)
    bed = block(40, 40, 40)
    bed = bed[np.argsort(bed[:, 2], kind="stable")][:count]
    gas = np.random.default_rng(0).random((60_000 - count, 3)) * [40, 40, 400] + [0, 0, 100]
    place = np.vstack([bed, gas])
    assert proof.touch(*place.T, np.full(len(place), 0.5))
