"""The common table: every check on grains and contacts, and the geometry of contacts."""

import numpy as np
import pytest

from scanfab.base.errors import PackingError, ScanfabWarning
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing
from scanfab.packing.search import find_contacts
from tests.helpers.lattices import shaken_cubic

PAIR = np.array([[0.0, 0, 0], [1.9, 0, 0]])
PUSH = np.array([2.0, 0.5, -1.0])
ROW = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0]])


def in_cell(**arguments):
    """Three grains in a row that touch their own images along x."""
    return Packing(ROW, 1.0, cell=Cell([5.7, 9, 9], (True, False, False)), **arguments)


BOX = Cell([5.7, 9, 9], (False, False, False))
WIDE = {"position": 2 * ROW, "contacts": [[0, 1]], "cell": Cell([11.4, 9, 9])}


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"position": [[1, 2, 3, 4]]}, r"position: expected shape \(N, 3\), found"),
        ({"position": [[1, 2, 3], [1, 2]]}, "position"),
        ({"position": [ROW[0], [0, np.nan, 0], ROW[2]]}, "grain 20: .* finite numbers"),
        ({"position": [ROW[0], [0, -1e101, 0], ROW[2]]}, "grain 20: .* cannot be a length"),
        ({"radius": [1.0, 1.0]}, r"radius: expected shape \(3"),
        ({"radius": [1, np.inf, 1]}, "grain 20: position and radius must be finite numbers"),
        ({"radius": [1, 1, 0.0]}, "grain 30: the radius must be larger than zero"),
        ({"radius": -1.0}, "3 grains, the first is 10: the radius must be"),
        ({"radius": [1, 1, 1e-101]}, "grain 30: .* cannot be a length"),
        ({"id": [7, 8, 7]}, "the id 7 occurs twice: 2 ids for 3 grains"),
        ({"id": [1, 2.5, 3]}, "id: expected whole numbers"),
        ({"wall_contacts": [1, -1, 3]}, "wall_contacts: expected 0 or more for each grain"),
        ({"columns": {"type": [1, 2, 3, 4]}}, r"type: expected shape \(3"),
        ({"cell": 3}, "cell: expected a Cell, .* found 3"),
        ({"contacts": [[0, 1], [-1, 0]]}, r"contact 1 names the rows \[-1, 0\]"),
        ({"contacts": [[0, 1, 2], [1, 2, 0]]}, r"contacts: expected shape \(N, 2\)"),
        ({"contacts": [[0, 1.5]]}, "contacts: expected"),
        ({"contacts": ContactList([[0, 1]], force=[[1, 2]])}, r"force: expected shape \(1, 3\)"),
        ({"contacts": ContactList([[0, 1]], force_n=[1.0, 2.0])}, r"force_n: expected shape \(1"),
        ({"contacts": ContactList([[0, 1]], image=[[0, 0]])}, r"image: expected shape \(1, 3\)"),
        ({"contacts": [[0, 0]], "bodies": [3, 3, -1]}, "grain 10: in contact with itself"),
        (
            {"contacts": [[0, 0]], "cell": Cell([2.0, 9, 9])},
            r"itself; find .*own images.*`contacts=",
        ),
        ({"contacts": [[0, 1]], "cell": Cell([1.5, 9, 9])}, "through more than one .*geometric"),
        (
            {"contacts": ContactList([[0, 1]], image=[[0, 0, 1]]), "cell": BOX},
            "passes a face that is not periodic",
        ),
        ({"contacts": [[0, 3]]}, r"contact 0 names the rows \[0, 3\]"),
        (WIDE, "does the cell .* belong to this sample"),
        (
            {"contacts": [[0, 2]], "cell": BOX},
            r"10 and 30.*\(`cell` and `periodic`\).*another step",
        ),
    ],
)
def test_what_is_no_packing_is_told_by_grain_and_array(given, told):
    with pytest.raises(PackingError, match=told):
        Packing(**{"position": ROW, "radius": 1.0, "id": [10, 20, 30], **given})


def test_what_a_packing_takes():
    """No grains, numbers of any kind, columns of vectors and words."""
    empty = Packing(np.zeros((0, 3)), np.zeros(0), contacts=np.zeros((0, 2), int))
    assert len(empty) == len(empty.contacts) == 0
    columns = {"v": ROW, "element": ["Si", "O", "O"]}
    packing = Packing(ROW, 0.5, id=[1.0, 2.0, 5.0], columns=columns)
    assert packing.id.tolist() == [1, 2, 5]
    assert packing.columns["v"].shape == (3, 3)
    assert packing.columns["element"][0] == "Si"


