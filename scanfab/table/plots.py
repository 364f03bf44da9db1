"""
The figures of a table, found where they register: under the entry point ``scanfab.figures``.

A figure is a function of a table and of matplotlib's Axes, which it draws on and gives back; the
table knows no figure itself, so that more of them can come from anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any

from scanfab.base.column import no_column
from scanfab.base.plugins import load_plugins

__all__ = ["Plots", "installed_figures"]

GROUP = "scanfab.figures"


@cache
def installed_figures() -> dict[str, Callable[..., Any]]:
    """The figures of tables by name."""
    return load_plugins(GROUP, "figure")


class Plots:
    """
    The figures of one table: ``table.plot.evolution(ax=ax)``.

    Each takes ``ax``, the Axes to draw on (its own in a new figure by default), and gives it back.

    Examples
    --------
    >>> import scanfab
    >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
    >>> "evolution" in dir(table.plot)
    True
    """

    def __init__(self, rows: Sequence[Mapping[str, Any]]) -> None:
        self._rows = rows

    def __getattr__(self, name: str) -> Callable[..., Any]:
        figures = installed_figures()
        if name not in figures:
            raise AttributeError(no_column(name, figures).replace("column", "figure"))
        return partial(figures[name], self._rows)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *installed_figures()]

    def __repr__(self) -> str:
        return f"Plots({', '.join(installed_figures())})"
