"""The figure rose: mean void length and contact normals around the vertical axis."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.space import Space
from scanfab.viz.figures.figure import FrameFigure, one_of
from scanfab.viz.figures.rings import Ring, Rings, rings_of
from scanfab.viz.figures.style import COLOURS, DIRECTIONAL, WIDTH, rounded_down

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure

    from scanfab.viz.scanned_frames import ScannedFrames


POLAR_ANGLES = (90.0, 60.0, 30.0)
EQUATOR = (90.0,)
LOOKS: tuple[dict[str, Any], ...] = (
    {"color": COLOURS["vermilion"], "marker": "^", "ls": "-"},
    {"color": COLOURS["blue"], "marker": "o", "ls": "--"},
    {"color": COLOURS["green"], "marker": "D", "ls": "-."},
    {"color": COLOURS["purple"], "marker": "s", "ls": ":"},
)
# columns of the legend
MOST_COLUMNS = 3
# azimuths of smooth curves, degrees
AROUND = np.linspace(0, 360, 181)
# whose errors the bars of a panel are
BARS = {"voids": "of the scan", "contacts": "of a count of contacts"}


class Rose(FrameFigure):
    """
    Mean void length and contact normals over the azimuth, at a few polar angles from z.

    Of discs over the directions of their plane, which has no polar angles.

    Parameters
    ----------
    data : ScannedFrames
        Of :func:`scanfab.scan_frames`.
    angles : sequence of float, optional
        Polar angles, degrees, one to four of them.
    frame : int, optional
        The number of a frame, to draw that one alone; on one Axes the last by default.
    of : str, optional
        ``"voids"`` or ``"contacts"``, to draw these alone; on one Axes voids by default.

    Raises
    ------
    SettingsError
        If there is nothing to draw, or the Axes are not polar.

    Examples
    --------
    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> import scanfab
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    >>> packing = scanfab.find_contacts(scanfab.Packing(grid, 0.5), tolerance=1e-4)
    >>> frames = scanfab.scan_frames(packing, variants="c", tolerance=0.02)
    >>> ax = Figure().subplots(subplot_kw={"projection": "polar"})
    >>> frames.plot.rose(ax=ax, angles=(90, 45)) is ax
    True
    """

    order = 4
    lettered = True
    slow = True
    projection = "polar"

    def __init__(
        self,
        data: ScannedFrames,
        angles: Sequence[float] = POLAR_ANGLES,
        frame: int | None = None,
        of: str | None = None,
    ) -> None:
        super().__init__(data, frame)
        self.angles = _checked_angles(angles, "angles", f"{POLAR_ANGLES}, found {angles!r}")
        self.of = one_of(of, tuple(DIRECTIONAL))

    @classmethod
    def parse(cls, argument: str) -> dict[str, Any]:
        """Polar angles such as ``30,60,90``."""
        words = argument.split(",")
        are_numbers = all(re.fullmatch(r"\d+(\.\d+)?", word) for word in words)
        angles = [float(word) for word in words] if are_numbers else []
        example = f"rose:30,60,90, found {f'rose:{argument}'!r}"
        return {"angles": _checked_angles(angles, "figure", example)}

    @cached_property
    def rings(self) -> list[Rings]:
        """What is drawn of each frame."""
        found = []
        for frame in self.chosen(self.data.frames):
            if frame.space.is_plane and self.angles not in (POLAR_ANGLES, EQUATOR):
                angles = ",".join(f"{one:g}" for one in self.angles)
                raise SettingsError(
                    f"figure: discs in {frame.space} have no polar angles, found {angles}: choose "
                    f"`figure=rose`"
                )
            found.append(rings_of(frame, EQUATOR if frame.space.is_plane else self.angles))
        return found

    @property
    def space(self) -> Space:
        """The plane of the frames, if their grains are discs."""
        return self.rings[0].space

    @property
    def looks(self) -> dict[float, dict[str, Any]]:
        """The look of each polar angle; a usual angle has the same look in all figures."""
        angles = EQUATOR if self.space.is_plane else self.angles
        usual = {phi: LOOKS[k] for k, phi in enumerate(POLAR_ANGLES) if phi in angles}
        free = iter([look for look in reversed(LOOKS) if look not in usual.values()])
        return {phi: usual.get(phi) or next(free) for phi in dict.fromkeys(angles)}

    @property
    def size(self) -> tuple[float, float]:
        """A row for each frame, and the legend."""
        entries = -(-len(self.looks) // MOST_COLUMNS)
        return WIDTH, 3.0 * len(self.rings) + 0.7 + 0.2 * entries

    @property
    def caption(self) -> str:
        """With the variant and the source."""
        return (
            f"Mean void length and contact normals over the azimuth, relative to isotropy, "
            f"{self.data.name}."
        )

    def draw(self, ax: Axes) -> None:
        """Of the last frame, unless another one is asked for."""
        reach = self._draw_column([ax], self.rings[-1:], self.of[0], "center")
        handles, labels = self._entries()
        below: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.08)}
        ax.legend(handles, labels, title=self._note({self.of[0]: reach}), **below)

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """A row for each frame, a column for each of both, and the legend below."""
        shape, polar = (len(self.rings), len(self.of)), {"projection": "polar"}
        panels = part.subplots(*shape, squeeze=False, subplot_kw=polar)
        reaches = {
            kind: self._draw_column(column, self.rings, kind, "left")
            for kind, column in zip(self.of, panels.T, strict=True)
        }
        handles, labels = self._entries()
        columns, note = min(len(labels), MOST_COLUMNS), self._note(reaches)
        part.legend(handles, labels, ncols=columns, title=note, loc="outside lower center")
        found: list[Axes] = panels.ravel().tolist()
        return found

    def _draw_column(
        self, column: Sequence[Axes], frames: Sequence[Rings], kind: str, loc: Any
    ) -> float:
        """Panels with one scale; how far it reaches from 1."""
        reach = max((_reach(ring) for one in frames for ring in getattr(one, kind)), default=0.02)
        for axes, one in zip(column, frames, strict=True):
            _draw_rings(axes, getattr(one, kind), reach, self.looks)
            axes.set_title(f"{DIRECTIONAL[kind]}\n{one.title}", loc=loc)
        return reach

    def _entries(self) -> tuple[list[Any], list[str]]:
        """Handles and labels of the legend."""
        from matplotlib.lines import Line2D

        handles = [Line2D([], [], **look) for look in self.looks.values()]
        if self.space.is_plane:
            return handles, [f"in {self.space}"]
        return handles, [rf"polar angle $\varphi={phi:g}^\circ$" for phi in self.looks]

    def _note(self, reaches: Mapping[str, float]) -> str:
        """What the angle of the panels is, and what circles and bars are."""
        over = "over the azimuth $\\theta$ from x"
        if self.space.is_plane:
            first, second = ("xyz"[k] for k in sorted(self.space.along))
            over = f"over the angle from {first} towards {second}"
        sides = dict(zip(reaches, (" (left)", " (right)"), strict=False))
        if len(reaches) == 1:
            sides = dict.fromkeys(reaches, "")
        circles = []
        for kind, reach in reaches.items():
            middle, values = _scale(reach)
            named = ", ".join(f"{one:g}" for one in values)
            circles.append(f"{named} about {middle:.3g}{sides[kind]}")
        errors = ", ".join(f"{BARS[kind]}{sides[kind]}" for kind in reaches)
        return (
            f"{over}, relative to isotropy\ncircles: {', '.join(circles)}\n"
            f"bars: one standard error, {errors}"
        )


def _checked_angles(angles: Sequence[float], where: str, example: str) -> tuple[float, ...]:
    if not 0 < len(angles) <= len(LOOKS) or not all(0 < angle <= 90 for angle in angles):
        raise SettingsError(
            f"{where}: expected one to four polar angles above 0 and up to 90 degrees, such as "
            f"{example}"
        )
    return tuple(angles)


def _reach(ring: Ring) -> float:
    """How far the values, with their errors, and the curve are from 1; at least 0.02."""
    far = np.abs(ring.value - 1.0) + np.nan_to_num(ring.error)
    curve = np.ones(1) if ring.curve is None else ring.curve(AROUND)
    return max(0.02, float(np.nanmax(far, initial=0.0)), float(np.abs(curve - 1.0).max()))


def _draw_rings(
    axes: Axes, rings: Sequence[Ring], reach: float, looks: Mapping[float, dict[str, Any]]
) -> None:
    for ring in rings:
        look = looks[ring.phi]
        theta, value, error = ring.theta, ring.value, ring.error
        if ring.curve is None:
            # closed: the last point is followed by the first
            theta, value, error = (np.append(a, a[:1]) for a in (theta, value, error))
        line = look["ls"] if ring.curve is None else "none"
        style = {**look, "ls": line, "elinewidth": 0.5, "capsize": 0}
        axes.errorbar(np.radians(theta), value, error, **style)
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


def _scale(reach: float) -> tuple[float, list[float]]:
    """The value in the middle of a rose, and those of its circles."""
    middle, step = max(0.0, 1.0 - 2.0 * reach), rounded_down(reach)
    return middle, [one for one in (1.0 - step, 1.0, 1.0 + step) if one > middle]
