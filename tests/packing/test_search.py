"""Contacts of lattices and chains, and contacts that are listed more than once."""

import itertools

import numpy as np
import pytest

from scanfab import (
    Cell,
    ContactList,
    Packing,
    Sample,
    Window,
    compute,
    contact_fabric,
    find_contacts,
    sphere,
)
from scanfab.packing.sample import VARIANTS
from scanfab.packing.search import near_pairs
from tests.helpers.lattices import face_centred_cubic, simple_cubic

TOLERANCE = 1e-4


def periodic(spheres, edges, **cell):
    return find_contacts(Packing(*spheres, cell=Cell(edges, **cell)), TOLERANCE)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize(
    ("lattice", "contacts_of_a_cell"), [(simple_cubic, 3), (face_centred_cubic, 24)]
)
def test_cubic_lattices_have_the_isotropic_contact_fabric(lattice, contacts_of_a_cell, count):
    """A cell of one grain touches nothing but its own images."""
    packing = periodic(lattice(count), [count] * 3)
    assert len(packing.contacts) == contacts_of_a_cell * count**3
    tensor = contact_fabric(packing.contacts.normal)
    assert np.abs(tensor.matrix - np.eye(3) / 3).max() < 1e-9
    assert tensor.alpha < 1e-9


@pytest.mark.parametrize(
    ("lattice", "coordination"), [(simple_cubic, 6.0), (face_centred_cubic, 12.0)]
)
def test_cubic_lattices_have_their_coordination_number(lattice, coordination):
    packing = periodic(lattice(4), [4, 4, 4])
    row = compute(packing, variants="c", directions="lebedev:5", spacing=0.2, cutoff=0.1)[0]
    assert row.coordination == coordination
    assert row.rattlers == 0
    assert row.alpha_c == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_all_contacts_along_one_axis(axis):
    """A chain through the cell: n⊗n."""
    position = np.zeros((5, 3)) + 2.0
    position[:, axis] = np.arange(5) + 0.5
    edges = np.where(np.arange(3) == axis, 5.0, 4.0)
    packing = find_contacts(Packing(position, 0.5, cell=Cell(edges)), TOLERANCE)
    tensor = contact_fabric(packing.contacts.normal)
    assert len(packing.contacts) == 5
    assert tensor.matrix == pytest.approx(np.diag(np.eye(3)[axis]), abs=1e-12)
    assert tensor.alpha == pytest.approx(1.0)
    assert tensor.axial(np.eye(3)[axis]) == pytest.approx(1.0)


def test_periodic_contact_listed_twice_or_from_both_sides_counts_once():
    """Through a face, and with an own image."""
    packing = periodic(simple_cubic(2), [2, 2, 2])
    listed = packing.contacts
    both = ContactList(
        np.concatenate([listed.pairs, listed.pairs[:, ::-1], listed.pairs]),
        np.concatenate([listed.image, -listed.image, listed.image]),
    )
    again = packing.with_contacts(both).contacts
    assert len(listed) == 24
    assert np.array_equal(again.pairs, listed.pairs)
    assert np.array_equal(again.image, listed.image)


@pytest.mark.parametrize(("radius", "contacts"), [(0.5 * (1 + 1e-9), 54), (0.5 * (1 - 1e-9), 0)])
def test_contact_without_a_tolerance_needs_an_overlap(radius, contacts):
    """However small it is; touching exactly would be decided by rounding."""
    packing = find_contacts(Packing(simple_cubic(3).position, radius))
    assert len(packing.contacts) == contacts


@pytest.mark.parametrize(("gap", "contacts"), [(0.9e-4, 54), (1.1e-4, 0)])
def test_tolerance_is_relative_to_the_sum_of_the_radii(gap, contacts):
    lattice = simple_cubic(3)
    packing = find_contacts(Packing(lattice.position * (1 + gap) * 1e-6, 0.5e-6), TOLERANCE)
    assert len(packing.contacts) == contacts


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
