"""
The computation of another checkout beside this one's, in turns, in processor time of one thread.

python tests/benchmarks/two_checkouts.py OTHER/bin/python [--pairs 9]

For changes that must not cost any speed. Each run is a process that computes a case twice, and
tells the seconds of the second time and a number of its table.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
import warnings
from functools import partial
from pathlib import Path

ROOT = Path(__file__).parents[2]
CUTOFFS = ",".join(f"{0.2 * k:.1f}rmin" for k in range(1, 11))
CASES = {
    "open, abcd, r_min/5": ("liggghts_box", {"spacing": "0.2rmin"}),
    "open, c, r_min/10": ("liggghts_box", {"spacing": "0.1rmin", "variants": "c"}),
    "open, abcd, 4 r_min": ("liggghts_box", {"spacing": "4rmin", "directions": 1454}),
    "open, ten cut-offs": ("liggghts_box", {"spacing": "0.5rmin", "cutoffs": CUTOFFS}),
    "periodic, abcd, r_min/5": ("liggghts_periodic", {"spacing": "0.2rmin"}),
    "periodic, ten cut-offs": ("liggghts_periodic", {"spacing": "0.5rmin", "cutoffs": CUTOFFS}),
}


def computed(case: str) -> None:
    """Compute a case by the scanfab of this interpreter."""
    import scanfab

    warnings.simplefilter("ignore")
    folder, words = CASES[case]
    packing = scanfab.read_series(ROOT / "sample_data" / folder)[-1].read()
    options = {"directions": 61, "workers": 1, "seed": 3, **words}
    scanfab.compute(packing, **options)
    begun = time.process_time()
    table = scanfab.compute(packing, **options)
    print(time.process_time() - begun, table[0].mean_length)


def run(python: str, case: str, values: set[str]) -> float:
    """Seconds of a case; the number of its table joins the others."""
    # without this folder and this checkout in the path of the other interpreter
    command = [python, "-P", __file__, python, "--case", case]
    seconds, value = subprocess.check_output(command, text=True).split()
    values.add(value)
    return float(seconds)


def main() -> None:
    """Print the ratio of each case."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument("other", help="Python of an environment that has the other installed")
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.case:
        return computed(asked.case)
    sys.path[0] = str(ROOT)  # not this folder, whose modules have common names
    import numpy as np

    from tests.benchmarks.timing import samples, table

    rows = []
    for case in CASES:
        values: set[str] = set()
        ways = {one: partial(run, one, case, values) for one in (sys.executable, asked.other)}
        mine, others = samples(ways, asked.pairs, clock=None).values()
        low, middle, high = np.percentile(mine / others, [25, 50, 75])
        spread = f"{low:.3f} to {high:.3f}"
        rows.append((case, f"{middle:.3f}", spread, f"{np.median(mine):.2f}"))
        if len(values) > 1:
            print(f"{case}: the checkouts differ: {' and '.join(sorted(values))}")
    return print(table(["case", "median of pairs", "quarter to three quarters", "seconds"], rows))


if __name__ == "__main__":
    main()
