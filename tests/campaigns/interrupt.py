"""
Interrupt many runs at random moments and resume them: the bytes are those of an uninterrupted run.

Usage, from the root of the repository (100 runs take about six minutes on an idle machine)::

    python -m tests.campaigns.interrupt [RUNS] [SEED]

Each run computes 30 small frames and is stopped one to three times, by SIGINT, SIGTERM or SIGKILL,
at a moment anywhere between its start and its end; the formats take turns. The exit code is 0 if
every run gave the bytes of the run that nobody interrupted.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from random import Random

from scanfab.table.formats import OWN_FORMATS
from tests.campaigns.frame import count_wrong
from tests.helpers.interruptions import Interrupter, write_series

SUFFIXES = [one.suffix for one in OWN_FORMATS]
OPTIONS = ("--tolerance", "3e-3")


def main(runs: int = 100, seed: int = 0) -> int:
    """The number of runs whose bytes differ."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tool = Interrupter(write_series(folder / "series"), OPTIONS, Random(seed))
        expected = {suffix: tool.whole(folder / f"whole{suffix}") for suffix in SUFFIXES}

        def fault_of(number: int) -> str | None:
            suffix = SUFFIXES[number % len(SUFFIXES)]
            data, seconds = expected[suffix]
            place = folder / f"run{number}"
            place.mkdir()
            found = tool.interrupted(place / f"table{suffix}", seconds, tool.random.randint(1, 3))
            return None if found == data else f"OTHER bytes in {suffix}"

        wrong = count_wrong("interrupted", runs, fault_of)
    print(f"exit codes {dict(tool.codes)}")
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:]))))
