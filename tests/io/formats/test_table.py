"""Tables of any program: what is proved is read and told, what is not is asked."""

from __future__ import annotations

import pickle
import re
import warnings
import zipfile

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning, SettingsError
from scanfab.io.options import parse_columns
from scanfab.io.registry import reader_for
from tests.helpers.dumps import dump_text, pairs_text, write
from tests.helpers.truth import FLOOR, csv_rows

EDGE = 4


def lattice(shake=0.0):
    """Sixty-four equal spheres that touch along the axes: centres and radii."""
    grid = np.stack(np.meshgrid(*[np.arange(float(EDGE))] * 3, indexing="ij"), -1).reshape(-1, 3)
    return grid + shake * np.random.default_rng(0).uniform(-1, 1, grid.shape), np.full(64, 0.5)


POSITION, RADIUS = lattice(0.002)
ID = np.random.default_rng(1).permutation(1000)[:64] + 5
PAIRS = np.argwhere(np.triu(np.linalg.norm(POSITION[:, None] - POSITION, axis=2) < 1.1, 1))
# on the second grain of each pair, mostly along the normal
FORCE = POSITION[PAIRS[:, 1]] - POSITION[PAIRS[:, 0]] + 0.1


def rows(path, *columns, names=None, separator=" "):
    lines = [separator.join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    text = "\n".join([*([] if names is None else [separator.join(names)]), *lines]) + "\n"
    return write(path, text)


def read(path, **options):
    return scanfab.read(path, **{"contacts": "geometric", **options})


def assert_right(packing):
    np.testing.assert_array_equal(packing.position, POSITION)
    np.testing.assert_array_equal(packing.radius, RADIUS)


# what columns without names are


@pytest.mark.parametrize("loose", [1.0, 3.0])
@pytest.mark.parametrize(
    ("columns", "told"),
    [
        ((POSITION, RADIUS), "x y z radius"),
        ((ID, POSITION, RADIUS), "id x y z radius"),
        ((POSITION, RADIUS, np.full(64, -1)), "x y z radius clump"),
        ((POSITION, RADIUS, np.arange(64) // 2), "x y z radius clump"),
    ],
)
def test_a_table_without_names_is_read_by_a_rule_that_is_told(tmp_path, columns, told, loose):
    """Also loose packings, with any ending: columns 2 to 4 are lengths, whatever touches."""
    columns = [loose * one if one is POSITION else one for one in columns]
    for name in ("grains.txt", "111_10k.spheres", "pack.out"):
        lines = [" ".join(map(repr, row)) for row in zip(*map(list, _single(columns)), strict=True)]
        path = write(tmp_path / name, "\n".join(lines) + "\n")
        with pytest.warns(
            ScanfabNote, match=f"have no names and are taken for {told}: .*`columns`"
        ):
            packing = read(path)
        np.testing.assert_array_equal(packing.position, loose * POSITION)
        np.testing.assert_array_equal(packing.radius, RADIUS)
    if told.startswith("id"):
        np.testing.assert_array_equal(packing.id, ID)
    if told.endswith("clump"):
        np.testing.assert_array_equal(packing.columns["clump"], columns[-1])


def _single(columns):
    """Columns of one number a row, as Python's own."""
    return [part for one in columns for part in np.atleast_2d(one.T).tolist()]


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ((POSITION, 2 * RADIUS), "in one another"),
        ((ID, POSITION, 2 * RADIUS), "in one another"),
        ((POSITION, -RADIUS), "not be positive"),
        ((np.tile(POSITION, (2, 1)), np.tile(RADIUS, 2)), "two frames"),
        ((POSITION, RADIUS, RADIUS), "not be whole"),
        ((ID, POSITION), "seems to be ids"),
        ((POSITION, RADIUS, ID, ID), "the 6 columns have no names .expected four or five"),
        ((POSITION,), "3 columns"),
    ],
)
def test_a_table_without_names_that_cannot_be_so_is_asked(tmp_path, columns, reason):
    lines = [" ".join(map(repr, row)) for row in zip(*_single(columns), strict=True)]
    path = write(tmp_path / "grains.txt", "\n".join(lines) + "\n")
    for options in ({}, {"format": "table"}):
        with pytest.raises(ReadError, match=rf"{reason}.*`columns=\"x=1,y=2,z=3,r"):
            read(path, **options)


def test_options_of_tables_serve_a_text_of_any_ending(tmp_path):
    lines = [" ".join(map(repr, row)) for row in zip(*_single([POSITION, 2 * RADIUS]), strict=True)]
    path = write(tmp_path / "pack.out", "made by hand\n" + "\n".join(lines) + "\n")
    assert_right(read(path, skip=1, columns="x=1,y=2,z=3,diameter=4"))
    with pytest.raises(ReadError, match=r"as a table .* columns"):
        read(write(tmp_path / "notes", "some words\nand more of them\n"))


def test_a_diameter_is_one_where_the_user_says_so(tmp_path):
    path = rows(tmp_path / "grains.txt", POSITION, 2 * RADIUS, RADIUS)
    assert_right(read(path, columns="x=1,y=2,z=3,diameter=4"))
    packing = read(path, columns={"x": 1, "y": 2, "z": 3, "radius": "5"})
    assert_right(packing)
    np.testing.assert_array_equal(packing.columns["4"], 2 * RADIUS)


def test_any_column_can_be_given_a_name(tmp_path):
    path = rows(tmp_path / "grains.txt", POSITION, RADIUS, ID)
    packing = read(path, columns="x=1,y=2,z=3,radius=4,type=5")
    np.testing.assert_array_equal(packing.columns["type"], ID)


def test_a_diameter_that_the_user_names_comes_before_a_radius_of_the_file(tmp_path):
    names = ["x", "y", "z", "r", "size"]
    path = rows(tmp_path / "grains.csv", POSITION, 9 * RADIUS, 2 * RADIUS, names=names)
    assert_right(read(path, columns="diameter=size"))


@pytest.mark.parametrize("name", ["d", "size", "rad_mm_half"])
def test_a_column_that_may_be_a_size_is_not_taken_for_one(tmp_path, name):
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, names=["x", "y", "z", name], separator=",")
    with pytest.raises(ReadError, match=r"no grains|no radius"):
        read(path, format="table")
    assert_right(read(path, columns={"radius": name}))


