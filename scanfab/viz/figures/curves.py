"""The figures evolution and normalised, and what figures of curves over the strain share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray
from scanfab.table.curves import Curve, abscissa_label, abscissa_words, curves_of, is_turned
from scanfab.table.table import Table
from scanfab.viz.figures.figure import Figure, one_of
from scanfab.viz.figures.style import (
    COLOURS,
    CONTACT,
    LABELS,
    LOOKS,
    NAMES,
    VOID,
    WIDTH,
    band,
    plain,
    widen,
)

Look = dict[str, Any]

COLOURS_OF_MANY = ("blue", "vermilion", "green", "purple", "orange", "sky", "black")
LINES = ("-", "--", "-.", ":")
# Looks of curves that differ by their source or by the size of their RV; the second half is open.
MANY_LOOKS: tuple[Look, ...] = tuple(
    {"color": COLOURS[colour], "marker": marker, "ls": LINES[(place + turn) % 4], **more}
    for turn, more in enumerate(({}, {"mfc": "white", "ms": 5.5}))
    for place, (colour, marker) in enumerate(zip(COLOURS_OF_MANY, "o^DsvPX", strict=True))
)
OTHER: Look = {"color": "0.3", "marker": "v", "ls": "-"}
MEANINGS = {"a": "whole", "b": "whole, rattlers void", "c": "RV", "d": "RV, rattlers void"}
# Height of each further row of panels, inches.
ROW = 2.1
MOST_MARKERS = 25


class Drawn(NamedTuple):
    """A curve, its number among all curves of the table, its look and its name in the legend."""

    curve: Curve
    place: int
    look: Look
    name: str


class Group(NamedTuple):
    """The curves of one panel; the title is empty if there is only one group."""

    title: str
    drawn: list[Drawn]


def groups_of(rows: Sequence[Mapping[str, Any]]) -> list[Group]:
    """
    Group the curves of a table by source or by variant, whichever makes fewer panels.

    In one panel, several variants of several sources could not be told apart.

    Raises
    ------
    SettingsError
        If the table has nothing to draw.
    """
    curves = curves_of(rows)
    if not any(np.isfinite(curve.values("alpha_vs_axial")).any() for curve in curves):
        raise SettingsError("there is nothing to draw: no row of the table has a void fabric")
    sources = list(dict.fromkeys(curve.source for curve in curves))
    variants = sorted({curve.variant for curve in curves})
    by_source = len(sources) == 1 or 1 < len(variants) >= len(sources)
    # several RVs of a variant need different looks
    several_rvs = len({variant[0] for variant in variants}) < len(variants)
    panels: dict[str, list[Drawn]] = {one: [] for one in (sources if by_source else variants)}
    for place, curve in enumerate(curves):
        source, variant = curve.source, curve.variant
        number = variants.index(variant) if by_source else sources.index(source)
        look = MANY_LOOKS[number % len(MANY_LOOKS)]
        if by_source:
            name = _spelt(variant) if len(sources) == 1 else f"variant {variant}"
            look = look if several_rvs else LOOKS.get(variant, OTHER)
        else:
            name = f"variant {variant}, " * (len(variants) == 1) + plain(source)
        panels[source if by_source else variant].append(Drawn(curve, place, look, name))
    titles = {one: plain(one) if by_source else _spelt(one) for one in panels}
    return [Group(titles[one] * (len(panels) > 1), drawn) for one, drawn in panels.items()]


def group_of(groups: Sequence[Group]) -> Group:
    """The only group; SettingsError if there are several, which one Axes cannot hold."""
    if len(groups) > 1:
        raise SettingsError(
            "several variants of several sources are too many for one Axes: choose some, "
            'for instance by table.select(variant="c")'
        )
    return groups[0]


def _spelt(variant: str) -> str:
    meaning = MEANINGS.get(variant)
    return f"variant {variant}" if meaning is None else f"variant {variant}: {meaning}"


class Quantity(NamedTuple):
    """The column of the table that a panel shows, and its axis."""

    column: str
    label: str
    factor: float = 1.0
    errors: Literal["total", "column", ""] = ""
    """Errors of the band: scan and sample together, the column ``NAME_se``, or no band."""
    bars: bool = False
    """Whether bars show the scan's part of the errors, from the column ``NAME_se``."""
    smallest: float = 1.0
    """The axis spans at least this, so that noise does not look like a signal."""

    def errors_of(self, curve: Curve) -> FloatArray:
        """The standard errors of a curve, shape (F,); NaN where there is none."""
        if self.errors == "total":
            return curve.total_errors(self.column)
        found = curve.errors(f"{self.column}_se")
        return found if self.errors else np.full_like(found, np.nan)


