"""From named columns to grains, the cell and clumps; from ids or places to contacts and walls."""

from pathlib import Path

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, SettingsError
from scanfab.io import GrainTable, ReadOptions, grain_table, join_ids, join_positions
from scanfab.packing.cell import Cell
from tests.helpers.dumps import NAMES, dump_text, holds, write
from tests.helpers.fuzzing import only_scanfabs_warnings

PATH = Path("dump.txt")
POSITION = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
RADIUS = np.array([0.01, 0.02])
BOX = Cell([2.0, 4.0, 8.0], (False, False, False), [-1.0, 0.0, 1.0])
TILTED = Cell([[2, 0, 0], [0.5, 3, 0], [0.25, -0.5, 4]])


def columns(names="x y z", position=POSITION, **more):
    return {**dict(zip(names.split(), position.T, strict=True)), "radius": RADIUS, **more}


def table(found, cell=None, **options):
    return grain_table(PATH, found, cell, ReadOptions(**options), ", step 5")


COORDINATES = [
    *[(names, {}) for names in ("x y z", "X Y Z", "xu yu zu")],
    ("px py pz", {"x": "px", "y": "py", "z": "pz"}),
    ("x y depth", {"z": "depth"}),
]


@pytest.mark.parametrize(("names", "named"), COORDINATES)
def test_coordinates_are_known_by_name_or_named_by_the_user(names, named):
    grains = table(columns(names), columns=named)
    holds(grains, position=POSITION, radius=RADIUS, columns={}, id=None)


@pytest.mark.parametrize("names", ["xs ys zs", "xsu ysu zsu"])
def test_scaled_coordinates_are_fractions_of_the_box(names):
    for box in (BOX, TILTED):
        expected = POSITION @ box.vectors + box.origin
        np.testing.assert_allclose(table(columns(names), box).position, expected, rtol=1e-15)
    with pytest.raises(ReadError, match=rf"dump.txt, step 5: {names} are fractions of a box"):
        table(columns(names))
    both = columns(names, 9 * POSITION) | columns()
    holds(table(both, BOX), position=POSITION)


def test_missing_columns_are_errors_that_list_what_there_is():
    with pytest.raises(ReadError, match=r'no coordinates .* in x, y, radius; `columns=."x": '):
        table(columns("x y", POSITION[:, :2]))
    with pytest.raises(ReadError, match=r"no column 'rr' to serve as radius; .*x, y, z, radius"):
        table(columns(), columns={"radius": "rr"})


@pytest.mark.parametrize("name", ["radius", "radii", "RADIUS", "rad", "R", "Diameter", "diam"])
def test_a_size_has_many_names_or_is_named_or_given_for_all(name):
    found = {"position": POSITION, name: RADIUS * (2 if "iam" in name else 1)}
    holds(table(found), radius=RADIUS)
    with pytest.raises(ReadError, match="`radius` is for dumps without radii"):
        table(found, radius=0.5)
    size = {"position": POSITION, "c_r": RADIUS}
    holds(table(size, columns={"radius": "c_r"}), radius=RADIUS)
    holds(table(size, columns={"diameter": "c_r"}), radius=0.5 * RADIUS)
    holds(table(size, radius=0.5), radius=[0.5, 0.5])


@pytest.mark.parametrize("radius", [0.333, 12.3, 1e-4])
def test_a_diameter_that_is_not_twice_the_radius_is_an_error_unless_it_was_rounded(radius):
    radii = np.array([radius, radius])
    for factor in (1, 1.004):
        found = {"position": POSITION, "r": radii, "Diam": 2 * radii * [1, factor]}
        holds(table(found), radius=radii)
    found["Diam"] = 2 * radii * [1, 0.5]
    with pytest.raises(ReadError, match=r"'r' and 'Diam' contradict each other at grain 2"):
        table(found)
    holds(table(found, columns={"radius": "r"}), radius=radii)
    holds(table(found, columns={"diameter": "Diam"}), radius=radii * [1, 0.5])


@pytest.mark.parametrize("other", [["big", "one"], [[1, 2], [3, 4]], [np.nan, np.nan]])
def test_a_column_that_cannot_be_diameters_contradicts_nothing(other):
    np.testing.assert_array_equal(table(columns(diameter=np.array(other))).radius, RADIUS)


@pytest.mark.parametrize("name", ["id", "ID", "particle_id", "body_id", "number"])
def test_ids_have_many_names(name):
    named = {"id": name} if name == "number" else {}
    grains = table(columns(**{name: np.array([7.0, 1000003.0])}), columns=named)
    assert (grains.id.tolist(), grains.id.dtype) == ([7, 1000003], np.int64)


