"""Figures of single frames: roses, projections, lengths of void segments, cut-offs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.viz.figures.style import (
    COLOURS,
    COLUMN,
    DPI,
    VOID_AXIAL,
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
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

__all__ = [
    "CutoffCurve",
    "LengthSample",
    "Projection",
    "Ring",
    "Rose",
    "disk",
    "drawn_histogram",
    "drawn_projection",
    "plot_cutoffs",
    "plot_histogram",
    "plot_projection",
    "plot_rose",
]


RINGS: tuple[dict[str, Any], ...] = (
    {"color": COLOURS["vermilion"], "marker": "^", "ls": "-"},
    {"color": COLOURS["blue"], "marker": "o", "ls": "--"},
    {"color": COLOURS["green"], "marker": "D", "ls": "-."},
    {"color": COLOURS["purple"], "marker": "s", "ls": ":"},
)
USUAL_RINGS = dict(zip((90.0, 60.0, 30.0), RINGS, strict=False))
# of the legend of rings
MOST_COLUMNS = 3
# azimuths of smooth curves, degrees
AROUND = np.linspace(0, 360, 181)
FRAMES: tuple[dict[str, Any], ...] = (
    {"color": COLOURS["blue"], "marker": "o", "ls": "--", "markerfacecolor": "white"},
    {"color": COLOURS["vermilion"], "marker": "^", "ls": "-"},
)
# of both columns of panels
WHAT = ("mean void length", "contact normals")
# rings and rays of the disk that a hemisphere is projected on
DISK = (41, 121)


@dataclass(frozen=True, eq=False)
class Ring:
    """Values around one polar angle, relative to the mean over all directions."""

    phi: float
    """Polar angle, degrees."""
    theta: FloatArray
    """Azimuths, degrees."""
    value: FloatArray
    error: FloatArray
    """Standard error."""
    curve: Callable[[FloatArray], FloatArray] | None = None
    """A smooth curve beside them: value at azimuths in degrees."""


@dataclass(frozen=True, eq=False)
class Rose:
    """One frame: mean void length and contact normals over the azimuth."""

    title: str
    void: Sequence[Ring]
    contact: Sequence[Ring]


@dataclass(frozen=True, eq=False)
class Projection:
    """One frame: deviation from the mean over all directions, per cent, at :func:`disk`."""

    title: str
    void: FloatArray
    contact: FloatArray | None


@dataclass(frozen=True, eq=False)
class LengthSample:
    """One frame: void segments, in units of the smallest radius."""

    title: str
    length: FloatArray
    cutoff: float


@dataclass(frozen=True, eq=False)
class CutoffCurve:
    """One frame: anisotropy over the cut-off, which is in units of the smallest radius."""

    title: str
    cutoff: FloatArray
    alpha: FloatArray
    """alpha_vs_axial, dimensionless."""
    error: FloatArray
    """The scan's part of its standard error."""
    total: FloatArray
    """Its standard error, of scan and sample together; NaN where either is not known."""
    chosen: float


def disk() -> tuple[FloatArray, FloatArray]:
    """
    The equal-area (Lambert) projection of the upper hemisphere.

    Returns
    -------
    ndarray, shape (41, 121, 2)
        Places on the disk of radius 1: z in the middle, x to the right, y up.
    ndarray, shape (41, 121, 3)
        The unit vectors that belong there.
    """
    rho, theta = np.meshgrid(
        np.linspace(0, 1, DISK[0]), np.linspace(0, 2 * np.pi, DISK[1]), indexing="ij"
    )
    polar = 2 * np.arcsin(rho / np.sqrt(2))
    along = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    directions = np.concatenate(
        [np.sin(polar)[..., None] * along, np.cos(polar)[..., None]], axis=-1
    )
    return rho[..., None] * along, directions


