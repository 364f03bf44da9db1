"""How many lines are enough: ladders of spacing, directions, cut-off and RV for one frame."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from scanfab.base.errors import PackingError, SettingsError
from scanfab.base.note import Note, tell
from scanfab.base.option import options_of, refuse_unknown
from scanfab.base.spelling import counted
from scanfab.io.options import parse_frames
from scanfab.packing.sample import Sample
from scanfab.pipeline.calibration_ladders import (
    PAPER_CUTOFF,
    PAPER_SPACING,
    StepRow,
    first_steady,
    judged,
    largest,
    sentence,
    sentence_of_recommended,
)
from scanfab.pipeline.frame import OTHER_CUTOFFS, compute_frame
from scanfab.pipeline.frames import Frames, Source
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.plan import Plan, make_plan
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.tolerance import TOLERANCE_MISSED, missing_work
from scanfab.pipeline.values import Length
from scanfab.pipeline.window_settings import SHAPES, settings_in
from scanfab.scan.directions import DirectionRule, direction_rule, rule_of, usual_rule
from scanfab.table.plots import Plots
from scanfab.table.row import Row

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
        lines = [*self.findings, f"recommended: {options}"]
        return "\n  ".join([f"Calibration: {steps}", *lines])

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
    """One frame, and the plan-making first frame of its series."""

    def __init__(self, source: Source, settings: Settings, frame: int) -> None:
        if len(settings.rvs) > 1:
            raise SettingsError(
                f"rv: expected one size, as a calibration has RVs of its own beside it, found "
                f"{len(settings.rvs)}"
            )
        frames = Frames(source, replace(settings, frames=parse_frames(frame, "frame")))
        self.name = frames.name
        self.first, self.number, self.sample = _samples(frames)
        self.space = self.first.packing.space
        self.settings = settings_in(settings, self.space)
        tell(self.sample.doubts_of_escaped(), f"frame {self.number}")
        radius = self.first.packing.radius[self.first.grains]
        self.r_min = float(radius.min())
        # what it says concerns every step
        tell(make_plan(self.settings, self.first).notes)

    def all(self) -> Calibration:
        """The ladders, what they say, and what follows."""
        cutoffs = list(self._cutoffs())
        with_fabric = {row.variant for row in cutoffs if row.alpha_vs_axial is not None}
        for variant in self.settings.variants:
            if variant not in with_fabric:
                grains = self.sample.number(self.sample.grains)
                raise SettingsError(
                    f"frame {self.number}: no cut-off leaves a void fabric in variant {variant}: "
                    f"the sample ({grains} grains) is too small for it, "
                    f"there is no void, or all its grains are rattlers"
                )
        ladders = {
            "spacing": judged(self._spacings()),
            "directions": judged(self._directions()),
            "cutoff": cutoffs,
            "rv": judged(self._rvs(), self.space.dimension) if self._rv_has_sizes else [],
        }
        sample = largest(cutoffs, "alpha_vs_axial_sample_se", self._default_cutoff())
        target = max(self.settings.tolerance, OF_SAMPLE * (sample or 0.0))
        best, options = self._recommended(ladders["spacing"], ladders["directions"], target)
        findings = [sentence(ladder, rows) for ladder, rows in ladders.items() if rows]
        if self.settings.needs_window and not self._rv_has_sizes:
            findings.append(
                f"RV: its size is left out, as {self.settings.rv_shape} draws it: to try others, "
                f"scale that surface"
            )
        findings.append(sentence_of_recommended(best, target, sample))
        rows = [row for ladder in ladders.values() for row in ladder]
        return Calibration((*rows, *best), tuple(findings), options)

    def _default_cutoff(self) -> float:
        cutoff = self.settings.cutoff
        return cutoff.value if cutoff.unit == "rmin" else PAPER_CUTOFF

    def _spacings(self) -> Iterator[StepRow]:
        rule = self.settings.directions or usual_rule(self.space)
        for value in SPACINGS:
            step = replace(self.settings, spacing=Length(value, "rmin"), directions=rule)
            yield from self._step("spacing", value, step)

    def _directions(self) -> Iterator[StepRow]:
        spacing = self.settings.spacing or Length(FIXED_SPACING, "rmin")
        for rule in self._ladder_of_rules():
            step = replace(self.settings, spacing=spacing, directions=rule)
            yield from self._step("directions", len(rule), step)

    def _ladder_of_rules(self) -> list[DirectionRule]:
        if self.space.is_plane:
            return [rule_of(count, self.space) for count in STEPS]
        return [direction_rule(f"lebedev:{degree}") for degree in DEGREES]

    def _cutoffs(self) -> Iterator[StepRow]:
        cutoffs = tuple(Length(value, "rmin") for value in CUTOFFS)
        yield from self._step("cutoff", None, replace(self.settings, cutoffs=cutoffs))

    @property
    def _rv_has_sizes(self) -> bool:
        """Whether there is an RV, and not one that a file draws."""
        return self.settings.needs_window and self.settings.rv_shape in SHAPES

    def _rvs(self) -> Iterator[StepRow]:
        variants = "".join(variant for variant in self.settings.variants if variant in "cd")
        for value in RV_FRACTIONS:
            step = replace(self.settings, rv=value, rv_radius=None, rv_size=(), variants=variants)
            yield from self._step("rv", value, step)

    def _step(self, ladder: str, value: float | None, settings: Settings) -> Iterator[StepRow]:
        """The rows of one step; none if its settings do not fit the sample."""
        try:
            yield from self._measured(ladder, value, settings)[0]
        except SettingsError as error:
            if ladder == "cutoff":
                raise
            tell([Note("step_left_out", f"{ladder} {value:g} left out: {error}")])

    def _measured(
        self, ladder: str, value: float | None, settings: Settings
    ) -> tuple[list[StepRow], Measurement]:
        """The rows of one step, and what they were made from."""
        begun = time.perf_counter()
        plan = make_plan(settings, self.first)
        self._check_budget(ladder, plan)
        result = compute_frame(self.sample, plan, number=self.number, source=self.name)
        seconds = time.perf_counter() - begun
        LOGGER.info("%s %s: %.2g s", ladder, "" if value is None else f"{value:g}", seconds)
        rows = [
            self._row(row, ladder, value, plan, seconds, _told(result.notes, row.variant))
            for row in result.rows
        ]
        return rows, result.measurements[0]

    def _check_budget(self, ladder: str, plan: Plan) -> None:
        """Refuse a step of fixed lines that would cut more chords than allowed."""
        shadow = self.space.shadow(self.sample.packing.radius[self.sample.grains])
        chords = self.space.lines(shadow, plan.spacing) * plan.replicates * len(plan.rule)
        if ladder in ("spacing", "directions") and chords > self.settings.max_chords:
            raise SettingsError(
                f"it would cut {chords:.2g} chords from the grains, more than `max_chords` "
                f"{self.settings.max_chords:g}"
            )

    def _row(
        self,
        row: Row,
        ladder: str,
        value: float | None,
        plan: Plan,
        seconds: float,
        note: str,
    ) -> StepRow:
        if value is None:
            assert row.cutoff is not None
            value = round(row.cutoff / self.r_min, 9)
        return StepRow(
            source=self.name,
            frame=self.number,
            ladder=ladder,
            value=value,
            variant=row.variant,
            rule=plan.rule.name,
            degree=plan.rule.degree,
            rule_bias=plan.rule.bias,
            directions=row.directions,
            replicates=row.replicates,
            spacing=row.spacing,
            cutoff=row.cutoff,
            rv_radius=plan.window.radius if plan.window and row.variant in "cd" else None,
            segments=row.segments,
            seconds=seconds,
            mean_length=row.mean_length,
            alpha_vs_axial=row.alpha_vs_axial,
            alpha_vs_axial_se=row.alpha_vs_axial_se,
            alpha_vs_axial_sample_se=row.alpha_vs_axial_sample_se,
            steady=None,
            note=note,
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
        for _ in range(ROUNDS):
            settings = replace(
                self.settings,
                spacing=Length(spacing, "rmin"),
                directions=rule,
                tolerance=target,
                seed=self.settings.seed + 1,
            )
            found = self._measured("recommended", len(rule), settings)[1]
            missing = missing_work(found.sums, found.plan, settings.variants)
            if missing <= 1.0:
                break
            wanted = len(rule) * missing
            if wanted > MOST_DIRECTIONS:
                spacing = float(f"{spacing * self.space.apart(MOST_DIRECTIONS / wanted):.2g}")
            rule = rule_of(min(math.ceil(wanted), MOST_DIRECTIONS), self.space)
        settings = replace(self.settings, spacing=Length(spacing, "rmin"), directions=rule)
        rows = self._measured("recommended", len(rule), settings)[0]
        return rows, {"spacing": f"{spacing:g}rmin", "directions": rule.name}


def _samples(frames: Frames) -> tuple[Sample, int, Sample]:
    """The first frame that has grains, and the wanted one with its number."""
    number, one = frames.one()
    first = frames.first()
    if first is None:
        raise PackingError("no frame has any grains: there is nothing to calibrate")
    tell(frames.notes(*first[1:]))
    sample = first[2] if first[0] == number else frames.sample(number, one)
    if sample is None or not sample.grains.any():
        raise PackingError(f"frame {number} has no grains: choose another frame")
    return first[2], number, sample


def _told(notes: Iterable[Note], variant: str) -> str:
    """What the scan itself said of one row."""
    # errors at other cut-offs than the scan's stand in the rows themselves
    own = [one for one in notes if variant in one.variants and one.code != OTHER_CUTOFFS]
    whole = [one for one in notes if one.code == TOLERANCE_MISSED]
    return "; ".join(one.text for one in (*own, *whole))
