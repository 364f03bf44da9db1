"""
How often the scan's standard error covers the truth: 68 of 100 times if it is right.

Usage, from the root of the repository (1600 seeds take half an hour on two cores)::

    python -m tests.campaigns.coverage [--seeds N] [--first SEED] [--edge clip|start|ends]

The last frames of two series of sample_data, all variants. The truth is a scan with an error ten
times smaller or more, with other random numbers. Each seed is a scan of its own: the default
``auto`` at a loose tolerance, a given spacing with automatic directions, fixed lines in 16
replicates, and what ``calibrate`` recommends. Counted is how often ``alpha_vs_axial`` differs from
the truth by less than its standard error. Of a normal estimate with an exactly known error that is
68.3 %; with an error from the scatter of 16 replicates
Student's t with 15 degrees of freedom gives 66.7 %. The exit code is 0 if every variant lies
within 68 ± 5 %.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np

import scanfab
from scanfab.scan.edges import EDGES
from tests.campaigns.frame import SAMPLE_DATA, asked, is_right

FRAMES: dict[str, dict[str, Any]] = {"yade_triaxial": {"boundary": "mask=3"}, "liggghts_box": {}}
TOLERANCE = 1e-3
SCANS: dict[str, dict[str, Any]] = {
    "auto": {"tolerance": TOLERANCE},
    "spacing": {"tolerance": TOLERANCE / 2, "spacing": "0.5rmin"},
    "fixed": {"directions": "icosahedral:9", "spacing": "0.5rmin"},
    "calibrate": {},
}
TRUTH = {"tolerance": TOLERANCE / 80, "seed": 1_000_000}
VARIANTS = "abcd"


def coverage(name: str, packing, scan: dict[str, Any], seeds: range, truth) -> bool:
    """Print the coverage of one frame and kind of scan; whether it is as expected."""
    tables = [scanfab.compute(packing, seed=seed, **scan) for seed in seeds]
    values, errors = (
        np.array([one[f"alpha_vs_axial{end}"] for one in tables]) for end in ("", "_se")
    )
    within = np.mean(np.abs(values - truth) < errors, axis=0)
    scatter = values.std(axis=0, ddof=1)
    ratio = scatter / np.sqrt(np.mean(errors**2, axis=0))
    bias = np.mean(values - truth, axis=0) / scatter
    counts = sorted({int(number) for one in tables for number in one["replicates"]})
    for which, variant in enumerate(VARIANTS):
        print(
            f"{name} {variant}: "
            f"covered {within[which]:.1%}, scatter/error {ratio[which]:.3f}, "
            f"bias {bias[which]:+.2f} of the scatter, error {errors[:, which].mean():.2e}, "
            f"replicates {counts[0]} to {counts[-1]}",
            flush=True,
        )
    return is_right(within)


def main() -> int:
    """How many frames and kinds of scan lie outside."""
    given = asked(__doc__, seeds=1600, first=0, frames=FRAMES, workers=1, edge=EDGES[0], only=SCANS)
    warnings.simplefilter("ignore", scanfab.ScanfabWarning)
    outside = 0
    for name in given.frames:
        packing = scanfab.read_series(SAMPLE_DATA / name)[-1].read()
        words = {**FRAMES[name], "edge": given.edge, "workers": given.workers}
        table = scanfab.compute(packing, **words, **TRUTH)
        truth = table["alpha_vs_axial"]
        print(f"{name} truth: {truth.round(6)} ± {table['alpha_vs_axial_se'].round(6)}", flush=True)
        for kind in given.only:
            scan = SCANS[kind]
            if kind == "calibrate":
                scan = scanfab.calibrate(packing, variants=VARIANTS, **words).options
            seeds = range(given.first, given.first + given.seeds)
            right = coverage(f"{name} {kind:9}", packing, {**words, **scan}, seeds, truth)
            outside += not right
    return outside


if __name__ == "__main__":
    sys.exit(bool(main()))
