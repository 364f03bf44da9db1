"""How many lines are enough: one frame scanned with finer and finer settings, by ladders."""

from __future__ import annotations

import logging
import math
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import groupby
from typing import Annotated, Any

from scanfab.base.column import LENGTH
from scanfab.base.errors import Note, PackingError, SettingsError, tell
from scanfab.base.option import options_of, refuse_unknown
from scanfab.base.spelling import counted
from scanfab.io.options import parse_frames
from scanfab.pipeline.frame import OTHER_CUTOFFS, compute_frame
from scanfab.pipeline.frames import Frames, Source
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.plan import make_plan
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.tolerance import TOLERANCE_MISSED, Goal, missing_work
from scanfab.pipeline.values import SHAPES, Length
from scanfab.pipeline.window_settings import settings_in
from scanfab.scan.directions import direction_rule, rule_of, usual_rule
from scanfab.table.plots import Plots
from scanfab.table.row import Record

LOGGER = logging.getLogger("scanfab")

# of the 2017 paper, in r_min
PAPER_SPACING, PAPER_CUTOFF = 0.1, 1.0
# in r_min, down to the spacing of the paper
SPACINGS = (4.0, 2.0, 1.0, 0.5, 0.2, PAPER_SPACING)
# of the ladder of directions, in r_min: 16 replicates with lines r_min apart
FIXED_SPACING = 0.25
DEGREES = (5, 9, 11, 17, 23, 31, 41)
# the same in a plane: numbers of equal steps
STEPS = (3, 5, 8, 16, 32, 64, 128)
CUTOFFS = tuple(0.25 * k for k in range(13))
# fractions of half the smallest extent
RV_FRACTIONS = (0.4, 0.5, 0.6, 0.67, 0.7, 0.8)
# the scan's error as a fraction of the sample's own: together they are 3 % above the latter
OF_SAMPLE = 0.25
# most directions to recommend, and how often recommended settings are tried and refined
MOST_DIRECTIONS, ROUNDS = 2905, 5
# probability that two steps of a ladder differ by chance alone, and degrees of freedom of the
# difference of two values with standard errors of 16 replicates each
CHANCE, FREEDOM = 0.05, 30
PAPER = {"spacing": " (the paper: 0.1)", "rv": " (the paper: 0.67 to 0.7)"}


@dataclass(frozen=True, kw_only=True, slots=True)
class StepRow(Record):
    """One step of a ladder for one variant; lengths in the dump's unit."""

    source: Annotated[str, "the series as given"]
    frame: Annotated[int, "index in the series, from 0"]
    ladder: Annotated[str, "what is changed: spacing, directions, cutoff, rv; or recommended"]
    value: Annotated[
        float, "spacing or cut-off in r_min, number of directions, RV over half the smallest extent"
    ]
    variant: Annotated[str, "as in the fabric table"]
    rule: Annotated[str, "the direction rule"]
    degree: Annotated[int | None, "of the polynomials that the rule integrates exactly"]
    rule_bias: Annotated[float, "alpha_vs that the rule gives an isotropic sample"]
    directions: Annotated[int | None, "axes of the rule, in each replicate"]
    replicates: Annotated[int | None, "number of replicates"]
    spacing: Annotated[float | None, "between lines of one direction, all replicates", LENGTH]
    cutoff: Annotated[float | None, "shortest void segment kept", LENGTH]
    rv_radius: Annotated[float | None, "radius of the ball that holds the RV; a, b: empty", LENGTH]
    segments: Annotated[int | None, "void segments kept"]
    seconds: Annotated[float, "time of the step, all variants (and all cut-offs) together", "s"]
    mean_length: Annotated[float | None, "mean length of the kept segments", LENGTH]
    alpha_vs_axial: Annotated[float | None, "signed anisotropy of the void fabric along the axis"]
    alpha_vs_axial_se: Annotated[float | None, "its standard error from the scan"]
    alpha_vs_axial_sample_se: Annotated[float | None, "its standard error from the sample"]
    steady: Annotated[
        int | None,
        "1 if this step and all later ones differ by no more than chance makes of their standard "
        "errors (of the scan; for rv also of the sample), else 0; empty for a cut-off, on which "
        "alpha_vs depends by definition",
    ]
    note: Annotated[str, "what makes the step doubtful"]


