"""How many lines are enough: ladders of spacing, directions, cut-off and RV for one frame."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from scanfab.base.errors import Note, PackingError, SettingsError, tell
from scanfab.base.option import options_of, refuse_unknown
from scanfab.base.spelling import counted
from scanfab.io.options import parse_frames
from scanfab.pipeline.calibration_ladders import (
    PAPER_CUTOFF,
    PAPER_SPACING,
    SENTENCES,
    StepRow,
    first_steady,
    judged,
    largest,
    sentence_of_recommended,
)
from scanfab.pipeline.frame import OTHER_CUTOFFS, compute_frame
from scanfab.pipeline.frames import Frames, Source
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.plan import Plan, make_plan
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.tolerance import EACH_VARIANT, TOLERANCE_MISSED, missing_work
from scanfab.pipeline.values import Length
from scanfab.pipeline.window_settings import SHAPES, settings_in
from scanfab.scan.directions import direction_rule, rule_of, usual_rule
from scanfab.table.plots import Plots

LOGGER = logging.getLogger("scanfab")

# in r_min, down to the spacing of the 2017 paper
SPACINGS = (4.0, 2.0, 1.0, 0.5, 0.2, 0.1)
# of the ladder of directions, in r_min: 16 replicates with lines r_min apart
FIXED_SPACING = 0.25
DEGREES = (5, 9, 11, 17, 23, 31, 41)
# the same in a plane: numbers of equal steps
STEPS = (3, 5, 8, 16, 32, 64, 128)
CUTOFFS = tuple(0.25 * k for k in range(13))
# fractions of half the smallest extent
RV_FRACTIONS = (0.4, 0.5, 0.6, 0.67, 0.7, 0.8)
# what a scan may add to the sample's own error: a quarter of it adds 3 %
OF_SAMPLE = 0.25
MOST_DIRECTIONS = 2905
ROUNDS = 5


@dataclass(frozen=True)
class Calibration:
    """
    What :func:`calibrate` finds.

    ``Table(found.rows)`` shows all steps.

    Attributes
    ----------
    rows : tuple of StepRow
        All steps of all ladders, then the recommended settings.
    findings : tuple of str
        One sentence for each ladder, and one for the recommended settings.
    options : dict
        The recommended settings by the names of their options.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import Packing, Table, calibrate
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    >>> packing = Packing(grid, 0.5)
    >>> found = calibrate(packing, variants="c", tolerance=0.01, rv=0.6, contact_tolerance=1e-4)
    >>> sorted(found.options)
    ['directions', 'spacing']
    >>> len(Table(found.rows)) == len(found.rows)
    True
    """

    rows: tuple[StepRow, ...]
    findings: tuple[str, ...]
    options: dict[str, str]

    def __repr__(self) -> str:
        steps = counted(len(self.rows), "step of a variant", "steps of variants")
        options = ", ".join(f"{name}={value!r}" for name, value in self.options.items())
        lines = [f"Calibration: {steps}", *self.findings, f"recommended: {options}"]
        return "\n  ".join(lines)

    @property
    def plot(self) -> Plots:
        """Its figure: ``found.plot.calibration(ax=ax, ladder="cutoff")``."""
        return Plots(self.rows, "calibration")


def calibrate(
    source: Source, *, frame: int = -1, variants: str = "cd", **options: Any
) -> Calibration:
    """
    How the void fabric of one frame changes with the settings of the scan.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        Lengths relative to radii and the RV come from the first frame of the series that has
        grains, as for :func:`scanfab.compute`.
    frame : int, optional
        Which frame, the last by default.
    variants : str, optional
        Letters out of abcd.
    **options
        Those of :func:`scanfab.compute`: ``directions`` are those of the ladder of spacings,
        ``spacing`` that of the ladder of directions; the cut-offs and RVs are scanned to the
        ``tolerance``.

    Returns
    -------
    Calibration
        A row for each step and variant, what they show in words, and recommended settings: the
        widest spacing and the fewest directions from which nothing changes any more, and then as
        many directions as bring the scan's error below a quarter of the sample's own (or to the
        tolerance, if that is larger).

    Raises
    ------
    SettingsError
        If there is no such frame, or no step has a void fabric.
    TypeError
        If there is no such option; names the nearest that there is.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import Packing, calibrate
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    >>> options = {"tolerance": 0.01, "rv": 0.6, "contact_tolerance": 1e-4}
    >>> found = calibrate(Packing(grid, 0.5), variants="c", **options)
    >>> sorted({row.ladder for row in found.rows})
    ['cutoff', 'directions', 'recommended', 'rv', 'spacing']
    """
    refuse_unknown("calibrate", options, [one.name for one in options_of(Settings)])
    settings = Settings(variants=variants, **options)
    if settings.lists_gaps:
        raise SettingsError("calibrate: cutoffs and moment have no meaning for its ladders")
    return _Calibrator(source, settings, frame).all()


class _Calibrator:
    """One frame, and the first frame of its series that has grains, which makes the plan."""

    def __init__(self, source: Source, settings: Settings, frame: int) -> None:
        if len(settings.rvs) > 1:
            raise SettingsError(
                f"rv: expected one size, as a calibration has RVs of its own beside it, found "
                f"{len(settings.rvs)}"
            )
        frames = Frames(source, replace(settings, frames=parse_frames(frame, "frame")))
        self.number, wanted = frames.one()
        first = frames.first()
        if first is None:
            raise PackingError("no frame has any grains: there is nothing to calibrate")
        number, readable, self.first = first
        tell(frames.notes(readable, self.first))
        sample = self.first if number == self.number else frames.sample(self.number, wanted)
        if sample is None or not sample.grains.any():
            raise PackingError(f"frame {self.number} has no grains: choose another frame")
        self.name, self.sample = frames.name, sample
        self.space = self.first.packing.space
        self.settings = settings_in(settings, self.space)
        tell(sample.doubts_of_escaped(), f"frame {self.number}")
        self.r_min = float(self.first.packing.radius[self.first.grains].min())
        # these notes concern every step
        tell(make_plan(self.settings, self.first).notes)

    def all(self) -> Calibration:
        """The ladders, what they say, and what follows."""
        settings = self.settings
        cutoffs = self._cutoffs()
        # a surface that a file draws is an RV without a ladder of sizes
        has_sizes = settings.needs_window and settings.rv_shape in SHAPES
        ladders = {
            "spacing": judged(self._ladder("spacing", self._spacings())),
            "directions": judged(self._ladder("directions", self._directions())),
            "cutoff": cutoffs,
            "rv": judged(self._ladder("rv", self._rvs() if has_sizes else {}), self.space),
        }
        cutoff = settings.cutoff.value if settings.cutoff.unit == "rmin" else PAPER_CUTOFF
        at_cutoff = [row for row in cutoffs if row.value == cutoff] or cutoffs
        sample = largest(at_cutoff, "alpha_vs_axial_sample_se")
        target = max(settings.tolerance, OF_SAMPLE * (sample or 0.0))
        best, options = self._recommended(ladders["spacing"], ladders["directions"], target)
        findings = [SENTENCES[ladder](rows) for ladder, rows in ladders.items() if rows]
        if settings.needs_window and not has_sizes:
            findings.append(
                f"RV: its size is left out, as {settings.rv_shape} draws it: to try others, "
                f"scale that surface"
            )
        findings.append(sentence_of_recommended(best, target, sample))
        rows = [row for ladder in ladders.values() for row in ladder]
        return Calibration((*rows, *best), tuple(findings), options)

    def _spacings(self) -> dict[float, Settings]:
        rule = self.settings.directions or usual_rule(self.space)
        lengths = {value: Length(value, "rmin") for value in SPACINGS}
        return {
            value: replace(self.settings, spacing=length, directions=rule)
            for value, length in lengths.items()
        }

    def _directions(self) -> dict[float, Settings]:
        spacing = self.settings.spacing or Length(FIXED_SPACING, "rmin")
        if self.space.is_plane:
            rules = [rule_of(count, self.space) for count in STEPS]
        else:
            rules = [direction_rule(f"lebedev:{degree}") for degree in DEGREES]
        return {
            len(rule): replace(self.settings, spacing=spacing, directions=rule) for rule in rules
        }

    def _rvs(self) -> dict[float, Settings]:
        variants = "".join(variant for variant in self.settings.variants if variant in "cd")
        words: dict[str, Any] = {"rv_radius": None, "rv_size": (), "variants": variants}
        return {value: replace(self.settings, rv=value, **words) for value in RV_FRACTIONS}

    def _cutoffs(self) -> list[StepRow]:
        """One scan for all cut-offs; SettingsError if a variant has no void fabric at any."""
        lengths = tuple(Length(value, "rmin") for value in CUTOFFS)
        rows, _ = self._measured("cutoff", None, replace(self.settings, cutoffs=lengths))
        with_fabric = {row.variant for row in rows if row.alpha_vs_axial is not None}
        for variant in self.settings.variants:
            if variant not in with_fabric:
                grains = self.sample.number(self.sample.grains)
                raise SettingsError(
                    f"frame {self.number}: no cut-off leaves a void fabric in variant {variant}: "
                    f"the sample ({grains} grains) is too small for it, "
                    f"there is no void, or all its grains are rattlers"
                )
        return rows

    def _ladder(self, ladder: str, steps: Mapping[float, Settings]) -> Iterator[StepRow]:
        """The rows of all steps but those whose settings do not fit the sample."""
        for value, settings in steps.items():
            try:
                rows, _ = self._measured(ladder, value, settings)
            except SettingsError as error:
                tell([Note("step_left_out", f"{ladder} {value:g} left out: {error}")])
            else:
                yield from rows

    def _measured(
        self, ladder: str, value: float | None, settings: Settings
    ) -> tuple[list[StepRow], Measurement]:
        """The rows of one step, and what they were made from; no value: that of each cut-off."""
        begun = time.perf_counter()
        plan = make_plan(settings, self.first)
        if ladder in ("spacing", "directions"):
            self._check_budget(plan)
        result = compute_frame(self.sample, plan, number=self.number, source=self.name)
        seconds = time.perf_counter() - begun
        LOGGER.info("%s %s: %.2g s", ladder, "" if value is None else f"{value:g}", seconds)
        of_step: dict[str, Any] = {
            "ladder": ladder,
            "rule": plan.rule.name,
            "degree": plan.rule.degree,
            "rule_bias": plan.rule.bias,
            "seconds": seconds,
            "steady": None,
        }
        rows = []
        for row in result.rows:
            window = plan.window if row.variant in "cd" else None
            same = {one.name: row[one.name] for one in fields(StepRow) if one.name in row}
            step = StepRow(
                **same,
                **of_step,
                value=round(row.cutoff / self.r_min, 9) if value is None else value,
                rv_radius=window.radius if window else None,
                note=_told(result.notes, row.variant),
            )
            rows.append(step)
        return rows, result.measurements[0]

    def _check_budget(self, plan: Plan) -> None:
        """Refuse a step of fixed lines that would cut more chords than allowed."""
        shadow = self.space.shadow(self.sample.packing.radius[self.sample.grains])
        chords = self.space.lines(shadow, plan.spacing) * plan.replicates * len(plan.rule)
        if chords > self.settings.max_chords:
            raise SettingsError(
                f"it would cut {chords:.2g} chords from the grains, more than `max_chords` "
                f"{self.settings.max_chords:g}"
            )

    def _recommended(
        self, spacings: list[StepRow], directions: list[StepRow], target: float
    ) -> tuple[list[StepRow], dict[str, str]]:
        """
        Steady spacing and directions, and more of the latter until the error is surely met.

        They are chosen along other lines than those that tell what they reach: whoever repeats the
        scan with lines of their own must not find a larger error.
        """
        spacing = min(first_steady(spacings) or PAPER_SPACING, FIXED_SPACING)
        steady = first_steady(directions) or len(usual_rule(self.space))
        rule = rule_of(int(steady), self.space)
        other_lines = replace(self.settings, tolerance=target, seed=self.settings.seed + 1)
        for _ in range(ROUNDS):
            trial = replace(other_lines, spacing=Length(spacing, "rmin"), directions=rule)
            _, found = self._measured("recommended", len(rule), trial)
            sums, plan = found.sums, found.plan
            errors = [EACH_VARIANT.errors(sums, plan, one) for one in plan.variants]
            missing = missing_work(errors, plan, sums.replicates)
            if missing <= 1.0:
                break
            wanted = len(rule) * missing
            if wanted > MOST_DIRECTIONS:
                spacing = float(f"{spacing * self.space.apart(MOST_DIRECTIONS / wanted):.2g}")
            rule = rule_of(min(math.ceil(wanted), MOST_DIRECTIONS), self.space)
        best = replace(self.settings, spacing=Length(spacing, "rmin"), directions=rule)
        rows, _ = self._measured("recommended", len(rule), best)
        return rows, {"spacing": f"{spacing:g}rmin", "directions": rule.name}


def _told(notes: Iterable[Note], variant: str) -> str:
    """What the scan itself said of one row."""
    # errors at other cut-offs than the scan's stand in the rows themselves
    own = [one for one in notes if variant in one.variants and one.code != OTHER_CUTOFFS]
    whole = [one for one in notes if one.code == TOLERANCE_MISSED]
    return "; ".join(one.text for one in (*own, *whole))
