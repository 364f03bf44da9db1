"""An auto scan: closer lines, more directions, more replicates, until the tolerance holds."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.note import Note
from scanfab.base.spelling import spelt_apart, spelt_time
from scanfab.fabric.void import void_fabric
from scanfab.pipeline.plan import NOISE, Plan
from scanfab.scan.directions import design_of, rule_of
from scanfab.scan.following import FollowedTooFarError
from scanfab.scan.scan import ScanSums, scan_lines
from scanfab.scan.solids import Solids, is_affordable, most_lines

LOGGER = logging.getLogger("scanfab")

TOLERANCE_MISSED = "tolerance_missed"
"""The code of a note: an auto scan ended before its tolerance was met."""

# beyond these there is more overhead than scan
MAX_REPLICATES = 16_384
MAX_DIRECTIONS = 3_000
# where so much is missing, a scan with closer lines and a finer rule, which need fewer segments in
# all, is worth to start afresh; the rule grows by the other factor at most
AFRESH_FROM, FINER_UP_TO = 2.0, 8.0
# a round multiplies the work by this at most: early estimates of the error are uncertain
GROWTH = 4.0
# and by this at least, so that there is something to do for several threads
SMALLEST_ROUND = 1.1
# By how much the expected error must be below the tolerance: then that of the replicates, which is
# reported, is seldom above it, and a scan that goes on until it is below picks few errors that are
# too small by chance. Where replicates can be added this makes the error surer; where their number
# R is fixed it stays uncertain by a part of 1/√(2(R - 1)), so many of which the margin leaves.
MARGIN, SIGMAS = 1.1, 2.5
# of the smallest radius: directions that are empty with lines so close cannot be filled
CLOSEST = 0.05
# fraction of the directions of a replicate that may keep no segment before lines are set closer
MOST_EMPTY = 0.005
# a variant of fewer of its grains than the one is hardly a packing any more: it may ask for the
# other times as many lines as the variants beside it, but not hold them back
FEW_KEPT, HELD_BACK = 0.1, 10.0
# behind these "at least" is all that can be said of the lines that are missing
FAR_MORE = 1000


class Errors(NamedTuple):
    """Standard errors of the axial anisotropy by the scan."""

    reported: float
    """By the scatter of the replicates: what the table says."""
    expected: float
    """Less noisy, to plan by."""


class Goal(Protocol):
    """What is scanned, and what is to meet the tolerance."""

    def scan(
        self, solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
    ) -> Any:
        """Sums, with their ``replicates``, ``chords``, ``steps`` and ``work``."""
        ...

    def concatenate(self, parts: Sequence[Any]) -> Any:
        """All replicates of several such sums."""
        ...

    def errors(self, sums: Any, plan: Plan, variant: str) -> Errors | None:
        """Of one variant; None if it has no fabric."""
        ...

    def empty_share(self, sums: Any, variant: str) -> float:
        """Share of the replicates' axes without a segment; 1 where none has any."""
        ...


class EachVariant:
    """The plain scan: the error of each variant is to meet the tolerance."""

    def scan(
        self, solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
    ) -> ScanSums:
        """As planned."""
        return scan_lines(
            solids,
            plan.rule,
            spacing=plan.spacing,
            cutoff=plan.cutoff,
            variants=plan.variants,
            replicates=replicates,
            seed=plan.seed,
            workers=plan.workers,
            most_steps=most_steps,
        )

    def concatenate(self, parts: Sequence[ScanSums]) -> ScanSums:
        """All replicates."""
        return ScanSums.concatenate(parts)

    def errors(self, sums: ScanSums, plan: Plan, variant: str) -> Errors | None:
        """By the replicates, and about a polynomial."""
        fabric = void_fabric(sums.axes, plan.rule.weights, *sums.kept(variant), plan.space)
        if fabric is None:
            return None
        reported = fabric.axial_error(plan.axis) or 0.0
        expected = fabric.expected_error(plan.axis, plan.rule.degree)
        return Errors(reported, expected or reported)

    def empty_share(self, sums: ScanSums, variant: str) -> float:
        """Of all replicates and axes."""
        return float(np.mean(sums.kept(variant)[1] == 0))


