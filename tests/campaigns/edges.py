"""
What counts at a window's surface: three rules against media whose mean length is known.

Usage, from the root of the repository (about ten minutes on one core)::

    python -m tests.campaigns.edges [--packings N] [--centers N] [--only poisson medium]

``poisson``: freely overlapping spheres of radii 0.5 to 1.5 in spherical windows of radius 9, six
largest radii, each of N packings in a periodic cell far wider. ``start`` and ``ends`` must give
c + 1/β, ``clip`` c + A1/(A0 + βA1), and all an anisotropy of 0: within 4 errors, from the scatter
of the packings, which for 3,000 of them are below 2e-3 of the mean length and 3e-4.

``medium``: windows of several radii at N random places of a dense periodic packing, as in the
paper. ``start`` and ``ends`` must give the mean length of the medium, measured without any window,
and ``clip`` that by 1/(ℓ_clip - c) = 1/(ℓ - c) + A0/A1.

The exit code is 0 if nothing is off by more than 4 errors.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable

import numpy as np

from scanfab.base.shapes import sphere
from scanfab.fabric.tensor import axial
from scanfab.packing.cell import Cell
from scanfab.scan.directions import direction_rule
from scanfab.scan.edges import EDGES
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.lines import line_triads
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids, margin_of
from tests.benchmarks.packings import relaxed_cell
from tests.campaigns.frame import asked
from tests.helpers.naive import void_tensor
from tests.helpers.scanning import Estimate, ratio, scan_triads

RULE = direction_rule("lebedev:11")
TRIADS = line_triads(RULE.axes)
CUTOFF, LARGEST = 0.5, 1.5
Z = np.array([0.0, 0.0, 1.0])
Medium = tuple[np.ndarray, np.ndarray, float]
"""Positions and radii in a periodic cube, and its edge."""


def about(center: np.ndarray, window, edge: str, medium: Medium | None = None) -> Solids:
    """A window about a place of a periodic medium, by default the dense packing."""
    position, radius, edge_length = medium or relaxed_cell()
    cell = Cell([edge_length] * 3)
    place, removed = position - center, np.zeros(len(radius), bool)
    grains = CellGrains(place, radius, removed, cell.vectors, np.array(cell.periodic))
    reach = 0.0 if window is None else window.reach + margin_of(grains)
    images, row = cell.images_near_origin(place, radius + reach)
    whole = grains if window is None else None
    return Solids(images, radius[row], removed[row], window, whole, edge=edge, around=grains)


def pooled(sums: Iterable[ScanSums], variant: str) -> tuple[Estimate, Estimate]:
    """Mean length over all directions, and axial anisotropy, over independent samples."""
    kept = [one.kept(variant) for one in sums]
    length = np.array([one[0][0] for one in kept])
    number = np.array([one[1][0] for one in kept], dtype=float)
    mean = ratio(length @ RULE.weights, number @ RULE.weights)
    with np.errstate(invalid="ignore", divide="ignore"):
        each = length / number
    whole = np.isfinite(each).all(axis=1)
    values = [axial(void_tensor(RULE.axes, RULE.weights, one), Z) for one in each[whole]]
    return mean, Estimate(np.mean(values), np.std(values, ddof=1) / np.sqrt(len(values)))


def clipped(mean_length: float, radius: float) -> float:
    """What clipping at a sphere makes of a mean length."""
    a0 = 1 - CUTOFF**2 / (4 * radius**2)
    a1 = 4 / 3 * radius - CUTOFF + CUTOFF**3 / (12 * radius**2)
    return CUTOFF + 1 / (1 / (mean_length - CUTOFF) + a0 / a1)


def told(name: str, found: tuple[Estimate, Estimate], length: float, alpha: float) -> bool:
    """Print a row of a table; whether both numbers are as expected."""
    mean, anisotropy = found
    off = (mean.value - length) / mean.error, (anisotropy.value - alpha) / anisotropy.error
    print(
        f"| {name} | {mean.value:.4f} ± {mean.error:.4f} | {length:.4f} | {off[0]:+.1f} | "
        f"{anisotropy.value:+.5f} ± {anisotropy.error:.5f} | {off[1]:+.1f} |",
        flush=True,
    )
    return bool(np.all(np.abs(off) < 4.0))


def poisson(packings: int) -> bool:
    """Freely overlapping spheres, in a window of six largest radii."""
    density, window, edge_length = 0.2, 6 * LARGEST, 26.0
    beta = density * np.pi * 13 / 12
    right = True

    def sums(seed: int, edge: str) -> ScanSums:
        random = np.random.default_rng([seed, 3])
        count = random.poisson(density * edge_length**3)
        position = edge_length * random.random((count, 3))
        radius = random.uniform(0.5, LARGEST, count)
        solids = about(np.zeros(3), sphere(window), edge, (position, radius, edge_length))
        return scan_triads(solids, TRIADS, random.random((len(RULE), 2)), 1.0, CUTOFF, "c")

    for edge in EDGES:
        found = pooled([sums(seed, edge) for seed in range(packings)], "c")
        length = CUTOFF + 1 / beta
        length = clipped(length, window) if edge == "clip" else length
        right &= told(f"Poisson, R = {window:g}, `{edge}`", found, length, 0.0)
    return right


def of_medium() -> tuple[float, float]:
    """Mean length and axial anisotropy of the dense packing, without a window."""
    solids = about(np.zeros(3), None, "clip")
    every = [
        scan_triads(solids, TRIADS, shift, 0.1, CUTOFF, "a")
        for shift in np.random.default_rng(2).random((20, len(RULE), 2))
    ]
    mean, anisotropy = pooled(every, "a")
    print(f"medium: {mean.value:.5f} ± {mean.error:.5f}, {anisotropy.value:+.6f}", flush=True)
    return float(mean.value), float(anisotropy.value)


def medium(centers: int) -> bool:
    """Windows at random places of a dense periodic packing."""
    (length, alpha), right = of_medium(), True
    edge_length = relaxed_cell()[2]
    for size in (3.0, 4.0, 5.0, 6.0, 8.0):
        for edge in EDGES:
            random, sums = np.random.default_rng(1), []
            for _ in range(centers):
                solids = about(edge_length * random.random(3), sphere(size), edge)
                shifts = random.random((len(RULE), 2))
                sums.append(scan_triads(solids, TRIADS, shifts, 0.5, CUTOFF, "c"))
            found = pooled(sums, "c")
            expected = clipped(length, size) if edge == "clip" else length
            right &= told(f"RV, R = {size:g}, `{edge}`", found, expected, alpha)
    return right


def main() -> int:
    """How many of them are off."""
    kinds = {"poisson": poisson, "medium": medium}
    given = asked(__doc__, packings=3000, centers=400, only=kinds)
    numbers = {"poisson": given.packings, "medium": given.centers}
    return [kinds[name](numbers[name]) for name in given.only].count(False)


if __name__ == "__main__":
    sys.exit(bool(main()))
