"""LAMMPS' dumps: its own fabric of a tilted cell, NetCDF, binary dumps; and data files."""

import struct

import numpy as np
import pytest

import scanfab
from scanfab import ScanfabWarning
from scanfab.io.formats import binary_dump as binary
from tests.helpers.dumps import NAMES, ROWS, binary_dump, holds, refuses, write
from tests.helpers.made.data_files import CENTRES, DIAMETERS, TITLE, data_file
from tests.helpers.made.lammps import netcdf
from tests.helpers.truth import OF_SHEAR, SHEAR, id_pairs, lammps_fabric, off_by

FORMS = SHEAR / "forms"
LAST = SHEAR / "shear.200000.lammpstrj.gz"
LAST_PAIRS = SHEAR / "pairs.200000.local.gz"
# LAMMPS computed its fabric in the state that is dumped, with 15 digits
GOLDEN = np.loadtxt(SHEAR / "fabric.txt")


@pytest.fixture(scope="module")
def frames():
    with pytest.warns(scanfab.ScanfabNote, match="skipped"):
        series = scanfab.read_series(SHEAR, contact_columns=OF_SHEAR)
    return [frame.read() for frame in series]


def test_frames_have_steps_times_and_tilts(frames):
    assert [packing.step for packing in frames] == [0, 40000, 80000, 120000, 160000, 200000]
    np.testing.assert_allclose([packing.time for packing in frames], 0.44 + 0.4 * np.arange(6))
    tilt = [packing.cell.vectors[1, 0] / packing.cell.vectors[0, 0] for packing in frames]
    assert tilt[0] == 0
    assert tilt[-1] > 1
    assert all(packing.cell.periodic == (True, True, True) for packing in frames)


@pytest.mark.parametrize("number", range(6))
def test_contacts_of_the_file_and_by_geometry_give_lammps_own_fabric(frames, number):
    packing = frames[number]
    found = scanfab.find_contacts(packing)
    for one in (packing, found):
        np.testing.assert_allclose(lammps_fabric(one), GOLDEN[number, 1:], atol=1e-12)
        ends = np.bincount(one.contacts.pairs.ravel(), minlength=len(packing))
        np.testing.assert_array_equal(ends, packing.columns["c_touch"])
    assert id_pairs(found) == id_pairs(packing)
    assert packing.contacts.image.any(axis=1).sum() > 200
    push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
    assert np.all(push > 0)


UNNAMED = [
    (LAST_PAIRS, None),
    # pairs that do not touch are left out
    (FORMS / "wide.local.gz", None),
    (FORMS / "wide.local.gz", "id1=c_wideids[1],id2=c_wideids[2]"),
]


@pytest.mark.parametrize(("contacts", "columns"), UNNAMED)
def test_ids_are_found_without_being_named_and_forces_are_not(contacts, columns):
    named = scanfab.read(LAST, contacts=LAST_PAIRS, contact_columns=OF_SHEAR)
    packing = scanfab.read(LAST, contacts=contacts, contact_columns=columns)
    assert id_pairs(packing) == id_pairs(named)
    assert packing.contacts.force is None


@pytest.mark.parametrize("name", ["scaled.lammpstrj.gz", "shear.data.gz"])
def test_other_forms_hold_the_same_grains(name):
    last, other = scanfab.read(LAST), scanfab.read(FORMS / name, periodic="xyz")
    assert other.step == 200000
    order, others = np.argsort(last.id), np.argsort(other.id)
    np.testing.assert_array_equal(last.radius[order], other.radius[others])
    np.testing.assert_allclose(other.cell.vectors, last.cell.vectors, rtol=1e-12, atol=1e-15)
    assert off_by(other, last.position[order][np.argsort(others)]).max() < 1e-15


