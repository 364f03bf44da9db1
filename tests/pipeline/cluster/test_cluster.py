"""Frames on a real Dask cluster of separate processes: the same rows, whatever dies."""

import json
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("distributed")

import scanfab
from scanfab.cli.main import run
from scanfab.pipeline import cluster as module
from tests.helpers.dask_cluster import DaskCluster
from tests.helpers.growing import SAMPLE, meanwhile, until
from tests.helpers.interruptions import write_series

FAST = ("--directions", "9", "--variants", "ac", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")
QUICK = {"directions": 9, "variants": "ac", "spacing": "0.5rmin", "contact_tolerance": 0.01}
pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX"),
    # those of a cluster that has just been started may come in a moment
    pytest.mark.filterwarnings("ignore:.*the scheduler has no workers yet"),
]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Two workers; a frame that two workers die of is given up."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "1")
        with DaskCluster(tmp_path_factory.mktemp("cluster")) as found:
            yield found


@pytest.fixture
def executor(cluster):
    with scanfab.dask_executor(cluster.address) as found:
        until(lambda: len(found.client.nthreads()) == 2)
        yield found


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_series(tmp_path / "dumps", 5)
    return tmp_path


@pytest.fixture
def is_same(folder):
    """Whether a table has the bytes of a run on one core."""

    def is_same(*words: str) -> bool:
        assert compute(*(words or ("dumps", *FAST)), output="one.csv") == 0
        return Path("t.csv").read_bytes() == Path("one.csv").read_bytes()

    return is_same


def compute(*words: str, output: str = "t.csv") -> int:
    return run(["compute", *words, "-o", output])


@pytest.fixture
def after_a_row():
    """Does something in another thread once the first row is there."""
    threads = []

    def after_a_row(act: Callable[[], object]) -> None:
        part = Path("t.csv.part")
        there = partial(until, lambda: part.exists() and part.stat().st_size > 0)
        threads.append(meanwhile([there, act]))

    yield after_a_row
    for one in threads:
        one.join()


def test_the_bytes_are_those_of_one_core(cluster, folder, is_same):
    """Sources are relative, and the workers stand elsewhere."""
    (folder / "yade").symlink_to(SAMPLE / "yade_triaxial")
    words = ("yade", *FAST[:4], "--tolerance", "1e-2", "--boundary", "mask=3", "--frames", "::2")
    assert compute(*words, "--scheduler-file", str(cluster.file)) == 0
    assert is_same(*words)
    one, other = (json.loads(Path(f"{n}.csv.manifest.json").read_text()) for n in ("one", "t"))
    # workers that are late to come are a warning of the cluster alone
    late = [text for text in other["warnings"] if "has no workers yet" in text]
    assert {**one, "warnings": [*one["warnings"], *late]} == other


def test_every_executor_serves(executor, folder):
    """Packings from anywhere, also periodic ones; that of Dask itself too."""
    packings = [frame.read() for frame in scanfab.read_series("dumps", periodic="xyz")[:2]]
    expected = scanfab.compute(packings, **QUICK)
    for one in (executor, executor.client.get_executor()):
        assert scanfab.compute(iter(packings), executor=one, **QUICK) == expected


def test_a_running_simulation(cluster, is_same):
    words = ("dumps", *FAST, "--frames", ":4")
    assert compute(*words, "--follow-for", "30", "--scheduler", cluster.address) == 0
    assert is_same(*words)


def test_a_frame_that_cannot_be_read_goes_by_on_error(cluster, folder, capsys):
    broken = Path("dumps/dump_300.txt")
    broken.write_text(broken.read_text()[:-40])
    words, skip = ("dumps", *FAST), ("--on-error", "skip")
    address = ("--scheduler", cluster.address)
    assert compute(*words, *address, *skip) == compute(*words, *skip, output="one.csv") == 1
    said = capsys.readouterr().err
    assert said.count("frame 3 skipped: ") == 2
    assert Path("t.csv").read_bytes() == Path("one.csv").read_bytes()
    assert compute(*words, *address, output="stopped.csv") == 1
    assert "dump_300.txt" in capsys.readouterr().err


