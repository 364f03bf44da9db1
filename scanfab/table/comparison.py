"""The rows of a comparison: of frames, of sources and variants, of pairs of variants."""

from __future__ import annotations

from dataclasses import dataclass

from scanfab.base.typing import FloatArray

__all__ = [
    "DIFFERENCE_MEANINGS",
    "FRAME_MEANINGS",
    "SUMMARY_MEANINGS",
    "Comparison",
    "DifferenceRow",
    "FrameRow",
    "SummaryRow",
]


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
    alpha_vs_axial_se: float | None
    alpha_vs_axial_sample_se: float | None
    alpha_vs_axial_total_se: float | None
    alpha_c_axial_sample_se: float | None
    shear_strain: float | None


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
    "alpha_vs_axial_se": "as in the fabric table: the scan's part of the error",
    "alpha_vs_axial_sample_se": "as in the fabric table: the sample's part of the error",
    "alpha_vs_axial_total_se": "both together, √(scan² + sample²); empty where either is",
    "alpha_c_axial_sample_se": "as in the fabric table; contacts are counted, not scanned, so this "
    "is all of the error",
    "shear_strain": "as in the fabric table",
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
    "peak_strain": "the strain there; shear_strain where strain is the same in all frames",
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


@dataclass(frozen=True, eq=False)
class Comparison:
    """The tables that :func:`scanfab.compare_tables` makes."""

    frames: tuple[FrameRow, ...]
    summary: tuple[SummaryRow, ...]
    differences: tuple[DifferenceRow, ...]
    points: tuple[FloatArray, ...]
    """For each row of the summary, contact and void anisotropy of the frames in its fits, shape
    (frames, 2)."""
