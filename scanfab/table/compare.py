"""Comparison of fabric tables: normalised curves, and void against contact fabric by variant."""

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
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS
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

# the strain of a frame at 12 % may be 0.1200012, as the numbers of boxes are rounded
SAME_STRAIN = 1e-5
# a line through fewer points says nothing
FEWEST_FRAMES = 3
BOTH = ("alpha_vs_axial", "alpha_c_axial")
TURNED = (
    "the loading axis is not the axis of the contact fabric, as in simple shear: alpha_vs_axial, "
    "alpha_c_axial, and with them slope and peak, miss most of the fabric; figures draw alpha_vs, "
    "alpha_c and the angle between their axes instead; or compute with `axis` along the major axis"
)

KINDS = {one.name: one.kind for one in (*OWN_COLUMNS, *MORE_COLUMNS)}
KEPT = "as in the fabric table"
RV = f"{KEPT}: only where that has several RVs"


def _columns(**meanings: str) -> tuple[Column, ...]:
    """Columns by name and meaning, of the kind that they have in fabric tables, else floats."""
    kinds = {**KINDS, "frames": int, "variants": str}
    return tuple(Column(name, kinds.get(name, float), "", text) for name, text in meanings.items())


FRAMES = _columns(
    **dict.fromkeys(("source", "frame", "strain", "variant", *BOTH), KEPT),
    alpha_vs_axial_norm="alpha_vs_axial over its largest absolute value in the source's variant",
    alpha_c_axial_norm="alpha_c_axial likewise",
    alpha_vs_axial_se=f"{KEPT}: the scan's part of the error",
    alpha_vs_axial_sample_se=f"{KEPT}: the sample's part of the error",
    alpha_vs_axial_total_se="both together, √(scan² + sample²); empty where either is",
    alpha_c_axial_sample_se=f"{KEPT}: all of the error, as contacts are counted, not scanned",
    shear_strain=KEPT,
    rv=RV,
)
"""One frame and variant, with both anisotropies divided by their own largest absolute value."""

SUMMARY = _columns(
    **dict.fromkeys(("source", "variant"), KEPT),
    frames="number of frames that enter the fits",
    slope="least-squares slope of alpha_vs_axial on alpha_c_axial, with an intercept",
    slope_origin="that slope through the origin",
    r2="R² of the fit with an intercept",
    slope_se="standard error of the slope from the sample's octants, each left out in all frames; "
    "empty if a frame has no values without octants",
    peak="alpha_vs_axial where its absolute value is largest",
    peak_strain="the strain there; shear_strain where strain is the same in all frames",
    final="alpha_vs_axial of the last frame that has one",
    rv=RV,
)
"""One source and variant: void fabric against contact fabric over the frames."""

DIFFERENCES = _columns(
    **dict.fromkeys(("source", "frame", "strain"), KEPT),
    variants="the two variants, for instance a-b",
    difference="alpha_vs_axial of the first minus that of the second",
    difference_se="its standard error if the scans were independent: too large if they share lines",
)
"""How far two variants of one frame are apart."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """
    The tables that :func:`scanfab.compare_tables` makes.

    Attributes
    ----------
    frames : Table
        A row for each frame and variant, with both anisotropies divided by their largest.
    summary : Table
        A row for each source and variant: slope, peak, final value.
    differences : Table
        A row for each frame and pair of variants.
    points : tuple of ndarray
        For each row of the summary, contact and void anisotropy of the frames in its fits, shape
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
    >>> round(float(found.slope[0]), 12)
    0.1
    """

    frames: Table
    summary: Table
    differences: Table
    points: tuple[FloatArray, ...]

    @property
    def slope(self) -> FloatArray:
        """Slope of each row of the summary, dimensionless; NaN where there is none."""
        return self.summary["slope"]

    @property
    def slope_se(self) -> FloatArray:
        """Its standard error from the sample's octants."""
        return self.summary["slope_se"]

    @property
    def r2(self) -> FloatArray:
        """R² of each fit."""
        return self.summary["r2"]

    @property
    def peak(self) -> FloatArray:
        """The void anisotropy that is largest in size, for each row of the summary."""
        return self.summary["peak"]

    def __repr__(self) -> str:
        lines = [
            f"{one.source}, variant {variant_of(one)}: "
            f"slope {with_error(one.slope, one.slope_se)}, {counted(one.frames, 'frame')}"
            for one in self.summary
        ]
        return "\n".join([f"Comparison of {len(self.frames)} rows", *lines])


