"""Curves over the strain: what the figures evolution and normalised share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.curves import Curve, abscissa_label, abscissa_words, is_turned
from scanfab.table.table import Table
from scanfab.viz.figures.figure import Figure, one_of
from scanfab.viz.figures.groups import Drawn, Group, group_of, groups_of
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
    widen,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure


# of each further row of panels, inches
ROW = 2.1
MOST_MARKERS = 25


@dataclass(frozen=True)
class Quantity:
    """What a column of panels shows: a column of the table, and the factor of the axis."""

    label: str
    factor: float
    values: str
    words: str = ""
    """What it is called in a caption; empty without errors."""
    scan: str = ""
    """The column of the scan's part of its errors."""
    smallest: float = 1.0
    """The axis spans at least this, so that noise does not look like a signal."""


AXIAL = (
    Quantity(VOID_UNIT + VOID_AXIAL, 1e3, "alpha_vs_axial", "voids", "alpha_vs_axial_se"),
    Quantity(CONTACT_UNIT + CONTACT_AXIAL, 1e2, "alpha_c_axial", "contacts"),
)
# where the principal axes are not the loading axis
TURNED = (
    Quantity(VOID_UNIT + VOID_INTENSITY, 1e3, "alpha_vs"),
    Quantity(CONTACT_UNIT + CONTACT_INTENSITY, 1e2, "alpha_c"),
    Quantity("coaxiality, degrees", 1.0, "coaxiality_deg"),
)
NORMALISED = (
    Quantity(f"{VOID_AXIAL} / largest", 1.0, "alpha_vs_axial", "voids"),
    Quantity(f"{CONTACT_AXIAL} / largest", 1.0, "alpha_c_axial", "contacts"),
)
NORMALISED_TURNED = (
    Quantity(f"{VOID_INTENSITY} / largest", 1.0, "alpha_vs"),
    Quantity(f"{CONTACT_INTENSITY} / largest", 1.0, "alpha_c"),
)


