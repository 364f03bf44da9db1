"""From named columns to positions, radii, ids and the cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, SettingsError
from scanfab.io.columns import grain_table, has_radius, user_cell
from scanfab.io.options import parse_columns
from scanfab.io.reader import ReadOptions
from scanfab.io.writer import installed_writers
from scanfab.packing.cell import Cell
from tests.helpers.dumps import write

PATH = Path("dump.txt")
POSITION = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
RADIUS = np.array([0.01, 0.02])
BOX = Cell([2.0, 4.0, 8.0], (False, False, False), [-1.0, 0.0, 1.0])


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
    assert grains.columns == {}
    assert grains.id is None


@pytest.mark.parametrize("names", ["xs ys zs", "xsu ysu zsu"])
def test_scaled_coordinates_are_fractions_of_the_box(names):
    for box in (BOX, Cell([[2, 0, 0], [0.5, 3, 0], [0.25, -0.5, 4]])):
        expected = POSITION @ box.vectors + box.origin
        np.testing.assert_allclose(table(columns(names), box).position, expected, rtol=1e-15)
    with pytest.raises(ReadError, match=rf"dump.txt, step 5: {names} are fractions of a box"):
        table(columns(names))


@pytest.mark.parametrize(
    "found",
    [
        {**columns("xs ys zs", 9 * POSITION), **columns()},
        {"position": POSITION.tolist(), "radius": RADIUS},
        {**columns(), "position": RADIUS},
    ],
)
def test_plain_coordinates_or_vectors_come_before_others(found):
    np.testing.assert_array_equal(table(found, BOX).position, POSITION)


def test_missing_columns_are_errors_that_list_what_there_is():
    with pytest.raises(ReadError, match=r'no coordinates.*found x, y, radius.*`columns=."x": '):
        table(columns("x y", POSITION[:, :2]))
    with pytest.raises(ReadError, match=r"step 5: no radius.*type.*`columns=.*`radius`"):
        table({"position": POSITION, "type": RADIUS})
    with pytest.raises(ReadError, match=r"no column 'rr' to serve as radius; .*x, y, z, radius"):
        table(columns(), columns={"radius": "rr"})


def test_a_column_that_is_named_twice_is_refused():
    with pytest.raises(SettingsError, match="columns: expected one column as x, found 'x=1,y=2,x"):
        parse_columns("columns", "x=1,y=2,x=3")


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("radius", 1),
        ("radii", 1),
        ("RADIUS", 1),
        ("rad", 1),
        ("R", 1),
        ("Diameter", 2),
        ("diam", 2),
    ],
)
def test_a_size_has_many_names(name, factor):
    found = {"position": POSITION, name: factor * RADIUS}
    np.testing.assert_array_equal(table(found).radius, RADIUS)
    assert has_radius(list(found))
    with pytest.raises(ReadError, match="`radius` is for dumps without radii"):
        table(found, radius=0.5)


def test_users_may_name_the_size_or_give_one_for_all():
    size = {"position": POSITION, "c_r": RADIUS}
    np.testing.assert_array_equal(table(size, columns={"radius": "c_r"}).radius, RADIUS)
    np.testing.assert_array_equal(table(size, columns={"diameter": "c_r"}).radius, 0.5 * RADIUS)
    np.testing.assert_array_equal(table(size, radius=0.5).radius, [0.5, 0.5])
    with pytest.raises(ReadError, match="`radius` is for dumps without radii"):
        table(size, columns={"diameter": "c_r"}, radius=0.5)


@pytest.mark.parametrize("radius", [0.333, 12.3, 1e-4])
@pytest.mark.parametrize(("factor", "agree"), [(1, True), (1.004, True), (0.5, False)])
def test_a_diameter_that_is_not_twice_the_radius_is_an_error_or_was_rounded(radius, factor, agree):
    radii = np.array([radius, radius])
    found = {"position": POSITION, "r": radii, "Diam": 2 * radii * [1, factor]}
    if agree:
        grains = table(found)
        np.testing.assert_array_equal(grains.radius, radii)
        np.testing.assert_array_equal(grains.columns["Diam"], found["Diam"])
        return
    words = r"'r' and 'Diam' contradict each other at grain 2: .*\"radius\": \"r\".*\"Diam\""
    with pytest.raises(ReadError, match=words):
        table(found)
    np.testing.assert_array_equal(table(found, columns={"radius": "r"}).radius, radii)
    half = table(found, columns={"diameter": "Diam"})
    np.testing.assert_array_equal(half.radius, radii * [1, factor])


@pytest.mark.parametrize("other", [["big", "one"], [[1, 2], [3, 4]], [np.nan, np.nan]])
def test_a_column_that_cannot_be_diameters_contradicts_nothing(other):
    found = table(columns(diameter=np.array(other)))
    np.testing.assert_array_equal(found.radius, RADIUS)


@pytest.mark.parametrize("name", installed_writers())
@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_what_was_chosen_stays_chosen_in_what_convert_writes(tmp_path, name):
    path = write(tmp_path / "s.csv", "x,y,z,radius,diameter\n0,0,0,0.5,1\n3,0,0,1,1\n")
    with pytest.raises(ReadError, match="contradict each other"):
        scanfab.read(path)
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
    np.testing.assert_array_equal(grains.id, [7, 1000003])
    assert grains.id.dtype == np.int64


@pytest.mark.parametrize("wrong", [1.5, np.nan, np.inf, 2.0**53, -(2.0**53), 1e300, 2**63])
def test_ids_must_be_whole_numbers(wrong):
    with pytest.raises(ReadError, match="step 5: ids must be whole numbers"):
        table(columns(id=np.array([1, wrong])))


def test_ids_that_are_no_decimals_are_exact():
    ids = [2**53 + 1, -(2**63)]
    assert table(columns(id=np.array(ids))).id.tolist() == ids


def test_other_columns_keep_their_names_unless_the_user_names_them():
    more = columns(type=RADIUS, c_ca=2 * RADIUS, phase=3 * RADIUS, id=np.array([1, 2]))
    assert sorted(table(more).columns) == ["c_ca", "phase", "type"]
    found = table(more, columns={"type": "phase", "id": "id"}).columns
    np.testing.assert_array_equal(found["type"], 3 * RADIUS)
    np.testing.assert_array_equal(found["type_of_dump"], RADIUS)
    assert "phase" not in found


def test_the_users_cell_replaces_the_dumps_and_keeps_its_corner():
    cell = user_cell(PATH, BOX, ReadOptions(cell=(3.0, 5.0, 7.0)))
    np.testing.assert_array_equal(cell.vectors, np.diag([3.0, 5.0, 7.0]))
    np.testing.assert_array_equal(cell.origin, BOX.origin)
    assert cell.periodic == (True, True, True)
    tilted = user_cell(PATH, None, ReadOptions(cell=(3.0, 5.0, 7.0, 0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(tilted.vectors, [[3, 0, 0], [0.1, 5, 0], [0.2, 0.3, 7]])
    assert user_cell(PATH, BOX, ReadOptions()) is BOX
    assert user_cell(PATH, None, ReadOptions()) is None


@pytest.mark.parametrize(
    ("letters", "periodic"),
    [("xyz", (True, True, True)), ("zx", (True, False, True)), ("", (False, False, False))],
)
def test_periodic_letters_say_which_axes_repeat(letters, periodic):
    assert user_cell(PATH, BOX, ReadOptions(periodic=letters)).periodic == periodic
    with_cell = ReadOptions(periodic=letters, cell=(1.0, 1.0, 1.0))
    assert user_cell(PATH, None, with_cell).periodic == periodic


def test_a_cell_that_cannot_be_is_an_error():
    with pytest.raises(ReadError, match=r'`periodic="xy"` .* names no cell: give it with `cell'):
        user_cell(PATH, None, ReadOptions(periodic="xy"))
    for cell in ((1.0, 2.0), (1.0, 2.0, 3.0, 4.0)):
        with pytest.raises(SettingsError, match="expected three lengths LX LY LZ"):
            scanfab.read_series("nowhere", cell=cell)
    for letters in ("xq", "X"):
        with pytest.raises(SettingsError, match="expected letters out of xyz"):
            scanfab.read_series("nowhere", periodic=letters)
