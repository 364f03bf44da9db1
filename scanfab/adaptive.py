"""An auto scan: more replicates, or more directions, until every variant meets the tolerance."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np

from scanfab.directions import direction_rule
from scanfab.errors import ScanfabWarning, SettingsError
from scanfab.fabric.void import void_fabric
from scanfab.plan import Plan
from scanfab.scan import ScanSums, Solids, is_affordable, scan_lines
from scanfab.settings import Settings

__all__ = ["scan_to_tolerance"]

# beyond these there is more overhead than scan
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
    if plan.auto:
        plan = _within_budget(plan, solids, settings)
    sums: ScanSums | None = None
    start, stop, spent = 0, plan.replicates, 0
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
        spent += int(batch.chords.sum())
        sums = batch if sums is None else ScanSums.concatenate([sums, batch])
        if not plan.auto:
            return sums, plan
        left = (settings.max_chords - spent) / max(float(sums.chords.mean()), 1.0)
        if start == 0 and plan.auto == "replicates" and _too_few_lines(sums, settings):
            finer = replace(plan, spacing=0.5 * plan.spacing)
            if is_affordable(solids, finer.spacing) and left > 4 * stop:
                plan, sums = finer, None
                continue
        factor = min(_missing_work(sums, plan, settings), GROWTH)
        if factor <= 1.0:
            return sums, plan
        if plan.auto == "replicates":
            start, stop = stop, int(min(math.ceil(factor * stop), MAX_REPLICATES, stop + left))
            if stop > start:
                continue
        elif factor * stop <= left and len(plan.rule) < MAX_DIRECTIONS:
            more = direction_rule(str(math.ceil(factor * len(plan.rule))))
            plan, sums = replace(plan, rule=more), None
            continue
        _warn_of_missed_tolerance(factor, spent, settings)
        return sums, plan


def _within_budget(plan: Plan, solids: Solids, settings: Settings) -> Plan:
    """The plan, with wider lines if its first round alone would cut more chords than allowed."""
    areas = float(np.pi * np.sum(solids.radius**2))
    chords = areas / plan.spacing**2 * len(plan.rule) * plan.replicates
    if chords <= settings.max_chords:
        return plan
    if plan.auto == "replicates":
        wider = plan.spacing * math.sqrt(chords / settings.max_chords)
        if wider > _width(solids):
            raise SettingsError(
                f"max-chords: {settings.max_chords:g} leave less than one line for each of "
                f"{plan.replicates} replicates of {len(plan.rule)} directions: allow more, or take "
                f"fewer --directions"
            )
        return replace(plan, spacing=wider)
    raise SettingsError(
        f"spacing: {plan.replicates} replicates of {len(plan.rule)} directions would cut "
        f"{chords:.2g} chords from the grains, more than --max-chords {settings.max_chords:g}: "
        f"choose a wider spacing"
    )


def _width(solids: Solids) -> float:
    """Of the window, or of the sample where there is none."""
    if solids.window_radius > 0:
        return 2.0 * solids.window_radius
    low = (solids.position - solids.radius[:, None]).min(axis=0)
    high = (solids.position + solids.radius[:, None]).max(axis=0)
    return float((high - low).max())


def _too_few_lines(sums: ScanSums, settings: Settings) -> bool:
    """Whether some variant keeps segments, but none in too many directions of a replicate."""
    for variant in settings.variants:
        _, segments = sums.kept(variant)
        if segments.any() and np.mean(segments == 0) > MOST_EMPTY:
            return True
    return False


def _missing_work(sums: ScanSums, plan: Plan, settings: Settings) -> float:
    """By what factor the lines must grow for every variant to meet the tolerance; <= 1: done."""
    missing = expected = 0.0
    for variant in settings.variants:
        length, segments = sums.kept(variant)
        fabric = void_fabric(sums.axes, plan.rule.weights, length, segments)
        if fabric is not None:
            error = fabric.axial_error(settings.axis) or 0.0
            missing = max(missing, (error / settings.tolerance) ** 2)
            error = fabric.expected_error(settings.axis) or error
            expected = max(expected, (error / settings.tolerance) ** 2)
        elif segments.any() and plan.auto == "replicates" and sums.replicates < 256:
            # a direction without any segment may still get one
            return GROWTH
    # the replicates' own scatter is what is reported, but too noisy to decide alone: a scan that
    # stops at the first low value of it would claim too small an error
    if max(missing, expected) <= 1.0:
        return 1.0
    return max(1.05 * expected, min(missing, 1.1))


def _warn_of_missed_tolerance(factor: float, spent: int, settings: Settings) -> None:
    more = "at least " if factor >= GROWTH else ""
    warnings.warn(
        f"the scan stopped after {spent:.2g} chords before the tolerance {settings.tolerance:g} "
        f"was met: alpha_vs_axial_se is what it reached; {more}{factor:.1f} times as many lines "
        f"would be needed (--max-chords, --tolerance)",
        ScanfabWarning,
        stacklevel=3,
    )
