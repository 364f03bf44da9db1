"""Figures of curves over the strain: what they share, and the figure columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from scanfab.base.column import no_column
from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray
from scanfab.table.curves import ABSCISSAS, Curve, abscissa, curves_of
from scanfab.table.row import numbers_of
from scanfab.table.table import Table
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.style import LOOKS, MANY_LOOKS, WIDTH, band, plain, widen

Look = dict[str, Any]

MEANINGS = {"a": "whole", "b": "whole, rattlers void", "c": "RV", "d": "RV, rattlers void"}
# Height of each further row of panels, inches.
ROW = 2.1
MOST_MARKERS = 25
# The columns that are drawn if no names are given, as far as the table has them.
FIRST = (
    "p", "q", "void_ratio", "coordination_mechanical", "acst_vs", "acst_c",
    "alpha_bn_axial", "alpha_fn_axial", "alpha_ft_axial", "alpha_gc_strong_axial",
    "f_vs", "f_c", "vs_a4", "c_a4",
)  # fmt: skip


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
        If the table has nothing to draw, or rows of several cut-offs.
    """
    curves = curves_of(rows)
    if any(len(set(numbers_of(curve.rows, "cutoff"))) > 1 for curve in curves):
        several = "the rows have several cut-offs, which a curve cannot show"
        raise SettingsError(f"{several}: choose one, as by table.select(cutoff=...)")
    if not any(np.isfinite(curve.values("alpha_vs_axial")).any() for curve in curves):
        raise SettingsError("there is nothing to draw: no row of the table has a void fabric")
    sources = list(dict.fromkeys(curve.source for curve in curves))
    variants = sorted({curve.variant for curve in curves})
    by_source = len(sources) == 1 or 1 < len(variants) >= len(sources)
    panels: dict[str, list[Drawn]] = {one: [] for one in (sources if by_source else variants)}
    for place, curve in enumerate(curves):
        source, variant = curve.source, curve.variant
        number = variants.index(variant) if by_source else sources.index(source)
        look = MANY_LOOKS[number % len(MANY_LOOKS)]
        if by_source:
            name = _spelt(variant) if len(sources) == 1 else f"variant {variant}"
            # RVs of several sizes are variants with other names
            look = LOOKS.get(variant, look)
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
    total: bool = False
    """Whether the band is the error of scan and sample together, not the column ``NAME_se``."""
    bars: bool = False
    """Whether bars show the scan's part of the errors, from the column ``NAME_se``."""
    smallest: float = 1.0
    """The axis spans at least this, so that noise does not look like a signal."""

    def errors_of(self, curve: Curve) -> FloatArray:
        """The standard errors of a curve, shape (F,); NaN where there is none."""
        name = self.column
        return curve.total_errors(name) if self.total else curve.errors(f"{name}_se")


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
    from_zero: ClassVar[bool] = True
    """Whether each panel shows the zero."""

    def __init__(self, data: Table, quantities: Sequence[Quantity]) -> None:
        super().__init__(data)
        self.groups = groups_of(data)
        self.quantities = tuple(quantities)
        drawn = [one for group in self.groups for one in group.drawn]
        self.curves = [one.curve for one in drawn]
        self.looks = {one.name: one.look for one in drawn}
        self.rows = -(-len(self.quantities) // self.across)
        """How many rows of panels each group has."""

    @property
    def note(self) -> str:
        """The lines above the legend."""
        return ""

    def draw(self, ax: Axes) -> None:
        """The first quantity, with the legend in the panel."""
        group = group_of(self.groups)
        self._draw_panel(ax, group.drawn, self.quantities[0])
        self._set_abscissa(ax)
        ax.legend(self._handles(), list(self.looks))

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
        columns = min(len(self.looks), 2 if max(map(len, self.looks)) > 12 else 4)
        above: dict[str, Any] = {"loc": "outside upper center", "title": self.note or None}
        part.legend(self._handles(), list(self.looks), ncols=columns, **above)
        return found

    def _handles(self) -> list[Line2D]:
        """Entries of the legend, without the error bars of the curves."""
        return [Line2D([], [], **look) for look in self.looks.values()]

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
        if self.from_zero or low < 0 < high:
            axes.axhline(0, color="0.6", lw=0.6, zorder=0)
        widen(axes, quantity.smallest)

    def _set_abscissa(self, axes: Axes) -> None:
        """Set label and scale of the x axis."""
        label = ABSCISSAS[abscissa(self.data)][0]
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


class Columns(Curves):
    """
    Columns of the table over the strain, or over the frames.

    Each column has a panel. Bands are standard errors, from the columns named ``NAME_se``.

    Parameters
    ----------
    data : Table
        A fabric table; on one Axes of one source, or of one variant.
    of : str or sequence of str, optional
        Names of columns; in a text they are separated by commas. One Axes shows the first column.
        The default are the columns of stress, forces, invariants and harmonics that the table has
        (see the option `with_`).

    Raises
    ------
    SettingsError
        If there is no such column, or nothing to draw.

    Examples
    --------
    >>> import scanfab
    >>> from matplotlib.figure import Figure as Page
    >>> rows = [
    ...     dict(source="s", frame=k, strain=0.1 * k, variant="c", alpha_vs_axial=0.0, p=2.0 + k)
    ...     for k in range(3)
    ... ]
    >>> ax = scanfab.Table(rows).plot.columns(ax=Page().subplots(), of="p")
    >>> ax.get_ylabel(), ax.lines[0].get_ydata().tolist()
    ('p', [2.0, 3.0, 4.0])
    """

    order = 4
    columns = ("variant", "alpha_vs_axial", "strain")
    across = 2
    from_zero = False

    def __init__(self, data: Table, of: str | Sequence[str] | None = None) -> None:
        self.names = _named(data, of)
        panels = [Quantity(one, plain(one), smallest=1e-12) for one in self.names]
        super().__init__(data, panels)

    @classmethod
    def parse(cls, argument: str) -> dict[str, Any] | None:
        """Read names of columns, separated by commas."""
        return {"of": argument} if argument else None

    @classmethod
    def suits(cls, data: Table) -> bool:
        """Whether the table has columns that are drawn by default."""
        return bool(_first(data))

    @property
    def size(self) -> tuple[float, float]:
        """Width and height for rows of two panels, inches."""
        return WIDTH, ROW * self.rows * len(self.groups) + 0.8

    @property
    def caption(self) -> str:
        """The names of the columns and of the x axis."""
        has_errors = any(f"{name}_se" in self.data.names for name in self.names)
        errors = "; bands are their standard errors, as the table has them" if has_errors else ""
        return f"{', '.join(self.names)} over {ABSCISSAS[abscissa(self.data)][1]}{errors}."


def _named(data: Table, of: str | Sequence[str] | None) -> list[str]:
    """Names of the columns to draw; SettingsError if a column is missing or has no numbers."""
    asked = of.split(",") if isinstance(of, str) else of or ()
    names = [name.strip() for name in asked] or _first(data)
    if not names:
        reason = "the table has no columns that `with_` adds"
        raise SettingsError(f"figure columns: name those to draw: {reason}")
    for name in names:
        if name not in data.names:
            raise SettingsError(f"figure columns: {no_column(name, data.names)}")
        if not numbers_of(data, name):
            raise SettingsError(f"figure columns: the column {name} holds no numbers")
    return names


def _first(data: Table) -> list[str]:
    """Names of the columns that are drawn by default."""
    return [name for name in FIRST if numbers_of(data, name)]
