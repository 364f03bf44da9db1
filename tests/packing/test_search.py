"""Contacts by geometry: those of a slow twin in any cell, of lattices and chains; near pairs."""

import itertools

import numpy as np
import pytest

import scanfab
from scanfab import Cell, ContactList, Packing, PackingError, contact_fabric, find_contacts
from scanfab.packing.sample import VARIANTS
from scanfab.packing.search import near_pairs, overlapping_pairs
from tests.helpers import naive
from tests.helpers.lattices import face_centred_cubic, simple_cubic
from tests.helpers.packed import sample_of

TOLERANCE = 1e-4


def canonical(contacts):
    """Contacts as a set, each named as the slow twin does; none may be listed twice."""
    named = set()
    for (i, j), image in zip(contacts.pairs.tolist(), contacts.image.tolist(), strict=True):
        if i > j or (i == j and image < [0, 0, 0]):
            i, j, image = j, i, [-n for n in image]
        assert (i, j, tuple(image)) not in named
        named.add((i, j, tuple(image)))
    return named


def assert_those_of_the_slow_twin(position, radius, tolerance=0.0, **cell):
    packing = Packing(position, radius, cell=Cell(**cell) if cell else None)
    found = find_contacts(packing, tolerance).contacts
    lattice = (cell["vectors"], cell["periodic"]) if cell else ()
    expected = naive.contacts(packing.position, packing.radius, tolerance, *lattice)
    assert canonical(found) == expected
    assert sorted(found.pairs.tolist()) == found.pairs.tolist()


def check_random_open(random):
    count = random.integers(1, 40)
    position = random.random((count, 3)) * random.choice([0.5, 2.0, 6.0], 3)
    radius = np.exp(random.uniform(np.log(0.02), 0.0, count)) * 0.7
    assert_those_of_the_slow_twin(position, radius, random.choice([0.0, 1e-4, 0.01]))


def random_vectors(random):
    """Thin cells, most of them tilted: upright, as LAMMPS writes them, or any three vectors."""
    vectors = np.diag(random.uniform(0.8, 3.0, 3))
    kind = random.integers(3)
    if kind == 1:
        vectors[[1, 2, 2], [0, 0, 1]] = random.uniform(-2.5, 2.5, 3) * vectors[0, 0]
    while kind == 2:
        vectors = random.normal(size=(3, 3)) * random.uniform(0.5, 2.0)
        if abs(np.linalg.det(vectors)) > 0.3:
            break
    return vectors


def check_random_periodic(random):
    """Any mix of open vectors; grains from dust to some that touch their own images."""
    vectors, count = random_vectors(random), random.integers(1, 7)
    periodic, origin = tuple(random.random(3) < 0.7), random.uniform(-5, 5, 3)
    position = origin + random.uniform(-1, 2, (count, 3)) @ vectors
    radius = random.uniform(0.02, 1.0, count) * random.choice([0.1, 0.3, 0.7])
    radius *= random.choice([1.0, 0.01], count)
    cell = {"vectors": vectors, "periodic": periodic, "origin": origin}
    assert_those_of_the_slow_twin(position, radius, **cell)


@pytest.mark.parametrize(
    ("check", "times"), [(check_random_open, 150), (check_random_periodic, 300)]
)
def test_contacts_are_those_of_the_slow_twin(check, times):
    for seed in range(times):
        check(np.random.default_rng(seed))


def test_wrong_units_and_tolerances_are_told():
    with pytest.raises(PackingError, match="spans 200 periodic cells: have the cell and the radii"):
        find_contacts(Packing([[0.5, 0.5, 0.5]], 100.0, cell=Cell([1.0, 1.0, 1.0])))
    for tolerance in (-1e-9, np.inf, np.nan):
        with pytest.raises(
            scanfab.SettingsError, match="contact_tolerance: expected a number >= 0, found"
        ):
            find_contacts(Packing([[0, 0, 0]], 1.0), tolerance)


@pytest.mark.parametrize("far", [1e3, 1e60])
@pytest.mark.parametrize("cell", [None, Cell([1.0, 1.1, 5.0], (True, True, False))])
def test_grains_that_flew_away_leave_the_bins_small(far, cell):
    """In bins that span all, 20000² / 2 pairs would be looked at; the far ones touch each other."""
    position = np.random.default_rng(4).random((20_000, 3))
    position[::5000, 2] = far
    position[1::5000] = position[::5000] + np.array([0.01, 0.0, 0.0])
    pairs, _ = overlapping_pairs(position, np.full(20_000, 0.02), 1.0, cell)
    is_near = position[:, 2] <= 1
    among, _ = overlapping_pairs(position[is_near], np.full(is_near.sum(), 0.02), 1.0, cell)
    assert is_near[pairs].all(axis=1).sum() == len(among)
    found = {tuple(pair) for pair in pairs[~is_near[pairs].any(axis=1)].tolist()}
    assert {(k, k + 1) for k in range(0, 20_000, 5000)} <= found


@pytest.mark.parametrize("sizes", ["equal", "unlike"])
def test_grains_on_top_of_one_another_are_refused_before_all_pairs_are_tried(sizes):
    """The 5e9 pairs of 100,000 would take all memory; those of 900 are more than usual."""
    random = np.random.default_rng(0)
    radius = np.ones(100_000) if sizes == "equal" else np.exp(random.uniform(0, 7, 100_000))
    position = random.uniform(-1e-3, 1e-3, (100_000, 3))
    with pytest.raises(PackingError, match=r"more than 1000 contacts a grain.*100000.*units"):
        find_contacts(Packing(position, radius))
    few = find_contacts(Packing(position[:900], radius[:900])).contacts
    assert len(few) == 900 * 899 // 2


