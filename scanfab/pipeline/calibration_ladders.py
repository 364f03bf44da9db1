"""Ladders of a calibration: their rows, from where on they are steady, and what they say."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Annotated

from scanfab.base.column import LENGTH
from scanfab.base.space import SPACE, Space
from scanfab.table.row import Record

# of the 2017 paper, in r_min; its RV as fractions of the sample's radius
PAPER_SPACING = 0.1
PAPER_CUTOFF = 1.0
PAPER_RV = "0.67 to 0.7"
# how likely chance alone makes any two steps of a ladder differ, and how sure standard errors of 16
# replicates are
CHANCE, FREEDOM = 0.05, 30


@dataclass(frozen=True, kw_only=True, slots=True)
class StepRow(Record):
    """One step of a ladder for one variant; lengths in the dump's unit."""

    source: Annotated[str, "the series as given"]
    frame: Annotated[int, "index in the series, from 0"]
    ladder: Annotated[str, "what is changed: spacing, directions, cutoff, rv; or recommended"]
    value: Annotated[
        float,
        "spacing or cut-off in r_min, number of directions, RV radius as a fraction of "
        "half the smallest extent",
    ]
    variant: Annotated[str, "as in the fabric table"]
    rule: Annotated[str, "the direction rule"]
    degree: Annotated[
        int | None,
        "polynomials to this degree it integrates exactly; empty for none",
    ]
    rule_bias: Annotated[float, "alpha_vs that the rule gives an isotropic sample"]
    directions: Annotated[int | None, "axes of the rule, in each replicate"]
    replicates: Annotated[int | None, "number of replicates"]
    spacing: Annotated[
        float | None,
        "distance between neighbouring lines of one direction, all replicates together",
        LENGTH,
    ]
    cutoff: Annotated[float | None, "shortest void segment kept", LENGTH]
    rv_radius: Annotated[
        float | None,
        "radius of the RV (of a shape that is no sphere, of the ball that holds it); empty for the "
        "whole sample",
        LENGTH,
    ]
    segments: Annotated[int | None, "void segments kept"]
    seconds: Annotated[float, "time of the step, all variants (and all cut-offs) together", "s"]
    mean_length: Annotated[float | None, "mean length of the kept segments", LENGTH]
    alpha_vs_axial: Annotated[
        float | None,
        "signed anisotropy of the void fabric along the loading axis",
    ]
    alpha_vs_axial_se: Annotated[float | None, "its standard error from the scan"]
    alpha_vs_axial_sample_se: Annotated[
        float | None,
        "the sample's own scatter, by a jackknife over eight octants, of discs four quadrants",
    ]
    steady: Annotated[
        int | None,
        "1 if this step and all later ones of the ladder differ by no more than chance "
        "makes of their standard errors (of the scan; for rv also of the sample, as the "
        "smaller RV is a part of the larger), else 0; empty for a cut-off, on which "
        "alpha_vs depends by definition",
    ]
    note: Annotated[str, "what makes the step doubtful"]


def judged(rows: Iterable[StepRow], space: Space = SPACE) -> list[StepRow]:
    """The rows of a ladder with ``steady`` filled in, variant by variant."""
    every = list(rows)
    found: list[StepRow] = []
    most = _most_errors([row.variant for row in every])
    for row in reversed(every):
        later = [one for one in found if one.variant == row.variant]
        is_sound = None not in (row.alpha_vs_axial, row.alpha_vs_axial_se) and not row.note
        steady = is_sound and all(
            one.steady and _agree(row, one, most, space.dimension) for one in later
        )
        found.append(replace(row, steady=int(steady)))
    return found[::-1]


def _most_errors(variants: list[str]) -> float:
    """By how many standard errors steps may differ by chance, given all pairs of a variant's."""
    from scipy.special import stdtrit

    steps = [variants.count(variant) for variant in set(variants)]
    pairs = sum(count * (count - 1) // 2 for count in steps)
    return float(stdtrit(FREEDOM, 1.0 - 0.5 * CHANCE / max(pairs, 1)))


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


def largest(rows: Sequence[StepRow], name: str) -> float | None:
    """The largest value of a column."""
    return max((row[name] for row in rows if row[name] is not None), default=None)


def _of_spacing(rows: Sequence[StepRow]) -> str:
    steady, finest = first_steady(rows), [row for row in rows if row.value == PAPER_SPACING]
    said = "spacing: no step agrees with all finer ones"
    if steady is not None:
        said = f"spacing: from {steady:g} r_min on nothing changes within the errors"
    if not finest:
        return f"{said}; the paper's r_min/10 would take too many lines here"
    widest = [row for row in rows if row.value == steady] or finest
    return (
        f"{said}; the paper's r_min/10 has an error of {_spelt_error(finest)} with "
        f"{finest[0].directions} directions and takes {finest[0].seconds:.2g} s, "
        f"{widest[0].value:g} r_min {_spelt_error(widest)} and {widest[0].seconds:.2g} s"
    )


def _of_directions(rows: Sequence[StepRow]) -> str:
    steady = first_steady(rows)
    if steady is None:
        return "directions: no step agrees with all later ones"
    return f"directions: from {steady:g} on nothing changes within the errors"


def _of_cutoff(rows: Sequence[StepRow]) -> str:
    variant = rows[0].variant
    known = {
        row.value: row.alpha_vs_axial
        for row in rows
        if row.variant == variant and row.alpha_vs_axial is not None
    }
    best = max(known, key=lambda value: abs(known[value]))
    said = (
        f"cut-off: it decides what is measured; in {variant} the anisotropy is largest "
        f"({known[best]:.2g}) at {best:g} r_min"
    )
    paper = known.get(PAPER_CUTOFF)
    if paper is None or known[best] == 0:
        return said
    return f"{said}; at the paper's 1 r_min it is {paper / known[best]:.0%} of that"


def _of_rv(rows: Sequence[StepRow]) -> str:
    steady = first_steady(rows)
    if steady is None:
        return f"RV: it matters which is taken, also at the paper's {PAPER_RV}"
    return (
        f"RV: from {steady:g} on it does not matter within the sample's error "
        f"(the paper: {PAPER_RV})"
    )


SENTENCES = {
    "spacing": _of_spacing,
    "directions": _of_directions,
    "cutoff": _of_cutoff,
    "rv": _of_rv,
}
"""What the rows of a ladder show, in one sentence."""


def sentence_of_recommended(rows: Sequence[StepRow], target: float, sample: float | None) -> str:
    """What the recommended settings reach."""
    own = "unknown" if sample is None else f"{sample:.2g}"
    error = largest(rows, "alpha_vs_axial_se")
    missed = ""
    if error is not None and error > target:
        missed = (
            f": {100 * (error / target - 1.0):.2g} % more than wanted, as errors vary with the "
            f"lines that are drawn; more directions make it smaller"
        )
    return (
        f"recommended: scan's error {_spelt_error(rows)} (wanted {target:.2g}; the sample's own is "
        f"{own}) in {rows[0].seconds:.2g} s{missed}"
    )


def _spelt_error(rows: Sequence[StepRow]) -> str:
    """The largest standard error by the scan."""
    value = largest(rows, "alpha_vs_axial_se")
    return "unknown" if value is None else f"{value:.2g}"
