"""The four variants: rattlers, coordination, counted grains and the contacts that count."""

import numpy as np
import pytest

from scanfab import Cell, Packing, contact_fabric, find_contacts, sphere
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import Window
from tests.helpers.lattices import shaken_cubic
from tests.helpers.packed import along_x, sample_of

A, B, C, D = (VARIANTS[name] for name in "abcd")


def row_of_grains(count=6, boundary=(), **options):
    """Grains along x at 0, 2, 4, ..., in contact with their neighbours."""
    pairs = [(k, k + 1) for k in range(count - 1)]
    packing = Packing(along_x(2 * np.arange(count)), 1.0, contacts=pairs, **options)
    return sample_of(packing, boundary)


def rows(mask):
    return np.flatnonzero(mask).tolist()


def test_grain_held_by_its_own_images_is_no_rattler():
    sample = sample_of(Packing([[1, 1, 1]], 0.6, cell=Cell([1.0, 4.0, 4.0])))
    assert sample.contact_numbers.tolist() == [2]
    assert rows(sample.rattlers) == []


FAR, NEAR = Window(np.array([50.0, 0, 0]), sphere(1.0)), Window(np.zeros(3), sphere(2.5))


@pytest.mark.parametrize(
    ("sample", "variant", "window", "expected"),
    [
        (row_of_grains(), A, None, (1 + 2 + 2 + 2 + 2 + 1) / 6),
        # without the ends, and their contacts
        (row_of_grains(), B, None, (1 + 2 + 2 + 1) / 4),
        (row_of_grains(2), B, None, None),
        # boundary particles are no grains, but their contacts count, as those with walls do
        (row_of_grains(boundary=[0], wall_contacts=[5, 0, 0, 0, 0, 3]), A, None, 12 / 5),
        # of grains 0 and 1, whose contacts count wherever they are
        (row_of_grains(), C, NEAR, (1 + 2) / 2),
        (row_of_grains(), D, NEAR, 1.0),
        (row_of_grains(), C, FAR, None),
    ],
)
def test_coordination_is_the_mean_over_the_grains_that_are_counted(
    sample, variant, window, expected
):
    assert sample.coordination(variant, window) == pytest.approx(expected)


def test_counted_grains_are_no_boundary_but_may_be_rattlers():
    sample = row_of_grains(boundary=[1])
    window = Window(np.array([0.0, 0, 0]), sphere(4.5))
    assert rows(sample.counted(A, None)) == rows(sample.counted(B, None)) == [0, 2, 3, 4, 5]
    assert rows(sample.counted(C, window)) == rows(sample.counted(D, window)) == [0, 2]


@pytest.mark.parametrize(("reach", "contacts"), [(0.99, 0), (1.01, 1), (2.99, 1), (3.01, 2)])
def test_contacts_of_the_window_are_those_whose_point_lies_in_it(reach, contacts):
    """Points at 1, 3, 5, ...; centres at 0, 2, 4, ..."""
    window = Window(np.array([0.0, 0, 0]), sphere(reach))
    assert row_of_grains().fabric_contacts(C, window).sum() == contacts
    assert row_of_grains().fabric_contacts(D, window).sum() == max(contacts - 1, 0)


def test_contact_point_through_a_face_lies_in_the_window_on_either_side():
    position, cell = [[0.4, 5, 5], [9.4, 5, 5]], Cell([10.0, 10, 10])
    sample = sample_of(Packing(position, 0.51, cell=cell))
    for x, contacts in ((0.2, 1), (9.7, 1), (1.0, 0)):
        window = Window(np.array([x, 5, 5]), sphere(0.4))
        assert sample.fabric_contacts(C, window).sum() == contacts


def test_window_that_holds_everything_gives_what_the_whole_gives():
    packing = find_contacts(Packing(*shaken_cubic(np.random.default_rng(0), 5)))
    sample = Sample(packing, packing.position[:, 2] < 0.8)
    window = Window(np.array([2.5, 2.5, 2.5]), sphere(50.0))
    assert sample.rattlers.any()
    for whole, inside in [(A, C), (B, D)]:
        normals = packing.contacts.normal[sample.fabric_contacts(whole, None)]
        chosen = sample.fabric_contacts(inside, window)
        assert np.array_equal(normals, packing.contacts.normal[chosen])
        assert sample.coordination(whole, None) == sample.coordination(inside, window)
        assert contact_fabric(normals).alpha > 0


@pytest.mark.parametrize(
    ("boundary", "rattlers", "contacts"),
    [([], [0, 5], [5, 3]), ([0], [5], [4, 3]), ([0, 5], [], [3, 3]), ([0, 3], [5], [2, 1])],
)
def test_contacts_with_boundary_hold_grains_but_do_not_enter_the_contact_fabric(
    boundary, rattlers, contacts
):
    sample = row_of_grains(boundary=boundary)
    for variant in (A, B, C, D):
        expected = rattlers if variant in (B, D) else []
        assert rows(sample.removed(variant)) == expected
    assert rows(sample.rattlers) == rattlers
    assert [sample.fabric_contacts(one, None).sum() for one in (A, B)] == contacts