# lattices and chains


@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize(("lattice", "each"), [(simple_cubic, 6), (face_centred_cubic, 12)])
def test_cubic_lattices_have_their_coordination_and_the_isotropic_fabric(lattice, each, count):
    """A cell of one grain touches nothing but its own images."""
    packing = find_contacts(Packing(*lattice(count), cell=Cell([count] * 3)), TOLERANCE)
    assert len(packing.contacts) == each * len(packing) / 2
    tensor = contact_fabric(packing.contacts.normal)
    assert np.abs(tensor.matrix - np.eye(3) / 3).max() < 1e-9
    assert tensor.alpha < 1e-9
    assert set(sample_of(packing).contact_numbers) == {each}


def test_contacts_listed_twice_or_from_both_sides_count_once():
    """Of two grains in a cell that is thinner than they are along x and y."""
    cell = Cell([0.6, 1.5, 9.0], (True, True, False))
    packing = find_contacts(Packing([[0.1, 0.1, 4], [0.4, 1.3, 4]], 1.0, cell=cell))
    pairs, image = packing.contacts.pairs, packing.contacts.image
    both = np.concatenate([pairs, pairs[:, ::-1], pairs]), np.concatenate([image, -image, image])
    again = packing.with_contacts(ContactList(*both)).contacts
    assert np.array_equal(again.pairs, pairs)
    assert np.array_equal(again.image, image)


def test_a_contact_needs_an_overlap_or_a_gap_below_the_relative_tolerance():
    for scale, radius, tolerance, contacts in (
        (1 - 1e-9, 0.5, 0.0, 54),
        (1 + 1e-9, 0.5, 0.0, 0),
        ((1 + 0.9e-4) * 1e-6, 0.5e-6, TOLERANCE, 54),
        ((1 + 1.1e-4) * 1e-6, 0.5e-6, TOLERANCE, 0),
    ):
        packing = find_contacts(Packing(simple_cubic(3).position * scale, radius), tolerance)
        assert len(packing.contacts) == contacts


# near pairs


@pytest.fixture(scope="module")
def sample():
    random = np.random.default_rng(4)
    cell = Cell(np.array([[6.0, 0, 0], [1.5, 6.0, 0], [0, 0.5, 5.0]]))
    position = random.random((60, 3)) @ cell.vectors
    return sample_of(Packing(position, random.uniform(0.3, 0.6, 60), cell=cell))


def every_pair(packing, chosen, gap):
    """Overlaps, normals and middles of pairs of the chosen grains, one after the other."""
    found = []
    shifts = np.array(list(itertools.product((-1, 0, 1), repeat=3))) @ packing.cell.vectors
    pairs = itertools.combinations(np.flatnonzero(chosen), 2)
    for (one, two), shift in itertools.product(pairs, shifts):
        branch = packing.position[two] + shift - packing.position[one]
        distance = np.linalg.norm(branch)
        overlap = packing.radius[one] + packing.radius[two] - distance
        if overlap > -gap:
            normal = branch / distance
            middle = packing.position[one] + normal * (packing.radius[one] - overlap / 2)
            found.append((overlap, *normal, *middle))
    return np.array(sorted(found))


@pytest.mark.parametrize("variant", ["a", "b"])
def test_pairs_of_a_tilted_cell(sample, variant):
    solid = ~sample.removed(VARIANTS[variant])
    expected = every_pair(sample.packing, solid, 0.25)
    found = near_pairs(sample.packing, solid, sample.grains, None, 0.25)
    assert len(expected) > 20
    order = np.argsort(found.overlap)
    np.testing.assert_allclose(found.overlap[order], expected[:, 0], atol=1e-12)
    turned = np.einsum("ci,ci->c", found.normal[order], expected[:, 1:4])
    np.testing.assert_allclose(np.abs(turned), 1.0, atol=1e-12)
    assert found.volume == pytest.approx(180.0)
    assert found.shadow == pytest.approx(np.pi * np.sum(sample.packing.radius[solid] ** 2))


def test_pairs_of_an_rv_have_their_middles_in_it(sample):
    window = scanfab.Window(np.array([3.0, 3.0, 2.5]), scanfab.sphere(2.0))
    counted = sample.counted(VARIANTS["c"], window)
    found = near_pairs(sample.packing, sample.grains, counted, window, 0.25)
    middles = every_pair(sample.packing, sample.grains, 0.25)[:, 4:]
    assert len(found.overlap) == window.contains(middles, sample.packing).sum()
    inside = window.contains(sample.packing.position, sample.packing)
    assert found.shadow == pytest.approx(np.pi * np.sum(sample.packing.radius[inside] ** 2))
    assert found.volume == pytest.approx(4 / 3 * np.pi * 8)


def test_size_ratio_of_a_thousand_takes_little_memory_and_time():
    """All dust in the bins of one boulder would be 20000² / 2 pairs to look at."""
    position = np.random.default_rng(2).random((20_000, 3))
    radius = np.full(20_000, 2e-4)
    radius[:3] = 0.2
    pairs, _ = overlapping_pairs(position, radius)
    gaps = np.linalg.norm(position[:3, None] - position, axis=2) - (radius[:3, None] + radius)
    with_boulders = {(min(i, j), max(i, j)) for i, j in np.argwhere(gaps < 0).tolist() if i != j}
    assert with_boulders == {tuple(pair) for pair in pairs.tolist() if pair[0] < 3}
