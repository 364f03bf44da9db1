"""Tables of any program: what columns are, by names, by the user or by a rule that is told."""

import re

import numpy as np
import pyarrow
import pytest
from pyarrow import parquet

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.cli.main import run
from scanfab.io.reader import reader_for
from tests.helpers import dumps
from tests.helpers.dumps import dump_text, holds, pairs_text, refuses, write
from tests.helpers.sound_files import made

# sixty-four equal spheres that touch along the axes
GRID = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
POSITION = GRID + 0.002 * np.random.default_rng(0).uniform(-1, 1, GRID.shape)
RADIUS = np.full(64, 0.5)
ID = np.random.default_rng(1).permutation(1000)[:64] + 5
PAIRS = np.argwhere(np.triu(np.linalg.norm(POSITION[:, None] - POSITION, axis=2) < 1.1, 1))
# on the second grain of each pair, mostly along the normal
FORCE = POSITION[PAIRS[:, 1]] - POSITION[PAIRS[:, 0]] + 0.1


def rows(path, *columns, names=()):
    """A table of words between commas; without names between blanks."""
    parts = [part.tolist() for one in columns for part in np.atleast_2d(one.T)]
    separator = "," if len(names) else " "
    lines = [separator.join(map(repr, row)) for row in zip(*parts, strict=True)]
    return write(path, "".join(f"{line}\n" for line in [separator.join(names), *lines] if line))


def read(path, **options):
    return scanfab.read(path, **{"contacts": "geometric", **options})


def assert_right(packing):
    holds(packing, position=POSITION, radius=RADIUS)


# columns without names


