"""Both directional distributions of a frame on a disk: void lengths and contact normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import direction_points, mean_length_function

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame


# rings and rays of the disk that a hemisphere is projected on
DISK = (41, 121)
# of the kernel exp(k (n·m)²) that smooths contact normals: half its height at 19 degrees
CONCENTRATION = 6.5


@dataclass(frozen=True, eq=False)
class Hemisphere:
    """
    One frame: deviation from the mean over all directions, per cent.

    At :func:`disk`, or of discs at :func:`half_circle`.
    """

    title: str
    voids: FloatArray
    contacts: FloatArray | None


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


def half_circle(space: Space) -> tuple[FloatArray, FloatArray]:
    """
    Directions of a plane, of which all others are the opposites.

    Returns
    -------
    ndarray, shape (181,)
        Their angles from the first of its coordinates to the second, degrees.
    ndarray, shape (181, 3)
        The unit vectors.
    """
    angle = np.arange(181.0)
    first, second = (np.eye(3)[k] for k in sorted(space.along))
    turn = np.radians(angle)[:, None]
    return angle, np.cos(turn) * first + np.sin(turn) * second


def hemisphere_of(frame: ScannedFrame) -> Hemisphere:
    """The directional distributions of a frame."""
    space = frame.space
    _, directions = half_circle(space) if space.is_plane else disk()
    measured = frame.measurement
    mean_length = mean_length_function(measured.sums.axes, *measured.kept(frame.variant), space)
    assert mean_length is not None
    points, weights = direction_points(space)
    mean = float(weights @ mean_length(points))
    normals = frame.normals
    return Hemisphere(
        frame.title,
        100 * (mean_length(directions) / mean - 1),
        100 * (smoothed_density(normals, directions, space) - 1) if len(normals) else None,
    )


def smoothed_density(
    normals: FloatArray, directions: FloatArray, space: Space = SPACE
) -> FloatArray:
    """Density of the normals (n or -n) about each direction, over that of isotropic ones."""
    points, weights = direction_points(space)
    isotropic = float(weights @ np.exp(CONCENTRATION * points[:, max(space.along)] ** 2))
    flat = directions.reshape(-1, 3)
    density: FloatArray = np.array(
        [np.exp(CONCENTRATION * (normals @ one) ** 2).mean() for one in flat]
    )
    return density.reshape(directions.shape[:-1]) / isotropic
