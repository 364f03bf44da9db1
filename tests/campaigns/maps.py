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

import sys
import warnings
from collections.abc import Callable

import numpy as np

import scanfab
from scanfab import Cell, Packing, find_contacts
from tests.benchmarks.packings import pushed_apart
from tests.campaigns.frame import asked, is_right

EDGE, SMALL_EDGE = 24.0, 16.0
POISSON, DENSE = 0.15, 0.6
# of radii from 0.5 to 1.5
MEAN_CUBE = 1.25
STEPS = 120
KINDS = {"grid": {"grid": (2, 2, 2)}, "slices": {"slices": 4}, "shells": {"shells": 2}}
TOLERANCE = 3e-3
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
    position = pushed_apart(position, radius, edge, STEPS)
    return find_contacts(Packing(position, radius, cell=Cell([edge] * 3)))


MEDIA: dict[str, Callable[..., Packing]] = {"poisson": poisson, "dense": dense}


def mapped(packing, kind: str, seed: int, tolerance: float) -> tuple[scanfab.Table, str]:
    """A map, and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        table = scanfab.fabric_map(
            packing, workers=1, seed=seed, tolerance=tolerance, **KINDS[kind]
        )
    return table, " ".join(str(one.message) for one in caught)


def covered(values: np.ndarray, errors: np.ndarray, truth: float) -> tuple[float, float]:
    """How often values lie within their errors of the truth; their scatter over the errors."""
    known = np.isfinite(values) & np.isfinite(errors)
    off, errors = values[known] - truth, errors[known]
    return float(np.mean(np.abs(off) < errors)), float(
        np.sqrt(np.mean(off**2 / np.mean(errors**2)))
    )


def of_samples(medium: str, kind: str, samples: int) -> bool:
    """Print the coverage of the errors of one kind of blocks; whether void anisotropy is right."""
    every, told = [], []
    for seed in range(samples):
        packing = MEDIA[medium](np.random.default_rng([seed, 11]))
        table, said = mapped(packing, kind, seed, TOLERANCE)
        every.append(table)
        told.append("): the sample is not homogeneous" in said)
    right = True
    for column, errors in ERRORS.items():
        values = np.ravel([one[column] for one in every])
        total = np.sqrt(sum(np.ravel([one[error] for one in every]) ** 2 for error in errors))
        share, ratio = covered(values, total, np.nanmean(values))
        print(
            f"{medium} {kind}: {column}: covered {share:.1%}, scatter/error {ratio:.3f}", flush=True
        )
        right &= column != "alpha_vs_axial" or is_right(share)
    print(f"{medium} {kind}: called not homogeneous: {np.mean(told):.1%} of {samples}", flush=True)
    return right


def of_scans(kind: str, seeds: int) -> bool:
    """Print the coverage of the scan's errors over its seeds; whether it is right."""
    packing = dense(np.random.default_rng(0), SMALL_EDGE)
    tables = [mapped(packing, kind, seed, TOLERANCE)[0] for seed in range(seeds)]
    values, errors = (
        np.array([one[name] for one in tables]) for name in ("alpha_vs_axial", "alpha_vs_axial_se")
    )
    truth, _ = mapped(packing, kind, 1_000_000, 0.1 * float(np.median(errors)))
    off = np.ravel(values - truth["alpha_vs_axial"])
    share, ratio = covered(off, np.ravel(errors), 0.0)
    print(f"scan {kind}: covered {share:.1%}, scatter/error {ratio:.3f}", flush=True)
    return is_right(share)


def main() -> int:
    """How many coverages lie outside."""
    given = asked(
        __doc__, samples=100, seeds=400, kinds=KINDS, media=MEDIA, only=["sample", "scan"]
    )
    right = []
    for kind in given.kinds:
        if "sample" in given.only:
            right += [of_samples(medium, kind, given.samples) for medium in given.media]
        if "scan" in given.only:
            right.append(of_scans(kind, given.seeds))
    return right.count(False)


if __name__ == "__main__":
    sys.exit(bool(main()))
