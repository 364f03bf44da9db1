"""The figure columns: numeric columns of a table over the strain, a panel for each column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from scanfab.base.column import no_column
from scanfab.base.errors import SettingsError
from scanfab.table.curves import abscissa_words
from scanfab.table.table import Table
from scanfab.viz.figures.curves import ROW, Curves, Quantity
from scanfab.viz.figures.style import WIDTH, plain

# The columns that are drawn if no names are given, as far as the table has them.
FIRST = (
    "p", "q", "void_ratio", "coordination_mechanical", "acst_vs", "acst_c",
    "alpha_bn_axial", "alpha_fn_axial", "alpha_ft_axial", "alpha_gc_strong_axial",
    "f_vs", "f_c", "vs_a4", "c_a4",
)  # fmt: skip


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

    def __init__(self, data: Table, of: str | Sequence[str] | None = None) -> None:
        self.names = _named(data, of)
        panels = [Quantity(one, plain(one), errors="column", smallest=1e-12) for one in self.names]
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
        return f"{', '.join(self.names)} over {abscissa_words(self.data)}{errors}."


def _named(data: Table, of: str | Sequence[str] | None) -> list[str]:
    """Names of the columns to draw; SettingsError if a column is missing or has no numbers."""
    asked = of.split(",") if isinstance(of, str) else list(of or ())
    names = [name.strip() for name in asked] or _first(data)
    if not names:
        raise SettingsError(
            "figure columns: name those to draw: the table has no columns that `with_` adds"
        )
    for name in names:
        if name not in data.names:
            raise SettingsError(f"figure columns: {no_column(name, data.names)}")
        if not any(isinstance(one[name], int | float) for one in data):
            raise SettingsError(f"figure columns: the column {name} holds no numbers")
    return names


def _first(data: Table) -> list[str]:
    """Names of the columns that are drawn by default."""
    names = [name for name in FIRST if name in data.names]
    return [name for name in names if any(one[name] is not None for one in data)]