class StrainCurves(Figure):
    """
    Void and contact anisotropy over the strain, or over the frames.

    A column of panels for voids and one for contacts, a row for each source, or each variant if
    these are fewer. A row for each source is too much for one Axes.
    """

    columns = ("variant", "alpha_vs_axial", "strain", "alpha_c_axial")
    lettered = True
    height: ClassVar[float]
    """Of a single row of panels, inches."""
    share: ClassVar[bool]
    """Whether each curve is divided by its own largest absolute value."""

    def __init__(self, data: Table, of: str | None = None) -> None:
        super().__init__(data)
        self.of = one_of(of, ("voids", "contacts"))
        self.groups = groups_of(data)
        self.turned = is_turned(data)

    @property
    def size(self) -> tuple[float, float]:
        """A row of panels for each group, and as many lines of legend."""
        lines = -(-len(self._entries) // 2)
        return WIDTH, self.height + ROW * (len(self.groups) - 1) + 0.15 * max(lines - 2, 0)

    @property
    def caption(self) -> str:
        """With the abscissa, and with what has errors."""
        what = f"{' and '.join(one.removesuffix('s') for one in self.of)} anisotropy"
        drawn = f"{what.capitalize()} along the loading axis"
        if self.turned:
            angle = ", and the angle between their major axes" if self._has_angle else ""
            drawn = f"Intensity of {what}{angle}"
        divided = ", each curve divided by its own largest absolute value" if self.share else ""
        with_errors = [one for one in self._quantities if one.words and self._has_errors(one)]
        banded = [one.words for one in with_errors]
        errors = f"with total standard errors of {' and '.join(banded)}"
        return (
            f"{drawn}, over {abscissa_words(self.data)}{divided}; "
            f"{errors if banded else 'without total errors'}."
        )

    def draw(self, ax: Axes) -> None:
        """Of voids, unless contacts are asked for."""
        group = group_of(self.groups)
        _draw_curves(ax, group.drawn, self._quantities[0], self.share)
        set_abscissa(ax, abscissa_label(self.data), [group])
        for one in group.drawn:
            # for the legend alone: the curve itself has errors beside it
            ax.plot([], [], label=one.name, **one.look)
        ax.legend()

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """A row for each group, a column for each quantity, and the legend above."""
        shape = len(self.groups), len(self._quantities)
        rows = part.subplots(*shape, squeeze=False, sharex=True, sharey="col")
        for group, panels in zip(self.groups, rows, strict=True):
            for axes, quantity in zip(panels, self._quantities, strict=True):
                _draw_curves(axes, group.drawn, quantity, self.share)
            panels[0].set_title(group.title, loc="left")
        for axes in rows[-1]:
            set_abscissa(axes, abscissa_label(self.data), self.groups)
        self._legend(part)
        found: list[Axes] = rows.ravel().tolist()
        return found

    @cached_property
    def _quantities(self) -> list[Quantity]:
        """A column of panels each: voids first, then contacts."""
        every = (AXIAL, TURNED, NORMALISED, NORMALISED_TURNED)[2 * self.share + self.turned]
        named = dict(zip(("voids", "contacts"), every, strict=False))
        found = [named[one] for one in self.of]
        return found if len(found) == 1 else [*found, *every[2:]]

    @property
    def _has_angle(self) -> bool:
        return len(self._quantities) > len(self.of)

    @property
    def _curves(self) -> list[Curve]:
        return [one.curve for group in self.groups for one in group.drawn]

    def _has_errors(self, one: Quantity) -> bool:
        return any(np.isfinite(curve.total_errors(one.values)).any() for curve in self._curves)

    @property
    def _entries(self) -> dict[str, dict[str, Any]]:
        """Names and looks, which all groups share."""
        return {one.name: one.look for group in self.groups for one in group.drawn}

    def _legend(self, part: Page | SubFigure) -> None:
        """Above the panels, so that it covers no data."""
        from matplotlib.lines import Line2D

        entries = self._entries
        part.legend(
            [Line2D([], [], **look) for look in entries.values()],
            list(entries),
            loc="outside upper center",
            ncols=min(len(entries), 2 if max(map(len, entries)) > 12 else 4),
            title=_note(self._curves, self._quantities, self.share) or None,
        )


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


def _draw_curves(axes: Axes, drawn: Sequence[Drawn], quantity: Quantity, share: bool) -> None:
    """One panel: values, their total errors as bands, the scan's part as bars."""
    for one in drawn:
        values = one.curve.values(quantity.values)
        largest = np.nanmax(np.abs(values), initial=0.0)
        factor = quantity.factor if not share else 1.0 / largest if largest > 0 else np.nan
        if quantity.words:
            error = factor * one.curve.total_errors(quantity.values)
            band(axes, one.curve.x, factor * values, error, one.look["color"])
        every = max(1, -(-len(values) // MOST_MARKERS))
        axes.plot(one.curve.x, factor * values, markevery=every, **one.look)
        if quantity.scan:
            _bars(axes, one, factor * values, factor * one.curve.errors(quantity.scan))
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


def _note(curves: Sequence[Curve], quantities: Sequence[Quantity], share: bool) -> str:
    """What bands and bars are."""
    if not any(quantity.words for quantity in quantities):
        return "without errors: the table has those of the axial values only"
    lines = [_band_note(curves)]
    scan = np.concatenate([curve.errors("alpha_vs_axial_se") for curve in curves])
    if np.isfinite(scan).any() and not share:
        largest = f"{1e3 * np.nanmax(scan):.2g}"
        lines.append(rf"bars: the scan's part, at most ${largest}\times10^{{-3}}$")
    return "\n".join(line for line in lines if line)


def _band_note(curves: Sequence[Curve]) -> str:
    void, contact = (
        any(np.isfinite(curve.total_errors(name)).any() for curve in curves)
        for name in ("alpha_vs_axial", "alpha_c_axial")
    )
    alone = any(curve.contact_alone for curve in curves)
    which = "contacts taken as independent" if alone else "the sample's"
    parts = [f"of {VOID} scan and sample together"] if void else []
    parts += [f"of {CONTACT} {which}"] if contact else []
    return f"bands: one total standard error, {', '.join(parts)}" if parts else ""