def test_the_arrays_are_copies_that_cannot_be_written():
    position = ROW.copy()
    packing = Packing(position, 1.0, columns={"type": [1, 2, 3]})
    position[0] = 9
    assert packing.position[0, 0] == 0
    arrays = packing.position, packing.radius, packing.id, packing.columns["type"]
    for array in (*arrays, in_cell().position):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5


def test_grains_with_the_same_centre_are_no_contact():
    with pytest.warns(ScanfabWarning, match="grains 20 and 30 have the same centre.*left out"):
        packing = Packing(ROW[[0, 1, 1]], 1.0, id=[10, 20, 30], contacts=[[0, 1], [1, 2]])
    assert packing.contacts.pairs.tolist() == [[0, 1]]


@pytest.mark.parametrize("radius", [[1.0, 0.5, 1.0], [0.5, 1.0, 1.0]])
def test_a_contact_may_be_open_by_half_the_smaller_grain(radius):
    for gap in (0.0, 0.49):
        Packing([[0, 0, 0], [1.5 + gap, 0, 0], [9, 0, 0]], radius, contacts=[[0, 1]])
    told = r"centres are 2\.01 apart and their radii add up to 1.5"
    with pytest.raises(PackingError, match=told):
        Packing([[0, 0, 0], [2.01, 0, 0], [9, 0, 0]], radius, contacts=[[0, 1]])


def test_the_point_is_the_middle_of_the_overlap():
    position, radius = [[0, 0, 0], [0, 2.9, 0], [9, 9, 9]], [1, 2, 1]
    for pair in ([0, 1], [1, 0]):
        point = Packing(position, radius, contacts=[pair]).contacts.point
        np.testing.assert_allclose(point, [[0, 0.95, 0]])


def test_a_contact_through_a_face_takes_the_nearest_image():
    contacts = in_cell(contacts=ContactList([[2, 0]], force=[[3.0, 1, 0]])).contacts
    np.testing.assert_array_equal(contacts.image, [[1, 0, 0]])
    np.testing.assert_allclose(contacts.normal, [[1, 0, 0]])
    np.testing.assert_allclose(contacts.point, [[4.75, 0, 0]])
    np.testing.assert_allclose(contacts.force_n, [3.0])


def test_each_pair_counts_once_with_its_first_force_whichever_grain_is_first():
    force = np.outer([1, 2, 3, 4], [1, 0, 0])
    listed = ContactList([[1, 0], [0, 1], [1, 2], [1, 0]], force=force)
    contacts = Packing(ROW, 1.0, contacts=listed).contacts
    np.testing.assert_array_equal(contacts.pairs, [[1, 0], [1, 2]])
    np.testing.assert_array_equal(contacts.force, force[[0, 2]])


def test_other_contacts_keep_everything_else():
    """Also the number of those with walls."""
    packing = Packing(ROW, 1.0, id=[5, 6, 7], step=4, wall_contacts=[1, 0, 2])
    other = packing.with_contacts(ContactList([[0, 1]], source="geometric"))
    assert other.contacts.source == "geometric"
    assert (other.step, *other.id, *other.wall_contacts) == (4, 5, 6, 7, 1, 0, 2)
    assert packing.contacts is None


@pytest.fixture(scope="module")
def sheared():
    """125 unequal grains in a cell that is tilted by more than its length."""
    spheres = shaken_cubic(np.random.default_rng(2), 5)
    return spheres, np.array([[5.0, 0, 0], [6.5, 5, 0], [-2.0, 7.1, 5]])


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


# forces


@pytest.mark.parametrize(
    ("given", "expected"), [([-4.0], -4.0), ([[-4.0, 0, 0]], -4.0), ([[0.0, 4, 0]], 0.0)]
)
def test_a_normal_force_is_a_number_or_a_vector_on_the_second_grain(given, expected):
    """Where the whole force is known, the normal force follows from that."""
    both = ContactList([[0, 1]], force=[PUSH], force_n=[7.0])
    np.testing.assert_array_equal(Packing(PAIR, 1.0, contacts=both).contacts.force_n, [2.0])
    contacts = Packing(PAIR, 1.0, contacts=ContactList([[0, 1]], force_n=given)).contacts
    assert contacts.force is None
    np.testing.assert_array_equal(contacts.force_n, [expected])
    assert repr(contacts) == "Contacts: 1 contact from file with normal forces"