# names


@pytest.mark.parametrize(
    "names",
    [
        ["x", "y", "z", "radius"],
        ["X", "Y", "Z", "r"],
        ["pos_x", "pos_y", "pos_z", "Radius"],
        ["Points:0", "Points:1", "Points:2", "radii"],
        ["x [m]", "y [m]", "z [m]", "radius [m]"],
    ],
)
def test_usual_names(tmp_path, names):
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, ID, names=[*names, "kept"], separator=",")
    packing = read(path)
    assert_right(packing)
    np.testing.assert_array_equal(packing.columns["kept"], ID)


def test_lengths_of_two_units_are_refused(tmp_path):
    names = ["x (m)", "y (m)", "z (m)", "radius (mm)"]
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, names=names, separator=",")
    with pytest.raises(ReadError, match=r"lengths of one unit .* x \(m\), .* radius \(mm\)"):
        read(path, format="table")


@pytest.mark.parametrize("second", ["x", "X"])
def test_a_name_that_stands_twice_is_asked(tmp_path, second):
    names = ["x", "y", "z", "radius", second]
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, ID, names=names, separator=",")
    with pytest.raises(ReadError, match=r"several columns may be x: 'x' \(column 1\), .*column 5"):
        read(path)
    assert_right(read(path, columns="x=1"))


def test_ids_above_what_decimals_hold_stay_exact(tmp_path):
    large = ID + 2**53
    path = rows(tmp_path / "g.txt", POSITION, RADIUS)
    text = "".join(
        f"{one} {line}" for one, line in zip(large, path.read_text().splitlines(True), strict=True)
    )
    np.testing.assert_array_equal(
        read(write(tmp_path / "h.txt", text), columns="id=1,x=2,y=3,z=4,radius=5").id, large
    )
    np.testing.assert_array_equal(read(tmp_path / "h.txt").id, large)


def test_a_table_without_rows_is_an_empty_frame(tmp_path):
    assert len(read(write(tmp_path / "g.csv", "id,x,y,z,radius\n"))) == 0


def test_a_last_line_without_an_end_is_told(tmp_path):
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, names=["x", "y", "z", "r"], separator=",")
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.warns(ScanfabWarning, match=r"g\.csv: the last line has no end: if the file was"):
        assert_right(read(path))


