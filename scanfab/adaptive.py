"""An auto scan: more replicates, or more directions, until every variant meets the tolerance."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np

from scanfab.directions import direction_rule
from scanfab.errors import ScanfabWarning
from scanfab.fabric.void import void_fabric
from scanfab.plan import Plan
from scanfab.scan import ScanSums, Solids, is_affordable, scan_lines
from scanfab.settings import Settings

__all__ = ["scan_to_tolerance"]

# an auto scan that has not met its tolerance by then stops and says so
MAX_REPLICATES = 16_384
MAX_DIRECTIONS = 3_000
# a round multiplies the work by this at most: early estimates of the error are uncertain
GROWTH = 4.0
# fraction of the directions of a replicate that may keep no segment before lines are set closer
MOST_EMPTY = 0.005


def scan_to_tolerance(solids: Solids, plan: Plan, settings: Settings) -> tuple[ScanSums, Plan]:
    """
    Scan one frame as planned, and where the plan is ``auto``, on until the tolerance holds.

    Returns
    -------
    ScanSums
        Of all replicates.
    Plan
        With the rule and the spacing of each replicate as they were in the end.
    """
    sums: ScanSums | None = None
    start, stop = 0, plan.replicates
    while True:
        batch = scan_lines(
            solids,
            plan.rule,
            spacing=plan.spacing,
            cutoff=plan.cutoff,
            variants=settings.variants,
            replicates=range(start, stop),
            seed=settings.seed,
            workers=settings.workers,
        )
        sums = batch if sums is None else ScanSums.concatenate([sums, batch])
        if not plan.auto:
            return sums, plan
        if start == 0 and plan.auto == "replicates" and _too_few_lines(sums, settings):
            finer = replace(plan, spacing=0.5 * plan.spacing)
            if is_affordable(solids, finer.spacing):
                plan, sums = finer, None
                continue
        factor = min(1.05 * _missing_work(sums, plan, settings), GROWTH)
        if factor <= 1.0:
            return sums, plan
        if plan.auto == "replicates" and stop < MAX_REPLICATES:
            start, stop = stop, min(math.ceil(factor * stop), MAX_REPLICATES)
        elif plan.auto == "directions" and len(plan.rule) < MAX_DIRECTIONS:
            more = direction_rule(str(math.ceil(factor * len(plan.rule))))
            plan, sums = replace(plan, rule=more), None
        else:
            _warn_of_missed_tolerance(factor, settings)
            return sums, plan


def _too_few_lines(sums: ScanSums, settings: Settings) -> bool:
    """Whether some variant keeps segments, but none in too many directions of a replicate."""
    for variant in settings.variants:
        _, segments = sums.kept(variant)
        if segments.any() and np.mean(segments == 0) > MOST_EMPTY:
            return True
    return False


def _missing_work(sums: ScanSums, plan: Plan, settings: Settings) -> float:
    """By what factor the lines must grow for every variant to meet the tolerance; <= 1: done."""
    factor = 0.0
    for variant in settings.variants:
        length, segments = sums.kept(variant)
        fabric = void_fabric(sums.axes, plan.rule.weights, length, segments)
        if fabric is not None:
            error = fabric.axial_error(settings.axis)
            factor = max(factor, 0.0 if error is None else (error / settings.tolerance) ** 2)
        elif segments.any() and plan.auto == "replicates" and sums.replicates < 256:
            # a direction without any segment may still get one
            factor = GROWTH
    return factor


def _warn_of_missed_tolerance(factor: float, settings: Settings) -> None:
    warnings.warn(
        f"the scan stopped before the tolerance {settings.tolerance:g} was met: see "
        f"alpha_vs_axial_se; {factor:.1f} times the lines, or more, would be needed",
        ScanfabWarning,
        stacklevel=3,
    )
