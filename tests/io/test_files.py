"""Files that are compressed, are no dumps, or hold far more than files so small can."""

import base64
import bz2
import gzip
import lzma
import os
import struct
import sys
import zlib
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import lz4.frame
import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io import files
from scanfab.io import text as text_table
from scanfab.io.mesh import read_mesh
from tests.helpers.dumps import dump_text, pairs_text, refuses, vtk_array, vtk_xml

zstd = import_module(files.ZSTD)
PROGRAMS = {
    ".gz": gzip.compress,
    ".bz2": bz2.compress,
    ".xz": lzma.compress,
    ".zst": zstd.compress,
    ".lz4": lz4.frame.compress,
}
TEXT = dump_text().encode()


@pytest.mark.parametrize("suffix", PROGRAMS)
def test_a_dump_and_its_contacts_are_read_whatever_they_are_packed_with(tmp_path, suffix):
    (tmp_path / f"dump_5.txt{suffix}").write_bytes(PROGRAMS[suffix](dump_text(step=5).encode()))
    (tmp_path / f"pairs_5.txt{suffix}").write_bytes(PROGRAMS[suffix](pairs_text(step=5).encode()))
    packing = scanfab.read_series(tmp_path)[0].read()
    assert (packing.step, len(packing.contacts)) == (5, 2)
    # several parts one behind the other are one file
    path = tmp_path / f"dump.txt{suffix}"
    path.write_bytes(PROGRAMS[suffix](TEXT[:40]) + PROGRAMS[suffix](TEXT[40:]))
    assert len(scanfab.read(path)) == 3


FRAMES = b"\x50\x2a\x4d\x18\x04\x00\x00\x00pzst" + zstd.compress(TEXT)


@pytest.mark.parametrize(("end", "data"), [("", gzip.compress(TEXT)), (".gz", TEXT), ("", FRAMES)])
def test_packing_is_told_by_the_content(tmp_path, end, data):
    (path := tmp_path / f"dump.txt{end}").write_bytes(data)
    assert len(scanfab.read(path)) == 3
    assert files.first_bytes(path, 9) == b"ITEM: TIM"


@pytest.mark.parametrize("suffix", PROGRAMS)
@pytest.mark.parametrize("cut", [5, 0.5, -3])
def test_a_part_of_a_packed_file_is_an_error(tmp_path, suffix, cut):
    noise = np.random.default_rng(0).uniform(size=(3000, 6)).tolist()
    packed = PROGRAMS[suffix](dump_text(noise).encode())
    path = tmp_path / f"dump.txt{suffix}"
    path.write_bytes(packed[: int(cut * len(packed)) if isinstance(cut, float) else cut])
    refuses(path, r"dump\.txt", format="liggghts")


