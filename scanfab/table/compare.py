"""Compare fabric tables: normalised curves, and void against contact fabric by variant."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from scanfab.base.column import Column
from scanfab.base.errors import SettingsError, note, warn
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray
from scanfab.fabric.errors import BLOCKS, variance_without_noise
from scanfab.table.columns import KINDS
from scanfab.table.curves import is_turned, strain_column, why_not_strain
from scanfab.table.row import (
    Rows,
    column_of,
    groups_of,
    number_of,
    numbers_of,
    total_error,
    variant_of,
    with_error,
)
from scanfab.table.selection import check_rows
from scanfab.table.table import Table

# Box sizes are rounded in dumps, so the strain of a frame at 12 % may be 0.1200012.
SAME_STRAIN = 1e-5
# a straight line needs at least as many points to say anything
FEWEST_FRAMES = 3
BOTH = ("alpha_vs_axial", "alpha_c_axial")
TURNED = (
    "the loading axis is not the axis of the contact fabric, as in simple shear: alpha_vs_axial, "
    "alpha_c_axial, slope and peak miss most of the fabric. Figures draw alpha_vs, alpha_c and the "
    "angle between their axes instead; or compute with `axis` along the major axis"
)

KEPT = "as in the fabric table"
RV = f"{KEPT}; only if that has several RVs"


def _columns(**meanings: str) -> tuple[Column, ...]:
    """Columns from names and meanings; their kind is that of the fabric table, else float."""
    kinds = {**KINDS, "frames": int, "variants": str}
    return tuple(Column(name, kinds.get(name, float), "", text) for name, text in meanings.items())


FRAMES = _columns(
    **dict.fromkeys(("source", "frame", "strain", "variant", *BOTH), KEPT),
    alpha_vs_axial_norm="alpha_vs_axial over its largest absolute value in this source and variant",
    alpha_c_axial_norm="alpha_c_axial over its largest absolute value in this source and variant",
    alpha_vs_axial_se=f"{KEPT}: standard error due to the scan",
    alpha_vs_axial_sample_se=f"{KEPT}: standard error due to the sample",
    alpha_vs_axial_total_se="total standard error √(scan² + sample²); empty if either is empty",
    alpha_c_axial_sample_se=f"{KEPT}: the whole standard error, as contacts need no scan",
    shear_strain=KEPT,
    rv=RV,
)
"""Columns of a frame and variant; each anisotropy is also divided by its largest value."""

SUMMARY = _columns(
    **dict.fromkeys(("source", "variant"), KEPT),
    frames="number of frames in the fits",
    slope="least-squares slope of alpha_vs_axial against alpha_c_axial, with an intercept",
    slope_origin="least-squares slope of the line through the origin",
    r2="R² of the fit with an intercept",
    slope_se="standard error of the slope, by a jackknife that leaves out each octant of the "
    "sample in all frames; empty if a frame lacks the values without octants",
    peak="the alpha_vs_axial with the largest absolute value",
    peak_strain="strain at the peak; shear_strain if the axial strain does not change",
    final="the last alpha_vs_axial that is not empty",
    rv=RV,
)
"""Columns of a source and variant: void fabric against contact fabric over the frames."""

DIFFERENCES = _columns(
    **dict.fromkeys(("source", "frame", "strain"), KEPT),
    variants="the two variants, for instance a-b",
    difference="alpha_vs_axial of the first variant minus that of the second",
    difference_se="standard error of the difference for independent scans; too large for variants "
    "that share lines",
)
"""Columns of the difference between two variants of a frame."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """
    The result of :func:`scanfab.compare_tables`: three tables and the points of the fits.

    Attributes
    ----------
    frames : Table
        A row for each frame and variant; each anisotropy is also divided by its largest value.
    summary : Table
        A row for each source and variant: slope, peak, final value.
    differences : Table
        A row for each frame and pair of variants.
    points : tuple of ndarray
        For each row of the summary, the contact and void anisotropy of the fitted frames, shape
        (frames, 2).

    Examples
    --------
    >>> from scanfab import Table
    >>> rows = [dict(source="s", frame=k, strain=0.01 * k, variant="c", alpha_vs_axial=0.1 * x,
    ...              alpha_c_axial=x) for k, x in enumerate([0.0, 0.02, 0.05])]
    >>> found = Table(rows).compare()
    >>> found
    Comparison of 3 rows
    s, variant c: slope 0.1, 3 frames
    >>> round(found.summary[0].slope, 12)
    0.1
    """

    frames: Table
    summary: Table
    differences: Table
    points: tuple[FloatArray, ...]

    def __repr__(self) -> str:
        lines = [
            f"{row.source}{', ' * bool(row.source)}variant {variant_of(row)}: "
            f"slope {with_error(row.slope, row.slope_se)}, {counted(row.frames, 'frame')}"
            for row in self.summary
        ]
        return "\n".join([f"Comparison of {counted(len(self.frames), 'row')}", *lines])


def compare_tables(
    rows: Iterable[Mapping[str, Any]], *, strain_max: float | None = None
) -> Comparison:
    """
    Compare void with contact fabric over the frames, and the variants with one another.

    Parameters
    ----------
    rows : iterable of mapping
        Rows of fabric tables by column; numbers may be None. Rows are grouped by source, variant
        and, if there are several, RV.
    strain_max : float, optional
        Leave frames beyond this strain, a fraction, out of the fits. If the axial strain is the
        same in all frames, the limit holds for the shear strain.

    Returns
    -------
    Comparison
        Tables by frame, by source and variant, and by pair of variants, and the points of each fit.

    Raises
    ------
    SettingsError
        If a column is missing or holds other values than numbers, or if a frame has several rows of
        the same variant, as with several cut-offs.

    Examples
    --------
    >>> from scanfab.table.compare import compare_tables
    >>> rows = [
    ...     dict(source="s", frame=k, strain=0.01 * k, variant="c",
    ...          alpha_vs_axial=0.1 * x, alpha_c_axial=x)
    ...     for k, x in enumerate([0.0, 0.02, 0.05])
    ... ]
    >>> round(compare_tables(rows).summary[0].slope, 12)
    0.1
    """
    rows = [dict(row) for row in rows]
    check_rows(rows)
    groups = groups_of(rows)
    for (source, variant), group in groups.items():
        frame, count = Counter(row["frame"] for row in group).most_common(1)[0]
        if count > 1:
            raise SettingsError(
                f"{source}, variant {variant}: several rows for frame {frame}: choose one cut-off "
                f"with `cutoff` (in Python by table.select(cutoff=...)), or name two runs of the "
                f"same sample with `labels=NAME`"
            )
    column = strain_column(rows) or "strain"
    _tell_of_strains(rows, column, strain_max)
    if is_turned(rows):
        note(TURNED)
    origins = {(row["source"], row["contacts_from"]) for row in rows if row.get("contacts_from")}
    if len(origins) > len({source for source, _ in origins}):
        note(
            "contacts come from files in some frames and from geometry in others (contacts_from): "
            "the slope on the contact fabric mixes both"
        )
    fits = [_fitted_group(group, column, strain_max) for group in groups.values()]
    _tell_of_errors([summary for summary, _ in fits], rows)
    normalised = [row for group in groups.values() for row in _normalised(group)]
    # the last column, rv, is dropped if there are no several RVs
    end = None if numbers_of(rows, "rv") else -1
    return Comparison(
        frames=Table(normalised, FRAMES[:end]),
        summary=Table([summary for summary, _ in fits], SUMMARY[:end]),
        differences=Table(_differences(groups), DIFFERENCES),
        points=tuple(points for _, points in fits),
    )


def _tell_of_strains(rows: Rows, column: str, strain_max: float | None) -> None:
    """Note which strain is used, and warn if ``strain_max`` does not fit the strains."""
    if hint := why_not_strain(rows):
        note(hint)
    if strain_max is None:
        return
    if not math.isfinite(strain_max):
        raise SettingsError(f"strain_max: expected a number, found {strain_max}")
    strains = numbers_of(rows, column)
    if not strains:
        warn("`strain_max`: no frame has a strain, so no frame is fitted")
    elif _within(max(strains), strain_max):
        tell = warn if strain_max > 1 else note
        tell(
            f"`strain_max`: {strain_max:g} leaves out no frame: strains are fractions (5 % is "
            f"0.05), positive in compression, and here lie between {min(strains):.3g} and "
            f"{max(strains):.3g}"
        )


def _tell_of_errors(summary: Iterable[Mapping[str, Any]], rows: Rows) -> None:
    """Note why slopes have no standard error."""
    without = [one for one in summary if one["slope"] is not None and one["slope_se"] is None]
    if not without:
        return
    curve = [row for row in rows if row["alpha_vs_axial"] is not None]
    parts = {
        name for row in curve for name in row if "_without_" in name and numbers_of([row], name)
    }
    reason = "the noise of the scan hides the scatter of the octants"
    if not parts:
        reason = "the table has no parts of the jackknife (alpha_vs_axial_without_1 and so on)"
    elif any(row.get(name) is None for row in curve for name in parts):
        reason = "some frame has no fabric without one of its octants, so it has too few grains"
    names = ", ".join(dict.fromkeys(variant_of(one) for one in without))
    note(f"slope_se is empty for variant {names}: {reason}")


def _within(strain: float | None, strain_max: float | None) -> bool:
    """Whether a frame is fitted: always without a limit, else if it has a strain within it."""
    return strain_max is None or (strain is not None and strain <= strain_max + SAME_STRAIN)


def _normalised(group: Rows) -> Iterator[dict[str, Any]]:
    """The rows of one source and variant with normalised anisotropies and total errors."""
    largest = {name: max(map(abs, numbers_of(group, name)), default=0.0) for name in BOTH}
    for row in group:
        values = {**row, "alpha_vs_axial_total_se": total_error(row, "alpha_vs_axial")}
        for name in BOTH:
            if row[name] is not None and largest[name] > 0:
                values[f"{name}_norm"] = row[name] / largest[name]
        yield values


def _fitted_group(
    group: Rows, column: str, strain_max: float | None
) -> tuple[dict[str, Any], FloatArray]:
    """The summary row of one source and variant, and the points of its fit."""
    curve = [row for row in group if row["alpha_vs_axial"] is not None]
    fitted = [
        row
        for row in curve
        if row["alpha_c_axial"] is not None and _within(number_of(row, column), strain_max)
    ]
    points = np.column_stack([column_of(fitted, name) for name in BOTH[::-1]])
    slope, slope_origin, r2 = _fit(*points.T)
    peak = max(curve, key=lambda row: abs(row["alpha_vs_axial"]), default={})
    summary = {
        **{name: group[0].get(name) for name in ("source", "variant", "rv")},
        "frames": len(fitted),
        "slope": slope,
        "slope_origin": slope_origin,
        "r2": r2,
        "slope_se": None if slope is None else _slope_error(fitted),
        "peak": peak.get("alpha_vs_axial"),
        "peak_strain": number_of(peak, column),
        "final": curve[-1]["alpha_vs_axial"] if curve else None,
    }
    return summary, points


def _fit(x: FloatArray, y: FloatArray) -> tuple[float | None, float | None, float | None]:
    """Slope of the fit with an intercept, slope through the origin, R² of the first fit."""
    if len(x) < FEWEST_FRAMES:
        return None, None, None
    origin = float(x @ y / (x @ x)) if np.any(x != 0) else None
    dx, dy = x - x.mean(), y - y.mean()
    if np.ptp(x) == 0:  # dx may be rounding
        return None, origin, None
    slope = float(dx @ dy / (dx @ dx))
    r2 = float((dx @ dy) ** 2 / ((dx @ dx) * (dy @ dy))) if np.ptp(y) > 0 else None
    return slope, origin, r2


def _slope_error(fitted: Rows) -> float | None:
    """
    Standard error of the slope, by a jackknife over the blocks of the sample.

    Frames of one sample are not independent, so their scatter about the line does not measure the
    error. The table has values without each block from two replicates of the scan. They give two
    slopes per block, whose difference shows the noise of the scan; this noise is subtracted. The
    error is None if nothing remains, or if a frame lacks the values without some block.
    """
    # samples in a plane have four quadrants in place of eight octants
    upper = [f"alpha_c_axial_without_{block}" for block in range(BLOCKS // 2 + 1, BLOCKS + 1)]
    has_upper = any(numbers_of(fitted, name) for name in upper)
    slopes: list[list[float | None]] = []
    for block in range(1, (BLOCKS if has_upper else BLOCKS // 2) + 1):
        contact = column_of(fitted, f"alpha_c_axial_without_{block}")
        void = column_of(fitted, f"alpha_vs_axial_without_{block}")
        half = column_of(fitted, f"alpha_vs_axial_half_{block}")
        if np.isnan(half).any():  # older tables lack this column: the noise is not subtracted
            half = np.zeros(len(fitted))
        slopes.append([_fit(contact, void + sign * half)[0] for sign in (1.0, -1.0)])
    # a missing value makes the slope NaN, and so the variance
    variance = float(variance_without_noise(np.array(slopes, float)))
    return math.sqrt(variance) if variance >= 0 else None


def _differences(groups: Mapping[tuple[str, str], Rows]) -> Iterator[dict[str, Any]]:
    """A row for each frame and each pair of variants of the same source."""
    for source in dict.fromkeys(source for source, _ in groups):
        variants = sorted(variant for name, variant in groups if name == source)
        for first, second in combinations(variants, 2):
            others = {row["frame"]: row for row in groups[source, second]}
            for row in groups[source, first]:
                pair = row, others.get(row["frame"], {})
                values = numbers_of(pair, "alpha_vs_axial")
                errors = numbers_of(pair, "alpha_vs_axial_se")
                if len(values) == 2:
                    yield {
                        **{name: row[name] for name in ("source", "frame", "strain")},
                        "variants": f"{first}-{second}",
                        "difference": values[0] - values[1],
                        "difference_se": math.hypot(*errors) if len(errors) == 2 else None,
                    }
