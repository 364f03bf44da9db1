"""Void against contact fabric, with the lines that the comparison fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.curves import Curve
from scanfab.viz.figures.groups import Drawn, Group
from scanfab.viz.figures.style import (
    CONTACT,
    CONTACT_AXIAL,
    CONTACT_INTENSITY,
    CONTACT_UNIT,
    VOID,
    VOID_AXIAL,
    VOID_INTENSITY,
    VOID_UNIT,
    widen,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = ["PAPER_SLOPE", "Fit", "draw_correlation", "draw_group"]


PAPER_SLOPE = 0.096


@dataclass(frozen=True)
class Fit:
    """The line of one source and variant, as the comparison has it; dimensionless."""

    slope: float
    slope_se: float | None
    r2: float | None
    contact: tuple[float, float]
    """Smallest and largest contact anisotropy of the fitted frames."""
    middle: tuple[float, float]
    """Their mean contact and void anisotropy, which the line goes through."""


def draw_correlation(
    part: Figure | SubFigure, groups: Sequence[Group], fits: Sequence[Fit | None], turned: bool
) -> tuple[list[Axes], str]:
    """
    A panel for each group, beside it the legend, which has the numbers; and a caption.

    Where the axes are turned, the intensities are drawn, of which there is no line.
    """
    panels = part.subplots(len(groups), 2, squeeze=False, width_ratios=(3, 2))
    lines: list[str] = []
    for group, (axes, margin) in zip(groups, panels, strict=True):
        lines += draw_group(axes, margin, group, fits, turned)
    what = "intensity" if turned else "anisotropy along the loading axis"
    drawn = f"with {' and '.join(dict.fromkeys(lines))}" if lines else "without a line"
    return [axes for axes, _ in panels], f"Void against contact {what}, {drawn}"


def draw_group(
    axes: Axes, margin: Axes | None, group: Group, fits: Sequence[Fit | None], turned: bool
) -> list[str]:
    """
    The points and lines of one panel, and which kinds of lines there are.

    The legend stands in the margin, or in the panel itself where there is none.
    """
    legend = _Legend()
    fitted = [] if turned else [fits[one.place] for one in group.drawn]
    for one in group.drawn:
        _points(axes, one, None if turned else fits[one.place], legend, turned)
    lines = ["fitted lines"] * any(fit is not None for fit in fitted)
    lines += ["the paper's slope"] * _paper(axes, fitted, legend)
    _errors(group, legend, turned)
    _label(axes, turned)
    title = "intensities" if turned else f"slope of {VOID} on {CONTACT}, axial"
    if margin is None:
        axes.legend(legend.handles, legend.labels, title=title)
    else:
        legend.draw(margin, title)
    return lines


class _Legend:
    """Lines of a legend that stands in the axes beside the panel."""

    def __init__(self) -> None:
        self.handles: list[Any] = []
        self.labels: list[str] = []

    def add(self, handle: Any, label: str) -> None:
        self.handles.append(handle)
        self.labels.append(label)

    def draw(self, margin: Axes, title: str) -> None:
        margin.set_axis_off()
        margin.legend(
            self.handles, self.labels, loc="center left", title=title, handlelength=2.5,
            borderaxespad=0,
        )  # fmt: skip


def _points(axes: Axes, one: Drawn, fit: Fit | None, legend: _Legend, turned: bool) -> None:
    """The frames of a curve, with their total errors, and its line."""
    look = {key: value for key, value in one.look.items() if key != "ls"}
    x, y = _values(one.curve, turned)
    points = axes.errorbar(
        1e2 * x,
        1e3 * y,
        xerr=None if turned else _bars(1e2 * one.curve.contact_total),
        yerr=None if turned else _bars(1e3 * one.curve.void_total),
        ls="none",
        elinewidth=0.5,
        capsize=0,
        zorder=2.5,
        **look,
    )
    for bars in points.lines[2]:
        bars.set_alpha(0.4)
    if fit is None:
        legend.add(points, one.name if turned else f"{one.name}:\nno line")
        return
    ends = np.array(fit.contact)
    void = fit.middle[1] + fit.slope * (ends - fit.middle[0])
    (line,) = axes.plot(1e2 * ends, 1e3 * void, color=look["color"], ls=one.look["ls"], gid="fit")
    legend.add((line, points), f"{one.name}:\n{_spell(fit)}")


def _values(curve: Curve, turned: bool) -> tuple[FloatArray, FloatArray]:
    if turned:
        return curve.contact_intensity, curve.void_intensity
    return curve.contact, curve.void


def _bars(error: FloatArray) -> FloatArray | None:
    return np.nan_to_num(error) if np.isfinite(error).any() else None


def _paper(axes: Axes, fits: Sequence[Fit | None], legend: _Legend) -> bool:
    """The slope that the paper prints, through the origin; whether it is drawn."""
    reach = max((fit.contact[1] for fit in fits if fit is not None), default=0.0)
    if reach > 0:
        (line,) = axes.plot([0, 1e2 * reach], [0, 1e3 * PAPER_SLOPE * reach], "k:", lw=0.9)
        legend.add(line, f"2017 paper: {PAPER_SLOPE:.3f}")
    return reach > 0


def _errors(group: Group, legend: _Legend, turned: bool) -> None:
    from matplotlib.lines import Line2D

    if turned:
        return
    curves = [one.curve for one in group.drawn]
    void = any(np.isfinite(curve.void_total).any() for curve in curves)
    contact = any(np.isfinite(curve.contact_total).any() for curve in curves)
    # the bars themselves: a line without a point would look like the axis through zero
    shape = {(True, True): "+", (True, False): "|", (False, True): "_"}.get((void, contact))
    if shape is not None:
        alone = contact and any(curve.contact_alone for curve in curves)
        which = f",\nof {CONTACT} as if contacts\nwere independent" if alone else ""
        bars = Line2D([], [], color="0.4", marker=shape, markersize=11, mew=0.6, ls="none")
        legend.add(bars, f"one total standard error{which}")


def _label(axes: Axes, turned: bool) -> None:
    axes.set_xlabel(CONTACT_UNIT + (CONTACT_INTENSITY if turned else CONTACT_AXIAL))
    axes.set_ylabel(VOID_UNIT + (VOID_INTENSITY if turned else VOID_AXIAL))
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    widen(axes, 1.0)


def _spell(fit: Fit) -> str:
    """The slope as the table has it, with its error and R² where they exist."""
    error = "" if fit.slope_se is None else rf" $\pm$ {fit.slope_se:.3f}"
    r2 = "" if fit.r2 is None else f", $R^2$ = {fit.r2:.3f}"
    return f"{fit.slope:.3f}{error}{r2}"
