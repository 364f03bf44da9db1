"""The figure rose: mean void length and contact normals around the vertical axis."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.viz.figures.figure import FrameFigure, one_of
from scanfab.viz.figures.rings import Ring, Rings, rings_of
from scanfab.viz.figures.style import COLOURS, DIRECTIONAL, WIDTH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure
    from matplotlib.projections.polar import PolarAxes

    from scanfab.viz.scanned_frames import ScannedFrames


POLAR_ANGLES = (90.0, 60.0, 30.0)
EQUATOR = (90.0,)
RINGS: tuple[dict[str, Any], ...] = (
    {"color": COLOURS["vermilion"], "marker": "^", "ls": "-"},
    {"color": COLOURS["blue"], "marker": "o", "ls": "--"},
    {"color": COLOURS["green"], "marker": "D", "ls": "-."},
    {"color": COLOURS["purple"], "marker": "s", "ls": ":"},
)
USUAL_RINGS = dict(zip((90.0, 60.0, 30.0), RINGS, strict=False))
# of the legend
MOST_COLUMNS = 3
# azimuths of smooth curves, degrees
AROUND = np.linspace(0, 360, 181)


def _are_angles(angles: Sequence[float]) -> bool:
    return 0 < len(angles) <= len(RINGS) and all(0 < angle <= 90 for angle in angles)


def _no_angles(where: str, example: object, found: object) -> SettingsError:
    return SettingsError(
        f"{where}: expected one to four polar angles above 0 and up to 90 degrees, such as "
        f"{example}, found {found!r}"
    )


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
        if not _are_angles(angles):
            raise _no_angles("angles", POLAR_ANGLES, angles)
        self.angles = tuple(angles)
        self.of = one_of(of, tuple(DIRECTIONAL))

    @classmethod
    def parse(cls, argument: str) -> dict[str, Any]:
        """Polar angles such as ``30,60,90``."""
        words = argument.split(",")
        angles = [float(word) for word in words if re.fullmatch(r"\d+(\.\d+)?", word)]
        if len(angles) < len(words) or not _are_angles(angles):
            raise _no_angles("figure", "rose:30,60,90", f"rose:{argument}")
        return {"angles": tuple(angles)}

    @cached_property
    def rings(self) -> list[Rings]:
        """What is drawn of each frame."""
        frames = self.chosen(self.data.frames)
        return [rings_of(one, _angles_in(one.space, self.angles)) for one in frames]

    @property
    def space(self) -> Space:
        """The plane of the frames, if their grains are discs."""
        return self.rings[0].space

    @property
    def drawn_angles(self) -> tuple[float, ...]:
        """Of discs one ring, in their plane."""
        return _angles_in(self.space, self.angles)

    @property
    def size(self) -> tuple[float, float]:
        """A row for each frame, and the legend."""
        entries = -(-len(self.drawn_angles) // MOST_COLUMNS)
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
        rings, looks = self.rings[-1], _ring_looks(self.drawn_angles)
        shown = getattr(rings, self.of[0])
        reach = max(map(_reach, shown), default=0.02)
        _draw_rings(cast("PolarAxes", ax), shown, reach, looks)
        ax.set_title(f"{DIRECTIONAL[self.of[0]]}\n{rings.title}")
        circles, middle = _named_circles(reach)
        ax.legend(
            *_entries(looks, self.space),
            loc="upper center",
            bbox_to_anchor=(0.5, -0.08),
            title=f"{_over(self.space)}, relative to isotropy\ncircles: {circles} about {middle}",
        )

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """A row for each frame, a column for each of both."""
        return draw_roses(part, self.rings, self.drawn_angles, self.of, self.space)


def _angles_in(space: Space, angles: tuple[float, ...]) -> tuple[float, ...]:
    """The polar angles to draw; of discs none but that of their plane."""
    if not space.is_plane:
        return angles
    if angles not in (POLAR_ANGLES, EQUATOR):
        raise SettingsError(
            f"figure: discs in {space} have no polar angles, found "
            f"{','.join(f'{one:g}' for one in angles)}: choose `figure=rose`"
        )
    return EQUATOR


def draw_roses(
    part: Page | SubFigure,
    frames: Sequence[Rings],
    angles: Sequence[float],
    of: Sequence[str] = tuple(DIRECTIONAL),
    space: Space = SPACE,
) -> list[Axes]:
    """Rings on an empty Figure or SubFigure; the panels of a column share their scale."""
    looks = _ring_looks(angles)
    panels = part.subplots(len(frames), len(of), squeeze=False, subplot_kw={"projection": "polar"})
    reaches = []
    for column, kind in enumerate(of):
        reach = max((_reach(ring) for one in frames for ring in getattr(one, kind)), default=0.02)
        reaches.append(reach)
        for axes, one in zip(panels[:, column], frames, strict=True):
            _draw_rings(axes, getattr(one, kind), reach, looks)
            axes.set_title(f"{DIRECTIONAL[kind]}\n{one.title}", loc="left")
    _ring_legend(part, looks, dict(zip(of, reaches, strict=True)), space)
    found: list[Axes] = panels.ravel().tolist()
    return found


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


def _draw_rings(
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


def _named_circles(reach: float) -> tuple[str, str]:
    middle, circles = _scale(reach)
    return ", ".join(f"{one:g}" for one in circles), f"{middle:.3g}"


def _over(space: Space) -> str:
    """What the angle of the panels is."""
    if not space.is_plane:
        return "over the azimuth $\\theta$ from x"
    first, second = ("xyz"[k] for k in sorted(space.along))
    return f"over the angle from {first} towards {second}"


def _entries(looks: Mapping[float, dict[str, Any]], space: Space) -> tuple[list[Any], list[str]]:
    """Handles and labels of the legend."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **look) for look in looks.values()]
    if space.is_plane:
        return handles, [f"in {space}"]
    return handles, [rf"polar angle $\varphi={phi:g}^\circ$" for phi in looks]


def _ring_legend(
    part: Page | SubFigure,
    looks: Mapping[float, dict[str, Any]],
    reaches: Mapping[str, float],
    space: Space,
) -> None:
    """Below the panels, with what circles and bars are."""
    sides = {"voids": "left", "contacts": "right"} if len(reaches) > 1 else {}
    bars = {"voids": "of the scan", "contacts": "of a count of contacts"}
    beside = {kind: f" ({sides[kind]})" if sides else "" for kind in reaches}
    scales = [
        "{} about {}{}".format(*_named_circles(reach), beside[kind])
        for kind, reach in reaches.items()
    ]
    errors = ", ".join(f"{bars[kind]}{beside[kind]}" for kind in reaches)
    note = (
        f"{_over(space)}, relative to isotropy\n"
        f"circles: {', '.join(scales)}\n"
        f"bars: one standard error, {errors}"
    )
    handles, labels = _entries(looks, space)
    part.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=min(len(labels), MOST_COLUMNS),
        title=note,
    )
