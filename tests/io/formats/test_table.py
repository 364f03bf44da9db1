"""Tables of any program: what is proved is read and told, what is not is asked."""

from __future__ import annotations

import os
import pickle
import re
import warnings
import zipfile

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.io.formats import table, table_files
from scanfab.io.parse import text_table
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


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        ((POSITION, RADIUS), "x y z radius"),
        ((ID, POSITION, RADIUS), "id x y z radius"),
        ((POSITION, RADIUS, ID, ID), "x y z radius"),
        ((ID, POSITION, RADIUS, POSITION), "id x y z radius"),
    ],
)
def test_a_guess_that_holds_is_taken_and_told(tmp_path, columns, told):
    path = rows(tmp_path / "grains.txt", *columns)
    with pytest.warns(ScanfabNote, match=f"are taken for {told}, since the grains then touch"):
        packing = read(path)
    assert_right(packing)
    if told.startswith("id"):
        np.testing.assert_array_equal(packing.id, ID)


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ((POSITION, 2 * RADIUS), "a diameter, it seems"),
        ((ID, POSITION, 2 * RADIUS), "a diameter, it seems"),
        ((POSITION, 0.5 * RADIUS), "do not touch"),
        ((POSITION, np.pi * RADIUS**3), "do not touch"),
        ((POSITION, -RADIUS), "do not touch"),
        ((POSITION[:, :2], RADIUS, POSITION[:, 2:]), "do not touch"),
        ((np.ones(64), POSITION, RADIUS), "do not touch"),
        ((POSITION, POSITION, RADIUS), "do not touch"),
        ((10 * POSITION, RADIUS), "do not touch"),
        ((POSITION[:9], RADIUS[:9]), "fewer than 10 grains prove nothing"),
    ],
)
def test_a_guess_that_does_not_hold_is_asked(tmp_path, columns, reason):
    path = rows(tmp_path / "grains.txt", *columns)
    for options in ({}, {"format": "table"}):
        with pytest.raises(
            ReadError, match=rf"cannot be told .*{reason}.*`columns=\"x=1,y=2,z=3,r"
        ):
            read(path, **options)


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


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_a_table_without_names_is_proved_once_and_anew_when_it_changed(tmp_path, monkeypatch):
    proved = []
    prove = table.touch
    monkeypatch.setattr(table, "touch", lambda *words: proved.append(1) or prove(*words))
    path = rows(tmp_path / "grains.txt", POSITION, RADIUS)
    assert_right(read(path))
    assert len(proved) == 1
    # of the same size: the fourth column is now a diameter
    changed = path.read_text("utf-8").replace(" 0.5\n", " 1.0\n")
    path.write_text(changed, encoding="utf-8")
    os.utime(path, ns=(0, 0))
    with pytest.raises(ReadError, match="the fourth is a diameter"):
        read(path)


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_a_table_without_names_is_parsed_once(tmp_path, monkeypatch):
    parsed, parse = [], table_files.read_columns
    monkeypatch.setattr(table_files, "read_columns", lambda *how: parsed.append(1) or parse(*how))
    path = rows(tmp_path / "grains.txt", POSITION, RADIUS)
    assert_right(read(path))
    assert len(parsed) == 1
    assert_right(read(path))
    assert len(parsed) == 2  # its columns are not kept


def test_a_table_that_is_replaced_while_it_is_read_is_read_as_it_is_then(tmp_path, monkeypatch):
    monkeypatch.setattr(text_table, "PIECE", 10)
    path, read_to_end = tmp_path / "grains.csv", table_files.read_to_end
    path.write_text("x,y,z,radius\n1,2,3,4\n5,6,7,8\n")

    def replaced(*how):
        found = read_to_end(*how)
        path.write_text("radius,x,y,z\n4,1,2,3\n88,55,66,77\n")
        return found

    monkeypatch.setattr(table_files, "read_to_end", replaced)
    assert read(path).position.tolist() == [[1, 2, 3], [55, 66, 77]]


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
    with pytest.warns(ScanfabNote, match="id x y z radius"):
        np.testing.assert_array_equal(read(tmp_path / "h.txt").id, large)


def test_a_table_without_rows_is_an_empty_frame(tmp_path):
    assert len(read(write(tmp_path / "g.csv", "id,x,y,z,radius\n"))) == 0