READ_BY_RULE = [
    ("x y z radius", (POSITION, RADIUS)),
    ("id x y z radius", (ID, POSITION, RADIUS)),
    ("x y z radius clump", (POSITION, RADIUS, np.full(64, -1))),
    ("x y z radius clump", (POSITION, RADIUS, np.arange(64) // 2)),
]


@pytest.mark.parametrize("loose", [1.0, 3.0])
@pytest.mark.parametrize(("told", "columns"), READ_BY_RULE)
def test_a_table_without_names_is_read_by_a_rule_that_is_told(tmp_path, columns, told, loose):
    """Also loose packings, with any ending."""
    columns = [loose * one if one is POSITION else one for one in columns]
    path = rows(tmp_path / "111_10k.spheres", *columns)
    with pytest.warns(ScanfabNote, match=f"no names and are taken as {told}: .*`columns`"):
        packing = read(path)
    holds(packing, position=loose * POSITION, radius=RADIUS)
    holds(packing, id=ID if told.startswith("id") else range(64))
    assert not told.endswith("clump") or np.array_equal(packing.columns["clump"], columns[-1])


ASKED = [
    ("inside one another", (POSITION, 2 * RADIUS)),
    ("inside one another", (ID, POSITION, 2 * RADIUS)),
    ("not be positive", (POSITION, -RADIUS)),
    ("two frames", (np.tile(POSITION, (2, 1)), np.tile(RADIUS, 2))),
    ("not be whole", (POSITION, RADIUS, RADIUS)),
    ("looks like ids", (ID, POSITION)),
    ("the 6 columns have no names .expected four or five", (POSITION, RADIUS, ID, ID)),
    ("3 columns", (POSITION,)),
]


@pytest.mark.parametrize(("reason", "columns"), ASKED)
def test_a_table_without_names_that_cannot_be_so_is_asked(tmp_path, columns, reason):
    path = rows(tmp_path / "grains.txt", *columns)
    for options in ({}, {"format": "table"}):
        refuses(path, rf"{reason}.*`columns=\"x=1,y=2,z=3,r", **options)


def test_users_say_what_columns_are_in_a_text_of_any_ending(tmp_path, capsys):
    path = rows(tmp_path / "grains.txt", POSITION, 2 * RADIUS, RADIUS, ID)
    assert_right(read(path, columns="x=1,y=2,z=3,diameter=4"))
    packing = read(path, columns={"x": 1, "y": 2, "z": 3, "radius": "5", "type": 6})
    assert_right(packing)
    holds(packing, type=ID, **{"4": 2 * RADIUS})
    pairs = {"contacts": rows(tmp_path / "pairs", ID[PAIRS]), "contact_columns": "id1=1,id2=2"}
    packing = scanfab.read(path, columns="x=1,y=2,z=3,diameter=4,id=6", **pairs)
    assert {*map(tuple, packing.contacts.pairs.tolist())} == {*map(tuple, PAIRS.tolist())}
    path = write(tmp_path / "pack.out", "made by hand\n" + path.read_text())
    assert_right(read(path, skip=1, columns="x=1,y=2,z=3,diameter=4"))
    assert run(["inspect", f"{path}", "--skip=1", "--columns=x=1,y=2,z=3,radius=5", "--json"]) == 0
    assert '"grains": 64' in capsys.readouterr().out
    refuses(write(tmp_path / "notes", "some words\nand more of them\n"), r"as a table .* columns")


# names


USUAL_NAMES = [
    "x y z radius",
    "X Y Z r",
    "pos_x pos_y pos_z Radius",
    "Points:0 Points:1 Points:2 radii",
    "x[m] y[m] z[m] radius[m]",
    "x(\xb5m) y(\u03bcm) z(\xb5m) r(\u03bcm)",  # two letters for micro
]


@pytest.mark.parametrize("names", USUAL_NAMES)
def test_usual_names(tmp_path, names):
    packing = read(rows(tmp_path / "g.csv", POSITION, RADIUS, ID, names=[*names.split(), "kept"]))
    assert_right(packing)
    np.testing.assert_array_equal(packing.columns["kept"], ID)


ROWS = "0,0,0,0.5,7\n1,0,0,0.5,7\n"


TWICE = [
    ("", {"x": 2, "y": "2", "radius": 5}, "each name and each column once, found .*'y': '2'"),
    ("x,y,z,r,e\n", {"radius": "r", "age": "r"}, "each name and each column once"),
    ("x,y,z,r,X\n", {}, r"several columns may be x: 'x' \(column 1\), .*column 5"),
]


@pytest.mark.parametrize(("names", "columns", "told"), TWICE)
def test_a_column_that_stands_or_serves_twice_is_named(tmp_path, names, columns, told):
    path = write(tmp_path / "g.csv", names + ROWS)
    refuses(path, told, error=scanfab.ScanfabError, columns=columns)
    assert read(path, columns="x=1,y=2,z=3,radius=4").radius.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("unit", ["mm^3", "mm\xb3", "m^3"])
def test_lengths_have_one_unit_and_volumes_its_cube(tmp_path, unit):
    told = r"g\.csv: .* of one unit, found .*x ?\(m"
    path = write(tmp_path / "g.csv", f"x (m),y (m),z (m),radius (mm),e\n{ROWS}")
    refuses(path, told, format="table")
    names = ",".join(f"position {axis}(mm)" for axis in "xyz")
    write(path, f"{names},volume({unit}),e\n{ROWS}")
    if unit == "m^3":
        refuses(path, told, format="edem")
    else:
        with pytest.warns(ScanfabNote, match="radii are computed from the volumes"):
            radius = read(path, format="edem").radius
        np.testing.assert_allclose(4 / 3 * np.pi * radius**3, 0.5)


# rows


def test_side_columns_may_have_gaps(tmp_path, capsys):
    """What needs them says so: types that are not there enclose nothing."""
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, RADIUS, names=[*"xyzr", "type"])
    lines = path.read_text().splitlines(True)
    write(path, "".join([*lines[:6], lines[6].rpartition(",")[0] + ",\n", *lines[7:]]))
    assert np.isnan(read(path).columns["type"][5])
    assert run(["inspect", str(path), "--json"]) == 0
    assert run(["inspect", str(path), "--boundary", "type=2"]) != 0
    assert "column type has no value for 1 of 64 particles" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["Time [s]", "Time Step", "FRAME"])
