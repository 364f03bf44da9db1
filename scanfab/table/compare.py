"""Comparison of fabric tables: normalised curves, and void against contact fabric by variant."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from scanfab.base.errors import ScanfabNote, ScanfabWarning, SettingsError
from scanfab.base.typing import FloatArray
from scanfab.fabric.jackknife import BLOCKS, variance_without_noise
from scanfab.table.abscissa import strain_column, why_not_strain
from scanfab.table.columns import columns_of
from scanfab.table.comparison_rows import Comparison, DifferenceRow, FrameRow, SummaryRow
from scanfab.table.curves import is_turned
from scanfab.table.reading import number_of, numbers_of, total_error, variant_of
from scanfab.table.selection import check_rows
from scanfab.table.table import Table

# a frame at 12 % may say 0.1200012, as boxes have rounded numbers
SAME_STRAIN = 1e-5


TURNED = (
    "the loading axis is not the axis of the contact fabric, as in simple shear: alpha_vs_axial, "
    "alpha_c_axial, and with them slope and peak, miss most of the fabric; figures draw alpha_vs, "
    "alpha_c and the angle between their axes instead; or compute with `axis` along the major axis"
)
# with fewer points a line says nothing
FEWEST_FRAMES = 3


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
        Rows for frames, for sources and variants, and for pairs of variants (what they hold is
        said by ``columns_of`` of ``scanfab.table.columns``), and the points of each fit.

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
    rows = list(rows)
    groups = _grouped(rows)
    _tell_of_strains(rows, strain_max)
    if is_turned(rows):
        warnings.warn(TURNED, ScanfabNote, stacklevel=2)
    column = strain_column(rows)
    told_apart = {key: _with_strain(group, column) for key, group in groups.items()}
    points = [_points(group, strain_max) for group in told_apart.values()]
    return Comparison(
        frames=_table(FrameRow, (row for group in groups.values() for row in _normalised(group))),
        summary=_table(
            SummaryRow,
            (
                _summary(group, fitted, strain_max)
                for group, fitted in zip(told_apart.values(), points, strict=True)
            ),
        ),
        differences=Table(_differences(groups), columns_of(DifferenceRow)),
        points=tuple(points),
    )


def _table(kind: type[FrameRow | SummaryRow], rows: Iterable[FrameRow | SummaryRow]) -> Table:
    """The rows, with a column for the RV if some of them have one."""
    rows = list(rows)
    has_rv = any(row.rv is not None for row in rows)
    return Table(rows, [one for one in columns_of(kind) if one.name != "rv" or has_rv])


def _tell_of_strains(rows: Sequence[Mapping[str, Any]], strain_max: float | None) -> None:
    """Say which strain stands for which, and what is odd about the largest one of a fit."""
    hint = why_not_strain(rows)
    if hint is not None:
        warnings.warn(hint, ScanfabNote, stacklevel=3)
    if strain_max is None:
        return
    if not math.isfinite(strain_max):
        raise SettingsError(f"strain_max: expected a number, found {strain_max}")
    strains = numbers_of(rows, strain_column(rows) or "strain")
    if not strains:
        warnings.warn("`strain_max`: no frame has a strain, so none is fitted", ScanfabWarning, 3)
    elif not _within(min(strains), strain_max):
        warnings.warn(
            f"strain_max: {strain_max:g} leaves out all frames, so none is fitted: their strains "
            f"lie between {min(strains):.3g} and {max(strains):.3g} (positive in compression)",
            ScanfabWarning,
            stacklevel=3,
        )
    elif _within(max(strains), strain_max):
        warnings.warn(
            f"strain_max: {strain_max:g} leaves out no frame: strains are fractions (5 % is 0.05), "
            f"and lie between {min(strains):.3g} and {max(strains):.3g}",
            ScanfabWarning if strain_max > 1 else ScanfabNote,
            stacklevel=3,
        )
    else:
        _tell_of_few_frames(rows, strain_max)


def _tell_of_few_frames(rows: Sequence[Mapping[str, Any]], strain_max: float) -> None:
    """Say where a largest strain leaves too few frames for a line, and which one would not."""
    column = strain_column(rows) or "strain"
    for source, own in groupby(sorted(rows, key=_source), key=_source):
        of_frames = {row["frame"]: number_of(row, column) for row in own}
        strains = sorted(strain for strain in of_frames.values() if strain is not None)
        beyond = [strain for strain in strains if not _within(strain, strain_max)]
        left = len(strains) - len(beyond)
        if left < FEWEST_FRAMES and beyond:
            warnings.warn(
                f"strain_max: {strain_max:g} leaves {left} of {len(strains)} frames of {source}, "
                f"and a line needs {FEWEST_FRAMES}: the nearest strain above is {beyond[0]:.10g}",
                ScanfabWarning,
                stacklevel=4,
            )


def _source(row: Mapping[str, Any]) -> str:
    return str(row["source"])


def _with_strain(
    group: Sequence[Mapping[str, Any]], column: str | None
) -> Sequence[Mapping[str, Any]]:
    """Rows whose strain is the one that the frames are told apart by."""
    if column in (None, "strain"):
        return group
    return [{**row, "strain": number_of(row, str(column))} for row in group]


def _grouped(
    rows: Sequence[Mapping[str, Any]],
) -> dict[tuple[str, str], list[Mapping[str, Any]]]:
    """Rows by source, variant and RV, in the order of their first appearance."""
    check_rows(rows)
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["source"], variant_of(row)), []).append(row)
    for (source, variant), group in groups.items():
        frames = [row["frame"] for row in group if row["frame"] is not None]
        if len(set(frames)) < len(frames):
            twice = next(frame for frame in frames if frames.count(frame) > 1)
            raise SettingsError(
                f"{source}, variant {variant}: several rows for frame {twice}: choose the rows of "
                f"one cut-off with `cutoff`; two runs of one sample are told apart by "
                f"`labels=NAME`, once for each table"
            )
    return groups


def _normalised(group: Sequence[Mapping[str, Any]]) -> list[FrameRow]:
    largest = {name: _largest(group, name) for name in ("alpha_vs_axial", "alpha_c_axial")}

    def norm(row: Mapping[str, Any], name: str) -> float | None:
        value, scale = row[name], largest[name]
        return None if value is None or not scale else value / scale

    return [
        FrameRow(
            source=row["source"],
            frame=row["frame"],
            strain=row["strain"],
            variant=row["variant"],
            alpha_vs_axial=row["alpha_vs_axial"],
            alpha_c_axial=row["alpha_c_axial"],
            alpha_vs_axial_norm=norm(row, "alpha_vs_axial"),
            alpha_c_axial_norm=norm(row, "alpha_c_axial"),
            alpha_vs_axial_se=number_of(row, "alpha_vs_axial_se"),
            alpha_vs_axial_sample_se=number_of(row, "alpha_vs_axial_sample_se"),
            alpha_vs_axial_total_se=total_error(row, "alpha_vs_axial"),
            alpha_c_axial_sample_se=number_of(row, "alpha_c_axial_sample_se"),
            shear_strain=number_of(row, "shear_strain"),
            rv=number_of(row, "rv"),
        )
        for row in group
    ]


def _largest(group: Sequence[Mapping[str, Any]], name: str) -> float | None:
    """The largest absolute value of a column."""
    return max((abs(row[name]) for row in group if row[name] is not None), default=None)


def _summary(
    group: Sequence[Mapping[str, Any]], fitted: FloatArray, strain_max: float | None
) -> SummaryRow:
    slope, slope_origin, r2 = _fit(*fitted.T)
    curve = [row for row in group if row["alpha_vs_axial"] is not None]
    peak = max(curve, key=lambda row: abs(row["alpha_vs_axial"]), default=None)
    return SummaryRow(
        source=group[0]["source"],
        variant=group[0]["variant"],
        frames=len(fitted),
        slope=slope,
        slope_origin=slope_origin,
        r2=r2,
        slope_se=_slope_error(group, strain_max) if slope is not None else None,
        peak=None if peak is None else peak["alpha_vs_axial"],
        peak_strain=None if peak is None else peak["strain"],
        final=curve[-1]["alpha_vs_axial"] if curve else None,
        rv=number_of(group[0], "rv"),
    )


def _points(
    group: Sequence[Mapping[str, Any]],
    strain_max: float | None,
    names: Sequence[str] = ("alpha_c_axial", "alpha_vs_axial"),
) -> FloatArray:
    """Columns of the frames of a fit that have all of them, shape (M, len(names))."""
    values = [
        [row.get(name) for name in names] for row in group if _within(row["strain"], strain_max)
    ]
    return np.array([some for some in values if None not in some], float).reshape(-1, len(names))


def _slope_error(group: Sequence[Mapping[str, Any]], strain_max: float | None) -> float | None:
    """
    Standard error of the slope from the blocks of the sample.

    Frames of one sample are not independent: their scatter about the line says nothing of it. The
    values without each block come from two replicates of the scan, so there are two slopes for
    each, and the noise of the scan is taken off. None if nothing is left, or if a frame lacks the
    values without some block.
    """
    frames = len(_points(group, strain_max))
    slopes: list[list[float | None]] = []
    for block in range(1, _blocks(group) + 1):
        names = [f"alpha_c_axial_without_{block}", f"alpha_vs_axial_without_{block}"]
        contact, void = _points(group, strain_max, names).T
        halves = _points(group, strain_max, [*names, f"alpha_vs_axial_half_{block}"])[:, 2]
        if len(contact) < frames:
            return None
        if len(halves) < frames:  # a table of before this column: the noise stays in
            halves = np.zeros(frames)
        slopes.append([_fit(contact, void + sign * halves)[0] for sign in (1.0, -1.0)])
    values = np.array(slopes, float)
    if np.isnan(values).any():
        return None
    variance = variance_without_noise(values)
    return math.sqrt(variance) if variance >= 0 else None


def _blocks(group: Sequence[Mapping[str, Any]]) -> int:
    """How many blocks the rows were parted into: those of samples in a plane have no upper half."""
    names = [f"alpha_c_axial_without_{block}" for block in range(BLOCKS // 2 + 1, BLOCKS + 1)]
    has_upper = any(row.get(name) is not None for row in group for name in names)
    return BLOCKS if has_upper else BLOCKS // 2


def _within(strain: float | None, strain_max: float | None) -> bool:
    """Whether a frame belongs to the fit; without a strain nobody can tell, so it does not."""
    return strain_max is None or (strain is not None and strain <= strain_max + SAME_STRAIN)


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


def _differences(
    groups: Mapping[tuple[str, str], Sequence[Mapping[str, Any]]],
) -> Iterable[DifferenceRow]:
    """Pairs of variants of one source, frame by frame."""
    sources = dict.fromkeys(source for source, _ in groups)
    for source in sources:
        variants = sorted(variant for name, variant in groups if name == source)
        for place, first in enumerate(variants):
            for second in variants[place + 1 :]:
                others = {row["frame"]: row for row in groups[source, second]}
                for one in groups[source, first]:
                    other = others.get(one["frame"])
                    if other is not None and None not in (
                        one["alpha_vs_axial"],
                        other["alpha_vs_axial"],
                    ):
                        yield _difference(one, other)


def _difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> DifferenceRow:
    errors = [row.get("alpha_vs_axial_se") for row in (one, other)]
    return DifferenceRow(
        source=one["source"],
        frame=one["frame"],
        strain=one["strain"],
        variants=f"{variant_of(one)}-{variant_of(other)}",
        difference=one["alpha_vs_axial"] - other["alpha_vs_axial"],
        difference_se=None if None in errors else math.hypot(*errors),  # type: ignore[arg-type]
    )
