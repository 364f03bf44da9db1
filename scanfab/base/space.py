"""The space of the grains, three dimensions or a coordinate plane, with its constants."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scanfab.base.typing import FloatArray

# number of points on a sphere and on a circle
POINTS, POINTS_OF_A_RIM = 2000, 128


class Space:
    """
    Three-dimensional space, or the coordinate plane of a packing of discs.

    This class holds all differences between the two. In a plane a ball is a disc, a volume is an
    area, and parallel lines lie side by side instead of in a grid.

    Parameters
    ----------
    across : int, optional
        The coordinate that is constant in the plane: 0, 1 or 2 for x, y or z. Default: no plane.

    Examples
    --------
    >>> from scanfab.base.space import Space
    >>> plane = Space(2)
    >>> plane, plane.dimension, plane.along
    (Space: the plane x-y, 2, (0, 1))
    """

    def __init__(self, across: int | None = None) -> None:
        flat = across is not None
        self.across = across
        self.is_plane = flat
        self.dimension = 2 if flat else 3
        last = 2 if across is None else across
        order = ((last + 1) % 3, (last + 2) % 3, last)
        self.along: tuple[int, ...] = order[: self.dimension]
        """Indices of its coordinates, in a plane in cyclic order: x-y, y-z or z-x."""
        self.name = "-".join("xyz"[k] for k in sorted(self.along))
        """Its coordinates as users name them, for instance ``x-y``."""
        self.basis: FloatArray = np.eye(3)[[*order]]
        """Unit vectors along its coordinates, shape (3, 3); in a plane the normal comes last."""
        self.normal: FloatArray = self.basis[2]
        """Unit normal of a plane, shape (3,)."""
        self.identity = np.diag([1.0 if k in self.along else 0.0 for k in range(3)])
        """Unit tensor, shape (3, 3); in a plane its component along the normal is 0."""
        self.second_order = 4.0 if flat else 7.5
        """Factor of the fabric deviator F = 15/2 (G - I/3), in a plane F = 4 (G - I/2)."""
        self.intensity = 0.5 if flat else 1.5
        """Factor under the root of a = √(3/2 F:F), in a plane a = √(1/2 F:F)."""
        self.unit_shadow = 2.0 if flat else np.pi
        """Projected area of the unit ball; in a plane the width of the unit disc."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Space) and self.across == other.across

    def __hash__(self) -> int:
        return hash(self.across)

    def __repr__(self) -> str:
        return f"Space: {self}"

    def __str__(self) -> str:
        return f"the plane {self.name}" if self.is_plane else "all three dimensions"

    def axial(self, cosine2: Any) -> Any:
        """
        The second Legendre polynomial of directions, from their squared cosine x with an axis.

        3/2 x - 1/2, in a plane 2 x - 1: it is 1 along the axis, and its mean over all directions
        is 0.
        """
        return self.dimension / (self.dimension - 1.0) * cosine2 - 1.0 / (self.dimension - 1.0)

    def volume(self, radius: FloatArray, share: FloatArray | float = 1.0) -> FloatArray:
        """Volumes of balls times a fraction of each; in a plane areas of discs."""
        if self.across is None:
            return np.asarray(share * 4.0 / 3.0 * np.pi * radius**3)
        return np.asarray(share * np.pi * radius**2)

    def shadow(self, radius: FloatArray) -> float:
        """Sum of the projected areas of balls; in a plane of the widths of discs."""
        return self.unit_shadow * float(np.sum(radius ** (self.dimension - 1)))

    def lines(self, shadow: float, spacing: float) -> float:
        """Number of lines of one direction that meet a body of this projected area."""
        return shadow / spacing ** (self.dimension - 1)

    def apart(self, factor: float) -> float:
        """Factor by which the spacing of lines grows when their number is divided by a factor."""
        return math.sqrt(factor) if self.across is None else factor


SPACE = Space()


def on_sphere() -> FloatArray:
    """Points of the unit sphere along a spiral; each stands for nearly the same area."""
    z = 1.0 - (2.0 * np.arange(POINTS) + 1.0) / POINTS
    turn = np.arange(POINTS) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - z**2)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])


def on_circle() -> FloatArray:
    """Points of the circle of radius 1 about z."""
    turn = np.arange(POINTS_OF_A_RIM) * 2.0 * np.pi / POINTS_OF_A_RIM
    return np.column_stack([np.cos(turn), np.sin(turn), np.zeros(POINTS_OF_A_RIM)])
