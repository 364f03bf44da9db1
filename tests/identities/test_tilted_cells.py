"""Contacts do not depend on how a periodic packing is described: by which vectors, from where."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, ContactList, Packing, contact_fabric, find_contacts
from tests.helpers.lattices import face_centred_cubic, shaken_cubic
from tests.helpers.truth import CELL as LIGGGHTS

TOLERANCE = 1e-4
# of a face-centred cubic lattice of unit cubes: one grain a cell
PRIMITIVE = 0.5 * np.array([[0.0, 1, 1], [1, 0, 1], [1, 1, 0]])
NEARLY = 1 / np.sqrt(8)


def unimodular(random):
    """Whole combinations of three vectors that span the same lattice."""
    matrix = np.eye(3, dtype=int)
    for _ in range(4):
        one, two = random.choice(3, 2, replace=False)
        matrix[one] += random.integers(-2, 3) * matrix[two]
    return matrix


def assert_face_centred(packing):
    """Twelve contacts a grain, and no direction before the others."""
    contacts = packing.contacts
    assert len(contacts) == 6 * len(packing)
    ends = np.bincount(contacts.pairs.ravel(), minlength=len(packing))
    assert set(ends.tolist()) == {12}
    tensor = contact_fabric(contacts.normal).matrix
    assert np.abs(tensor - np.eye(3) / 3).max() < 1e-9


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_a_lattice_has_the_same_contacts_by_any_vectors(count):
    """By its primitive cell (0), whose one grain touches its images, or cubes of some edge."""
    random = np.random.default_rng(count)
    for matrix in [np.eye(3), *(unimodular(random) for _ in range(10))]:
        cell = Cell(
            matrix @ (count * np.eye(3) if count else PRIMITIVE), origin=random.normal(size=3)
        )
        spheres = face_centred_cubic(count) if count else (random.normal(size=(1, 3)) * 3, NEARLY)
        assert_face_centred(find_contacts(Packing(*spheres, cell=cell), TOLERANCE))


def named(packing):
    """Contacts by their grains and normals, which no description of the cell changes."""
    contacts = packing.contacts
    sign = np.where(contacts.pairs[:, 0] < contacts.pairs[:, 1], 1.0, -1.0)
    rows = np.column_stack([np.sort(contacts.pairs, axis=1), sign[:, None] * contacts.normal])
    return rows[np.lexsort(np.round(rows, 6).T[::-1])]


@pytest.fixture(scope="module")
def sheared():
    """125 unequal grains in a cell that is tilted by more than its length."""
    spheres = shaken_cubic(np.random.default_rng(2), 5)
    return spheres, np.array([[5.0, 0, 0], [6.5, 5, 0], [-2.0, 7.1, 5]])


def test_other_places_and_other_vectors_of_the_lattice_leave_the_contacts(sheared):
    spheres, vectors = sheared
    before = find_contacts(Packing(*spheres, cell=Cell(vectors)))
    assert len(before.contacts) > 150
    random = np.random.default_rng(3)
    for shift in random.normal(size=(5, 3)) * 20:
        moved = Packing(*spheres.moved(shift), cell=Cell(vectors, origin=random.normal(size=3)))
        other = Packing(*spheres, cell=Cell(unimodular(random) @ vectors))
        for packing in (moved, other):
            np.testing.assert_allclose(named(find_contacts(packing)), named(before), atol=1e-9)


def test_a_list_without_images_has_those_that_geometry_finds(sheared):
    spheres, vectors = sheared
    found = find_contacts(Packing(*spheres, cell=Cell(vectors)))
    listed = Packing(*spheres, cell=Cell(vectors), contacts=found.contacts.pairs)
    np.testing.assert_array_equal(listed.contacts.image, found.contacts.image)


def test_images_are_told_from_positions_as_they_are_given(sheared):
    """The third grain is given two cells away from the first, which it touches."""
    _, vectors = sheared
    cell = Cell(vectors)
    position = np.array([[1, 1, 1], [1, 1, 2.9], [2.9, 1, 1]])
    away = np.array([[0, 0, 0], [0, 0, 0], [0, -1, 2]])
    listed = ContactList([[0, 1], [0, 2]], image=[[0, 0, 0], [0, 1, -2]])
    packing = Packing(position + away @ vectors, 1.0, cell=cell, contacts=listed)
    np.testing.assert_allclose(packing.contacts.normal, [[0, 0, 1], [1, 0, 0]], atol=1e-12)


@pytest.mark.parametrize("step", [30000, 60000, 90000, 120000, 150000])
def test_liggghts_counts_the_same_contacts_of_each_grain(step):
    listed = LIGGGHTS / f"contacts_{step}.txt.gz"
    packing = scanfab.read(LIGGGHTS / f"dump_{step}.txt.gz", contacts=listed)
    flags = np.loadtxt(listed, skiprows=9)[:, 8]
    through = packing.contacts.image.any(axis=1)
    for one in (packing, find_contacts(packing)):
        ends = np.bincount(one.contacts.pairs.ravel(), minlength=len(packing))
        np.testing.assert_array_equal(ends, packing.columns["c_ca"])
    assert through.sum() == np.count_nonzero(flags)
    assert np.mean(np.sum(packing.contacts.force * packing.contacts.normal, axis=1) > 0) > 0.9