@pytest.mark.parametrize("wrong", [1.5, np.nan, np.inf, 2.0**53, 1e300])
def test_ids_are_whole_numbers(wrong):
    for ids in (np.array([1, wrong]), np.array([1, 2**63], np.uint64)):
        with pytest.raises(ReadError, match="step 5: ids must be whole numbers"):
            table(columns(id=ids))
    exact = [2**53 + 1, -(2**63)]
    assert table(columns(id=np.array(exact))).id.tolist() == exact


def test_other_columns_keep_their_names_unless_the_user_names_them():
    more = columns(type=RADIUS, c_ca=2 * RADIUS, phase=3 * RADIUS, id=np.array([1, 2]))
    assert sorted(table(more).columns) == ["c_ca", "phase", "type"]
    found = table(more, columns={"type": "phase", "id": "id"})
    holds(found, type=3 * RADIUS, type_of_dump=RADIUS)
    assert "phase" not in found.columns


def cell_of(own=None, **options):
    return grain_table(PATH, columns(), own, ReadOptions(**options)).cell


def test_the_users_cell_replaces_the_dumps_and_keeps_its_corner():
    cell = cell_of(BOX, cell=(3.0, 5.0, 7.0))
    holds(cell, vectors=np.diag([3, 5, 7]), origin=BOX.origin, periodic=(True, True, True))
    tilted = cell_of(cell=(3.0, 5.0, 7.0, 0.1, 0.2, 0.3))
    holds(tilted, vectors=[[3, 0, 0], [0.1, 5, 0], [0.2, 0.3, 7]])
    assert (cell_of(BOX), cell_of()) == (BOX, None)


@pytest.mark.parametrize("letters", ["xyz", "zx", ""])
def test_periodic_letters_say_which_axes_repeat(letters):
    periodic = tuple(axis in letters for axis in "xyz")
    assert cell_of(BOX, periodic=letters).periodic == periodic
    assert cell_of(periodic=letters, cell=(1.0, 1.0, 1.0)).periodic == periodic
    with pytest.raises(ReadError, match=rf'`periodic="{letters}"` needs a cell, .*: give it with'):
        cell_of(periodic=letters)


def test_a_cell_that_cannot_be_is_an_error():
    for options in ({"cell": (1, 2)}, {"cell": (1, 2, 3, 4)}, {"periodic": "xq"}):
        with pytest.raises(SettingsError, match=r"expected (three lengths|letters out of xyz)"):
            scanfab.read_series("nowhere", **options)


def dump(tmp_path, column, values, **options):
    """Four spheres in a row with one more column."""
    rows = [(k, 1, 0.2 * k, 0.5, 0.5, 0.1, value) for k, value in enumerate(values)]
    path = write(tmp_path / "dump.txt", dump_text(rows, f"{NAMES} {column}", box=((0, 2),) * 3))
    return scanfab.read(path, **options)


def heads(packing):
    return None if packing.bodies is None else packing.bodies.head.tolist()


@pytest.mark.parametrize("column", ["id_multisphere", "clumpId", "clump_id", "clump", "CLUMP"])
def test_columns_that_number_clumps_are_taken_by_their_name(tmp_path, column):
    """Negative numbers are spheres that are no part of a clump."""
    assert heads(dump(tmp_path, column, [0, 0, -1, -1])) == [0, 0, 2, 3]


def test_any_column_may_be_named_and_id_makes_each_sphere_a_grain(tmp_path):
    """Molecule 0 is none."""
    assert heads(dump(tmp_path, "mol", [1, 1, 0, 0])) is None
    assert heads(dump(tmp_path, "mol", [1, 1, 0, 0], bodies="mol")) == [0, 0, 2, 3]
    values = [5, 5, 8, 8]
    assert heads(dump(tmp_path, "c_body", values)) is None
    assert heads(dump(tmp_path, "c_body", values, bodies="c_body")) == [0, 0, 2, 2]
    assert heads(dump(tmp_path, "c_body", values, columns={"clump": "c_body"})) == [0, 0, 2, 2]
    assert heads(dump(tmp_path, "clump", values, bodies="id")) is None
    assert heads(dump(tmp_path, "clump", values, bodies="type")) == [0, 0, 0, 0]