def test_a_worker_that_dies_costs_its_frames_again(cluster, is_same, after_a_row):
    after_a_row(lambda: (cluster.add(), cluster.kill()))
    assert compute("dumps", *FAST, "--scheduler-file", str(cluster.file)) == 0
    assert is_same()


class Deadly(scanfab.Packing):
    """A packing that takes down whoever looks at it."""

    def __len__(self) -> int:
        os._exit(9)


def test_a_frame_that_kills_its_workers_is_named(cluster, folder):
    packings = [frame.read() for frame in scanfab.read_series("dumps")[:3]]
    packings[1] = Deadly(packings[1].position, packings[1].radius)
    for _ in range(2):
        cluster.add()
    died = "frame 1 skipped: the workers that computed it died, 2 one after the other"
    with scanfab.dask_executor(scheduler_file=cluster.file) as executor, pytest.warns(match=died):
        far = scanfab.compute(packings, executor=executor, on_error="skip", **QUICK)
    assert {row.frame for row in far} == {0, 2}
    cluster.forget_the_dead()


def test_a_scheduler_that_hangs(cluster, executor, is_same, after_a_row, capsys, monkeypatch):
    """It is stopped, and closes no connection; the run goes on when it is there again."""
    monkeypatch.setattr("scanfab.pipeline.compute.PAUSE", 0.2)
    monkeypatch.setattr(module, "SILENCE", 1.0)
    words = ("dumps", *FAST, "--scheduler-file", str(cluster.file))
    after_a_row(lambda: cluster.scheduler.send_signal(signal.SIGSTOP))
    assert compute(*words) == 1
    said = capsys.readouterr().err
    assert "the scheduler has not answered for 1 s while frames were computed: start it" in said
    assert said.count("error") == 1
    cluster.scheduler.send_signal(signal.SIGCONT)
    assert compute(*words, "--resume") == 0
    assert is_same()


def test_late_workers_and_a_dead_scheduler(cluster, folder, is_same, after_a_row, capsys):
    """And another cluster goes on."""
    with DaskCluster(folder / "first", workers=0) as first:
        timer = threading.Timer(0.1, first.add)
        timer.start()
        after_a_row(first.kill_scheduler)
        assert compute("dumps", *FAST, "--quiet", "--scheduler", first.address) == 1
        timer.join()
    said = capsys.readouterr().err
    assert "has no workers yet: frames wait for them, without a limit" in said
    assert "the scheduler has gone while frames were computed" in said
    assert said.count("error") == 1
    assert compute("dumps", *FAST, "--scheduler-file", str(cluster.file), "--resume") == 0
    assert is_same()


@dataclass
class Job:
    """A job that reads a file."""

    path: Path

    def __call__(self) -> str:
        return "done"


def test_a_worker_that_does_not_see_the_files_is_named(executor, folder):
    assert executor.submit(Job(folder / "dumps")).result(60) == "done"
    with pytest.raises(scanfab.ReadError, match=r"such.txt: the worker on .* cannot read it"):
        executor.submit(Job(folder / "no/such.txt")).result(60)


def test_other_versions_are_an_error_that_names_both(executor, folder, monkeypatch):
    mine = module.versions_here()
    monkeypatch.setattr(module, "versions_here", lambda: {**mine, "numpy": "1.0.0"})
    with pytest.raises(
        module.ClusterError, match=f"{mine['numpy']}'}}, but this process .* '1.0.0'"
    ):
        scanfab.compute(scanfab.read_series("dumps"), executor=executor, on_error="skip", **QUICK)


def test_who_does_not_answer_is_named(folder, capsys, monkeypatch):
    monkeypatch.setattr(module, "TIMEOUT", 0.3)
    Path("file.json").write_text("{}")
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        for option, given, told in (
            ("--scheduler", address, "no Dask scheduler answers there within 0.3 s"),
            ("--scheduler", "nonsense", "no Dask scheduler answers there within 0.3 s"),
            ("--scheduler-file", "none.json", "expected the file that a Dask"),
            ("--scheduler-file", "file.json", "found something else: is it started"),
        ):
            assert compute("dumps", *FAST, option, given) == 1
            said = capsys.readouterr().err
            assert given in said
            assert told in said
