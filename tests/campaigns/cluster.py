"""
Kill workers, or the scheduler, of a Dask cluster at random moments: the rows stay the same.

Usage, from the root of the repository (50 and 10 runs take about ten minutes)::

    python -m tests.campaigns.cluster [WORKER_RUNS] [SCHEDULER_RUNS] [SEED]

Each run computes 12 small frames on two workers. In the first kind one worker after the other is
killed by SIGKILL at random moments, and another one started in its place. In the second the
scheduler is killed at a random moment, and the run goes on by --resume with another. The exit code
is 0 if every run gave the bytes of a run with --workers 1.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from random import Random

from tests.campaigns.frame import count_wrong, ended
from tests.helpers.dask_cluster import DaskCluster
from tests.helpers.interruptions import PROGRAM, write_series

FRAMES = 12
WORDS = ("compute", "dumps", "--tolerance", "2e-3", "--quiet", "-o", "t.csv")


class Campaign:
    """Runs in one folder, which are to give the same bytes."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder = folder
        self.random = Random(seed)
        write_series(folder / "dumps", FRAMES)
        assert self.run("--workers", "1").wait() == 0
        self.expected = self.taken()

    def run(self, *words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [*PROGRAM, *WORDS, *words], cwd=self.folder, stderr=subprocess.PIPE, text=True
        )

    def taken(self) -> bytes:
        """The bytes of the table, which is removed."""
        path = self.folder / "t.csv"
        data = path.read_bytes()
        path.unlink()
        (self.folder / "t.csv.manifest.json").unlink()
        return data

    def fault(self, code: int, said: str) -> str | None:
        """What is wrong with an ended run."""
        if code != 0:
            return f"exit code {code}: {said}"
        return None if self.taken() == self.expected else "OTHER bytes"

    def cluster(self, name: str) -> DaskCluster:
        (self.folder / name).mkdir()
        return DaskCluster(self.folder / name)

    def workers_killed(self, cluster: DaskCluster, number: int) -> str | None:
        """One run, in whose course one to three workers are killed."""
        deaths = self.random.randint(1, 3)
        process = self.run("--scheduler-file", str(cluster.file))
        for _ in range(deaths):
            time.sleep(self.random.uniform(0.0, 3.0))
            cluster.kill(self.random.randrange(len(cluster.workers)))
            cluster.add()
        return self.fault(*ended(process))

    def scheduler_killed(self, number: int) -> str | None:
        """One run that loses its scheduler, and goes on with another."""
        with self.cluster(f"scheduler-{number}") as first:
            process = self.run("--scheduler-file", str(first.file))
            time.sleep(self.random.uniform(2.0, 6.0))
            first.kill_scheduler()
            code, said = ended(process)
        if code == 1:  # 0: it was faster than the signal
            with self.cluster(f"scheduler-{number}-next") as second:
                code, said = ended(self.run("--resume", "--scheduler-file", str(second.file)))
        return self.fault(code, said)


def main(worker_runs: int = 50, scheduler_runs: int = 10, seed: int = 0) -> int:
    """The number of runs whose bytes differ."""
    with tempfile.TemporaryDirectory() as folder:
        campaign = Campaign(Path(folder), seed)
        with campaign.cluster("workers") as cluster:
            killed = partial(campaign.workers_killed, cluster)
            wrong = count_wrong("workers killed", worker_runs, killed)
        return wrong + count_wrong("scheduler killed", scheduler_runs, campaign.scheduler_killed)


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:]))))