@dataclass(frozen=True)
class Calibration:
    """
    What :func:`calibrate` finds; ``Table(found.rows)`` shows all steps.

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
    >>> from scanfab import Calibration
    >>> Calibration((), (), {"spacing": "0.25rmin"})
    Calibration: 0 steps of variants
      recommended: spacing='0.25rmin'
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
        With recommended settings: the widest spacing and the fewest directions from which nothing
        changes any more, and then as many directions as bring the scan's error below a quarter of
        the sample's own (or to the tolerance, if that is larger).

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
    if settings.lists_gaps or len(settings.rvs) > 1:
        raise SettingsError("calibrate: its ladders take neither cutoffs, moment nor several rv")
    one = _OneFrame(source, settings, frame)
    settings, cutoffs = one.settings, one.cutoffs()
    spacings, directions, rvs = (one.ladder(name) for name in ("spacing", "directions", "rv"))
    ladders = {"spacing": spacings, "directions": directions, "cutoff": cutoffs, "rv": rvs}
    cutoff = settings.cutoff.value if settings.cutoff.unit == "rmin" else PAPER_CUTOFF
    at_cutoff = [row for row in cutoffs if row.value == cutoff] or cutoffs
    sample = _largest(at_cutoff, "alpha_vs_axial_sample_se")
    target = max(settings.tolerance, OF_SAMPLE * (sample or 0.0))
    best, recommended = one.recommended(spacings, directions, target)
    findings = [_finding(name, rows) for name, rows in ladders.items() if rows]
    reached, own = (
        "unknown" if error is None else f"{error:.2g}"
        for error in (_largest(best, "alpha_vs_axial_se"), sample)
    )
    findings.append(
        f"recommended: scan's error {reached} (wanted {target:.2g}; the sample's own is {own}) "
        f"in {best[0].seconds:.2g} s"
    )
    rows = [row for ladder in ladders.values() for row in ladder]
    return Calibration((*rows, *best), tuple(findings), recommended)


class _OneFrame:
    """One frame, scanned with one choice of settings after the other."""

    def __init__(self, source: Source, settings: Settings, frame: int) -> None:
        frames = Frames(source, replace(settings, frames=parse_frames(frame, "frame")))
        self.number, wanted = frames.one()
        # the first frame of the series that has grains makes the plan
        first = frames.first()
        if first is None:
            raise PackingError("no frame has any grains: there is nothing to calibrate")
        number, readable, self.first = first
        tell(frames.notes(readable, self.first))
        sample = self.first if number == self.number else frames.sample(self.number, wanted)
        if sample is None or not sample.grains.any():
            raise PackingError(f"frame {self.number} has no grains: choose another frame")
        self.name, self.sample, self.space = frames.name, sample, self.first.packing.space
        self.settings = settings_in(settings, self.space)
        tell(sample.doubts_of_escaped(), f"frame {self.number}")
        # these notes concern every step
        tell(make_plan(self.settings, self.first).notes)

    def ladder(self, name: str) -> list[StepRow]:
        """The rows of a ladder, without the steps whose settings do not fit the sample."""
        settings, space = self.settings, self.space
        steps: dict[float, dict[str, Any]] = {}
        if name == "spacing":
            rule = settings.directions or usual_rule(space)
            for value in SPACINGS:
                steps[value] = {"spacing": Length(value, "rmin"), "directions": rule}
        elif name == "directions":
            spacing = settings.spacing or Length(FIXED_SPACING, "rmin")
            rules = [direction_rule(f"lebedev:{degree}") for degree in DEGREES]
            if space.is_plane:
                rules = [rule_of(count, space) for count in STEPS]
            steps = {len(rule): {"spacing": spacing, "directions": rule} for rule in rules}
        elif settings.needs_window and settings.rv_shape in SHAPES:
            # a surface that a file draws is an RV of one size
            variants = "".join(variant for variant in settings.variants if variant in "cd")
            words = {"rv_radius": None, "rv_size": (), "variants": variants}
            steps = {value: {"rv": value, **words} for value in RV_FRACTIONS}
        rows: list[StepRow] = []
        for value, changed in steps.items():
            try:
                rows += self.measured(name, value, replace(settings, **changed))[0]
            except SettingsError as error:
                tell([Note("step_left_out", f"{name} {value:g} left out: {error}")])
        return judged(rows, space.dimension)

    def cutoffs(self) -> list[StepRow]:
        """One scan for all cut-offs; SettingsError if a variant has no void fabric at any."""
        lengths = tuple(Length(value, "rmin") for value in CUTOFFS)
        rows, _ = self.measured("cutoff", None, replace(self.settings, cutoffs=lengths))
        for variant in self.settings.variants:
            if all(row.alpha_vs_axial is None for row in rows if row.variant == variant):
                raise SettingsError(
                    f"frame {self.number}: no cut-off leaves a void fabric in variant {variant}: "
                    f"its grains are too few, or rattlers, or there is no void"
                )
        return rows

    def measured(
        self, ladder: str, value: float | None, settings: Settings
    ) -> tuple[list[StepRow], Measurement]:
        """The rows of one step, and their measurement; without a value each row has its cut-off."""
        begun = time.perf_counter()
        plan = make_plan(settings, self.first)
        shadow = self.space.shadow(self.sample.packing.radius[self.sample.grains])
        chords = self.space.lines(shadow, plan.spacing) * plan.replicates * len(plan.rule)
        if ladder in ("spacing", "directions") and chords > settings.max_chords:
            raise SettingsError(
                f"it would cut {chords:.2g} chords from the grains, more than `max_chords` "
                f"{settings.max_chords:g}"
            )
        result = compute_frame(self.sample, plan, number=self.number, source=self.name)
        seconds = time.perf_counter() - begun
        LOGGER.info("%s %s: %.2g s", ladder, "" if value is None else f"{value:g}", seconds)
        r_min = float(self.first.packing.radius[self.first.grains].min())
        rows, window = [], plan.window
        for row in result.rows:
            # errors at other cut-offs than the scan's stand in the rows themselves
            own = [n for n in result.notes if row.variant in n.variants and n.code != OTHER_CUTOFFS]
            whole = [one for one in result.notes if one.code == TOLERANCE_MISSED]
            step = StepRow(
                **{one.name: row[one.name] for one in fields(StepRow) if one.name in row},
                ladder=ladder,
                value=round(row.cutoff / r_min, 9) if value is None else value,
                rule=plan.rule.name,
                degree=plan.rule.degree,
                rule_bias=plan.rule.bias,
                rv_radius=window.radius if window and row.variant in "cd" else None,
                seconds=seconds,
                steady=None,
                note="; ".join(one.text for one in (*own, *whole)),
            )
            rows.append(step)
        return rows, result.measurements[0]

    def recommended(
        self, spacings: list[StepRow], directions: list[StepRow], target: float
    ) -> tuple[list[StepRow], dict[str, str]]:
        """
        Steady spacing and directions, and more of the latter until the error is surely met.

        They are chosen along other lines than those that tell what they reach: whoever repeats the
        scan with lines of their own must not find a larger error.
        """
        spacing = min(first_steady(spacings) or PAPER_SPACING, FIXED_SPACING)
        rule = rule_of(int(first_steady(directions) or len(usual_rule(self.space))), self.space)
        other_lines = replace(self.settings, tolerance=target, seed=self.settings.seed + 1)
        for _ in range(ROUNDS):
            trial = replace(other_lines, spacing=Length(spacing, "rmin"), directions=rule)
            _, found = self.measured("recommended", len(rule), trial)
            errors = [Goal().errors(found.sums, found.plan, one) for one in found.plan.variants]
            missing = missing_work(errors, found.plan, found.sums.replicates)
            if missing <= 1.0:
                break
            wanted = len(rule) * missing
            if wanted > MOST_DIRECTIONS:
                spacing = float(f"{spacing * self.space.apart(MOST_DIRECTIONS / wanted):.2g}")
            rule = rule_of(min(math.ceil(wanted), MOST_DIRECTIONS), self.space)
        best = replace(self.settings, spacing=Length(spacing, "rmin"), directions=rule)
        rows, _ = self.measured("recommended", len(rule), best)
        return rows, {"spacing": f"{spacing:g}rmin", "directions": rule.name}


def judged(rows: Sequence[StepRow], dimension: int = 3) -> list[StepRow]:
    """The rows of a ladder with ``steady`` filled in, variant by variant."""
    from scipy.special import stdtrit

    # by how many standard errors steps may differ by chance, given all pairs of a variant's
    pairs = sum(math.comb(count, 2) for count in Counter(row.variant for row in rows).values())
    most = float(stdtrit(FREEDOM, 1.0 - 0.5 * CHANCE / max(pairs, 1)))
    found: list[StepRow] = []
    for row in reversed(rows):
        later = [one for one in found if one.variant == row.variant]
        is_sound = None not in (row.alpha_vs_axial, row.alpha_vs_axial_se) and not row.note
        agree = all(one.steady and _agree(row, one, most, dimension) for one in later)
        found.append(replace(row, steady=int(is_sound and agree)))
    return found[::-1]


def _agree(one: StepRow, other: StepRow, most: float, dimension: int) -> bool:
    """
    Whether two values differ by no more than so many standard errors of their difference.

    Of two RVs one lies in the other, and they have the grains of the smaller one in common. The
    variance of a mean over grains falls with their number, so the sample's part in the variance of
    the difference is the difference of the variances; both follow from the larger RV's, which is
    the better known.
    """
    if one.alpha_vs_axial is None or other.alpha_vs_axial is None:
        return False
    nested = 0.0
    if one.ladder == "rv":
        small, large = sorted((one, other), key=lambda row: row.rv_radius or 0.0)
        more = ((large.rv_radius or 0.0) / (small.rv_radius or 1.0)) ** dimension
        nested = (large.alpha_vs_axial_sample_se or 0.0) * math.sqrt(max(more - 1.0, 0.0))
    error = math.hypot(one.alpha_vs_axial_se or 0.0, other.alpha_vs_axial_se or 0.0, nested)
    return abs(one.alpha_vs_axial - other.alpha_vs_axial) <= most * error


def first_steady(rows: Sequence[StepRow]) -> float | None:
    """
    The first value of a ladder at which all variants are steady; None if there is none.

    The last one alone has nothing to agree with.
    """
    steps = [list(step) for _, step in groupby(rows, key=lambda row: row.value)]
    return next((step[0].value for step in steps[:-1] if all(row.steady for row in step)), None)


def _largest(rows: Sequence[StepRow], name: str) -> float | None:
    return max((row[name] for row in rows if row[name] is not None), default=None)


def _finding(ladder: str, rows: list[StepRow]) -> str:
    """What the rows of a ladder show, in one sentence."""
    if ladder != "cutoff":
        steady = first_steady(rows)
        said = "no step agrees with all later ones"
        if steady is not None:
            said = f"from {steady:g} on nothing changes within the errors"
        return f"{ladder}: {said}{PAPER.get(ladder, '')}"
    variant = rows[0].variant
    own = {row.value: row.alpha_vs_axial or 0.0 for row in rows if row.variant == variant}
    best = max(own, key=lambda value: abs(own[value]))
    said = (
        f"cut-off: it decides what is measured; in {variant} the anisotropy is largest "
        f"({own[best]:.2g}) at {best:g} r_min"
    )
    paper = own.get(PAPER_CUTOFF)
    if paper:
        said += f"; at the paper's 1 r_min it is {paper / own[best]:.0%} of that"
    return said
