"""Near pairs against a loop over all pairs and images."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from scanfab import Cell, Packing, Sample, Window, find_contacts, sphere
from scanfab.packing.sample import VARIANTS
from scanfab.packing.search import near_pairs


@pytest.fixture(scope="module")
def sample():
    random = np.random.default_rng(4)
    cell = Cell(np.array([[6.0, 0, 0], [1.5, 6.0, 0], [0, 0.5, 5.0]]))
    position = random.random((60, 3)) @ cell.vectors
    packing = Packing(position, random.uniform(0.3, 0.6, 60), cell=cell)
    return Sample(find_contacts(packing), boundary=np.zeros(60, bool))


def every_pair(packing, chosen, gap):
    """Normals, overlaps and middles of pairs of the chosen grains, one after the other."""
    found = []
    rows = np.flatnonzero(chosen)
    shifts = [
        np.array(one) @ packing.cell.vectors for one in itertools.product((-1, 0, 1), repeat=3)
    ]
    for one, two in itertools.combinations(rows, 2):
        for shift in shifts:
            branch = packing.position[two] + shift - packing.position[one]
            distance = np.linalg.norm(branch)
            overlap = packing.radius[one] + packing.radius[two] - distance
            if overlap > -gap:
                middle = packing.position[one] + branch / distance * (
                    packing.radius[one] - overlap / 2
                )
                found.append((overlap, *branch / distance, *middle))
    return np.array(found)


@pytest.mark.parametrize("variant", ["a", "b"])
def test_pairs_of_a_tilted_cell(sample, variant):
    solid = ~sample.removed(VARIANTS[variant])
    expected = every_pair(sample.packing, solid, 0.25)
    found = near_pairs(sample, VARIANTS[variant], None, 0.25)
    assert len(expected) > 20
    order = np.argsort(found.overlap)
    expected = expected[np.argsort(expected[:, 0])]
    np.testing.assert_allclose(found.overlap[order], expected[:, 0], atol=1e-12)
    turned = np.einsum("ci,ci->c", found.normal[order], expected[:, 1:4])
    np.testing.assert_allclose(np.abs(turned), 1.0, atol=1e-12)
    assert found.volume == pytest.approx(180.0)
    assert found.shadow == pytest.approx(np.pi * np.sum(sample.packing.radius[solid] ** 2))


def test_pairs_of_an_rv_have_their_middles_in_it(sample):
    window = Window(np.array([3.0, 3.0, 2.5]), sphere(2.0))
    found = near_pairs(sample, VARIANTS["c"], window, 0.25)
    middles = every_pair(sample.packing, sample.grains, 0.25)[:, 4:]
    assert len(found.overlap) == window.contains(middles, sample.packing).sum()
    inside = window.contains(sample.packing.position, sample.packing)
    assert found.shadow == pytest.approx(np.pi * np.sum(sample.packing.radius[inside] ** 2))
    assert found.volume == pytest.approx(4 / 3 * np.pi * 8)