def compare_tables(
    rows: Iterable[Mapping[str, Any]], *, strain_max: float | None = None
) -> Comparison:
    """
    Set the variants of fabric tables side by side.

    Parameters
    ----------
    rows : iterable of mapping
        Rows of fabric tables by column; numbers may be None. Groups are source, variant and, where
        there are several, RV.
    strain_max : float, optional
        Leave frames beyond this strain, a fraction, out of the fits; beyond this shear strain
        where the axial strain is the same in all frames.

    Returns
    -------
    Comparison
        Rows for frames, for sources and variants, and for pairs of variants, and the points of
        each fit.

    Raises
    ------
    SettingsError
        If a column is missing, or holds something else than numbers, or if a frame has several rows
        of one variant, as with several cut-offs.

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
                f"with `cutoff`, or tell two runs of one sample apart by `labels=NAME`"
            )
    column = strain_column(rows) or "strain"
    _tell_of_strains(rows, column, strain_max)
    if is_turned(rows):
        note(TURNED)
    fits = [_fitted_group(group, column, strain_max) for group in groups.values()]
    normalised = [row for group in groups.values() for row in _normalised(group)]
    # the column of the RV is the last one
    end = None if numbers_of(rows, "rv") else -1
    return Comparison(
        frames=Table(normalised, FRAMES[:end]),
        summary=Table([summary for summary, _ in fits], SUMMARY[:end]),
        differences=Table(_differences(groups), DIFFERENCES),
        points=tuple(points for _, points in fits),
    )


def _tell_of_strains(rows: Rows, column: str, strain_max: float | None) -> None:
    """Notes on the strain that is used, and warnings on a ``strain_max`` that does not fit it."""
    if hint := why_not_strain(rows):
        note(hint)
    if strain_max is None:
        return
    if not math.isfinite(strain_max):
        raise SettingsError(f"strain_max: expected a number, found {strain_max}")
    known = [row for row in rows if number_of(row, column) is not None]
    strains = {(row["source"], row["frame"]): float(row[column]) for row in known}
    if not strains:
        warn("`strain_max`: no frame has a strain, so none is fitted")
        return
    largest = max(strains.values())
    lie = (
        f"strains are fractions (5 % is 0.05), positive in compression, and lie between "
        f"{min(strains.values()):.3g} and {largest:.3g}"
    )
    if _within(largest, strain_max):
        tell = warn if strain_max > 1 else note
        tell(f"strain_max: {strain_max:g} leaves out no frame: {lie}")
    for source in dict.fromkeys(source for source, _ in strains):
        own = [strain for (name, _), strain in strains.items() if name == source]
        beyond = [strain for strain in own if not _within(strain, strain_max)]
        if beyond and (left := len(own) - len(beyond)) < FEWEST_FRAMES:
            warn(
                f"strain_max: {strain_max:g} leaves {left} of {len(own)} frames of {source}, and "
                f"a line needs {FEWEST_FRAMES}: the nearest strain above is {min(beyond):.10g}; "
                f"{lie}"
            )


def _within(strain: float | None, strain_max: float | None) -> bool:
    """Whether a frame belongs to the fit; a frame without a strain does not."""
    return strain_max is None or (strain is not None and strain <= strain_max + SAME_STRAIN)


def _normalised(group: Rows) -> Iterator[dict[str, Any]]:
    """The rows of one source and variant with their values divided by the largest of them."""
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
    """The row of the summary, and the points of its fit."""
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
    """Slope with an intercept, slope through the origin, R² of the former."""
    if len(x) < FEWEST_FRAMES:
        return None, None, None
    origin = float(x @ y / (x @ x)) if np.any(x != 0) else None
    dx, dy = x - x.mean(), y - y.mean()
    if not np.any(dx != 0):
        return None, origin, None
    slope = float(dx @ dy / (dx @ dx))
    r2 = float((dx @ dy) ** 2 / ((dx @ dx) * (dy @ dy))) if np.any(dy != 0) else None
    return slope, origin, r2


def _slope_error(fitted: Rows) -> float | None:
    """
    Standard error of the slope from the blocks of the sample.

    Frames of one sample are not independent, so their scatter about the line is no measure of it.
    The values without each block come from two replicates of the scan, which give two slopes each;
    from these the noise of the scan is known and taken off. None if nothing is left, or if a frame
    lacks the values without some block.
    """
    # samples in a plane have no upper half, and so half as many blocks
    upper = [f"alpha_c_axial_without_{block}" for block in range(BLOCKS // 2 + 1, BLOCKS + 1)]
    has_upper = any(numbers_of(fitted, name) for name in upper)
    slopes: list[list[float | None]] = []
    for block in range(1, (BLOCKS if has_upper else BLOCKS // 2) + 1):
        contact = column_of(fitted, f"alpha_c_axial_without_{block}")
        void = column_of(fitted, f"alpha_vs_axial_without_{block}")
        half = column_of(fitted, f"alpha_vs_axial_half_{block}")
        if np.isnan(half).any():  # an older table lacks this column: the noise stays in
            half = np.zeros(len(fitted))
        slopes.append([_fit(contact, void + sign * half)[0] for sign in (1.0, -1.0)])
    # a value that a frame lacks makes the slope, and with it the variance, no number
    variance = float(variance_without_noise(np.array(slopes, float)))
    return math.sqrt(variance) if variance >= 0 else None


def _differences(groups: Mapping[tuple[str, str], Rows]) -> Iterator[dict[str, Any]]:
    """Pairs of variants of one source, frame by frame."""
    for source in dict.fromkeys(source for source, _ in groups):
        variants = sorted(variant for name, variant in groups if name == source)
        for first, second in combinations(variants, 2):
            others = {row["frame"]: row for row in groups[source, second]}
            for one in groups[source, first]:
                pair = one, others.get(one["frame"], {})
                values = numbers_of(pair, "alpha_vs_axial")
                errors = numbers_of(pair, "alpha_vs_axial_se")
                if len(values) == 2:
                    yield {
                        **{name: one[name] for name in ("source", "frame", "strain")},
                        "variants": f"{first}-{second}",
                        "difference": values[0] - values[1],
                        "difference_se": math.hypot(*errors) if len(errors) == 2 else None,
                    }
