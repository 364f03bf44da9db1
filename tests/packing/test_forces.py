"""Forces of contacts: whose they are stays right, however the pair is named and found."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab import Cell, ContactList, Packing
from scanfab.base.errors import PackingError

PAIR = np.array([[0.0, 0, 0], [1.9, 0, 0]])
PUSH = np.array([2.0, 0.5, -1.0])


def test_compression_is_positive():
    contacts = Packing(PAIR, 1.0, contacts=ContactList([[0, 1]], force=[PUSH])).contacts
    np.testing.assert_array_equal(contacts.force_n, [2.0])


def test_the_other_grain_feels_the_opposite():
    one, two = (
        Packing(PAIR, 1.0, contacts=ContactList([pair], force=[force])).contacts
        for pair, force in (([0, 1], PUSH), ([1, 0], -PUSH))
    )
    np.testing.assert_array_equal(one.force_n, two.force_n)
    stress = [np.outer(c.force[0], c.normal[0]) for c in (one, two)]
    np.testing.assert_array_equal(*stress)


def test_of_a_contact_that_is_listed_from_both_sides_one_force_stays():
    listed = ContactList([[1, 0], [0, 1]], force=[-PUSH, PUSH])
    contacts = Packing(PAIR, 1.0, contacts=listed).contacts
    assert len(contacts) == 1
    np.testing.assert_array_equal(contacts.force, [-PUSH])
    np.testing.assert_array_equal(contacts.normal, [[-1, 0, 0]])


def test_through_a_periodic_face_the_normal_is_that_of_the_image():
    places = [[0.5, 5, 5], [9.0, 5, 5]]
    listed = ContactList([[0, 1]], force=[[-3.0, 1, 0]])
    contacts = Packing(places, 1.0, contacts=listed, cell=Cell([10, 10, 10])).contacts
    np.testing.assert_allclose(contacts.normal, [[-1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(contacts.force_n, [3.0])


@pytest.mark.parametrize(
    ("given", "expected"), [([-4.0], -4.0), ([[-4.0, 0, 0]], -4.0), ([[0.0, 4, 0]], 0.0)]
)
def test_a_normal_force_alone_is_a_number_or_a_vector_on_the_second_grain(given, expected):
    contacts = Packing(PAIR, 1.0, contacts=ContactList([[0, 1]], force_n=given)).contacts
    assert contacts.force is None
    np.testing.assert_array_equal(contacts.force_n, [expected])
    assert repr(contacts) == "Contacts: 1 contact from file with normal forces"


def test_where_the_force_is_known_its_normal_part_follows():
    listed = ContactList([[0, 1]], force=[PUSH], force_n=[7.0])
    np.testing.assert_array_equal(Packing(PAIR, 1.0, contacts=listed).contacts.force_n, [2.0])


@pytest.mark.parametrize("wrong", [{"force": [PUSH] * 2}, {"force_n": [1.0, 2.0]}])
def test_each_contact_has_one_force(wrong):
    (name,) = wrong
    with pytest.raises(PackingError, match=rf"^{name}: expected shape \(1"):
        Packing(PAIR, 1.0, contacts=ContactList([[0, 1]], **wrong))


def test_contacts_that_are_found_have_none():
    from scanfab import find_contacts

    contacts = find_contacts(Packing(PAIR, 1.0)).contacts
    assert contacts.force is None
    assert contacts.force_n is None
