"""The sphere RV (representative volume): what lies in it, of lines, grains and contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from scanfab.errors import SettingsError
from scanfab.packing import Packing

__all__ = ["SphereWindow", "default_center", "room_around", "smallest_extent"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SphereWindow:
    """A sphere RV, fixed for a series; lengths in the dump's unit."""

    center: FloatArray
    """Shape (3,)."""
    radius: float

    def contains(self, points: FloatArray, packing: Packing) -> BoolArray:
        """Which points (shape (N, 3)) lie in the window, through periodic faces too."""
        return np.asarray(self.distance(points, packing) < self.radius)

    def distance(self, points: FloatArray, packing: Packing) -> FloatArray:
        """Distance of points from the centre, nearest image, shape (N,)."""
        distance: FloatArray = np.linalg.norm(self.branches(points, packing), axis=1)
        return distance

    def __str__(self) -> str:
        return f"RV (radius {self.radius:g} about {np.round(self.center, 9).tolist()})"

    def check_fits(self, packing: Packing) -> None:
        """
        Make sure that no two images of a grain have their centres in the window.

        Raises
        ------
        SettingsError
            If it is wider than a period.
        """
        if packing.cell is None or not packing.is_periodic:
            return
        shortest = packing.cell.lattice.shortest
        if self.radius > 0.5 * shortest:
            raise SettingsError(
                f"the {self} is wider than the cell's shortest period ({shortest:g}): "
                f"choose a smaller --rv"
            )

    def branches(self, points: FloatArray, packing: Packing) -> FloatArray:
        """From the centre to the nearest image of each point, shape (N, 3)."""
        branch = points - self.center
        if packing.cell is not None and packing.is_periodic:
            branch = branch + packing.cell.nearest_image(branch) @ packing.cell.vectors
        return branch


def smallest_extent(packing: Packing, grains: BoolArray) -> float:
    """The smallest extent of the grains' surfaces (of the cell, along its periodic vectors)."""
    low, high = _surface_box(packing, grains)
    extent = high - low
    if packing.cell is not None:
        extent = np.where(packing.cell.periodic, packing.cell.heights, extent)
    return float(extent.min())


def default_center(packing: Packing, grains: BoolArray) -> FloatArray:
    """The middle of the box of the grains' surfaces (of the cell, along its periodic vectors)."""
    low, high = _surface_box(packing, grains)
    middle: FloatArray = 0.5 * (low + high)
    if packing.cell is not None:
        middle = np.where(packing.cell.periodic, packing.cell.center, middle)
    return middle


def room_around(window: SphereWindow, packing: Packing, grains: BoolArray) -> float:
    """
    The smallest distance from the window to a face of the box of the grains' surfaces.

    Negative if it reaches beyond; infinite if all directions are periodic, as there is no face.
    """
    low, high = _surface_box(packing, grains)
    room = np.minimum(window.center - low, high - window.center) - window.radius
    if packing.cell is not None:
        room = np.where(packing.cell.periodic, np.inf, room)
    return float(room.min())


def _surface_box(packing: Packing, grains: BoolArray) -> tuple[FloatArray, FloatArray]:
    position, radius = packing.position[grains], packing.radius[grains]
    # one coordinate at a time: that is faster by far for millions of grains
    low = [(along - radius).min() for along in position.T]
    high = [(along + radius).max() for along in position.T]
    return np.array(low), np.array(high)