def test_netcdf(tmp_path):
    series = scanfab.read_series(netcdf(tmp_path / "a.nc", written=2))
    assert [(frame.step, frame.snapshot.time) for frame in series] == [(0, 0.0), (100, 50.0)]
    first, second = (frame.read() for frame in series)
    holds(first, position=first.cell.wrap(np.array(ROWS)[:, 2:5]), radius=0.1)
    # one atom was lost: its place holds what was never written
    holds(second, id=[1, 2])
    # edges a, b and their angle; an edge of length 0 does not repeat
    holds(first.cell, periodic=(True, True, False), origin=[0, -1, 0])
    np.testing.assert_allclose(first.cell.vectors[:2], [[1, 0, 0], [1, 3**0.5, 0]], atol=1e-15)
    assert scanfab.read(netcdf(tmp_path / "b.nc", lengths=(0, 0, 0)), frame=0).cell is None
    path = netcdf(tmp_path / "c.nc", name="scaled_coordinates", lengths=(2, 2, 4))
    scaled = scanfab.read(path, frame=0)
    expected = scaled.cell.origin + np.array(ROWS)[:, 2:5] @ scaled.cell.vectors
    np.testing.assert_allclose(scaled.position, scaled.cell.wrap(expected))


def test_netcdf_that_cannot_be_read(tmp_path, monkeypatch):
    refuses(netcdf(tmp_path / "a.nc", axes=2), "coordinates was not written for all atoms", frame=0)
    monkeypatch.setattr(binary, "find_spec", lambda name: None)
    refuses(tmp_path / "a.nc", r'pip install "scanfab\[netcdf\]"')


NUMBERS = {name: str(place) for place, name in enumerate(NAMES.split(), start=1)}


def written(tmp_path, data):
    path = tmp_path / "dump.bin"
    path.write_bytes(data)
    return path


LAYOUTS = [
    ({"names": NAMES, "time": 0.25}, "lammps", [{}]),
    ({}, "liggghts", [{"columns": NUMBERS}, {"columns": NUMBERS, "format": "lammps"}]),
]


@pytest.mark.parametrize("blocks", [1, 3, 5])
@pytest.mark.parametrize(("more", "format", "options"), LAYOUTS)
def test_both_layouts_hold_the_grains(tmp_path, blocks, more, format, options):
    path = written(tmp_path, binary_dump(step=7, blocks=blocks, **more))
    for one in options:
        series, rows = scanfab.read_series(path, **one), np.array(ROWS)
        assert series.grains.reader.name == one.get("format", format)
        packing = series[0].read()
        holds(packing, id=rows[:, 0], type=rows[:, 1], position=rows[:, 2:5], radius=rows[:, 5])
        holds(packing, step=7, time=more.get("time"))


def test_the_box_repeats_where_both_faces_do(tmp_path):
    data = binary_dump(names=NAMES, flags=(0, 0, 0, 1, 2, 3), tilt=(0.2, 0.1, -0.05))
    cell = scanfab.read(written(tmp_path, data)).cell
    assert cell.periodic == (True, False, False)
    # the bounds are those of the box around the tilted one: 1 - (0.3 - 0), 1 - 0.05, 1
    np.testing.assert_allclose(cell.vectors, [[0.7, 0, 0], [0.2, 0.95, 0], [0.1, -0.05, 1]])
    np.testing.assert_allclose(cell.origin, [0, 0.05, 0])


def test_snapshots_are_frames_and_an_incomplete_last_one_is_left_out(tmp_path):
    empty = np.zeros((0, 6))
    data = binary_dump(empty, names=NAMES, step=20) + binary_dump(names=NAMES, step=10)
    frames = scanfab.read_series(written(tmp_path, data))
    assert [(frame.step, len(frame.read())) for frame in frames] == [(10, 3), (20, 0)]
    for cut in (1, 100, 250):
        path = written(tmp_path, data[:-cut])
        with pytest.warns(ScanfabWarning, match=r"number 2, is incomplete.*left out"):
            assert [frame.step for frame in scanfab.read_series(path)] == [20]


ONE, BLOCK = binary_dump(names=NAMES), struct.pack("<i", 18)


WRONG = [
    (binary_dump(), r'the 6 columns have no names.*`columns="id=1,x=3'),
    (ONE[:-1], "incomplete"),
    (ONE[:200], "incomplete"),
    (ONE.replace(struct.pack("<q", 3), struct.pack("<q", 4), 1), "4 rows are not 18 numbers"),
    *(
        (ONE.replace(BLOCK, struct.pack("<i", size), 1), "incomplete")
        for size in (17, -18, 2**31 - 1)
    ),
]


