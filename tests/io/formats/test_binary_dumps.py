"""Binary dumps of LAMMPS and LIGGGHTS say what their text does, or what is wrong with them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabWarning
from tests.helpers.dumps import NAMES, ROWS, binary_dump

COLUMNS = {name: str(place) for place, name in enumerate(NAMES.split(), start=1)}


def written(tmp_path, data):
    path = tmp_path / "dump.bin"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("blocks", [1, 3, 5])
@pytest.mark.parametrize(
    ("more", "format", "options"),
    [
        ({"names": NAMES, "time": 0.25}, "lammps", [{}]),
        ({}, "liggghts", [{"columns": COLUMNS}, {"columns": COLUMNS, "format": "lammps"}]),
    ],
)
def test_both_layouts_hold_the_grains(tmp_path, blocks, more, format, options):
    path = written(tmp_path, binary_dump(step=7, blocks=blocks, **more))
    for one in options:
        series, rows = scanfab.read_series(path, **one), np.array(ROWS)
        assert series.grains.reader.name == one.get("format", format)
        packing = series[0].read()
        np.testing.assert_array_equal(packing.id, rows[:, 0])
        np.testing.assert_array_equal(packing.columns["type"], rows[:, 1])
        np.testing.assert_array_equal(packing.position, rows[:, 2:5])
        np.testing.assert_array_equal(packing.radius, rows[:, 5])
        assert (packing.step, packing.time) == (7, more.get("time"))


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


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (binary_dump(), r'the 6 columns have no names.*`columns="id=1,x=3'),
        (ONE[:-1], "incomplete"),
        (ONE[:200], "incomplete"),
        (ONE.replace(struct.pack("<q", 3), struct.pack("<q", 4), 1), "4 rows are not 18 numbers"),
        *(
            (ONE.replace(BLOCK, struct.pack("<i", size), 1), "incomplete")
            for size in (17, -18, 2**31 - 1)
        ),
    ],
)
def test_what_cannot_be_read_is_told(tmp_path, data, told):
    with pytest.raises(ReadError, match=rf"dump.bin.*{told}"):
        scanfab.read(written(tmp_path, data))
