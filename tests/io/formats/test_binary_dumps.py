"""Binary dumps of LAMMPS and LIGGGHTS say what their text does, or what is wrong with them."""

from __future__ import annotations

import shutil
import struct
import subprocess

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io.registry import reader_for
from tests.helpers.dumps import NAMES, ROWS, binary_dump

COLUMNS = {name: str(place) for place, name in enumerate(NAMES.split(), start=1)}


def write(path, data):
    path.write_bytes(data)
    return path


def assert_right(path, **options):
    packing, rows = scanfab.read(path, **options), np.array(ROWS)
    np.testing.assert_array_equal(packing.id, rows[:, 0])
    np.testing.assert_array_equal(packing.columns["type"], rows[:, 1])
    np.testing.assert_array_equal(packing.position, rows[:, 2:5])
    np.testing.assert_array_equal(packing.radius, rows[:, 5])
    assert packing.step == 7
    return packing


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("blocks", [1, 3, 5])
def test_the_new_layout_names_its_columns_and_the_old_one_asks_for_them(tmp_path, blocks, order):
    data = binary_dump(names=NAMES, step=7, time=0.25, blocks=blocks, order=order)
    path = write(tmp_path / "new.bin", data)
    assert reader_for(path).name == "lammps"
    assert assert_right(path).time == 0.25
    path = write(tmp_path / "old.bin", binary_dump(step=7, blocks=blocks))
    assert reader_for(path).name == "liggghts"
    with pytest.raises(ReadError, match=r'does not name its 6 columns.*`columns="id=1,type=2'):
        scanfab.read(path)
    for format in (None, "lammps", "liggghts"):
        assert_right(path, columns=COLUMNS, format=format)


def test_the_box_repeats_where_both_faces_do(tmp_path):
    data = binary_dump(names=NAMES, flags=(0, 0, 0, 1, 2, 3), tilt=(0.2, 0.1, -0.05))
    cell = scanfab.read(write(tmp_path / "dump.bin", data)).cell
    assert cell.periodic == (True, False, False)
    # the bounds are those of the box around the tilted one: 1 - (0.3 - 0), 1 - 0.05, 1
    np.testing.assert_allclose(cell.vectors, [[0.7, 0, 0], [0.2, 0.95, 0], [0.1, -0.05, 1]])
    np.testing.assert_allclose(cell.origin, [0, 0.05, 0])


def test_snapshots_are_frames_and_an_incomplete_last_one_is_left_out(tmp_path):
    empty = np.zeros((0, 6))
    data = binary_dump(empty, names=NAMES, step=20) + binary_dump(names=NAMES, step=10)
    path = write(tmp_path / "dump.bin", data)
    frames = [(frame.step, len(frame.read())) for frame in scanfab.read_series(path)]
    assert frames == [(10, 3), (20, 0)]
    for cut in (1, 100, 250):
        path = write(tmp_path / f"cut{cut}.bin", data[:-cut])
        with pytest.warns(ScanfabWarning, match=r"number 2, is incomplete.*left out"):
            assert [frame.step for frame in scanfab.read_series(path)] == [20]


ONE, BLOCK = binary_dump(names=NAMES), struct.pack("<i", 18)


@pytest.mark.parametrize(
    "data",
    [
        ONE[:-1],
        ONE[:200],
        ONE.replace(struct.pack("<q", 3), struct.pack("<q", 4), 1),
        *(ONE.replace(BLOCK, struct.pack("<i", size), 1) for size in (17, -18, 2**31 - 1)),
    ],
)
def test_counts_that_lie_are_told(tmp_path, data):
    assert data != ONE
    with pytest.raises(ReadError, match=r"whole binary snapshot: .*incomplete"):
        scanfab.read(write(tmp_path / "dump.bin", data))


DECK = """
units si
atom_style sphere
boundary p p f
newton off
comm_modify vel yes
region box block 0 1 0 1 0 1 units box
create_box 1 box
create_atoms 1 random 40 7 box
set group all diameter 0.05
set group all density 2500
pair_style gran/hooke 200000.0 NULL 50.0 NULL 0.5 0
pair_coeff * *
fix 1 all nve/sphere
dump text all custom 1 t.*.txt id type x y z radius
dump bits all custom 1 b.*.bin id type x y z radius
dump_modify text format float %.17g
run 0
"""


@pytest.mark.skipif(shutil.which("lmp") is None, reason="LAMMPS is not installed")
def test_lammps_own_dumps_are_the_same_packing(tmp_path):
    write(tmp_path / "deck", DECK.encode())
    subprocess.run(["lmp", "-in", "deck"], cwd=tmp_path, check=True, capture_output=True)
    text, bits = (scanfab.read(tmp_path / name) for name in ("t.0.txt", "b.0.bin"))
    np.testing.assert_array_equal(text.position, bits.position)
    np.testing.assert_array_equal(text.id, bits.id)
    assert text.cell.periodic == bits.cell.periodic == (True, True, False)
