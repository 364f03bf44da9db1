"""Frames on a real Dask cluster of separate processes: the same rows, whatever dies."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import tracemalloc
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("distributed")

import scanfab
from scanfab.base.errors import ReadError, ScanfabError
from scanfab.cli.main import run
from scanfab.pipeline.cluster import connection
from scanfab.pipeline.cluster import dask_executor as module
from scanfab.pipeline.cluster.connection import ClusterError
from scanfab.pipeline.compute import shared_in_order
from tests.helpers.dask_cluster import DaskCluster
from tests.helpers.dumps import shaken_cubic
from tests.helpers.growing import SAMPLE
from tests.helpers.interruptions import PROGRAM, write_series

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")
YADE = ("--boundary", "mask=3")
pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX"),
    # those of a cluster that has just been started may come in a moment
    pytest.mark.filterwarnings("ignore:.*the scheduler has no workers yet"),
]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with DaskCluster(tmp_path_factory.mktemp("cluster")) as found:
        yield found


@pytest.fixture(scope="module")
def executor(cluster):
    with scanfab.dask_executor(cluster.address) as found:
        wait_until(lambda: len(found.workers()) == 2)
        yield found


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_series(tmp_path / "dumps", 6)
    return tmp_path


def compute(*words: str, output: str = "t.csv") -> int:
    return run(["compute", *words, "-o", output])


def test_the_bytes_are_those_of_one_core(cluster, executor, folder):
    """Sources are relative, and the workers stand elsewhere."""
    (folder / "yade").symlink_to(SAMPLE / "yade_triaxial")
    for words in (("dumps", *FAST), ("yade", *FAST, *YADE)):
        assert compute(*words, "--workers", "1", output="one.csv") == 0
        assert compute(*words, "--scheduler", cluster.address) == 0
        assert compute(*words, "--scheduler-file", str(cluster.file), output="u.csv") == 0
        expected = Path("one.csv").read_bytes()
        assert Path("t.csv").read_bytes() == expected
        assert Path("u.csv").read_bytes() == expected


def test_manifests_are_the_same_too(cluster, executor, folder):
    assert compute("dumps", *FAST, output="one.csv") == 0
    assert compute("dumps", *FAST, "--scheduler", cluster.address) == 0
    one, other = (json.loads(Path(f"{n}.csv.manifest.json").read_text()) for n in ("one", "t"))
    assert one == other


@pytest.mark.parametrize(
    "options",
    [
        {"tolerance": 3e-3, "with_": "harmonics"},
        {"cutoffs": "0.2rmin,0.5rmin", "tolerance": 5e-3},
        {"edge": "start", "tolerance": 1e-2},
        {"edge": "ends", "tolerance": 1e-2},
    ],
)
@pytest.mark.filterwarnings("ignore:frame 0, variant")
def test_one_frame_is_scanned_by_all(executor, folder, options):
    frame = scanfab.read_series("dumps")[:1]
    far = scanfab.compute(frame, executor=executor, **options)
    assert far == scanfab.compute(frame, workers=1, **options)


def test_a_periodic_frame_too(executor):
    frame = scanfab.read_series(SAMPLE / "liggghts_periodic")[-1:]
    words = {"tolerance": 5e-3, "variants": "ac"}
    assert scanfab.compute(frame, executor=executor, **words) == scanfab.compute(frame, **words)


def test_packings_from_anywhere(executor, folder):
    packings = [frame.read() for frame in scanfab.read_series("dumps")]
    words = {"directions": 9, "spacing": "0.5rmin"}
    far = scanfab.compute(iter(packings), executor=executor, **words)
    assert far == scanfab.compute(packings, **words)


def test_the_plain_executor_of_dask_serves_too(executor, folder):
    words = {"directions": 9, "spacing": "0.5rmin"}
    series = scanfab.read_series("dumps")
    far = scanfab.compute(series, executor=executor.client.get_executor(), **words)
    assert far == scanfab.compute(series, **words)


def test_a_running_simulation(cluster, executor, folder):
    words = ("dumps", *FAST, "--follow-for", "1.5", "--scheduler", cluster.address)
    assert compute(*words) == 0
    assert compute("dumps", *FAST, output="one.csv") == 0
    assert Path("t.csv").read_bytes() == Path("one.csv").read_bytes()


def test_a_frame_that_fails_is_tried_on_other_workers_and_skipped(
    cluster, executor, folder, capsys
):
    text = Path("dumps/dump_300.txt").read_text().splitlines(keepends=True)
    Path("dumps/dump_300.txt").write_text("".join([*text[:20], "1 2 x\n", *text[21:]]))
    words = ("dumps", *FAST, "--scheduler", cluster.address)
    assert compute(*words, "--on-error", "skip") == 1
    said = capsys.readouterr().err
    (skipped,) = [line for line in said.splitlines() if "skipped" in line]
    assert "frame 3 skipped: " in skipped
    assert "dump_300.txt" in skipped
    assert "tried 3 times, on tcp://" in skipped
    assert skipped.count("tcp://") == 2
    assert compute("dumps", *FAST, "--on-error", "skip", output="one.csv") == 1
    assert Path("t.csv").read_bytes() == Path("one.csv").read_bytes()
    assert compute(*words, output="stopped.csv") == 1
    assert "dump_300.txt" in capsys.readouterr().err


@dataclass(frozen=True)
class Slow:
    """A job that leaves a mark where it begins."""

    mark: Path
    file: Any = None

    @property
    def strict(self) -> Slow:
        return self

    def given_up(self, error: Exception) -> Any:
        raise error

    def __call__(self, threads: int) -> int:
        with open(self.mark, "a") as stream:
            stream.write(f"{os.getpid()}\n")
        time.sleep(0.3)
        return threads


@dataclass(frozen=True)
class Deadly(Slow):
    """A job that takes its worker down in its first moment."""

    def __call__(self, threads: int) -> int:
        os._exit(9)


@dataclass(frozen=True)
class Long(Slow):
    """A job that goes on until a file is there."""

    end: Path = Path("end")

    def __call__(self, threads: int) -> int:
        super().__call__(threads)
        while not self.end.exists():
            time.sleep(0.05)
        return threads

    @property
    def starts(self) -> int:
        """How often it was begun."""
        return len(self.mark.read_text().splitlines()) if self.mark.exists() else 0


@dataclass(frozen=True)
class Fickle(Long):
    """A long job that fails on its first try."""

    def __call__(self, threads: int) -> int:
        if not self.mark.exists():
            self.mark.write_text("failed\n")
            raise ReadError("not yet")
        return super().__call__(threads)


@dataclass(frozen=True)
class Heavy(Slow):
    """A job with a result of some megabytes."""

    def __call__(self, threads: int) -> Any:
        return np.ones(HEAVY // 8)


HEAVY = 4_000_000


def peak(work: Callable[[], object]) -> int:
    """The most bytes that Python and numpy hold at a time."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_results_do_not_pile_up(executor):
    """Neither here nor at the workers: those of 60 frames would be 240 MB."""
    held = []

    def work() -> None:
        jobs = iter([Heavy(Path("unused")) for _ in range(60)])
        for result in shared_in_order(executor, jobs, executor.room, executor.share):
            assert len(result) == HEAVY // 8
            held.append(sum(name.startswith(executor.name) for name in executor.client.who_has()))

    assert executor.room() == 4
    assert peak(work) < 12 * HEAVY
    assert max(held) <= 8