EACH_VARIANT = EachVariant()


def scan_to_tolerance(
    solids: Solids, plan: Plan, where: str = "the frame", goal: Goal = EACH_VARIANT
) -> tuple[Any, Plan, list[Note]]:
    """
    Scan one frame as planned, and where the plan is ``auto``, on until the tolerance holds.

    Progress goes to the logger ``scanfab``, where ``where`` names the frame.

    Returns
    -------
    sums
        Of all replicates, as the goal scans them; without one a ScanSums.
    Plan
        With the rule and the spacing of each replicate as they were in the end.
    list of Note
        What was not reached.
    """
    if not plan.auto:
        every = range(plan.replicates)
        return goal.scan(solids, plan, every, plan.max_chords), plan, []
    plan = _within_budget(plan, solids)
    notes: list[Note] = []
    planned = plan.spacing
    sums: Any = None
    start, stop, spent = 0, plan.replicates, 0.0
    begun = time.perf_counter()
    while True:
        if start == 0:
            batch, plan = _first_round(solids, plan, goal)
        else:
            batch = goal.scan(solids, plan, range(start, stop))
        # a line costs as much as a chord, also if it meets nothing
        lines = most_lines(solids, plan.spacing) * len(plan.rule)
        spent += float(batch.work.sum()) + lines * batch.replicates
        sums = batch if start == 0 else goal.concatenate([sums, batch])
        # as many replicates as the budget allows
        left = (plan.max_chords - spent) / max(float(sums.work.mean()) + lines, 1.0)
        counted = _counted_variants(sums, plan, solids, left, goal)
        missing = missing_work(sums, plan, counted, goal)
        rest = min(missing, plan.max_chords / spent) - 1.0
        if rest > 0.0:
            seconds = rest * (time.perf_counter() - begun)
            _tell_progress(sums, plan, counted, goal, where, seconds)
        better: Plan | None = None
        if start == 0 and plan.spacing <= planned:
            too_few = any(_too_few_lines(sums, name, goal) for name in counted)
            better = _better_plan(plan, missing, solids, too_few, left)
        if better is not None:
            plan, planned = better, better.spacing
            continue
        if missing <= 1.0:
            break
        more = math.ceil(max(min(missing, GROWTH), SMALLEST_ROUND) * stop)
        more = min(more, MAX_REPLICATES, int(stop + left))
        if plan.auto == "directions" or more <= stop:
            notes.append(_missed_tolerance(missing, spent, sums, plan))
            break
        start, stop = stop, more
    return sums, plan, [*notes, *_dropped_variants(sums, plan, counted, goal)]


def _first_round(solids: Solids, plan: Plan, goal: Goal) -> tuple[Any, Plan]:
    """
    Scan the first replicates, with wider lines if following them takes more steps than allowed.

    Only a scan can tell how far lines go through a periodic medium, so one replicate goes ahead,
    and ends when it has used its share.
    """
    every = plan.replicates
    if solids.medium is None:
        return goal.scan(solids, plan, range(every)), plan
    while True:
        try:
            sums = goal.scan(solids, plan, range(1), plan.max_chords / every)
            if every > 1:
                rest = goal.scan(solids, plan, range(1, every), plan.max_chords)
                sums = goal.concatenate([sums, rest])
            return sums, plan
        except FollowedTooFarError:
            wider = 2.0 * plan.spacing
            if plan.auto != "replicates" or wider > _width(solids):
                raise
            plan = replace(plan, spacing=wider)


def _better_plan(
    plan: Plan, missing: float, solids: Solids, too_few_lines: bool, left: float
) -> Plan | None:
    """After the first round, a plan to start afresh with, if that is worth it and affordable."""
    closest = CLOSEST * solids.grain_radius.min(initial=np.inf)
    better = plan
    if plan.auto == "directions":
        better = _with_more_axes(plan, missing)
    elif too_few_lines and 0.5 * plan.spacing > closest:
        better = replace(plan, spacing=0.5 * plan.spacing)
    elif missing >= AFRESH_FROM and len(solids.grain_radius):
        better = _with_closer_lines(plan, missing, solids)
    growth = plan.space.lines(len(better.rule) / len(plan.rule), better.spacing / plan.spacing)
    affordable = growth * plan.replicates <= left and is_affordable(solids, better.spacing)
    return better if growth > 1.0 and affordable else None


