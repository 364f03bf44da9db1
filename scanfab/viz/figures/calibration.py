"""The figure calibration: void anisotropy over each ladder, in four panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray
from scanfab.table.curves import short_names
from scanfab.table.row import column_of, total_error
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.style import LOOKS, VOID_AXIAL, VOID_UNIT, WIDTH, band, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure


# ladder: label of the axis, whether it is logarithmic, and the paper's choice
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
        Of :func:`scanfab.calibrate`; lengths of the axes are relative to r_min.
    ladder : str, optional
        ``"spacing"``, ``"directions"``, ``"cutoff"`` or ``"rv"``, for one Axes.

    Raises
    ------
    SettingsError
        If there is no such ladder.
    """

    kind = "calibration"
    order = 8
    lettered = True

    def __init__(self, data: Sequence[Any], ladder: str = "spacing") -> None:
        super().__init__(data)
        if ladder not in PANELS:
            raise SettingsError(f"ladder: expected {', '.join(PANELS)}, found {ladder!r}")
        self.ladder = ladder

    @property
    def size(self) -> tuple[float, float]:
        """Of two rows."""
        return WIDTH, 5.2

    def draw(self, ax: Axes) -> None:
        """One of the ladders."""
        _draw(ax, self._steps(self.ladder), self.ladder)
        ax.legend()

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """All four."""
        panels: list[Axes] = part.subplots(2, 2).ravel().tolist()
        for panel, ladder in zip(panels, PANELS, strict=True):
            _draw(panel, self._steps(ladder), ladder)
        handles, labels = panels[0].get_legend_handles_labels()
        part.legend(handles, labels, loc="outside upper center", ncols=4, title=self._note())
        return panels

    def _note(self) -> str:
        """What was scanned, and what bands, bars and dots are."""
        lines = ["bands: one total standard error, of scan and sample together"]
        if np.isnan(_totals(self.data)).any():
            lines.append("no band where either part is not known")
        lines.append("bars: the scan's part; dotted: the choice of the 2017 paper")
        if self.data:
            source, frame = self.data[0].source, self.data[0].frame
            name = plain(short_names([source])[source])
            lines.insert(0, f"{f'{name}, ' if name else ''}frame {frame}")
        return "\n".join(lines)

    def _steps(self, ladder: str) -> list[Any]:
        return [row for row in self.data if row.ladder == ladder]


def _totals(rows: Sequence[Any]) -> FloatArray:
    """Total errors of the steps that have a void fabric; NaN where they are not known."""
    known = [row for row in rows if row.alpha_vs_axial is not None]
    return column_of([{"total": total_error(row, "alpha_vs_axial")} for row in known], "total")


def _draw(panel: Any, rows: Sequence[Any], ladder: str) -> None:
    """One ladder: a curve for each variant."""
    label, logarithmic, paper = PANELS[ladder]
    for variant in sorted({row.variant for row in rows}):
        steps = [r for r in rows if r.variant == variant and r.alpha_vs_axial is not None]
        values = np.array([row.value for row in steps])
        alphas = 1e3 * np.array([row.alpha_vs_axial for row in steps])
        band(panel, values, alphas, 1e3 * _totals(steps), LOOKS[variant])
        error = [1e3 * (row.alpha_vs_axial_se or 0.0) for row in steps]
        panel.errorbar(values, alphas, error, label=f"variant {variant}", **LOOKS[variant])
    if paper is not None:
        panel.axvline(paper, color="0.6", linewidth=0.8, linestyle=":")
    if logarithmic:
        panel.set_xscale("log")
    panel.set(xlabel=label, ylabel=VOID_UNIT + VOID_AXIAL)
