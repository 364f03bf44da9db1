"""The figure projection: mean void length and contact normals over all directions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.space import Space
from scanfab.base.typing import FloatArray
from scanfab.viz.figures.figure import FrameFigure, one_of
from scanfab.viz.figures.hemisphere import Hemisphere, disk, half_circle, hemisphere_of
from scanfab.viz.figures.lobe_noise import noise_notes
from scanfab.viz.figures.style import COLOURS, DIRECTIONAL, WIDTH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure

    from scanfab.viz.scanned_frames import ScannedFrames


DEVIATION = "deviation from the mean in %"


class Projection(FrameFigure):
    """
    Mean void length and contact normals over all directions, on an equal-area disk.

    Of discs over the directions of their plane, as curves.

    Parameters
    ----------
    data : ScannedFrames
        Of :func:`scanfab.scan_frames`.
    frame : int, optional
        The number of a frame, to draw that one alone; on one Axes the last by default.
    of : str, optional
        ``"voids"`` or ``"contacts"``, to draw these alone; on one Axes voids by default.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """

    order = 5
    lettered = True

    def __init__(
        self, data: ScannedFrames, frame: int | None = None, of: str | None = None
    ) -> None:
        super().__init__(data, frame)
        self.of = one_of(of, tuple(DIRECTIONAL))

    @cached_property
    def hemispheres(self) -> list[Hemisphere]:
        """What is drawn of each frame."""
        return [hemisphere_of(one) for one in self.chosen(self.data.frames)]

    @property
    def plane(self) -> Space | None:
        """That of the discs, if they are some."""
        space = self.chosen(self.data.frames)[0].space
        return space if space.is_plane else None

    @property
    def size(self) -> tuple[float, float]:
        """A row for each frame."""
        return WIDTH, 2.5 * len(self.hemispheres) + 0.2

    @property
    def caption(self) -> str:
        """With how large the lobes are by chance alone."""
        drawn = f"Mean void length and contact normals over all directions, {self.data.name}."
        noise = noise_notes(self.chosen(self.data.frames), self.hemispheres)
        return " ".join(filter(None, [drawn, noise, self.data.note]))

    def draw(self, ax: Axes) -> None:
        """Of the last frame, unless another one is asked for."""
        one, kind = self.hemispheres[-1], self.of[0]
        value = getattr(one, kind)
        if self.plane is not None:
            _curve(ax, value, self.plane, _largest([value]))
            ax.set_title(f"{DIRECTIONAL[kind]}\n{one.title}")
            return
        drawn = _disk(ax, value, _largest([value]))
        if drawn is not None:
            ax.figure.colorbar(drawn, ax=ax, shrink=0.8).set_label(DEVIATION)
        ax.set_title(f"{DIRECTIONAL[kind]}\n{one.title}")

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """A row for each frame, a column with its scale for each of both."""
        frames = self.hemispheres
        panels = part.subplots(len(frames), len(self.of), squeeze=False)
        for column, kind in zip(panels.T, self.of, strict=True):
            values = [getattr(one, kind) for one in frames]
            drawn = None
            for axes, one, value in zip(column, frames, values, strict=True):
                if self.plane is not None:
                    _curve(axes, value, self.plane, _largest(values))
                else:
                    drawn = _disk(axes, value, _largest(values)) or drawn
                axes.set_title(f"{DIRECTIONAL[kind]}\n{one.title}", loc="left")
            if drawn is not None:
                bar = part.colorbar(drawn, ax=column, shrink=0.8, pad=0.03, aspect=30)
                bar.set_label(DEVIATION)
        found: list[Axes] = panels.ravel().tolist()
        return found


def _largest(values: Sequence[FloatArray | None]) -> float:
    """The end of the scale: the largest deviation, and at least a tenth of a per cent."""
    known = [float(np.abs(value).max()) for value in values if value is not None]
    return max(max(known, default=1.0), 0.1)


def _curve(axes: Axes, value: FloatArray | None, plane: Space, largest: float) -> None:
    """Over the directions of a plane."""
    first, second = ("xyz"[k] for k in sorted(plane.along))
    axes.set(xlim=(0, 180), ylim=(-1.1 * largest, 1.1 * largest), ylabel=DEVIATION)
    axes.set(xlabel=f"direction, degrees from {first} to {second}", xticks=range(0, 181, 45))
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    if value is None:
        axes.text(90, 0, "no contacts", ha="center")
    else:
        axes.plot(half_circle(plane)[0], value, color=COLOURS["blue"])


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
