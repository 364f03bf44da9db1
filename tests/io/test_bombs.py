"""Files of kilobytes that unpack to gigabytes: refused by what they hold, long before the end."""

from __future__ import annotations

import base64
import bz2
import gzip
import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io import files
from scanfab.io import text as text_table
from scanfab.io.mesh import read_mesh
from tests.helpers.dumps import dump_text, write

BLOCK = 1 << 20
ZEROS = zlib.compress(bytes(BLOCK))
HEAD = b'<boost_serialization signature="serialization::archive"><scene><px>'


def packed(data: bytes = b"", zeros: int = 0) -> str:
    """An array in blocks, as VTK packs it: some data, or so many blocks of zeros."""
    blocks = [ZEROS] * zeros or [zlib.compress(data)]
    size = BLOCK if zeros else len(data)
    sizes = struct.pack(f"<{3 + len(blocks)}Q", len(blocks), size, 0, *map(len, blocks))
    return base64.b64encode(sizes).decode() + base64.b64encode(b"".join(blocks)).decode()


def array(name: str, content: str, components: int = 1) -> str:
    return (
        f'<DataArray type="Float64" Name="{name}" NumberOfComponents="{components}" '
        f'format="binary">{content}</DataArray>'
    )


def polydata(path: Path, count: int, points: str, *arrays: str) -> Path:
    return write(
        path,
        '<VTKFile type="PolyData" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor"><PolyData>'
        f'<Piece NumberOfPoints="{count}"><PointData>{"".join(arrays)}</PointData>'
        f"<Points>{array('Points', points, 3)}</Points></Piece></PolyData></VTKFile>",
    )


SOME_POINTS = packed(np.random.default_rng(0).uniform(size=300).tobytes())
LONG = packed(zeros=600)


@pytest.mark.parametrize(
    ("count", "points", "more", "told"),
    [
        (100, SOME_POINTS, [array("radius", LONG)], "radius has 78643200 of 100 values"),
        (
            100,
            SOME_POINTS,
            [array("a", LONG, 600 * BLOCK // 800)],
            "its library crashed",
        ),
        (600 * BLOCK, LONG, [], "Points has 78643200 of|its library crashed"),
    ],
)
def test_arrays_that_are_far_too_long_are_refused(tmp_path, count, points, more, told):
    with pytest.raises(ReadError, match=told):
        read_mesh(polydata(tmp_path / "a.vtp", count, points, *more))


def test_an_array_of_one_value_is_no_bomb(tmp_path):
    """All grains of one radius: a thousand bytes in one."""
    count, radii = 3 * BLOCK, array("radius", packed(zeros=24))
    lattice = np.stack(np.meshgrid(np.arange(128.0), np.arange(128.0), np.arange(192.0)), -1)
    mesh = read_mesh(polydata(tmp_path / "a.vtp", count, packed(lattice.tobytes()), radii))
    np.testing.assert_array_equal(mesh.points, lattice.reshape(-1, 3))
    np.testing.assert_array_equal(mesh.point_arrays["radius"], np.zeros(count))


def test_what_does_not_fit_into_memory_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "free_memory", lambda: 1_000)
    path = polydata(tmp_path / "a.vtp", 100, SOME_POINTS)
    with pytest.raises(ReadError, match=r"takes about 0.0 GB of memory, but only 0.0 GB are free"):
        scanfab.read(path)


@pytest.mark.parametrize("unit", [b"<a/>", b"<a>", b"x"])
def test_endless_xml_is_left_early(tmp_path, unit):
    path = tmp_path / "save.xml.bz2"
    # streams one behind the other are one file
    path.write_bytes(bz2.compress(HEAD) + 1000 * bz2.compress(unit * (BLOCK // len(unit))))
    with pytest.raises(ReadError, match=r"save\.xml\.bz2: .* decompress to more than 1000 times"):
        scanfab.read(path)


DUMP = dump_text().partition("ITEM: ATOMS")[0].replace("\n3\n", "\n99999999999\n") + "ITEM: {}\n"
ROWS = b"1 0 0 0 1\n" * 300_000
DATA = "LAMMPS data file\n\n{} atoms\n\n0 1 xlo xhi\n0 1 ylo yhi\n0 1 zlo zhi\n\nAtoms # sphere\n\n"


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("dump", DUMP.format("ATOMS id x y z radius"), "counts 99999999999 rows, found 300000"),
        ("dump", DUMP.format("ATOMS"), "counts 99999999999 rows, found 300000"),
        ("a.data", DATA.format(99999999999), "counts 99999999999 atoms, found 30000"),
        ("a.data", DATA.format(3), "counts 3 atoms, found 30000"),
    ],
)
def test_rows_that_cannot_be_those_counted_are_not_parsed(tmp_path, monkeypatch, name, text, told):
    def parsed(*_, **__):
        raise AssertionError("rows were parsed")

    monkeypatch.setattr(text_table, "columns_of", parsed)
    path = tmp_path / f"{name}.gz"
    path.write_bytes(gzip.compress(text.encode() + ROWS))
    with pytest.raises(ReadError, match=told):
        scanfab.read(path)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_a_full_disk_of_temporary_files_is_named(tmp_path):
    """A small copy reaches the disk only when it is flushed."""
    from tests.cli.test_full_disk import files_up_to

    path = tmp_path / "dump.gz"
    path.write_bytes(gzip.compress(b"x" * 4000))
    told = pytest.raises(ReadError, match=r"^dump: cannot be written to .*File too")
    with files_up_to(1000), told:
        files.plain(path)