def test_a_last_line_without_an_end_is_told(tmp_path):
    path = rows(tmp_path / "g.csv", POSITION, RADIUS, names=["x", "y", "z", "r"], separator=",")
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.warns(ScanfabWarning, match=r"g\.csv: the last line has no end: if the file was"):
        assert_right(read(path))


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
    with pytest.warns(ScanfabNote, match=r"passed over.*pairs_5\.csv \(a table beside dumps\)"):
        series = scanfab.read_series(tmp_path)
    assert len(series[0].read()) == 3
    assert series.contacts == ()
    # one of them by its name
    assert len(scanfab.read(tmp_path / "table_5.csv", contacts="geometric")) == 1
    packing = scanfab.read(tmp_path / "dump_5.txt", contacts=tmp_path / "pairs_5.csv")
    assert len(packing.contacts) == 1


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
    ["hello\n", "step,a,b\n1,2,3\n", "1 2\n", "x,y\n1,2\n", "id,name\n1,a\n", "1,2,3,4\n" * 20],
)
def test_other_tables_are_nobodys(tmp_path, text):
    for name in ("a.csv", "a.txt", "a.log"):
        assert reader_for(write(tmp_path / name, text)) is None


# maps by name


def test_pfc(tmp_path):
    names = ["ball.id", "ball.pos.x", "ball.pos.y", "ball.pos.z", "ball.radius"]
    balls = rows(tmp_path / "b.csv", ID, POSITION, RADIUS, names=names, separator=",")
    text = "contact.type,contact.end1.id,contact.end2.id,contact.force.normal\n"
    text += "".join(f"ball-ball,{a},{b},1.5\n" for a, b in ID[PAIRS])
    contacts = write(tmp_path / "c.csv", text + f"ball-facet,{ID[3]},{ID[4]},2.5\n")
    packing = scanfab.read(balls, contacts=contacts, format="pfc")
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


def test_xyzd(tmp_path):
    path = tmp_path / "packing.xyzd"
    path.write_bytes(np.column_stack([POSITION, 2 * RADIUS]).astype("<f8").tobytes())
    assert_right(read(path))
    path.write_bytes(np.column_stack([POSITION, 2 * RADIUS]).astype(">f8").tobytes())
    with pytest.raises(ReadError, match="its grains do not touch"):
        read(path)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(ReadError, match="rows of four doubles, 32 bytes each, found 2047 bytes"):
        read(path)


def test_the_diameters_of_an_xyzd_are_scaled_by_its_porosities(tmp_path):
    """(1 - final) / (1 - theoretical) = 1.331, a factor of 1.1."""
    path = tmp_path / "packing.xyzd"
    path.write_bytes(np.column_stack([POSITION, 2 * RADIUS / 1.1]).astype("<f8").tobytes())
    with pytest.raises(ReadError, match=r"packing\.nfo with the porosities"):
        read(path)
    np.testing.assert_allclose(read(path, columns="x=1,y=2,z=3,diameter=4").radius, RADIUS / 1.1)
    info = "64 spheres\nbox\nTheoretical Porosity: 0.5\nFinal Porosity: 0.3345\n"
    write(tmp_path / "packing.nfo", info)
    with pytest.warns(ScanfabNote, match=r"multiplied by 1\.1, from the porosities"):
        np.testing.assert_allclose(read(path).radius, RADIUS, rtol=1e-12)
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


# what a trial by a fresh reader found


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_a_relative_path_may_come_to_mean_another_file(tmp_path, monkeypatch):
    for number in (0, 7):
        folder = tmp_path / f"run{number}"
        folder.mkdir()
        text = "".join(f"{x + number:10.5f} {y:.5f} {z:.5f} 0.5\n" for x, y, z in POSITION)
        os.utime(write(folder / "g.txt", text), ns=(0, 0))
    monkeypatch.chdir(tmp_path / "run0")
    scanfab.read_series("g.txt")
    monkeypatch.chdir(tmp_path / "run7")
    assert read("g.txt").position[:, 0].min() > 6.9


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


def test_signs_of_thousands_are_no_decimal_commas(tmp_path):
    text = "x\ty\tz\tradius\n120\t840\t1,080\t60\n240\t1,200\t10\t60\n"
    with pytest.raises(ReadError, match=r"'1,200' may be a decimal number or have a sign of thous"):
        read(write(tmp_path / "a.tsv", text))
    # one that can be nothing else shows what they are
    packing = read(write(tmp_path / "b.tsv", text.replace("840", "0,840")))
    np.testing.assert_array_equal(packing.position, [[120, 0.84, 1.08], [240, 1.2, 10]])


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


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x,y,z,radius\n" + "1," * 75_000 + "1\n", "line 2: expected a row of at most 65536 bytes"),
        ("x,y,z,radius\n" + "1," * 300_000 + "1\n", "at most 65536 bytes, found more"),
        (",".join(f"c{k}" for k in range(5000)) + "\n", "at most 4096 columns, found 5000"),
        ("1 " * 5000 + "\n", "at most 4096 columns, found 5000"),
    ],
)
def test_no_table_of_grains_has_thousands_of_columns(tmp_path, text, told):
    with pytest.raises(ReadError, match=told):
        read(write(tmp_path / "a.csv", text))
