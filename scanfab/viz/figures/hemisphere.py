"""Both directional distributions of a frame on a disk: void lengths and contact normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import mean_length_function, sphere_points

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame

__all__ = ["CONCENTRATION", "Hemisphere", "disk", "hemisphere_of", "smoothed_density"]


# rings and rays of the disk that a hemisphere is projected on
DISK = (41, 121)
# of the kernel exp(k (n·m)²) that smooths contact normals: half its height at 19 degrees
CONCENTRATION = 6.5


@dataclass(frozen=True, eq=False)
class Hemisphere:
    """One frame: deviation from the mean over all directions, per cent, at :func:`disk`."""

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


def hemisphere_of(frame: ScannedFrame) -> Hemisphere:
    """The directional distributions of a frame."""
    _, directions = disk()
    measured = frame.measurement
    mean_length = mean_length_function(measured.sums.axes, *measured.kept(frame.variant))
    assert mean_length is not None
    points, weights = sphere_points()
    mean = float(weights @ mean_length(points))
    normals = frame.normals
    return Hemisphere(
        frame.title,
        100 * (mean_length(directions) / mean - 1),
        100 * (smoothed_density(normals, directions) - 1) if len(normals) else None,
    )


def smoothed_density(normals: FloatArray, directions: FloatArray) -> FloatArray:
    """Density of the normals (n or -n) about each direction, over that of isotropic ones."""
    points, weights = sphere_points()
    isotropic = float(weights @ np.exp(CONCENTRATION * points[:, 2] ** 2))
    flat = directions.reshape(-1, 3)
    density: FloatArray = np.array(
        [np.exp(CONCENTRATION * (normals @ one) ** 2).mean() for one in flat]
    )
    return density.reshape(directions.shape[:-1]) / isotropic