def test_packings_do_not_pile_up(executor):
    """Those of a generator are sent away, and forgotten here."""
    alive: weakref.WeakSet[scanfab.Packing] = weakref.WeakSet()
    most = []

    def packings() -> Iterator[scanfab.Packing]:
        for _ in range(40):
            grains = shaken_cubic(np.random.default_rng(0), 4)
            packing = scanfab.Packing(grains.position, grains.radius)
            alive.add(packing)
            most.append(len(alive))
            yield packing

    words = {"variants": "a", "directions": 9, "spacing": "2rmin", "contact_tolerance": 0.01}
    assert len(scanfab.compute(packings(), executor=executor, **words)) == 40
    assert max(most) <= executor.room() + 6


@pytest.fixture
def fragile(tmp_path):
    """A cluster whose workers may die."""
    (tmp_path / "cluster").mkdir()
    with DaskCluster(tmp_path / "cluster") as found:
        yield found


def test_workers_that_die_cost_their_frames_again(fragile, folder):
    """Killed in the middle; the frames that they had but queued are no tries."""
    assert compute("dumps", *FAST, output="one.csv") == 0

    def kill_some() -> None:
        wait_for_a_row()
        for _ in range(2):
            fragile.add()
            fragile.kill()

    killer = threading.Thread(target=kill_some)
    killer.start()
    assert compute("dumps", *FAST, "--scheduler-file", str(fragile.file)) == 0
    killer.join()
    assert Path("t.csv").read_bytes() == Path("one.csv").read_bytes()


def test_a_frame_that_kills_its_workers_is_given_up(fragile, tmp_path):
    for _ in range(3):
        fragile.add()
    with scanfab.dask_executor(scheduler_file=fragile.file) as executor:
        wait_until(lambda: len(executor.workers()) == 5)
        deadly = executor.submit(Deadly(tmp_path / "deadly"), 1)
        with pytest.raises(ClusterError, match=r"the worker died: .*tried"):
            deadly.result(60)
        # the others go on
        assert executor.submit(Slow(tmp_path / "other"), 1).result(60) == 1


