"""The figure cutoffs: void anisotropy over the cut-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.row import number_of, total_error
from scanfab.viz.figures.figure import FrameFigure
from scanfab.viz.figures.style import (
    COLUMN,
    FRAME_LOOKS,
    VOID_AXIAL,
    VOID_UNIT,
    band,
    widen,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure

    from scanfab.viz.scanned_frames import ScannedFrame


# in smallest radii
CUTOFFS = (0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)


@dataclass(frozen=True, eq=False)
class CutoffCurve:
    """One frame: anisotropy over the cut-off, which is in units of the smallest radius."""

    title: str
    cutoff: FloatArray
    alpha: FloatArray
    """alpha_vs_axial, dimensionless."""
    error: FloatArray
    """The scan's part of its standard error."""
    total: FloatArray
    """Its standard error, of scan and sample together; NaN where either is not known."""
    chosen: float
    predicted: FloatArray
    """alpha_vs_axial as the contacts predict it; NaN where they do not."""


class Cutoffs(FrameFigure):
    """
    Void anisotropy over the cut-off, along the lines of the table; a curve for each frame.

    Bands are total standard errors, bars the scan's part.

    Parameters
    ----------
    data : ScannedFrames
        Of :func:`scanfab.scan_frames`.
    frame : int, optional
        The number of a frame, to draw that one alone.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """

    order = 7
    slow = True

    @cached_property
    def curves(self) -> list[CutoffCurve]:
        """What is drawn of each frame."""
        return [_curve_of(one) for one in self.chosen(self.data.with_lines_of_table)]

    @property
    def size(self) -> tuple[float, float]:
        """Of one panel, with the legend above it."""
        return COLUMN, 3.4

    @property
    def caption(self) -> str:
        """With the variant and the source."""
        return (
            f"Void anisotropy along the loading axis over the cut-off, {self.data.name}, with "
            f"total standard errors."
        )

    def draw(self, ax: Axes) -> None:
        """With the legend in the panel."""
        draw_curves(ax, self.curves)
        ax.legend(title=_note(self.curves))

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """With the legend above the panel."""
        axes = part.subplots()
        draw_curves(axes, self.curves)
        part.legend(loc="outside upper left", title=_note(self.curves))
        return [axes]


def draw_curves(axes: Axes, curves: Sequence[CutoffCurve]) -> None:
    """A curve for each frame, with the cut-off of the table."""
    for curve, look in zip(curves, FRAME_LOOKS, strict=False):
        band(axes, curve.cutoff, 1e3 * curve.alpha, 1e3 * curve.total, look["color"])
        axes.errorbar(
            curve.cutoff,
            1e3 * curve.alpha,
            yerr=1e3 * np.nan_to_num(curve.error),
            label=curve.title,
            elinewidth=0.9,
            **look,
        )
        axes.plot(curve.cutoff, 1e3 * curve.predicted, color=look["color"], lw=1.2, ls="-.")
    if any(np.isfinite(curve.predicted).any() for curve in curves):
        axes.plot([], [], color="0.3", lw=1.2, ls="-.", label="predicted from near contacts")
    axes.axvline(curves[-1].chosen, color="k", lw=0.9, ls=":", label="cut-off of the table")
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    axes.set(xlabel=r"cut-off / $r_{min}$", ylabel=VOID_UNIT + VOID_AXIAL)
    widen(axes, 1.0)


def _note(curves: Sequence[CutoffCurve]) -> str:
    """What bands and bars are."""
    hole = any((np.isfinite(one.alpha) & ~np.isfinite(one.total)).any() for one in curves)
    without = "\n(none where either is not known)" if hole else ""
    return f"bands: one total standard error, scan and sample{without}\nbars: the scan's part"


def _curve_of(frame: ScannedFrame) -> CutoffCurve:
    """The lines of the table at other cut-offs, and at its own."""
    # compiled kernels, which those who draw something else do without
    from scanfab.packing.sample import VARIANTS
    from scanfab.pipeline.variant_columns import VariantColumns

    smallest, chosen = frame.smallest, frame.measurement.plan.cutoff
    lengths = {*(cutoff * smallest for cutoff in CUTOFFS), chosen}
    measured = frame.measurement.at_cutoffs(lengths)
    each = [
        VariantColumns(measured, VARIANTS[frame.variant], place) for place in range(len(lengths))
    ]
    rows = [one.columns() for one in each]

    def column(values: Sequence[float | None]) -> FloatArray:
        return np.array([np.nan if one is None else one for one in values], np.float64)

    return CutoffCurve(
        frame.title,
        cutoff=column([number_of(row, "cutoff") for row in rows]) / smallest,
        alpha=column([number_of(row, "alpha_vs_axial") for row in rows]),
        error=column([number_of(row, "alpha_vs_axial_se") for row in rows]),
        total=column([total_error(row, "alpha_vs_axial") for row in rows]),
        chosen=chosen / smallest,
        predicted=column([one.predicted_alpha for one in each]),
    )
