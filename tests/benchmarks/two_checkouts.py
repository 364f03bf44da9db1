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
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[0] = str(ROOT)  # not this folder, whose modules have common names

from tests.benchmarks.timing import samples, table  # noqa: E402

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
    """A process that computes with one of them, and ends with its input."""

    def __init__(self, python: str, cache: str) -> None:
        """All cases are computed once; ``first`` is what that takes, in processor seconds."""
        self.process = subprocess.Popen(
            [python, "-c", WORKER, json.dumps([str(ROOT / "sample_data"), SCAN, CASES])],
            env={**os.environ, "NUMBA_CACHE_DIR": cache}, cwd=cache,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.first = float(self.process.stdout.readline())
        self.values: dict[str, str] = {}

    def run(self, case: str) -> float:
        """Processor seconds of a case; a number of its table is kept."""
        print(case, file=self.process.stdin, flush=True)
        seconds, self.values[case] = self.process.stdout.readline().split()
        return float(seconds)


def compiled_first(python: str) -> float:
    """Seconds of all cases in a new process without compiled code."""
    with tempfile.TemporaryDirectory() as cache:
        one = Checkout(python, cache)
        one.process.communicate()
        return one.first


def row(case: str, seconds: dict[str, np.ndarray]) -> tuple[str, ...]:
    """The ratio of a case: this checkout's time over the other's, turn by turn."""
    low, middle, high = np.percentile(seconds["this"] / seconds["other"], [25, 50, 75])
    spread = f"{low:.3f} to {high:.3f}"
    return case, f"{middle:.3f}", spread, f"{np.median(seconds['this']):.2f}"


def main() -> None:
    """Print the ratio of each case."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument("other", help="Python of an environment that has the other installed")
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--cold", type=int, default=3, help="pairs that compile everything")
    asked = parser.parse_args()
    pythons = {"this": sys.executable, "other": asked.other}
    ways = {name: partial(compiled_first, python) for name, python in pythons.items()}
    rows = []
    if asked.cold:
        rows.append(row("compiled first", samples(ways, asked.cold, warm=False, clock=None)))
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
        both = {
            name: Checkout(python, cache)
            for (name, python), cache in zip(pythons.items(), (one, two), strict=True)
        }
        for case in CASES:
            ways = {name: partial(checkout.run, case) for name, checkout in both.items()}
            rows.append(row(case, samples(ways, asked.pairs, clock=None)))
            values = {checkout.values[case] for checkout in both.values()}
            if len(values) > 1:
                print(f"{case}: the checkouts differ: {' and '.join(sorted(values))}")
        for checkout in both.values():
            checkout.process.communicate()
    print(table(["case", "median of pairs", "quarter to three quarters", "seconds"], rows))


if __name__ == "__main__":
    main()
