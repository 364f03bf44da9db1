"""Files that are compressed, are no dumps, or hold far more than files so small can."""

import bz2
import gzip
import lzma
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module

import lz4.frame
import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io import files
from tests.helpers.dumps import dump_text, pairs_text, refuses

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
    text = dump_text([(1, 1, 0.2, 0.5, 0.5, 0.1)] * 20_000)
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


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_a_full_disk_of_temporary_files_is_named(tmp_path):
    """A small copy reaches the disk only when it is flushed."""
    from tests.cli.test_full_disk import files_up_to

    path = tmp_path / "dump.gz"
    path.write_bytes(gzip.compress(b"x" * 4000))
    told = pytest.raises(ReadError, match=r"^dump: cannot be written to .*File too")
    with files_up_to(1000), told:
        files.plain(path)
