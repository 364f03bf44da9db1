"""The figure map: the fabric by place, as profiles or as colour maps of planes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import FigureBase
from matplotlib.ticker import AutoLocator

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.table.curves import Curve
from scanfab.table.row import column_of, numbers_of
from scanfab.viz.figures.curves import Quantity
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.style import FRAME_LOOKS, LABELS, WIDTH, band

# Quantities with total errors are signed: zero is in the middle of their colours.
QUANTITIES = (
    Quantity("alpha_vs_axial", LABELS["alpha_vs_axial"], 1e3, True),
    Quantity("alpha_c_axial", LABELS["alpha_c_axial"], 1e2, True),
    Quantity("mean_length", "mean length\n(dump's unit)"),
    Quantity("solid_fraction", "solid fraction"),
    Quantity("coordination", "coordination"),
)
AXES = "xyz"
# Coordinates that differ by less than this part of their spread are the same.
SAME = 1e-6
MISSING = "0.85"
SURFACE = "block at the surface (α is biased)"


class Map(Figure):
    """
    The fabric by place.

    Slices and shells are profiles, whose bands are standard errors (of the void anisotropy the
    total errors); grey symbols are blocks at a surface. A grid gives colour maps of the planes of
    blocks next to its middle, of the last frame; grey blocks have no value, and hatched blocks lie
    at a surface. Blocks at a surface do not set the scale.

    Parameters
    ----------
    data : Table
        A map, of :func:`scanfab.fabric_map`.
    variant : str, optional
        Of several the one to draw; by default the first.
    quantity : str, optional
        A column, to draw it alone; on one Axes alpha_vs_axial by default.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """

    kind, order = "map", 9
    columns = ("block", "x", "y", "z", "variant", "alpha_vs_axial")

    def __init__(self, data: Any, variant: str | None = None, quantity: str | None = None) -> None:
        super().__init__(data)
        rows = list(data)
        every = list(dict.fromkeys(row["variant"] for row in rows))
        self.variant = every[0] if variant is None and every else variant
        self.rows = [row for row in rows if row["variant"] == self.variant]
        known = [one for one in QUANTITIES if numbers_of(self.rows, one.column)]
        self.quantities = [one for one in known if quantity in (None, one.column)]
        if not self.quantities:
            none = f"no block of variant {self.variant} has {quantity or 'a value'}"
            raise SettingsError(f"there is nothing to draw: {none}")
        self.is_profile = self.rows[0].get("r_outer") is not None or _is_line(self.frames[-1])
        """Whether blocks follow one another along a line, or about a centre."""

    @cached_property
    def frames(self) -> list[list[Any]]:
        """The rows of the first and of the last frame with a value; of one, if there is but one."""
        found: dict[Any, list[Any]] = {}
        for row in self.rows:
            found.setdefault((row.get("source"), row.get("frame")), []).append(row)
        drawn = [one.column for one in self.quantities]
        every = [rows for rows in found.values() if any(numbers_of(rows, name) for name in drawn)]
        return every if len(every) == 1 else [every[0], every[-1]]

    @property
    def size(self) -> tuple[float, float]:
        """Two profiles a row; of a grid three planes a row."""
        if self.is_profile:
            return WIDTH, 0.4 + 1.9 * ((len(self.quantities) + 1) // 2)
        return WIDTH, 1.7 * len(self.quantities)

    @property
    def caption(self) -> str:
        """Names the variant, and says if blocks lie at the surface."""
        text = f"Fabric by place, variant {self.variant}."
        last = self.frames[-1]
        if all(row.get("at_surface") for row in last):
            text += " All blocks lie at the surface, which biases their α."
        elif not self.is_profile and any(_at_surface(last)):
            text += " Hatched blocks lie at the surface, which biases their α."
        return text

    def draw(self, ax: Axes) -> None:
        """One quantity: its profile, or its values in the plane normal to the second axis."""
        one = self.quantities[0]
        if self.is_profile:
            self._draw_profile(ax, one)
            ax.legend()
        else:
            self._draw_plane(ax, one, 1)
            ax.set_title(one.label, loc="left")

    def panels(self, part: FigureBase) -> list[Axes]:
        """A profile for each quantity, or a row of three planes."""
        if not self.is_profile:
            planes = part.subplots(len(self.quantities), 3, squeeze=False)
            for one, row in zip(self.quantities, planes, strict=True):
                drawn = [self._draw_plane(panel, one, axis) for axis, panel in enumerate(row)]
                bar = part.colorbar(drawn[-1], ax=list(row), fraction=0.05, pad=0.02)
                bar.set_label(one.label)
            return [row[0] for row in planes]
        rows = (len(self.quantities) + 1) // 2
        axes = list(np.ravel(part.subplots(rows, 2, sharex=True)))
        used = axes[: len(self.quantities)]
        for one, panel in zip(self.quantities, used, strict=True):
            self._draw_profile(panel, one)
        for panel in axes[len(used) :]:
            panel.set_axis_off()
        for panel in used[:-2]:
            panel.set_xlabel("")
        for panel in used[-2:]:
            # no panel stands below, so it needs the labels of the shared axis
            panel.xaxis.set_tick_params(labelbottom=True)
        handles, labels = used[0].get_legend_handles_labels()
        if len(axes) > len(used):
            axes[-1].legend(handles, labels, loc="center", title=f"variant {self.variant}")
        else:
            part.legend(handles, labels, loc="outside upper left", title=f"variant {self.variant}")
        return used

    def _draw_profile(self, axes: Axes, one: Quantity) -> None:
        """Draw the profiles of the first and the last frame."""
        looks, greys = FRAME_LOOKS[-len(self.frames) :], []
        for rows, look in zip(self.frames, looks, strict=True):
            place, label = _places(rows)
            curve, outer = Curve("", str(self.variant), place, rows), _at_surface(rows)
            every = one.factor * curve.values(one.column)
            value = np.where(outer, np.nan, every)
            band(axes, place, value, one.factor * one.errors_of(curve), look)
            told = [f"frame {rows[0].get('frame')}"]
            told += [f"strain {strain:.3g}" for strain in numbers_of(rows[:1], "strain")]
            line = {key: look[key] for key in ("color", "marker", "ls")}
            axes.plot(place, value, label=", ".join(told), **line)
            greys.append((place[outer], every[outer], look["marker"]))
            axes.set(xlabel=label, ylabel=one.label)
        if one.total:
            axes.axhline(0, color="0.6", lw=0.6, zorder=0)
        # the surface takes segments from these blocks, so they must not set the scale
        limits = axes.get_ylim()
        for place, every, marker in greys:
            legend = SURFACE if len(place) and marker == looks[-1]["marker"] else None
            axes.plot(place, every, color="0.75", marker=marker, ls="", label=legend, zorder=0)
        axes.set_ylim(limits)

    def _draw_plane(self, axes: Axes, one: Quantity, axis: int) -> Any:
        """The blocks next to the middle along an axis."""
        rows = self.frames[-1]
        middles, outer = _middles(rows), _at_surface(rows)
        number, steps = lattice_of(middles)
        values = np.where(outer, np.nan, one.factor * column_of(rows, one.column))
        # of two planes next to the middle the lower one
        chosen = np.flatnonzero(number[:, axis] == number[:, axis].max() // 2)
        across, up = (other for other in range(3) if other != axis)
        columns, lines = number[chosen, across], number[chosen, up]
        shape = lines.max() + 1, columns.max() + 1
        picture, hatched = np.full(shape, np.nan), np.zeros(shape, bool)
        picture[lines, columns], hatched[lines, columns] = values[chosen], outer[chosen]
        # corners of the blocks: half a step about their middles
        at_column, at_line = np.meshgrid(*(np.arange(n + 1) - 0.5 for n in shape[::-1]))
        places = middles[chosen[0]] - columns[0] * steps[across] - lines[0] * steps[up]
        places = places + at_column[..., None] * steps[across] + at_line[..., None] * steps[up]
        x, y = places[..., across], places[..., up]
        # the colours hold for all blocks, which may have no value where another frame has some
        known = values[np.isfinite(values)] if np.isfinite(values).any() else np.zeros(1)
        largest = float(np.abs(known).max()) or 1.0
        ends = -largest, largest
        if not one.total:
            ends = AutoLocator().nonsingular(known.min(), known.max())
        colours = colormaps["RdBu_r" if one.total else "viridis"].with_extremes(bad=MISSING)
        values = np.ma.masked_invalid(picture)
        drawn = axes.pcolormesh(x, y, values, cmap=colours, norm=Normalize(*ends))
        for line, column in np.argwhere(hatched):
            around = [line, line, line + 1, line + 1], [column, column + 1, column + 1, column]
            axes.fill(x[around], y[around], fc="none", ec="0.35", hatch="////", lw=0)
        place = float(np.mean(middles[chosen, axis]))
        axes.set_title(f"{AXES[axis]} = {place:.3g}", loc="left")
        axes.set(xlabel=AXES[across], ylabel=AXES[up], aspect="equal")
        axes.locator_params(nbins=4)
        # a narrow panel has no room for many digits
        axes.ticklabel_format(style="sci", scilimits=(-1, 3))
        return drawn


def _is_line(rows: Sequence[Any]) -> bool:
    number, _ = lattice_of(_middles(rows))
    return int((number.max(axis=0) > 0).sum()) < 2


def _middles(rows: Sequence[Any]) -> FloatArray:
    return np.column_stack([column_of(rows, name) for name in AXES])


def _at_surface(rows: Sequence[Any]) -> Any:
    """Which blocks lie at a surface; none if all do, so that there is something to draw."""
    outer = np.array([bool(row.get("at_surface")) for row in rows])
    return outer & ~outer.all()


def _places(rows: Sequence[Any]) -> tuple[FloatArray, str]:
    """Where the blocks of a profile lie, and what that is."""
    if rows[0].get("r_outer") is not None:
        middle = 0.5 * (column_of(rows, "r_inner") + column_of(rows, "r_outer"))
        return middle, "distance from the centre\n(dump's unit)"
    middles = _middles(rows)
    spread = np.ptp(middles, axis=0)
    along = int(np.argmax(spread))
    if spread[along] == 0 or np.sort(spread)[1] <= SAME * spread[along]:
        return middles[:, along], f"{AXES[along]} (dump's unit)"
    return np.linalg.norm(middles - middles[0], axis=1), "along the axis (dump's unit)"


def lattice_of(middles: FloatArray) -> tuple[IntArray, FloatArray]:
    """
    How the blocks of a grid lie, from their middles in the order of the table, shape (N, 3).

    Returns
    -------
    ndarray of int, shape (N, 3)
        Which one along x, y and z each block is.
    ndarray, shape (3, 3)
        The step along each of these axes, dump's length unit; of an axis with one block as long as
        the longest of the others.
    """
    numbers = np.zeros((len(middles), 3), np.int64)
    steps = np.zeros((3, 3))
    stride, free = 1, [0, 1, 2]
    while stride < len(middles) and free:
        # blocks along one axis follow one another at equal steps
        rest = middles[::stride]
        step = rest[1] - rest[0]
        off = np.linalg.norm(np.diff(rest, axis=0) - step, axis=1) > 0.01 * np.linalg.norm(step)
        count = int(np.argmax(off)) + 1 if off.any() else len(rest)
        axis = max(free, key=lambda one: abs(float(step[one])))
        free.remove(axis)
        numbers[:, axis] = np.arange(len(middles)) // stride % count
        steps[axis] = step
        stride *= count
    if stride != len(middles):
        raise SettingsError("figure map: the blocks are no whole grid: rows are missing")
    longest = float(np.linalg.norm(steps, axis=1).max()) or 1.0
    for axis in free:
        steps[axis, axis] = longest
    return numbers, steps
