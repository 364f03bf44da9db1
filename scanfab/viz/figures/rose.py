"""The figure rose: mean void length and contact normals around the vertical axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from scanfab.base.errors import SettingsError
from scanfab.base.option import numbers
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.invariants import fabric_deviator
from scanfab.fabric.tensor import contact_fabric
from scanfab.viz.figures.figure import DirectionalFigure
from scanfab.viz.figures.style import MANY_LOOKS, WIDTH, rounded_down

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame, ScannedFrames

REPLICATES = 16
# So many segments for each direction give mean lengths to about half a per cent.
SEGMENTS = 20_000
# Steps between the azimuths of void lengths, and between the sectors of contacts, degrees.
THETA_STEP = 15.0
CONTACT_STEP = 30.0
POLAR_ANGLES = (90.0, 60.0, 30.0)
EQUATOR = (90.0,)
LOOKS = MANY_LOOKS[:4]
parse_angles = numbers(
    "one to four polar angles above 0 and up to 90 degrees, such as rose:30,60,90",
    lambda angles: 0 < len(angles) <= len(LOOKS) and all(0 < angle <= 90 for angle in angles),
)
# At most so many columns in the legend.
MOST_COLUMNS = 3
# Azimuths of smooth curves, degrees.
AROUND = np.linspace(0, 360, 181)
# Source of the errors that bars show.
BARS = {"voids": "of the scan", "contacts": "of a count of contacts"}


class Ring(NamedTuple):
    """Values around one polar angle, relative to the mean over all directions."""

    theta: FloatArray
    """Azimuths, degrees."""
    value: FloatArray
    error: FloatArray
    """Standard error."""
    curve: FloatArray | None = None
    """A smooth curve beside the values, at the azimuths ``AROUND``."""

    @property
    def reach(self) -> float:
        """Largest distance of values with errors, and of the curve, from 1; at least 0.02."""
        far = np.abs(self.value - 1.0) + np.nan_to_num(self.error)
        curve = np.ones(1) if self.curve is None else self.curve
        return max(0.02, float(np.nanmax(far, initial=0.0)), float(np.abs(curve - 1.0).max()))

    def draw(self, axes: Axes, look: Mapping[str, Any]) -> None:
        """Draw values with bars on polar Axes, and the smooth curve, or else a line through all."""
        style = {**look, "elinewidth": 0.5, "capsize": 0}
        if self.curve is not None:
            axes.plot(np.radians(AROUND), self.curve, color=look["color"], ls=look["ls"])
            style["ls"] = "none"
        axes.errorbar(np.radians(self.theta), self.value, self.error, **style)


class Rose(DirectionalFigure):
    """
    Mean void length and contact normals over the azimuth, at a few polar angles from z.

    For discs, over the directions of their plane, without polar angles.

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
    slow = True
    projection = "polar"
    drawn = "Mean void length and contact normals over the azimuth, relative to isotropy"

    def __init__(
        self,
        data: ScannedFrames,
        angles: Sequence[float] = POLAR_ANGLES,
        frame: int | None = None,
        of: str | None = None,
    ) -> None:
        super().__init__(data, frame, of)
        self.angles = parse_angles("angles", angles)

    @classmethod
    def parse(cls, argument: str) -> dict[str, Any]:
        """Polar angles such as ``30,60,90``."""
        return {"angles": parse_angles("figure", argument)}

    @property
    def space(self) -> Space:
        """The space of the frames; the plane of discs has no polar angles."""
        space = self.frames[0].space
        if space.is_plane and self.angles not in (POLAR_ANGLES, EQUATOR):
            angles = ",".join(f"{one:g}" for one in self.angles)
            reason = f"discs in {space} have no polar angles, found {angles}"
            raise SettingsError(f"figure: {reason}: choose `figure=rose`")
        return space

    @property
    def looks(self) -> dict[float, dict[str, Any]]:
        """The look of each polar angle, the same for the usual angles in all figures."""
        angles = EQUATOR if self.space.is_plane else self.angles
        usual = {phi: LOOKS[k] for k, phi in enumerate(POLAR_ANGLES) if phi in angles}
        free = iter([look for look in reversed(LOOKS) if look not in usual.values()])
        return {phi: usual.get(phi) or next(free) for phi in dict.fromkeys(angles)}

    @property
    def size(self) -> tuple[float, float]:
        """A row for each frame, and the legend."""
        entries = -(-len(self.looks) // MOST_COLUMNS)
        return WIDTH, 3.0 * len(self.frames) + 0.7 + 0.2 * entries

    def draw_column(self, column: list[Axes], frames: list[ScannedFrame], kind: str) -> None:
        """Draw rings about 1 at the polar angles."""
        looks = self.looks
        if kind == "voids":
            every = [[void_ring(one, phi) for phi in looks] for one in frames]
        else:
            # without contacts there is no ring
            each = [one.normals for one in frames]
            every = [[contact_ring(n, phi, self.space) for phi in looks if len(n)] for n in each]
        reach = max((ring.reach for rings in every for ring in rings), default=0.02)
        middle, step = max(0.0, 1.0 - 2.0 * reach), rounded_down(reach)
        circles = [one for one in (1.0 - step, 1.0, 1.0 + step) if one > middle]
        for axes, rings in zip(column, every, strict=True):
            for ring, look in zip(rings, looks.values(), strict=False):
                ring.draw(axes, look)
            axes.plot(np.radians(AROUND), np.ones_like(AROUND), color="0.4", lw=0.6)
            axes.set_ylim(middle, 1.0 + 1.1 * reach)
            # the legend names the circles, as words in the panel would cover data
            axes.set_yticks(circles, [])
            axes.set_xticks(np.radians(np.arange(0, 360, 45)))
            axes.grid(color="0.85", lw=0.5)
            axes.spines["polar"].set_color("0.7")

    def add_legend(self, place: Any, panels: Any) -> None:
        """Add the legend below, with the meaning of angle, circles and bars."""
        handles = [Line2D([], [], **look) for look in self.looks.values()]
        labels = [rf"polar angle $\varphi={phi:g}^\circ$" for phi in self.looks]
        over = "over the azimuth $\\theta$ from x"
        if self.space.is_plane:
            first, second = ("xyz"[k] for k in sorted(self.space.along))
            over = f"over the angle from {first} towards {second}"
            labels = [f"in {self.space}"]
        circles, bars = [], []
        sides = (" (left)", " (right)") if len(panels[0]) > 1 else ("",)
        for side, kind, axes in zip(sides, self.of, panels[0], strict=False):
            named = ", ".join(f"{one:g}" for one in axes.get_yticks())
            circles.append(f"{named} about {axes.get_ylim()[0]:.3g}{side}")
            bars.append(f"{BARS[kind]}{side}")
        note = (
            f"{over}, relative to isotropy\ncircles: {', '.join(circles)}\n"
            f"bars: one standard error, {', '.join(bars)}"
        )
        where: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.08)}
        if isinstance(place, FigureBase):
            where = {"loc": "outside lower center", "ncols": min(len(labels), MOST_COLUMNS)}
        place.legend(handles, labels, title=note, **where)


