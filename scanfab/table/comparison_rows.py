"""The rows of a comparison: of frames, of sources and variants, of pairs of variants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray
from scanfab.table.preview import with_error
from scanfab.table.reading import variant_of
from scanfab.table.row import Record

if TYPE_CHECKING:
    from scanfab.table.table import Table


@dataclass(frozen=True, kw_only=True, slots=True)
class FrameRow(Record):
    """One frame and variant, with both anisotropies divided by their own largest absolute value."""

    source: Annotated[str, "as in the fabric table"]
    frame: Annotated[int, "as in the fabric table"]
    strain: Annotated[float | None, "as in the fabric table"]
    variant: Annotated[str, "as in the fabric table"]
    alpha_vs_axial: Annotated[
        float | None,
        "signed anisotropy of the void fabric along the loading axis",
    ]
    alpha_c_axial: Annotated[
        float | None,
        "signed anisotropy of the contact fabric along the loading axis",
    ]
    alpha_vs_axial_norm: Annotated[
        float | None,
        "alpha_vs_axial over its largest absolute value in the source's variant",
    ]
    alpha_c_axial_norm: Annotated[float | None, "alpha_c_axial likewise"]
    alpha_vs_axial_se: Annotated[
        float | None,
        "as in the fabric table: the scan's part of the error",
    ]
    alpha_vs_axial_sample_se: Annotated[
        float | None,
        "as in the fabric table: the sample's part of the error",
    ]
    alpha_vs_axial_total_se: Annotated[
        float | None,
        "both together, √(scan² + sample²); empty where either is",
    ]
    alpha_c_axial_sample_se: Annotated[
        float | None,
        "as in the fabric table; contacts are counted, not scanned, so this is all of the error",
    ]
    shear_strain: Annotated[float | None, "as in the fabric table"]
    rv: Annotated[float | None, "as in the fabric table: only where that has several RVs"] = None


@dataclass(frozen=True, kw_only=True, slots=True)
class SummaryRow(Record):
    """One source and variant: void fabric against contact fabric over the frames."""

    source: Annotated[str, "as in the fabric table"]
    variant: Annotated[str, "as in the fabric table"]
    frames: Annotated[int, "number of frames that enter the fits"]
    slope: Annotated[
        float | None,
        "least-squares slope of alpha_vs_axial on alpha_c_axial, with an intercept",
    ]
    slope_origin: Annotated[float | None, "that slope through the origin"]
    r2: Annotated[float | None, "R² of the fit with an intercept"]
    slope_se: Annotated[
        float | None,
        "standard error of the slope from the sample's octants, each left out in all "
        "frames; empty if a frame has no values without octants",
    ]
    peak: Annotated[float | None, "alpha_vs_axial where its absolute value is largest"]
    peak_strain: Annotated[
        float | None,
        "the strain there; shear_strain where strain is the same in all frames",
    ]
    final: Annotated[float | None, "alpha_vs_axial of the last frame that has one"]
    rv: Annotated[float | None, "as in the fabric table: only where that has several RVs"] = None


@dataclass(frozen=True, kw_only=True, slots=True)
class DifferenceRow(Record):
    """How far two variants of one frame are apart."""

    source: Annotated[str, "as in the fabric table"]
    frame: Annotated[int, "as in the fabric table"]
    strain: Annotated[float | None, "as in the fabric table"]
    variants: Annotated[str, "the two variants, for instance a-b"]
    difference: Annotated[float, "alpha_vs_axial of the first minus that of the second"]
    difference_se: Annotated[
        float | None,
        "its standard error as if both scans were independent, which is too large where "
        "they share lines",
    ]


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
        return self._numbers("slope")

    @property
    def slope_se(self) -> FloatArray:
        """Its standard error from the sample's octants."""
        return self._numbers("slope_se")

    @property
    def r2(self) -> FloatArray:
        """R² of each fit."""
        return self._numbers("r2")

    @property
    def peak(self) -> FloatArray:
        """The void anisotropy that is largest in size, for each row of the summary."""
        return self._numbers("peak")

    def _numbers(self, name: str) -> FloatArray:
        return self.summary[name].astype(float)

    def __repr__(self) -> str:
        lines = [
            f"{one.source}, variant {variant_of(one)}: "
            f"slope {with_error(one.slope, one.slope_se)}, {counted(one.frames, 'frame')}"
            for one in self.summary
        ]
        return "\n".join([f"Comparison of {len(self.frames)} rows", *lines])
