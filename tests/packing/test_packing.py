"""The common table: every check on grains and contacts, and the geometry of contacts."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.base.errors import PackingError, ScanfabWarning
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing

ROW = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0]])


def in_cell(**arguments):
    """Three grains in a row that touch their own images along x."""
    return Packing(ROW, 1.0, cell=Cell([5.7, 9, 9], (True, False, False)), **arguments)


@pytest.mark.parametrize("position", [[1, 2, 3], [[1, 2, 3, 4]], [[[1, 2, 3]]], 5])
def test_positions_have_three_columns(position):
    with pytest.raises(PackingError, match=r"position: expected shape \(N, 3\), found"):
        Packing(position, 1.0)


@pytest.mark.parametrize("position", [[["a", 0, 0]], [[None, 0, 0]], [[1, 2, 3], [1, 2]]])
def test_positions_are_numbers(position):
    with pytest.raises(PackingError, match="position"):
        Packing(position, 1.0)


@pytest.mark.parametrize(
    ("what", "values"),
    [
        ("radius", [1.0, 1.0]),
        ("id", [1, 2]),
        ("wall_contacts", [0, 0]),
        ("type", [1, 2, 3, 4]),
    ],
)
def test_each_array_has_a_value_for_each_grain(what, values):
    arguments = {"columns": {what: values}} if what == "type" else {what: values}
    with pytest.raises(PackingError, match=f"{what}: expected shape \\(3"):
        Packing(ROW, **{"radius": 1.0, **arguments})


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_positions_and_radii_are_finite_and_the_grain_is_named(wrong):
    message = "grain 20: position and radius must be finite numbers"
    with pytest.raises(PackingError, match=message):
        Packing([ROW[0], [0, wrong, 0], ROW[2]], 1.0, id=[10, 20, 30])
    with pytest.raises(PackingError, match=message):
        Packing(ROW, [1, wrong, 1], id=[10, 20, 30])


@pytest.mark.parametrize("wrong", [1e101, -1e101])
def test_numbers_whose_cube_is_none_are_refused(wrong):
    with pytest.raises(PackingError, match=r"grain 20: .* cannot be a length"):
        Packing([ROW[0], [0, wrong, 0], ROW[2]], 1.0, id=[10, 20, 30])


@pytest.mark.parametrize("wrong", [0.0, -1.0])
def test_radii_are_above_zero_and_the_grains_are_named(wrong):
    with pytest.raises(PackingError, match="grain 30: the radius must be larger than zero"):
        Packing(ROW, [1, 1, wrong], id=[10, 20, 30])
    with pytest.raises(PackingError, match="3 grains, the first is 10: the radius must be"):
        Packing(ROW, wrong, id=[10, 20, 30])


def test_an_id_occurs_once():
    with pytest.raises(PackingError, match="the id 7 occurs twice: 2 ids for 3 grains"):
        Packing(ROW, 1.0, id=[7, 8, 7])


@pytest.mark.parametrize("what", ["id", "wall_contacts"])
def test_counts_are_whole_numbers(what):
    with pytest.raises(PackingError, match=f"{what}: expected whole numbers"):
        Packing(ROW, 1.0, **{what: [1, 2.5, 3]})


def test_whole_numbers_may_come_as_floats():
    np.testing.assert_array_equal(Packing(ROW, 1.0, id=[1.0, 2.0, 5.0]).id, [1, 2, 5])


def test_ids_are_row_numbers_by_default():
    np.testing.assert_array_equal(Packing(ROW, 1.0).id, [0, 1, 2])


def test_one_radius_is_for_all():
    np.testing.assert_array_equal(Packing(ROW, 0.5).radius, [0.5, 0.5, 0.5])


def test_no_grains_are_a_packing():
    packing = Packing(np.zeros((0, 3)), np.zeros(0), contacts=np.zeros((0, 2), int))
    assert len(packing) == len(packing.contacts) == 0


def test_columns_may_hold_vectors_and_words():
    packing = Packing(ROW, 1.0, columns={"v": ROW, "element": ["Si", "O", "O"]})
    assert packing.columns["v"].shape == (3, 3)
    assert packing.columns["element"][0] == "Si"


def test_the_arrays_are_copies_that_cannot_be_written():
    position = ROW.copy()
    packing = Packing(position, 1.0, columns={"type": [1, 2, 3]})
    position[0] = 9
    assert packing.position[0, 0] == 0
    for array in (packing.position, packing.radius, packing.id, packing.columns["type"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5


def test_the_arrays_in_a_cell_cannot_be_written_either():
    with pytest.raises(ValueError, match="read-only"):
        in_cell().position[0] = 5


# contacts


@pytest.mark.parametrize("pair", [[0, 3], [-1, 0], [3, 3]])
def test_a_contact_names_rows_that_exist(pair):
    with pytest.raises(PackingError, match=rf"contact 1 names the rows \[{pair[0]}, {pair[1]}\]"):
        Packing(ROW, 1.0, contacts=[[0, 1], pair])


@pytest.mark.parametrize(
    "contacts", [[0, 1, 2], [[0, 1, 1, 2]], [[0], [1]], [[0, 1, 2], [1, 2, 0]]]
)
def test_contacts_have_two_columns(contacts):
    with pytest.raises(PackingError, match=r"contacts: expected shape \(N, 2\)"):
        Packing(ROW, 1.0, contacts=contacts)


def test_columns_of_pairs_are_not_taken_for_pairs():
    # four grains in a row: rows of first and of second grains
    position = np.vstack([ROW, [[5.7, 0, 0]]])
    with pytest.raises(PackingError):
        Packing(position, 3.0, contacts=[[0, 1, 2], [1, 2, 3]])


@pytest.mark.parametrize("contacts", [[[0, 1.5]], [["a", "b"]], [[0, np.nan]]])
@pytest.mark.filterwarnings("ignore:invalid value encountered in cast")
def test_contacts_are_whole_numbers(contacts):
    with pytest.raises(PackingError, match="contacts: expected"):
        Packing(ROW, 1.0, contacts=contacts)


@pytest.mark.parametrize(
    ("what", "values", "shape"),
    [("force", [[1, 2, 3]], r"\(2, 3\)"), ("image", [[0, 0, 0]], r"\(2, 3\)")],
)
def test_each_contact_has_its_own_force_and_image(what, values, shape):
    with pytest.raises(PackingError, match=f"{what}: expected shape {shape}"):
        Packing(ROW, 1.0, contacts=ContactList([[0, 1], [1, 2]], **{what: values}))


def test_grains_with_the_same_centre_are_no_contact():
    with pytest.warns(ScanfabWarning, match="grains 20 and 30 have the same centre.*left out"):
        packing = Packing(ROW[[0, 1, 1]], 1.0, id=[10, 20, 30], contacts=[[0, 1], [1, 2]])
    assert packing.contacts.pairs.tolist() == [[0, 1]]


def test_a_grain_does_not_touch_itself():
    with pytest.raises(PackingError, match="grain 10: in contact with itself"):
        Packing(ROW, 1.0, id=[10, 20, 30], contacts=[[0, 0]])


@pytest.mark.parametrize("radius", [[1.0, 0.5, 1.0], [0.5, 1.0, 1.0]])
def test_a_contact_may_be_open_by_half_the_smaller_grain(radius):
    for gap in (0.0, 0.49):
        Packing([[0, 0, 0], [1.5 + gap, 0, 0], [9, 0, 0]], radius, contacts=[[0, 1]])
    with pytest.raises(
        PackingError, match=r"centres are 2\.01 apart and their radii add up to 1.5"
    ):
        Packing([[0, 0, 0], [2.01, 0, 0], [9, 0, 0]], radius, contacts=[[0, 1]])


def test_a_long_contact_without_a_cell_asks_for_one():
    with pytest.raises(PackingError, match=r"10 and 30.*\(`cell` and `periodic`\).*another step"):
        Packing(ROW, 1.0, id=[10, 20, 30], contacts=[[0, 1], [0, 2]])


def test_a_long_contact_in_a_box_that_does_not_repeat_asks_for_a_cell():
    with pytest.raises(PackingError, match="name its cell"):
        Packing(ROW, 1.0, contacts=[[0, 2]], cell=Cell([5.7, 9, 9], (False, False, False)))


def test_a_long_contact_in_a_periodic_cell_asks_for_the_step():
    with pytest.raises(PackingError, match="is this the contact list of another step"):
        Packing([[0, 0, 0], [1.9, 4, 0]], 1.0, contacts=[[0, 1]], cell=Cell([5.7, 9, 9]))


def test_normals_point_from_the_first_to_the_second_grain():
    contacts = Packing(ROW, 1.0, contacts=[[0, 1], [2, 1]]).contacts
    np.testing.assert_array_equal(contacts.normal, [[1, 0, 0], [-1, 0, 0]])


def test_the_point_is_the_middle_of_the_overlap():
    position, radius = [[0, 0, 0], [0, 2.9, 0], [9, 9, 9]], [1, 2, 1]
    for pair in ([0, 1], [1, 0]):
        point = Packing(position, radius, contacts=[pair]).contacts.point
        np.testing.assert_allclose(point, [[0, 0.95, 0]])


def test_a_contact_through_a_face_takes_the_nearest_image():
    contacts = in_cell(contacts=[[2, 0]]).contacts
    np.testing.assert_array_equal(contacts.image, [[1, 0, 0]])
    np.testing.assert_allclose(contacts.normal, [[1, 0, 0]])
    np.testing.assert_allclose(contacts.point, [[4.75, 0, 0]])


def test_a_contact_may_name_its_image():
    contacts = in_cell(contacts=ContactList([[0, 2]], image=[[-1, 0, 0]])).contacts
    np.testing.assert_allclose(contacts.normal, [[-1, 0, 0]])


def test_each_pair_counts_once_whichever_grain_is_first():
    contacts = Packing(ROW, 1.0, contacts=[[1, 0], [0, 1], [1, 2], [1, 0]]).contacts
    np.testing.assert_array_equal(contacts.pairs, [[1, 0], [1, 2]])


def test_of_a_repeated_contact_the_first_force_counts():
    force = [[1, 0, 0], [2, 0, 0], [3, 0, 0]]
    listed = ContactList([[1, 0], [0, 1], [1, 2]], force=force)
    np.testing.assert_array_equal(
        Packing(ROW, 1.0, contacts=listed).contacts.force, [[1, 0, 0], [3, 0, 0]]
    )


def test_two_images_of_one_pair_are_two_contacts():
    # two grains that touch on both sides
    cell = Cell([3.8, 9, 9])
    image = [[0, 0, 0], [-1, 0, 0], [1, 0, 0]]
    listed = ContactList([[0, 1], [0, 1], [1, 0]], image=image)
    packing = Packing(ROW[:2], 1.0, contacts=listed, cell=cell)
    np.testing.assert_array_equal(packing.contacts.image, [[0, 0, 0], [-1, 0, 0]])


def test_a_grain_touches_its_own_image_once():
    listed = ContactList([[0, 0], [0, 0]], image=[[1, 0, 0], [-1, 0, 0]])
    packing = Packing([[0, 0, 0]], 1.0, contacts=listed, cell=Cell([1.9, 9, 9]))
    assert len(packing.contacts) == 1


def test_the_source_of_a_list_is_kept():
    assert Packing(ROW, 1.0, contacts=[[0, 1]]).contacts.source == "file"
    assert in_cell().contacts is None
    assert in_cell().with_contacts(ContactList([], source="geometric")).contacts.source == (
        "geometric"
    )


def test_other_contacts_keep_everything_else():
    packing = Packing(
        ROW,
        1.0,
        id=[5, 6, 7],
        columns={"type": [1, 2, 3]},
        wall_contacts=[1, 0, 2],
        step=4,
        time=0.5,
    )
    other = packing.with_contacts(ContactList([[0, 1]]))
    np.testing.assert_array_equal(other.id, packing.id)
    np.testing.assert_array_equal(other.columns["type"], [1, 2, 3])
    np.testing.assert_array_equal(other.wall_contacts, [1, 0, 2])
    assert (other.step, other.time, len(other.contacts)) == (4, 0.5, 1)


@pytest.mark.parametrize("x", [-1e-17, -1e-300, 5.7, 11.4, -5.7])
def test_centres_are_wrapped_into_the_cell(x):
    packing = Packing([[x, 0, 0]], 1.0, cell=Cell([5.7, 9, 9]))
    assert 0 <= packing.position[0, 0] < 5.7


def test_centres_are_not_wrapped_along_vectors_that_do_not_repeat():
    packing = Packing([[6.0, -3.0, 0]], 1.0, cell=Cell([5.7, 9, 9], (True, False, False)))
    np.testing.assert_allclose(packing.position, [[0.3, -3.0, 0]])


def test_what_is_no_cell_is_told():
    with pytest.raises(PackingError, match=r"cell: expected a Cell, .* found 3"):
        Packing([[0, 0, 0]], 1.0, cell=3)
