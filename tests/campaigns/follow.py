"""
Follow folders that are written half a file at a time: no row lost, doubled or of half a frame.

Usage, from the root of the repository (100 runs take about twelve minutes)::

    python -m tests.campaigns.follow [RUNS] [SEED]

A process writes four to eight frames, grains and contacts in files of their own, each file in two
halves with random pauses of up to 0.6 s. Every third run is interrupted at random moments, by a
signal or two or by SIGKILL, and goes on by --resume. The bytes are held against those of a run over
the finished folder. The exit code is 0 if they are the same in every run.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random

from tests.helpers.dumps import cubic_rows, dump_text, pairs_text
from tests.helpers.growing import in_halves
from tests.helpers.interruptions import PROGRAM

WORDS = ("compute", "dumps", "--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)


def files(frames: int) -> Iterator[tuple[str, bytes]]:
    """Of 64 grains, squeezed along z a little more each time."""
    for frame in range(frames):
        rows = cubic_rows(squeeze=1 - 0.005 * frame)
        step = 100 * frame
        yield f"dump_{step}.txt", dump_text(rows, step=step, box=((0, 4),) * 3).encode()
        yield f"pairs_{step}.txt", pairs_text(step=step).encode()


class Run:
    """A folder that is written and followed."""

    def __init__(self, folder: Path, random: Random) -> None:
        self.folder = folder
        self.random = random
        (folder / "dumps").mkdir(parents=True)
        self.codes: list[int] = []

    def write(self) -> None:
        for name, data in files(self.random.randint(4, 8)):
            in_halves(data, self.folder / "dumps" / name, self.random.uniform(0, 0.6))
            time.sleep(self.random.choice((0.0, self.random.uniform(0, 0.6))))

    def follow(self, *words: str) -> subprocess.Popen[bytes]:
        command = [*PROGRAM, *WORDS, "--workers", str(self.random.choice((1, 2))), *words]
        return subprocess.Popen([*command, "-o", "t.csv"], cwd=self.folder, stderr=subprocess.PIPE)

    def ended(self, process: subprocess.Popen[bytes]) -> str:
        _, said = process.communicate(timeout=120)
        self.codes.append(process.returncode)
        return said.decode()

    def is_right(self, interrupted: bool) -> bool:
        """Whether the bytes are those of a run over the finished folder."""
        writer = threading.Thread(target=self.write)
        writer.start()
        if interrupted:
            for _ in range(self.random.randint(1, 2)):
                process = self.follow("--follow", "--resume")
                time.sleep(self.random.uniform(1.0, 6.0))
                process.send_signal(self.random.choice(SIGNALS))
                if self.random.random() < 0.3:
                    process.send_signal(signal.SIGINT)
                self.ended(process)
            said = self.ended(self.follow("--follow-for", "2.5", "--resume"))
        else:
            said = self.ended(self.follow("--follow-for", "2.5"))
        writer.join()
        subprocess.run(
            [*PROGRAM, *WORDS, "-o", "finished.csv"],
            cwd=self.folder, check=True, capture_output=True,
        )  # fmt: skip
        expected = (self.folder / "finished.csv").read_bytes()
        same = self.codes[-1] == 0 and (self.folder / "t.csv").read_bytes() == expected
        if not same:
            print(said)
        return same


def main(runs: int = 100, seed: int = 0) -> int:
    """The number of runs whose bytes differ."""
    wrong, codes = 0, Counter[int]()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(runs):
            run = Run(Path(folder) / str(number), Random(f"{seed} {number}"))
            same = run.is_right(interrupted=number % 3 == 2)
            wrong += not same
            codes.update(run.codes)
            print(f"run {number + 1}: {'the same' if same else 'OTHER'} bytes", flush=True)
    print(f"{runs} runs, {wrong} with other bytes; exit codes {dict(codes)}")
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:]))))
