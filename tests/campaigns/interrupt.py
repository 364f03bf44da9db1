"""
Interrupt runs at random moments: the table has the bytes of a run that nobody interrupted.

Usage, from the root of the repository (100 runs take six to twelve minutes on an idle machine)::

    python -m tests.campaigns.interrupt KIND [RUNS] [SEED]

The kinds are *resume*: 30 small frames, stopped one to three times by SIGINT, SIGTERM or SIGKILL
at any moment and resumed; the formats of the table take turns. *follow*: a folder into which
another thread writes four to eight frames, grains and contacts in files of their own, each file in
two halves with pauses of up to 0.6 s; every third run is interrupted and resumed as well.
*workers*: 12 frames on two workers of a Dask cluster, which are killed by SIGKILL one after the
other, and replaced. *scheduler*: the same, but the scheduler is killed, and the run goes on by
--resume with another one. The exit code is 0 if every run gave the right bytes.
"""

import argparse
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from random import Random

from scanfab.table.formats import OWN_FORMATS
from tests.helpers.dask_cluster import DaskCluster
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text
from tests.helpers.growing import in_halves
from tests.helpers.interruptions import PROGRAM, SIGNALS, write_series

SCAN = ("--tolerance", "3e-3")
SUFFIXES = [one.suffix for one in OWN_FORMATS]


def start(folder: Path, output: str, *words: str) -> subprocess.Popen[str]:
    """Compute the dumps of a folder."""
    command = [*PROGRAM, "compute", "dumps", *SCAN, *words, "-o", output]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)


def ended(process: subprocess.Popen[str], seconds: float = 120.0) -> tuple[int, str]:
    """Exit code and messages of a process, which is killed if it takes too long."""
    watch = threading.Timer(seconds, process.kill)
    watch.start()
    _, said = process.communicate()
    watch.cancel()
    return process.returncode, said


def interrupted(folder: Path, output: str, random: Random, times: int, *words: str) -> None:
    """Start a run so many times, and send each a signal after a while."""
    for _ in range(times):
        workers = str(random.choice((1, 2, 3)))  # their number changes nothing
        process = start(folder, output, "--resume", "--workers", workers, *words)
        time.sleep(random.uniform(0.0, 4.0))
        process.send_signal(random.choice(SIGNALS))
        if ended(process)[0] == 0:
            return  # it was faster than the signal


def resume(folder: Path, random: Random, output: str) -> tuple[int, str]:
    """Interrupt and resume."""
    write_series(folder / "dumps")
    interrupted(folder, output, random, random.randint(1, 3))
    return ended(start(folder, output, "--resume"))


def follow(folder: Path, random: Random, output: str) -> tuple[int, str]:
    """Follow a folder that is being written."""
    (folder / "dumps").mkdir()

    def write() -> None:
        for frame in range(random.randint(4, 8)):
            rows, step = cubic_rows(squeeze=1 - 0.005 * frame), 100 * frame
            grains = dump_text(rows, step=step, box=((0, 4),) * 3)
            for name, text in (("dump", grains), ("pairs", pairs_text(step=step))):
                path = folder / "dumps" / f"{name}_{step}.txt"
                in_halves(text.encode(), path, random.uniform(0, 0.6))
                time.sleep(random.choice((0.0, random.uniform(0, 0.6))))

    writer = threading.Thread(target=write)
    writer.start()
    times = random.choice((0, 0, random.randint(1, 2)))
    interrupted(folder, output, random, times, "--follow")
    found = ended(start(folder, output, "--follow-for", "2.5", *["--resume"] * (times > 0)))
    writer.join()
    return found


def workers(folder: Path, random: Random, output: str) -> tuple[int, str]:
    """Kill some workers of a cluster."""
    write_series(folder / "dumps", 12)
    with DaskCluster(folder / "cluster") as cluster:
        process = start(folder, output, "--scheduler-file", str(cluster.file))
        for _ in range(random.randint(1, 3)):
            time.sleep(random.uniform(0.0, 3.0))
            cluster.kill(random.randrange(len(cluster.workers)))
            cluster.add()
        return ended(process)


def scheduler(folder: Path, random: Random, output: str) -> tuple[int, str]:
    """Kill the scheduler of a cluster, and resume with another one."""
    write_series(folder / "dumps", 12)
    with DaskCluster(folder / "cluster") as first:
        process = start(folder, output, "--scheduler-file", str(first.file))
        time.sleep(random.uniform(2.0, 6.0))
        first.kill_scheduler()
        found = ended(process)
    if found[0] != 1:  # 0: it was faster than the signal
        return found
    with DaskCluster(folder / "next") as second:
        return ended(start(folder, output, "--resume", "--scheduler-file", str(second.file)))


KINDS: dict[str, Callable[[Path, Random, str], tuple[int, str]]] = {
    "resume": resume, "follow": follow, "workers": workers, "scheduler": scheduler,
}  # fmt: skip


def fault(kind: str, folder: Path, random: Random, suffix: str) -> str:
    """What is wrong after one run: its end, its bytes, or the files that it leaves."""
    folder.mkdir()
    before = {"dumps", "cluster", "next"}
    code, said = KINDS[kind](folder, random, f"table{suffix}")
    if code:
        return f"exit code {code}: {said}"
    left = {path.name for path in folder.iterdir()} - before
    if left != {f"table{suffix}", f"table{suffix}.manifest.json"}:
        return f"it leaves {left}"
    assert ended(start(folder, f"whole{suffix}"))[0] == 0
    same = (folder / f"table{suffix}").read_bytes() == (folder / f"whole{suffix}").read_bytes()
    return "" if same else f"OTHER bytes in {suffix}"


def main(kind: str, runs: int, seed: int) -> int:
    """The number of runs that are wrong; all are printed."""
    wrong = 0
    with tempfile.TemporaryDirectory() as name:
        for number in range(runs):
            random, suffix = Random(f"{seed} {number}"), SUFFIXES[number % len(SUFFIXES)]
            found = fault(kind, Path(name) / str(number), random, suffix)
            wrong += bool(found)
            print(f"{kind}, run {number + 1}: {found or 'the same bytes'}", flush=True)
    print(f"{kind}: {runs} runs, {wrong} wrong", flush=True)
    return wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("runs", type=int, nargs="?", default=100)
    parser.add_argument("seed", type=int, nargs="?", default=0)
    sys.exit(bool(main(**vars(parser.parse_args()))))