def plot_rose(path: Path, roses: Sequence[Rose], dpi: int = DPI) -> None:
    """Roses of void lengths and contact normals, a row for each frame."""
    looks = _ring_looks([ring.phi for ring in roses[0].void])
    entries = -(-len(looks) // MOST_COLUMNS)
    with new_figure(WIDTH, 3.0 * len(roses) + 0.7 + 0.2 * entries) as figure:
        panels = figure.subplots(len(roses), 2, squeeze=False, subplot_kw={"projection": "polar"})
        reaches = []
        for column, kind in enumerate(("void", "contact")):
            rings = [ring for rose in roses for ring in getattr(rose, kind)]
            reach = max((_reach(ring) for ring in rings), default=0.02)
            reaches.append(reach)
            for row, rose in enumerate(roses):
                _rose(panels[row, column], getattr(rose, kind), reach, looks)
        titles = [f"{what}\n{rose.title}" for rose in roses for what in WHAT]
        letter(panels.ravel(), titles)
        _ring_legend(figure, looks, reaches)
        save_figure(figure, path, dpi)


def _ring_looks(angles: Sequence[float]) -> dict[float, dict[str, Any]]:
    """Of each polar angle; the usual ones keep theirs, whichever others there are."""
    usual = {phi: look for phi, look in USUAL_RINGS.items() if phi in angles}
    free = iter([look for look in reversed(RINGS) if look not in usual.values()])
    return {phi: usual.get(phi) or next(free) for phi in dict.fromkeys(angles)}


def _reach(ring: Ring) -> float:
    """How far the values, with their errors, and the curve are from 1; at least 0.02."""
    far = np.abs(ring.value - 1.0) + np.nan_to_num(ring.error)
    curve = np.ones(1) if ring.curve is None else ring.curve(AROUND)
    return max(0.02, float(np.nanmax(far, initial=0.0)), float(np.abs(curve - 1.0).max()))


def _rose(
    axes: PolarAxes, rings: Sequence[Ring], reach: float, looks: Mapping[float, dict[str, Any]]
) -> None:
    for ring in rings:
        look = looks[ring.phi]
        theta, value, error = ring.theta, ring.value, ring.error
        if ring.curve is None:
            # closed, as the last point is followed by the first
            theta, value, error = (np.append(a, a[:1]) for a in (theta, value, error))
        line = look["ls"] if ring.curve is None else "none"
        axes.errorbar(
            np.radians(theta), value, yerr=error, elinewidth=0.5, capsize=0, **{**look, "ls": line}
        )
        if ring.curve is not None:
            axes.plot(np.radians(AROUND), ring.curve(AROUND), color=look["color"], ls=look["ls"])
    axes.plot(np.radians(AROUND), np.ones_like(AROUND), color="0.4", lw=0.6)
    middle, circles = _scale(reach)
    axes.set_ylim(middle, 1.0 + 1.1 * reach)
    # named in the legend: within the panel there is no place where words would not meet the data
    axes.set_yticks(circles, [])
    axes.set_xticks(np.radians(np.arange(0, 360, 45)))
    axes.grid(color="0.85", lw=0.5)
    axes.spines["polar"].set_color("0.7")


def _round_down(value: float) -> float:
    """1, 2 or 5 times a power of ten, not above the value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step for step in (power, 2 * power, 5 * power) if step <= value))


def _scale(reach: float) -> tuple[float, list[float]]:
    """The value in the middle of a rose, and those of its circles."""
    middle = max(0.0, 1.0 - 2.0 * reach)
    step = _round_down(reach)
    return middle, [one for one in (1.0 - step, 1.0, 1.0 + step) if one > middle]


def _ring_legend(
    figure: Figure, looks: Mapping[float, dict[str, Any]], reaches: Sequence[float]
) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **look) for look in looks.values()]
    labels = [rf"polar angle $\varphi={phi:g}^\circ$" for phi in looks]
    scales = [
        f"{', '.join(f'{one:g}' for one in circles)} about {middle:.3g}"
        for middle, circles in map(_scale, reaches)
    ]
    note = (
        "over the azimuth $\\theta$ from x, relative to isotropy\n"
        f"circles: {scales[0]} (left), {scales[1]} (right)\n"
        "bars: one standard error, of the scan (left), of a count of contacts (right)"
    )
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=min(len(labels), MOST_COLUMNS),
        title=note,
    )


def plot_projection(path: Path, frames: Sequence[Projection], dpi: int = DPI) -> None:
    """Write :func:`drawn_projection` to a file."""
    with drawn_projection(frames) as figure:
        save_figure(figure, path, dpi)


@contextmanager
def drawn_projection(frames: Sequence[Projection]) -> Iterator[Figure]:
    """The directional distributions on equal-area disks, a row for each frame."""
    with new_figure(WIDTH, 2.5 * len(frames) + 0.2) as figure:
        panels = figure.subplots(len(frames), 2, squeeze=False)
        for column, kind in enumerate(("void", "contact")):
            values = [getattr(frame, kind) for frame in frames]
            known = [value for value in values if value is not None]
            largest = max((float(np.abs(value).max()) for value in known), default=1.0)
            drawn = None
            for axes, value in zip(panels[:, column], values, strict=True):
                drawn = _disk(axes, value, max(largest, 0.1)) or drawn
            if drawn is not None:
                bar = figure.colorbar(drawn, ax=panels[:, column], shrink=0.8, pad=0.03, aspect=30)
                bar.set_label("deviation from the mean in %")
        letter(panels.ravel(), [f"{what}\n{frame.title}" for frame in frames for what in WHAT])
        yield figure


def _disk(axes: Axes, value: FloatArray | None, largest: float) -> Any:
    axes.set(aspect="equal", xlim=(-1.25, 1.25), ylim=(-1.25, 1.25))
    axes.set_axis_off()
    around = np.linspace(0, 2 * np.pi, 181)
    for polar in (30, 60, 90):
        rho = np.sqrt(2) * np.sin(np.radians(polar) / 2)
        style: dict[str, Any] = {"color": "0.35", "lw": 0.4 if polar < 90 else 0.8}
        axes.plot(rho * np.cos(around), rho * np.sin(around), **style)
        if polar < 90:
            axes.text(rho * 0.7, -rho * 0.7, rf"${polar}^\circ$", fontsize=7, color="0.25")
    for label, x, y in (("x", 1.1, 0), ("y", 0, 1.1), ("z", 0, 0)):
        axes.text(x, y, label, ha="center", va="center")
    if value is None:
        axes.text(0, -0.3, "no contacts", ha="center")
        return None
    places, _ = disk()
    return axes.pcolormesh(
        places[..., 0],
        places[..., 1],
        value,
        cmap="PuOr_r",
        vmin=-largest,
        vmax=largest,
        shading="gouraud",
        rasterized=True,
        zorder=0,
    )


def plot_histogram(path: Path, samples: Sequence[LengthSample], dpi: int = DPI) -> None:
    """Write :func:`drawn_histogram` to a file."""
    with drawn_histogram(samples) as figure:
        save_figure(figure, path, dpi)


@contextmanager
def drawn_histogram(samples: Sequence[LengthSample]) -> Iterator[Figure]:
    """Density of void segment lengths, with the cut-off; an outline for each frame."""
    with new_figure(COLUMN, 3.2) as figure:
        axes = figure.subplots()
        longest = max(float(np.quantile(sample.length, 0.999)) for sample in samples)
        edges = np.linspace(0, longest, 41)
        for sample, look in zip(samples, FRAMES, strict=False):
            density, _ = np.histogram(sample.length, edges, density=True)
            dropped = np.mean(sample.length < sample.cutoff)
            axes.stairs(
                density,
                edges,
                color=look["color"],
                ls=look["ls"],
                lw=1.1,
                baseline=None,
                label=f"{sample.title}:\n{100 * dropped:.0f} % dropped",
            )
        cutoff = samples[-1].cutoff
        axes.axvspan(0, cutoff, color="0.92", zorder=0)
        axes.axvline(cutoff, color="k", lw=0.9, ls=":", label="cut-off")
        axes.set(yscale="log", xlim=(0, longest), ylabel="probability density")
        axes.set(xlabel=r"void segment length / $r_{min}$")
        figure.legend(loc="outside upper left", ncols=1)
        yield figure


def plot_cutoffs(path: Path, curves: Sequence[CutoffCurve], dpi: int = DPI) -> None:
    """Void anisotropy over the cut-off, a curve for each frame."""
    with new_figure(COLUMN, 3.4) as figure:
        axes = figure.subplots()
        for curve, look in zip(curves, FRAMES, strict=False):
            band(axes, curve.cutoff, 1e3 * curve.alpha, 1e3 * curve.total, look["color"])
            axes.errorbar(
                curve.cutoff,
                1e3 * curve.alpha,
                yerr=1e3 * np.nan_to_num(curve.error),
                label=curve.title,
                elinewidth=0.9,
                **look,
            )
        axes.axvline(curves[-1].chosen, color="k", lw=0.9, ls=":", label="cut-off of the table")
        axes.axhline(0, color="0.6", lw=0.6, zorder=0)
        axes.set(xlabel=r"cut-off / $r_{min}$", ylabel=VOID_UNIT + VOID_AXIAL)
        widen(axes, 1.0)
        hole = any((np.isfinite(one.alpha) & ~np.isfinite(one.total)).any() for one in curves)
        without = "\n(none where either is not known)" if hole else ""
        figure.legend(
            loc="outside upper left",
            title="bands: one total standard error, scan and sample"
            f"{without}\nbars: the scan's part",
        )
        save_figure(figure, path, dpi)
