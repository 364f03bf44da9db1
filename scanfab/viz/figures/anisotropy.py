"""The figures of both anisotropies: evolution and normalised over the strain, and correlation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from scanfab.table.compare import Comparison, compare_tables
from scanfab.table.curves import ABSCISSAS, abscissa, have_errors, is_turned
from scanfab.table.row import numbers_of
from scanfab.table.table import Table
from scanfab.viz.figures.curves import ROW, Curves, Drawn, Group, Quantity, group_of, groups_of
from scanfab.viz.figures.figure import Figure, shown_of
from scanfab.viz.figures.style import CONTACT, LABELS, NAMES, VOID, WIDTH, widen

ANGLE = Quantity("coaxiality_deg", "coaxiality, degrees")
# Slopes of the 2017 paper, for spheres and for discs.
PAPER_SLOPE, PAPER_SLOPE_2D = 0.096, 0.231
# Heights of the legend without curves, and of the two lines for each curve, inches.
LEGEND, ENTRY = 1.0, 0.32


class Evolution(Curves):
    """
    Void and contact anisotropy over the strain, or over the frames.

    Bands are total standard errors, bars the scan's part. If the principal axes are not the loading
    axis, as in simple shear, intensities are drawn, and the angle between both major axes.

    Parameters
    ----------
    data : Table
        A fabric table; on one Axes of one source, or of one variant.
    of : str, optional
        ``"voids"`` or ``"contacts"``, to draw these alone; on one Axes voids by default.

    Raises
    ------
    SettingsError
        If there is nothing to draw, or too much for one Axes.

    Examples
    --------
    >>> import scanfab
    >>> from matplotlib.figure import Figure
    >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
    >>> table = scanfab.Table(
    ...     dict(row, source="s", variant="c", alpha_vs_axial=0.001 * k, alpha_c_axial=0.01 * k)
    ...     for k, row in enumerate(table)
    ... )
    >>> ax = Figure().subplots()
    >>> table.plot.evolution(ax=ax, of="contacts") is ax
    True
    """

    order = 1
    columns = ("variant", "alpha_vs_axial", "strain", "alpha_c_axial")
    height: ClassVar[float] = 2.9
    """Height of a single row of panels, inches."""

    def __init__(self, data: Table, of: str | None = None) -> None:
        self.turned = is_turned(data)
        self.of = shown_of(of, ("voids", "contacts"))
        self.has_angle = self.turned and not self.share and of is None
        chosen = [self._quantity(name) for name in self.of]
        super().__init__(data, [*chosen, *[ANGLE] * self.has_angle])

    def _quantity(self, name: str) -> Quantity:
        """The anisotropy along the loading axis, or the intensity if principal axes are turned."""
        voids = name == "voids"
        column = ("alpha_vs" if voids else "alpha_c") + ("" if self.turned else "_axial")
        label, factor = LABELS[column], 1e3 if voids else 1e2
        if self.share:
            label, factor = f"{NAMES[column]} / largest", 1.0
        bars = voids and not self.turned and not self.share
        return Quantity(column, label, factor, not self.turned, bars)

    @property
    def size(self) -> tuple[float, float]:
        """A row of panels for each group, and as many lines of legend."""
        lines = -(-len(self.looks) // 2)
        return WIDTH, self.height + ROW * (len(self.groups) - 1) + 0.15 * max(lines - 2, 0)

    @property
    def caption(self) -> str:
        """With the x axis; the legend explains errors."""
        what = f"{' and '.join(one.removesuffix('s') for one in self.of)} anisotropy"
        drawn = f"{what.capitalize()} along the loading axis"
        if self.turned:
            angle = ", and the angle between their major axes" if self.has_angle else ""
            drawn = f"Intensity of {what}{angle}"
        divided = ", each curve divided by its own largest absolute value" if self.share else ""
        return f"{drawn}, over {ABSCISSAS[abscissa(self.data)][1]}{divided}."

    @property
    def note(self) -> str:
        """The meaning of bands and bars."""
        if self.turned:
            return "without errors: the table has those of the axial values only"
        alone = any(curve.contact_alone for curve in self.curves)
        which = "contacts taken as independent" if alone else "the sample's"
        parts = [f"of {VOID} scan and sample together"] * have_errors(self.curves, "alpha_vs_axial")
        parts += [f"of {CONTACT} {which}"] * have_errors(self.curves, "alpha_c_axial")
        # two lines, because one would be wider than the page
        lines = ["bands: one total standard error,", ", ".join(parts)] if parts else []
        scan = np.concatenate([curve.errors("alpha_vs_axial_se") for curve in self.curves])
        if np.isfinite(scan).any() and not self.share:
            largest = rf"${1e3 * np.nanmax(scan):.2g}\times10^{{-3}}$"
            lines.append(f"bars: the scan's part, at most {largest}")
        return "\n".join(lines)


class Normalised(Evolution):
    """
    Void and contact anisotropy over the strain, each curve divided by its own largest value.

    Parameters
    ----------
    data : Table
        A fabric table; on one Axes of one source, or of one variant.
    of : str, optional
        ``"voids"`` or ``"contacts"``, to draw these alone; on one Axes voids by default.

    Raises
    ------
    SettingsError
        If there is nothing to draw, or too much for one Axes.
    """

    order = 2
    height = 2.7
    share = True


class Correlation(Figure):
    """
    Void against contact anisotropy, with the lines that the comparison fits.

    Bars are total standard errors. If the principal axes are not the loading axis, the intensities
    are drawn, without a line.

    Parameters
    ----------
    data : Table
        A fabric table; on one Axes of one source, or of one variant.
    comparison : Comparison, optional
        Of the same table, with the lines to draw: ``table.compare(strain_max=0.05)``. By default
        all frames are fitted.
    paper_line : bool, optional
        Whether to draw the slope of the 2017 paper as a dotted line.

    Raises
    ------
    SettingsError
        If there is nothing to draw, or too much for one Axes.
    """

    order = 3
    columns = ("variant", "alpha_vs_axial", "strain", "alpha_c_axial")

    def __init__(
        self, data: Table, comparison: Comparison | None = None, paper_line: bool = True
    ) -> None:
        super().__init__(data)
        self.paper_line = paper_line
        self.groups, self.turned = groups_of(data), is_turned(data)
        self.part = "" if self.turned else "_axial"
        self.in_plane = any(0.0 in numbers_of(data, f"gvs_{axis}") for axis in ("xx", "yy", "zz"))
        made = compare_tables(data) if comparison is None else comparison
        self.fits = list(zip(made.summary, made.points, strict=True))
        """For each curve its line, and contact and void anisotropy of the fitted frames."""

    @property
    def size(self) -> tuple[float, float]:
        """A panel for each group, its legend beside it, which may be the higher one."""
        curves = max(len(group.drawn) for group in self.groups)
        higher = max(LEGEND + ENTRY * curves - 2.6, 0.0)
        return WIDTH, 2.6 + ROW * (len(self.groups) - 1) + higher * len(self.groups)

    @property
    def caption(self) -> str:
        """The legend says which lines are drawn."""
        what = "intensity" if self.turned else "anisotropy along the loading axis"
        return f"Void against contact {what}."

    def draw(self, ax: Axes) -> None:
        """With the legend in the panel."""
        self._draw_group(ax, ax, group_of(self.groups))

    def panels(self, part: FigureBase) -> list[Axes]:
        """A panel for each group, beside it the legend, which has the numbers."""
        panels = part.subplots(len(self.groups), 2, squeeze=False, width_ratios=(3, 2))
        for group, (axes, margin) in zip(self.groups, panels, strict=True):
            margin.set_axis_off()
            place: dict[str, Any] = {"loc": "center left", "borderaxespad": 0, "handlelength": 2.5}
            self._draw_group(axes, margin, group, **place)
            axes.set_title(group.title, loc="left")
        return [axes for axes, _ in panels]

    def _draw_group(self, axes: Axes, margin: Axes, group: Group, **place: Any) -> None:
        """The points and lines of one panel, and its legend in the margin."""
        entries = [self._draw_curve(axes, one) for one in group.drawn]
        reach, title = self._reach(group.drawn), "intensities"
        if not self.turned:
            title = f"slope of {VOID} on {CONTACT}, axial"
            if reach > 0:
                slope, of = (PAPER_SLOPE_2D, ", 2D") if self.in_plane else (PAPER_SLOPE, "")
                (line,) = axes.plot([0, 1e2 * reach], [0, 1e3 * slope * reach], "k:", lw=0.9)
                entries.append((line, f"2017 paper{of}: {slope:.3f}"))
            entries += _errors_entry(group)
        axes.set(xlabel=LABELS[f"alpha_c{self.part}"], ylabel=LABELS[f"alpha_vs{self.part}"])
        axes.axhline(0, color="0.6", lw=0.6, zorder=0)
        widen(axes, 1.0)
        margin.legend(*zip(*entries, strict=True), title=title, **place)

    def _draw_curve(self, axes: Axes, one: Drawn) -> tuple[Any, str]:
        """The frames of a curve, with their total errors, and its line."""
        look = {key: value for key, value in one.look.items() if key != "ls"}
        style = {"ls": "none", "elinewidth": 0.5, "capsize": 0, "zorder": 2.5, **look}
        contact, void = f"alpha_c{self.part}", f"alpha_vs{self.part}"
        x, y = 1e2 * one.curve.values(contact), 1e3 * one.curve.values(void)
        xerr, yerr = (np.nan_to_num(one.curve.total_errors(name)) for name in (contact, void))
        points = axes.errorbar(x, y, xerr=1e2 * xerr, yerr=1e3 * yerr, **style)
        for bars in points.lines[2]:
            bars.set_alpha(0.4)
        if self.turned:
            return points, one.name
        fit, frames = self.fits[one.place]
        if fit.slope is None:
            return points, f"{one.name}:\nno line"
        middle = frames.mean(axis=0)
        ends = np.array([frames[:, 0].min(), frames[:, 0].max()])
        style = {"color": look["color"], "ls": one.look["ls"], "gid": "fit"}
        (line,) = axes.plot(1e2 * ends, 1e3 * (middle[1] + fit.slope * (ends - middle[0])), **style)
        error = "" if fit.slope_se is None else rf" $\pm$ {fit.slope_se:.3f}"
        r2 = "" if fit.r2 is None else f", $R^2$ = {fit.r2:.3f}"
        return (line, points), f"{one.name}:\n{fit.slope:.3f}{error}{r2}"

    def _reach(self, drawn: Sequence[Drawn]) -> float:
        """The end of the paper's line: the largest contact anisotropy that is fitted, or 0."""
        fits = [self.fits[one.place] for one in drawn if self.paper_line]
        return max((frames[:, 0].max() for fit, frames in fits if fit.slope is not None), default=0)


def _errors_entry(group: Group) -> list[tuple[Any, str]]:
    """The legend's entry for error bars: a cross, as a single line would look like the axis."""
    curves = [one.curve for one in group.drawn]
    void, contact = (have_errors(curves, name) for name in ("alpha_vs_axial", "alpha_c_axial"))
    if not (void or contact):
        return []
    shape = "+" if void and contact else "|" if void else "_"
    alone = contact and any(curve.contact_alone for curve in curves)
    which = f",\nof {CONTACT} as if contacts\nwere independent" if alone else ""
    bars = Line2D([], [], color="0.4", marker=shape, markersize=11, mew=0.6, ls="none")
    return [(bars, f"one total standard error{which}")]
