"""The space that grains lie in, three-dimensional or a coordinate plane, with its constants."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scanfab.base.typing import FloatArray


class Space:
    """
    Three-dimensional space, or the coordinate plane in which all grains are discs.

    All differences between the two stand here. In a plane a ball is a disc, a
    volume an area, and lines of one direction lie side by side, not in a grid.

    Parameters
    ----------
    across : int, optional
        The coordinate that is constant in the plane: 0, 1 or 2 for x, y or z.

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
        self.along: tuple[int, ...] = (0, 1, 2)
        """Its coordinates; in a plane in the order that makes x-y, y-z and z-x alike."""
        if across is not None:
            self.along = (across + 1) % 3, (across + 2) % 3
        self.name = "-".join("xyz"[k] for k in sorted(self.along))
        """Its coordinates as users name them: ``x-y``."""
        self.basis: FloatArray = np.eye(3)[[*self.along, *([] if across is None else [across])]]
        """Unit vectors along its coordinates, the normal of a plane last, shape (3, 3)."""
        self.normal: FloatArray = self.basis[2]
        """The unit vector across a plane, shape (3,)."""
        self.identity = np.diag([1.0 if k in self.along else 0.0 for k in range(3)])
        """The unit tensor, shape (3, 3); its component across a plane is 0."""
        self.second_order = 4.0 if flat else 7.5
        """F = 15/2 (G - I/3) is the second order of a density of directions; 4 (G - I/2)."""
        self.intensity = 0.5 if flat else 1.5
        """a = √(3/2 F:F), in a plane √(1/2 F:F)."""
        self.ball = np.pi if flat else 4.0 / 3.0 * np.pi
        """The volume of a ball of radius 1; in a plane the area of a disc."""
        self.unit_shadow = 2.0 if flat else np.pi
        """The projected area of a ball of radius 1; in a plane the width of a disc."""

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
        The signed anisotropy of directions, from their squared cosine with an axis.

        1 along the axis, 0 in the mean of all directions: 3/2 x - 1/2, in a plane 2 x - 1.
        """
        return self.dimension / (self.dimension - 1.0) * cosine2 - 1.0 / (self.dimension - 1.0)

    def volume(self, radius: FloatArray, share: FloatArray | float = 1.0) -> FloatArray:
        """The volumes of balls, or of a share of each; in a plane the areas of discs."""
        if self.across is None:
            return np.asarray(share * 4.0 / 3.0 * np.pi * radius**3)
        return np.asarray(share * np.pi * radius**2)

    def shadow(self, radius: FloatArray) -> float:
        """The sum of the projected areas of balls; in a plane of the widths of discs."""
        return self.unit_shadow * float(np.sum(radius ** (self.dimension - 1)))

    def lines(self, shadow: float, spacing: float) -> float:
        """How many lines of one direction meet a body of this projected area."""
        return shadow / spacing ** (self.dimension - 1)

    def apart(self, factor: float) -> float:
        """By how much the spacing of lines grows when their number falls by a factor."""
        return math.sqrt(factor) if self.across is None else factor


SPACE = Space()
