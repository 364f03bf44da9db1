"""Contacts joined to grains: by ids or by places, with walls, errors and periodic faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scanfab.base.errors import ReadError
from scanfab.io.contacts import join_ids, join_positions
from scanfab.io.reader import GrainTable
from scanfab.packing.cell import Cell

PATH = Path("contacts.txt")
POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0], [5.7, 0, 0]])


def grains(id=(40, 10, 30, 20), cell=None, position=POSITION):
    ids = None if id is None else np.array(id, dtype=np.int64)
    return GrainTable(position, np.ones(len(position)), ids, {}, cell)


def by_ids(ids, force=None, walls=False, **table):
    return join_ids(PATH, grains(**table), np.array(ids), force, walls=walls)


def by_places(ends, force=None, **table):
    return join_positions(PATH, grains(**table), np.array(ends, dtype=float), force)


def test_contacts_by_ids_name_rows_in_the_order_of_the_file():
    joined = by_ids([[10, 30], [40, 10]])
    np.testing.assert_array_equal(joined.contacts.pairs, [[1, 2], [0, 1]])
    np.testing.assert_array_equal(joined.wall_contacts, [0, 0, 0, 0])


@pytest.mark.parametrize(
    ("ids", "options", "message"),
    [
        ([[10, 30], [77, 10], [30, 20]], {}, r"contact 2 names the grain 77.*\(1 of 3.*same step"),
        ([[77, 78]], {"walls": True}, "contact 1 names the grain 77"),
        ([[10, 30]], {"id": None}, "the grain file has no ids"),
        ([[1, 2]], {"id": [], "position": np.zeros((0, 3))}, "contact 1 names the grain 1"),
    ],
)
def test_an_unknown_id_is_an_error_that_names_it_and_asks_for_the_step(ids, options, message):
    with pytest.raises(ReadError, match=message):
        by_ids(ids, **options)


def test_an_unknown_id_may_be_a_wall():
    force = np.arange(12.0).reshape(4, 3)
    joined = by_ids([[10, 30], [77, 10], [30, 78], [10, 79]], force, walls=True)
    np.testing.assert_array_equal(joined.contacts.pairs, [[1, 2]])
    np.testing.assert_array_equal(joined.contacts.force, force[:1])
    np.testing.assert_array_equal(joined.wall_contacts, [0, 2, 1, 0])


def test_no_contacts_are_no_error():
    joined = by_ids(np.zeros((0, 2), int))
    assert len(joined.contacts.pairs) == 0
    assert len(by_places(np.zeros((0, 2, 3))).contacts.pairs) == 0


def test_ends_of_a_line_become_the_grains_that_are_there():
    rounded = POSITION[[2, 1]] + [0.009, 0, 0]
    joined = by_places([rounded, POSITION[[0, 1]]], id=None)
    np.testing.assert_array_equal(joined.contacts.pairs, [[2, 1], [0, 1]])


def test_an_end_where_no_grain_is_belongs_to_a_wall():
    joined = by_places([[POSITION[2], [3.8, 1, 0]], [[0, -1, 0], POSITION[0]]])
    assert len(joined.contacts.pairs) == 0
    np.testing.assert_array_equal(joined.wall_contacts, [1, 0, 1, 0])


def test_two_ends_without_a_grain_are_an_error_that_names_the_place():
    with pytest.raises(ReadError, match=r"contact 1 ends at a grain at \[9\.0, 9\.0, 9\.0\]"):
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
