"""Calibration: scan one frame with finer and finer settings (ladders) to see what is enough."""

from __future__ import annotations

import logging
import math
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, groupby
from typing import Any

from scanfab.base.column import LENGTH, Column
from scanfab.base.errors import Note, PackingError, SettingsError, tell
from scanfab.base.spelling import counted
from scanfab.io.reader import parse_frames
from scanfab.packing.sample import VARIANTS
from scanfab.pipeline.frame import compute_frame
from scanfab.pipeline.frames import Frames, Source, doubts_of_frame
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.plan import make_plan
from scanfab.pipeline.settings import MAX_CHORDS, OF_SAMPLE, Settings
from scanfab.pipeline.tolerance import missing_work, variant_errors
from scanfab.pipeline.values import SHAPES, Length
from scanfab.scan.directions import direction_rule, rule_of, usual_rule
from scanfab.table.columns import OWN_COLUMNS, row_of
from scanfab.table.plots import Plots
from scanfab.table.row import Row

LOGGER = logging.getLogger("scanfab")

# spacing and cut-off of the 2017 paper, in r_min
PAPER_SPACING, PAPER_CUTOFF = 0.1, 1.0
# ladder of spacings, in r_min, down to the spacing of the paper
SPACINGS = (4.0, 2.0, 1.0, 0.5, 0.2, PAPER_SPACING)
# spacing for the ladder of directions, in r_min: 16 replicates whose lines are r_min apart
FIXED_SPACING = 0.25
# ladder of directions: degrees of Lebedev rules
DEGREES = (5, 9, 11, 17, 23, 31, 41)
# ladder of directions in a plane: numbers of equal angles
STEPS = (3, 5, 8, 16, 32, 64, 128)
CUTOFFS = tuple(0.25 * k for k in range(13))
# ladder of RVs: fractions of half the smallest extent
RV_FRACTIONS = (0.4, 0.5, 0.6, 0.67, 0.7, 0.8)
# most directions to recommend, and number of times that recommended settings are tried and refined
MOST_DIRECTIONS, ROUNDS = 2905, 5
# significance level for a difference between steps of a ladder, and degrees of freedom of the
# difference of two values whose standard errors come from 16 replicates each
CHANCE, FREEDOM = 0.05, 30
PAPER = {"spacing": " (the paper: 0.1)", "rv": " (the paper: 0.67 to 0.7)"}


STEADY = (
    "1 if this step agrees with all later steps within the standard errors (of the scan; for rv "
    "also of the sample), else 0; empty for a cut-off, because alpha_vs depends on it by definition"
)
SIZE = "spacing or cut-off in r_min, number of directions, RV over half the smallest extent"
IN_TABLES = {column.name: column for column in OWN_COLUMNS}
STEP_COLUMNS = (
    IN_TABLES["source"],
    IN_TABLES["frame"],
    Column("ladder", str, "", "what is varied: spacing, directions, cutoff, rv; or recommended"),
    Column("value", float, "", SIZE),
    IN_TABLES["variant"],
    Column("rule", str, "", "the direction rule"),
    Column("degree", int, "", "of the polynomials that the rule integrates exactly"),
    Column("rule_bias", float, "", "alpha_vs that the rule gives for an isotropic sample"),
    *(IN_TABLES[name] for name in ("directions", "replicates", "spacing", "cutoff")),
    Column("rv_radius", float, LENGTH, "radius of the ball that holds the RV; empty for a and b"),
    IN_TABLES["segments"],
    Column("seconds", float, "s", "time of the step for all variants (and all cut-offs)"),
    IN_TABLES["mean_length"],
    *(IN_TABLES[f"alpha_vs_axial{error}"] for error in ("", "_se", "_sample_se")),
    Column("steady", int, "", STEADY),
    Column("note", str, "", "doubts about the step"),
)
"""Columns of a row of :func:`calibrate`: one step of a ladder for one variant."""


