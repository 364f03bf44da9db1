"""Contacts joined to grains: by ids or by places, with walls, errors and periodic faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scanfab.base.errors import ReadError
from scanfab.io.contacts import join_ids, join_positions, rows_of_ids
from scanfab.io.reader import GrainTable
from scanfab.packing.cell import Cell

PATH = Path("contacts.txt")
POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0], [5.7, 0, 0]])


def grains(id=(40, 10, 30, 20), cell=None, position=POSITION):
    return GrainTable(position, np.ones(4), None if id is None else np.array(id), {}, cell)


def by_ids(ids, force=None, walls=False, **table):
    return join_ids(PATH, grains(**table), np.array(ids), force, walls=walls)


def by_places(ends, force=None, **table):
    return join_positions(PATH, grains(**table), np.array(ends, dtype=float), force)


def test_ids_become_rows_in_any_order():
    np.testing.assert_array_equal(rows_of_ids(grains(), [10, 20, 30, 40, 50]), [1, 3, 2, 0, -1])


def test_without_ids_no_row_is_found():
    np.testing.assert_array_equal(rows_of_ids(grains(id=None), [10, 20]), [-1, -1])


def test_contacts_by_ids_name_rows_in_the_order_of_the_file():
    joined = by_ids([[10, 30], [40, 10]])
    np.testing.assert_array_equal(joined.contacts.pairs, [[1, 2], [0, 1]])
    np.testing.assert_array_equal(joined.wall_contacts, [0, 0, 0, 0])


def test_an_unknown_id_is_an_error_that_names_it_and_asks_for_the_step():
    with pytest.raises(ReadError, match=r"contact 2 names the grain 77.*\(1 of 3.*the same step"):
        by_ids([[10, 30], [77, 10], [30, 20]])


def test_an_unknown_id_may_be_a_wall():
    joined = by_ids([[10, 30], [77, 10], [30, 78], [10, 79]], walls=True)
    np.testing.assert_array_equal(joined.contacts.pairs, [[1, 2]])
    np.testing.assert_array_equal(joined.wall_contacts, [0, 2, 1, 0])


def test_two_walls_are_an_error():
    with pytest.raises(ReadError, match="contact 1 names the grain 77"):
        by_ids([[77, 78]], walls=True)


def test_grains_without_ids_are_an_error():
    with pytest.raises(ReadError, match="names grains by id, but the grain file has no ids"):
        by_ids([[10, 30]], id=None)


def test_forces_stay_with_their_contacts_when_walls_are_taken_out():
    force = np.arange(9.0).reshape(3, 3)
    joined = by_ids([[10, 30], [77, 10], [30, 20]], force, walls=True)
    np.testing.assert_array_equal(joined.contacts.force, force[[0, 2]])


def test_no_contacts_are_no_error():
    joined = by_ids(np.zeros((0, 2), int))
    assert len(joined.contacts.pairs) == 0
    assert len(by_places(np.zeros((0, 2, 3))).contacts.pairs) == 0


def test_ends_of_a_line_become_the_grains_that_are_there():
    joined = by_places([POSITION[[2, 1]], POSITION[[0, 1]]], id=None)
    np.testing.assert_array_equal(joined.contacts.pairs, [[2, 1], [0, 1]])


def test_ends_may_be_rounded():
    ends = POSITION[[2, 1]] + 0.009
    assert len(by_places([ends * [1, 0, 0]]).contacts.pairs) == 1


def test_an_end_where_no_grain_is_belongs_to_a_wall():
    joined = by_places([[POSITION[2], [3.8, 1, 0]], [[0, -1, 0], POSITION[0]]])
    assert len(joined.contacts.pairs) == 0
    np.testing.assert_array_equal(joined.wall_contacts, [1, 0, 1, 0])


def test_two_ends_without_a_grain_are_an_error_that_names_the_place():
    with pytest.raises(ReadError, match=r"contact 1 ends at \[9\.0, 9\.0, 9\.0\], where no grain"):
        by_places([[[9, 9, 9], [8, 8, 8]]])


def test_ends_outside_a_periodic_cell_are_wrapped():
    cell = Cell([7.6, 4, 4])
    joined = by_places([[POSITION[3], [7.6, 0, 0]], [[-1.9, 4, -4], POSITION[0]]], cell=cell)
    np.testing.assert_array_equal(joined.contacts.pairs, [[3, 0], [3, 0]])


@pytest.mark.parametrize("error", [-1e-9, -1e-17, 0.0, 1e-9])
def test_rounding_at_a_face_does_not_part_an_end_from_its_grain(error):
    cell = Cell([7.6, 4, 4])
    joined = by_places([[POSITION[3], [7.6 + error, error, error]]], cell=cell)
    np.testing.assert_array_equal(joined.contacts.pairs, [[3, 0]])


def test_without_a_cell_the_image_of_a_grain_is_no_wall():
    with pytest.raises(ReadError, match=r"1 contacts end at periodic images of grains.*`cell="):
        by_places([[POSITION[3], [7.6, 0, 0]]])


def test_no_grains_at_all_are_an_error_of_the_contact():
    empty = GrainTable(np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int64), {}, None)
    with pytest.raises(ReadError, match=r"contact 1 names the grain 1.*same step"):
        join_ids(PATH, empty, np.array([[1, 2]]), None, walls=False)
