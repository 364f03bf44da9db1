"""The figure projection: mean void length and contact normals over all directions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric import distribution
from scanfab.table.row import number_of, total_error
from scanfab.viz.figures.figure import DirectionalFigure
from scanfab.viz.figures.style import COLOURS, WIDTH

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame

# Rings and rays of the disk on which a hemisphere is projected, as numpy.mgrid counts them.
DISK = (41j, 121j)
DEVIATION = "deviation from the mean in %"
# k of the kernel exp(k (n·m)²) that smooths contact normals; it has half its height at 19 degrees.
CONCENTRATION = 6.5
# The largest lobe of pure noise is 2 to 3 standard errors.
CHANCE = 3.0


class Projection(DirectionalFigure):
    """
    Mean void length and contact normals over all directions, on an equal-area disk.

    For discs, curves over the directions of their plane.

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
    drawn = "Mean void length and contact normals over all directions"

    @cached_property
    def deviations(self) -> list[dict[str, FloatArray | None]]:
        """What is drawn of each frame."""
        return [deviations_of(one) for one in self.frames]

    @property
    def size(self) -> tuple[float, float]:
        """A row for each frame."""
        return WIDTH, 2.5 * len(self.frames) + 0.2

    @property
    def caption(self) -> str:
        """With the size of lobes that chance alone makes."""
        noise = map(noise_note, self.frames, self.deviations)
        return " ".join(filter(None, [super().caption, *noise]))

    def draw_column(self, column: list[Axes], frames: list[ScannedFrame], kind: str) -> None:
        """Draw disks with one colour bar beside them; curves for discs."""
        values = [one[kind] for one in self.deviations[-len(frames) :]]
        known = [float(np.abs(value).max()) for value in values if value is not None]
        # the scale ends at the largest deviation, and at least at a tenth of a per cent
        largest = max(max(known, default=1.0), 0.1)
        drawn = None
        for axes, frame, value in zip(column, frames, values, strict=True):
            if frame.space.is_plane:
                _draw_curve(axes, value, frame.space, largest)
            else:
                drawn = _draw_disk(axes, value, largest) or drawn
        if drawn is not None:
            page = column[0].figure
            bar = page.colorbar(drawn, ax=column, shrink=0.8, pad=0.03, aspect=30)
            bar.set_label(DEVIATION)


def _draw_curve(axes: Axes, value: FloatArray | None, plane: Space, largest: float) -> None:
    """Draw a curve over the directions of a plane."""
    first, second = ("xyz"[k] for k in sorted(plane.along))
    axes.set(xlim=(0, 180), ylim=(-1.1 * largest, 1.1 * largest), ylabel=DEVIATION)
    axes.set(xlabel=f"direction, degrees from {first} to {second}", xticks=range(0, 181, 45))
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    if value is None:
        axes.text(90, 0, "no contacts", ha="center")
    else:
        axes.plot(places_of(plane)[0], value, color=COLOURS["blue"])


def _draw_disk(axes: Axes, value: FloatArray | None, largest: float) -> Any:
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
    x, y = np.moveaxis(places_of(SPACE)[0], -1, 0)
    scale: dict[str, Any] = {"cmap": "PuOr_r", "vmin": -largest, "vmax": largest}
    return axes.pcolormesh(x, y, value, shading="gouraud", rasterized=True, zorder=0, **scale)


def places_of(space: Space) -> tuple[FloatArray, FloatArray]:
    """
    Places of directions on the disk: the equal-area (Lambert) projection of the upper hemisphere.

    Returns
    -------
    ndarray, shape (41, 121, 2)
        Places on the disk of radius 1: z in the middle, x to the right, y up. Of discs, shape
        (181,), angles from the first coordinate of their plane to the second, degrees.
    ndarray, shape (41, 121, 3) or (181, 3)
        The unit vectors at these places; all other directions are their opposites.
    """
    if space.is_plane:
        angle = np.arange(181.0)
        first, second = (np.eye(3)[k] for k in sorted(space.along))
        turn = np.radians(angle)[:, None]
        return angle, np.cos(turn) * first + np.sin(turn) * second
    rho, theta = np.mgrid[0.0 : 1.0 : DISK[0], 0.0 : 2.0 * np.pi : DISK[1]]
    polar = 2 * np.arcsin(rho / np.sqrt(2))
    along = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    directions = np.dstack([np.sin(polar)[..., None] * along, np.cos(polar)])
    return rho[..., None] * along, directions


