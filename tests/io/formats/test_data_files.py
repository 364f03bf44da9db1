"""Data files of LIGGGHTS and LAMMPS: which column is what, where the file does not say so."""

from __future__ import annotations

import struct

import numpy as np
import pytest

import scanfab
from tests.helpers.dumps import holds, refuses, write
from tests.helpers.made.data_files import CENTRES, DIAMETERS, TITLE, data_file

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


RESTARTS = [
    struct.pack("<ii", 0, 42) + b"Version LIGGGHTS-PUBLIC 3.8.0, compiled ...\0" + bytes(99),
    b"LammpS RestartT\0" + struct.pack("<ii", 1, 2) + bytes(99),
]


@pytest.mark.parametrize("data", RESTARTS)
def test_a_binary_restart_is_named_with_what_to_write(tmp_path, data):
    path = tmp_path / "restart.1000"
    path.write_bytes(data)
    refuses(path, r"a binary restart.*dump custom")
