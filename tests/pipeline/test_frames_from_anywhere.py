"""Packings from lists and generators, frames in other processes, and frames one by one."""

import gzip
import os
import tempfile
import threading
import weakref
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from itertools import chain, repeat
from multiprocessing import get_context

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabWarning, SettingsError
from scanfab.packing.packing import Packing
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.settings import Settings
from tests.helpers.dumps import NAMES, dump_text, write
from tests.helpers.lattices import shaken_cubic
from tests.helpers.truth import SAMPLE_DATA

SCAN = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "variants": "cd"}


def packings(count=4):
    """The same grains, pressed together a little more from one to the next."""
    first = shaken_cubic(np.random.default_rng(2), 5)
    for k in range(count):
        squeezed = first.position * [1.0, 1.0, 1.0 - 0.01 * k]
        yield Packing(squeezed, first.radius, step=k)


def series_in(folder, count=4):
    """The same as a dump of snapshots."""
    return scanfab.read_series(write(folder / "dump.txt", "".join(map(text_of, packings(count)))))


def text_of(packing):
    """One snapshot of a dump."""
    table = np.column_stack([packing.id + 1, packing.id, packing.position, packing.radius])
    return dump_text(table.tolist(), NAMES, step=packing.step, box=((0, 10),) * 3)


def test_an_iterable_of_packings_is_a_series(tmp_path):
    """Each comes with the plan of the first."""
    table = scanfab.compute(list(packings()), strain="grains", **SCAN)
    assert [(row.frame, row.step, row.source) for row in table[::2]] == [
        (k, k, "") for k in range(4)
    ]
    assert [row.strain for row in table[::2]] == pytest.approx([0.0, 0.01, 0.02, 0.03])
    (first,) = scanfab.inspect(series_in(tmp_path, 1))
    words = {"rv_radius": first.rv_radius, "rv_center": first.rv_center}
    alone = scanfab.compute(list(packings())[-1], **SCAN, **words)
    assert [row.gvs_zz for row in table[-2:]] == [row.gvs_zz for row in alone]


def test_a_generator_gives_what_a_list_gives():
    lists = scanfab.compute(list(packings()), frames="-3:-1", **SCAN)
    assert scanfab.compute(packings(), frames="-3:-1", **SCAN) == lists


def test_rows_of_a_stream_come_before_its_end():
    """Those of a running simulation, of which nobody knows how long it goes on."""
    endless = chain.from_iterable(map(packings, repeat(4)))
    rows = compute_rows(endless, Settings(workers=2, **SCAN))
    assert [next(rows).frame for _ in range(12)] == [k // 2 for k in range(12)]
    rows.close()


def test_a_stream_is_not_kept_in_memory():
    alive = weakref.WeakSet()

    def watched():
        for one in packings(12):
            alive.add(one)
            yield one
            assert len(alive) <= 5

    assert len(scanfab.compute(watched(), workers=1, **SCAN)) == 24


def test_what_is_no_packing_or_executor_is_named():
    with pytest.raises(SettingsError, match=r"expected a concurrent.futures.Executor, found 4"):
        scanfab.compute(packings(1), executor=4)
    with pytest.raises(SettingsError, match=r"expected packings, found 3$"):
        scanfab.compute([*packings(1), 3], **SCAN)
    series = scanfab.read_series(SAMPLE_DATA / "liggghts_periodic")
    for source in (series[0], list(series)):
        with pytest.raises(SettingsError, match=r"found Frame 0 .*: `frame.read\(\)` is its pack"):
            scanfab.compute(source, **SCAN)
    for source in ("dumps/", 7):
        with pytest.raises(SettingsError, match=f"or an iterable of packings, found {source!r}"):
            scanfab.compute(source, **SCAN)


class FirstIsSlow(ThreadPoolExecutor):
    """Its first job is begun when a second one is done."""

    def submit(self, job, *args):
        if not hasattr(self, "second"):
            self.second = threading.Event()
            return super().submit(lambda: self.second.wait(10) and job(*args))
        future = super().submit(job, *args)
        future.add_done_callback(lambda _: self.second.set())
        return future


def test_rows_come_in_the_order_of_the_frames_and_before_the_error_of_the_source():
    def broken():
        yield from packings()
        raise ValueError("no more")

    with FirstIsSlow(3) as executor:
        rows = compute_rows(broken(), Settings(workers=3, **SCAN), executor=executor)
        assert [next(rows).frame for _ in range(8)] == [0, 0, 1, 1, 2, 2, 3, 3]
        with pytest.raises(ValueError, match="no more"):
            next(rows)
        # the executor belongs to whoever made it, and goes on
        assert executor.submit(int, "3").result() == 3


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        yield executor


def test_other_processes_give_the_same_rows(tmp_path, processes):
    series = series_in(tmp_path)
    for source in (lambda: series, packings):
        found = scanfab.compute(source(), executor=processes, **SCAN)
        assert found == scanfab.compute(source(), **SCAN)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_forked_processes_leave_the_copies_of_packed_files_alone(tmp_path, monkeypatch):
    """Copies are those of one process; a forked one makes its own, and takes them with it."""
    for number, one in enumerate(packings(12)):
        (tmp_path / f"packed_{number}.txt.gz").write_bytes(gzip.compress(text_of(one).encode()))
    series = scanfab.read_series(tmp_path / "packed_*.txt.gz")
    before = scanfab.compute(series, workers=2, **SCAN)
    copies = tmp_path / "copies"
    copies.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(copies))
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as forked:
        assert scanfab.compute(series, executor=forked, workers=2, **SCAN) == before
    assert scanfab.compute(series, workers=2, **SCAN) == before
    assert list(copies.iterdir()) == []


def test_what_another_process_is_told_is_heard_here(tmp_path, processes):
    """Notes of the scan, and warnings of whoever reads."""
    series = series_in(tmp_path, 2)
    words = {**SCAN, "cutoff": 50.0, "executor": processes}
    with pytest.warns(ScanfabWarning) as told:
        scanfab.compute(series, **words)
    texts = [str(one.message) for one in told if "no void segment reaches" in str(one.message)]
    about = ["frame 0, variants c, d", "frames 0 to 1, variants c, d"]
    assert [text.partition(":")[0] for text in texts] == about
