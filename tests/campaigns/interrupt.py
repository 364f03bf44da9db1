"""
Interrupt many runs at random moments and resume them: the bytes are those of an uninterrupted run.

Usage, from the root of the repository (100 runs take about six minutes on an idle machine)::

    python -m tests.campaigns.interrupt [RUNS] [SEED]

Each run computes 30 small frames and is stopped one to three times, by SIGINT, SIGTERM or SIGKILL,
at a moment anywhere between its start and its end; the formats take turns. The exit code is 0 if
every run gave the bytes of the run that nobody interrupted.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from random import Random

from scanfab.table.formats import OWN_FORMATS
from tests.campaigns.frame import count_wrong, ended
from tests.helpers.interruptions import PROGRAM, SIGNALS, write_series

SUFFIXES = [one.suffix for one in OWN_FORMATS]


def main(runs: int = 100, seed: int = 0) -> int:
    """The number of runs whose bytes differ."""
    random = Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        series = write_series(folder / "series")

        def run(output: Path, *more: str) -> subprocess.Popen[str]:
            # the number of workers changes nothing
            workers = str(random.choice((1, 2, 3)))
            words = ["compute", str(series), "--tolerance", "3e-3", "--workers", workers, *more]
            command = [*PROGRAM, *words, "-o", str(output)]
            return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)

        began = time.perf_counter()
        for suffix in SUFFIXES:
            assert ended(run(folder / f"whole{suffix}"))[0] == 0
        seconds = (time.perf_counter() - began) / len(SUFFIXES)

        def fault_of(number: int) -> str | None:
            suffix = SUFFIXES[number % len(SUFFIXES)]
            output = folder / f"run{number}" / f"table{suffix}"
            output.parent.mkdir()
            for _ in range(random.randint(1, 3)):
                process = run(output, "--resume")
                time.sleep(random.uniform(0, seconds))
                process.send_signal(random.choice(SIGNALS))
                if ended(process)[0] == 0:
                    break  # it was faster than the signal
            else:
                code, said = ended(run(output, "--resume"))
                if code:
                    return f"exit code {code}: {said}"
            left = {path.name for path in output.parent.iterdir()}
            if left != {output.name, f"{output.name}.manifest.json"}:
                return f"it leaves {left}"
            same = output.read_bytes() == (folder / f"whole{suffix}").read_bytes()
            return None if same else f"OTHER bytes in {suffix}"

        return count_wrong("interrupted", runs, fault_of)


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:]))))