def test_frames_one_below_the_other_are_refused_whatever_their_name(tmp_path, name):
    path = rows(tmp_path / "a.csv", POSITION, RADIUS, ID // 500, names=[*"xyzr", name])
    refuses(path, re.escape(f"the column {name} has {len(set(ID // 500))} values: expected one"))


# contacts


def grains_file(folder, *, ids=True):
    columns = [*([ID] if ids else []), POSITION, RADIUS]
    return rows(folder / "grains.csv", *columns, names=[*(["id"] * ids), *"xyz", "radius"])


def joined(folder, names, *columns, ids=True, **options):
    """Contacts of a table with these further columns."""
    path = rows(folder / "c.csv", ID[PAIRS], *columns, names=["id1", "id2", *names])
    return scanfab.read(grains_file(folder), contacts=path, **options).contacts


@pytest.mark.parametrize(("sign", "which"), [(1, "second"), (-1, "first")])
@pytest.mark.parametrize("parts", [1, 2])
def test_forces_push_grains_apart_whichever_they_act_on(tmp_path, sign, which, parts):
    """Normal and tangential parts are added."""
    names, columns = ["fx", "fy", "fz"], [sign * FORCE]
    if parts == 2:
        names = [f"{part}{axis}" for part in ("fn", "ft") for axis in "xyz"]
        columns = [sign * FORCE - 0.25, np.full(FORCE.shape, 0.25)]
    with pytest.warns(ScanfabNote, match=f"the forces act on the {which} grain"):
        contacts = joined(tmp_path, names, *columns)
    assert contacts.source == "file"
    assert np.all(contacts.force_n > 0)
    np.testing.assert_allclose(np.abs(contacts.force), np.abs(FORCE))


def test_forces_keep_the_sign_that_their_name_says_and_have_one_unit(tmp_path):
    """Cohesion all over: what pushes nothing apart is not turned round, but for a normal force."""
    for end, force in (("2", -FORCE), ("1", FORCE)):
        contacts = joined(tmp_path, [f"f{axis}{end}" for axis in "xyz"], force)
        assert np.all(contacts.force_n < 0)
    for sign in (1, -1):
        contacts = joined(tmp_path, ["fn"], sign * np.arange(1.0, len(PAIRS) + 1))
        assert np.all(contacts.force_n > 0)
    with pytest.raises(ReadError, match=r"forces of one unit, .* fx2 \[N\], .* fz2 \[kN\]"):
        joined(tmp_path, ["fx2 [N]", "fy2 [N]", "fz2 [kN]"], FORCE)


def test_forces_in_a_plane_need_no_third_component_but_those_in_space_do(tmp_path):
    with pytest.warns(ScanfabWarning, match="fx2, fy2 are left out, since there is no fz2"):
        assert joined(tmp_path, ["fx2", "fy2"], FORCE[:, :2]).force is None
    flat = rows(tmp_path / "g.csv", ID, POSITION * [1, 1, 0], RADIUS, names=["id", *"xyzr"])
    force = scanfab.read(flat, contacts=tmp_path / "c.csv").contacts.force
    np.testing.assert_array_equal(force, FORCE * [1, 1, 0])


def test_forces_of_both_signs_are_left_out_and_told(tmp_path):
    signs = np.where(np.arange(len(PAIRS)) % 3, 1.0, -1.0)[:, None]
    with pytest.warns(ScanfabWarning, match="the forces are left out: 67% of them push"):
        assert joined(tmp_path, ["fx", "fy", "fz"], signs * FORCE).force is None
    named = "id1=id1,id2=id2,fx2=fx,fy2=fy,fz2=fz"
    contacts = joined(tmp_path, ["fx", "fy", "fz"], signs * FORCE, contact_columns=named)
    assert np.mean(contacts.force_n > 0) == pytest.approx(2 / 3, abs=0.01)


@pytest.mark.parametrize("base", [0, 1])
def test_contacts_of_grains_without_ids_name_rows(tmp_path, base):
    contacts = rows(tmp_path / "c.csv", PAIRS + base, names=["id1", "id2"])
    with pytest.warns(ScanfabNote, match=f"their rows, counted from {base}"):
        packing = scanfab.read(grains_file(tmp_path, ids=False), contacts=contacts)
    assert {tuple(pair) for pair in packing.contacts.pairs} == {tuple(pair) for pair in PAIRS}
    write(contacts, "id1,id2\n1,40\n2,60\n5,33\n")
    told = "are listed as a contact, but their centres are"
    refuses(tmp_path / "grains.csv", told, error=scanfab.ScanfabError, contacts=contacts)


def test_contacts_with_walls_are_counted_and_no_pairs(tmp_path):
    """The second of DEM-Engine's SA is numbered among walls; else a wall has a negative number."""
    pairs = "".join(f"SS,{a},{b}\n" for a, b in ID[PAIRS])
    walls = f"SA,{ID[0]},{ID[1]}\nSA,{ID[0]},0\nSS,{ID[0]},-1\nSS,-1,-2\n"
    contacts = write(tmp_path / "c.csv", f"contact_type,A,B\n{pairs}{walls}")
    named = {"contacts": contacts, "contact_columns": "id1=A,id2=B"}
    packing = scanfab.read(grains_file(tmp_path), **named)
    assert len(packing.contacts) == len(PAIRS)
    assert packing.wall_contacts[0] == packing.wall_contacts.sum() == 3
    write(contacts, contacts.read_text() + "SS,7777,-1\n")
    refuses(tmp_path / "grains.csv", "names the grain 7777", **named)


def test_the_image_of_the_second_grain_is_kept(tmp_path):
    """Also where another one is nearer: two grains that touch through both faces."""
    grains = write(tmp_path / "g.csv", "id,x,y,z,radius\n1,.5,.5,.5,.6\n2,1.4,.5,.5,.6\n")
    contacts = write(tmp_path / "c.csv", "id1,id2,image.x,image.y,image.z\n1,2,-1,0,0\n")
    packing = scanfab.read(grains, contacts=contacts, cell=(2, 9, 9), periodic="x")
    np.testing.assert_array_equal(packing.contacts.normal, [[-1, 0, 0]])


def test_contact_columns_that_cannot_be_are_told(tmp_path):
    path = write(tmp_path / "g.csv", "x,y,z,r,age\n" + ROWS)
    pairs = write(tmp_path / "g.contacts.csv", "a,b\n0,1\n")
    twice = {"contacts": pairs, "contact_columns": "id1=a,id2=1"}
    refuses(path, "in contact with itself", error=scanfab.ScanfabError, format="table", **twice)
    refuses(path, "no column 'c'", contact_columns="id1=a,id2=c")
    assert len(scanfab.read(path, contact_columns="id1=a,id2=b").contacts) == 1


# where tables lie


def test_tables_beside_dumps_are_skipped_unless_they_are_named(tmp_path):
    dump = write(tmp_path / "dump_5.txt", dump_text(step=5))
    table = write(tmp_path / "table_5.csv", "id,x,y,z,radius\n1,0,0,0,1\n")
    pairs = write(tmp_path / "pairs_5.csv", "id1,id2\n1,2\n")
    told = r"skipped pairs_5\.csv, table_5\.csv: they hold results or other tables"
    with pytest.warns(ScanfabNote, match=told):
        series = scanfab.read_series(tmp_path)
    assert (len(series[0].read()), series.contacts) == (3, ())
    assert len(read(table)) == 1
    assert len(scanfab.read(dump, contacts=pairs).contacts) == 1
    write(tmp_path / "others_5.txt", pairs_text(step=5))
    assert len(scanfab.read_series(tmp_path)[0].read().contacts) == 2


def test_a_table_without_names_beside_others_is_a_frame_only_if_the_format_is_named(tmp_path):
    grains_file(tmp_path)
    write(tmp_path / "energy.txt", "0 1 2 0.1\n0 2 3 0.1\n")
    with pytest.warns(ScanfabNote, match=r"skipped energy\.txt"):
        assert len(scanfab.read_series(tmp_path)[0].read()) == 64
    refuses(tmp_path, "several series", format="table")
    (tmp_path / "grains.csv").unlink()
    assert len(scanfab.read_series(tmp_path)[0].read()) == 2


@pytest.mark.parametrize("text", ["hello\n", "step,a,b\n1,2,3\n", "1 2\n", "id,name\n1,a\n"])
def test_other_tables_are_nobodys(tmp_path, text):
    assert reader_for(write(tmp_path / "a.csv", text)) is None


# names of programs


@pytest.mark.parametrize("format", ["pfc", None])
def test_pfc(tmp_path, format):
    names = ["ball.id", "ball.pos.x", "ball.pos.y", "ball.pos.z", "ball.radius"]
    balls = rows(tmp_path / "b.csv", ID, POSITION, RADIUS, names=names)
    text = "contact.type,contact.end1.id,contact.end2.id,contact.force.normal\n"
    text += "".join(f"ball-ball,{a},{b},1.5\n" for a, b in ID[PAIRS])
    contacts = write(tmp_path / "c.csv", text + f"ball-facet,{ID[3]},{ID[4]},2.5\n")
    packing = scanfab.read(balls, contacts=contacts, format=format)
    assert_right(packing)
    assert len(packing.contacts) == len(PAIRS)
    assert packing.wall_contacts[3] == 1
    np.testing.assert_array_equal(packing.contacts.force_n, 1.5)


def test_edem(tmp_path):
    paths = {path.name: path for path in made("edem", tmp_path)}
    packing = scanfab.read(paths["grains.csv"], contacts=paths["pairs.csv"], format="edem")
    holds(packing, id=[1, 2, 3], radius=0.1, position=np.array(dumps.ROWS)[:, 2:5])
    # normal and tangential part of each are added
    holds(packing.contacts, pairs=[[0, 1], [1, 2]], force=[[0.1, 2.0, 0]] * 2)


# tables that are no text


def test_xyzd(tmp_path):
    path = tmp_path / "packing.xyzd"
    for data, told in ((b"", "the file is empty"), (bytes(65), "32 bytes each, found 65 bytes")):
        path.write_bytes(data)
        refuses(path, told)
    path.write_bytes(np.column_stack([POSITION, 2 * RADIUS / 1.1]).astype("<f8").tobytes())
    with pytest.warns(ScanfabWarning, match=r"no packing\.nfo beside the file"):
        np.testing.assert_allclose(read(path).radius, RADIUS / 1.1, rtol=1e-15)
    series = scanfab.read_series(path)
    assert [*series.files()] == [path]
    # (1 - final) / (1 - theoretical) = 1.331
    info = "N: 64\n Dimensions: 4 4.5 5.0\n Theoretical Porosity: 0.5\nFinal Porosity: 0.3345 (Tol"
    write(tmp_path / "packing.nfo", info)
    with pytest.warns(ScanfabNote, match=r"multiplied by 1\.1, from the porosities"):
        packing = read(path)
    np.testing.assert_allclose(packing.radius, RADIUS, rtol=1e-12)
    holds(packing, position=POSITION % [4, 4.5, 5])
    holds(packing.cell, vectors=np.diag([4, 4.5, 5]), periodic=(True, True, True))
    assert [*series.files()] == [path, tmp_path / "packing.nfo"]
    write(tmp_path / "packing.nfo", info.replace("0.3345", "none"))
    refuses(path, "expected the dimensions and both porosities")


def put_parquet(path, **columns):
    parquet.write_table(pyarrow.table(columns), path)


@pytest.mark.parametrize(
    ("ending", "put"), [(".npz", np.savez_compressed), (".parquet", put_parquet)]
)
def test_columns_that_are_no_text(tmp_path, ending, put):
    place = dict(zip("xyz", POSITION.T, strict=True))
    put(tmp_path / f"g{ending}", **place, r=RADIUS, id=ID)
    put(tmp_path / f"c{ending}", id2=ID[PAIRS[:, 1]], id1=ID[PAIRS[:, 0]])
    packing = scanfab.read(tmp_path / f"g{ending}", contacts=tmp_path / f"c{ending}")
    assert_right(packing)
    holds(packing, id=ID)
    holds(packing.contacts, pairs=PAIRS)


def test_arrays_of_positions(tmp_path):
    more = {"other": np.arange(3), "velocity": POSITION, "pairs": np.array([[0, 1]])}
    np.savez(tmp_path / "a.npz", pos=POSITION, r=RADIUS, **more)
    packing = read(tmp_path / "a.npz")
    assert_right(packing)
    assert set(packing.columns) == {"velocity_x", "velocity_y", "velocity_z"}


class Runs:
    """What runs a program when it is unpickled."""

    def __reduce__(self):
        return (pytest.fail, ("pickled objects run",))


def test_pickled_objects_are_refused_and_not_run(tmp_path):
    np.savez(tmp_path / "a.npz", x=np.array([Runs()], dtype=object), y=RADIUS)
    refuses(tmp_path / "a.npz", "cannot be read: Object arrays", format="table")


@pytest.mark.parametrize("data", [b"PK\x03\x04 or not", b"PAR1 or notPAR1"])
def test_damaged_files_are_told(tmp_path, data):
    (tmp_path / "a").write_bytes(data)
    refuses(tmp_path / "a", "cannot be read: (File is not a zip|parquet: )", format="table")
