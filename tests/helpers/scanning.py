"""Scans for tests: along given axes, with random shifts of the lines, as estimates with errors."""

from typing import NamedTuple

import numpy as np

from scanfab.base.arrays import concatenated
from scanfab.base.convex import Convex
from scanfab.base.shapes import sphere
from scanfab.fabric.void import void_fabric
from scanfab.scan.directions import direction_rule
from scanfab.scan.lines import line_triads
from scanfab.scan.scan import scan_lines, sums_of
from scanfab.scan.solids import Solids
from scanfab.scan.tallies import tally_triads

Z = np.array([[0.0, 0.0, 1.0]])


class Estimate(NamedTuple):
    """Values and their standard errors, from the scatter of independent samples."""

    value: np.ndarray
    error: np.ndarray

    def agrees(self, expected, within=1e-3):
        """Within 4 standard errors, and within a fraction of the expected value."""
        off = np.abs(self.value - expected)
        return np.all(off < 4 * self.error) and np.all(off < within * np.abs(expected))


def solids_of(spheres, window=0.0, removed=None):
    """Spheres about a window, as a scan takes them: a region, or the radius of a sphere, or 0."""
    none = np.zeros(len(spheres.radius), bool)
    if not isinstance(window, Convex):
        window = sphere(window) if window else None
    return Solids(spheres.position, spheres.radius, none if removed is None else removed, window)


def scan_triads(solids, triads, offsets, spacing, cutoff, variants="abcd"):
    """Scan along given line triads, with given shifts of the lines, as one replicate."""
    tallies = tally_triads(solids, triads, offsets, spacing, cutoff, variants)
    return sums_of(triads[None], tallies[None], variants, solids.edge)


def scan_along(solids, axes, spacing, cutoff=0.0, replicates=16, seed=0, variants="c"):
    """Scan along the same axes in every replicate: only the lines are shifted."""
    random = np.random.default_rng(seed)
    triads = line_triads(np.asarray(axes, dtype=float))
    words = spacing, cutoff, variants
    shifts = random.random((replicates, len(triads), 2))
    return concatenated([scan_triads(solids, triads, one, *words) for one in shifts])


def ratio(length, segments):
    """Σ length / Σ segments over the samples (first axis), error by the delta method."""
    value = length.sum(axis=0) / segments.sum(axis=0)
    residual = (length - value * segments) / segments.mean(axis=0)
    return Estimate(value, residual.std(axis=0, ddof=1) / np.sqrt(len(length)))


def mean_lengths(sums, variant):
    """ℓ(n) of each axis of :func:`scan_along`."""
    return ratio(*sums.kept(variant))


def fabric(solids, rule="design:9", variant="c", **options):
    """The void fabric of a scan with turned directions."""
    rule = direction_rule(rule)
    sums = scan_lines(solids, rule, variants=variant, **options)
    return void_fabric(sums.axes, rule.weights, *sums.kept(variant))
