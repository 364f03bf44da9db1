"""Clumps of discs in a cell that leans, with all rules at once, against naive ways to count."""

from itertools import product

import numpy as np
import pytest

from scanfab import Cell, ContactList, Packing, compute, find_contacts
from tests.helpers.naive_bodies import NaiveBodies

# where so few clumps are left, lines stay in channels and densities of contacts fall below 0
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
VECTORS = np.array([[11.0, 0, 0], [4.0, 10.0, 0], [0, 0, 50.0]])
AREA = 11.0 * 10.0
SHIFTS = [np.array([*k, 0]) @ VECTORS for k in product((-1, 0, 1), repeat=2)]
CLUMPS = 30
FAST = {"workers": 1, "seed": 4, "spacing": 0.1, "directions": 12}


class Sample:
    """Bodies of one to four discs at random, and a force on each contact."""

    def __init__(self, seed):
        random = np.random.default_rng(seed)
        sizes = random.integers(1, 5, CLUMPS)
        self.number = np.repeat(np.arange(CLUMPS), sizes)
        centre = random.random((CLUMPS, 2)) @ VECTORS[:2, :2]
        places = centre[self.number] + random.normal(0, 0.45, (len(self.number), 2))
        order = random.permutation(len(places))
        self.number, places = self.number[order], places[order]
        radius = random.uniform(0.3, 0.7, len(places))
        bare = Packing(places, radius, bodies=self.number, cell=Cell(VECTORS))
        found = find_contacts(bare)
        pairs, image, normal = found.contacts.pairs, found.contacts.image, found.contacts.normal
        size = random.exponential(1.0, len(pairs)) - 0.1
        across = np.cross(normal, [0, 0, 1.0]) * random.normal(0, 0.2, len(pairs))[:, None]
        force = size[:, None] * normal + across
        self.packing = found.with_contacts(ContactList(pairs, image, force))
        self.twin = NaiveBodies(found.position, radius, self.number, VECTORS, dimension=2)

    def pressing_neighbours(self, least):
        """Of each disc's body the number of neighbours that press on it, however many points."""
        contacts, body = self.packing.contacts, self.twin.body
        mean = contacts.force_n.mean()
        met = set()
        for (one, two), image, size in zip(
            contacts.pairs, contacts.image, contacts.force_n, strict=True
        ):
            if size <= least * mean:
                continue
            apart = self.branch(one, two, image)
            if body[one] > body[two]:
                one, two, apart = two, one, -apart
            met.add((body[one], body[two], *(np.round(apart, 6) + 0.0)))
        count = np.bincount([k for one in met for k in one[:2]], minlength=CLUMPS)
        return np.array([count[body[row]] for row in range(len(self.packing))])

    def branch(self, one, two, image):
        """From body to body."""
        places = self.twin.place
        return places(two) + image @ self.packing.cell.vectors - places(one)

    def stress(self):
        contacts = self.packing.contacts
        places = zip(contacts.pairs, contacts.image, strict=True)
        branch = np.array([self.branch(*pair, image) for pair, image in places])
        total = contacts.force.T @ branch / AREA
        return 0.5 * (total + total.T)

    def solid_area(self, steps=300):
        """Of all bodies, what discs of one body share once, on a fine grid."""
        at = (np.arange(steps) + 0.5) / steps
        points = np.stack(np.meshgrid(at, at, indexing="ij"), -1).reshape(-1, 2) @ VECTORS[:2, :2]
        found = 0
        for rows in self.twin.members:
            inside = np.zeros(len(points), bool)
            for row, shift in product(rows, SHIFTS):
                place = self.packing.position[row] + shift
                inside |= ((points - place[:2]) ** 2).sum(axis=1) < self.packing.radius[row] ** 2
            found += np.count_nonzero(inside)
        return found / len(points) * AREA


@pytest.fixture(scope="module")
def sample():
    return Sample(1)


@pytest.fixture(scope="module")
def rows(sample):
    words = {"rattlers": "force", "min_force": 0.2, "with_": "state,forces,invariants", **FAST}
    return {name: compute(sample.packing, variants=name, **words)[0] for name in "ab"}


def test_counts_are_those_of_the_twin(sample, rows):
    twin = sample.twin
    held = sample.pressing_neighbours(0.2) >= 2
    heads = [members[0] for members in twin.members]
    numbers = np.array(twin.numbers(np.zeros(len(sample.packing), int)))
    assert rows["a"].grains == CLUMPS
    assert rows["a"].rattlers == np.count_nonzero(~held[heads]) > 3
    assert rows["b"].grains == np.count_nonzero(held[heads])
    assert rows["a"].contacts == twin.contacts
    assert rows["a"].coordination == pytest.approx(numbers.mean())
    assert rows["a"].coordination_mechanical == pytest.approx(numbers[numbers >= 2].mean())
    pairs = sample.packing.contacts.pairs
    kept = held[pairs].all(axis=1)
    assert rows["b"].contacts == np.count_nonzero(kept)
    normal = sample.packing.contacts.normal[kept]
    assert rows["b"].gc_xy == pytest.approx(np.mean(normal[:, 0] * normal[:, 1]))


def test_areas_and_stress_are_those_of_the_twin(sample, rows):
    solid = sample.solid_area()
    assert rows["a"].void_ratio == pytest.approx((AREA - solid) / solid, rel=2e-3)
    stress = sample.stress()
    found = rows["a"].stress_xx, rows["a"].stress_yy, rows["a"].stress_xy
    np.testing.assert_allclose(found, (stress[0, 0], stress[1, 1], stress[0, 1]), rtol=1e-9)
    assert (rows["a"].stress_zz, rows["a"].stress_xz) == (0.0, 0.0)
    assert rows["a"].p == pytest.approx(0.5 * np.trace(stress))
    assert rows["a"].q == pytest.approx(stress[1, 1] - stress[0, 0])
