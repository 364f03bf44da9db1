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

import argparse
import sys
import warnings
from pathlib import Path

import numpy as np

import scanfab
from scanfab.scan.edges import EDGES

DATA = Path(__file__).parents[2] / "sample_data"
FRAMES = {
    "yade_triaxial": {"boundary": "mask=3"},
    "liggghts_box": {},
}
TOLERANCE = 1e-3
SCANS = {
    "auto": {"tolerance": TOLERANCE},
    "spacing": {"tolerance": TOLERANCE / 2, "spacing": "0.5rmin"},
    "fixed": {"directions": "icosahedral:9", "spacing": "0.5rmin"},
}
TRUTH = {"tolerance": TOLERANCE / 80, "seed": 1_000_000}
EXPECTED, ALLOWED = 0.68, 0.05
VARIANTS = "abcd"


def coverage(
    name: str, kind: str, options: dict, scan: dict, seeds: range, truth, workers: int
) -> bool:
    """Print the coverage of one frame and kind of scan; whether it is as expected."""
    packing = last_frame(name)
    values = np.empty((len(seeds), len(VARIANTS), 2))
    replicates = set()
    for place, seed in enumerate(seeds):
        table = scanfab.compute(packing, seed=seed, workers=workers, **options, **scan)
        values[place, :, 0] = table["alpha_vs_axial"]
        values[place, :, 1] = table["alpha_vs_axial_se"]
        replicates |= set(table["replicates"])
    off = values[:, :, 0] - truth
    covered = np.mean(np.abs(off) < values[:, :, 1], axis=0)
    ratio = off.std(axis=0, ddof=1) / np.sqrt(np.mean(values[:, :, 1] ** 2, axis=0))
    bias = off.mean(axis=0) / off.std(axis=0, ddof=1)
    counts = sorted(map(int, replicates))
    for which, variant in enumerate(VARIANTS):
        print(
            f"{name} {kind:9} {variant}: "
            f"covered {covered[which]:.1%}, scatter/error {ratio[which]:.3f}, "
            f"bias {bias[which]:+.2f} of the scatter, error {values[:, which, 1].mean():.2e}, "
            f"replicates {counts[0]} to {counts[-1]}",
            flush=True,
        )
    return bool(np.all(np.abs(covered - EXPECTED) <= ALLOWED))


def last_frame(name: str):
    """The last frame of a series, as a packing."""
    frames = list(scanfab.read_series(DATA / name))
    return frames[-1].read()


def main() -> int:
    """How many frames and kinds of scan lie outside."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument("--seeds", type=int, default=1600)
    parser.add_argument("--first", type=int, default=0, help="the first of the seeds")
    parser.add_argument("--frames", nargs="+", choices=FRAMES, default=[*FRAMES])
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--edge", choices=EDGES, default=EDGES[0])
    parser.add_argument("--only", nargs="+", choices=[*SCANS, "calibrate"], help="kinds of scan")
    asked = parser.parse_args()
    warnings.simplefilter("ignore", scanfab.ScanfabWarning)
    outside = 0
    seeds = range(asked.first, asked.first + asked.seeds)
    for name in asked.frames:
        options = {**FRAMES[name], "edge": asked.edge}
        table = scanfab.compute(last_frame(name), workers=asked.workers, **options, **TRUTH)
        truth = table["alpha_vs_axial"]
        print(f"{name} truth: {truth.round(6)} ± {table['alpha_vs_axial_se'].round(6)}", flush=True)
        words = {"variants": VARIANTS, "workers": asked.workers, **options}
        kinds = {kind: SCANS[kind] for kind in SCANS if kind in (asked.only or SCANS)}
        if "calibrate" in (asked.only or ["calibrate"]):
            kinds["calibrate"] = scanfab.calibrate(last_frame(name), **words).options
        for kind, scan in kinds.items():
            right = coverage(name, kind, options, scan, seeds, truth, asked.workers)
            outside += not right
    return outside


if __name__ == "__main__":
    sys.exit(bool(main()))
