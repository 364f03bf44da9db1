"""The figure map: the fabric by place, as profiles or as colour maps of planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.table.row import number_of, total_error
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.style import (
    CONTACT_AXIAL,
    CONTACT_UNIT,
    FRAME_LOOKS,
    VOID_AXIAL,
    VOID_UNIT,
    WIDTH,
    band,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure


@dataclass(frozen=True)
class Quantity:
    """What is drawn of each block."""

    column: str
    label: str
    error: str
    """The column of its error; empty if it is of scan and sample together."""
    scale: float = 1.0
    signed: bool = False
    """Whether its scale of colours has zero in the middle."""


QUANTITIES = (
    Quantity("alpha_vs_axial", VOID_UNIT + VOID_AXIAL, "", 1e3, True),
    Quantity("alpha_c_axial", CONTACT_UNIT + CONTACT_AXIAL, "alpha_c_axial_sample_se", 1e2, True),
    Quantity("mean_length", "mean length\n(dump's unit)", "mean_length_se"),
    Quantity("solid_fraction", "solid fraction", "solid_fraction_se"),
    Quantity("coordination", "coordination", "coordination_se"),
)
AXES = "xyz"
# of coordinates, relative to their spread: these are the same
SAME = 1e-6
MISSING = "0.85"


class Map(Figure):
    """
    The fabric by place.

    Slices and shells as profiles: bands are standard errors (of void anisotropy total ones), open
    symbols blocks at a surface. A grid as colour maps of the planes of blocks next to its middle,
    of the last frame; grey blocks have no value, hatched ones lie at a surface.

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
        known = [one for one in QUANTITIES if _any(self.rows, one.column)]
        self.quantities = [one for one in known if quantity in (None, one.column)]
        if not self.quantities:
            raise SettingsError(
                f"there is nothing to draw: no block of variant {self.variant} has "
                f"{quantity or 'a value'}"
            )

    @cached_property
    def frames(self) -> list[list[Any]]:
        """The rows of the first and of the last frame with a value; of one, if there is but one."""
        found: dict[Any, list[Any]] = {}
        for row in self.rows:
            found.setdefault((row.get("source"), row.get("frame")), []).append(row)
        drawn = [one.column for one in self.quantities]
        every = [rows for rows in found.values() if any(_any(rows, name) for name in drawn)]
        return every if len(every) == 1 else [every[0], every[-1]]

    @cached_property
    def is_profile(self) -> bool:
        """Whether blocks follow one another along a line, or about a centre."""
        if self.rows[0].get("r_outer") is not None:
            return True
        middles = _middles(self.frames[-1])
        spread = np.linalg.svd(middles - middles.mean(axis=0), compute_uv=False)
        return bool(len(spread) < 2 or spread[1] <= SAME * spread[0] or spread[0] == 0)

    @property
    def size(self) -> tuple[float, float]:
        """Two profiles a row; of a grid three planes a row."""
        if self.is_profile:
            return WIDTH, 0.4 + 1.75 * ((len(self.quantities) + 1) // 2)
        return WIDTH, 1.7 * len(self.quantities)

    @property
    def caption(self) -> str:
        """With the variant."""
        return f"Fabric by place, variant {self.variant}."

    def draw(self, ax: Axes) -> None:
        """One quantity: its profile, or its values in the plane normal to the first axis."""
        one = self.quantities[0]
        if self.is_profile:
            self._draw_profile(ax, one)
            ax.legend()
        else:
            self._draw_plane(ax, one, 1, *self._limits(one))
            ax.set_title(one.label, loc="left")

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """A profile for each quantity, or a row of three planes."""
        if not self.is_profile:
            return self._planes(part)
        rows = (len(self.quantities) + 1) // 2
        axes = list(np.ravel(part.subplots(rows, 2, sharex=True)))
        used = axes[: len(self.quantities)]
        for one, panel in zip(self.quantities, used, strict=True):
            self._draw_profile(panel, one)
        for panel in axes[len(used) :]:
            panel.set_axis_off()
        for panel in used[:-2]:
            panel.set_xlabel("")
        handles, labels = used[0].get_legend_handles_labels()
        if len(axes) > len(used):
            # above a panel that stands off there is none to say what its axis is
            used[-2].xaxis.set_tick_params(labelbottom=True)
            axes[-1].legend(handles, labels, loc="center", title=f"variant {self.variant}")
        else:
            part.legend(handles, labels, loc="outside upper left", title=f"variant {self.variant}")
        return used

    def _draw_profile(self, axes: Axes, one: Quantity) -> None:
        """Of the first and the last frame."""
        looks = FRAME_LOOKS[-len(self.frames) :]
        for rows, look in zip(self.frames, looks, strict=True):
            place, label = _places(rows)
            value = one.scale * _numbers(rows, one.column)
            error = one.scale * _errors(rows, one)
            band(axes, place, value, error, look)
            line = {name: look[name] for name in ("color", "marker", "ls")}
            axes.plot(place, value, label=_frame(rows[0]), **line)
            outer = np.array([bool(row.get("at_surface")) for row in rows])
            axes.plot(
                place[outer], value[outer], ls="", marker=look["marker"], mfc="white",
                mec=look["color"],
            )  # fmt: skip
            axes.set(xlabel=label, ylabel=one.label)
        if one.signed:
            axes.axhline(0, color="0.6", lw=0.6, zorder=0)

    def _limits(self, one: Quantity) -> tuple[str, float, float]:
        """Colours, and the values at their ends."""
        values = one.scale * _numbers(self.frames[-1], one.column)
        # in another frame there are some
        known = values[np.isfinite(values)] if np.isfinite(values).any() else np.zeros(1)
        if one.signed:
            largest = float(np.abs(known).max()) or 1.0
            return "RdBu_r", -largest, largest
        low, high = float(known.min()), float(known.max())
        # of one value alone each plane would make a scale of its own
        wider = 0.0 if high > low else 0.05 * abs(low) or 1.0
        return "viridis", low - wider, high + wider

    def _planes(self, part: Page | SubFigure) -> list[Axes]:
        panels = part.subplots(len(self.quantities), 3, squeeze=False)
        for one, row in zip(self.quantities, panels, strict=True):
            limits = self._limits(one)
            for axis, panel in enumerate(row):
                drawn = self._draw_plane(panel, one, axis, *limits)
            bar = part.colorbar(drawn, ax=list(row), fraction=0.05, pad=0.02)
            bar.set_label(one.label)
        return [row[0] for row in panels]

    def _draw_plane(
        self, axes: Axes, one: Quantity, axis: int, colours: str, low: float, high: float
    ) -> Any:
        """The blocks next to the middle along an axis."""
        from matplotlib import colormaps

        rows = self.frames[-1]
        lattice = _Lattice(_middles(rows))
        # of two planes next to the middle the lower one
        chosen = np.flatnonzero(lattice.along(axis) == (lattice.counts[axis] - 1) // 2)
        across = [other for other in range(3) if other != axis]
        columns, lines = (lattice.along(other)[chosen] for other in across)
        picture = np.full([lattice.counts[other] for other in reversed(across)], np.nan)
        picture[lines, columns] = one.scale * _numbers(rows, one.column)[chosen]
        corners = lattice.corners(chosen[0], across)
        colour = colormaps[colours].with_extremes(bad=MISSING)
        values = np.ma.masked_invalid(picture)
        drawn = axes.pcolormesh(*corners, values, cmap=colour, vmin=low, vmax=high)
        outer = np.array([bool(row.get("at_surface")) for row in rows])[chosen]
        for line, column in zip(lines[outer], columns[outer], strict=True):
            around = [line, line, line + 1, line + 1], [column, column + 1, column + 1, column]
            axes.fill(
                corners[0][around], corners[1][around],
                facecolor="none", edgecolor="0.35", hatch="////", lw=0,
            )  # fmt: skip
        place = float(np.mean(lattice.middles[chosen, axis]))
        axes.set_title(f"{AXES[axis]} = {place:.3g}", loc="left")
        axes.set(xlabel=AXES[across[0]], ylabel=AXES[across[1]], aspect="equal")
        axes.locator_params(nbins=4)
        # a narrow panel has no room for many digits
        axes.ticklabel_format(style="sci", scilimits=(-1, 3))
        return drawn


def _any(rows: Sequence[Any], column: str) -> bool:
    return any(row.get(column) is not None for row in rows)


def _numbers(rows: Sequence[Any], column: str) -> FloatArray:
    """A column, NaN where there is no value."""
    values = [row.get(column) for row in rows]
    return np.array([np.nan if one is None else one for one in values], np.float64)


def _errors(rows: Sequence[Any], one: Quantity) -> FloatArray:
    if one.error:
        return _numbers(rows, one.error)
    found = [total_error(row, one.column) for row in rows]
    return np.array([np.nan if error is None else error for error in found], np.float64)


def _middles(rows: Sequence[Any]) -> FloatArray:
    return np.column_stack([_numbers(rows, name) for name in AXES])


def _places(rows: Sequence[Any]) -> tuple[FloatArray, str]:
    """Where the blocks of a profile lie, and what that is."""
    if rows[0].get("r_outer") is not None:
        inner, outer = _numbers(rows, "r_inner"), _numbers(rows, "r_outer")
        return 0.5 * (inner + outer), "distance from the centre (dump's unit)"
    middles = _middles(rows)
    spread = np.ptp(middles, axis=0)
    along = int(np.argmax(spread))
    if spread[along] == 0 or np.sort(spread)[1] <= SAME * spread[along]:
        return middles[:, along], f"{AXES[along]} (dump's unit)"
    return np.linalg.norm(middles - middles[0], axis=1), "along the axis (dump's unit)"


def _frame(row: Any) -> str:
    strain = number_of(row, "strain")
    return f"frame {row.get('frame')}" + ("" if strain is None else f", strain {strain:.3g}")


class _Lattice:
    """How the blocks of a grid lie: along each axis how many, and the step from one to the next."""

    def __init__(self, middles: FloatArray) -> None:
        self.middles = middles
        self.counts, self.strides = [1, 1, 1], [1, 1, 1]
        self.steps = np.zeros((3, 3))
        stride = 1
        while stride < len(middles):
            # those along one axis follow one another at equal steps
            rest = middles[::stride]
            step = rest[1] - rest[0]
            expected = rest[0] + np.arange(len(rest))[:, None] * step
            off = np.linalg.norm(rest - expected, axis=1) > 0.01 * np.linalg.norm(step)
            count = int(np.argmax(off)) if off.any() else len(rest)
            free = [axis for axis in range(3) if self.strides[axis] == 1 and self.counts[axis] == 1]
            axis = max(free, key=lambda one: abs(float(step[one])))
            self.counts[axis], self.strides[axis], self.steps[axis] = count, stride, step
            stride *= count
        # an axis with one block has no step: as wide as the others
        usual = float(np.linalg.norm(self.steps, axis=1).max()) or 1.0
        for axis, count in enumerate(self.counts):
            if count == 1:
                self.steps[axis, axis] = usual

    def along(self, axis: int) -> IntArray:
        """Which one along an axis each block is."""
        numbers: IntArray = np.arange(len(self.middles)) // self.strides[axis] % self.counts[axis]
        return numbers

    def corners(self, block: int, across: Sequence[int]) -> list[FloatArray]:
        """Of all blocks of the plane that a block is in, by their two coordinates there."""
        one, two = across
        first = self.middles[block]
        first = first - sum(self.along(axis)[block] * self.steps[axis] for axis in across)
        columns, lines = (np.arange(self.counts[axis] + 1) - 0.5 for axis in across)
        places = first + columns[None, :, None] * self.steps[one]
        places = places + lines[:, None, None] * self.steps[two]
        return [places[..., axis] for axis in across]
