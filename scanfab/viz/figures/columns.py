"""The figure columns: any numbers of a table over the strain, a panel for each column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.column import no_column
from scanfab.base.errors import SettingsError
from scanfab.table.curves import abscissa_label, abscissa_words
from scanfab.table.table import Table
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.groups import Drawn, Group, group_of, groups_of
from scanfab.viz.figures.strain_curves import ROW, set_abscissa
from scanfab.viz.figures.style import WIDTH, band, plain, widen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure


# of the groups of further columns, those that a reader looks at first; two to a row of panels
FIRST = (
    "p", "q", "void_ratio", "coordination_mechanical", "acst_vs", "acst_c",
    "alpha_bn_axial", "alpha_fn_axial", "alpha_ft_axial", "alpha_gc_strong_axial",
    "f_vs", "f_c", "vs_a4", "c_a4",
)  # fmt: skip
ACROSS = 2
MOST_PANELS = 24


class Columns(Figure):
    """
    Columns of the table over the strain, or over the frames.

    A panel for each column; bands are the standard errors of the columns named ``NAME_se``.

    Parameters
    ----------
    data : Table
        A fabric table; of one source, or of one variant.
    of : str or sequence of str, optional
        Names of columns, between commas; on one Axes the first. By default those of stress, forces,
        invariants and harmonics that the table has (option `with_`).

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
    lettered = True

    def __init__(self, data: Table, of: str | Sequence[str] | None = None) -> None:
        super().__init__(data)
        self.names = _named(data, of)
        self.groups = groups_of(data)

    @classmethod
    def parse(cls, argument: str) -> dict[str, Any] | None:
        """The names behind the colon, between commas."""
        return {"of": argument} if argument else None

    @classmethod
    def suits(cls, data: Table) -> bool:
        """Whether it has further columns."""
        return bool(_first(data))

    @property
    def size(self) -> tuple[float, float]:
        """Two panels to a row."""
        rows = -(-len(self.names) // ACROSS) * len(self.groups)
        return WIDTH, ROW * rows + 0.8

    @property
    def caption(self) -> str:
        """With the names and the abscissa."""
        names = ", ".join(self.names)
        has_errors = any(f"{name}_se" in self.data.names for name in self.names)
        errors = "; bands are their standard errors, as the table has them" if has_errors else ""
        return f"{names} over {abscissa_words(self.data)}{errors}."

    def draw(self, ax: Axes) -> None:
        """The first of the columns."""
        group = group_of(self.groups)
        _draw(ax, group.drawn, self.names[0])
        set_abscissa(ax, abscissa_label(self.data), [group])
        ax.legend()

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """A block of panels for each group of curves, and the legend above."""
        rows = -(-len(self.names) // ACROSS)
        across = min(ACROSS, len(self.names))
        axes = part.subplots(rows * len(self.groups), across, squeeze=False, sharex=True)
        found: list[Axes] = []
        for place, group in enumerate(self.groups):
            every = axes[place * rows : (place + 1) * rows].ravel().tolist()
            for one in every[len(self.names) :]:
                one.remove()
            for one, name in zip(every, self.names, strict=False):
                _draw(one, group.drawn, name)
                found.append(one)
            every[0].set_title(group.title, loc="left")
        for one in found[-across:]:
            set_abscissa(one, abscissa_label(self.data), self.groups)
            one.xaxis.set_tick_params(labelbottom=True)
        _legend(part, self.groups)
        return found


def _named(data: Table, of: str | Sequence[str] | None) -> list[str]:
    """The columns to draw, all of them numbers of the table."""
    asked = of.split(",") if isinstance(of, str) else list(of or ())
    names = [name.strip() for name in asked] or _first(data)
    if not names:
        raise SettingsError(
            "figure columns: name those to draw: the table has none of those that `with_` adds"
        )
    for name in names:
        if name not in data.names:
            raise SettingsError(f"figure columns: {no_column(name, data.names)}")
        if not any(isinstance(one[name], int | float) for one in data):
            raise SettingsError(f"figure columns: the column {name} holds no numbers")
    if len(names) > MOST_PANELS:
        raise SettingsError(
            f"figure columns: expected at most {MOST_PANELS} columns, found {len(names)}"
        )
    return names


def _first(data: Table) -> list[str]:
    """What is drawn of a table if nobody chooses."""
    names = [name for name in FIRST if name in data.names]
    return [name for name in names if any(one[name] is not None for one in data)]


def _draw(axes: Axes, drawn: Sequence[Drawn], name: str) -> None:
    """One panel: values, and their errors as bands."""
    for one in drawn:
        values, error = one.curve.values(name), one.curve.values(f"{name}_se")
        band(axes, one.curve.x, values, np.where(error < 0, np.nan, error), one.look["color"])
        every = max(1, -(-len(values) // 25))
        axes.plot(one.curve.x, values, markevery=every, label=one.name, **one.look)
    axes.set_ylabel(plain(name))
    low, high = axes.get_ylim()
    if low < 0 < high:
        axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    widen(axes, 1e-12)


def _legend(part: Page | SubFigure, groups: Sequence[Group]) -> None:
    """Above the panels, so that it covers no data."""
    from matplotlib.lines import Line2D

    entries = {one.name: one.look for group in groups for one in group.drawn}
    part.legend(
        [Line2D([], [], **look) for look in entries.values()],
        list(entries),
        loc="outside upper center",
        ncols=min(len(entries), 2 if max(map(len, entries)) > 12 else 4),
    )
