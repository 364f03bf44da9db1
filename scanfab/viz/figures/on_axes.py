"""
Figures of tables on one Axes, which each of them gives back: what ``table.plot`` draws.

They register in pyproject.toml under the entry point ``scanfab.figures``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.table.compare import compare_tables
from scanfab.table.curves import abscissa_label, curves_of, is_turned
from scanfab.viz.figures.correlation import draw_group
from scanfab.viz.figures.fitted import fits_of
from scanfab.viz.figures.groups import Group, grouped
from scanfab.viz.figures.of_tables import draw_panel, quantities_of, set_abscissa
from scanfab.viz.figures.style import STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["correlation", "evolution", "normalised"]

Rows = Sequence[Mapping[str, Any]]

PANELS = ("voids", "contacts")


def evolution(rows: Rows, ax: Axes | None = None, *, of: str = "voids") -> Axes:
    """
    An anisotropy over strain, or over frames; bands are total standard errors, bars the scan's.

    Parameters
    ----------
    rows : Table or sequence of mapping
        Of a fabric table: one source, or one variant.
    ax : matplotlib Axes, optional
        To draw on; its own in a new figure by default.
    of : str, optional
        ``"voids"`` or ``"contacts"``.

    Returns
    -------
    Axes
        The one that was drawn on.

    Raises
    ------
    SettingsError
        If there is nothing to draw, or too much for one Axes.

    Examples
    --------
    >>> import scanfab
    >>> from matplotlib.figure import Figure
    >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
    >>> rows = [dict(row, source="s", variant="c", alpha_vs_axial=0.001 * k,
    ...              alpha_c_axial=0.01 * k) for k, row in enumerate(table)]
    >>> ax = Figure().subplots()
    >>> scanfab.Table(rows).plot.evolution(ax=ax) is ax
    True
    """
    return _over_strain(rows, ax, of, share=False)


def normalised(rows: Rows, ax: Axes | None = None, *, of: str = "voids") -> Axes:
    """The same with each curve divided by its own largest absolute value."""
    return _over_strain(rows, ax, of, share=True)


def correlation(rows: Rows, ax: Axes | None = None) -> Axes:
    """Void against contact anisotropy, with fitted lines; parameters as for :func:`evolution`."""
    group = _group(rows)
    axes = _axes(ax)
    draw_group(axes, None, group, fits_of(compare_tables(rows)), is_turned(rows))
    return axes


def _over_strain(rows: Rows, ax: Axes | None, of: str, share: bool) -> Axes:
    if of not in PANELS:
        raise SettingsError(f"of: expected {' or '.join(PANELS)}, found {of!r}")
    group = _group(rows)
    axes = _axes(ax)
    quantity = quantities_of(share, is_turned(rows))[PANELS.index(of)]
    draw_panel(axes, group.drawn, quantity, share)
    set_abscissa(axes, abscissa_label(rows), [group])
    for one in group.drawn:
        # for the legend alone: the curve itself has errors beside it
        axes.plot([], [], label=one.name, **one.look)
    axes.legend()
    return axes


def _group(rows: Rows) -> Group:
    """The curves of the one panel that there is."""
    curves = curves_of(rows)
    if not any(np.isfinite(curve.void).any() for curve in curves):
        raise SettingsError("there is nothing to draw: no row of the table has a void fabric")
    groups = grouped(curves)
    if len(groups) > 1:
        raise SettingsError(
            "several variants of several sources are too many for one Axes: choose some, "
            'for instance by table.select(variant="c")'
        )
    return groups[0]


def _axes(ax: Axes | None) -> Axes:
    """The Axes that are given, or new ones that a notebook shows."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    with pyplot.rc_context(STYLE):
        return pyplot.figure(layout="constrained").subplots()