def deviations_of(frame: ScannedFrame) -> dict[str, FloatArray | None]:
    """Deviations from the mean over all directions at :func:`places_of` a frame, per cent."""
    measured, space, normals = frame.measurement, frame.space, frame.normals
    _, directions = places_of(space)
    axes, (lengths, counts) = measured.sums.axes, measured.kept(frame.variant)
    mean_length = distribution.mean_length_function(axes, lengths, counts, space)
    assert mean_length is not None
    points, weights = distribution.direction_points(space)
    mean = float(weights @ mean_length(points))
    density = smoothed_density(normals, directions, space) if len(normals) else None
    contacts = None if density is None else 100 * (density - 1)
    return {"voids": 100 * (mean_length(directions) / mean - 1), "contacts": contacts}


def smoothed_density(
    normals: FloatArray, directions: FloatArray, space: Space = SPACE
) -> FloatArray:
    """Density of the normals (n or -n) about each direction, relative to isotropic normals."""
    points, weights = distribution.direction_points(space)
    isotropic = float(weights @ np.exp(CONCENTRATION * points[:, max(space.along)] ** 2))
    every = directions.reshape(-1, 3)
    means = np.array([np.exp(CONCENTRATION * (normals @ one) ** 2).mean() for one in every])
    density: FloatArray = means.reshape(directions.shape[:-1]) / isotropic
    return density


def noise_note(frame: ScannedFrame, deviations: Mapping[str, FloatArray | None]) -> str:
    """
    Compare the lobes of a frame with those that chance alone makes, in words.

    The error of a lobe combines scan and sample, as if it were the same in all directions.
    """
    known = []
    for what, error, deviation in (
        ("void lengths", void_noise(frame.row, frame.space), deviations["voids"]),
        ("contact normals", contact_noise(frame.row, frame.space), deviations["contacts"]),
    ):
        if error is not None and deviation is not None:
            largest = float(np.abs(deviation).max())
            text = f"lobes of {what} reach {largest:.2g} %, one standard error is {error:.2g} %"
            known.append(f"{text}, so they are noise" if largest < CHANCE * error else text)
    return f"Frame {frame.number}: {'; '.join(known)}." if known else ""


def void_noise(row: Mapping[str, Any], space: Space = SPACE) -> float | None:
    """
    Standard error of a lobe of the mean void length, per cent of the mean.

    A lobe is a sum of harmonics, each with √5 times the error of the axial anisotropy α, in a plane
    √2 times. The sample's error has only harmonics of the second degree, five or two. The scan's
    error has all fitted harmonics, as lines of different directions are independent.
    """
    scan, sample = (number_of(row, f"alpha_vs_axial_{part}") for part in ("se", "sample_se"))
    if sample is None:
        return None
    second = distribution.harmonics_of(2, space)
    degrees = range(2, distribution.HIGHEST_DEGREE + 1, 2)
    fitted = sum(distribution.harmonics_of(degree, space) for degree in degrees)
    parts = math.sqrt(fitted) * (scan or 0.0), math.sqrt(second) * sample
    return 100.0 * math.sqrt(second) * math.hypot(*parts)


def contact_noise(row: Mapping[str, Any], space: Space = SPACE) -> float | None:
    """Standard error of the smoothed density of contact normals, per cent of the mean."""
    alone, error = number_of(row, "alpha_c_axial_se"), total_error(row, "alpha_c_axial")
    if not alone or error is None:
        return None
    points, weights = distribution.direction_points(space)
    kernel = np.exp(CONCENTRATION * points[:, max(space.along)] ** 2)
    spread = float(weights @ kernel**2) / float(weights @ kernel) ** 2 - 1.0
    # neighbouring contacts are not independent; the errors of the anisotropy tell by how much
    return 100.0 * math.sqrt(spread / row["contacts"]) * error / alone
