"""Convex regions about the origin, as data: half-spaces and at most one quadric."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scanfab.base.option import number
from scanfab.base.typing import BoolArray, FloatArray

__all__ = ["EVERYWHERE", "Convex", "Quadric", "sphere"]


class Quadric(NamedTuple):
    """
    The places x with x·(m I + D) x below a level.

    A sphere has D = 0, and so the same numbers however its axes are turned.
    """

    isotropic: float
    """m, not negative."""
    deviator: FloatArray
    """D, symmetric, shape (3, 3); no eigenvalue of it is below -m."""
    level: float
    """Above 0: the origin lies inside."""


# of a region of planes alone
EVERYWHERE = Quadric(0.0, np.zeros((3, 3)), 1.0)


@dataclass(frozen=True, eq=False)
class Convex:
    """
    A convex region about the origin, bounded; its surface is not part of it.

    Parameters
    ----------
    planes : ndarray
        Rows n, d with unit vectors n: of each plane the side n·x < d, shape (P, 4).
    quadric : Quadric
        The second bound of the region; ``EVERYWHERE`` where the planes are the only one.
    low : ndarray
        The box along x, y and z that holds the region, shape (3,).
    high : ndarray, shape (3,)
        Its opposite corner.
    reach : float
        Radius of the ball about the origin that holds the region; of a sphere its own.
    size : str
        How messages tell its size, for instance ``radius 2``.

    Examples
    --------
    >>> from scanfab import sphere
    >>> ball = sphere(2.0)
    >>> ball
    Convex: radius 2 about the origin
    >>> ball.reach, ball.low.tolist()
    (2.0, [-2.0, -2.0, -2.0])
    """

    planes: FloatArray
    quadric: Quadric
    low: FloatArray
    high: FloatArray
    reach: float
    size: str

    def __repr__(self) -> str:
        return f"Convex: {self.size} about the origin"

    def __str__(self) -> str:
        return self.size

    def contains(self, points: FloatArray) -> BoolArray:
        """
        Which points lie inside.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            From the origin of the region.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        isotropic, deviator, level = self.quadric
        form = isotropic * np.einsum("ij,ij->i", points, points)
        form += np.einsum("ij,ij->i", points @ deviator, points)
        # of the roots, as distances are compared everywhere else
        inside = np.sqrt(form) < np.sqrt(level)
        for plane in self.planes:
            inside &= points @ plane[:3] < plane[3]
        return np.asarray(inside)

    def may_meet(self, points: FloatArray, radius: FloatArray) -> BoolArray:
        """
        Which spheres may reach inside: all that do, and of a sphere no others.

        Past an edge, or a quadric that is no sphere, some are told that only come near.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Their centres, from the origin of the region.
        radius : ndarray, shape (N,)
            Their radii.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        near = np.sqrt(np.einsum("ij,ij->i", points, points)) < self.reach + radius
        for plane in self.planes:
            near &= points @ plane[:3] < plane[3] + radius
        return np.asarray(near)


def sphere(radius: float) -> Convex:
    """
    A sphere about the origin.

    Parameters
    ----------
    radius : float
        Dump's length unit.

    Returns
    -------
    Convex
        The shape of a :class:`scanfab.Window`, or the window of :class:`scanfab.Solids`.

    Raises
    ------
    SettingsError
        If the radius is not a finite number above 0.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import sphere
    >>> sphere(2.0).contains(np.array([[0.0, 0.0, 1.9], [0.0, 2.1, 0.0]]))
    array([ True, False])
    """
    radius = number("a length above 0", lambda value: 0 < value < math.inf)("radius", radius)
    return Convex(
        planes=np.zeros((0, 4)),
        quadric=Quadric(1.0, np.zeros((3, 3)), radius * radius),
        low=np.full(3, -radius),
        high=np.full(3, radius),
        reach=radius,
        size=f"radius {radius:g}",
    )