def test_frames_that_a_dead_worker_had_but_queued_have_not_been_tried(tmp_path, monkeypatch):
    """Three die in a row, each with one frame begun and the others queued."""
    # of a frame's first death already we are told, and all frames are sent to the one worker
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION", "inf")
    jobs = [Long(tmp_path / str(number), end=tmp_path / "end") for number in range(4)]
    with (
        DaskCluster(tmp_path, workers=1) as cluster,
        scanfab.dask_executor(scheduler_file=cluster.file) as executor,
    ):
        futures = [executor.submit(job, 1) for job in jobs]
        for deaths in (1, 2, 3):
            wait_until(lambda: sum(job.starts for job in jobs) == deaths)  # noqa: B023
            # one that was bound to the worker before comes with the next look for workers
            wait_until(lambda: len(*executor.client.processing().values()) == len(jobs))
            cluster.kill()
            tries = [job.starts for job in jobs]
            cluster.add()
        (tmp_path / "end").touch()
        assert sum(tries) == 3
        for future, number in zip(futures, tries, strict=True):
            if number < 3:
                assert future.result(60) == 1
            else:
                with pytest.raises(ClusterError, match="tried 3 times"):
                    future.result(60)


def test_a_frame_bound_to_workers_that_are_gone_goes_to_later_ones(fragile, tmp_path):
    """After its first try it is for the other worker; both die, and another one comes."""
    job = Fickle(tmp_path / "fickle", end=tmp_path / "end")
    with scanfab.dask_executor(scheduler_file=fragile.file) as executor:
        wait_until(lambda: len(executor.workers()) == 2)
        future = executor.submit(job, 1)
        wait_until(lambda: job.starts == 2)
        fragile.kill()
        fragile.kill()
        fragile.add()
        job.end.touch()
        assert future.result(60) == 1


def test_the_scheduler_dies_and_the_run_is_resumed(fragile, folder):
    assert compute("dumps", *FAST, output="one.csv") == 0
    words = [*PROGRAM, "compute", "dumps", *FAST, "-o", "t.csv", "--scheduler-file"]
    with subprocess.Popen(
        [*words, str(fragile.file)], stderr=subprocess.PIPE, text=True
    ) as process:
        wait_for_a_row()
        fragile.kill_scheduler()
        said = process.stderr.read()
        assert process.wait(60) == 1
    assert "error: tcp://127.0.0.1:" in said
    assert "the scheduler has gone while frames were computed" in said
    assert said.count("error") == 1
    (folder / "next").mkdir()
    with DaskCluster(folder / "next", workers=1) as other:
        assert compute("dumps", *FAST, "--scheduler-file", str(other.file), "--resume") == 0
    assert Path("t.csv").read_bytes() == Path("one.csv").read_bytes()


def wait_until(is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)


def wait_for_a_row() -> None:
    part = Path("t.csv.part")
    wait_until(lambda: part.exists() and part.stat().st_size > 0)


