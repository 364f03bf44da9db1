"""Indexes of large files that a later run finds."""

from __future__ import annotations

import gzip
import os

import pytest

import scanfab
from scanfab import ScanfabWarning
from scanfab.io import kept_index
from scanfab.io.kept_index import snapshots_of
from scanfab.io.registry import reader_named
from tests.conftest import ROOT

FOLDER = ROOT / "sample_data" / "liggghts_periodic"
TEXTS = [gzip.decompress((FOLDER / f"dump_{k}0000.txt.gz").read_bytes()) for k in (3, 6, 9)]


class Counting:
    """How often a reader looks through a file."""

    def __init__(self, monkeypatch) -> None:
        self.times = 0
        reader = reader_named("liggghts")
        look = type(reader).snapshots

        def counted(own, path):
            self.times += 1
            return look(own, path)

        monkeypatch.setattr(type(reader), "snapshots", counted)
        self.reader = reader


@pytest.fixture
def counting(monkeypatch, tmp_path):
    monkeypatch.setattr(kept_index, "LARGE", 0)
    monkeypatch.setattr(kept_index, "user_folder", lambda: tmp_path / "cache")
    return Counting(monkeypatch)


@pytest.fixture
def dump(tmp_path):
    path = tmp_path / "dump.txt"
    path.write_bytes(b"".join(TEXTS))
    return path


def test_a_later_run_finds_it(counting, dump):
    first = snapshots_of(counting.reader, dump)
    assert len(first) == 3
    assert snapshots_of(counting.reader, dump) == first
    assert counting.times == 1
    frames = [scanfab.read_series(dump)[k].read() for k in range(3)]
    assert counting.times == 1
    apart = [scanfab.read(FOLDER / f"dump_{k}0000.txt.gz") for k in (3, 6, 9)]
    assert [one.position.tolist() for one in frames] == [one.position.tolist() for one in apart]


def test_a_file_that_has_changed_is_looked_through_again(counting, dump):
    assert len(snapshots_of(counting.reader, dump)) == 3
    with open(dump, "ab") as file:
        file.write(gzip.decompress((FOLDER / "dump_120000.txt.gz").read_bytes()))
    assert len(snapshots_of(counting.reader, dump)) == 4
    # of the same size and time, with another end
    status = dump.stat()
    content = dump.read_bytes()
    dump.write_bytes(content[:-3] + b"7" + content[-2:])
    os.utime(dump, ns=(status.st_atime_ns, status.st_mtime_ns))
    snapshots_of(counting.reader, dump)
    assert counting.times == 3


def test_an_incomplete_end_is_told_in_each_run(counting, dump):
    with open(dump, "r+b") as file:
        file.truncate(dump.stat().st_size - 100)
    for _ in range(2):
        with pytest.warns(ScanfabWarning, match="incomplete"):
            assert len(snapshots_of(counting.reader, dump)) == 2
    assert counting.times == 2


def test_a_damaged_index_is_made_again(counting, dump, tmp_path):
    first = snapshots_of(counting.reader, dump)
    (kept,) = (tmp_path / "cache" / "indexes").iterdir()
    kept.write_bytes(kept.read_bytes()[:-1])
    assert snapshots_of(counting.reader, dump) == first
    assert counting.times == 2


def test_small_files_and_a_home_that_cannot_be_written_to_do_without(counting, dump, monkeypatch):
    monkeypatch.setattr(kept_index, "user_folder", lambda: None)
    snapshots_of(counting.reader, dump)
    # a file stands where the folder would be
    monkeypatch.setattr(kept_index, "user_folder", lambda: dump)
    assert len(snapshots_of(counting.reader, dump)) == 3
    monkeypatch.undo()
    assert dump.stat().st_size < kept_index.LARGE