@pytest.mark.parametrize("suffix", [".bz2", ".xz", ".zst"])
def test_a_bomb_is_refused_unless_more_is_allowed(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(files, "ANYWAY", 1000)
    text = dump_text([(1, 1, 0.2, 0.5, 0.5, 0.1)] * 50_000)
    path = tmp_path / f"dump.txt{suffix}"
    path.write_bytes(PROGRAMS[suffix](text.encode()))
    refuses(path, r"to more than 1000 times their size.*`max_unpacked`")
    refuses(path, "the id 1 ", error=scanfab.PackingError, max_unpacked=1e6)


def test_a_file_is_decompressed_once_until_it_changes(tmp_path):
    path = tmp_path / "dump.txt.gz"
    path.write_bytes(gzip.compress(TEXT))
    copy = files.plain(path)
    assert (copy.name, copy.read_bytes()) == ("dump.txt", TEXT)
    assert files.plain(path) == copy
    path.write_bytes(gzip.compress(b"something else, and longer than it was before"))
    assert files.plain(path).read_bytes().startswith(b"something else")


def test_only_copies_that_somebody_holds_and_the_last_few_are_kept(tmp_path):
    def copied(number):
        path = tmp_path / f"{number}.gz"
        path.write_bytes(gzip.compress(TEXT))
        return files.plain(path)

    held, forgotten = copied(0), str(copied(1))
    with ThreadPoolExecutor(3) as pool:
        kept = list(pool.map(copied, range(2, 2 + files.KEPT)))
    assert held.exists()
    assert all(copy.exists() for copy in kept)
    assert not os.path.exists(forgotten)


def test_what_cannot_be_opened_is_an_error_that_says_why(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "a.gz").write_bytes(b"\x1f\x8b" + b"nonsense" * 10)
    for name, said in (
        ("a.gz", "decompressed: "),
        ("none", "read: No such file or directory"),
        ("folder", "read: Is a directory"),
    ):
        with pytest.raises(ReadError, match=f"{name}: cannot be {said}"):
            files.first_bytes(tmp_path / name)


BLOCK = 1 << 20
ZEROS = zlib.compress(bytes(BLOCK))
HEAD = b'<boost_serialization signature="serialization::archive"><scene><px>'


def packed(data: bytes = b"", zeros: int = 0) -> str:
    """An array in blocks, as VTK packs it: some data, or so many blocks of zeros."""
    blocks = [ZEROS] * zeros or [zlib.compress(data)]
    size = BLOCK if zeros else len(data)
    sizes = struct.pack(f"<{3 + len(blocks)}Q", len(blocks), size, 0, *map(len, blocks))
    return base64.b64encode(sizes).decode() + base64.b64encode(b"".join(blocks)).decode()


def polydata(path: Path, count: int, points: str, *arrays: str) -> Path:
    more = 'header_type="UInt64" compressor="vtkZLibDataCompressor"'
    content = f"<PointData>{''.join(arrays)}</PointData><Points>{vtk_array(points)}</Points>"
    return vtk_xml(path, f'NumberOfPoints="{count}"', content, more=more)


SOME_POINTS = packed(np.random.default_rng(0).uniform(size=300).tobytes())
LONG = packed(zeros=600)


TOO_LONG = [
    (100, SOME_POINTS, {"Name": "radius"}, "radius has 78643200 of 100 values"),
    (100, SOME_POINTS, {"NumberOfComponents": 600 * BLOCK // 800}, "its library crashed"),
    (600 * BLOCK, LONG, {}, "Points has 78643200 of|its library crashed"),
]


@pytest.mark.parametrize(("count", "points", "more", "told"), TOO_LONG)
def test_arrays_that_are_far_too_long_are_refused(tmp_path, count, points, more, told):
    array = vtk_array(LONG, **{"Name": "a", "NumberOfComponents": 1, **more})
    with pytest.raises(ReadError, match=told):
        read_mesh(polydata(tmp_path / "a.vtp", count, points, *[array] * bool(more)))


def test_an_array_of_one_value_is_no_bomb(tmp_path):
    """All grains of one radius: a thousand bytes in one."""
    count, radii = BLOCK // 8, vtk_array(packed(zeros=1), Name="radius", NumberOfComponents=1)
    lattice = np.stack(np.meshgrid(np.arange(64.0), np.arange(64.0), np.arange(32.0)), -1)
    mesh = read_mesh(polydata(tmp_path / "a.vtp", count, packed(lattice.tobytes()), radii))
    np.testing.assert_array_equal(mesh.points, lattice.reshape(-1, 3))
    np.testing.assert_array_equal(mesh.point_arrays["radius"], np.zeros(count))


@pytest.mark.parametrize("unit", [b"<a/>", b"<a>", b"x"])
def test_endless_xml_is_left_early(tmp_path, monkeypatch, unit):
    monkeypatch.setattr(files, "ANYWAY", BLOCK)
    path = tmp_path / "save.xml.bz2"
    # streams one behind the other are one file
    path.write_bytes(bz2.compress(HEAD) + 100 * bz2.compress(unit * (BLOCK // len(unit))))
    refuses(path, r"save\.xml\.bz2: .* decompress to more than 1000 times")


DUMP = dump_text().partition("ITEM: ATOMS")[0].replace("\n3\n", "\n99999999999\n") + "ITEM: {}\n"
ROWS = b"1 0 0 0 1\n" * 300_000
DATA = "LAMMPS data file\n\n{} atoms\n\n0 1 xlo xhi\n0 1 ylo yhi\n0 1 zlo zhi\n\nAtoms # sphere\n\n"


MISCOUNTED = [
    ("dump", DUMP.format("ATOMS id x y z radius"), "counts 99999999999 rows, found 300000"),
    ("dump", DUMP.format("ATOMS"), "counts 99999999999 rows, found 300000"),
    ("a.data", DATA.format(99999999999), "counts 99999999999 atoms, found 30000"),
    ("a.data", DATA.format(3), "counts 3 atoms, found 30000"),
]


@pytest.mark.parametrize(("name", "text", "told"), MISCOUNTED)
def test_rows_that_cannot_be_those_counted_are_not_parsed(tmp_path, monkeypatch, name, text, told):
    def parsed(*_, **__):
        raise AssertionError("rows were parsed")

    monkeypatch.setattr(text_table, "columns_of", parsed)
    path = tmp_path / f"{name}.gz"
    path.write_bytes(gzip.compress(text.encode() + ROWS))
    refuses(path, told)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_a_full_disk_of_temporary_files_is_named(tmp_path):
    """A small copy reaches the disk only when it is flushed."""
    from tests.cli.test_full_disk import files_up_to

    path = tmp_path / "dump.gz"
    path.write_bytes(gzip.compress(b"x" * 4000))
    told = pytest.raises(ReadError, match=r"^dump: cannot be written to .*File too")
    with files_up_to(1000), told:
        files.plain(path)
