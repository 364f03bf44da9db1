"""From named columns to positions, radii, ids and the cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, SettingsError
from scanfab.io import ReadOptions, grain_table
from scanfab.io.writer import installed_writers
from scanfab.packing.cell import Cell
from tests.helpers.dumps import write

PATH = Path("dump.txt")
POSITION = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
RADIUS = np.array([0.01, 0.02])
BOX = Cell([2.0, 4.0, 8.0], (False, False, False), [-1.0, 0.0, 1.0])
TILTED = Cell([[2, 0, 0], [0.5, 3, 0], [0.25, -0.5, 4]])


def columns(names="x y z", position=POSITION, **more):
    return {**dict(zip(names.split(), position.T, strict=True)), "radius": RADIUS, **more}


def table(found, cell=None, **options):
    return grain_table(PATH, found, cell, ReadOptions(**options), ", step 5")


@pytest.mark.parametrize(
    ("names", "named"),
    [
        *[(names, {}) for names in ("x y z", "X Y Z", "xu yu zu")],
        ("px py pz", {"x": "px", "y": "py", "z": "pz"}),
        ("x y depth", {"z": "depth"}),
    ],
)
def test_coordinates_are_known_by_name_or_named_by_the_user(names, named):
    grains = table(columns(names), columns=named)
    np.testing.assert_array_equal(grains.position, POSITION)
    np.testing.assert_array_equal(grains.radius, RADIUS)
    assert (grains.columns, grains.id) == ({}, None)


@pytest.mark.parametrize("names", ["xs ys zs", "xsu ysu zsu"])
def test_scaled_coordinates_are_fractions_of_the_box(names):
    for box in (BOX, TILTED):
        expected = POSITION @ box.vectors + box.origin
        np.testing.assert_allclose(table(columns(names), box).position, expected, rtol=1e-15)
    with pytest.raises(ReadError, match=rf"dump.txt, step 5: {names} are fractions of a box"):
        table(columns(names))
    both = columns(names, 9 * POSITION) | columns()
    np.testing.assert_array_equal(table(both, BOX).position, POSITION)


def test_missing_columns_are_errors_that_list_what_there_is():
    with pytest.raises(ReadError, match=r'no coordinates .* in x, y, radius; `columns=."x": '):
        table(columns("x y", POSITION[:, :2]))
    with pytest.raises(ReadError, match=r"step 5: no radius.*type.*`columns=.*`radius`"):
        table({"position": POSITION, "type": RADIUS})
    with pytest.raises(ReadError, match=r"no column 'rr' to serve as radius; .*x, y, z, radius"):
        table(columns(), columns={"radius": "rr"})


@pytest.mark.parametrize("name", ["radius", "radii", "RADIUS", "rad", "R", "Diameter", "diam"])
def test_a_size_has_many_names(name):
    found = {"position": POSITION, name: RADIUS * (2 if "iam" in name else 1)}
    np.testing.assert_array_equal(table(found).radius, RADIUS)
    with pytest.raises(ReadError, match="`radius` is for dumps without radii"):
        table(found, radius=0.5)


def test_users_may_name_the_size_or_give_one_for_all():
    size = {"position": POSITION, "c_r": RADIUS}
    np.testing.assert_array_equal(table(size, columns={"radius": "c_r"}).radius, RADIUS)
    np.testing.assert_array_equal(table(size, columns={"diameter": "c_r"}).radius, 0.5 * RADIUS)
    np.testing.assert_array_equal(table(size, radius=0.5).radius, [0.5, 0.5])


@pytest.mark.parametrize("radius", [0.333, 12.3, 1e-4])
def test_a_diameter_that_is_not_twice_the_radius_is_an_error_unless_it_was_rounded(radius):
    radii = np.array([radius, radius])
    for factor in (1, 1.004):
        found = {"position": POSITION, "r": radii, "Diam": 2 * radii * [1, factor]}
        np.testing.assert_array_equal(table(found).radius, radii)
    found["Diam"] = 2 * radii * [1, 0.5]
    with pytest.raises(ReadError, match=r"'r' and 'Diam' contradict each other at grain 2"):
        table(found)
    np.testing.assert_array_equal(table(found, columns={"radius": "r"}).radius, radii)
    half = table(found, columns={"diameter": "Diam"})
    np.testing.assert_array_equal(half.radius, radii * [1, 0.5])


@pytest.mark.parametrize("other", [["big", "one"], [[1, 2], [3, 4]], [np.nan, np.nan]])
def test_a_column_that_cannot_be_diameters_contradicts_nothing(other):
    np.testing.assert_array_equal(table(columns(diameter=np.array(other))).radius, RADIUS)


@pytest.mark.parametrize("name", installed_writers())
@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_what_was_chosen_stays_chosen_in_what_convert_writes(tmp_path, name):
    path = write(tmp_path / "s.csv", "x,y,z,radius,diameter\n0,0,0,0.5,1\n3,0,0,1,1\n")
    packing = scanfab.read(path, columns={"radius": "radius"})
    extension = installed_writers()[name].plugin.extensions[0]
    (out,) = scanfab.convert(packing, tmp_path / f"a{extension}", to=name)
    again = scanfab.read(out)
    assert again.radius.tolist() == [0.5, 1]
    assert again.columns["diameter_of_dump"].tolist() == [1, 1]


@pytest.mark.parametrize("name", ["id", "ID", "particle_id", "body_id", "number"])
def test_ids_have_many_names(name):
    named = {"id": name} if name == "number" else {}
    grains = table(columns(**{name: np.array([7.0, 1000003.0])}), columns=named)
    assert (grains.id.tolist(), grains.id.dtype) == ([7, 1000003], np.int64)


@pytest.mark.parametrize("wrong", [1.5, np.nan, np.inf, 2.0**53, 1e300])
def test_ids_are_whole_numbers(wrong):
    with pytest.raises(ReadError, match="step 5: ids must be whole numbers"):
        table(columns(id=np.array([1, wrong])))
    exact = [2**53 + 1, -(2**63)]
    assert table(columns(id=np.array(exact))).id.tolist() == exact
    with pytest.raises(ReadError, match="whole numbers"):
        table(columns(id=np.array([1, 2**63], np.uint64)))


def test_other_columns_keep_their_names_unless_the_user_names_them():
    more = columns(type=RADIUS, c_ca=2 * RADIUS, phase=3 * RADIUS, id=np.array([1, 2]))
    assert sorted(table(more).columns) == ["c_ca", "phase", "type"]
    found = table(more, columns={"type": "phase", "id": "id"}).columns
    np.testing.assert_array_equal(found["type"], 3 * RADIUS)
    np.testing.assert_array_equal(found["type_of_dump"], RADIUS)
    assert "phase" not in found


def cell_of(own=None, **options):
    return grain_table(PATH, columns(), own, ReadOptions(**options)).cell


def test_the_users_cell_replaces_the_dumps_and_keeps_its_corner():
    cell = cell_of(BOX, cell=(3.0, 5.0, 7.0))
    np.testing.assert_array_equal(cell.vectors, np.diag([3.0, 5.0, 7.0]))
    np.testing.assert_array_equal(cell.origin, BOX.origin)
    assert cell.periodic == (True, True, True)
    tilted = cell_of(cell=(3.0, 5.0, 7.0, 0.1, 0.2, 0.3))
    np.testing.assert_array_equal(tilted.vectors, [[3, 0, 0], [0.1, 5, 0], [0.2, 0.3, 7]])
    assert (cell_of(BOX), cell_of()) == (BOX, None)


@pytest.mark.parametrize("letters", ["xyz", "zx", ""])
def test_periodic_letters_say_which_axes_repeat(letters):
    periodic = tuple(axis in letters for axis in "xyz")
    assert cell_of(BOX, periodic=letters).periodic == periodic
    assert cell_of(periodic=letters, cell=(1.0, 1.0, 1.0)).periodic == periodic
    with pytest.raises(
        ReadError, match=rf'`periodic="{letters}"` needs a cell, .* not name: give it with'
    ):
        cell_of(periodic=letters)


@pytest.mark.parametrize(
    "options", [{"cell": (1, 2)}, {"cell": (1, 2, 3, 4)}, {"periodic": "xq"}, {"periodic": "X"}]
)
def test_a_cell_that_cannot_be_is_an_error(options):
    with pytest.raises(SettingsError, match=r"expected (three lengths|letters out of xyz)"):
        scanfab.read_series("nowhere", **options)
