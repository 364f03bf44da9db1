"""
The computation of another checkout beside this one's, in turns, in processor time of one thread.

python tests/benchmarks/two_checkouts.py OTHER/bin/python [--pairs 15]

For changes that must not cost any speed, such as files that move: each checkout has a process of
its own, which is told when to run, so that both share the machine's moods.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

DATA = Path(__file__).parents[2] / "sample_data"
CUTOFFS = ",".join(f"{0.2 * k:.1f}rmin" for k in range(1, 11))
SCAN = {"directions": 61, "workers": 1, "seed": 3}
CASES = {
    "open, abcd, r_min/5": ("liggghts_box", {"spacing": "0.2rmin"}),
    "open, c, r_min/10": ("liggghts_box", {"spacing": "0.1rmin", "variants": "c"}),
    "open, abcd, 4 r_min": ("liggghts_box", {"spacing": "4rmin", "directions": 1454}),
    "open, ten cut-offs": ("liggghts_box", {"spacing": "0.5rmin", "cutoffs": CUTOFFS}),
    "periodic, abcd, r_min/5": ("liggghts_periodic", {"spacing": "0.2rmin"}),
    "periodic, ten cut-offs": ("liggghts_periodic", {"spacing": "0.5rmin", "cutoffs": CUTOFFS}),
}
WORKER = """
import json, sys, time, warnings
warnings.simplefilter("ignore")
begun = time.process_time()
import scanfab
data, scan, cases = json.loads(sys.argv[1])

def ready(folder, words):
    *_, last = scanfab.read_series(f"{data}/{folder}")
    packing = last.read()
    packing = packing if packing.contacts is not None else scanfab.find_contacts(packing)
    scanfab.compute(packing, **{**scan, **words})
    return packing, {**scan, **words}

cases = {name: ready(*case) for name, case in cases.items()}
print(time.process_time() - begun, flush=True)
for line in sys.stdin:
    packing, words = cases[line.strip()]
    begun = time.process_time()
    table = scanfab.compute(packing, **words)
    print(time.process_time() - begun, table[0].mean_length, flush=True)
"""


class Checkout:
    """A process that computes with one of them."""

    def __init__(self, python: str, cache: Path) -> None:
        """All cases are computed once; ``first`` is what that takes, in processor seconds."""
        self.process = subprocess.Popen(
            [python, "-c", WORKER, json.dumps([str(DATA), SCAN, CASES])],
            env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
            cwd=cache,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.told, self.answers = self.process.stdin, self.process.stdout
        self.first = float(self.answers.readline())

    def run(self, case: str) -> tuple[float, str]:
        """Processor seconds of a case, and a number of its table."""
        print(case, file=self.told, flush=True)
        seconds, value = self.answers.readline().split()
        return float(seconds), value

    def end(self) -> None:
        """Let it go."""
        self.told.close()
        self.process.wait()


def main() -> None:
    """Print the ratio of each case: this checkout's time over the other's."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument("other", help="Python of an environment that has the other installed")
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--cold", type=int, default=3, help="pairs that compile everything")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        cold = []
        for turn in range(asked.cold):
            pair = [Checkout(python, _cache(name, python, turn)) for python in _both(asked.other)]
            cold.append(pair[0].first / pair[1].first)
            print(f"compiled first: {pair[0].first:.1f} s of {pair[1].first:.1f} s", flush=True)
            for one in pair:
                one.end()
        here, other = (Checkout(python, _cache(name, python, 0)) for python in _both(asked.other))
        print("\n| case | median of pairs | quarter to three quarters | seconds |")
        print("| --- | --- | --- | --- |")
        for case in CASES:
            pairs = [_pair(here, other, case, turn) for turn in range(asked.pairs)]
            low, middle, high = statistics.quantiles([one / two for one, two in pairs], n=4)
            seconds = statistics.median(one for one, _ in pairs)
            print(
                f"| {case} | {middle:.3f} | {low:.3f} to {high:.3f} | {seconds:.2f} |", flush=True
            )
        if cold:
            spread = f"{min(cold):.3f} to {max(cold):.3f}"
            print(f"| compiled first | {statistics.median(cold):.3f} | all: {spread} | |")


def _both(other: str) -> tuple[str, str]:
    return sys.executable, other


def _cache(folder: str, python: str, turn: int) -> Path:
    """Where compiled code is kept, empty at first."""
    path = Path(folder) / f"{turn}{'here' if python == sys.executable else 'other'}"
    path.mkdir(exist_ok=True)
    return path


def _pair(here: Checkout, other: Checkout, case: str, turn: int) -> tuple[float, float]:
    """Seconds of both, which take turns in who is first; their numbers must be the same."""
    first, second = (here, other) if turn % 2 else (other, here)
    found = {first: first.run(case), second: second.run(case)}
    if found[here][1] != found[other][1]:
        print(f"{case}: the checkouts differ: {found[here][1]} and {found[other][1]}", flush=True)
    return found[here][0], found[other][0]


if __name__ == "__main__":
    main()
