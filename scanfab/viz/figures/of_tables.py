"""Figures of fabric tables: evolution, normalised curves, and a page with the correlation too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray
from scanfab.table.curves import (
    Curve,
    abscissa_label,
    abscissa_words,
    curves_of,
    is_turned,
)
from scanfab.viz.figures.correlation import Fit, draw_correlation
from scanfab.viz.figures.groups import Drawn, Group, grouped
from scanfab.viz.figures.style import (
    CONTACT,
    CONTACT_AXIAL,
    CONTACT_INTENSITY,
    CONTACT_UNIT,
    VOID,
    VOID_AXIAL,
    VOID_INTENSITY,
    VOID_UNIT,
    WIDTH,
    band,
    letter,
    new_figure,
    save_figure,
    widen,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = [
    "SIZES",
    "TABLE_FIGURES",
    "Fit",
    "Quantity",
    "draw_panel",
    "draw_table",
    "plot_table",
    "quantities_of",
    "set_abscissa",
]


TABLE_FIGURES = ("evolution", "normalised", "correlation")

# in inches, of one row of panels
SIZES = {"evolution": (WIDTH, 2.9), "normalised": (WIDTH, 2.7), "correlation": (WIDTH, 2.6)}
# of each further row
ROW = 2.1
MOST_MARKERS = 25


@dataclass(frozen=True)
class Quantity:
    """What a column of panels shows: names of a curve's arrays, and the factor of the axis."""

    label: str
    factor: float
    values: str
    total: str | None = None
    scan: str | None = None
    words: str = ""
    """What it is called in a caption if it has errors."""
    smallest: float = 1.0
    """The axis spans at least this, so that noise does not look like a signal."""


AXIAL = (
    Quantity(VOID_UNIT + VOID_AXIAL, 1e3, "void", "void_total", "void_scan", "voids"),
    Quantity(CONTACT_UNIT + CONTACT_AXIAL, 1e2, "contact", "contact_total", words="contacts"),
)
# where the principal axes are not the loading axis
TURNED = (
    Quantity(VOID_UNIT + VOID_INTENSITY, 1e3, "void_intensity"),
    Quantity(CONTACT_UNIT + CONTACT_INTENSITY, 1e2, "contact_intensity"),
    Quantity("coaxiality, degrees", 1.0, "angle"),
)
NORMALISED = (
    Quantity(f"{VOID_AXIAL} / largest", 1.0, "void", "void_total", words="voids"),
    Quantity(f"{CONTACT_AXIAL} / largest", 1.0, "contact", "contact_total", words="contacts"),
)
NORMALISED_TURNED = (
    Quantity(f"{VOID_INTENSITY} / largest", 1.0, "void_intensity"),
    Quantity(f"{CONTACT_INTENSITY} / largest", 1.0, "contact_intensity"),
)


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
    with new_figure(*SIZES[name or "evolution"]) as figure:
        draw_table(figure, rows, fits, name)
        save_figure(figure, path)


def draw_table(
    figure: Figure,
    rows: Sequence[Mapping[str, Any]],
    fits: Sequence[Fit | None],
    name: str | None = None,
) -> list[str]:
    """
    Draw on an empty figure, which gets its size; parameters as for :func:`plot_table`.

    Returns
    -------
    list of str
        A caption for each figure: what is drawn.
    """
    curves = curves_of(rows)
    if not any(np.isfinite(curve.void).any() for curve in curves):
        raise SettingsError("there is nothing to draw: no row of the table has a void fabric")
    abscissa = abscissa_label(rows), abscissa_words(rows)
    page = _Page(grouped(curves), abscissa, fits, is_turned(rows))
    names = list(TABLE_FIGURES) if name is None else [name]
    heights = [page.height(one) for one in names]
    figure.set_size_inches(WIDTH, sum(heights))
    parts: Any = [figure]
    if name is None:
        parts = figure.subfigures(len(names), 1, height_ratios=heights)
    return [page.draw(part, one) for part, one in zip(parts, names, strict=True)]


