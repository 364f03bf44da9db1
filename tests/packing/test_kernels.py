"""Contacts by geometry equal those of a comparison of all pairs with all images."""

import numpy as np
import pytest

from scanfab import Cell, Packing, PackingError, find_contacts
from scanfab.packing.search import overlapping_pairs
from tests.helpers import naive
from tests.helpers.uncompiled import run_uncompiled


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


def assert_periodic_contacts_equal(position, radius, vectors, periodic, origin=(0, 0, 0)):
    packing = Packing(position, radius, cell=Cell(vectors, periodic, origin))
    found = find_contacts(packing).contacts
    assert canonical(found) == naive.contacts(
        packing.position, packing.radius, 0.0, vectors, periodic
    )
    assert sorted(found.pairs.tolist()) == found.pairs.tolist()


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


def random_vectors(random):
    """Thin cells, most of them tilted: as LAMMPS writes them, or any three vectors."""
    vectors = np.diag(random.uniform(0.8, 3.0, 3))
    if random.random() < 0.5:
        vectors[[1, 2, 2], [0, 0, 1]] = random.uniform(-2.5, 2.5, 3) * vectors[0, 0]
        return vectors
    while True:
        vectors = random.normal(size=(3, 3)) * random.uniform(0.5, 2.0)
        if abs(np.linalg.det(vectors)) > 0.3:
            return vectors


def check_random_tilted(random):
    """Any mix of open vectors; grains from dust to some that touch their own images."""
    vectors, count = random_vectors(random), random.integers(1, 7)
    periodic, origin = tuple(random.random(3) < 0.7), random.uniform(-5, 5, 3)
    position = origin + random.uniform(-1, 2, (count, 3)) @ vectors
    radius = random.uniform(0.02, 1.0, count) * random.choice([0.1, 0.3, 0.7])
    radius *= random.choice([1.0, 0.01], count)
    assert_periodic_contacts_equal(position, radius, vectors, periodic, origin)


def test_contacts_in_tilted_cells_equal_the_slow_twin():
    for seed in range(200):
        check_random_tilted(np.random.default_rng(seed))


def test_open_contacts_equal_the_slow_twin():
    for seed in range(150):
        check_random_open(np.random.default_rng(seed))


def test_periodic_contacts_equal_the_slow_twin():
    for seed in range(100):
        check_random_periodic(np.random.default_rng(seed))


@pytest.mark.parametrize("edges", [(0.5, 0.5, 0.5), (0.7, 2.5, 8.0), (2.9, 2.9, 2.9)])
def test_cell_thinner_than_three_bins(edges):
    """Edges of a fifth of a bin, and of less than three bins."""
    random = np.random.default_rng(3)
    position = random.random((4, 3)) * edges
    radius = np.array([0.49, 0.3, 0.1, 0.48])
    assert_periodic_contacts_equal(position, radius, edges, (True, True, True))


def test_a_grain_of_many_cells_is_a_mistake_of_units():
    with pytest.raises(PackingError, match="spans 200 periodic cells: have the cell and the radii"):
        find_contacts(Packing([[0.5, 0.5, 0.5]], 100.0, cell=Cell([1.0, 1.0, 1.0])))


@pytest.mark.parametrize("far", [1e3, 1e9, 1e60])
@pytest.mark.parametrize("cell", [None, Cell([1.0, 1.1, 5.0], (True, True, False))])
def test_grains_that_flew_away_leave_the_bins_small(far, cell):
    """In bins that span all, 20000² / 2 pairs would be looked at; the far ones touch each other."""
    random = np.random.default_rng(4)
    position = random.random((20_000, 3))
    position[::5000, 2] = far
    position[1::5000] = position[::5000] + np.array([0.01, 0.0, 0.0])
    pairs, _ = overlapping_pairs(position, np.full(20_000, 0.02), 1.0, cell)
    near = np.flatnonzero(position[:, 2] <= 1)
    among, _ = overlapping_pairs(position[near], np.full(len(near), 0.02), 1.0, cell)
    assert (position[pairs, 2] <= 1).all(axis=1).sum() == len(among)
    found = {tuple(pair) for pair in pairs[(position[pairs, 2] > 1).all(axis=1)].tolist()}
    assert {(k, k + 1) for k in range(0, 20_000, 5000)} <= found


def test_size_ratio_of_a_thousand_takes_little_memory_and_time():
    """All dust in the bins of one boulder would be 20000² / 2 pairs to look at."""
    random = np.random.default_rng(2)
    position = random.random((20_000, 3))
    radius = np.full(20_000, 2e-4)
    radius[:3] = 0.2
    pairs, _ = overlapping_pairs(position, radius)
    gaps = np.linalg.norm(position[:3, None] - position, axis=2) - (radius[:3, None] + radius)
    with_boulders = {(min(i, j), max(i, j)) for i, j in np.argwhere(gaps < 0).tolist() if i != j}
    found = [tuple(pair) for pair in pairs.tolist()]
    assert with_boulders == {pair for pair in found if pair[0] < 3}


def test_more_contacts_than_the_first_guess_has_room_for():
    """All pairs of 30 grains in one heap: 14.5 contacts a grain."""
    position = np.random.default_rng(0).random((30, 3))
    assert len(find_contacts(Packing(position, 1.0)).contacts) == 30 * 29 // 2


@pytest.mark.parametrize("sizes", ["equal", "unlike"])
def test_grains_on_top_of_one_another_are_refused_before_all_pairs_are_tried(sizes):
    """The 5e9 pairs of 100,000 would take all memory."""
    random = np.random.default_rng(0)
    radius = np.ones(100_000) if sizes == "equal" else np.exp(random.uniform(0, 7, 100_000))
    position = random.uniform(-1e-3, 1e-3, (100_000, 3))
    with pytest.raises(PackingError, match=r"more than 1000 contacts a grain.*units"):
        find_contacts(Packing(position, radius))
    few = find_contacts(Packing(position[:900], radius[:900])).contacts
    assert len(few) == 900 * 899 // 2


def test_contacts_equal_the_slow_twin_uncompiled():
    code = (
        "import numpy as np\n"
        "from scanfab.packing import kernels as neighbours\n"
        "from tests.packing import test_kernels as here\n"
        "assert not hasattr(neighbours.find_pairs, 'py_func')\n"
        "for seed in range(15):\n"
        "    here.check_random_open(np.random.default_rng(seed))\n"
        "    here.check_random_periodic(np.random.default_rng(seed))\n"
        "    here.check_random_tilted(np.random.default_rng(seed))\n"
    )
    run_uncompiled(code)
