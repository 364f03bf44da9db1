"""
Workers of a Dask cluster beside threads of one process: wall time, and time of processors.

python tests/benchmarks/cluster.py [--turns 7] [--frames 8] [--edge 10]

Two clusters of separate processes, of one worker and of two with one thread each, and one and two
threads of this process take turns. Each way is taken once before, so that kernels are loaded and
connections stand. Processor time is user and system time of this process, of the schedulers and of
the workers. Frames have so many grains along an edge.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import psutil

sys.path[0] = str(Path(__file__).parents[2])  # not this folder, whose modules have common names

import scanfab  # noqa: E402
from tests.benchmarks.timing import samples, table  # noqa: E402
from tests.helpers.dask_cluster import DaskCluster  # noqa: E402
from tests.helpers.interruptions import write_series  # noqa: E402

SCAN: dict[str, Any] = {"directions": 100, "spacing": "0.3rmin", "cutoff": "0.2rmin"}
TITLES = ["wall", "of one thread's (quarters)", "processor: here", "schedulers", "workers", "all"]


def used(processes: list[Any]) -> float:
    """Seconds of the processor that processes have used."""
    times = [psutil.Process(one.pid).cpu_times() for one in processes]
    return float(sum(one.user + one.system for one in times))


def rows(turns: dict[str, np.ndarray]) -> list[list[str]]:
    """Medians of each way, and the quarters of the wall time against that of one thread."""
    first = next(iter(turns.values()))[:, 0]
    found = []
    for way, times in turns.items():
        low, middle, high = np.percentile(times[:, 0] / first, [25, 50, 75])
        processors = [*times[:, 1:].T, times[:, 1:].sum(axis=1)]
        wall, *rest = (f"{np.median(column):.2f}" for column in (times[:, 0], *processors))
        found.append([way, wall, f"{middle:.2f} ({low:.2f} to {high:.2f})", *rest])
    return found


def main() -> None:
    """All ways in turns."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser()
    parser.add_argument("--turns", type=int, default=7)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--edge", type=int, default=10)
    asked = parser.parse_args()
    ways: dict[str, dict[str, Any]] = {f"`--workers {n}`": {"workers": n} for n in (1, 2)}
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        clusters = []
        for count, workers in ((1, "1 worker"), (2, "2 workers")):
            (Path(name) / workers).mkdir()
            clusters.append(stack.enter_context(DaskCluster(Path(name) / workers, count)))
            executor = stack.enter_context(scanfab.dask_executor(clusters[-1].address))
            executor.client.wait_for_workers(count)
            ways[f"cluster, {workers}"] = {"executor": executor}

        def clocks() -> np.ndarray:
            schedulers = used([one.scheduler for one in clusters])
            workers = used([worker for one in clusters for worker in one.workers])
            return np.array([time.perf_counter(), time.process_time(), schedulers, workers])

        series = scanfab.read_series(write_series(Path(name) / "dumps", asked.frames, asked.edge))
        runs = {way: partial(scanfab.compute, series, **SCAN, **more) for way, more in ways.items()}
        print(table(["way", *TITLES], rows(samples(runs, asked.turns, clock=clocks))))


if __name__ == "__main__":
    main()
