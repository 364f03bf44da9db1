"""The figure rose: mean void length and contact normals around the vertical axis."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from scanfab.base.errors import SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.contact import contact_fabric
from scanfab.fabric.invariants import fabric_deviator
from scanfab.viz.figures.figure import FrameFigure, one_of
from scanfab.viz.figures.style import COLOURS, DIRECTIONAL, WIDTH, rounded_down

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame, ScannedFrames

REPLICATES = 16
# segments for each direction: mean lengths to about half a per cent
SEGMENTS = 20_000
# between azimuths of void lengths, and of the sectors that contacts are counted in, degrees
THETA_STEP = 15.0
CONTACT_STEP = 30.0
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

    @property
    def reach(self) -> float:
        """How far the values, with their errors, and the curve are from 1; at least 0.02."""
        far = np.abs(self.value - 1.0) + np.nan_to_num(self.error)
        curve = np.ones(1) if self.curve is None else self.curve(AROUND)
        return max(0.02, float(np.nanmax(far, initial=0.0)), float(np.abs(curve - 1.0).max()))


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
        try:
            angles = [float(word) for word in argument.split(",")]
        except ValueError:
            angles = []
        example = f"rose:30,60,90, found {f'rose:{argument}'!r}"
        return {"angles": _checked_angles(angles, "figure", example)}

    @cached_property
    def frames(self) -> list[ScannedFrame]:
        """The frames that are drawn."""
        return self.chosen(self.data.frames)

    @cached_property
    def rings(self) -> dict[str, list[list[Ring]]]:
        """The rings of each frame: of ``voids``, and of ``contacts``."""
        angles, found = self.angles, self.frames
        if self.space.is_plane:
            if angles not in (POLAR_ANGLES, EQUATOR):
                raise SettingsError(
                    f"figure: discs in {self.space} have no polar angles, found "
                    f"{','.join(f'{one:g}' for one in angles)}: choose `figure=rose`"
                )
            angles = EQUATOR
        return {
            "voids": [void_rings(one, angles) for one in found],
            "contacts": [
                [contact_ring(one.normals, phi, one.space) for phi in angles if len(one.normals)]
                for one in found
            ],
        }

    @property
    def space(self) -> Space:
        """The plane of the frames, if their grains are discs."""
        return self.frames[0].space

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
        return WIDTH, 3.0 * len(self.frames) + 0.7 + 0.2 * entries

    @property
    def caption(self) -> str:
        """With the variant and the source."""
        return (
            f"Mean void length and contact normals over the azimuth, relative to isotropy, "
            f"{self.data.name}."
        )

    def draw(self, ax: Axes) -> None:
        """Of the last frame, unless another one is asked for."""
        reach = self._draw_column([ax], self.of[0], "center")
        handles, labels = self._entries()
        below: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.08)}
        ax.legend(handles, labels, title=self._note({self.of[0]: reach}), **below)

    def panels(self, part: FigureBase) -> list[Axes]:
        """A row for each frame, a column for each of both, and the legend below."""
        shape, polar = (len(self.frames), len(self.of)), {"projection": "polar"}
        panels = part.subplots(*shape, squeeze=False, subplot_kw=polar)
        reaches = {
            kind: self._draw_column(column, kind, "left")
            for kind, column in zip(self.of, panels.T, strict=True)
        }
        handles, labels = self._entries()
        columns, note = min(len(labels), MOST_COLUMNS), self._note(reaches)
        part.legend(handles, labels, ncols=columns, title=note, loc="outside lower center")
        return list(panels.ravel())

    def _draw_column(self, column: Sequence[Axes], kind: str, loc: Any) -> float:
        """Panels of the last frames with one scale; how far it reaches from 1."""
        frames = self.frames[-len(column) :]
        every = self.rings[kind][-len(column) :]
        reach = max((ring.reach for rings in every for ring in rings), default=0.02)
        for axes, frame, rings in zip(column, frames, every, strict=True):
            _draw_rings(axes, rings, reach, self.looks)
            axes.set_title(f"{DIRECTIONAL[kind]}\n{frame.title}", loc=loc)
        return reach

    def _entries(self) -> tuple[list[Any], list[str]]:
        """Handles and labels of the legend."""
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


def void_rings(frame: ScannedFrame, angles: Sequence[float]) -> list[Ring]:
    """Mean void lengths of a frame, at some polar angles in degrees."""
    # at the equator θ and θ + 180° are one line
    rings = {phi: np.arange(0.0, 180.0 if phi == 90 else 360.0, THETA_STEP) for phi in angles}
    axes = np.concatenate([_vectors(theta, phi, frame.space) for phi, theta in rings.items()])
    value, error = _mean_lengths(frame, axes)
    ends, found = np.cumsum([len(theta) for theta in rings.values()])[:-1], []
    parts = zip(rings.items(), np.split(value, ends), np.split(error, ends), strict=True)
    for (phi, theta), own, own_error in parts:
        if phi == 90:
            theta = np.concatenate([theta, theta + 180.0])
            own, own_error = np.tile(own, 2), np.tile(own_error, 2)
        found.append(Ring(phi, theta, own, own_error))
    return found


def _vectors(theta: FloatArray, phi: float, space: Space) -> FloatArray:
    azimuth, polar = np.radians(theta), np.radians(phi)
    if space.is_plane:
        return np.column_stack([np.cos(azimuth), np.sin(azimuth)]) @ np.eye(3)[sorted(space.along)]
    flat = np.sin(polar)
    return np.column_stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), np.full(len(theta), np.cos(polar))]
    )


def _mean_lengths(frame: ScannedFrame, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """ℓ of each axis over the mean of all directions, and its standard error, shape (D,)."""
    # compiled kernels, which those who draw something else do without
    from scanfab.scan.directions import DirectionRule
    from scanfab.scan.gaps import scan_gaps

    measured, variant, plan = frame.measurement, frame.variant, frame.measurement.plan
    # as many lines as give the wanted number of segments
    found = measured.sums.kept(variant)[1].mean()
    spacing = plan.spacing * plan.space.apart(found * REPLICATES / SEGMENTS)
    weights = np.full(len(axes), 1 / len(axes))
    rose = scan_gaps(
        measured.solids,
        DirectionRule("rose", axes, weights, None, turned=False, space=plan.space),
        spacing=float(spacing),
        cutoffs=[plan.cutoff],
        blocks=measured.blocks,
        variants=variant,
        replicates=range(REPLICATES),
        seed=plan.seed,
        workers=plan.workers,
        most_steps=plan.max_chords,
    )
    sums_of, numbers = rose.kept(variant, 0, plan.moment)
    length, segments = measured.kept(variant)
    mean = length.sum() / segments.sum()
    with np.errstate(invalid="ignore", divide="ignore"):
        value = sums_of.sum(axis=0) / numbers.sum(axis=0) / mean
        scatter = np.nanstd(sums_of / numbers, axis=0, ddof=1) / mean
    return value, scatter / np.sqrt(REPLICATES)


def contact_ring(normals: FloatArray, phi: float, space: Space = SPACE) -> Ring:
    """
    Contact normals near a polar angle by azimuth, over what isotropy would give.

    The curve beside them is the second-order density of the contact fabric, after Kanatani (1984).
    """
    both = np.concatenate([normals, -normals])
    # the share of all directions that is counted
    share = 1.0
    # angles of a plane are counted from the first of its coordinates
    first, second = sorted(space.along)[:2]
    if not space.is_plane:
        polar = np.degrees(np.arccos(np.clip(both[:, 2], -1, 1)))
        low, high = max(phi - 15.0, 0.0), phi + 15.0
        both = both[(polar >= low) & (polar < high)]
        share = 0.5 * (np.cos(np.radians(low)) - np.cos(np.radians(high)))
    azimuth = np.degrees(np.arctan2(both[:, second], both[:, first])) % 360.0
    edges = np.arange(0.0, 361.0, CONTACT_STEP)
    count, _ = np.histogram(azimuth, edges)
    expected = 2 * len(normals) * share * CONTACT_STEP / 360.0
    tensor = contact_fabric(normals, space)
    assert tensor is not None
    deviator = fabric_deviator(tensor.matrix, space)

    def density(theta: FloatArray) -> FloatArray:
        directions = _vectors(theta, phi, space)
        values: FloatArray = 1 + np.einsum("ni,ij,nj->n", directions, deviator, directions)
        return values

    middle = 0.5 * (edges[1:] + edges[:-1])
    return Ring(phi, middle, count / expected, np.sqrt(count) / expected, density)