def void_ring(frame: ScannedFrame, phi: float) -> Ring:
    """Mean void lengths of a frame around a polar angle in degrees; the first one is repeated."""
    # loaded here, as other figures do without compiled kernels
    from scanfab.scan.directions import DirectionRule
    from scanfab.scan.scan import scan_gaps

    measured, plan = frame.measurement, frame.measurement.plan
    around = np.arange(0.0, 361.0, THETA_STEP)
    # at the equator θ and θ + 180° are one line
    theta = around[around < (180.0 if phi == 90 else 360.0)]
    axes, weights = _vectors(theta, phi, plan.space), np.full(len(theta), 1 / len(theta))
    every, counts = measured.kept(frame.variant)
    # the spacing that gives the wanted number of segments
    wider = plan.space.apart(measured.sums.kept(frame.variant)[1].mean() * REPLICATES / SEGMENTS)
    rose = scan_gaps(
        measured.solids,
        DirectionRule("rose", axes, weights, None, turned=False, space=plan.space),
        spacing=float(plan.spacing * wider),
        cutoffs=[plan.cutoff],
        blocks=measured.blocks,
        variants=frame.variant,
        replicates=range(REPLICATES),
        seed=plan.settings.seed,
        workers=plan.workers,
        most_steps=plan.max_chords,
    )
    lengths, numbers = rose.kept(frame.variant, 0, plan.settings.moment)
    mean = every.sum() / counts.sum()
    with np.errstate(invalid="ignore", divide="ignore"):
        value = lengths.sum(axis=0) / numbers.sum(axis=0) / mean
        error = np.nanstd(lengths / numbers, axis=0, ddof=1) / mean / np.sqrt(REPLICATES)
    place = np.arange(len(around)) % len(theta)
    return Ring(around, value[place], error[place])


def _vectors(theta: FloatArray, phi: float, space: Space) -> FloatArray:
    """Unit vectors at azimuths and a polar angle; in a plane from its first coordinate."""
    azimuth, polar = np.radians(theta), np.radians(phi)
    flat, basis = np.sin(polar), np.eye(3)[sorted(space.along)]
    parts = [flat * np.cos(azimuth), flat * np.sin(azimuth), np.full(len(theta), np.cos(polar))]
    return np.column_stack(parts[: len(basis)]) @ basis


def contact_ring(normals: FloatArray, phi: float, space: Space = SPACE) -> Ring:
    """
    Contact normals near a polar angle by azimuth, over what isotropy would give.

    The curve beside them is the second-order density of the contact fabric, after Kanatani (1984).
    """
    both = np.concatenate([normals, -normals])
    # the share of all directions that this ring counts
    share = 1.0
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
    directions = _vectors(AROUND, phi, space)
    deviator = fabric_deviator(tensor.matrix, space)
    density = 1 + np.einsum("ni,ij,nj->n", directions, deviator, directions)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return Ring(middle, count / expected, np.sqrt(count) / expected, density)
