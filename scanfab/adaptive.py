"""An auto scan: more replicates, or more directions, until every variant meets the tolerance."""

from __future__ import annotations

import math
import warnings

from scanfab.directions import DirectionRule, direction_rule
from scanfab.errors import ScanfabWarning
from scanfab.fabric.void import void_fabric
from scanfab.plan import Plan
from scanfab.scan import ScanSums, Solids, scan_lines
from scanfab.settings import Settings

__all__ = ["scan_to_tolerance"]

# an auto scan that has not met its tolerance by then stops and says so
MAX_REPLICATES = 16_384
MAX_DIRECTIONS = 3_000
# a round multiplies the work by this at most: early estimates of the error are uncertain
GROWTH = 4.0


def scan_to_tolerance(
    solids: Solids, plan: Plan, settings: Settings
) -> tuple[ScanSums, DirectionRule]:
    """
    Scan one frame as planned, and where the plan is ``auto``, on until the tolerance holds.

    Returns
    -------
    ScanSums
        Of all replicates.
    DirectionRule
        The rule of each replicate.
    """
    rule, start, sums = plan.rule, 0, None
    stop = plan.replicates
    while True:
        batch = scan_lines(
            solids,
            rule,
            spacing=plan.spacing,
            cutoff=plan.cutoff,
            variants=settings.variants,
            replicates=range(start, stop),
            seed=settings.seed,
            workers=settings.workers,
        )
        sums = batch if sums is None else ScanSums.concatenate([sums, batch])
        if not plan.auto:
            return sums, rule
        factor = _missing_work(sums, rule, settings)
        if factor <= 1.0:
            return sums, rule
        factor = min(1.05 * factor, GROWTH)
        if plan.auto == "replicates":
            start, stop = stop, min(math.ceil(factor * stop), MAX_REPLICATES)
            exhausted = start == stop
        else:
            exhausted = len(rule) >= MAX_DIRECTIONS
            if not exhausted:
                rule, sums = direction_rule(str(math.ceil(factor * len(rule)))), None
        if exhausted:
            _warn_of_missed_tolerance(factor, settings)
            return sums or batch, rule


def _missing_work(sums: ScanSums, rule: DirectionRule, settings: Settings) -> float:
    """By what factor the lines must grow for every variant to meet the tolerance; <= 1: done."""
    factor = 0.0
    for variant in settings.variants:
        length, segments = sums.kept(variant)
        fabric = void_fabric(sums.axes, rule.weights, length, segments)
        if fabric is None:
            # nothing kept in some direction: no use going on for ever
            found = segments.sum() > 0 and sums.replicates < 256
            factor = max(factor, GROWTH if found else 0.0)
        elif (error := fabric.axial_error(settings.axis)) is not None:
            factor = max(factor, (error / settings.tolerance) ** 2)
    return factor


def _warn_of_missed_tolerance(factor: float, settings: Settings) -> None:
    warnings.warn(
        f"the scan stopped before the tolerance {settings.tolerance:g} was met: see "
        f"alpha_vs_axial_se; {factor:.1f} times the lines, or more, would be needed",
        ScanfabWarning,
        stacklevel=3,
    )
