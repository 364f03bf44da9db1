"""Auto scans: add closer lines, directions or replicates until the tolerance is met."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from scanfab.base.arrays import concatenated
from scanfab.base.errors import Note, SettingsError
from scanfab.base.spelling import spelt_apart, spelt_time
from scanfab.fabric.void import void_fabric
from scanfab.pipeline.plan import NOISE, Plan
from scanfab.pipeline.settings import MAX_CHORDS
from scanfab.scan.directions import design_of, rule_of
from scanfab.scan.scan import ScanSums, scan_lines
from scanfab.scan.solids import MAX_LINES, Solids, most_lines
from scanfab.scan.tallies import FollowedTooFarError

LOGGER = logging.getLogger("scanfab")

TOLERANCE_MISSED = "tolerance_missed"
"""Code of the note that an auto scan ended before its tolerance was met."""

# larger numbers would cost more overhead than scanning
MAX_REPLICATES, MAX_DIRECTIONS = 16_384, 3_000
# With closer lines and a finer rule, fewer segments suffice than with more replicates. So a scan
# starts again with both if it needs AFRESH_FROM times as many lines or more. The number of axes of
# its rule grows by FINER_UP_TO at most.
AFRESH_FROM, FINER_UP_TO = 2.0, 8.0
# A round multiplies the work by at most GROWTH, because early estimates of the error are uncertain,
# and by at least SMALLEST_ROUND, so that all threads have work.
GROWTH, SMALLEST_ROUND = 4.0, 1.1
# The expected error must be smaller than the tolerance by a margin. Then the reported error, from
# the replicates, seldom exceeds the tolerance, and the scan seldom ends at an error that is too
# small by chance. The margin is the factor MARGIN if replicates can be added, which makes the error
# more certain. For a fixed number R of replicates the error has the relative uncertainty
# 1/√(2(R - 1)), and the margin is 1 plus SIGMAS times this.
MARGIN, SIGMAS = 1.1, 2.5
# in smallest radii: a direction that is empty at this spacing stays empty with closer lines
CLOSEST = 0.05
# lines are set closer if a larger fraction of the axes of a replicate keeps no segment
MOST_EMPTY = 0.005
# without rattlers, what is left of a sample with a larger fraction of them is hardly a packing
MOST_REMOVED = 0.9


class Errors(NamedTuple):
    """Standard errors of the axial anisotropy due to the scan; infinite without a void fabric."""

    reported: float
    """Error from the scatter of the replicates, as in the table."""
    expected: float
    """Less noisy error for planning."""
    empty: float
    """Fraction of the axes of all replicates that keep no segment."""

    def over(self, aim: float) -> Errors:
        """The errors relative to the error that a scan aims at."""
        return Errors(self.reported / aim, self.expected / aim, self.empty)


def scan_variants(
    solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
) -> ScanSums:
    """Scan some replicates; maps use a function of their own, which also sums block by block."""
    return scan_lines(
        solids, plan.rule, spacing=plan.spacing, cutoff=plan.cutoff, variants=plan.variants,
        replicates=replicates, seed=plan.settings.seed, workers=plan.workers,
        most_steps=most_steps,
    )  # fmt: skip


def variant_errors(sums: ScanSums, plan: Plan, variant: str) -> Errors:
    """Errors of a variant from the scatter of replicates, and from the fit of a polynomial."""
    length, segments = sums.kept(variant)
    empty = float(np.mean(segments == 0))
    fabric = void_fabric(sums.axes, plan.rule.weights, length, segments, plan.space)
    if fabric is None:
        return Errors(math.inf, math.inf, empty)
    reported = fabric.axial_error(plan.settings.axis) or 0.0
    expected = fabric.expected_error(plan.settings.axis, plan.rule.degree)
    return Errors(reported, expected or reported, empty)


def missing_work(errors: Iterable[Errors], plan: Plan, replicates: int) -> float:
    """
    Factor by which the number of lines must grow to meet the tolerance; 1 if it is met.

    ``errors`` are relative to the tolerance. Auto scans and calibrations use the same rule.
    """
    margin = MARGIN
    if plan.auto != "replicates" and replicates > 1:
        margin = 1.0 + SIGMAS / math.sqrt(2.0 * (replicates - 1))
    missing = expected = 0.0
    for error in errors:
        if math.isfinite(error.reported):
            missing = max(missing, error.reported**2)
            expected = max(expected, (margin * error.expected) ** 2)
        elif error.empty < 1.0 and plan.auto == "replicates" and replicates < 256:
            # more replicates may find segments in directions that have none yet
            return GROWTH
    # The table reports the error from the scatter of replicates. It is too noisy to decide alone:
    # a scan that ended at its first low value would report too small an error.
    if max(missing, expected) <= 1.0:
        return 1.0
    return max(expected, min(missing, SMALLEST_ROUND))


def scan_to_tolerance(
    solids: Solids,
    plan: Plan,
    aims: Mapping[str, float],
    where: str,
    scan: Callable[..., Any] = scan_variants,
    errors_of: Callable[..., Errors] = variant_errors,
) -> tuple[Any, Plan, list[Note]]:
    """
    Scan one frame as planned; an auto scan continues until the tolerance is met.

    ``aims`` holds the tolerance of each variant. Progress is written to the logger ``scanfab``;
    ``where`` names the frame there. ``scan`` and ``errors_of`` say what is summed and which error
    of a variant must meet the tolerance.

    Returns
    -------
    sums
        Sums of all replicates, as ``scan`` returns them.
    Plan
        The plan with the final rule and the final spacing of each replicate.
    list of Note
        Notes on tolerances that were not met.
    """
    if not plan.auto:
        return scan(solids, plan, range(plan.replicates), MAX_CHORDS), plan, []
    auto = _AutoScan(solids, _within_budget(plan, solids), aims, scan, errors_of)
    notes = auto.run(where)
    return auto.sums, auto.plan, notes


@dataclass
class _AutoScan:
    """A scan that adds replicates, round by round, until its tolerance is met."""

    solids: Solids
    plan: Plan
    aims: Mapping[str, float]
    """The tolerance of each variant."""
    scan: Callable[..., Any]
    errors_of: Callable[..., Errors]
    sums: Any = None
    errors: dict[str, Errors] = field(default_factory=dict)
    """Errors of each variant."""
    spent: float = 0.0
    """Chords cut so far; each line counts as one more chord, even if it meets nothing."""
    left: float = 0.0
    """Number of further replicates that the budget allows."""

    def run(self, where: str) -> list[Note]:
        """Scan until the tolerance is met or nothing can be added; return notes on what failed."""
        planned, begun = self.plan.spacing, time.perf_counter()
        start, stop = 0, self.plan.replicates
        while True:
            self._add_round(start, stop)
            counted = self._counted()
            missing = self._missing(counted)
            rest = min(missing, self.plan.max_chords / self.spent) - 1.0
            if rest > 0.0:
                seconds = spelt_time(rest * (time.perf_counter() - begun))
                worst = max(counted, key=lambda name: self.errors[name].reported / self.aims[name])
                reached, tolerance = spelt_apart(self.errors[worst].reported, self.aims[worst])
                LOGGER.info("%s: error %s of %s, about %s", where, reached, tolerance, seconds)
            # a better plan is of no use if lines already had to be wider than planned
            is_first = start == 0 and self.plan.spacing <= planned
            if is_first and (better := self._better_plan(missing, counted)) is not None:
                self.plan, planned = better, better.spacing
                continue
            more = math.ceil(max(min(missing, GROWTH), SMALLEST_ROUND) * stop)
            more = int(min(more, MAX_REPLICATES, stop + self.left))
            if missing <= 1.0 or self.plan.auto == "directions" or more <= stop:
                return list(self._notes())
            start, stop = stop, more

    def _add_round(self, start: int, stop: int) -> None:
        """Scan some replicates and add their sums; the first round starts with new sums."""
        if start == 0:
            batch = self.sums = self._first_round()
        else:
            batch = self.scan(self.solids, self.plan, range(start, stop))
            self.sums = concatenated([self.sums, batch])
        plan = self.plan
        lines = most_lines(self.solids, plan.spacing) * len(plan.rule)
        self.spent += float(batch.work.sum()) + lines * batch.replicates
        each = float(self.sums.work.mean()) + lines
        self.left = (plan.max_chords - self.spent) / max(each, 1.0)
        self.errors = {name: self.errors_of(self.sums, plan, name) for name in plan.variants}

    def _first_round(self) -> Any:
        """
        Scan the first replicates, with wider lines if they take more steps than allowed.

        Only a scan can tell how far lines run through a periodic medium. So one replicate is
        scanned first, and stops when it has used its share of the steps.
        """
        replicates, most = self.plan.replicates, self.plan.max_chords
        if self.solids.medium is None:
            return self.scan(self.solids, self.plan, range(replicates))
        while True:
            try:
                first = self.scan(self.solids, self.plan, range(1), most / replicates)
                rest = self.scan(self.solids, self.plan, range(1, replicates), most)
                return concatenated([first, rest])
            except FollowedTooFarError:
                wider = 2.0 * self.plan.spacing
                if self.plan.auto != "replicates" or self.solids.chords(wider) < 1.0:
                    raise
                self.plan = replace(self.plan, spacing=wider)

    def _missing(self, variants: str) -> float:
        errors = [self.errors[name].over(self.aims[name]) for name in variants]
        return missing_work(errors, self.plan, self.sums.replicates)

    def _counted(self) -> str:
        """
        The variants whose errors decide when the scan ends.

        A variant whose tolerance the budget cannot reach does not decide, nor does one that keeps
        few grains, so that the others need not wait for it. If no variant remains, all decide.
        """
        solids, variants = self.solids, self.plan.variants
        removed = solids.removed if solids.medium is None else solids.medium.removed
        if len(removed) and removed.mean() > MOST_REMOVED:
            variants = "".join(name for name in variants if name in "ac") or variants
        # closer lines reduce the error more than further replicates do; and early estimates of the
        # error are uncertain, hence the factor GROWTH
        across = self.plan.space.dimension - 1
        growth = 1.0 + NOISE[across + 1].growth / across
        reach = GROWTH * (1.0 + self.left / self.sums.replicates) ** growth
        return "".join(name for name in variants if self._missing(name) <= reach) or variants

    def _better_plan(self, missing: float, counted: str) -> Plan | None:
        """A better plan to start again with after the first round; None if it does not pay."""
        plan = better = self.plan
        space, radius = plan.space, self.solids.grain_radius
        is_patchy = any(MOST_EMPTY < self.errors[name].empty < 1.0 for name in counted)
        if plan.auto == "directions":
            if missing > 1.0 and len(plan.rule) < MAX_DIRECTIONS:
                axes = math.ceil(min(missing, GROWTH) * len(plan.rule))
                better = replace(plan, rule=rule_of(axes, space))
        elif is_patchy and 0.5 * plan.spacing > CLOSEST * radius.min(initial=np.inf):
            better = replace(plan, spacing=0.5 * plan.spacing)
        elif missing >= AFRESH_FROM and len(radius):
            noise = NOISE[space.dimension]
            power = space.dimension - 1.0 + noise.growth
            closest = min(noise.close * float(radius.mean()), plan.spacing)
            spacing = max(plan.spacing / missing ** (1.0 / power), closest)
            better = replace(plan, spacing=spacing)
            # if closer lines do not suffice, directions are added too
            missing /= (plan.spacing / spacing) ** power
            if missing > 1.0 and plan.settings.directions is None:
                axes = math.ceil(min(missing, FINER_UP_TO) * len(plan.rule))
                better = replace(better, rule=design_of(axes, space))
        growth = space.lines(len(better.rule) / len(plan.rule), better.spacing / plan.spacing)
        affordable = growth * plan.replicates <= self.left
        affordable = affordable and most_lines(self.solids, better.spacing) <= MAX_LINES
        return better if growth > 1.0 and affordable else None

    def _notes(self) -> Iterator[Note]:
        """A note for each variant that missed its tolerance: what it reached, why, what to do."""
        steps, work = float(self.sums.steps.sum()), float(self.sums.work.sum())
        for name, errors in self.errors.items():
            if (missing := self._missing(name)) <= 1.0 or errors.reported <= self.aims[name]:
                continue
            text = "there is no void fabric yet"
            if math.isfinite(errors.reported):
                reached, tolerance = spelt_apart(errors.reported, self.aims[name])
                text = f"alpha_vs_axial_se is {reached}, where the tolerance is {tolerance}"
            # not 6.9e+02 but 690
            times = f"{float(f'{missing:.2g}'):g} times"
            text += (
                f": the scan stopped after {self.spent:.2g} chords, and about {times} as many "
                f"lines would be needed: choose a larger `tolerance` or `max_chords`"
            )
            if 2 * steps > work:
                text += (
                    f"; {steps / work:.0%} of the work was to follow long void segments through "
                    f'images of the cell, as along a free surface: `variants="cd"` measures the '
                    f"RV alone; or is the cell too large, or periodic where the sample is not "
                    f"(`cell`, `periodic`)?"
                )
            yield Note(TOLERANCE_MISSED, text, (name,))


def _within_budget(plan: Plan, solids: Solids) -> Plan:
    """The plan, with wider lines if its first round would cut more chords than allowed."""
    axes = len(plan.rule) * plan.replicates
    chords = axes * (solids.chords(plan.spacing) + most_lines(solids, plan.spacing))
    if chords <= plan.max_chords:
        return plan
    # lines that are wider apart still make a chord for each axis
    if plan.auto == "replicates" and axes <= plan.max_chords:
        return replace(plan, spacing=plan.spacing * plan.space.apart(chords / plan.max_chords))
    least, wider = (axes, "") if plan.auto == "replicates" else (chords, "a wider `spacing` or ")
    raise SettingsError(
        f"max_chords: expected at least {math.ceil(least)}, the chords of {plan.replicates} "
        f"replicates, found {plan.max_chords:g}: choose {wider}fewer `directions`"
    )
