"""Contacts joined to grains: by ids or by places, with walls, errors and periodic faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scanfab import ReadError
from scanfab.io import GrainTable, join_ids, join_positions
from scanfab.packing.cell import Cell
from tests.helpers.dumps import holds
from tests.helpers.fuzzing import only_scanfabs_warnings

PATH = Path("contacts.txt")
POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0], [5.7, 0, 0]])
CELL = Cell([7.6, 4, 4])


def grains(id=(40, 10, 30, 20), cell=None):
    ids = None if id is None else np.array(id, dtype=np.int64)
    return GrainTable(POSITION, np.ones(len(POSITION)), ids, {}, cell)


def by_places(ends, cell=None):
    return join_positions(PATH, grains(None, cell), np.array(ends, dtype=float), None)


UNKNOWN = [
    ([[10, 30], [77, 10], [30, 20]], False, r"contact 2 names the grain 77.*\(1 of 3.*same st"),
    ([[77, 78]], True, "contact 1 names the grain 77"),
    ([[77, 10]], "negative", "contact 1 names the grain 77"),
]


@pytest.mark.parametrize(("ids", "walls", "message"), UNKNOWN)
def test_an_unknown_id_is_an_error_that_names_it_and_asks_for_the_step(ids, walls, message):
    with pytest.raises(ReadError, match=message):
        join_ids(PATH, grains(), np.array(ids), None, walls=walls)


def test_an_unknown_id_may_be_a_wall():
    force = np.arange(12.0).reshape(4, 3)
    ids = np.array([[10, 30], [77, 10], [30, 78], [10, 79]])
    joined = join_ids(PATH, grains(), ids, force, walls=True)
    holds(joined.contacts, pairs=[[1, 2]], force=force[:1])
    holds(joined, wall_contacts=[0, 2, 1, 0])


def test_ends_of_a_line_are_grains_or_walls():
    rounded = POSITION[[2, 1]] + [0.009, 0, 0]
    wall = [[POSITION[2], [3.8, 1, 0]], [[0, -1, 0], POSITION[0]]]
    joined = by_places([rounded, POSITION[[0, 1]], *wall])
    holds(joined.contacts, pairs=[[2, 1], [0, 1]])
    holds(joined, wall_contacts=[1, 0, 1, 0])
    assert len(by_places(np.zeros((0, 2, 3))).contacts.pairs) == 0
    with pytest.raises(ReadError, match=r"contact 1 ends at a grain at \[9\.0, 9\.0, 9\.0\]"):
        by_places([[[9, 9, 9], [8, 8, 8]]])


@pytest.mark.parametrize("error", [-1e-9, -1e-17, 0.0, 1e-9])
def test_ends_outside_a_periodic_cell_are_wrapped_and_rounding_does_no_harm(error):
    ends = [[POSITION[3], [7.6 + error, error, error]], [[-1.9, 4, -4], POSITION[0]]]
    np.testing.assert_array_equal(by_places(ends, CELL).contacts.pairs, [[3, 0], [3, 0]])


def test_without_a_cell_the_image_of_a_grain_is_no_wall():
    with pytest.raises(ReadError, match=r"1 contacts end at periodic images.*`cell="):
        by_places([[POSITION[3], [7.6, 0, 0]]])


@pytest.mark.parametrize(
    ("end", "place", "radius"),
    [(np.nan, 0, 1), (np.inf, 0, 1), (1e300, 0, 1), (1, np.nan, 1), (1, 0, np.nan), (1, 0, np.inf)],
)
def test_ends_that_are_no_places_are_refused_without_a_warning(end, place, radius):
    found = GrainTable(np.full((1, 3), place), np.full(1, radius), None, {}, Cell([4, 4, 4]))
    with only_scanfabs_warnings(), pytest.raises(ReadError, match="finite"):
        join_positions(PATH, found, np.array([[[0, 0, 0], [end, 0, 0]]]), None)


def test_a_large_grain_in_a_small_cell_has_few_images():
    found = GrainTable(np.zeros((1, 3)), np.array([1e50]), None, {}, Cell([4, 4, 4]))
    joined = join_positions(PATH, found, np.array([[[0.0, 0, 0], [1, 0, 0]]]), None)
    assert joined.contacts.pairs.tolist() == [[0, 0]]
