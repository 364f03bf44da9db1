"""Series of very many frames: a frame is read when its turn comes, and none is kept."""

from __future__ import annotations

import os
import time
import weakref

import pytest

import scanfab
from scanfab.io import frame as frame_module
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.settings import Settings
from tests.helpers.dumps import cubic_rows, dump_text, write

SCAN = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "variants": "a"}
FRAMES = 8


@pytest.fixture
def series(tmp_path):
    for frame in range(FRAMES):
        text = dump_text(cubic_rows(squeeze=1 - 0.01 * frame), step=frame)
        write(tmp_path / f"dump_{frame}.txt", text)
    return scanfab.read_series(tmp_path)


def test_ten_thousand_files_open_within_seconds(tmp_path):
    first = write(tmp_path / "dump_0.txt", dump_text())
    for step in range(1, 10_000):
        os.link(first, tmp_path / f"dump_{step}.txt")
    start = time.perf_counter()
    assert len(next(iter(scanfab.read_series(tmp_path))).read()) == 3
    assert time.perf_counter() - start < 4


def test_memory_holds_one_frame_a_worker_and_all_give_the_same_rows(series, monkeypatch):
    found = []

    class Watched(scanfab.Packing):
        def __init__(self, *words, **named):
            super().__init__(*words, **named)
            found.append(weakref.ref(self))

    monkeypatch.setattr(frame_module, "Packing", Watched)
    tables = []
    for workers in (1, 2, 3):
        found.clear()
        rows, most = [], 0
        for row in compute_rows(series, Settings(workers=workers, **SCAN)):
            rows.append(row)
            most = max(most, sum(reference() is not None for reference in found))
        # one more for each row that is taken while the next frame is read
        assert (len(found), most <= workers + 2) == (FRAMES, True)
        tables.append(rows)
    tables.append(list(compute_rows(series, Settings(workers=16, **SCAN))))
    assert all(table == tables[0] for table in tables)