def test_names_that_were_cut_are_told_of(tmp_path):
    path = write(tmp_path / "g.csv", "id,x,y,z,rad")
    with pytest.warns(ScanfabWarning, match=r"g\.csv: the last line has no end"):
        assert len(scanfab.read(path, columns={"radius": "rad"})) == 0


def test_points_need_a_radius(tmp_path):
    path = rows(tmp_path / "g.csv", POSITION, names=["x", "y", "z"], separator=",")
    with pytest.raises(ReadError, match="no radius"):
        read(path, format="table")
    assert_right(read(path, format="table", radius=0.5))


# contacts


def grains_file(folder, *, ids=True):
    names = [*(["id"] if ids else []), "x", "y", "z", "radius"]
    columns = [*([ID] if ids else []), POSITION, RADIUS]
    return rows(folder / "grains.csv", *columns, names=names, separator=",")


def contacts_file(folder, names, *columns):
    ids = ID[PAIRS]
    return rows(folder / "c.csv", ids, *columns, names=["id1", "id2", *names], separator=",")


@pytest.mark.parametrize(("sign", "which"), [(1, "second"), (-1, "first")])
def test_forces_push_grains_apart_whichever_they_act_on(tmp_path, sign, which):
    grains = grains_file(tmp_path)
    contacts = contacts_file(tmp_path, ["fx", "fy", "fz"], sign * FORCE)
    with pytest.warns(ScanfabNote, match=f"the forces act on the {which} grain"):
        packing = scanfab.read(grains, contacts=contacts)
    assert packing.contacts.source == "file"
    assert np.all(packing.contacts.force_n > 0)
    np.testing.assert_allclose(np.abs(packing.contacts.force), np.abs(FORCE))


@pytest.mark.parametrize(("end", "sign"), [("2", 1), ("1", -1)])
def test_forces_keep_the_sign_that_their_name_says(tmp_path, end, sign):
    """Cohesion all over: what pushes nothing apart is not turned round."""
    names = [f"fx{end}", f"fy{end}", f"fz{end}"]
    contacts = contacts_file(tmp_path, names, -sign * FORCE)
    packing = scanfab.read(grains_file(tmp_path), contacts=contacts)
    assert np.all(packing.contacts.force_n < 0)


def test_forces_in_a_plane_need_no_third_component(tmp_path):
    flat = POSITION * [1, 1, 0]
    grains = rows(tmp_path / "g.csv", ID, flat, RADIUS, names=["id", *"xyz", "r"], separator=",")
    contacts = contacts_file(tmp_path, ["fx2", "fy2"], FORCE[:, :2])
    force = scanfab.read(grains, contacts=contacts).contacts.force
    np.testing.assert_array_equal(force, FORCE * [1, 1, 0])


def test_forces_that_lack_a_component_in_space_are_left_out_and_told(tmp_path):
    contacts = contacts_file(tmp_path, ["fx2", "fy2"], FORCE[:, :2])
    with pytest.warns(ScanfabWarning, match="fx2, fy2 are left out, since there is no fz2"):
        packing = scanfab.read(grains_file(tmp_path), contacts=contacts)
    assert packing.contacts.force is None


def test_forces_of_two_units_are_refused(tmp_path):
    contacts = contacts_file(tmp_path, ["fx2 [N]", "fy2 [N]", "fz2 [kN]"], FORCE)
    with pytest.raises(ReadError, match=r"forces of one unit .* fx2 \[N\], .* fz2 \[kN\]"):
        scanfab.read(grains_file(tmp_path), contacts=contacts)


def test_forces_of_both_signs_are_left_out_and_told(tmp_path):
    signs = np.where(np.arange(len(PAIRS)) % 3, 1.0, -1.0)[:, None]
    contacts = contacts_file(tmp_path, ["fx", "fy", "fz"], signs * FORCE)
    with pytest.warns(ScanfabWarning, match="the forces are left out: 67% of them push"):
        packing = scanfab.read(grains_file(tmp_path), contacts=contacts)
    assert packing.contacts.force is None
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabWarning)
        packing = scanfab.read(
            grains_file(tmp_path),
            contacts=contacts,
            contact_columns="id1=id1,id2=id2,fx2=fx,fy2=fy,fz2=fz",
        )
    assert np.mean(packing.contacts.force_n > 0) == pytest.approx(2 / 3, abs=0.01)


