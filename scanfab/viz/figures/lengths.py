"""The figures histogram and cutoffs: how long the void segments are, and what a cut-off does."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.table.row import column_of, total_error
from scanfab.viz.figures.figure import FrameFigure
from scanfab.viz.figures.style import COLUMN, FRAME_LOOKS, LABELS, band, widen

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame

LINES = 6_000
# cut-offs that are drawn, in units of the smallest radius
CUTOFFS = (0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)


class OnePanel(FrameFigure):
    """A figure of frames in one panel."""

    def panels(self, part: FigureBase) -> list[Axes]:
        """One panel; its legend moves from the panel to the page above it."""
        (axes,) = super().panels(part)
        inside = axes.get_legend()
        assert inside is not None
        part.legend(loc="outside upper left", title=inside.get_title().get_text())
        inside.remove()
        return [axes]


class Histogram(OnePanel):
    """
    Lengths of the void segments, with the cut-off; an outline for each frame.

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

    order = 6
    size = (COLUMN, 3.2)
    drawn, more = "Lengths of the void segments", "; those below the cut-off are dropped"

    @cached_property
    def lengths(self) -> list[FloatArray]:
        """Lengths of void segments of each frame, in units of its smallest radius."""
        return [_lengths_of(one) for one in self.chosen(self.data.frames)]

    def draw(self, ax: Axes) -> None:
        """Draw the density of the lengths; lengths below the cut-off are on grey."""
        longest = max(float(np.quantile(length, 0.999)) for length in self.lengths)
        edges, frames = np.linspace(0, longest, 41), self.chosen(self.data.frames)
        for frame, length, look in zip(frames, self.lengths, FRAME_LOOKS, strict=False):
            density, _ = np.histogram(length, edges, density=True)
            cutoff = frame.measurement.plan.cutoff / frame.smallest
            label = f"{frame.title}:\n{100 * np.mean(length < cutoff):.0f} % dropped"
            style: dict[str, Any] = {"color": look["color"], "ls": look["ls"], "lw": 1.1}
            ax.stairs(density, edges, baseline=None, label=label, **style)
        ax.axvspan(0, cutoff, color="0.92", zorder=0)
        ax.axvline(cutoff, color="k", lw=0.9, ls=":", label="cut-off")
        ax.set(yscale="log", xlim=(0, longest), ylabel="probability density")
        ax.set(xlabel=r"void segment length / $r_{min}$")
        ax.legend()


def _lengths_of(frame: ScannedFrame) -> FloatArray:
    """Lengths of void segments on lines in even directions, tens of thousands of them."""
    # loaded here, as other figures do without compiled kernels
    from scanfab.scan.lines import line_triads, sample_segments

    points, _ = direction_points(frame.space)
    some = points[: len(points) // 2 : 5 if frame.space.is_plane else 20]
    triads = line_triads(some, frame.space)
    position, radius, window = frame.spheres
    found = sample_segments(position, radius, triads, LINES, window, frame.space)
    lengths: FloatArray = found.length[found.void] / frame.smallest
    return lengths


class CutoffCurve(NamedTuple):
    """Anisotropy of one frame over the cut-off, which is in units of the smallest radius."""

    title: str
    cutoff: FloatArray
    alpha: FloatArray
    """alpha_vs_axial, dimensionless."""
    error: FloatArray
    """The scan's part of its standard error."""
    total: FloatArray
    """Standard error of scan and sample together; NaN if one of them is not known."""
    chosen: float
    predicted: FloatArray
    """alpha_vs_axial as predicted from near contacts; NaN if there is no prediction."""


class Cutoffs(OnePanel):
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
    size = (COLUMN, 3.4)
    drawn = "Void anisotropy along the loading axis over the cut-off"
    more = ", with total standard errors"

    @cached_property
    def curves(self) -> list[CutoffCurve]:
        """What is drawn of each frame."""
        return [_curve_of(one) for one in self.chosen(self.data.with_lines_of_table)]

    def draw(self, ax: Axes) -> None:
        """Draw a curve for each frame, and the cut-off of the table."""
        for one, look in zip(self.curves, FRAME_LOOKS, strict=False):
            band(ax, one.cutoff, 1e3 * one.alpha, 1e3 * one.total, look)
            error = 1e3 * np.nan_to_num(one.error)
            ax.errorbar(one.cutoff, 1e3 * one.alpha, error, label=one.title, elinewidth=0.9, **look)
            ax.plot(one.cutoff, 1e3 * one.predicted, color=look["color"], lw=1.2, ls="-.")
        if any(np.isfinite(one.predicted).any() for one in self.curves):
            ax.plot([], [], color="0.3", lw=1.2, ls="-.", label="predicted from near contacts")
        ax.axvline(self.curves[-1].chosen, color="k", lw=0.9, ls=":", label="cut-off of the table")
        ax.axhline(0, color="0.6", lw=0.6, zorder=0)
        ax.set(xlabel=r"cut-off / $r_{min}$", ylabel=LABELS["alpha_vs_axial"])
        widen(ax, 1.0)
        hole = any((np.isfinite(one.alpha) & ~np.isfinite(one.total)).any() for one in self.curves)
        without = "\n(none where either is not known)" if hole else ""
        note = f"bands: one total standard error, scan and sample{without}\nbars: the scan's part"
        ax.legend(title=note)


def _curve_of(frame: ScannedFrame) -> CutoffCurve:
    """The lines of the table at other cut-offs, and at its own."""
    # loaded here, as other figures do without compiled kernels
    from scanfab.packing.sample import VARIANTS
    from scanfab.pipeline.frame import VariantColumns

    smallest, chosen = frame.smallest, frame.measurement.plan.cutoff
    lengths = {*(cutoff * smallest for cutoff in CUTOFFS), chosen}
    measured, variant = frame.measurement.at_cutoffs(lengths), VARIANTS[frame.variant]
    each = [VariantColumns(measured, variant, place) for place in range(len(lengths))]
    rows = [{**one.columns(), "predicted": one.predicted_alpha} for one in each]
    return CutoffCurve(
        frame.title,
        cutoff=column_of(rows, "cutoff") / smallest,
        alpha=column_of(rows, "alpha_vs_axial"),
        error=column_of(rows, "alpha_vs_axial_se"),
        total=np.array([total_error(row, "alpha_vs_axial") for row in rows], np.float64),
        chosen=chosen / smallest,
        predicted=column_of(rows, "predicted"),
    )
