"""
The figures histogram, cutoffs and calibration: what the settings of a scan do to its results.

They show the lengths of void segments, and the void anisotropy over the cut-off and over the
settings that a calibration tries.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from scanfab.base.option import one_of
from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.table.curves import short_names
from scanfab.table.row import column_of, numbers_of, total_errors
from scanfab.viz.figures import style
from scanfab.viz.figures.figure import Figure, FrameFigure

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame

ALPHA = "alpha_vs_axial"
LINES = 6_000
# cut-offs that are drawn, in units of the smallest radius
CUTOFFS = (0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)
BANDS = "bands: standard error of scan and sample, where known"
# For each ladder: label and scale of the x axis, and the value in the 2017 paper.
PANELS: dict[str, tuple[str, str, float | None]] = {
    "spacing": ("spacing of lines $s/r_{min}$", "log", 0.1),
    "directions": ("number of directions", "log", None),
    "cutoff": ("cut-off $c/r_{min}$", "linear", 1.0),
    "rv": ("RV radius / half extent", "linear", 0.67),
}


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
    size = (style.COLUMN, 3.2)
    drawn, more = "Lengths of the void segments", "; those below the cut-off are dropped"

    @cached_property
    def lengths(self) -> list[FloatArray]:
        """Lengths of void segments of each frame, in units of its smallest radius."""
        return [_lengths_of(one) for one in self.frames]

    def draw(self, ax: Axes) -> None:
        """Draw the density of the lengths; lengths below the cut-off are on grey."""
        longest = max(float(np.quantile(length, 0.999)) for length in self.lengths)
        edges, each = np.linspace(0, longest, 41), zip(self.frames, self.lengths, strict=True)
        for (frame, length), look in zip(each, style.FRAME_LOOKS, strict=False):
            density, _ = np.histogram(length, edges, density=True)
            label = f"{frame.title}:\n{100 * np.mean(length < frame.cutoff):.0f} % dropped"
            line: dict[str, Any] = {"color": look["color"], "ls": look["ls"], "lw": 1.1}
            ax.stairs(density, edges, baseline=None, label=label, **line)
        # in a later frame the smallest grain may be another one; the last cut-off is drawn
        ax.axvspan(0, frame.cutoff, color="0.92", zorder=0)
        ax.axvline(frame.cutoff, color="k", lw=0.9, ls=":", label="cut-off")
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
    size = (style.COLUMN, 3.4)
    drawn = "Void anisotropy along the loading axis over the cut-off"
    more = ", with total standard errors"

    @cached_property
    def curves(self) -> list[list[dict[str, Any]]]:
        """
        The rows of each frame, one for each cut-off, with the columns of the table.

        ``value`` is the cut-off in units of the smallest radius, ``predicted`` the alpha_vs_axial
        that near contacts predict.
        """
        return [_curve_of(one) for one in self.frames]

    def draw(self, ax: Axes) -> None:
        """Draw a curve for each frame, and the cut-off of the table."""
        each = zip(self.frames, self.curves, strict=True)
        for (frame, rows), look in zip(each, style.FRAME_LOOKS, strict=False):
            draw_alpha(ax, rows, look, frame.title)
            x, predicted = (column_of(rows, name) for name in ("value", "predicted"))
            ax.plot(x, 1e3 * predicted, color=look["color"], lw=1.2, ls="-.")
        if any(numbers_of(rows, "predicted") for rows in self.curves):
            ax.plot([], [], color="0.3", lw=1.2, ls="-.", label="predicted from near contacts")
        ax.axvline(frame.cutoff, color="k", lw=0.9, ls=":", label="cut-off of the table")
        ax.axhline(0, color="0.6", lw=0.6, zorder=0)
        ax.set(xlabel=r"cut-off / $r_{min}$", ylabel=style.LABELS[ALPHA])
        style.widen(ax, 1.0)
        ax.legend(title=f"{BANDS}\nbars: the scan's part")


def draw_alpha(ax: Axes, rows: Sequence[Any], look: dict[str, Any], label: str) -> None:
    """Draw void anisotropy over ``value``, with bands of total errors, and bars for the scan."""
    x, alpha, scan = (column_of(rows, name) for name in ("value", ALPHA, f"{ALPHA}_se"))
    style.band(ax, x, 1e3 * alpha, 1e3 * total_errors(rows, ALPHA), look)
    ax.errorbar(x, 1e3 * alpha, 1e3 * np.nan_to_num(scan), label=label, elinewidth=0.9, **look)


def _curve_of(frame: ScannedFrame) -> list[dict[str, Any]]:
    """The lines of the table at other cut-offs, and at its own."""
    # loaded here, as other figures do without compiled kernels
    from scanfab.packing.sample import VARIANTS
    from scanfab.pipeline.frame import VariantColumns

    lengths = sorted({*(one * frame.smallest for one in CUTOFFS), frame.measurement.plan.cutoff})
    measured, variant = frame.measurement.at_cutoffs(lengths), VARIANTS[frame.variant]
    each = [VariantColumns(measured, variant, place) for place in range(len(lengths))]
    return [
        {**one.columns(), "value": length / frame.smallest, "predicted": one.predicted_alpha}
        for one, length in zip(each, lengths, strict=True)
    ]


class Ladders(Figure):
    """
    Void anisotropy over each ladder of a calibration.

    Bands are total standard errors, bars the scan's part.

    Parameters
    ----------
    data : steps of a calibration
        The steps of :func:`scanfab.calibrate`. Spacings and cut-offs are divided by r_min.
    ladder : str, optional
        The ladder to draw on one Axes: ``"spacing"``, ``"directions"``, ``"cutoff"`` or ``"rv"``.

    Raises
    ------
    SettingsError
        If there is no such ladder.
    """

    kind = "calibration"
    order = 8
    size = (style.WIDTH, 5.2)

    def __init__(self, data: Sequence[Any], ladder: str = "spacing") -> None:
        super().__init__(data)
        self.ladder = one_of(*PANELS)("ladder", ladder)

    def draw(self, ax: Axes) -> None:
        """Draw the chosen ladder."""
        self._draw_ladder(ax, self.ladder)
        ax.legend()

    def panels(self, part: FigureBase) -> list[Axes]:
        """Draw all four ladders."""
        panels: list[Axes] = part.subplots(2, 2).ravel().tolist()
        for panel, ladder in zip(panels, PANELS, strict=True):
            self._draw_ladder(panel, ladder)
        # the legend's title names the frame and explains bands, bars and dotted lines
        lines = [BANDS, "bars: the scan's part; dotted: the choice of the 2017 paper"]
        if self.data:
            source, frame = self.data[0].source, self.data[0].frame
            name = style.plain(short_names([source])[source])
            lines.insert(0, f"{f'{name}, ' if name else ''}frame {frame}")
        above: dict[str, Any] = {"loc": "outside upper center", "title": "\n".join(lines)}
        part.legend(*panels[0].get_legend_handles_labels(), ncols=4, **above)
        return panels

    def _draw_ladder(self, panel: Axes, ladder: str) -> None:
        """Draw a curve for each variant."""
        label, scale, paper = PANELS[ladder]
        rows = [row for row in self.data if row.ladder == ladder and row[ALPHA] is not None]
        for variant in sorted({row.variant for row in rows}):
            steps = [row for row in rows if row.variant == variant]
            draw_alpha(panel, steps, style.LOOKS[variant], f"variant {variant}")
        if paper is not None:
            panel.axvline(paper, color="0.6", linewidth=0.8, linestyle=":")
        panel.set(xlabel=label, xscale=scale, ylabel=style.LABELS[ALPHA])
