"""
The bodies that windows are images of: a ball, a column, a block, and the hull of some corners.

A linear map makes every ellipsoid of the ball of radius 1, every cylinder of the column of radius
1 between z = -1 and 1, every box of the block from -1 to 1. What is known of the body in closed
form, the map carries over: a window that deforms with its sample needs no formula of its own.

A window in a plane is the image of a disc or a square, spanned by the map's first two columns; the
third is the unit normal. Volumes are areas there, and areas are lengths.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from scanfab.base.typing import FloatArray

# of a curved surface that is to be looked at
POINTS, POINTS_OF_A_RIM = 2000, 128
# of a hull: planes that cut lines, all directions together, and the lines along each direction
MOST_CUTS, FEWEST_LINES, MOST_LINES = 40_000_000, 400, 10_000


def points_on_a_rim() -> FloatArray:
    """Points of the circle of radius 1 about z."""
    turn = np.arange(POINTS_OF_A_RIM) * 2.0 * np.pi / POINTS_OF_A_RIM
    return np.column_stack([np.cos(turn), np.sin(turn), np.zeros(POINTS_OF_A_RIM)])


class Body:
    """A convex body with the origin inside, by its constants and three functions of its own."""

    planes: FloatArray
    """Of its flat faces: rows n, d with the body on the side n·x < d, shape (P, 4)."""
    form: FloatArray
    """Of its curved face, x·M x < 1: the diagonal of M, shape (3,); zeros without one."""
    volume: float
    """With edges and radii of the body itself."""
    outline: FloatArray
    """Points of its surface whose hull it is; of a curved one nearly; shape (K, 3)."""
    is_symmetric: bool = True
    """Whether with x also -x lies in it."""
    is_flat: bool = False
    """Whether it lies in a plane; what lies above and below it counts as inside."""

    def support(self, along: FloatArray) -> FloatArray:
        """The place in the body that is furthest along each vector, shape (N, 3)."""
        raise NotImplementedError

    def reach(self, frame: FloatArray) -> float:
        """No place of its image, frame @ x, is further away from the origin."""
        return float(np.linalg.norm(self.outline @ frame.T, axis=1).max())

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """As :meth:`scanfab.Convex.overlap`, moved by ``length * shift``, shifts of any length."""
        raise NotImplementedError


class Ball(Body):
    """Of radius 1 about the origin."""

    planes = np.zeros((0, 4))
    form = np.ones(3)
    volume = 4.0 / 3.0 * math.pi

    def __init__(self) -> None:
        # a spiral, of which all points have a like share of the surface
        z = 1.0 - (2.0 * np.arange(POINTS) + 1.0) / POINTS
        turn = np.arange(POINTS) * np.pi * (3.0 - np.sqrt(5.0))
        across = np.sqrt(1.0 - z**2)
        self.outline = np.column_stack([across * np.cos(turn), across * np.sin(turn), z])

    def support(self, along: FloatArray) -> FloatArray:
        """The end of a radius."""
        unit: FloatArray = along / np.linalg.norm(along, axis=1, keepdims=True)
        return unit

    def reach(self, frame: FloatArray) -> float:
        """The largest semi-axis."""
        return float(np.linalg.svd(frame, compute_uv=False)[0])

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """A lens of two equal caps."""
        step = np.linalg.norm(shift, axis=1)
        u = np.minimum(length * step, 2.0)
        return self.volume * (1.0 - 0.75 * u + u**3 / 16.0), np.pi * step * (1.0 - 0.25 * u**2)


class Column(Body):
    """A cylinder about z, of radius 1 and between z = -1 and 1; in a plane a disc of radius 1."""

    form = np.array([1.0, 1.0, 0.0])

    def __init__(self, is_flat: bool) -> None:
        rim, ends = points_on_a_rim(), np.array([[0.0, 0.0, 1.0, 1.0], [0.0, 0.0, -1.0, 1.0]])
        self.is_flat = is_flat
        self.planes = ends[:0] if is_flat else ends
        self.volume = math.pi if is_flat else 2.0 * math.pi
        self.outline = rim if is_flat else np.concatenate([rim + ends[0, :3], rim + ends[1, :3]])

    def support(self, along: FloatArray) -> FloatArray:
        """A place on a rim, or the middle of an end."""
        across = np.linalg.norm(along[:, :2], axis=1, keepdims=True)
        rim = along[:, :2] / np.where(across > 0.0, across, 1.0)
        height = 0.0 if self.is_flat else 1.0
        return np.column_stack([rim, np.where(along[:, 2] < 0.0, -height, height)])

    def reach(self, frame: FloatArray) -> float:
        """Where the axis stands square on the ends, the distance of a rim; else a little more."""
        widest = np.linalg.svd(frame[:, :2], compute_uv=False)[0]
        if self.is_flat:
            return float(widest)
        square = widest**2 + frame[:, 2] @ frame[:, 2]
        return float(np.sqrt(square + 2.0 * np.linalg.norm(frame[:, :2].T @ frame[:, 2])))

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """The lens of two circles, as high as both columns stand side by side."""
        across, along = np.linalg.norm(shift[:, :2], axis=1), np.abs(shift[:, 2])
        q, height = np.minimum(length * across, 2.0), 2.0 - length * along
        chord = np.sqrt(4.0 - q**2)
        lens = 2.0 * np.arccos(0.5 * q) - 0.5 * q * chord
        if self.is_flat:
            return lens, across * chord
        slope = along * lens + across * chord * height
        return np.maximum(height, 0.0) * lens, np.where(height > 0.0, slope, 0.0)


class Block(Body):
    """A cube from -1 to 1; in a plane a square."""

    form = np.zeros(3)

    def __init__(self, dimension: int, corners: Sequence[Sequence[float]]) -> None:
        axes = np.eye(3)[:dimension]
        self.is_flat = dimension == 2
        self.planes = np.column_stack([np.concatenate([axes, -axes]), np.ones(2 * dimension)])
        self.volume = 2.0**dimension
        self.outline = np.array(corners)

    def support(self, along: FloatArray) -> FloatArray:
        """A corner."""
        return np.where(along < 0.0, -1.0, 1.0) * [1.0, 1.0, 0.0 if self.is_flat else 1.0]

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """A smaller block."""
        step = np.abs(shift[:, : len(self.planes) // 2])
        edge = np.maximum(2.0 - length * step, 0.0)
        others = range(1, step.shape[1])
        slope = sum(
            math.prod((edge[:, i - k] for k in others), start=step[:, i])
            for i in range(step.shape[1])
        )
        return edge.prod(axis=1), np.where(np.all(edge > 0.0, axis=1), slope, 0.0)


@dataclass(frozen=True, eq=False)
class Hull(Body):
    """A convex polyhedron about the origin."""

    outline: FloatArray
    planes: FloatArray
    areas: FloatArray
    """Of the face in each plane, shape (P,)."""
    volume: float

    form = np.zeros(3)
    is_symmetric = False

    def support(self, along: FloatArray) -> FloatArray:
        """A corner."""
        furthest: FloatArray = self.outline[np.argmax(along @ self.outline.T, axis=1)]
        return furthest

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        Of its own chords t: g = V Σ max(0, t - z) / Σ t, and -g' = A #(t ≥ z) / #(t > 0).

        A few hundred lines along each of many directions tell these shares to some 1e-3, and
        what a sum over the directions needs far better. Volume and projected area are exact, the
        latter by A = ½ Σ A_f |n·n_f| over the faces.
        """
        shadow = 0.5 * np.abs(shift @ self.planes[:, :3].T) @ self.areas
        if length == 0.0:
            return np.full(len(shift), self.volume), shadow
        lines = MOST_CUTS // (len(self.planes) * max(len(shift), 1))
        lines = min(max(lines, FEWEST_LINES), MOST_LINES)
        found = [self._long_shares(one, length, lines) for one in shift]
        shared, number = np.array(found).reshape(-1, 2).T
        return self.volume * shared, shadow * number

    def _long_shares(self, shift: FloatArray, length: float, lines: int) -> tuple[float, float]:
        """The share of its chords that is beyond a length, of all together and of their number."""
        step = float(np.linalg.norm(shift))
        axis = shift / step
        u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        sides = np.array([u / np.linalg.norm(u), np.cross(axis, u / np.linalg.norm(u))])
        across = self.outline @ sides.T
        low, extent = across.min(axis=0), np.ptp(across, axis=0)
        # lines at irrational steps: no row of them meets an edge all along
        number = np.arange(lines)
        places = np.column_stack([(number + 0.5) / lines, number * 0.6180339887498949 % 1.0])
        feet = (low + places * extent) @ sides
        steep = self.planes[:, :3] @ axis
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = (self.planes[:, 3] - feet @ self.planes[:, :3].T) / steep
        flat = np.abs(steep) < 1e-14
        outside = np.any(feet @ self.planes[flat, :3].T > self.planes[flat, 3], axis=1)
        leaves = np.min(ends, axis=1, where=steep > 1e-14, initial=np.inf)
        enters = np.max(ends, axis=1, where=steep < -1e-14, initial=-np.inf)
        chords = np.where(outside, 0.0, np.maximum(leaves - enters, 0.0))
        chords = chords[chords > 0.0]
        long = chords[chords >= length * step]
        return float(np.sum(long - length * step) / chords.sum()), len(long) / len(chords)


BALL = Ball()
COLUMN, DISC = Column(is_flat=False), Column(is_flat=True)
BLOCK = Block(3, list(product((-1.0, 1.0), repeat=3)))
# the corners follow one another around it
SQUARE = Block(2, [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)])
