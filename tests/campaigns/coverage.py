"""
How often standard errors cover the truth: 68 of 100 times if they are right.

Usage, from the root of the repository (all of it takes an hour and a half on two cores)::

    python -m tests.campaigns.coverage [--only scan map] [--seeds N] [--samples N] [--edge clip ...]

*scan*: the last frames of two series of sample_data, all variants. The truth is a scan with an
error ten times smaller or more, with other random numbers. Each seed is a scan of its own: the
default ``auto`` at a loose tolerance, a given spacing with automatic directions, fixed lines in 16
replicates, and what ``calibrate`` recommends. A normal estimate with an exactly known error covers
the truth in 68.3 % of the scans, one with an error from the scatter of 16 replicates in 66.7 %
(Student's t with 15 degrees of freedom).

*map*: homogeneous periodic media, each of its own random numbers: overlapping spheres (Poisson) and
dense packings, both with radii from 0.5 to 1.5; as a grid, slices and shells. The truth is the mean
of all blocks of all samples, and the errors are those of scan and sample together; 65 % are right
for seven degrees of freedom, as a jackknife over eight parts has.

The exit code is 0 if each coverage of void anisotropy lies within 68 ± 5 %.
"""

import argparse
import sys
import warnings
from typing import Any

import numpy as np

import scanfab
from scanfab import Cell, Packing, find_contacts
from scanfab.scan.edges import EDGES
from tests.benchmarks.packings import pushed_apart
from tests.helpers.truth import SAMPLE_DATA

FRAMES: dict[str, dict[str, Any]] = {"yade_triaxial": {"boundary": "mask=3"}, "liggghts_box": {}}
SCANS: dict[str, dict[str, Any]] = {
    "auto": {"tolerance": 1e-3},
    "spacing": {"tolerance": 5e-4, "spacing": "0.5rmin"},
    "fixed": {"directions": "icosahedral:9", "spacing": "0.5rmin"},
    "calibrate": {},
}
TRUTH = {"tolerance": 1e-3 / 80, "seed": 1_000_000}
VARIANTS = "abcd"
# of a map: the edge of the cell, share or number of grains in it, the mean cube of the radii
EDGE, POISSON, DENSE, MEAN_CUBE = 24.0, 0.15, 0.6, 1.25
BLOCKS = {"grid": {"grid": (2, 2, 2)}, "slices": {"slices": 4}, "shells": {"shells": 2}}
ERRORS = {
    "alpha_vs_axial": ("alpha_vs_axial_se", "alpha_vs_axial_sample_se"),
    "alpha_c_axial": ("alpha_c_axial_sample_se",),
    "mean_length": ("mean_length_se",),
    "solid_fraction": ("solid_fraction_se",),
    "coordination": ("coordination_se",),
}


def is_right(name: str, values: np.ndarray, errors: np.ndarray, truth: float) -> bool:
    """Print how often values lie within their errors of the truth; whether that is 68 ± 5 %."""
    known = np.isfinite(values) & np.isfinite(errors)
    off, errors = values[known] - truth, errors[known]
    share, scatter = np.mean(np.abs(off) < errors), np.sqrt(np.mean(off**2) / np.mean(errors**2))
    print(
        f"{name}: covered {share:.1%}, scatter/error {scatter:.3f}, bias {np.mean(off):+.1e}, "
        f"error {errors.mean():.2e}",
        flush=True,
    )
    return bool(abs(share - 0.68) <= 0.05)


def of_scans(frame: str, kind: str, seeds: int, edge: str) -> int:
    """How many variants of a frame's scans lie outside."""
    packing = scanfab.read_series(SAMPLE_DATA / frame)[-1].read()
    words = {**FRAMES[frame], "edge": edge}
    truth = scanfab.compute(packing, **words, **TRUTH)["alpha_vs_axial"]
    scan = SCANS[kind]
    if kind == "calibrate":
        scan = scanfab.calibrate(packing, variants=VARIANTS, **words).options
    tables = [scanfab.compute(packing, seed=seed, **{**words, **scan}) for seed in range(seeds)]
    values, errors = (
        np.array([one[f"alpha_vs_axial{end}"] for one in tables]).T for end in ("", "_se")
    )
    found = [
        is_right(f"{frame} {kind} {edge} {variant}", values[k], errors[k], truth[k])
        for k, variant in enumerate(VARIANTS)
    ]
    return found.count(False)


def sample(medium: str, random: np.random.Generator) -> Packing:
    """Freely overlapping spheres, or random centres pushed apart until little overlap is left."""
    is_dense = medium == "dense"
    count = random.poisson(POISSON * EDGE**3)
    if is_dense:
        count = int(DENSE * EDGE**3 / (4 / 3 * np.pi * MEAN_CUBE))
    position, radius = random.uniform(0, EDGE, (count, 3)), random.uniform(0.5, 1.5, count)
    if is_dense:
        radius *= np.cbrt(DENSE * EDGE**3 / (4 / 3 * np.pi * np.sum(radius**3)))
        position = pushed_apart(position, radius, EDGE, 120)
    return find_contacts(Packing(position, radius, cell=Cell([EDGE] * 3)))


def of_maps(medium: str, kind: str, samples: int) -> int:
    """Whether the error of void anisotropy lies outside; how many samples are not homogeneous."""
    every, said = [], 0
    for seed in range(samples):
        packing = sample(medium, np.random.default_rng([seed, 11]))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            every.append(scanfab.fabric_map(packing, seed=seed, tolerance=3e-3, **BLOCKS[kind]))
        said += any("): the sample is not homogeneous" in str(one.message) for one in caught)
    right = []
    for column, errors in ERRORS.items():
        values = np.ravel([one[column] for one in every])
        total = np.sqrt(sum(np.ravel([one[error] for one in every]) ** 2 for error in errors))
        right.append(is_right(f"{medium} {kind} {column}", values, total, np.nanmean(values)))
    print(f"{medium} {kind}: {said} of {samples} called not homogeneous", flush=True)
    return int(not right[0])


def main() -> int:
    """How many coverages lie outside."""
    parser = argparse.ArgumentParser(description="How often standard errors cover the truth.")
    parser.add_argument("--only", nargs="+", default=["scan", "map"])
    parser.add_argument("--seeds", type=int, default=1600)
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--edge", nargs="+", default=EDGES[:1])
    given = parser.parse_args()
    warnings.simplefilter("ignore", scanfab.ScanfabWarning)
    outside = 0
    if "scan" in given.only:
        outside += sum(
            of_scans(frame, kind, given.seeds, edge)
            for frame in FRAMES
            for edge in given.edge
            for kind in SCANS
        )
    if "map" in given.only:
        outside += sum(
            of_maps(medium, kind, given.samples)
            for medium in ("poisson", "dense")
            for kind in BLOCKS
        )
    return outside


if __name__ == "__main__":
    sys.exit(bool(main()))
