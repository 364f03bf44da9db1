"""The four variants, and the rules for rattlers: known networks, a twin that goes one by one."""

import numpy as np
import pytest

from scanfab import ContactList, Packing, PackingError, ReadError, sphere
from scanfab.packing.rattlers import count, force, recursive
from scanfab.packing.sample import VARIANTS
from scanfab.packing.window import Window
from tests.helpers import naive
from tests.helpers.packed import along_x, sample_of

A, B, C, D = (VARIANTS[name] for name in "abcd")


def row(size):
    return [(k, k + 1) for k in range(size - 1)]


def row_of_grains(count=6, boundary=(), **options):
    """Grains along x at 0, 2, 4, ..., in contact with their neighbours."""
    packing = Packing(along_x(2 * np.arange(count)), 1.0, contacts=row(count), **options)
    return sample_of(packing, boundary)


def rows(mask):
    return np.flatnonzero(mask).tolist()


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


# the rules for rattlers


def network(pairs, size, *, boundary=(), walls=None, least=2, rule=recursive):
    """Grains whose contacts are these, wherever they are."""
    pairs = np.reshape(pairs, (-1, 2))
    packing = Packing(along_x(0.01 * np.arange(size)), 1.0, contacts=pairs, wall_contacts=walls)
    return sample_of(packing, boundary, least, rule)


RING, TAIL = [(0, 1), (1, 2), (2, 3), (3, 0)], [(3, 4), (4, 5), (5, 6)]


@pytest.mark.parametrize(
    ("pairs", "options", "expected"),
    [
        (row(7), {"rule": count}, [0, 6]),
        (row(7), {"rule": count, "least": 1}, []),
        (row(7), {"rule": count, "walls": [1, 0, 0, 0, 0, 0, 0]}, [6]),
        (row(7), {}, [0, 1, 2, 3, 4, 5, 6]),
        ([*RING, *TAIL], {"rule": count}, [6]),
        ([*RING, *TAIL], {}, [4, 5, 6]),
        # a rule says nothing of boundary particles
        (row(7), {"boundary": [1], "rule": lambda _: np.ones(7, bool)}, [0, 2, 3, 4, 5, 6]),
    ],
)
def test_rows_and_rings_fall_apart_from_their_ends(pairs, options, expected):
    assert rows(network(pairs, 7, **options).rattlers) == expected


def random_network(seed):
    random = np.random.default_rng(seed)
    size = int(random.integers(5, 40))
    pairs = random.integers(0, size, (int(random.integers(0, 3 * size)), 2))
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    walls = random.integers(0, 2, size) * random.integers(0, 2, size)
    boundary = np.flatnonzero(random.random(size) < 0.2)
    return pairs, size, boundary, walls


@pytest.mark.parametrize("least", [1, 2, 3, 4])
def test_recursive_is_its_naive_twin(least):
    for seed in range(25):
        pairs, size, boundary, walls = random_network(seed)
        sample = network(pairs, size, boundary=boundary, walls=walls, least=least)
        held = naive.held_grains(pairs.tolist(), walls.tolist(), sample.grains.tolist(), least)
        assert set(rows(sample.grains & ~sample.rattlers)) == held


def test_a_rule_that_gives_something_else_is_an_error():
    sample = network(row(4), 4, rule=lambda sample: np.array([0, 3]))
    with pytest.raises(PackingError, match=r"rattlers: expected shape \(4\), found \(2,\)"):
        _ = sample.rattlers


def test_the_first_sphere_of_a_clump_speaks_for_it():
    packing = Packing(np.eye(3), 0.1, bodies=[1, 1, 2], contacts=[])
    for told, expected in (([1, 0, 0], [0, 1]), ([0, 1, 0], [])):
        rule = lambda _, told=told: np.array(told, bool)  # noqa: E731
        assert rows(sample_of(packing, rattler_rule=rule).rattlers) == expected


def pressed(forces, *, least=2, min_force=0.0, walls=None):
    """Five grains in a row, with these normal forces between them, compression positive."""
    listed = ContactList(row(5), force=along_x(forces))
    packing = Packing(along_x(1.9 * np.arange(5)), 1.0, contacts=listed, wall_contacts=walls)
    return rows(sample_of(packing, (), least, force, min_force).rattlers)


@pytest.mark.parametrize(
    ("forces", "min_force", "expected"),
    [
        ([1, 1, 1, 1], 0.0, [0, 4]),
        ([1, 0, 1, 1], 0.0, [0, 1, 2, 4]),
        ([1, 1, -1, 1], 0.0, [0, 2, 3, 4]),
        ([4, 4, 1, 3], 0.3, [0, 4]),
        ([4, 4, 1, 3], 1 / 3, [0, 2, 3, 4]),  # the mean is 3: at the limit is not above it
        ([4, 4, 1, 3], 1.0, [0, 2, 3, 4]),
        ([0, 0, 0, 0], 0.0, [0, 1, 2, 3, 4]),
    ],
)
def test_by_force_contacts_count_that_press(forces, min_force, expected):
    assert pressed(forces, min_force=min_force) == expected


def test_by_force_contacts_that_pull_in_the_mean_are_refused():
    """With the sign of the other grain's force a limit would hold for the strong contacts."""
    with pytest.raises(ReadError, match="name id1 and id2 the other way round"):
        pressed([-4, -4, -1, -3])


def test_by_force_walls_count_and_it_is_one_pass():
    """The grain in the middle stays, though both that hold it go."""
    assert pressed([0, 1, 1, 0], walls=[1, 0, 0, 0, 2]) == [0, 1, 3]


@pytest.mark.parametrize(
    ("weak", "expected"), [(0, [2, 3, 4]), (1, [2, 3, 4]), (2, [0, 1, 2, 3, 4])]
)
def test_by_force_a_clump_has_the_neighbours_that_press_on_any_of_its_spheres(weak, expected):
    """A clump of two spheres between one of two, which it touches in two points, and a sphere."""
    position = np.array([[0, 0, 0], [0, 3, 0], [1.9, 0, 0], [1.9, 3, 0], [-1.9, 0, 0]])
    forces = np.array([[1.0, 0, 0], [1.0, 0, 0], [-1.0, 0, 0]])
    forces[weak] = 0.0
    listed = ContactList([[0, 2], [1, 3], [0, 4]], force=forces)
    packing = Packing(position, 1.0, bodies=[0, 0, 1, 1, 2], contacts=listed)
    assert rows(sample_of(packing, (), 2, force).rattlers) == expected


def test_by_force_contacts_without_forces_are_an_error():
    for contacts, told in (([[0, 1]], "not in"), (None, "found")):
        packing = Packing(along_x([0, 1.9]), 1.0, contacts=contacts)
        with pytest.raises(ReadError, match=f"needs the forces of the contacts, which are {told}"):
            _ = sample_of(packing, (), 2, force).rattlers