class _Page:
    """Figures of one table, whose panels are lettered through."""

    def __init__(
        self,
        groups: list[Group],
        abscissa: tuple[str, str],
        fits: Sequence[Fit | None],
        turned: bool,
    ) -> None:
        self.groups = groups
        self.abscissa, self.over = abscissa
        self.fits = fits
        self.turned = turned
        self.lettered = 0

    def height(self, name: str) -> float:
        """Of a figure, in inches: a row of panels for each group, and as many lines of legend."""
        lines = 0 if name == "correlation" else -(-len(self._entries()) // 2)
        return SIZES[name][1] + ROW * (len(self.groups) - 1) + 0.15 * max(lines - 2, 0)

    def draw(self, part: Figure | SubFigure, name: str) -> str:
        """One of the figures, and its caption."""
        if name == "correlation":
            panels, caption = draw_correlation(part, self.groups, self.fits, self.turned)
            self._letter(panels, [group.title for group in self.groups])
            return caption
        share = name == "normalised"
        quantities = quantities_of(share, self.turned)
        shape = len(self.groups), len(quantities)
        columns = part.subplots(*shape, squeeze=False, sharex=True, sharey="col")
        for group, panels in zip(self.groups, columns, strict=True):
            for axes, quantity in zip(panels, quantities, strict=True):
                draw_panel(axes, group.drawn, quantity, share)
        for axes in columns[-1]:
            set_abscissa(axes, self.abscissa, self.groups)
        titles = [
            group.title if place == 0 else ""
            for group in self.groups
            for place in range(len(quantities))
        ]
        self._letter(columns.ravel().tolist(), titles)
        self._legend(part, _note(self.groups, quantities, share))
        return self._caption(quantities, share)

    def _caption(self, quantities: Sequence[Quantity], share: bool) -> str:
        """What is drawn of a figure with an abscissa."""
        what = "Void and contact anisotropy along the loading axis"
        if self.turned:
            angle = ", and the angle between their major axes"
            what = f"Intensity of void and contact anisotropy{'' if share else angle}"
        divided = ", each curve divided by its own largest absolute value" if share else ""
        curves = [one.curve for group in self.groups for one in group.drawn]
        banded = [
            quantity.words
            for quantity in quantities
            if quantity.total
            and any(np.isfinite(getattr(curve, quantity.total)).any() for curve in curves)
        ]
        errors = f"with total standard errors of {' and '.join(banded)}"
        return f"{what}, over {self.over}{divided}; {errors if banded else 'without total errors'}"

    def _letter(self, panels: Sequence[Axes], titles: Sequence[str]) -> None:
        letter(panels, titles, self.lettered)
        self.lettered += len(panels)

    def _entries(self) -> dict[str, dict[str, Any]]:
        """Names and looks, which all groups share."""
        return {one.name: one.look for group in self.groups for one in group.drawn}

    def _legend(self, part: Figure | SubFigure, note: str) -> None:
        """Above the panels, so that it covers no data."""
        from matplotlib.lines import Line2D

        entries = self._entries()
        part.legend(
            [Line2D([], [], **look) for look in entries.values()],
            list(entries),
            loc="outside upper center",
            ncols=min(len(entries), 2 if max(map(len, entries)) > 12 else 4),
            title=note or None,
        )


def quantities_of(share: bool, turned: bool) -> tuple[Quantity, ...]:
    """What a figure shows, a panel each: voids first, then contacts."""
    return (AXIAL, TURNED, NORMALISED, NORMALISED_TURNED)[2 * share + turned]


def set_abscissa(axes: Axes, label: str, groups: Sequence[Group]) -> None:
    """Label and scale of what the curves are drawn over."""
    from matplotlib.ticker import MaxNLocator

    axes.set_xlabel(label)
    places = np.concatenate([one.curve.x for group in groups for one in group.drawn])
    known = np.unique(places[np.isfinite(places)])
    if len(known) == 1:
        # one frame alone has no scale
        axes.set_xlim(known[0] - 1, known[0] + 1)
    if label == "frame":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def draw_panel(axes: Axes, drawn: Sequence[Drawn], quantity: Quantity, share: bool) -> None:
    """One panel: values, their total errors as bands, the scan's part as bars."""
    for one in drawn:
        values = getattr(one.curve, quantity.values)
        largest = np.nanmax(np.abs(values), initial=0.0)
        factor = quantity.factor if not share else 1.0 / largest if largest > 0 else np.nan
        if quantity.total:
            error = factor * getattr(one.curve, quantity.total)
            band(axes, one.curve.x, factor * values, error, one.look["color"])
        every = max(1, -(-len(values) // MOST_MARKERS))
        axes.plot(one.curve.x, factor * values, markevery=every, **one.look)
        if quantity.scan:
            _bars(axes, one, factor * values, factor * getattr(one.curve, quantity.scan))
    axes.set_ylabel(quantity.label)
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    widen(axes, quantity.smallest)


def _bars(axes: Axes, one: Drawn, values: FloatArray, error: FloatArray) -> None:
    if np.isfinite(error).any():
        axes.errorbar(
            one.curve.x,
            values,
            yerr=np.nan_to_num(error),
            fmt="none",
            ecolor=one.look["color"],
            elinewidth=0.9,
        )


def _note(groups: Sequence[Group], quantities: Sequence[Quantity], share: bool) -> str:
    """What bands and bars are."""
    curves = [one.curve for group in groups for one in group.drawn]
    if not any(quantity.total for quantity in quantities):
        return "without errors: the table has those of the axial values only"
    lines = [_band_note(curves)]
    scan = np.concatenate([curve.void_scan for curve in curves])
    if np.isfinite(scan).any() and not share:
        largest = f"{1e3 * np.nanmax(scan):.2g}"
        lines.append(rf"bars: the scan's part, at most ${largest}\times10^{{-3}}$")
    return "\n".join(line for line in lines if line)


def _band_note(curves: Sequence[Curve]) -> str:
    void = any(np.isfinite(curve.void_total).any() for curve in curves)
    contact = any(np.isfinite(curve.contact_total).any() for curve in curves)
    alone = any(curve.contact_alone for curve in curves)
    which = "contacts taken as independent" if alone else "the sample's"
    parts = [f"of {VOID} scan and sample together"] if void else []
    parts += [f"of {CONTACT} {which}"] if contact else []
    return f"bands: one total standard error, {', '.join(parts)}" if parts else ""