def test_a_column_that_is_not_there_or_not_whole_is_an_error_that_names_it(tmp_path):
    with pytest.raises(ReadError, match=r"dump.txt: .* no column 'body'; .*are id, .*clump"):
        dump(tmp_path, "clump", [1, 1, 2, 2], bodies="body")
    with pytest.raises(ReadError, match=r"the column clump: .* whole numbers"):
        dump(tmp_path, "clump", [1, 1, 1.5, 2])


def test_an_empty_frame_has_no_bodies_even_if_it_lacks_their_column(tmp_path):
    path = write(tmp_path / "dump.txt", dump_text([]))
    assert scanfab.read(path, bodies="clump").bodies is None


SHAPES = "shapex shapey shapez blockiness1 blockiness2"


def superquadrics(tmp_path, *values):
    row = (1, 1, 0.5, 0.5, 0.5, 0.1, *values)
    return scanfab.read(write(tmp_path / "dump.txt", dump_text([row], f"{NAMES} {SHAPES}")))


def test_superquadrics_are_refused_unless_they_are_spheres(tmp_path):
    assert superquadrics(tmp_path, 0.1, 0.1, 0.1, 2, 2).radius.tolist() == [0.1]
    for values in [(0.1, 0.1, 0.08, 2, 2), (0.1, 0.1, 0.1, 4, 2), (0.06, 0.06, 0.06, 8, 8)]:
        with pytest.raises(ReadError, match=r"dump.txt, step 0: 1 of 1 particles are super"):
            superquadrics(tmp_path, *values)


LISTED = Path("contacts.txt")
CHAIN = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0], [5.7, 0, 0]])
CELL = Cell([7.6, 4, 4])


def grains(id=(40, 10, 30, 20), cell=None):
    ids = None if id is None else np.array(id, dtype=np.int64)
    return GrainTable(CHAIN, np.ones(len(CHAIN)), ids, {}, cell)


def by_places(ends, cell=None):
    return join_positions(LISTED, grains(None, cell), np.array(ends, dtype=float), None)


def test_an_unknown_id_may_be_a_wall():
    force = np.arange(12.0).reshape(4, 3)
    ids = np.array([[10, 30], [77, 10], [30, 78], [10, 79]])
    joined = join_ids(LISTED, grains(), ids, force, walls=True)
    holds(joined.contacts, pairs=[[1, 2]], force=force[:1])
    holds(joined, wall_contacts=[0, 2, 1, 0])
    told = r"contact 2 names the grain 77.*\(1 of 2 contacts\): are both of the same step"
    with pytest.raises(ReadError, match=told):
        join_ids(LISTED, grains(), np.array([[10, 77], [77, 78]]), None, walls=True)


def test_ends_of_a_line_are_grains_or_walls():
    rounded = CHAIN[[2, 1]] + [0.009, 0, 0]
    wall = [[CHAIN[2], [3.8, 1, 0]], [[0, -1, 0], CHAIN[0]]]
    joined = by_places([rounded, CHAIN[[0, 1]], *wall])
    holds(joined.contacts, pairs=[[2, 1], [0, 1]])
    holds(joined, wall_contacts=[1, 0, 1, 0])
    assert len(by_places(np.zeros((0, 2, 3))).contacts.pairs) == 0
    with pytest.raises(ReadError, match=r"contact 1 ends at a grain at \[9\.0, 9\.0, 9\.0\]"):
        by_places([[[9, 9, 9], [8, 8, 8]]])


@pytest.mark.parametrize("error", [-1e-9, -1e-17, 0.0, 1e-9])
def test_ends_outside_a_periodic_cell_are_wrapped_and_rounding_does_no_harm(error):
    ends = [[CHAIN[3], [7.6 + error, error, error]], [[-1.9, 4, -4], CHAIN[0]]]
    np.testing.assert_array_equal(by_places(ends, CELL).contacts.pairs, [[3, 0], [3, 0]])


def test_without_a_cell_the_image_of_a_grain_is_no_wall():
    with pytest.raises(ReadError, match=r"1 contacts end at periodic images.*`cell="):
        by_places([[CHAIN[3], [7.6, 0, 0]]])


@pytest.mark.parametrize(("end", "place", "radius"), [(1e300, 0, 1), (1, np.nan, 1), (1, 0, -1)])
def test_ends_that_are_no_places_are_refused_without_a_warning(end, place, radius):
    found = GrainTable(np.full((1, 3), place), np.full(1, radius), None, {}, Cell([4, 4, 4]))
    with only_scanfabs_warnings(), pytest.raises(ReadError, match="finite"):
        join_positions(LISTED, found, np.array([[[0, 0, 0], [end, 0, 0]]]), None)
