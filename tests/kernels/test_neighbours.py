"""Contacts by geometry equal those of a comparison of all pairs with all images."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scanfab import Cell, Packing, find_contacts
from scanfab.kernels.neighbours import bin_spheres, overlapping_pairs
from tests import naive
from tests.uncompiled import run_uncompiled


def canonical(contacts):
    """Contacts as a set, each named as the slow twin does; none may be listed twice."""
    named = set()
    for pair, shift in zip(contacts.pairs.tolist(), contacts.image.tolist(), strict=True):
        i, j = pair
        image = tuple(shift)
        if i > j or (i == j and image < (0, 0, 0)):
            i, j, image = j, i, tuple(-n for n in image)
        assert (i, j, image) not in named
        named.add((i, j, image))
    return named


def assert_open_contacts_equal(position, radius, tolerance):
    packing = find_contacts(Packing(position, radius), tolerance)
    assert canonical(packing.contacts) == naive.contacts(position, radius, tolerance)


def assert_periodic_contacts_equal(position, radius, edges, periodic, origin=(0, 0, 0)):
    packing = Packing(position, radius, cell=Cell(edges, periodic, origin))
    found = find_contacts(packing).contacts
    assert canonical(found) == naive.contacts(
        packing.position, packing.radius, 0.0, np.array(edges), periodic
    )


def check_random_open(random):
    count = random.integers(1, 40)
    position = random.random((count, 3)) * random.choice([0.5, 2.0, 6.0], 3)
    radius = np.exp(random.uniform(np.log(0.02), 0.0, count)) * 0.7
    assert_open_contacts_equal(position, radius, random.choice([0.0, 1e-4, 0.01]))


def check_random_periodic(random):
    """Edges from two bins down to a fraction of a grain."""
    count = random.integers(1, 7)
    edges = random.uniform(0.8, 3.0, 3)
    periodic = tuple(random.random(3) < 0.7)
    origin = random.uniform(-5, 5, 3)
    position = origin + random.uniform(-1, 2, (count, 3)) * edges
    radius = random.uniform(0.02, 1.0, count) * random.choice([0.3, 1.0])
    assert_periodic_contacts_equal(position, radius, edges, periodic, origin)


def test_open_contacts_equal_the_slow_twin():
    for seed in range(150):
        check_random_open(np.random.default_rng(seed))


def test_periodic_contacts_equal_the_slow_twin():
    for seed in range(100):
        check_random_periodic(np.random.default_rng(seed))


@given(
    st.lists(
        st.tuples(*3 * [st.integers(-6, 6)], st.integers(1, 5)),
        max_size=15,
        unique_by=lambda grain: grain[:3],
    )
)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_open_contacts_equal_the_slow_twin_for_any_grains(grains):
    # radii off the lattice: no ties, which rounding would decide
    table = np.array(grains, dtype=float).reshape(-1, 4)
    assert_open_contacts_equal(table[:, :3], 0.3017 * table[:, 3], 0.0)


def test_contacts_with_a_size_ratio_of_fifty():
    """Dust between boulders: the bins are as large as the boulders."""
    random = np.random.default_rng(1)
    position = random.random((250, 3)) * 6
    radius = np.where(np.arange(250) < 5, 1.5, 0.03 * random.uniform(1, 5, 250))
    assert_open_contacts_equal(position, radius, 0.0)


def test_wide_tolerance_between_a_boulder_and_dust():
    """A gap within the tolerance of the pair may be wider than the dust."""
    assert_open_contacts_equal(np.array([[0.0, 0, 0], [0, 0, 1.15]]), np.array([1.0, 0.05]), 0.1)


def test_grain_larger_than_half_the_cell_touches_its_own_images():
    """Along x and y, and not along z, where the cell is longer."""
    packing = Packing([[0.1, 0.2, 0.3]], 0.6, cell=Cell([1.0, 1.1, 2.0]))
    contacts = find_contacts(packing).contacts
    assert contacts.pairs.tolist() == [[0, 0], [0, 0]]
    assert np.abs(contacts.image).tolist() == [[0, 1, 0], [1, 0, 0]] or np.abs(
        contacts.image
    ).tolist() == [[1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize("edges", [(0.5, 0.5, 0.5), (0.7, 2.5, 8.0), (2.9, 2.9, 2.9)])
def test_cell_thinner_than_three_bins(edges):
    """Edges of a fifth of a bin, and of less than three bins."""
    random = np.random.default_rng(3)
    position = random.random((4, 3)) * edges
    radius = np.array([0.5, 0.3, 0.1, 0.48])
    assert_periodic_contacts_equal(position, radius, edges, (True, True, True))


def test_two_grains_may_touch_through_several_images():
    """Two grains that span the cell: once inside it, and once through its face."""
    packing = Packing([[0.5, 5, 5], [1.5, 5, 5]], 0.51, cell=Cell([2.0, 10.0, 10.0]))
    contacts = find_contacts(packing).contacts
    assert canonical(contacts) == {(0, 1, (0, 0, 0)), (0, 1, (-1, 0, 0))}


def test_pairs_beyond_the_room_are_counted_but_not_written():
    position, radius = np.zeros((4, 3)), np.ones(4)
    pairs = np.full((2, 2), -1)
    shape = np.ones(3, np.int64)
    found = overlapping_pairs(position, radius, 1.0, 4, np.zeros(3), 2.0, shape, pairs)
    assert found == 6
    assert pairs.tolist() == [[0, 1], [0, 2]]


def test_more_contacts_than_the_first_guess_has_room_for():
    """All pairs of 30 grains in one heap: 14.5 contacts a grain."""
    position = np.random.default_rng(0).random((30, 3))
    assert len(find_contacts(Packing(position, 1.0)).contacts) == 30 * 29 // 2


def test_bins_list_every_sphere_once_in_its_bin():
    random = np.random.default_rng(0)
    position = random.random((200, 3)) * [3, 2, 1]
    shape = np.array([6, 4, 2])
    start, order = bin_spheres(position, np.zeros(3), 0.5, shape)
    assert sorted(order) == list(range(200))
    for x, y, z in np.ndindex(*shape):
        place = (x * 4 + y) * 2 + z
        inside = position[order[start[place] : start[place + 1]]]
        assert np.all(np.floor(inside / 0.5) == [x, y, z])


def test_contacts_equal_the_slow_twin_uncompiled():
    code = (
        "import numpy as np\n"
        "from scanfab.kernels import neighbours\n"
        "from tests.kernels import test_neighbours as here\n"
        "assert not hasattr(neighbours.overlapping_pairs, 'py_func')\n"
        "for seed in range(15):\n"
        "    here.check_random_open(np.random.default_rng(seed))\n"
        "    here.check_random_periodic(np.random.default_rng(seed))\n"
    )
    run_uncompiled(code)
