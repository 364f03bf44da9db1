"""The figure correlation: void against contact fabric, with the lines that a comparison fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.compare import Comparison, compare_tables
from scanfab.table.curves import Curve, is_turned
from scanfab.table.row import Row, number_of
from scanfab.table.table import Table
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.groups import Drawn, Group, group_of, groups_of
from scanfab.viz.figures.strain_curves import ROW
from scanfab.viz.figures.style import (
    CONTACT,
    CONTACT_AXIAL,
    CONTACT_INTENSITY,
    CONTACT_UNIT,
    VOID,
    VOID_AXIAL,
    VOID_INTENSITY,
    VOID_UNIT,
    WIDTH,
    widen,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure


# as the 2017 paper prints them, of spheres and of discs
PAPER_SLOPE, PAPER_SLOPE_2D = 0.096, 0.231
# heights in inches: a legend without curves, and the two lines of each curve
LEGEND, ENTRY = 1.0, 0.32


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


def fits_of(comparison: Comparison) -> list[Fit | None]:
    """The line of each source and variant as the comparison's summary has it; None without one."""
    return [
        _fit(one, points) for one, points in zip(comparison.summary, comparison.points, strict=True)
    ]


def _fit(summary: Row, points: FloatArray) -> Fit | None:
    if summary.slope is None:
        return None
    middle = points.mean(axis=0)
    return Fit(
        slope=summary.slope,
        slope_se=summary.slope_se,
        r2=summary.r2,
        contact=(float(points[:, 0].min()), float(points[:, 0].max())),
        middle=(float(middle[0]), float(middle[1])),
    )


class Correlation(Figure):
    """
    Void against contact anisotropy, with the lines that the comparison fits.

    Bars are total standard errors. Where the principal axes are not the loading axis, the
    intensities are drawn, of which there is no line.

    Parameters
    ----------
    data : Table
        A fabric table; on one Axes of one source, or of one variant.
    comparison : Comparison, optional
        Of the same table, with the lines to draw: ``table.compare(strain_max=0.05)``. By default
        all frames are fitted.

    Raises
    ------
    SettingsError
        If there is nothing to draw, or too much for one Axes.
    """

    order = 3
    columns = ("variant", "alpha_vs_axial", "strain", "alpha_c_axial")
    lettered = True

    def __init__(self, data: Table, comparison: Comparison | None = None) -> None:
        super().__init__(data)
        self.groups = groups_of(data)
        self.turned = is_turned(data)
        self.in_plane = any(
            number_of(row, f"gvs_{axis}") == 0.0 for row in data for axis in ("xx", "yy", "zz")
        )
        self.fits = fits_of(compare_tables(data) if comparison is None else comparison)

    @property
    def size(self) -> tuple[float, float]:
        """A panel for each group, its legend beside it, which may be the higher one."""
        curves = max(len(group.drawn) for group in self.groups)
        higher = max(LEGEND + ENTRY * curves - 2.6, 0.0)
        return WIDTH, 2.6 + ROW * (len(self.groups) - 1) + higher * len(self.groups)

    @property
    def caption(self) -> str:
        """With which lines there are."""
        what = "intensity" if self.turned else "anisotropy along the loading axis"
        fits = [] if self.turned else [fit for fit in self.fits if fit is not None]
        lines = ["fitted lines"] * bool(fits)
        lines += ["the paper's slope"] * any(fit.contact[1] > 0 for fit in fits)
        drawn = f"with {' and '.join(lines)}" if lines else "without a line"
        return f"Void against contact {what}, {drawn}."

    def draw(self, ax: Axes) -> None:
        """With the legend in the panel."""
        _draw_group(ax, None, group_of(self.groups), self.fits, self.turned, self.in_plane)

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """A panel for each group, beside it the legend, which has the numbers."""
        panels = part.subplots(len(self.groups), 2, squeeze=False, width_ratios=(3, 2))
        for group, (axes, margin) in zip(self.groups, panels, strict=True):
            _draw_group(axes, margin, group, self.fits, self.turned, self.in_plane)
            axes.set_title(group.title, loc="left")
        return [axes for axes, _ in panels]


def _draw_group(
    axes: Axes,
    margin: Axes | None,
    group: Group,
    fits: Sequence[Fit | None],
    turned: bool,
    in_plane: bool,
) -> None:
    """
    The points and lines of one panel.

    The legend stands in the margin, or in the panel itself where there is none.
    """
    legend = _Legend()
    fitted = [] if turned else [fits[one.place] for one in group.drawn]
    for one in group.drawn:
        _points(axes, one, None if turned else fits[one.place], legend, turned)
    _paper(axes, fitted, legend, in_plane)
    _errors(group, legend, turned)
    _label(axes, turned)
    title = "intensities" if turned else f"slope of {VOID} on {CONTACT}, axial"
    if margin is None:
        axes.legend(legend.handles, legend.labels, title=title)
    else:
        legend.draw(margin, title)


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
        xerr=None if turned else _bars(1e2 * one.curve.total_errors("alpha_c_axial")),
        yerr=None if turned else _bars(1e3 * one.curve.total_errors("alpha_vs_axial")),
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
    ending = "" if turned else "_axial"
    return curve.values(f"alpha_c{ending}"), curve.values(f"alpha_vs{ending}")


def _bars(error: FloatArray) -> FloatArray | None:
    return np.nan_to_num(error) if np.isfinite(error).any() else None


def _paper(axes: Axes, fits: Sequence[Fit | None], legend: _Legend, in_plane: bool) -> None:
    """The slope that the paper prints, through the origin, as far as there are contacts."""
    reach = max((fit.contact[1] for fit in fits if fit is not None), default=0.0)
    slope, of = (PAPER_SLOPE_2D, ", 2D") if in_plane else (PAPER_SLOPE, "")
    if reach > 0:
        (line,) = axes.plot([0, 1e2 * reach], [0, 1e3 * slope * reach], "k:", lw=0.9)
        legend.add(line, f"2017 paper{of}: {slope:.3f}")


def _errors(group: Group, legend: _Legend, turned: bool) -> None:
    from matplotlib.lines import Line2D

    if turned:
        return
    curves = [one.curve for one in group.drawn]
    void, contact = (
        any(np.isfinite(curve.total_errors(name)).any() for curve in curves)
        for name in ("alpha_vs_axial", "alpha_c_axial")
    )
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