@pytest.mark.parametrize("sign", [1, -1])
def test_normal_forces_are_positive_in_compression(tmp_path, sign):
    contacts = contacts_file(tmp_path, ["fn"], sign * np.arange(1.0, len(PAIRS) + 1))
    packing = scanfab.read(grains_file(tmp_path), contacts=contacts)
    assert np.all(packing.contacts.force_n > 0)


@pytest.mark.parametrize("base", [0, 1])
def test_contacts_of_grains_without_ids_name_rows(tmp_path, base):
    grains = grains_file(tmp_path, ids=False)
    contacts = rows(tmp_path / "c.csv", PAIRS + base, names=["id1", "id2"], separator=",")
    with pytest.warns(ScanfabNote, match=f"their rows, counted from {base}, since"):
        packing = scanfab.read(grains, contacts=contacts)
    assert {tuple(pair) for pair in packing.contacts.pairs} == {tuple(pair) for pair in PAIRS}


def test_rows_that_are_no_neighbours_either_way_are_refused(tmp_path):
    grains = grains_file(tmp_path, ids=False)
    pairs = [[1, 40], [2, 60], [5, 33]]
    contacts = rows(tmp_path / "c.csv", pairs, names=["id1", "id2"], separator=",")
    with pytest.raises(ReadError, match="the grain file has no ids, and as rows"):
        scanfab.read(grains, contacts=contacts)


def test_contacts_with_walls_are_counted_and_no_pairs(tmp_path):
    """The second of DEM-Engine's SA and PFC's ball-facet is numbered among walls."""
    text = "".join(f"SS,{a},{b}\n" for a, b in ID[PAIRS])
    walls = f"SA,{ID[0]},{ID[1]}\nSA,{ID[0]},0\n"
    contacts = write(tmp_path / "c.csv", "contact_type,A,B\n" + text + walls)
    packing = scanfab.read(grains_file(tmp_path), contacts=contacts, contact_columns="id1=A,id2=B")
    assert len(packing.contacts) == len(PAIRS)
    assert packing.wall_contacts[0] == 2
    assert packing.wall_contacts.sum() == 2


def test_the_image_of_the_second_grain_is_kept(tmp_path):
    """In a cell of two grains they touch through both faces."""
    grains = write(tmp_path / "g.csv", "id,x,y,z,radius\n1,.5,.5,.5,.5\n2,1.5,.5,.5,.5\n")
    contacts = write(tmp_path / "c.csv", "id1,id2,ix,iy,iz\n1,2,0,0,0\n1,2,-1,0,0\n")
    packing = scanfab.read(grains, contacts=contacts, cell=(2, 9, 9), periodic="x")
    np.testing.assert_array_equal(packing.contacts.normal, [[1, 0, 0], [-1, 0, 0]])


# where tables lie


def test_a_folder_of_tables_is_a_series(tmp_path):
    for step in (9, 10):
        grains_file(tmp_path).rename(tmp_path / f"grains_{step}.csv")
        contacts_file(tmp_path, []).rename(tmp_path / f"pairs_{step}.csv")
    frames = [frame.read() for frame in scanfab.read_series(tmp_path)]
    assert [frame.step for frame in frames] == [9, 10]
    assert [len(frame.contacts) for frame in frames] == [len(PAIRS)] * 2


def test_tables_beside_dumps_are_passed_over(tmp_path):
    write(tmp_path / "dump_5.txt", dump_text(step=5))
    write(tmp_path / "table_5.csv", "id,x,y,z,radius\n1,0,0,0,1\n")
    write(tmp_path / "pairs_5.csv", "id1,id2\n1,2\n")
    with pytest.warns(
        ScanfabNote,
        match=r"skipped pairs_5\.csv, table_5\.csv: they hold results, or some",
    ):
        series = scanfab.read_series(tmp_path)
    assert len(series[0].read()) == 3
    assert series.contacts == ()
    # one of them by its name
    assert len(scanfab.read(tmp_path / "table_5.csv", contacts="geometric")) == 1
    packing = scanfab.read(tmp_path / "dump_5.txt", contacts=tmp_path / "pairs_5.csv")
    assert len(packing.contacts) == 1


