"""Packed files: the same frame whatever the program, and not more than a file so small can hold."""

from __future__ import annotations

import bz2
import gzip
import lzma

import lz4.frame
import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io import files
from scanfab.io.files import ZSTD, check_lines, import_module
from tests.helpers.dumps import dump_text, pairs_text

zstd = import_module(ZSTD)
SKIPPED = b"\x50\x2a\x4d\x18\x04\x00\x00\x00pzst"
PROGRAMS = {
    ".gz": gzip.compress,
    ".bz2": bz2.compress,
    ".xz": lzma.compress,
    ".zst": zstd.compress,
    ".lz4": lz4.frame.compress,
}


@pytest.mark.parametrize("suffix", PROGRAMS)
def test_a_dump_and_its_contacts_are_read_whatever_they_are_packed_with(tmp_path, suffix):
    (tmp_path / f"dump_5.txt{suffix}").write_bytes(PROGRAMS[suffix](dump_text(step=5).encode()))
    (tmp_path / f"pairs_5.txt{suffix}").write_bytes(PROGRAMS[suffix](pairs_text(step=5).encode()))
    packing = scanfab.read_series(tmp_path)[0].read()
    assert packing.step == 5
    assert len(packing.contacts) == 2


@pytest.mark.parametrize("suffix", PROGRAMS)
def test_several_parts_one_behind_the_other_are_one_file(tmp_path, suffix):
    text, half = dump_text().encode(), 40
    path = tmp_path / f"dump.txt{suffix}"
    path.write_bytes(PROGRAMS[suffix](text[:half]) + PROGRAMS[suffix](text[half:]))
    assert len(scanfab.read(path)) == 3


def test_what_pzstd_writes_is_known(tmp_path):
    path = tmp_path / "dump.txt.zst"
    path.write_bytes(SKIPPED + zstd.compress(dump_text().encode()))
    assert len(scanfab.read(path)) == 3


@pytest.mark.parametrize("suffix", PROGRAMS)
@pytest.mark.parametrize("cut", [5, 0.5, -3])
def test_a_part_of_a_packed_file_is_an_error(tmp_path, suffix, cut):
    noise = np.random.default_rng(0).uniform(size=(3000, 6)).tolist()
    packed = PROGRAMS[suffix](dump_text(noise).encode())
    path = tmp_path / f"dump.txt{suffix}"
    path.write_bytes(packed[: int(cut * len(packed)) if isinstance(cut, float) else cut])
    with pytest.raises(ReadError, match=r"dump\.txt"):
        scanfab.read(path, format="liggghts")


@pytest.mark.parametrize("suffix", [".bz2", ".xz", ".zst"])
def test_a_bomb_is_refused_unless_more_is_allowed(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(files, "ANYWAY", 1000)
    rows = "1 1 0.2 0.5 0.5 0.1\n" * 300_000
    text = dump_text(()).replace("ATOMS\n0", "ATOMS\n300000") + rows
    path = tmp_path / f"dump.txt{suffix}"
    path.write_bytes(PROGRAMS[suffix](text.encode()))
    with pytest.raises(ReadError, match=r"unpack to more than 1000 times as many.*`max_unpacked`"):
        scanfab.read(path)
    with pytest.raises(scanfab.PackingError, match="the id 1 "):
        scanfab.read(path, max_unpacked=1e6)
    monkeypatch.setattr(files, "MOST_TIMES", 1e6)
    assert len(scanfab.read_series(path)) == 1


def test_a_line_of_many_megabytes_is_refused_unless_it_is_allowed(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "LONGEST_LINE", 1 << 17)
    path = tmp_path / "dump.txt"
    path.write_text(dump_text() + "9" * (1 << 18) + "\n" + dump_text(step=1))
    with pytest.raises(ReadError, match=r"a line is longer than .*`max_unpacked`"):
        scanfab.read(path)
    with pytest.raises(ReadError, match="the header counts 3 rows, found 4"):
        scanfab.read(path, max_unpacked=1000)
    # lines of just the length are none too long, wherever they begin
    for length in (1 << 16, (1 << 17) - 2):
        path.write_text(("x" * length + "\n") * 9)
        check_lines(path, path)


@pytest.mark.parametrize("wrong", [0, -1, "many"])
def test_a_bound_that_is_none(wrong):
    with pytest.raises(scanfab.SettingsError, match="max_unpacked: expected a number above 0"):
        scanfab.read_series("nowhere", max_unpacked=wrong)
