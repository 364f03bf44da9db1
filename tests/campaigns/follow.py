"""
Follow folders that are written half a file at a time: no row lost, doubled or of half a frame.

Usage, from the root of the repository (100 runs take about twelve minutes)::

    python -m tests.campaigns.follow [RUNS] [SEED]

A process writes four to eight frames, grains and contacts in files of their own, each file in two
halves with random pauses of up to 0.6 s. Every third run is interrupted at random moments, by a
signal or by SIGKILL, and goes on by --resume. The bytes are held against those of a run over the
finished folder. The exit code is 0 if they are the same in every run.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from random import Random

from tests.campaigns.frame import count_wrong, ended
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text
from tests.helpers.growing import in_halves
from tests.helpers.interruptions import PROGRAM, SIGNALS

WORDS = ("compute", "dumps", "--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")


def write(folder: Path, random: Random) -> None:
    """Frames of 64 grains, squeezed along z a little more each time."""
    for frame in range(random.randint(4, 8)):
        rows, step = cubic_rows(squeeze=1 - 0.005 * frame), 100 * frame
        grains = dump_text(rows, step=step, box=((0, 4),) * 3)
        for name, text in (("dump", grains), ("pairs", pairs_text(step=step))):
            in_halves(text.encode(), folder / f"{name}_{step}.txt", random.uniform(0, 0.6))
            time.sleep(random.choice((0.0, random.uniform(0, 0.6))))


def fault(folder: Path, random: Random, interruptions: int) -> str | None:
    """What is wrong with the bytes, which should be those of a run over the finished folder."""

    def run(output: str, *words: str) -> subprocess.Popen[str]:
        command = [*PROGRAM, *WORDS, "--workers", str(random.choice((1, 2))), *words, "-o", output]
        return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)

    (folder / "dumps").mkdir(parents=True)
    writer = threading.Thread(target=write, args=(folder / "dumps", random))
    writer.start()
    for _ in range(interruptions):
        process = run("t.csv", "--follow", "--resume")
        time.sleep(random.uniform(1.0, 6.0))
        process.send_signal(random.choice(SIGNALS))
        ended(process)
    code, said = ended(run("t.csv", "--follow-for", "2.5", *["--resume"] * (interruptions > 0)))
    writer.join()
    assert ended(run("finished.csv"))[0] == 0
    expected = (folder / "finished.csv").read_bytes()
    same = code == 0 and (folder / "t.csv").read_bytes() == expected
    return None if same else f"OTHER bytes, exit code {code}: {said}"


def main(runs: int = 100, seed: int = 0) -> int:
    """The number of runs whose bytes differ."""
    with tempfile.TemporaryDirectory() as folder:

        def fault_of(number: int) -> str | None:
            random = Random(f"{seed} {number}")
            interruptions = random.randint(1, 2) if number % 3 == 2 else 0
            return fault(Path(folder) / str(number), random, interruptions)

        return count_wrong("followed", runs, fault_of)


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:]))))