def test_a_table_without_names_beside_others_is_a_frame_only_if_the_format_is_named(tmp_path):
    grains_file(tmp_path)
    write(tmp_path / "energy.txt", "0 1 2 0.1\n0 2 3 0.1\n")
    with pytest.warns(ScanfabNote, match=r"skipped energy\.txt"):
        assert len(scanfab.read_series(tmp_path)[0].read()) == 64
    with pytest.raises(ReadError, match="several series"):
        scanfab.read_series(tmp_path, format="table")
    (tmp_path / "grains.csv").unlink()
    assert len(scanfab.read_series(tmp_path)[0].read()) == 2


@pytest.mark.parametrize("whole_folder", [True, False])
def test_a_table_that_is_named_as_contacts_of_a_dump_is_taken(tmp_path, whole_folder):
    path = write(tmp_path / "dump_5.txt", dump_text(step=5))
    write(tmp_path / "dump_5.contacts.csv", "id1,id2\n1,2\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ScanfabNote)
        packing = scanfab.read_series(tmp_path if whole_folder else path)[0].read()
    np.testing.assert_array_equal(packing.contacts.pairs, [[0, 1]])


def test_contacts_of_a_dump_come_before_tables(tmp_path):
    write(tmp_path / "dump_5.txt", dump_text(step=5))
    write(tmp_path / "pairs_5.txt", pairs_text(step=5))
    write(tmp_path / "other_5.csv", "id1,id2\n1,2\n")
    assert len(scanfab.read_series(tmp_path)[0].read().contacts) == 2


def test_a_table_beside_real_dumps_is_right(tmp_path):
    """The truth that stands beside the dumps of LIGGGHTS is itself a table."""
    truth = csv_rows(FLOOR / "truth_grains.csv")
    packing = read(FLOOR / "truth_grains.csv")
    np.testing.assert_array_equal(packing.position[:, 2], truth["z"])
    np.testing.assert_array_equal(packing.radius, truth["radius"])


@pytest.mark.parametrize(
    "text",
    ["hello\n", "step,a,b\n1,2,3\n", "1 2\n", "x,y\n1,2\n", "id,name\n1,a\n"],
)
def test_other_tables_are_nobodys(tmp_path, text):
    for name in ("a.csv", "a.txt", "a.log"):
        assert reader_for(write(tmp_path / name, text)) is None


# maps by name


@pytest.mark.parametrize("format", ["pfc", None])
def test_pfc(tmp_path, format):
    names = ["ball.id", "ball.pos.x", "ball.pos.y", "ball.pos.z", "ball.radius"]
    balls = rows(tmp_path / "b.csv", ID, POSITION, RADIUS, names=names, separator=",")
    text = "contact.type,contact.end1.id,contact.end2.id,contact.force.normal\n"
    text += "".join(f"ball-ball,{a},{b},1.5\n" for a, b in ID[PAIRS])
    contacts = write(tmp_path / "c.csv", text + f"ball-facet,{ID[3]},{ID[4]},2.5\n")
    packing = scanfab.read(balls, contacts=contacts, format=format)
    assert_right(packing)
    assert len(packing.contacts) == len(PAIRS)
    assert packing.wall_contacts[3] == 1
    np.testing.assert_array_equal(packing.contacts.force_n, 1.5)


def test_edem(tmp_path):
    titles = ["Particle ID", "Particle Volume", *(f"Particle Position {a}" for a in "XYZ")]
    names = [f"Q{number:02} : {title}:" for number, title in enumerate(titles, start=2)]
    volume = 4 / 3 * np.pi * RADIUS**3
    grains = rows(tmp_path / "p.csv", ID, volume, POSITION, names=names, separator=",")
    titles = ["IDfirst", "IDsecond", *(f"Normal Force {a}" for a in "XYZ")]
    titles += [f"Tangential Force {a}" for a in "XYZ"]
    names = [f"Q{number:02}:Contact {title}:" for number, title in enumerate(titles, start=2)]
    normal = POSITION[PAIRS[:, 1]] - POSITION[PAIRS[:, 0]]
    contacts = rows(
        tmp_path / "c.csv", ID[PAIRS], -normal, normal - FORCE, names=names, separator=","
    )
    with pytest.warns(ScanfabNote, match="radii are those of spheres of the volumes"):
        packing = scanfab.read(grains, contacts=contacts, format="edem")
    np.testing.assert_allclose(packing.radius, RADIUS, rtol=1e-15)
    np.testing.assert_allclose(np.abs(packing.contacts.force), np.abs(FORCE), rtol=1e-12)


# what is no text


def xyzd(folder, factor=1.0, info=None):
    path = folder / "packing.xyzd"
    path.write_bytes(np.column_stack([POSITION, 2 * RADIUS / factor]).astype("<f8").tobytes())
    write(folder / "packing.nfo", info) if info else None
    return path


def test_xyzd(tmp_path):
    path = xyzd(tmp_path)
    with pytest.warns(ScanfabWarning, match=r"no packing\.nfo beside the file"):
        assert_right(read(path))
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(ReadError, match="rows of four doubles, 32 bytes each, found 2047 bytes"):
        read(path)
    path.write_bytes(b"")
    with pytest.raises(ReadError, match="the file is empty"):
        read(path)


def test_packing_nfo_says_the_cell_of_an_xyzd_and_the_factor_of_its_diameters(tmp_path):
    """(1 - final) / (1 - theoretical) = 1.331, a factor of 1.1."""
    info = "N: 64\n Dimensions: 4 4.5 5.0\n Theoretical Porosity: 0.5\nFinal Porosity: 0.3345 (Tol"
    path = xyzd(tmp_path, 1.1, info)
    with pytest.warns(ScanfabNote, match=r"multiplied by 1\.1, from the porosities"):
        packing = read(path)
    np.testing.assert_allclose(packing.radius, RADIUS, rtol=1e-12)
    np.testing.assert_array_equal(packing.cell.vectors, np.diag([4, 4.5, 5]))
    assert packing.cell.periodic == (True, True, True)
    write(tmp_path / "packing.nfo", info.replace("0.3345", "none"))
    with pytest.raises(ReadError, match="expected a theoretical and a final porosity"):
        read(path)


def test_arrays_of_positions(tmp_path):
    path = tmp_path / "a.npz"
    np.savez_compressed(path, pos=POSITION, r=RADIUS, id=ID, other=np.arange(3), velocity=POSITION)
    packing = read(path)
    assert_right(packing)
    np.testing.assert_array_equal(packing.id, ID)
    assert set(packing.columns) == {"velocity_x", "velocity_y", "velocity_z"}


class Runs:
    """What runs a program when it is unpickled."""

    def __reduce__(self):
        return (pytest.fail, ("pickled objects run",))


def test_pickled_objects_are_refused_and_not_run(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, x=np.array([Runs()], dtype=object), y=RADIUS)
    with pytest.raises(ReadError, match="the array x holds pickled objects"):
        read(path, format="table")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("x.npy", pickle.dumps(Runs()))
    with pytest.raises(ReadError, match="cannot be read as NPZ"):
        read(path, format="table")


def test_counts_that_lie_are_refused(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, radius=RADIUS)
    with zipfile.ZipFile(path) as archive:
        data = archive.read("radius.npy")
    lying = re.sub(rb"\(64,\), \}", b"(9999999999999,), }", data).replace(b" " * 11 + b"\n", b"\n")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("radius.npy", lying)
    with pytest.raises(ReadError, match=r"does not have the .* bytes|cannot be read as NPZ"):
        read(path, format="table")


@pytest.mark.parametrize("name", ["a.npz", "a.parquet"])
def test_damaged_files_are_told(tmp_path, name):
    (tmp_path / name).write_bytes(b"PK\x03\x04 or not" if name == "a.npz" else b"PAR1 or notPAR1")
    with pytest.raises(ReadError, match=r"cannot be read as (NPZ|Parquet)"):
        read(tmp_path / name, format="table")


def test_options_that_users_write_into_the_settings_file(tmp_path, capsys):
    from scanfab.cli.main import run

    text = rows(tmp_path / "g.txt", POSITION, 2 * RADIUS).read_text()
    write(tmp_path / "g.txt", "two lines\nbefore it\n" + text)
    write(
        tmp_path / "scanfab.toml",
        '[compute]\nformat = "table"\nskip = 2\ncolumns = "x=1,y=2,z=3,diameter=4"\n',
    )
    assert run(["inspect", str(tmp_path / "g.txt"), "--json"]) == 0
    assert '"grains": 64' in capsys.readouterr().out


@pytest.mark.parametrize("name", ["Time", "Time [s]", "time_s", "Time Step", "FRAME", "timestep"])
def test_frames_one_below_the_other_are_refused_whatever_their_name(tmp_path, name):
    frames = np.repeat([0.0, 1.0], 32)
    names = ["x", "y", "z", "radius", name]
    path = rows(tmp_path / "a.csv", POSITION, RADIUS, frames, names=names, separator=",")
    told = re.escape(f"the column {name} has 2 values: expected one frame")
    with pytest.raises(ReadError, match=told):
        read(path)


def test_what_may_be_frames_is_told(tmp_path):
    names = ["t", "x", "y", "z", "radius"]
    frames = np.repeat([1.0, 2.0], 32)
    path = rows(tmp_path / "a.csv", frames, POSITION, RADIUS, names=names, separator=",")
    with pytest.warns(ScanfabWarning, match="column t has 2 values, each in rows that follow"):
        read(path)
    # temperatures
    path = rows(tmp_path / "b.csv", frames[ID % 64], POSITION, RADIUS, names=names, separator=",")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(path)


def test_volumes_have_the_cube_of_the_unit_of_lengths(tmp_path):
    names = [f"Particle Position {axis} (mm)" for axis in "XYZ"]
    for unit, is_right in (("m^3", False), ("mm^3", True), ("mm\xb3", True)):
        path = rows(
            tmp_path / "a.csv",
            *(POSITION, 4 / 3 * np.pi * RADIUS**3),
            names=[*names, f"Particle Volume ({unit})"],
            separator=",",
        )
        if is_right:
            with pytest.warns(ScanfabNote, match="radii are those of spheres"):
                np.testing.assert_allclose(read(path, format="edem").radius, RADIUS)
        else:
            with pytest.raises(ReadError, match=r"the cube of the unit of lengths, mm, .* found P"):
                read(path, format="edem")


def test_two_letters_for_micro_are_one_unit(tmp_path):
    names = ["x (\xb5m)", "y (\u03bcm)", "z (\xb5m)", "r (\u03bcm)"]
    assert_right(read(rows(tmp_path / "a.csv", POSITION, RADIUS, names=names, separator=",")))


def test_a_radius_beside_an_angle_is_asked(tmp_path):
    distance = np.hypot(*POSITION[:, :2].T)
    angle = np.arctan2(*POSITION[:, :2].T)
    names = ["r", "theta", "x", "y", "z", "size"]
    columns = distance, angle, POSITION, RADIUS
    path = rows(tmp_path / "a.csv", *columns, names=names, separator=",")
    with pytest.raises(ReadError, match="the column r may be a radius of grains or, beside theta"):
        read(path)
    assert_right(read(path, columns="radius=size"))


def test_normal_and_tangential_forces_of_any_table_are_added(tmp_path):
    rows(tmp_path / "g.csv", POSITION, RADIUS, names=["x", "y", "z", "radius"], separator=",")
    names = ["id1", "id2", *(f"{part}{axis}" for part in ("fn", "ft") for axis in "xyz")]
    normal, tangential = FORCE - 0.25, np.full(FORCE.shape, 0.25)
    path = rows(tmp_path / "c.csv", PAIRS, normal, tangential, names=names, separator=",")
    with pytest.warns(ScanfabNote, match="act on the second grain"):
        packing = scanfab.read(tmp_path / "g.csv", contacts=path)
    np.testing.assert_allclose(packing.contacts.force, FORCE)


# names of columns


ROWS = "0,0,0,0.5,7\n1,0,0,0.5,7\n"


@pytest.mark.parametrize("format", [None, "table"])
@pytest.mark.parametrize(
    ("names", "columns", "twice"),
    [
        ("", {"x": 2, "y": "2", "z": 4, "radius": 5}, "'2' is named twice .*, as x and as y"),
        ("a,b,c,d,e\n", {"x": "a", "y": 2, "z": "b", "radius": "d"}, "'b' .*, as y and as z"),
        ("x,y,z,r,e\n", {"radius": "r", "age": "r"}, "'r' is named twice in .*, as radius and"),
    ],
)
def test_a_column_that_serves_twice_is_named(tmp_path, names, columns, twice, format):
    with pytest.raises(ReadError, match=f"the column {twice}"):
        scanfab.read(write(tmp_path / "g.csv", names + ROWS), columns=columns, format=format)


def test_so_it_is_of_dumps_and_of_contacts(tmp_path):
    dump = write(tmp_path / "dump.txt", dump_text())
    with pytest.raises(ReadError, match="'x' is named twice in `columns`, as x and as y"):
        scanfab.read(dump, columns={"x": "x", "y": "x"})
    path = write(tmp_path / "g.csv", "x,y,z,r,id\n" + ROWS)
    pairs = write(tmp_path / "p.csv", "id1,id2\n0,1\n")
    with pytest.raises(ReadError, match="'id1' is named twice in `contact_columns`"):
        scanfab.read(path, contacts=pairs, contact_columns="id1=id1,id2=1", format="table")
    with pytest.raises(SettingsError, match="columns: expected one column as x, found 'x=1,y=2,x"):
        parse_columns("columns", "x=1,y=2,x=3")


def test_contact_columns_that_no_file_has_are_told(tmp_path):
    path = write(tmp_path / "g.csv", "x,y,z,r,age\n" + ROWS)
    write(tmp_path / "g.contacts.csv", "a,b\n0,1\n")
    with pytest.warns(ScanfabWarning, match="there is no file of contacts with such columns"):
        scanfab.read(path, contact_columns="id1=a,id2=c")
    assert len(scanfab.read(path, contact_columns="id1=a,id2=b").contacts) == 1


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ("x [mm],y [mm],z [mm],radius,e", r"x \[mm\], y \[mm\], z \[mm\] name a unit, radius none"),
        ("x,y,z,radius (m),e", r"radius \(m\) name a unit, x, y, z none"),
        ("x,y,z,diameter (m),e [s]", r"diameter \(m\) name a unit, x, y, z none"),
        ("x,y,z,radius,age [s]", None),
        ("x [mm],y [mm],z [mm],radius [mm],e", None),
    ],
)
def test_lengths_without_a_unit_beside_others_are_told(tmp_path, names, told):
    path = write(tmp_path / "g.csv", f"{names}\n{ROWS}")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ScanfabWarning)
        scanfab.read(path)
    found = [str(one.message) for one in caught if issubclass(one.category, ScanfabWarning)]
    assert bool(told) == any(re.search(f"g.csv: {told}", one) for one in found)


