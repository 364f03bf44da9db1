"""Comparison of fabric tables: normalised curves, and void against contact fabric by variant."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.errors import SettingsError
from scanfab.fabric.jackknife import BLOCKS, jackknife_error
from scanfab.selection import check_rows

__all__ = [
    "DIFFERENCE_MEANINGS",
    "FRAME_MEANINGS",
    "SUMMARY_MEANINGS",
    "Comparison",
    "DifferenceRow",
    "FrameRow",
    "SummaryRow",
    "compare_tables",
]

FloatArray = npt.NDArray[np.float64]

# with fewer points a line says nothing
FEWEST_FRAMES = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class FrameRow:
    """One frame and variant, with both anisotropies divided by their own largest absolute value."""

    source: str
    frame: int
    strain: float | None
    variant: str
    alpha_vs_axial: float | None
    alpha_c_axial: float | None
    alpha_vs_axial_norm: float | None
    alpha_c_axial_norm: float | None


@dataclass(frozen=True, kw_only=True, slots=True)
class SummaryRow:
    """One source and variant: void fabric against contact fabric over the frames."""

    source: str
    variant: str
    frames: int
    slope: float | None
    slope_origin: float | None
    r2: float | None
    slope_se: float | None
    peak: float | None
    peak_strain: float | None
    final: float | None


@dataclass(frozen=True, kw_only=True, slots=True)
class DifferenceRow:
    """How far two variants of one frame are apart."""

    source: str
    frame: int
    strain: float | None
    variants: str
    difference: float
    difference_se: float | None


FRAME_MEANINGS: dict[str, str] = {
    "source": "as in the fabric table",
    "frame": "as in the fabric table",
    "strain": "as in the fabric table",
    "variant": "as in the fabric table",
    "alpha_vs_axial": "signed anisotropy of the void fabric along the loading axis",
    "alpha_c_axial": "signed anisotropy of the contact fabric along the loading axis",
    "alpha_vs_axial_norm": "alpha_vs_axial over its largest absolute value in the source's variant",
    "alpha_c_axial_norm": "likewise",
}
SUMMARY_MEANINGS: dict[str, str] = {
    "source": "as in the fabric table",
    "variant": "as in the fabric table",
    "frames": "number of frames that enter the fits",
    "slope": "least-squares slope of alpha_vs_axial on alpha_c_axial, with an intercept",
    "slope_origin": "that slope through the origin",
    "r2": "R² of the fit with an intercept",
    "slope_se": "standard error of the slope from the sample's octants, each left out in all "
    "frames; empty if a frame has no values without octants",
    "peak": "alpha_vs_axial where its absolute value is largest",
    "peak_strain": "the strain there",
    "final": "alpha_vs_axial of the last frame that has one",
}
DIFFERENCE_MEANINGS: dict[str, str] = {
    "source": "as in the fabric table",
    "frame": "as in the fabric table",
    "strain": "as in the fabric table",
    "variants": "the two variants, for instance a-b",
    "difference": "alpha_vs_axial of the first minus that of the second",
    "difference_se": "its standard error as if both scans were independent, which is too large "
    "where they share lines",
}
"""What each column holds; anisotropies and strains are dimensionless."""


@dataclass(frozen=True)
class Comparison:
    """The tables that :func:`compare_tables` makes."""

    frames: tuple[FrameRow, ...]
    summary: tuple[SummaryRow, ...]
    differences: tuple[DifferenceRow, ...]


def compare_tables(
    rows: Iterable[Mapping[str, Any]], *, strain_max: float | None = None
) -> Comparison:
    """
    Set the variants of fabric tables side by side.

    Parameters
    ----------
    rows : iterable of mapping
        Rows of fabric tables by column; numbers may be None. Groups are source and variant.
    strain_max : float, optional
        Leave frames beyond this strain out of the fits.

    Returns
    -------
    Comparison
        Rows for frames, for sources and variants, and for pairs of variants; what they hold is in
        ``FRAME_MEANINGS``, ``SUMMARY_MEANINGS`` and ``DIFFERENCE_MEANINGS``.

    Raises
    ------
    SettingsError
        If a column is missing, or holds something else than numbers, or if a frame has several rows
        of one variant, as with several cut-offs.

    Examples
    --------
    >>> from scanfab.compare import compare_tables
    >>> rows = [
    ...     dict(source="s", frame=k, strain=0.01 * k, variant="c",
    ...          alpha_vs_axial=0.1 * x, alpha_c_axial=x)
    ...     for k, x in enumerate([0.0, 0.02, 0.05])
    ... ]
    >>> round(compare_tables(rows).summary[0].slope, 12)
    0.1
    """
    groups = _grouped(rows)
    return Comparison(
        frames=tuple(row for group in groups.values() for row in _normalised(group)),
        summary=tuple(
            _summary(source, variant, group, strain_max)
            for (source, variant), group in groups.items()
        ),
        differences=tuple(_differences(groups)),
    )


def _grouped(
    rows: Iterable[Mapping[str, Any]],
) -> dict[tuple[str, str], list[Mapping[str, Any]]]:
    """Rows by source and variant, in the order of their first appearance."""
    rows = list(rows)
    check_rows(rows)
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["source"], row["variant"]), []).append(row)
    for (source, variant), group in groups.items():
        frames = [row["frame"] for row in group]
        if len(set(frames)) < len(frames):
            twice = next(frame for frame in frames if frames.count(frame) > 1)
            raise SettingsError(
                f"{source}, variant {variant}: several rows for frame {twice}: choose the rows of "
                f"one cut-off with --cutoff; two runs of one sample are told apart by "
                f"--label NAME, once for each table"
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
        )
        for row in group
    ]


def _largest(group: Sequence[Mapping[str, Any]], name: str) -> float | None:
    """The largest absolute value of a column."""
    return max((abs(row[name]) for row in group if row[name] is not None), default=None)


def _summary(
    source: str, variant: str, group: Sequence[Mapping[str, Any]], strain_max: float | None
) -> SummaryRow:
    fitted = _points(group, strain_max)
    slope, slope_origin, r2 = _fit(*fitted.T)
    curve = [row for row in group if row["alpha_vs_axial"] is not None]
    peak = max(curve, key=lambda row: abs(row["alpha_vs_axial"]), default=None)
    return SummaryRow(
        source=source,
        variant=variant,
        frames=len(fitted),
        slope=slope,
        slope_origin=slope_origin,
        r2=r2,
        slope_se=_slope_error(group, strain_max) if slope is not None else None,
        peak=None if peak is None else peak["alpha_vs_axial"],
        peak_strain=None if peak is None else peak["strain"],
        final=curve[-1]["alpha_vs_axial"] if curve else None,
    )


def _points(
    group: Sequence[Mapping[str, Any]], strain_max: float | None, suffix: str = ""
) -> FloatArray:
    """Contact and void anisotropy of the frames of a fit, shape (M, 2)."""
    names = [f"alpha_c_axial{suffix}", f"alpha_vs_axial{suffix}"]
    values = [
        [row.get(name) for name in names] for row in group if _within(row["strain"], strain_max)
    ]
    return np.array([pair for pair in values if None not in pair], float).reshape(-1, 2)


def _slope_error(group: Sequence[Mapping[str, Any]], strain_max: float | None) -> float | None:
    """
    Standard error of the slope from the blocks of the sample.

    Frames of one sample are not independent: their scatter about the line says nothing of it.
    """
    frames = len(_points(group, strain_max))
    slopes = []
    for block in range(1, BLOCKS + 1):
        points = _points(group, strain_max, f"_without_{block}")
        slope = _fit(*points.T)[0]
        if slope is None or len(points) < frames:
            return None
        slopes.append(slope)
    return jackknife_error(np.array(slopes))


def _within(strain: float | None, strain_max: float | None) -> bool:
    """Whether a frame belongs to the fit; without a strain nobody can tell, so it does not."""
    return strain_max is None or (strain is not None and strain <= strain_max)


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
        variants=f"{one['variant']}-{other['variant']}",
        difference=one["alpha_vs_axial"] - other["alpha_vs_axial"],
        difference_se=None if None in errors else math.hypot(*errors),  # type: ignore[arg-type]
    )
