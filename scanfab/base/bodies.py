"""
The bodies that windows are images of: a ball, a column, a block, and the hull of some corners.

A linear map makes every ellipsoid of the ball of radius 1, every cylinder of the column of radius
1 between z = -1 and 1, every box of the block from -1 to 1. What is known of the body in closed
form, the map carries over: a window that deforms with its sample needs no formula of its own.

A disc and a square are the bodies of windows in a plane, spanned by the map's first two columns;
its third is the unit normal. Volumes are areas there, and areas are lengths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Protocol

import numpy as np

from scanfab.base.typing import FloatArray

# of a curved surface that is to be looked at
POINTS, POINTS_OF_A_RIM = 2000, 128
# of a hull: planes that cut lines, all directions together, and the lines along each direction
MOST_CUTS, FEWEST_LINES, MOST_LINES = 40_000_000, 400, 10_000


class Body(Protocol):
    """A convex body with the origin inside."""

    @property
    def planes(self) -> FloatArray:
        """Of its flat faces: rows n, d with the body on the side n·x < d, shape (P, 4)."""
        ...

    @property
    def form(self) -> FloatArray:
        """Of its curved face, x·M x < 1: the diagonal of M, shape (3,); zeros without one."""
        ...

    @property
    def volume(self) -> float:
        """With edges and radii of the body itself."""
        ...

    @property
    def is_symmetric(self) -> bool:
        """Whether with x also -x lies in it."""
        ...

    @property
    def outline(self) -> FloatArray:
        """Points of its surface whose hull it is; of a curved one nearly; shape (K, 3)."""
        ...

    def support(self, along: FloatArray) -> FloatArray:
        """The place in the body that is furthest along each vector, shape (N, 3)."""
        ...

    def reach(self, frame: FloatArray) -> float:
        """No place of its image, frame @ x, is further away from the origin."""
        ...

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        The volume g that it has in common with itself moved by ``length * shift``, and -dg/dlength.

        The second is the area of the lines along the shift that it holds a piece of which is at
        least as long: at length 0 the projected area, for shifts that are unit vectors.
        """
        ...


class Ball:
    """Of radius 1 about the origin."""

    planes = np.zeros((0, 4))
    form = np.ones(3)
    volume = 4.0 / 3.0 * math.pi
    is_symmetric = True

    @cached_property
    def outline(self) -> FloatArray:
        """Points on a spiral, all with a like share of the surface."""
        z = 1.0 - (2.0 * np.arange(POINTS) + 1.0) / POINTS
        turn = np.arange(POINTS) * np.pi * (3.0 - np.sqrt(5.0))
        across = np.sqrt(1.0 - z**2)
        return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])

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


class Column:
    """A cylinder about z, of radius 1 and between z = -1 and 1."""

    planes = np.array([[0.0, 0.0, 1.0, 1.0], [0.0, 0.0, -1.0, 1.0]])
    form = np.array([1.0, 1.0, 0.0])
    volume = 2.0 * math.pi
    is_symmetric = True

    @cached_property
    def outline(self) -> FloatArray:
        """Two rims."""
        turn = np.arange(POINTS_OF_A_RIM) * 2.0 * np.pi / POINTS_OF_A_RIM
        rim = np.column_stack([np.cos(turn), np.sin(turn), np.ones(POINTS_OF_A_RIM)])
        return np.concatenate([rim, rim * [1.0, 1.0, -1.0]])

    def support(self, along: FloatArray) -> FloatArray:
        """A place on a rim, or the middle of an end."""
        across = np.linalg.norm(along[:, :2], axis=1, keepdims=True)
        rim = along[:, :2] / np.where(across > 0.0, across, 1.0)
        return np.column_stack([rim, np.where(along[:, 2] < 0.0, -1.0, 1.0)])

    def reach(self, frame: FloatArray) -> float:
        """Where the axis stands square on the ends, the distance of a rim; else a little more."""
        square = np.linalg.svd(frame[:, :2], compute_uv=False)[0] ** 2 + frame[:, 2] @ frame[:, 2]
        return float(np.sqrt(square + 2.0 * np.linalg.norm(frame[:, :2].T @ frame[:, 2])))

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """The lens of two circles, as high as both columns stand side by side."""
        across, along = np.linalg.norm(shift[:, :2], axis=1), np.abs(shift[:, 2])
        q, height = np.minimum(length * across, 2.0), 2.0 - length * along
        chord = np.sqrt(4.0 - q**2)
        lens = 2.0 * np.arccos(0.5 * q) - 0.5 * q * chord
        slope = along * lens + across * chord * height
        return np.maximum(height, 0.0) * lens, np.where(height > 0.0, slope, 0.0)


