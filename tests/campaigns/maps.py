"""
How often the errors of a map's blocks cover the truth, and homogeneous samples are called so.

Usage, from the root of the repository (an hour on one core)::

    python -m tests.campaigns.maps [--samples N] [--seeds N] [--only sample scan]

*sample*: homogeneous periodic media, each of its own random numbers: overlapping spheres (Poisson)
and dense packings, both with radii from 0.5 to 1.5; as a grid, slices and shells. The truth is the
mean of all blocks of all samples. Counted is how often a block differs from it by less than its
standard error, of scan and sample together: 68.3 % of normal estimates with errors that are known,
65 % with errors of seven degrees of freedom, as a jackknife over eight parts has. And how often a
test says that a sample is not homogeneous, which should be once in a hundred.

*scan*: one dense packing (of a smaller cell), scanned with many seeds. The truth is a scan with an
error ten times smaller. Of 16 replicates Student's t gives 66.7 %.

The exit code is 0 if each coverage of void anisotropy lies within 68 ± 5 %.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from typing import NamedTuple

import numpy as np

import scanfab
from scanfab import Cell, Packing, find_contacts

EDGE, SMALL_EDGE = 24.0, 16.0
POISSON, DENSE = 0.15, 0.6
# of radii from 0.5 to 1.5
MEAN_CUBE = 1.25
STEPS = 120
KINDS = {"grid": {"grid": (2, 2, 2)}, "slices": {"slices": 4}, "shells": {"shells": 2}}
MEDIA = ["poisson", "dense"]
TOLERANCE = 3e-3
EXPECTED, ALLOWED = 0.68, 0.05
ERRORS = {
    "alpha_vs_axial": ("alpha_vs_axial_se", "alpha_vs_axial_sample_se"),
    "alpha_c_axial": ("alpha_c_axial_sample_se",),
    "mean_length": ("mean_length_se",),
    "solid_fraction": ("solid_fraction_se",),
    "coordination": ("coordination_se",),
}


def poisson(random) -> Packing:
    """Freely overlapping spheres."""
    count = random.poisson(POISSON * EDGE**3)
    position, radius = random.uniform(0, EDGE, (count, 3)), random.uniform(0.5, 1.5, count)
    return find_contacts(Packing(position, radius, cell=Cell([EDGE] * 3)))


def dense(random, edge: float = EDGE) -> Packing:
    """Random centres, pushed apart until little overlap is left; all of one solid fraction."""
    count = int(DENSE * edge**3 / (4 / 3 * np.pi * MEAN_CUBE))
    position, radius = random.uniform(0, edge, (count, 3)), random.uniform(0.5, 1.5, count)
    radius *= np.cbrt(DENSE * edge**3 / (4 / 3 * np.pi * np.sum(radius**3)))
    cell = Cell([edge] * 3)
    for _ in range(STEPS):
        packing = find_contacts(Packing(position, radius, cell=cell))
        one, two = packing.contacts.pairs.T
        branch = packing.position[two] - packing.position[one] + edge * packing.contacts.image
        overlap = radius[one] + radius[two] - np.linalg.norm(branch, axis=1)
        push = 0.5 * overlap[:, None] * packing.contacts.normal
        position = packing.position.copy()
        np.add.at(position, one, -push)
        np.add.at(position, two, push)
    return find_contacts(Packing(position, radius, cell=cell))


class Mapped(NamedTuple):
    """A table, and what was told of it."""

    table: scanfab.Table
    told: str


def mapped(packing, **options) -> Mapped:
    """A map, with its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        table = scanfab.fabric_map(packing, workers=1, **options)
    return Mapped(table, " ".join(str(one.message) for one in caught))


def covered(values, errors, truth) -> tuple[float, float]:
    """How often values lie within their errors of the truth; their scatter over the errors."""
    known = np.isfinite(values) & np.isfinite(errors)
    off = (values - truth)[known]
    return float(np.mean(np.abs(off) < errors[known])), float(
        np.sqrt(np.mean(off**2) / np.mean(errors[known] ** 2))
    )


def of_samples(make, kind: str, samples: int) -> bool:
    """Print the coverage of the errors of one kind of blocks; whether void anisotropy is right."""
    every = []
    for seed in range(samples):
        packing = make(np.random.default_rng([seed, 11]))
        every.append(mapped(packing, seed=seed, tolerance=TOLERANCE, **KINDS[kind]))
    name, right = f"{make.__name__} {kind}", True
    for column, errors in ERRORS.items():
        values = np.array([one.table[column] for one in every])
        total = np.sqrt(sum(np.array([one.table[e] for one in every]) ** 2 for e in errors))
        # each block its own: the two shells are not of one size
        share, ratio = covered(values, total, np.nanmean(values))
        print(f"{name}: {column}: covered {share:.1%}, scatter/error {ratio:.3f}", flush=True)
        if column == "alpha_vs_axial":
            right = abs(share - EXPECTED) <= ALLOWED
    wrong = np.mean(["): the sample is not homogeneous" in one.told for one in every])
    print(f"{name}: called not homogeneous: {wrong:.1%} of {samples}", flush=True)
    return right


def of_scans(kind: str, seeds: int) -> bool:
    """Print the coverage of the scan's errors over its seeds; whether it is right."""
    packing = dense(np.random.default_rng(0), SMALL_EDGE)
    tables = [
        mapped(packing, seed=seed, tolerance=TOLERANCE, **KINDS[kind]).table
        for seed in range(seeds)
    ]
    values, errors = (
        np.array([one[name] for one in tables]) for name in ("alpha_vs_axial", "alpha_vs_axial_se")
    )
    finer = 0.1 * float(np.median(errors))
    truth = mapped(packing, seed=1_000_000, tolerance=finer, **KINDS[kind]).table
    share, ratio = covered(values, errors, truth["alpha_vs_axial"])
    print(f"scan {kind}: covered {share:.1%}, scatter/error {ratio:.3f}", flush=True)
    return abs(share - EXPECTED) <= ALLOWED


def main() -> int:
    """How many coverages lie outside."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=400)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--media", nargs="+", choices=["poisson", "dense"], default=MEDIA)
    parser.add_argument("--only", nargs="+", choices=["sample", "scan"], default=["sample", "scan"])
    asked = parser.parse_args()
    media = [make for make in (poisson, dense) if make.__name__ in asked.media]
    right = []
    for kind in asked.kinds:
        if "sample" in asked.only:
            right += [of_samples(make, kind, asked.samples) for make in media]
        if "scan" in asked.only:
            right.append(of_scans(kind, asked.seeds))
    return sum(not one for one in right)


if __name__ == "__main__":
    sys.exit(bool(main()))
