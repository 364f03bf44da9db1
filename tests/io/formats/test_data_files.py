"""Data files of LIGGGHTS and LAMMPS: which column is what, where the file does not say so."""

from __future__ import annotations

import struct

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabWarning
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.dumps import dump_text, write
from tests.helpers.made.data_files import CENTRES, DIAMETERS, TITLE, data_file


@pytest.mark.parametrize(
    ("order", "behind", "style"),
    [
        ("plain", "", ""),
        ("plain", " 0 -1 2", ""),
        ("plain", "", " # granular"),
        ("hybrid", " 7", ""),
        ("hybrid", "", " # hybrid"),
        ("hybrid", " 7 0 0 1", ""),
    ],
)
def test_every_order_gives_the_same_grains(tmp_path, order, behind, style):
    path = write(tmp_path / "grains.spl", data_file(order, behind=behind, style=style))
    packing = scanfab.read(path)
    assert packing.id.tolist() == [1, 2, 3]
    np.testing.assert_array_equal(packing.position, CENTRES)
    np.testing.assert_array_equal(packing.radius, [0.5, 0.5, 0.25])
    assert packing.columns["density"].tolist() == [2500.0] * 3
    assert packing.cell.origin.tolist() == [-1, 0, 0]
    assert packing.cell.periodic == (False, False, False)
    assert ("mol" in packing.columns) == ("7" in behind)
    assert ("iz" in packing.columns) == (len(behind) > 4)


def test_the_program_is_told_by_the_first_line(tmp_path):
    for title, name in ((TITLE, "liggghts"), ("LAMMPS data file", "lammps"), ("mine", "lammps")):
        series = scanfab.read_series(write(tmp_path / f"{len(title)}.data", data_file(title=title)))
        assert series.grains.reader.name == name


def test_both_orders_may_fit(tmp_path):
    path = write(tmp_path / "a.data", data_file(density=1))
    with pytest.raises(ReadError, match="which may be both: name them by their numbers"):
        scanfab.read(path)
    columns = {"id": 1, "diameter": 3, "x": 5, "y": 6, "z": 7}
    packing = scanfab.read(path, columns={what: str(one) for what, one in columns.items()})
    np.testing.assert_array_equal(packing.position, CENTRES)
    np.testing.assert_array_equal(packing.radius, [0.5, 0.5, 0.25])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (" 1.0 2500", " 0 2500", "which are neither"),
        (" 1.0 2500", " 1.0 -1", "which are neither"),
        ("1 atom types", "1 atom types\n3 ellipsoids", "expected spheres, found '3 ellipsoids'"),
        ("Atoms\n", "Atoms # atomic\n", "found 'Atoms # atomic'"),
        ("3 atoms", "4 atoms", "the header counts 4 atoms, found 3"),
        ("\nVelocities", "4\n\nVelocities", "counts 3 atoms, found 4"),
        (TITLE, "LIGGGHTS Description", "YADE writes radii in the column of diameters"),
    ],
)
def test_what_is_no_such_file(tmp_path, old, new, message):
    text = data_file()
    assert old in text
    with pytest.raises(ReadError, match=message):
        scanfab.read(write(tmp_path / "a.data", text.replace(old, new)))


def test_radii_of_yade_can_be_named(tmp_path):
    path = write(tmp_path / "a.data", data_file(title="LIGGGHTS Description"))
    columns = {"id": "1", "radius": "3", "x": "5", "y": "6", "z": "7"}
    np.testing.assert_array_equal(scanfab.read(path, columns=columns).radius, DIAMETERS)


@pytest.mark.filterwarnings("ignore:.*the last line has no end")
@pytest.mark.parametrize("cut", [4, 10, 30])
def test_a_file_that_was_cut_is_an_error(tmp_path, cut):
    with pytest.raises(ReadError, match=r"a\.data"):
        scanfab.read(write(tmp_path / "a.data", data_file(velocities=False)[:-cut]))


def test_a_last_line_without_its_end_is_read_with_a_warning(tmp_path):
    path = write(tmp_path / "a.data", data_file(velocities=False)[:-1])
    with pytest.warns(ScanfabWarning, match="the last line has no end"):
        assert len(scanfab.read(path)) == 3


def test_the_kit(tmp_path):
    files = [
        write(tmp_path / f"{number}.data", data_file(*one, behind=behind))
        for number, (one, behind) in enumerate(((("plain",), ""), (("hybrid",), " 7")))
    ]
    check_reader(reader_named("liggghts"), files, tmp_path / "damaged", counts=True)


@pytest.mark.parametrize(
    "data",
    [
        struct.pack("<ii", 0, 42) + b"Version LIGGGHTS-PUBLIC 3.8.0, compiled ...\0" + bytes(99),
        b"LammpS RestartT\0" + struct.pack("<ii", 1, 2) + bytes(99),
    ],
)
def test_a_binary_restart_is_named_with_what_to_write(tmp_path, data):
    path = tmp_path / "restart.1000"
    path.write_bytes(data)
    with pytest.raises(ReadError, match=r"a binary restart.*dump custom"):
        scanfab.read(path)
    write(tmp_path / "dump.1000", dump_text())
    with pytest.warns(ScanfabWarning, match="binary restart"):
        assert len(scanfab.read_series(tmp_path)) == 1
