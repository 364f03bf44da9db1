"""A Dask cluster of processes of their own: a scheduler and some workers, to be killed at will."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.helpers.growing import until

# without the process that starts a worker again; both end by themselves if the test is killed
KINDS = {
    "scheduler": ("dask_scheduler", "--port", "0", "--host", "127.0.0.1", "--idle-timeout", "600"),
    "worker": ("dask_worker", "--nthreads", "1", "--no-nanny", "--death-timeout", "60"),
}
ROOT = str(Path(__file__).parents[2])


class DaskCluster:
    """A scheduler and its workers, in a folder that has their file and logs."""

    def __init__(self, folder: Path, workers: int = 2) -> None:
        folder.mkdir(exist_ok=True)
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.workers: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start("scheduler")
        # it ends with a brace
        until(lambda: self.file.exists() and self.file.read_text().rstrip().endswith("}"))
        for _ in range(workers):
            self.add()

    def __enter__(self) -> DaskCluster:
        return self

    def __exit__(self, *_: object) -> None:
        self._end([*self.workers, self.scheduler])

    @property
    def address(self) -> str:
        """Of the scheduler."""
        return str(json.loads(self.file.read_text())["address"])

    def add(self, **variables: str) -> None:
        """Start one more worker."""
        self.workers.append(self._start("worker", **variables))

    def kill(self, place: int = 0) -> None:
        """Kill a worker at once."""
        self._end([self.workers.pop(place)])

    def forget_the_dead(self) -> None:
        """Keep two of the workers that are still there."""
        self.workers = [one for one in self.workers if one.poll() is None]
        while len(self.workers) > 2:
            self.kill()

    def kill_scheduler(self) -> None:
        """Kill the scheduler at once, and its workers."""
        self._end([self.scheduler, *self.workers])
        self.workers.clear()
        self.file.unlink()

    @staticmethod
    def _end(processes: list[subprocess.Popen[bytes]]) -> None:
        for one in processes:
            one.kill()
            one.wait()

    def _start(self, kind: str, **variables: str) -> subprocess.Popen[bytes]:
        module, *words = KINDS[kind]
        words += ["--no-dashboard", "--scheduler-file", str(self.file)]
        with open(self.folder / f"{kind}.log", "ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{module}", *words],
                cwd=self.folder,
                stdout=log,
                stderr=log,
                env={**os.environ, "PYTHONPATH": ROOT, "OMP_NUM_THREADS": "1", **variables},
            )