class Block:
    """A cube from -1 to 1."""

    planes = np.column_stack([np.concatenate([np.eye(3), -np.eye(3)]), np.ones(6)])
    form = np.zeros(3)
    volume = 8.0
    is_symmetric = True

    @cached_property
    def outline(self) -> FloatArray:
        """Its corners."""
        return np.array(list(product((-1.0, 1.0), repeat=3)))

    def support(self, along: FloatArray) -> FloatArray:
        """A corner."""
        return np.where(along < 0.0, -1.0, 1.0)

    def reach(self, frame: FloatArray) -> float:
        """Distance of the furthest corner."""
        return float(np.linalg.norm(self.outline @ frame.T, axis=1).max())

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """A smaller block."""
        step = np.abs(shift)
        edge = np.maximum(2.0 - length * step, 0.0)
        slope = sum(step[:, i] * edge[:, i - 1] * edge[:, i - 2] for i in range(3))
        return edge.prod(axis=1), np.where(np.all(edge > 0.0, axis=1), slope, 0.0)


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex polyhedron."""

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

    def reach(self, frame: FloatArray) -> float:
        """Distance of the furthest corner."""
        return float(np.linalg.norm(self.outline @ frame.T, axis=1).max())

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


class Disc:
    """Of radius 1, in a plane; what lies above and below it counts as inside."""

    planes = np.zeros((0, 4))
    form = np.array([1.0, 1.0, 0.0])
    volume = math.pi
    is_symmetric = True

    @cached_property
    def outline(self) -> FloatArray:
        """A rim."""
        turn = np.arange(POINTS_OF_A_RIM) * 2.0 * np.pi / POINTS_OF_A_RIM
        return np.column_stack([np.cos(turn), np.sin(turn), np.zeros(POINTS_OF_A_RIM)])

    def support(self, along: FloatArray) -> FloatArray:
        """The end of a radius."""
        flat = along * [1.0, 1.0, 0.0]
        length = np.linalg.norm(flat, axis=1, keepdims=True)
        unit: FloatArray = flat / np.where(length > 0.0, length, 1.0)
        return unit

    def reach(self, frame: FloatArray) -> float:
        """The larger semi-axis."""
        return float(np.linalg.svd(frame[:, :2], compute_uv=False)[0])

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """The lens of two circles."""
        step = np.linalg.norm(shift[:, :2], axis=1)
        u = np.minimum(length * step, 2.0)
        chord = np.sqrt(4.0 - u**2)
        return 2.0 * np.arccos(0.5 * u) - 0.5 * u * chord, step * chord


class Square:
    """From -1 to 1, in a plane; what lies above and below it counts as inside."""

    planes = np.column_stack([np.concatenate([np.eye(3)[:2], -np.eye(3)[:2]]), np.ones(4)])
    form = np.zeros(3)
    volume = 4.0
    is_symmetric = True

    @cached_property
    def outline(self) -> FloatArray:
        """Its corners, one after the other."""
        return np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)])

    def support(self, along: FloatArray) -> FloatArray:
        """A corner."""
        return np.where(along < 0.0, -1.0, 1.0) * [1.0, 1.0, 0.0]

    def reach(self, frame: FloatArray) -> float:
        """Distance of the furthest corner."""
        return float(np.linalg.norm(self.outline @ frame.T, axis=1).max())

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """A smaller rectangle."""
        step = np.abs(shift[:, :2])
        edge = np.maximum(2.0 - length * step, 0.0)
        slope = step[:, 0] * edge[:, 1] + step[:, 1] * edge[:, 0]
        return edge.prod(axis=1), np.where(np.all(edge > 0.0, axis=1), slope, 0.0)


BALL, COLUMN, BLOCK, DISC, SQUARE = Ball(), Column(), Block(), Disc(), Square()