ANGLE = Quantity("coaxiality_deg", "coaxiality, degrees")


class Curves(Figure):
    """
    Quantities of a table over the strain, or over the frames.

    Each group of curves (:func:`groups_of`) has a panel for each quantity. One Axes holds one group
    and its first quantity.
    """

    across: ClassVar[int] = 3
    """Panels in a row at most."""
    share: ClassVar[bool] = False
    """Whether each curve is divided by its own largest absolute value."""

    def __init__(self, data: Table, quantities: Sequence[Quantity]) -> None:
        super().__init__(data)
        self.groups = groups_of(data)
        self.quantities = tuple(quantities)
        self.looks = {one.name: one.look for group in self.groups for one in group.drawn}

    @property
    def note(self) -> str:
        """The lines above the legend."""
        return ""

    @property
    def curves(self) -> list[Curve]:
        """All curves of the figure."""
        return [one.curve for group in self.groups for one in group.drawn]

    @property
    def rows(self) -> int:
        """How many rows of panels each group has."""
        return -(-len(self.quantities) // self.across)

    def draw(self, ax: Axes) -> None:
        """The first quantity, with the legend in the panel."""
        group = group_of(self.groups)
        self._draw_panel(ax, group.drawn, self.quantities[0])
        self._set_abscissa(ax)
        for name, look in self.looks.items():
            # an entry of the legend without the error bars of the curve
            ax.plot([], [], label=name, **look)
        ax.legend()

    def panels(self, part: FigureBase) -> list[Axes]:
        """Some rows of panels for each group, and the legend above, so that it covers no data."""
        across = min(self.across, len(self.quantities))
        shape, one_row = (self.rows * len(self.groups), across), self.rows == 1
        grid = part.subplots(*shape, squeeze=False, sharex=True, sharey="col" if one_row else False)
        found: list[Axes] = []
        for place, group in enumerate(self.groups):
            every = grid[place * self.rows : (place + 1) * self.rows].ravel().tolist()
            for axes, quantity in zip(every, self.quantities, strict=False):
                self._draw_panel(axes, group.drawn, quantity)
                found.append(axes)
            for axes in every[len(self.quantities) :]:
                axes.remove()
            every[0].set_title(group.title, loc="left")
        for axes in found[-across:]:
            self._set_abscissa(axes)
            axes.xaxis.set_tick_params(labelbottom=True)
        handles = [Line2D([], [], **look) for look in self.looks.values()]
        columns = 2 if max(map(len, self.looks)) > 12 else 4
        above: dict[str, Any] = {"loc": "outside upper center", "title": self.note or None}
        part.legend(handles, list(self.looks), ncols=min(len(handles), columns), **above)
        return found

    def _draw_panel(self, axes: Axes, drawn: Sequence[Drawn], quantity: Quantity) -> None:
        """Values, their errors as bands, and the scan's part as bars."""
        for one in drawn:
            x, values = one.curve.x, one.curve.values(quantity.column)
            largest = np.nanmax(np.abs(values), initial=0.0)
            factor = quantity.factor if not self.share else 1.0 / largest if largest else np.nan
            band(axes, x, factor * values, factor * quantity.errors_of(one.curve), one.look)
            every = max(1, -(-len(values) // MOST_MARKERS))
            axes.plot(x, factor * values, markevery=every, **one.look)
            bars = factor * one.curve.errors(f"{quantity.column}_se")
            if quantity.bars and np.isfinite(bars).any():
                look = {"ecolor": one.look["color"], "elinewidth": 0.9}
                axes.errorbar(x, factor * values, np.nan_to_num(bars), fmt="none", **look)
        axes.set_ylabel(quantity.label)
        low, high = axes.get_ylim()
        if quantity.errors != "column" or low < 0 < high:
            axes.axhline(0, color="0.6", lw=0.6, zorder=0)
        widen(axes, quantity.smallest)

    def _set_abscissa(self, axes: Axes) -> None:
        """Set label and scale of the x axis."""
        label = abscissa_label(self.data)
        axes.set_xlabel(label)
        places = np.concatenate([curve.x for curve in self.curves])
        known = np.unique(places[np.isfinite(places)])
        if len(known) == 1:
            # a single frame gives no scale
            axes.set_xlim(known[0] - 1, known[0] + 1)
        if label in ("frame", "time step"):
            # steps have many digits
            most: Any = 4 if label == "time step" else "auto"
            axes.xaxis.set_major_locator(MaxNLocator(most, integer=True))


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
    """Of a single row of panels, inches."""

    def __init__(self, data: Table, of: str | None = None) -> None:
        self.turned = is_turned(data)
        self.of = one_of(of, ("voids", "contacts"))
        chosen = [self._quantity(name) for name in self.of]
        self.has_angle = self.turned and not self.share and of is None
        super().__init__(data, [*chosen, ANGLE] if self.has_angle else chosen)

    def _quantity(self, name: str) -> Quantity:
        """The anisotropy along the loading axis, or the intensity if principal axes are turned."""
        voids = name == "voids"
        column = ("alpha_vs" if voids else "alpha_c") + ("" if self.turned else "_axial")
        label, factor = LABELS[column], 1e3 if voids else 1e2
        if self.share:
            label, factor = f"{NAMES[column]} / largest", 1.0
        bars = voids and not self.turned and not self.share
        return Quantity(column, label, factor, "" if self.turned else "total", bars)

    @property
    def size(self) -> tuple[float, float]:
        """A row of panels for each group, and as many lines of legend."""
        lines = -(-len(self.looks) // 2)
        return WIDTH, self.height + ROW * (len(self.groups) - 1) + 0.15 * max(lines - 2, 0)

    @property
    def caption(self) -> str:
        """With the x axis, and with the quantities that have errors."""
        what = f"{' and '.join(one.removesuffix('s') for one in self.of)} anisotropy"
        drawn = f"{what.capitalize()} along the loading axis"
        if self.turned:
            angle = ", and the angle between their major axes" if self.has_angle else ""
            drawn = f"Intensity of {what}{angle}"
        divided = ", each curve divided by its own largest absolute value" if self.share else ""
        banded = [
            name
            for name, one in zip(self.of, self.quantities, strict=False)
            if one.errors and self._has_errors(one.column)
        ]
        errors = f"with total standard errors of {' and '.join(banded)}"
        return (
            f"{drawn}, over {abscissa_words(self.data)}{divided}; "
            f"{errors if banded else 'without total errors'}."
        )

    @property
    def note(self) -> str:
        """The meaning of bands and bars."""
        if self.turned:
            return "without errors: the table has those of the axial values only"
        alone = any(curve.contact_alone for curve in self.curves)
        which = "contacts taken as independent" if alone else "the sample's"
        parts = [f"of {VOID} scan and sample together"] * self._has_errors("alpha_vs_axial")
        parts += [f"of {CONTACT} {which}"] * self._has_errors("alpha_c_axial")
        # two lines, because one would be wider than the page
        lines = ["bands: one total standard error,", ", ".join(parts)] if parts else []
        scan = np.concatenate([curve.errors("alpha_vs_axial_se") for curve in self.curves])
        if np.isfinite(scan).any() and not self.share:
            largest = f"{1e3 * np.nanmax(scan):.2g}"
            lines.append(rf"bars: the scan's part, at most ${largest}\times10^{{-3}}$")
        return "\n".join(lines)

    def _has_errors(self, column: str) -> bool:
        return any(np.isfinite(curve.total_errors(column)).any() for curve in self.curves)


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
