"""The space that grains lie in, all of it or a coordinate plane, and the constants of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from scanfab.base.typing import FloatArray


@dataclass(frozen=True)
class Space:
    """
    All space, or the coordinate plane in which all grains are discs.

    What differs between the two is asked here and nowhere else. In a plane a ball is a disc, a
    volume an area, and lines of one direction lie side by side, not in a grid.

    Parameters
    ----------
    across : int, optional
        The coordinate that is the same all over the plane: 0, 1 or 2 for x, y or z.

    Examples
    --------
    >>> from scanfab.base.space import Space
    >>> plane = Space(2)
    >>> plane, plane.dimension, plane.along
    (Space: the plane x-y, 2, (0, 1))
    """

    across: int | None = None

    def __repr__(self) -> str:
        return f"Space: {self}"

    def __str__(self) -> str:
        return "all three dimensions" if self.across is None else f"the plane {self.name}"

    @property
    def name(self) -> str:
        """The coordinates along it, as users name them: ``x-y``."""
        return "-".join("xyz"[k] for k in sorted(self.along))

    @property
    def dimension(self) -> int:
        """3, or 2 of a plane."""
        return 3 if self.across is None else 2

    @property
    def is_plane(self) -> bool:
        """Whether it is one."""
        return self.across is not None

    @property
    def along(self) -> tuple[int, ...]:
        """Its coordinates; of a plane in the order that makes x-y, y-z and z-x alike."""
        if self.across is None:
            return (0, 1, 2)
        return ((self.across + 1) % 3, (self.across + 2) % 3)

    @property
    def basis(self) -> FloatArray:
        """Unit vectors along these coordinates, of a plane with its normal last, shape (3, 3)."""
        basis: FloatArray = np.eye(3)[
            [*self.along, *([] if self.across is None else [self.across])]
        ]
        return basis

    @property
    def normal(self) -> FloatArray:
        """Of a plane, a unit vector, shape (3,)."""
        normal: FloatArray = self.basis[2]
        return normal

    def axial(self, cosine2: Any) -> Any:
        """
        The signed anisotropy of directions, from their squared cosine with an axis.

        1 along the axis, 0 in the mean of all directions: 3/2 x - 1/2, in a plane 2 x - 1.
        """
        return self.dimension / (self.dimension - 1.0) * cosine2 - 1.0 / (self.dimension - 1.0)

    @property
    def identity(self) -> FloatArray:
        """The unit tensor; 0 across a plane, shape (3, 3)."""
        return np.diag([1.0 if k in self.along else 0.0 for k in range(3)])

    @property
    def second_order(self) -> float:
        """F = 15/2 (G - I/3) is the second order of a density of directions; 4 (G - I/2)."""
        return 7.5 if self.across is None else 4.0

    @property
    def intensity(self) -> float:
        """a = √(3/2 F:F), in a plane √(1/2 F:F)."""
        return 1.5 if self.across is None else 0.5

    @property
    def ball(self) -> float:
        """The volume of a ball of radius 1, of a disc the area."""
        return 4.0 / 3.0 * np.pi if self.across is None else np.pi

    def volume(self, radius: FloatArray, share: FloatArray | float = 1.0) -> FloatArray:
        """Of balls, or a share of each; of discs the area."""
        if self.across is None:
            return np.asarray(share * 4.0 / 3.0 * np.pi * radius**3)
        return np.asarray(share * np.pi * radius**2)

    @property
    def unit_shadow(self) -> float:
        """What lines of one direction meet of a ball of radius 1: an area, of a disc a length."""
        return np.pi if self.across is None else 2.0

    def shadow(self, radius: FloatArray) -> float:
        """What lines of one direction meet of balls, all added up."""
        return self.unit_shadow * float(np.sum(radius ** (self.dimension - 1)))

    def lines(self, shadow: float, spacing: float) -> float:
        """How many lines of one direction meet what has a shadow."""
        return shadow / spacing ** (self.dimension - 1)

    def apart(self, factor: float) -> float:
        """How much further apart lines are that are fewer by a factor."""
        return math.sqrt(factor) if self.across is None else factor


SPACE = Space()
