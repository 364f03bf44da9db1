"""From named columns to positions, radii, ids and the cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scanfab.base.errors import ReadError, SettingsError
from scanfab.io.columns import (
    grain_table,
    has_radius,
    user_cell,
)
from scanfab.io.reader import ReadOptions
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

PATH = Path("dump.txt")
POSITION = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
RADIUS = np.array([0.01, 0.02])
BOX = Cell([2.0, 4.0, 8.0], (False, False, False), [-1.0, 0.0, 1.0])


def columns(names="x y z", position=POSITION, **more):
    return {**dict(zip(names.split(), position.T, strict=True)), "radius": RADIUS, **more}


def table(found, cell=None, **options):
    return grain_table(PATH, found, cell, ReadOptions(**options), ", step 5")


@pytest.mark.parametrize("names", ["x y z", "X Y Z", "xu yu zu"])
def test_coordinates_are_known_by_name(names):
    np.testing.assert_array_equal(table(columns(names)).position, POSITION)


@pytest.mark.parametrize("names", ["xs ys zs", "xsu ysu zsu"])
def test_scaled_coordinates_are_fractions_of_the_box(names):
    expected = POSITION * [2, 4, 8] + [-1, 0, 1]
    np.testing.assert_allclose(table(columns(names), BOX).position, expected, rtol=1e-15)


def test_scaled_coordinates_follow_a_tilted_box():
    cell = Cell([[2, 0, 0], [0.5, 3, 0], [0.25, -0.5, 4]])
    np.testing.assert_allclose(
        table(columns("xs ys zs"), cell).position, POSITION @ cell.vectors, rtol=1e-15
    )


def test_scaled_coordinates_need_a_box():
    with pytest.raises(ReadError, match=r"dump.txt, step 5: xs ys zs are fractions of a box"):
        table(columns("xs ys zs"))


def test_plain_coordinates_come_before_the_others():
    both = {**columns("xs ys zs", 9 * POSITION), **columns()}
    np.testing.assert_array_equal(table(both, BOX).position, POSITION)


def test_a_column_may_be_called_position():
    found = table({**columns(), "position": RADIUS})
    np.testing.assert_array_equal(found.position, POSITION)
    np.testing.assert_array_equal(found.columns["position"], RADIUS)


def test_a_column_of_vectors_is_a_position():
    for position in (POSITION, POSITION.tolist()):
        found = {"position": position, "radius": RADIUS}
        np.testing.assert_array_equal(table(found).position, POSITION)


def test_radii_stay_those_of_the_reader_that_hands_them_over():
    radius = RADIUS.copy()
    found = table(columns(radius=radius))
    packing = Packing(found.position, found.radius)
    radius[0] = 99
    np.testing.assert_array_equal(packing.radius, RADIUS)


def test_users_may_name_coordinates():
    found = columns("px py pz")
    grains = table(found, columns={"x": "px", "y": "py", "z": "pz"})
    np.testing.assert_array_equal(grains.position, POSITION)
    assert grains.columns == {}


def test_users_may_name_one_coordinate_only():
    grains = table(columns("x y depth"), columns={"z": "depth"})
    np.testing.assert_array_equal(grains.position, POSITION)


def test_missing_coordinates_are_an_error_that_lists_what_there_is():
    with pytest.raises(ReadError, match=r'no coordinates.*found x, y, radius.*`columns=."x": '):
        table({"x": POSITION[:, 0], "y": POSITION[:, 1], "radius": RADIUS})


@pytest.mark.parametrize("name", ["radius", "radii", "Radius", "RADIUS", "rad", "r", "R"])
def test_a_radius_has_many_names(name):
    found = {"position": POSITION, name: RADIUS}
    np.testing.assert_array_equal(table(found).radius, RADIUS)
    assert has_radius(list(found))


@pytest.mark.parametrize("name", ["diameter", "Diameter", "diam"])
def test_a_diameter_is_halved(name):
    found = {"position": POSITION, name: 2 * RADIUS}
    np.testing.assert_array_equal(table(found).radius, RADIUS)
    assert has_radius(list(found))


def test_a_radius_comes_before_a_diameter():
    grains = table(columns(diameter=2 * RADIUS))
    np.testing.assert_array_equal(grains.radius, RADIUS)
    np.testing.assert_array_equal(grains.columns["diameter"], 2 * RADIUS)


def test_a_radius_and_a_diameter_that_say_different_sizes_are_an_error():
    with pytest.raises(ReadError, match="'radius' and 'diameter' contradict each other"):
        table(columns(diameter=7 * RADIUS))
    grains = table(columns(diameter=7 * RADIUS), columns={"radius": "radius"})
    np.testing.assert_array_equal(grains.radius, RADIUS)
    np.testing.assert_array_equal(grains.columns["diameter"], 7 * RADIUS)


def test_users_may_name_the_radius():
    grains = table({"position": POSITION, "c_rad": RADIUS}, columns={"radius": "c_rad"})
    np.testing.assert_array_equal(grains.radius, RADIUS)


def test_users_may_name_a_diameter():
    grains = table({"position": POSITION, "size": 2 * RADIUS}, columns={"diameter": "size"})
    np.testing.assert_array_equal(grains.radius, RADIUS)


def test_users_may_give_one_radius_for_all():
    np.testing.assert_array_equal(table({"position": POSITION}, radius=0.5).radius, [0.5, 0.5])


@pytest.mark.parametrize("name", ["radius", "Diameter", "size"])
def test_one_radius_for_all_does_not_replace_those_of_the_dump(name):
    named = {"radius": name} if name == "size" else {}
    with pytest.raises(ReadError, match="`radius` is for dumps without radii"):
        table({"position": POSITION, name: RADIUS}, columns=named, radius=0.5)


def test_no_radius_is_an_error_that_names_both_ways_out():
    with pytest.raises(ReadError, match=r"step 5: no radius.*type.*`columns=.*`radius`"):
        table({"position": POSITION, "type": RADIUS})


def test_a_point_array_called_scalars_is_no_radius():
    assert not has_radius(["scalars", "mass", "type"])


def test_a_column_that_does_not_exist_is_an_error_that_lists_those_that_do():
    with pytest.raises(
        ReadError, match=r"no column 'rr' to serve as radius; .*are x, y, z, radius"
    ):
        table(columns(), columns={"radius": "rr"})


@pytest.mark.parametrize("name", ["id", "ID", "Id", "ids", "particle_id", "body_id"])
def test_ids_have_many_names(name):
    grains = table(columns(**{name: np.array([7.0, 1000003.0])}))
    np.testing.assert_array_equal(grains.id, [7, 1000003])
    assert grains.id.dtype == np.int64


def test_users_may_name_the_ids():
    grains = table(columns(number=np.array([3, 4])), columns={"id": "number"})
    np.testing.assert_array_equal(grains.id, [3, 4])


def test_without_ids_there_are_none():
    assert table(columns()).id is None


@pytest.mark.parametrize("wrong", [1.5, np.nan, np.inf, 2.0**53, -(2.0**53), 1e300])
def test_ids_must_be_whole_numbers(wrong):
    with pytest.raises(ReadError, match="step 5: ids must be whole numbers"):
        table(columns(id=np.array([1.0, wrong])))


@pytest.mark.parametrize("id", [2**53 + 1, 2**63 - 1, -(2**63)])
def test_ids_that_are_no_decimals_are_exact(id):
    assert table(columns(id=np.array([1, id]))).id[1] == id


def test_all_other_columns_keep_their_names():
    grains = table(columns(type=np.array([1, 2]), c_ca=np.array([5, 6])))
    assert sorted(grains.columns) == ["c_ca", "type"]


def test_standard_names_of_other_columns_are_renamed():
    grains = table(columns(phase=np.array([1, 2])), columns={"type": "phase"})
    np.testing.assert_array_equal(grains.columns["type"], [1, 2])
    assert "phase" not in grains.columns


def test_the_users_cell_replaces_the_dumps_and_keeps_its_corner():
    cell = user_cell(PATH, BOX, ReadOptions(cell=(3.0, 5.0, 7.0)))
    np.testing.assert_array_equal(cell.vectors, np.diag([3.0, 5.0, 7.0]))
    np.testing.assert_array_equal(cell.origin, BOX.origin)
    assert cell.periodic == (True, True, True)


def test_the_users_cell_may_be_tilted():
    cell = user_cell(PATH, None, ReadOptions(cell=(3.0, 5.0, 7.0, 0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(cell.vectors, [[3, 0, 0], [0.1, 5, 0], [0.2, 0.3, 7]])


@pytest.mark.parametrize(
    ("letters", "periodic"),
    [("xyz", (True, True, True)), ("zx", (True, False, True)), ("", (False, False, False))],
)
def test_periodic_letters_say_which_axes_repeat(letters, periodic):
    assert user_cell(PATH, BOX, ReadOptions(periodic=letters)).periodic == periodic
    with_cell = ReadOptions(periodic=letters, cell=(1.0, 1.0, 1.0))
    assert user_cell(PATH, None, with_cell).periodic == periodic


def test_periodic_without_a_cell_is_an_error_that_asks_for_it():
    with pytest.raises(ReadError, match=r'`periodic="xy"` .* names no cell: give it with `cell'):
        user_cell(PATH, None, ReadOptions(periodic="xy"))


def test_without_options_the_cell_is_the_dumps():
    assert user_cell(PATH, BOX, ReadOptions()) is BOX
    assert user_cell(PATH, None, ReadOptions()) is None


@pytest.mark.parametrize("cell", [(1.0, 2.0), (1.0,), (1.0, 2.0, 3.0, 4.0), (1.0,) * 7])
def test_a_cell_has_three_or_six_numbers(cell):
    with pytest.raises(SettingsError, match="expected three lengths LX LY LZ"):
        user_cell(PATH, None, ReadOptions(cell=cell))


@pytest.mark.parametrize("letters", ["w", "xq", "X", "all"])
def test_periodic_letters_are_out_of_xyz(letters):
    with pytest.raises(SettingsError, match="expected letters out of xyz"):
        user_cell(PATH, BOX, ReadOptions(periodic=letters))