def _with_more_axes(plan: Plan, missing: float) -> Plan:
    """The plan with a rule of so many more axes, up to a limit."""
    if missing <= 1.0 or len(plan.rule) >= MAX_DIRECTIONS:
        return plan
    axes = math.ceil(min(missing, GROWTH) * len(plan.rule))
    return replace(plan, rule=rule_of(axes, plan.space))


def _with_closer_lines(plan: Plan, missing: float, solids: Solids) -> Plan:
    """The plan with lines as close as is of use, and a finer rule for what is missing then."""
    noise = NOISE[plan.space.dimension]
    power = plan.space.dimension - 1.0 + noise.growth
    closest = min(noise.close * float(solids.grain_radius.mean()), plan.spacing)
    spacing = max(plan.spacing / missing ** (1.0 / power), closest)
    missing /= (plan.spacing / spacing) ** power
    plan = replace(plan, spacing=spacing)
    if plan.rule_is_asked_for or missing <= 1.0:
        return plan
    axes = math.ceil(min(missing, FINER_UP_TO) * len(plan.rule))
    return replace(plan, rule=design_of(axes, plan.space))


def _within_budget(plan: Plan, solids: Solids) -> Plan:
    """The plan, with wider lines if its first round alone would cut more chords than allowed."""
    chords = solids.chords(plan.spacing) + most_lines(solids, plan.spacing)
    chords *= len(plan.rule) * plan.replicates
    if chords <= plan.max_chords:
        return plan
    if plan.auto == "replicates":
        wider = plan.spacing * plan.space.apart(chords / plan.max_chords)
        if wider > _width(solids):
            raise SettingsError(
                f"max_chords: {plan.max_chords:g} leave less than one line for each of "
                f"{plan.replicates} replicates of {len(plan.rule)} directions: allow more, or take "
                f"fewer `directions`"
            )
        return replace(plan, spacing=wider)
    raise SettingsError(
        f"spacing: {plan.replicates} replicates of {len(plan.rule)} directions would cut "
        f"{chords:.2g} chords from the grains, more than `max_chords` {plan.max_chords:g}: "
        f"choose a wider spacing"
    )


def _width(solids: Solids) -> float:
    """Of the window, or of the sample (the cell) where there is none."""
    if solids.window is not None:
        return 2.0 * solids.reach
    if solids.medium is not None:
        return float(np.linalg.norm(solids.medium.vectors, axis=1).max())
    low = (solids.position - solids.radius[:, None]).min(axis=0)
    high = (solids.position + solids.radius[:, None]).max(axis=0)
    return float((high - low).max())


def _counted_variants(sums: Any, plan: Plan, solids: Solids, left: float, goal: Goal) -> str:
    """
    The variants that the scan goes on for.

    One that keeps but a few grains does not hold back the others, nor one whose tolerance is out of
    reach of the budget, which allows so many more replicates; such are all variants, or none.
    """
    missing = {name: missing_work(sums, plan, name, goal) for name in plan.variants}
    few = [name for name in missing if _kept_grains(solids, name) < FEW_KEPT]
    usual = max((missing[name] for name in missing if name not in few), default=math.inf)
    held_back = {
        name
        for name in few
        if missing[name] > HELD_BACK * usual
        or (usual < math.inf and _too_few_lines(sums, name, goal))
    }
    # closer lines tell more than more of them; and early estimates of the error are uncertain
    growth = 1.0 + NOISE[plan.space.dimension].growth / (plan.space.dimension - 1)
    reach = GROWTH * (1.0 + left / sums.replicates) ** growth
    near = "".join(n for n in missing if n not in held_back and missing[n] <= reach)
    return near or plan.variants


