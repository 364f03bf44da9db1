"""
The installed figures, and those that can be drawn of some data: ``table.plot``.

A figure is a class that a package registers under the entry point ``scanfab.figures``, so this
room imports no drawing code; :mod:`scanfab.viz.figures.figure` says how to write one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from inspect import Parameter, Signature, signature
from typing import Any

from scanfab.base.column import no_column
from scanfab.base.option import refuse_unknown
from scanfab.base.plugins import load_plugins


@cache
def installed_figures() -> dict[str, Any]:
    """The classes of all figures by name, those of the package first."""

    def checked(plugin: Any) -> Any:
        if not hasattr(plugin, "kind") or not hasattr(plugin, "order"):
            raise TypeError("expected a subclass of scanfab.viz.figures.figure.Figure")
        return plugin

    offers = load_plugins("scanfab.figures", "figure", checked)
    found = {name: one.plugin for name, one in offers.items()}
    return dict(sorted(found.items(), key=lambda one: one[1].order))


def figures_of(kind: str) -> dict[str, Any]:
    """The figures of a kind of data: ``table``, ``frames``, ``calibration`` or ``map``."""
    return {name: one for name, one in installed_figures().items() if one.kind == kind}


class Plots:
    """
    The figures of some data: ``table.plot.evolution(ax=ax)``.

    Each takes ``ax``, the Axes to draw on (its own in a new figure by default), and gives it back;
    given a matplotlib Figure or SubFigure instead, it draws all its panels there.

    Examples
    --------
    >>> import scanfab
    >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
    >>> table.plot
    Plots(evolution, normalised, correlation, columns)
    """

    def __init__(self, data: Any, kind: str) -> None:
        self._data = data
        self._kind = kind

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("_"):
            raise AttributeError(name)
        figures = figures_of(self._kind)
        if name not in figures:
            raise AttributeError(no_column(name, figures).replace("column", "figure"))
        figure, data = figures[name], self._data
        options = [*signature(figure).parameters.values()][1:]

        def plot(ax: Any = None, **given: Any) -> Any:
            refuse_unknown(f"the figure {name}", given, [option.name for option in options])
            return figure(data, **given).on(ax)

        # a notebook shows the help and the options of the figure
        axes = Parameter("ax", Parameter.POSITIONAL_OR_KEYWORD, default=None)
        named = [one.replace(kind=Parameter.KEYWORD_ONLY) for one in options]
        plot.__name__, plot.__doc__ = name, figure.__doc__
        plot.__signature__ = Signature([axes, *named])  # type: ignore[attr-defined]
        return plot

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *figures_of(self._kind)]

    def __repr__(self) -> str:
        return f"Plots({', '.join(figures_of(self._kind))})"