@dataclass(frozen=True)
class Calibration:
    """
    The result of :func:`calibrate`; ``Table(found.rows)`` shows all steps.

    Attributes
    ----------
    rows : tuple of Row
        All steps of all ladders, then the recommended settings.
    findings : tuple of str
        One sentence for each ladder, and one for the recommended settings.
    options : dict
        The recommended settings, by option.

    Examples
    --------
    >>> from scanfab import Calibration
    >>> Calibration((), (), {"spacing": "0.25rmin"})
    Calibration: 0 rows
      recommended: spacing='0.25rmin'
    """

    rows: tuple[Row, ...]
    findings: tuple[str, ...]
    options: dict[str, str]

    def __repr__(self) -> str:
        options = ", ".join(f"{name}={value!r}" for name, value in self.options.items())
        rows = counted(len(self.rows), "row")
        lines = [f"Calibration: {rows}", *self.findings, f"recommended: {options}"]
        return "\n  ".join(lines)

    @property
    def plot(self) -> Plots:
        """Figure of the calibration: ``found.plot.calibration(ax=ax, ladder="cutoff")``."""
        return Plots(self.rows, "calibration")


def calibrate(
    source: Source, *, frame: int = -1, variants: str = "cd", **options: Any
) -> Calibration:
    """
    Measure how the void fabric of one frame depends on the settings of the scan.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        The series. Lengths relative to radii, and the RV, come from its first frame that has
        grains, as for :func:`scanfab.compute`.
    frame : int, optional
        Place of the frame in the series, as in ``series[frame]``; default: the last.
    variants : str, optional
        Letters out of abcd.
    **options
        Options of :func:`scanfab.compute`. ``directions`` is used for the ladder of spacings, and
        ``spacing`` for the ladder of directions; cut-offs and RVs are scanned to the ``tolerance``.

    Returns
    -------
    Calibration
        Steps of all ladders, and recommended settings. These start from the fewest directions
        beyond which nothing changes, and from the spacing beyond which nothing changes, but at most
        0.25 rmin. Directions are then added until the error of the scan is below a twentieth of the
        error of the sample, or at the tolerance if that is larger.

    Raises
    ------
    SettingsError
        If there is no such frame, or no step has a void fabric.
    TypeError
        If there is no such option; the message suggests the most similar name.

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
    settings = Settings(variants=variants, **options)
    if settings.lists_gaps or len(settings.rvs) > 1 or settings.frames != slice(None):
        raise SettingsError(
            "calibrate: leave out `cutoffs`, `moment`, `frames` and all but one `rv`"
        )
    # a number, so that the ladders differ in nothing but their steps
    most = settings.max_chords or MAX_CHORDS
    settings = replace(settings, tolerance=settings.aim(), max_chords=most)
    one_frame = _OneFrame(source, settings, frame)
    cutoffs = one_frame.cutoffs()
    spacings, directions, rvs = (one_frame.ladder(name) for name in ("spacing", "directions", "rv"))
    ladders = {"spacing": spacings, "directions": directions, "cutoff": cutoffs, "rv": rvs}
    cutoff = settings.cutoff.value if settings.cutoff.unit == "rmin" else PAPER_CUTOFF
    at_cutoff = [row for row in cutoffs if row.value == cutoff] or cutoffs
    sample = _largest(at_cutoff, "alpha_vs_axial_sample_se")
    target = max(settings.aim(), OF_SAMPLE * (sample or 0.0))
    best, recommended = one_frame.recommended(spacings, directions, target)
    findings = [_finding(name, rows) for name, rows in ladders.items() if rows]
    errors = _largest(best, "alpha_vs_axial_se"), sample
    reached, own = ("unknown" if error is None else f"{error:.2g}" for error in errors)
    findings.append(
        f"recommended: error of the scan {reached} (wanted {target:.2g}; of the sample {own}) "
        f"in {best[0].seconds:.2g} s"
    )
    return Calibration((*chain(*ladders.values()), *best), tuple(findings), recommended)


class _OneFrame:
    """One frame that is scanned repeatedly with different settings."""

    def __init__(self, source: Source, settings: Settings, frame: int) -> None:
        frames = Frames(source, replace(settings, frames=parse_frames("frame", frame)))
        self.number, wanted = frames.one()
        # the first frame of the series that has grains makes the plan
        number, _, self.first = frames.reference()
        sample = self.first if number == self.number else frames.sample(self.number, wanted)
        if sample is None or not sample.grains.any():
            raise PackingError(f"frame {self.number} has no grains: choose another frame")
        self.name, self.sample, self.space = frames.name, sample, self.first.packing.space
        self.settings = settings.in_space(self.space)
        doubts = doubts_of_frame(wanted, sample, self.settings)
        tell(doubts, f"frame {self.number}")
        # these notes hold for every step
        tell(make_plan(self.settings, self.first).notes)

    def ladder(self, name: str) -> list[Row]:
        """Scan the steps of a ladder; skip steps whose settings do not fit the sample."""
        settings, space = self.settings, self.space
        steps: dict[float, dict[str, Any]] = {}
        if name == "spacing":
            rule = settings.directions or usual_rule(space)
            steps = {k: {"spacing": Length(k, "rmin"), "directions": rule} for k in SPACINGS}
        elif name == "directions":
            spacing = settings.spacing or Length(FIXED_SPACING, "rmin")
            rules = [direction_rule(f"lebedev:{degree}") for degree in DEGREES]
            if space.is_plane:
                rules = [rule_of(count, space) for count in STEPS]
            steps = {len(rule): {"spacing": spacing, "directions": rule} for rule in rules}
        elif settings.needs_window and settings.rv_shape in SHAPES:
            # a surface from a file has one size, so it has no ladder
            variants = "".join(variant for variant in settings.variants if variant in "cd")
            words = {"rv_radius": None, "rv_size": None, "variants": variants}
            steps = {value: {"rv": value, **words} for value in RV_FRACTIONS}
        rows: list[Row] = []
        for value, changed in steps.items():
            try:
                rows += self.step(name, value, replace(settings, **changed))[0]
            except SettingsError as error:
                tell([Note("step_left_out", f"{name} {value:g} is skipped: {error}")])
        return judged(rows, space.dimension)

    def cutoffs(self) -> list[Row]:
        """Scan once for all cut-offs; SettingsError if a variant has no void fabric at any."""
        lengths = tuple(Length(value, "rmin") for value in CUTOFFS)
        rows, _ = self.step("cutoff", None, replace(self.settings, cutoffs=lengths))
        for variant in self.settings.variants:
            if all(row.alpha_vs_axial is None for row in rows if row.variant == variant):
                text = f"variant {variant} has no void fabric at any cut-off"
                raise SettingsError(f"frame {self.number}: {text}: it has too few grains or voids")
        return rows

    def step(
        self, ladder: str, value: float | None, settings: Settings
    ) -> tuple[list[Row], Measurement]:
        """Scan one step: its rows and its measurement. Without a value, rows take their cut-off."""
        begun = time.perf_counter()
        plan, sample = make_plan(settings, self.first), self.sample
        # the first variant has the longest lines: a and b meet all grains, c and d those of the RV
        solids = sample.solids(VARIANTS[settings.variants[0]], plan.window)
        shadow = self.space.shadow(sample.packing.radius[solids])
        chords = self.space.lines(shadow, plan.spacing) * plan.replicates * len(plan.rule)
        if ladder in ("spacing", "directions") and chords > settings.budget:
            allowed = f"more than `max_chords` allows ({settings.budget:g})"
            raise SettingsError(f"it would cut {chords:.2g} chords from grains, {allowed}")
        result = compute_frame(sample, plan, number=self.number, source=self.name)
        seconds = time.perf_counter() - begun
        LOGGER.info("%s: %.2g s", ladder if value is None else f"{ladder} {value:g}", seconds)
        r_min = float(self.first.packing.radius[self.first.grains].min())
        rows = []
        for row in result.rows:
            own = [note for note in result.notes if row.variant in note.variants]
            more = {
                "ladder": ladder,
                "value": round(row.cutoff / r_min, 9) if value is None else value,
                "rule": plan.rule.name,
                "degree": plan.rule.degree,
                "rule_bias": plan.rule.bias,
                "rv_radius": plan.window.radius if plan.window and row.variant in "cd" else None,
                "seconds": seconds,
                "note": "; ".join(note.text for note in own),
            }
            rows.append(row_of(STEP_COLUMNS, {**row, **more}))
        return rows, result.measurements[0]

    def recommended(
        self, spacings: list[Row], directions: list[Row], target: float
    ) -> tuple[list[Row], dict[str, str]]:
        """
        Choose steady spacing and directions, and add directions until the error is surely met.

        The choice uses other random lines than the final scan, whose error is reported. Otherwise
        the settings would suit just these lines, and a user would find a larger error.
        """
        # `max_chords` may have skipped the closest steps
        has_all = any(row.value == PAPER_SPACING for row in spacings)
        finest = PAPER_SPACING if has_all else FIXED_SPACING
        spacing = min(first_steady(spacings) or finest, FIXED_SPACING)
        rule = rule_of(int(first_steady(directions) or len(usual_rule(self.space))), self.space)
        other_lines = replace(self.settings, tolerance=target, seed=self.settings.seed + 1)
        for _ in range(ROUNDS):
            trial = replace(other_lines, spacing=Length(spacing, "rmin"), directions=rule)
            _, found = self.step("recommended", len(rule), trial)
            names = found.plan.variants
            errors = [variant_errors(found.sums, found.plan, name).over(target) for name in names]
            missing = missing_work(errors, found.plan, found.sums.replicates)
            if missing <= 1.0:
                break
            wanted = len(rule) * missing
            if wanted > MOST_DIRECTIONS:
                spacing = float(f"{spacing * self.space.apart(MOST_DIRECTIONS / wanted):.2g}")
            rule = rule_of(min(math.ceil(wanted), MOST_DIRECTIONS), self.space)
        best = replace(self.settings, spacing=Length(spacing, "rmin"), directions=rule)
        rows, _ = self.step("recommended", len(rule), best)
        return rows, {"spacing": f"{spacing:g}rmin", "directions": rule.name}


def judged(rows: Sequence[Row], dimension: int = 3) -> list[Row]:
    """Fill in ``steady`` in the rows of a ladder, variant by variant."""
    from scipy.special import stdtrit

    # standard errors by which steps may differ by chance, by Bonferroni's rule for all pairs
    pairs = sum(math.comb(count, 2) for count in Counter(row.variant for row in rows).values())
    most = float(stdtrit(FREEDOM, 1.0 - 0.5 * CHANCE / max(pairs, 1)))
    judged_rows: list[Row] = []
    for row in reversed(rows):
        later = [step for step in judged_rows if step.variant == row.variant]
        is_sound = None not in (row.alpha_vs_axial, row.alpha_vs_axial_se) and not row.note
        is_steady = is_sound and all(
            step.steady and _agree(row, step, most, dimension) for step in later
        )
        judged_rows.append(Row(**{**row, "steady": int(is_steady)}))
    return judged_rows[::-1]


def _agree(row: Row, later: Row, most: float, dimension: int) -> bool:
    """
    Whether two values differ by at most ``most`` standard errors of their difference.

    The smaller of two RVs lies inside the larger, so they share grains. The variance of a mean over
    grains falls with their number. So the sample's part in the variance of the difference is the
    difference of both variances, which follow from the error of the larger RV, as it is better
    known.
    """
    nested = 0.0
    if row.ladder == "rv" and row.rv_radius and later.rv_radius:
        # RVs ascend, so the later one is the larger
        more = (later.rv_radius / row.rv_radius) ** dimension
        nested = (later.alpha_vs_axial_sample_se or 0.0) * math.sqrt(more - 1.0)
    error = math.hypot(row.alpha_vs_axial_se, later.alpha_vs_axial_se, nested)
    return bool(abs(row.alpha_vs_axial - later.alpha_vs_axial) <= most * error)


def first_steady(rows: Sequence[Row]) -> float | None:
    """
    The first value of a ladder at which all variants are steady; None if there is none.

    The last step does not count, because it has no later step to agree with.
    """
    steps = [list(step) for _, step in groupby(rows, key=lambda row: row.value)]
    return next((step[0].value for step in steps[:-1] if all(row.steady for row in step)), None)


def _largest(rows: Sequence[Row], name: str) -> float | None:
    return max((row[name] for row in rows if row[name] is not None), default=None)


def _finding(ladder: str, rows: list[Row]) -> str:
    """Describe the result of a ladder in one sentence."""
    if ladder != "cutoff":
        steady = first_steady(rows)
        text = "no step agrees with all later ones"
        if steady is not None:
            text = f"from {steady:g} on, nothing changes within the errors"
        return f"{ladder}: {text}{PAPER.get(ladder, '')}"
    variant = rows[0].variant
    own = {row.value: row.alpha_vs_axial or 0.0 for row in rows if row.variant == variant}
    best = max(own, key=lambda value: abs(own[value]))
    paper = ", the paper's"
    if best != PAPER_CUTOFF:
        paper = (
            f"; at the paper's 1 r_min it is {own.get(PAPER_CUTOFF, 0.0) / own[best]:.0%} of that"
        )
    largest = f"the anisotropy of variant {variant} is largest ({own[best]:.2g})"
    return f"cut-off: {largest} at {best:g} r_min{paper}"