def _kept_grains(solids: Solids, variant: str) -> float:
    """The fraction of its window's grains that are solid in a variant."""
    if variant in "ac":
        return 1.0
    removed = solids.removed if solids.medium is None else solids.medium.removed
    if variant == "d":
        assert solids.window is not None
        removed = solids.removed[solids.window.contains(solids.position)]
    return 1.0 - float(removed.mean()) if len(removed) else 1.0


def _too_few_lines(sums: Any, variant: str, goal: Goal) -> bool:
    """Whether a variant keeps segments, but none in too many directions of a replicate."""
    return MOST_EMPTY < goal.empty_share(sums, variant) < 1.0


def missing_work(sums: Any, plan: Plan, variants: str, goal: Goal = EACH_VARIANT) -> float:
    """
    By what factor the lines must grow for these variants to meet the tolerance; <= 1: done.

    The one rule for all scans that are chosen by their error: ``auto`` ones, and those that a
    calibration recommends.
    """
    margin = MARGIN
    if plan.auto != "replicates" and sums.replicates > 1:
        margin = 1.0 + SIGMAS / math.sqrt(2.0 * (sums.replicates - 1))
    missing = expected = 0.0
    for variant in variants:
        errors = goal.errors(sums, plan, variant)
        if errors is not None:
            missing = max(missing, (errors.reported / plan.tolerance) ** 2)
            expected = max(expected, (margin * errors.expected / plan.tolerance) ** 2)
            continue
        has_segments = goal.empty_share(sums, variant) < 1.0
        if has_segments and plan.auto == "replicates" and sums.replicates < 256:
            # a direction without any segment may still get one
            return GROWTH
    # the replicates' own scatter is what is reported, but too noisy to decide alone: a scan that
    # stops at the first low value of it would claim too small an error
    if max(missing, expected) <= 1.0:
        return 1.0
    return max(expected, min(missing, 1.1))


def _missed_tolerance(factor: float, spent: float, sums: Any, plan: Plan) -> Note:
    more = "at least " if factor >= GROWTH else ""
    if factor > FAR_MORE:
        more, factor = "more than ", FAR_MORE
    why = ""
    if sums.steps.sum() > sums.chords.sum():
        why = (
            f"; {sums.steps.sum() / sums.work.sum():.0%} of the work was to follow long void "
            f"segments through the images of the cell: is it too large, or periodic where the "
            f"sample is not (`cell`, `periodic`)?"
        )
    text = (
        f"the scan stopped after {spent:.2g} chords before the tolerance {plan.tolerance:g} was "
        f"met: alpha_vs_axial_se is what it reached; {more}{factor:.4g} times as many lines would "
        f"be needed (`max_chords`, `tolerance`){why}"
    )
    return Note(TOLERANCE_MISSED, text)


def _dropped_variants(sums: Any, plan: Plan, counted: str, goal: Goal) -> Iterator[Note]:
    """What variants have reached that the scan did not go on for."""
    for name in plan.variants:
        errors = goal.errors(sums, plan, name)
        error = math.inf if errors is None else errors.reported
        if name in counted or error <= plan.tolerance:
            continue
        reached, tolerance = spelt_apart(error, plan.tolerance)
        said = f"alpha_vs_axial_se is {reached}, above the tolerance {tolerance}"
        text = (
            f"{said if errors else 'there is no void fabric yet'}: it keeps few grains, or would "
            f'need far more lines than the others (`variants="{name}"` scans it alone)'
        )
        yield Note("variant_dropped", text, (name,))


def _tell_progress(
    sums: Any, plan: Plan, counted: str, goal: Goal, where: str, seconds: float
) -> None:
    """The largest error so far, and about how long the rest of the scan will take."""
    if not LOGGER.isEnabledFor(logging.INFO):
        return
    every = [goal.errors(sums, plan, name) for name in counted]
    errors = [one.reported for one in every if one is not None]
    worst, tolerance = spelt_apart(max(errors, default=math.inf), plan.tolerance)
    LOGGER.info("%s: error %s of %s, about %s", where, worst, tolerance, spelt_time(seconds))
