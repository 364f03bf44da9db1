"""
Installed figures, and the accessor ``table.plot`` for the figures that suit the data.

A figure is a class that a package registers under the entry point ``scanfab.figures``, so this
package imports no drawing code. :mod:`scanfab.viz.figures.figure` says how to write a figure.
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
    """Classes of all figures by name; the figures of this package come first."""

    def checked(plugin: Any) -> Any:
        if not hasattr(plugin, "kind") or not hasattr(plugin, "order"):
            raise TypeError("expected a subclass of scanfab.viz.figures.figure.Figure")
        return plugin

    offers = load_plugins("scanfab.figures", "figure", checked)
    figures = {name: offer.plugin for name, offer in offers.items()}
    return dict(sorted(figures.items(), key=lambda item: item[1].order))


def figures_of(kind: str) -> dict[str, Any]:
    """Figures for a kind of data: ``table``, ``frames``, ``calibration`` or ``map``."""
    return {name: figure for name, figure in installed_figures().items() if figure.kind == kind}


class Plots:
    """
    The figures that suit the data, as methods: ``table.plot.evolution(ax=ax)``.

    Each method draws on the Axes ``ax`` and returns them; by default it makes a new figure. Given a
    matplotlib Figure or SubFigure in place of Axes, it draws all its panels there.

    Examples
    --------
    >>> import scanfab
    >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
    >>> table.plot
    Plots(evolution, normalised, correlation, columns)
    """

    def __init__(self, data: Any, kind: str) -> None:
        self._data, self._kind = data, kind

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("_"):
            raise AttributeError(name)
        figures = figures_of(self._kind)
        if name not in figures:
            raise AttributeError(no_column(name, figures, "figure"))
        figure, data = figures[name], self._data
        options = [*signature(figure).parameters.values()][1:]

        def plot(ax: Any = None, **given: Any) -> Any:
            refuse_unknown(f"the figure {name}", given, [option.name for option in options])
            return figure(data, **given).on(ax)

        # notebooks show the docstring and the signature of the figure
        axes = Parameter("ax", Parameter.POSITIONAL_OR_KEYWORD, default=None)
        named = [option.replace(kind=Parameter.KEYWORD_ONLY) for option in options]
        plot.__name__, plot.__doc__ = name, figure.__doc__
        plot.__signature__ = Signature([axes, *named])  # type: ignore[attr-defined]
        return plot

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *figures_of(self._kind)]

    def __repr__(self) -> str:
        return f"Plots({', '.join(figures_of(self._kind))})"
