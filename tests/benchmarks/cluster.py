"""
Workers of a Dask cluster beside threads of one process: wall time, and time of processors.

python tests/benchmarks/cluster.py [--turns 7] [--frames 8] [--edge 20]

Two clusters of separate processes, of one worker and of two with one thread each, and one and two
threads of this process take turns. Each way is taken once before, so that kernels are loaded and
connections stand. Processor time is user and system time of this process, of the scheduler and of
the workers.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil

sys.path.insert(0, str(Path(__file__).parents[2]))

import scanfab
from tests.helpers.dask_cluster import DaskCluster
from tests.helpers.dumps import cubic_rows, dump_text, shaken_cubic, write

SCAN = {"spacing": "0.3rmin", "cutoff": "0.2rmin"}
MANY: dict[str, Any] = {"directions": 100, **SCAN}
HUGE: dict[str, Any] = {"directions": 200, "spacing": "0.2rmin", "cutoff": "0.2rmin"}
Ways = dict[str, Callable[..., "Times"]]


class Times(NamedTuple):
    """Of one computation, in seconds."""

    wall: float
    here: float
    scheduler: float
    workers: float


def used(process: subprocess.Popen[bytes]) -> float:
    """Seconds of the processor that a process has used."""
    times = psutil.Process(process.pid).cpu_times()
    return float(times.user + times.system)


def timed(there: list[subprocess.Popen[bytes]], more: dict[str, Any], source: Any) -> Times:
    """One computation; ``there`` is the scheduler, and then its workers."""
    series, words = source
    before = [used(one) for one in there]
    here, begun = time.process_time(), time.perf_counter()
    scanfab.compute(series, **words, **more)
    wall, here = time.perf_counter() - begun, time.process_time() - here
    spent = [used(one) - was for one, was in zip(there, before, strict=True)]
    return Times(wall, here, sum(spent[:1]), sum(spent[1:]))


def sources(folder: Path, frames: int, edge: int) -> dict[str, Any]:
    """Many small frames as dumps, and a huge one, with their options."""
    for frame in range(frames):
        text = dump_text(cubic_rows(10, 1 - 1e-3 * frame), step=frame, box=((0, 10),) * 3)
        write(folder / f"dump_{frame}.txt", text)
    packing = shaken_cubic(np.random.default_rng(0), edge)
    np.savez(folder / "huge.npz", position=packing.position, radius=packing.radius)
    return {
        "many frames": (scanfab.read_series(str(folder / "dump_*.txt")), MANY),
        "one huge frame": (scanfab.read_series(folder / "huge.npz"), HUGE),
    }


def show(case: str, runs: dict[str, list[Times]]) -> None:
    """A row for each way: medians, and the quarters of the wall time against that of one thread."""
    print(f"\n| {case} | wall | of one thread's | here | scheduler | workers | all |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    first = [run.wall for run in next(iter(runs.values()))]
    for way, times in runs.items():
        ratios = [run.wall / one for run, one in zip(times, first, strict=True)]
        low, middle, high = statistics.quantiles(ratios, n=4)
        cells = [statistics.median(column) for column in zip(*times, strict=True)]
        cells.append(statistics.median(sum(run[1:]) for run in times))
        wall, *rest = (f"{cell:.2f}" for cell in cells)
        spread = f"{middle:.2f} ({low:.2f} to {high:.2f})"
        print(f"| {way} | {wall} | {spread} | {' | '.join(rest)} |", flush=True)


def ways_of(folder: Path, stack: ExitStack) -> Ways:
    """Threads of this process, and clusters that are started for it."""
    found: Ways = {f"`--workers {n}`": partial(timed, [], {"workers": n}) for n in (1, 2)}
    for count, name in ((1, "1 worker"), (2, "2 workers")):
        (folder / name).mkdir()
        cluster = stack.enter_context(DaskCluster(folder / name, count))
        executor = stack.enter_context(scanfab.dask_executor(cluster.address))
        while len(executor.workers()) < count:
            time.sleep(0.1)
        processes = [cluster.scheduler, *cluster.workers]
        found[f"cluster, {name}"] = partial(timed, processes, {"executor": executor})
    return found


def main() -> None:
    """Both cases, all ways in turns."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser()
    parser.add_argument("--turns", type=int, default=7)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--edge", type=int, default=20)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        ways = ways_of(Path(folder), stack)
        for case, source in sources(Path(folder), asked.frames, asked.edge).items():
            for way in ways.values():
                way(source)
            runs: dict[str, list[Times]] = {way: [] for way in ways}
            for _ in range(asked.turns):
                for name, way in ways.items():
                    runs[name].append(way(source))
            show(case, runs)


if __name__ == "__main__":
    main()