@pytest.mark.parametrize(
    ("frames", "kind", "step", "call"),
    [(":", module._Trial, "send", 5), ("0:1", module._Parts, "map", 1)],
    ids=["frames", "one frame"],
)
def test_a_scheduler_that_hangs_is_left(
    fragile, folder, capsys, monkeypatch, frames, kind, step, call
):
    """It is stopped, and closes no connection; the run goes on when it is there again."""
    words = ("dumps", *FAST, "--frames", frames)
    assert compute(*words, output="one.csv") == 0
    with scanfab.dask_executor(scheduler_file=fragile.file) as executor:
        wait_until(lambda: len(executor.workers()) == 2)
    proceed, calls = getattr(kind, step), []

    def hanging(*arguments: Any) -> Any:
        calls.append(arguments)
        if len(calls) == call:
            fragile.scheduler.send_signal(signal.SIGSTOP)
        return proceed(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(connection, "BEAT", 0.2)
        patch.setattr(connection, "SILENCE", 5.0)
        patch.setattr(kind, step, hanging)
        assert compute(*words, "--scheduler-file", str(fragile.file)) == 1
    said = capsys.readouterr().err
    assert "s while frames were computed: start it again, and go on with --resume" in said
    assert "the scheduler has not answered for" in said
    assert said.count("error") == 1
    fragile.scheduler.send_signal(signal.SIGCONT)
    assert compute(*words, "--resume", "--scheduler-file", str(fragile.file)) == 0
    assert Path("t.csv").read_bytes() == Path("one.csv").read_bytes()


@dataclass(frozen=True)
class Unseen(Slow):
    """A job whose file lies elsewhere for the workers."""

    source: str = "dumps"

    @property
    def strict(self) -> Unseen:
        return replace(self, file=Placed(At(Path("/none/dump_0.txt"))))

    def __call__(self, threads: int) -> int:
        raise ReadError("cannot be read")


@dataclass(frozen=True)
class Placed:
    """What stands for a frame in a file."""

    snapshot: Any


@dataclass(frozen=True)
class At:
    path: Path


def test_files_that_workers_who_come_late_do_not_see(executor, folder, monkeypatch):
    """No try of the frame, which could be passed over: it would be computed elsewhere."""
    monkeypatch.setattr(executor, "_seen", {"dumps"})
    job = Unseen(Path("unused"), file=Placed(At(folder / "dumps" / "dump_0.txt")))
    with pytest.raises(ClusterError, match=r"cannot read .*dump_0.txt: tcp://.* sees / with .* in"):
        executor.submit(job, 1).result(60)


def test_files_that_workers_do_not_see(executor, folder, monkeypatch):
    monkeypatch.setattr(module, "view_there", _blind)
    monkeypatch.setattr(executor, "_seen", set())
    with pytest.raises(ClusterError) as told:
        scanfab.compute(scanfab.read_series("dumps"), executor=executor, directions=9)
    assert f"2 workers of 2 cannot read {folder}/dumps/dump_" in str(told.value)
    assert "sees /home with nothing in it" in str(told.value)


def _blind(path: str) -> str:
    return "/home with nothing in it"


def test_what_a_worker_sees(tmp_path):
    from scanfab.pipeline.cluster.on_worker import view_there

    (tmp_path / "dump_0.txt").write_text("")
    assert view_there(str(tmp_path / "dump_0.txt")) == ""
    missing = tmp_path / "no" / "such" / "dump_1.txt"
    assert view_there(str(missing)) == f"{tmp_path} with dump_0.txt in it"


def test_other_versions_are_an_error_that_names_both(executor, monkeypatch):
    mine = {**module.versions_here(), "numpy": "1.0.0"}
    theirs = module.versions_here()["numpy"]
    monkeypatch.setattr(module, "versions_here", _Stays(mine))
    with pytest.raises(ClusterError, match=f"numpy {theirs} there and 1.0.0 here"):
        executor.submit(Slow(Path("unused")), 1).result(60)


class _Stays:
    """What is sent to workers is still the function of their own."""

    def __init__(self, mine: dict[str, str]) -> None:
        self.mine = mine

    def __call__(self) -> dict[str, str]:
        return self.mine

    def __reduce__(self) -> str | tuple[Any, ...]:
        from scanfab.pipeline.cluster import on_worker

        return getattr, (on_worker, "versions_here")


def test_workers_that_come_later_are_waited_for_and_that_is_told(tmp_path, folder, capsys):
    (tmp_path / "late").mkdir()
    with DaskCluster(tmp_path / "late", workers=0) as late:
        timer = threading.Timer(1.0, late.add)
        timer.start()
        code = compute("dumps", *FAST, "--quiet", "--scheduler", late.address)
        timer.join()
        assert code == 0
    told = capsys.readouterr().err
    assert "scanfab: warning: " in told
    assert "has no workers yet: frames wait for them, without a limit" in told


def test_no_scheduler_is_one_clear_message(folder, capsys):
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        free = silent.getsockname()[1]
        words = ("dumps", *FAST, "--scheduler", f"tcp://127.0.0.1:{free}")
        assert compute(*words) == 1
        assert "no scheduler is there" in capsys.readouterr().err
    assert compute("dumps", *FAST, "--scheduler", "nonsense") == 1
    assert "expected the address of a scheduler" in capsys.readouterr().err
    Path("file.json").write_text("{}")
    assert compute("dumps", *FAST, "--scheduler-file", "file.json") == 1
    assert "with its address, found something else: is" in capsys.readouterr().err


def test_who_does_not_answer_is_named(folder, capsys, monkeypatch):
    monkeypatch.setattr(connection, "TIMEOUT", 0.3)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        assert compute("dumps", *FAST, "--scheduler", address) == 1
    assert f"{address}: does not answer as a Dask scheduler" in capsys.readouterr().err
    assert compute("dumps", *FAST, "--scheduler-file", "none.json") == 1
    assert "none.json: expected the file that a Dask scheduler writes" in capsys.readouterr().err


def test_wrong_usage(cluster, folder):
    both = ("--scheduler", cluster.address, "--scheduler-file", str(cluster.file))
    assert compute("dumps", *both) == 2
    assert compute("dumps", "--scheduler", cluster.address, "--vtk", "vtk") == 2


def test_errors_that_cannot_be_sent_are_told_all_the_same():
    from scanfab.pipeline.cluster.on_worker import sendable

    class OddError(Exception):
        def __init__(self, one: int, two: int) -> None:
            super().__init__("odd")

    assert str(sendable(OddError(1, 2))) == "OddError: odd"
    assert isinstance(sendable(ReadError("x")), ReadError)
    assert issubclass(ClusterError, ScanfabError)
