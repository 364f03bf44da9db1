"""Figures of fabric tables: evolution, normalised curves, void against contact fabric."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from scanfab.errors import SettingsError
from scanfab.writers.curves import Curve, abscissa_label, curves_of
from scanfab.writers.plot import LOOKS, new_figure, plain, save_figure, widen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["TABLE_FIGURES", "Fit", "draw_table", "plot_table"]

FloatArray = npt.NDArray[np.float64]

TABLE_FIGURES = {
    "evolution": "void and contact anisotropy over the strain",
    "normalised": "both over the strain, each curve divided by its own largest absolute value",
    "correlation": "void against contact anisotropy, with the fitted line and the paper's slope",
}

# in inches
SIZES = {"evolution": (7.0, 3.0), "normalised": (7.0, 3.0), "correlation": (5.0, 3.0)}
PAGE = (7.0, 7.6)
PAPER_SLOPE = 0.096
# without rattlers: open and larger, so that a curve that coincides with its twin is still seen
OPEN = {"b": 5.5, "d": 5.5}
MOST_MARKERS = 25
VOID, CONTACT = r"$\alpha_{vs}$", r"$\alpha_{c}$"


@dataclass(frozen=True)
class Fit:
    """The line of one source and variant, as the comparison has it; dimensionless."""

    slope: float
    slope_se: float | None
    r2: float | None
    contact: tuple[float, float]
    """Smallest and largest contact anisotropy of the fitted frames."""
    middle: tuple[float, float]
    """Their mean contact and void anisotropy, which the line goes through."""


def plot_table(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    fits: Sequence[Fit | None],
    name: str | None = None,
) -> None:
    """
    Draw a fabric table to a file.

    Parameters
    ----------
    path : Path
        ``.png``, ``.svg`` or ``.pdf``.
    rows : sequence of mapping
        Of the table, numbers may be None.
    fits : sequence of Fit or None
        One for each source and variant, in the order of their first appearance.
    name : str, optional
        One of ``TABLE_FIGURES``; a page with all of them by default.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """
    with new_figure(*(SIZES[name] if name else PAGE)) as figure:
        draw_table(figure, rows, fits, name)
        save_figure(figure, path)


def draw_table(
    figure: Figure,
    rows: Sequence[Mapping[str, Any]],
    fits: Sequence[Fit | None],
    name: str | None = None,
) -> None:
    """Draw on an empty figure; parameters as for :func:`plot_table`."""
    curves = curves_of(rows)
    if not any(np.isfinite(curve.void).any() for curve in curves):
        raise SettingsError("there is nothing to draw: no row of the table has a void fabric")
    abscissa = abscissa_label(rows)
    if name is None:
        panels = figure.subplots(3, 2)
        _evolution(panels[0], curves, abscissa)
        _normalised(panels[1], curves, abscissa)
        _correlation(panels[2, 0], panels[2, 1], curves, fits)
        _letters(panels.ravel()[:5])
    elif name == "correlation":
        left, right = figure.subplots(1, 2, width_ratios=(3, 2))
        _correlation(left, right, curves, fits)
    else:
        draw = {"evolution": _evolution, "normalised": _normalised}[name]
        draw(figure.subplots(1, 2), curves, abscissa)
    if name != "correlation":
        _legend(figure, curves, "" if name == "normalised" else _note(curves))


def _evolution(panels: Sequence[Axes], curves: Sequence[Curve], abscissa: str) -> None:
    left, right = panels
    for curve, look in _with_looks(curves):
        _band(left, curve.x, 1e3 * curve.void, 1e3 * curve.void_sample, look)
        _line(left, curve.x, 1e3 * curve.void, 1e3 * curve.void_scan, look)
        _band(right, curve.x, 1e2 * curve.contact, 1e2 * curve.contact_sample, look)
        _line(right, curve.x, 1e2 * curve.contact, None, look)
    for axes, label, smallest in (
        (left, rf"void fabric  $10^{{3}}\,${VOID}", 1.0),
        (right, rf"contact fabric  $10^{{2}}\,${CONTACT}", 1.0),
    ):
        axes.set(xlabel=abscissa, ylabel=label)
        _zero(axes)
        widen(axes, smallest)


def _normalised(panels: Sequence[Axes], curves: Sequence[Curve], abscissa: str) -> None:
    left, right = panels
    for curve, look in _with_looks(curves):
        for axes, values in ((left, curve.void), (right, curve.contact)):
            largest = np.nanmax(np.abs(values), initial=0.0)
            if largest > 0:
                _line(axes, curve.x, values / largest, None, look)
    left.set(xlabel=abscissa, ylabel=rf"{VOID} / max |{VOID}|")
    right.set(xlabel=abscissa, ylabel=rf"{CONTACT} / max |{CONTACT}|")
    for axes in panels:
        _zero(axes)


def _correlation(
    axes: Axes, margin: Axes, curves: Sequence[Curve], fits: Sequence[Fit | None]
) -> None:
    """Points and lines; the legend, which has numbers, stands in the axes beside."""
    from matplotlib.lines import Line2D

    handles: list[Any] = []
    labels: list[str] = []
    several = len({curve.source for curve in curves}) > 1
    for (curve, look), fit in zip(_with_looks(curves), fits, strict=True):
        points = axes.errorbar(
            1e2 * curve.contact,
            1e3 * curve.void,
            xerr=_bars(1e2 * curve.contact_sample),
            yerr=_bars(1e3 * curve.void_sample),
            fmt=look["marker"],
            color=look["color"],
            markerfacecolor=look["markerfacecolor"],
            markersize=look["markersize"],
            zorder=look["zorder"],
            elinewidth=0.4,
            capsize=0,
        )
        for bars in points.lines[2]:
            bars.set_alpha(0.35)
        if fit is None:
            handles.append(points)
            labels.append(f"{_name(curve, several)}: no line")
            continue
        ends = np.array(fit.contact)
        void = fit.middle[1] + fit.slope * (ends - fit.middle[0])
        (line,) = axes.plot(1e2 * ends, 1e3 * void, color=look["color"], ls=look["ls"], gid="fit")
        handles.append((line, points))
        labels.append(f"{_name(curve, several)}: {_spell(fit)}")
    reach = max((fit.contact[1] for fit in fits if fit is not None), default=0.0)
    if reach > 0:
        (paper,) = axes.plot([0, 1e2 * reach], [0, 1e3 * PAPER_SLOPE * reach], "k:", lw=0.9)
        handles.append(paper)
        labels.append(f"2017 paper: {PAPER_SLOPE:.3f}")
    if any(np.isfinite(curve.contact_sample).any() for curve in curves):
        handles.append(Line2D([], [], color="0.6", lw=0.5))
        labels.append("one standard error\nof the sample")
    axes.set(xlabel=rf"contact fabric  $10^{{2}}\,${CONTACT}")
    axes.set(ylabel=rf"void fabric  $10^{{3}}\,${VOID}")
    _zero(axes)
    widen(axes, 1.0)
    margin.set_axis_off()
    margin.legend(
        handles, labels, loc="center left", title=f"slope of {VOID} on {CONTACT}", handlelength=2.5
    )


def _spell(fit: Fit) -> str:
    """The slope as the table has it, with its error and R² where they exist."""
    error = "" if fit.slope_se is None else f" ± {fit.slope_se:.3f}"
    r2 = "" if fit.r2 is None else f"\n$R^2$ = {fit.r2:.3f}"
    return f"{fit.slope:.3f}{error}{r2}"


def _with_looks(curves: Sequence[Curve]) -> list[tuple[Curve, dict[str, Any]]]:
    """Colour, marker and line by variant; further sources are paler and dotted."""
    sources = list(dict.fromkeys(curve.source for curve in curves))
    looks = []
    for curve in curves:
        place = sources.index(curve.source)
        look = {"color": "0.3", "marker": "v", "ls": "-", **LOOKS.get(curve.variant, {})}
        look["color"] = _paler(look["color"], 0.5 * place / max(len(sources) - 1, 1))
        if place % 2:
            look["ls"] = {"-": ":", "--": "-."}[look["ls"]]
        is_open = curve.variant in OPEN
        look["markerfacecolor"] = "white" if is_open else look["color"]
        look["markersize"] = OPEN.get(curve.variant, 3.5)
        look["zorder"] = 2.0 if is_open else 2.5
        looks.append((curve, look))
    return looks


def _paler(colour: str, share: float) -> Any:
    """A colour mixed with a share of white."""
    from matplotlib.colors import to_rgb

    return tuple((1.0 - share) * part + share for part in to_rgb(colour))


def _line(
    axes: Axes, x: FloatArray, y: FloatArray, error: FloatArray | None, look: Mapping[str, Any]
) -> None:
    every = max(1, -(-len(x) // MOST_MARKERS))
    axes.plot(x, y, markevery=every, **look)
    if error is not None and np.isfinite(error).any():
        bars = _bars(error)
        axes.errorbar(x, y, yerr=bars, fmt="none", ecolor=look["color"], elinewidth=0.7)


def _band(
    axes: Axes, x: FloatArray, y: FloatArray, error: FloatArray, look: Mapping[str, Any]
) -> None:
    if np.isfinite(error).any():
        axes.fill_between(x, y - error, y + error, color=look["color"], alpha=0.13, lw=0)


def _bars(error: FloatArray) -> FloatArray | None:
    return np.nan_to_num(error) if np.isfinite(error).any() else None


def _zero(axes: Axes) -> None:
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)


def _letters(panels: Sequence[Axes]) -> None:
    for letter, axes in zip("abcdefgh", panels, strict=False):
        axes.set_title(f"({letter})", loc="left", fontsize=8)


def _name(curve: Curve, several: bool) -> str:
    return f"{curve.variant}, {plain(curve.source)}" if several else curve.variant


def _legend(figure: Figure, curves: Sequence[Curve], note: str) -> None:
    """Above the panels, so that it covers no data."""
    from matplotlib.lines import Line2D

    several = len({curve.source for curve in curves}) > 1
    meanings = {"a": "whole", "b": "whole, rattlers void", "c": "RV", "d": "RV, rattlers void"}
    handles: list[Any] = []
    labels: list[str] = []
    for curve, look in _with_looks(curves):
        handles.append(Line2D([], [], **look))
        meaning = "" if several else f": {meanings.get(curve.variant, '')}"
        labels.append(f"variant {_name(curve, several)}{meaning}")
    figure.legend(
        handles,
        labels,
        loc="outside upper center",
        ncols=min(len(handles), 2 if several else 4),
        title=note or None,
        title_fontproperties={"size": 7},
    )


def _note(curves: Sequence[Curve]) -> str:
    """What bars and bands are."""

    def exists(values: Callable[[Curve], FloatArray]) -> bool:
        return any(np.isfinite(values(curve)).any() for curve in curves)

    parts = []
    if exists(lambda curve: curve.void_scan):
        parts.append("bars: one standard error of the scan")
    if exists(lambda curve: curve.contact_sample):
        alone = " (contacts taken as independent)"
        known = exists(lambda curve: curve.void_sample)
        parts.append(f"bands: one standard error of the sample{'' if known else alone}")
    return "; ".join(parts)
