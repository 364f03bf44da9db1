"""Files that are packed with gzip, bzip2 or xz, and files that cannot be opened."""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest

from scanfab.base.errors import ReadError
from scanfab.io import files

TEXT = b"ITEM: TIMESTEP\n" * 1000
PACK = {".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress}


@pytest.fixture(params=PACK)
def packed(request, tmp_path):
    path = tmp_path / f"dump.txt{request.param}"
    path.write_bytes(PACK[request.param](TEXT))
    return path


def test_the_first_bytes_are_the_unpacked_ones(packed):
    assert files.first_bytes(packed, 10) == TEXT[:10]


def test_a_packed_file_becomes_plain_under_its_bare_name(packed):
    copy = files.plain(packed)
    assert copy.read_bytes() == TEXT
    assert copy.name == "dump.txt"


def test_a_plain_file_is_itself(tmp_path):
    path = tmp_path / "dump.txt"
    path.write_bytes(TEXT)
    assert files.plain(path) == path


def test_packing_is_told_by_the_content_not_the_name(tmp_path):
    path = tmp_path / "dump.txt"
    path.write_bytes(gzip.compress(TEXT))
    assert files.plain(path).read_bytes() == TEXT


def test_a_name_that_promises_packing_need_not_keep_it(tmp_path):
    path = tmp_path / "dump.txt.gz"
    path.write_bytes(TEXT)
    assert files.plain(path) == path


def test_a_file_is_unpacked_once(packed):
    assert files.plain(packed) == files.plain(packed)


def test_a_file_that_changes_is_unpacked_again(tmp_path):
    path = tmp_path / "dump.gz"
    path.write_bytes(gzip.compress(TEXT))
    files.plain(path)
    path.write_bytes(gzip.compress(b"something else, and longer than it was before"))
    assert files.plain(path).read_bytes().startswith(b"something else")


@pytest.mark.parametrize("threads", [1, 3])
def test_of_each_thread_only_the_copies_used_last_are_kept(tmp_path, monkeypatch, threads):
    monkeypatch.setattr(files, "_copies", OrderedDict())
    monkeypatch.setattr(files, "_threads", set())

    def copied(number):
        path = tmp_path / f"{number}.gz"
        path.write_bytes(gzip.compress(TEXT))
        return files.plain(path)

    with ExitStack() as stack:
        pools = [stack.enter_context(ThreadPoolExecutor(1)) for _ in range(threads)]
        kept = files.KEPT * threads
        copies = [
            pools[number % threads].submit(copied, number).result() for number in range(kept + 2)
        ]
    assert [copy.exists() for copy in copies] == [False] * 2 + [True] * kept


def test_a_packed_file_cut_off_is_an_error(packed):
    packed.write_bytes(packed.read_bytes()[:-12])
    with pytest.raises(ReadError, match=f"{packed.name}: cannot be decompressed: "):
        files.plain(packed)


def test_a_packed_file_of_nonsense_is_an_error(tmp_path):
    path = tmp_path / "dump.gz"
    path.write_bytes(b"\x1f\x8b" + b"nonsense" * 10)
    with pytest.raises(ReadError, match="cannot be decompressed: "):
        files.first_bytes(path)


def test_a_missing_file_is_an_error_that_says_so(tmp_path):
    with pytest.raises(ReadError, match="none: cannot be read: No such file or directory"):
        files.first_bytes(tmp_path / "none")


def test_a_folder_is_an_error_that_says_so(tmp_path):
    with pytest.raises(ReadError, match="cannot be read: Is a directory"):
        files.plain(tmp_path)


@pytest.mark.parametrize(
    ("name", "bare"),
    [
        ("dump_10.txt.gz", "dump_10.txt"),
        ("dump_10.txt", "dump_10.txt"),
        ("a.xml.bz2", "a.xml"),
        ("b.xz", "b"),
    ],
)
def test_the_bare_name_has_no_ending_of_packing(name, bare):
    assert files.bare_name(Path(name)) == bare