def test_side_columns_may_have_gaps(tmp_path, capsys):
    """What needs them says so: types that are not there enclose nothing."""
    from scanfab.cli.main import run

    types = np.where(np.arange(64) == 5, "", "1")
    lines = "".join(
        f"{x},{y},{z},0.5,{kind}\n" for (x, y, z), kind in zip(POSITION, types, strict=True)
    )
    path = write(tmp_path / "g.csv", "x,y,z,radius,type\n" + lines)
    assert np.isnan(read(path).columns["type"][5])
    assert run(["inspect", str(path), "--json"]) == 0
    assert run(["inspect", str(path), "--boundary", "type=2"]) != 0
    assert "column type has no value for 1 of 64 particles" in capsys.readouterr().err


def test_pairs_that_stand_twice_are_counted_and_told(tmp_path):
    twice = np.vstack([PAIRS, PAIRS[:1, ::-1], PAIRS[:1], PAIRS[5:6]])
    contacts = rows(tmp_path / "c.csv", ID[twice], names=["id1", "id2"], separator=",")
    told = f"2 of {len(PAIRS)} pairs are listed more than once, such as"
    with pytest.warns(ScanfabWarning, match=told):
        scanfab.read(grains_file(tmp_path), contacts=contacts)


@pytest.mark.filterwarnings("ignore:.*the last line has no end")
@pytest.mark.parametrize("text", ["id1,id2,fn\n1,2,5\n2", "id1,id2,fn\n1,2"])
@pytest.mark.parametrize("whole_folder", [True, False])
def test_a_cut_list_of_contacts_beside_the_grains_is_an_error(tmp_path, text, whole_folder):
    path = write(tmp_path / "g_1.csv", "id,x,y,z,radius\n1,0,0,0,.5\n2,1,0,0,.5\n3,2,0,0,.5\n")
    write(tmp_path / "g_1.contacts.csv", text)
    with pytest.raises(ReadError, match=r"g_1\.contacts\.csv, line \d: .*columns"):
        scanfab.read(tmp_path if whole_folder else path)


def test_a_damaged_coordinate_is_told(tmp_path):
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, names=[*"xyz", "r"], separator=",")
    lines = path.read_text().splitlines(True)
    lines[7] = "1234567890123456789012345.0," + lines[7].partition(",")[2]
    with pytest.raises(ReadError, match=r"grain 7 has a coordinate of 1\.23457e\+2\d"):
        read(write(path, "".join(lines)))
