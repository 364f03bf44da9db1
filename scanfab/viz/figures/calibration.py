"""The figure calibration: void anisotropy over each ladder, in four panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray
from scanfab.table.curves import short_names
from scanfab.table.row import column_of, number_of, total_error
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.style import LABELS, LOOKS, WIDTH, band, plain

# For each ladder: label of the x axis, whether it is logarithmic, and the value in the 2017 paper.
PANELS: dict[str, tuple[str, bool, float | None]] = {
    "spacing": ("spacing of lines $s/r_{min}$", True, 0.1),
    "directions": ("number of directions", True, None),
    "cutoff": ("cut-off $c/r_{min}$", False, 1.0),
    "rv": ("RV radius / half extent", False, 0.67),
}


class Ladders(Figure):
    """
    Void anisotropy over each ladder of a calibration.

    Bands are total standard errors, bars the scan's part.

    Parameters
    ----------
    data : sequence of StepRow
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
    size = (WIDTH, 5.2)

    def __init__(self, data: Sequence[Any], ladder: str = "spacing") -> None:
        super().__init__(data)
        if ladder not in PANELS:
            raise SettingsError(f"ladder: expected {', '.join(PANELS)}, found {ladder!r}")
        self.ladder = ladder

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
        lines = ["bands: one total standard error, of scan and sample together"]
        if np.isnan(_totals(_known(self.data))).any():
            lines.append("no band where either part is not known")
        lines.append("bars: the scan's part; dotted: the choice of the 2017 paper")
        if self.data:
            source, frame = self.data[0].source, self.data[0].frame
            name = plain(short_names([source])[source])
            lines.insert(0, f"{f'{name}, ' if name else ''}frame {frame}")
        handles, labels = panels[0].get_legend_handles_labels()
        above: dict[str, Any] = {"loc": "outside upper center", "title": "\n".join(lines)}
        part.legend(handles, labels, ncols=4, **above)
        return panels

    def _draw_ladder(self, panel: Axes, ladder: str) -> None:
        """Draw a curve for each variant."""
        label, logarithmic, paper = PANELS[ladder]
        rows = [row for row in self.data if row.ladder == ladder]
        for variant in sorted({row.variant for row in rows}):
            steps = _known([row for row in rows if row.variant == variant])
            values, alphas = column_of(steps, "value"), 1e3 * column_of(steps, "alpha_vs_axial")
            band(panel, values, alphas, 1e3 * _totals(steps), LOOKS[variant])
            error = [1e3 * (number_of(row, "alpha_vs_axial_se") or 0.0) for row in steps]
            panel.errorbar(values, alphas, error, label=f"variant {variant}", **LOOKS[variant])
        if paper is not None:
            panel.axvline(paper, color="0.6", linewidth=0.8, linestyle=":")
        if logarithmic:
            panel.set_xscale("log")
        panel.set(xlabel=label, ylabel=LABELS["alpha_vs_axial"])


def _known(rows: Sequence[Any]) -> list[Any]:
    """Select the steps that have a void fabric."""
    return [row for row in rows if row.alpha_vs_axial is not None]


def _totals(rows: Sequence[Any]) -> FloatArray:
    """Total errors of steps; NaN where an error is not known."""
    return np.array([total_error(row, "alpha_vs_axial") for row in rows], np.float64)
