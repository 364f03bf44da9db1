"""What columns without names are, by the grains that they make."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.io.formats import proof


def lattice(edge: int) -> np.ndarray:
    """Centres of grains of diameter 1 that touch, in no order."""
    place = np.indices((edge, edge, edge)).reshape(3, -1).T.astype(float)
    return np.random.default_rng(2).permutation(place)


@pytest.mark.parametrize("away", [0, 100])
def test_a_large_packing_is_told_by_the_grains_around_its_middle(away):
    place = np.indices((32, 32, 32)).reshape(3, -1).T.astype(float)
    place = np.random.default_rng(2).permutation(place)
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
