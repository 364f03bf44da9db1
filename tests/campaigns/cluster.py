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
from pathlib import Path
from random import Random

from tests.campaigns.frame import count_wrong, ended
from tests.helpers.dask_cluster import DaskCluster
from tests.helpers.interruptions import PROGRAM, write_series

FRAMES = 12
WORDS = ("compute", "dumps", "--tolerance", "2e-3", "--quiet", "-o", "t.csv")


def main(worker_runs: int = 50, scheduler_runs: int = 10, seed: int = 0) -> int:
    """The number of runs whose bytes differ."""
    random = Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_series(folder / "dumps", FRAMES)

        def run(*words: str) -> subprocess.Popen[str]:
            command = [*PROGRAM, *WORDS, *words]
            return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)

        def taken() -> bytes:
            data = (folder / "t.csv").read_bytes()
            for one in folder.glob("t.csv*"):
                one.unlink()
            return data

        def fault(code: int, said: str) -> str | None:
            if code != 0:
                return f"exit code {code}: {said}"
            return None if taken() == expected else "OTHER bytes"

        def workers_killed(number: int) -> str | None:
            process = run("--scheduler-file", str(workers.file))
            for _ in range(random.randint(1, 3)):
                time.sleep(random.uniform(0.0, 3.0))
                workers.kill(random.randrange(len(workers.workers)))
                workers.add()
            return fault(*ended(process))

        def scheduler_killed(number: int) -> str | None:
            with DaskCluster(folder / f"scheduler-{number}") as first:
                process = run("--scheduler-file", str(first.file))
                time.sleep(random.uniform(2.0, 6.0))
                first.kill_scheduler()
                code, said = ended(process)
            if code == 1:  # 0: it was faster than the signal
                with DaskCluster(folder / f"scheduler-{number}-next") as second:
                    code, said = ended(run("--resume", "--scheduler-file", str(second.file)))
            return fault(code, said)

        assert ended(run("--workers", "1"))[0] == 0
        expected = taken()
        with DaskCluster(folder / "workers") as workers:
            wrong = count_wrong("workers killed", worker_runs, workers_killed)
        return wrong + count_wrong("scheduler killed", scheduler_runs, scheduler_killed)


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:]))))