@pytest.mark.parametrize(("data", "told"), WRONG)
def test_what_cannot_be_read_is_told(tmp_path, data, told):
    refuses(written(tmp_path, data), rf"dump.bin.*{told}")


LAMMPS = "LAMMPS data file via write_data, version 2 Aug 2023, timestep = 12"


ORDERS = [
    ("plain", "", "", TITLE, "liggghts"),
    ("plain", " 0 -1 2", "", "LAMMPS data file", "lammps"),
    ("plain", "", " # granular", "mine", "lammps"),
    ("hybrid", " 7", "", TITLE, "liggghts"),
    ("hybrid", "", " # hybrid", LAMMPS, "lammps"),
    ("hybrid", " 7 0 0 1", "", TITLE, "liggghts"),
]


@pytest.mark.parametrize(("order", "behind", "style", "title", "name"), ORDERS)
def test_every_order_gives_the_same_grains(tmp_path, order, behind, style, title, name):
    text = data_file(order, behind=behind, style=style, title=title)
    path = write(tmp_path / "grains.spl", text)
    assert scanfab.read_series(path).grains.reader.name == name
    packing = scanfab.read(path)
    holds(packing, id=[1, 2, 3], position=CENTRES, radius=[0.5, 0.5, 0.25], density=[2500] * 3)
    holds(packing, step=12 if title == LAMMPS else None)
    holds(packing.cell, origin=[-1, 0, 0], periodic=(False, False, False))
    assert ("mol" in packing.columns) == ("7" in behind)
    assert ("iz" in packing.columns) == (len(behind) > 4)


BOX = "-1 3 xlo xhi\n0 2 ylo yhi\n0 2 zlo zhi"
VECTORS = "4 0.5 0 avec\n0 2 0 bvec\n0 0 2 cvec\n-1 0 0 abc origin"


BOXES = [
    (f"{BOX}\n0.5 0 0.25 xy xz yz", [[4, 0, 0], [0.5, 2, 0], [0, 0.25, 2]]),
    (VECTORS, [[4, 0.5, 0], [0, 2, 0], [0, 0, 2]]),
]


@pytest.mark.parametrize(("box", "vectors"), BOXES)
def test_boxes_of_lammps(tmp_path, box, vectors):
    text = data_file(title=LAMMPS, style=" # sphere", behind=" 0 0 0").replace(BOX, box)
    cell = scanfab.read(write(tmp_path / "a.data", text)).cell
    holds(cell, vectors=vectors, origin=[-1, 0, 0])


def test_columns_can_be_named_by_their_numbers(tmp_path):
    columns = {"id": 1, "diameter": 6, "x": 3, "y": 4, "z": 5}
    packing = scanfab.read(write(tmp_path / "a.data", data_file("hybrid")), columns=columns)
    holds(packing, position=CENTRES, radius=[0.5, 0.5, 0.25])
    path = write(tmp_path / "a.data", data_file(title="LIGGGHTS Description"))
    columns = {"id": 1, "radius": 3, "x": 5, "y": 6, "z": 7}
    np.testing.assert_array_equal(scanfab.read(path, columns=columns).radius, DIAMETERS)


def test_a_binary_restart_is_named_with_what_to_write(tmp_path):
    data = struct.pack("<ii", 0, 42) + b"Version LIGGGHTS-PUBLIC 3.8.0, compiled ...\0" + bytes(99)
    refuses(written(tmp_path, data), r"a binary restart.*dump custom")


def test_the_same_lattice_by_another_vector_has_the_same_contacts():
    last = scanfab.find_contacts(scanfab.read(LAST))
    flipped = scanfab.find_contacts(scanfab.read(FORMS / "flipped.lammpstrj.gz"))
    assert flipped.cell.vectors[1, 0] < 0.1 * flipped.cell.vectors[0, 0]
    assert id_pairs(flipped) == id_pairs(last)
    np.testing.assert_allclose(lammps_fabric(flipped), lammps_fabric(last), atol=1e-10)
