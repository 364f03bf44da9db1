"""Curves over the strain: what the figures evolution, normalised and columns share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.curves import Curve, abscissa_label
from scanfab.table.table import Table
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.groups import Drawn, group_of, groups_of
from scanfab.viz.figures.style import band, widen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure


# height of each further row of panels, inches
ROW = 2.1
MOST_MARKERS = 25


@dataclass(frozen=True)
class Quantity:
    """What a panel shows: a column of the table, and how its axis is made."""

    column: str
    label: str
    factor: float = 1.0
    errors: Literal["total", "column", ""] = ""
    """Of the band: scan and sample together, the column ``NAME_se``, or no band."""
    bars: bool = False
    """Whether bars show the scan's part of the errors, the column ``NAME_se``."""
    smallest: float = 1.0
    """The axis spans at least this, so that noise does not look like a signal."""

    def errors_of(self, curve: Curve) -> FloatArray:
        """The standard errors of a curve, shape (F,); NaN where there is none."""
        if self.errors == "total":
            return curve.total_errors(self.column)
        found = curve.errors(f"{self.column}_se")
        return found if self.errors else np.full_like(found, np.nan)


class Curves(Figure):
    """
    Quantities of a table over the strain, or over the frames.

    Each group of curves (:func:`scanfab.viz.figures.groups.grouped`) has a panel for each
    quantity. One Axes holds one group and its first quantity.
    """

    lettered = True
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
        """What stands above the legend."""
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
            # for the legend alone: the curve itself has errors beside it
            ax.plot([], [], label=name, **look)
        ax.legend()

    def panels(self, part: Page | SubFigure) -> list[Axes]:
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
        self._legend_above(part)
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
        """Label and scale of what the curves are drawn over."""
        from matplotlib.ticker import MaxNLocator

        label = abscissa_label(self.data)
        axes.set_xlabel(label)
        places = np.concatenate([curve.x for curve in self.curves])
        known = np.unique(places[np.isfinite(places)])
        if len(known) == 1:
            # one frame alone has no scale
            axes.set_xlim(known[0] - 1, known[0] + 1)
        if label == "frame":
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))

    def _legend_above(self, part: Page | SubFigure) -> None:
        from matplotlib.lines import Line2D

        handles: list[Any] = [Line2D([], [], **look) for look in self.looks.values()]
        columns = 2 if max(map(len, self.looks)) > 12 else 4
        part.legend(
            handles, list(self.looks), loc="outside upper center",
            ncols=min(len(handles), columns), title=self.note or None,
        )  # fmt: skip
