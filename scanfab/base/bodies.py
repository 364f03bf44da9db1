"""
The bodies of which convex regions are images: products of balls and edges, and polyhedra.

A body has these members. ``planes`` are its flat faces, rows n, d with the body on the side
n·x < d, shape (P, 4). ``form`` is the diagonal of M in x·M x < 1, its curved face; zeros without
one. ``volume`` is that of the body itself. ``outline`` are points of its surface, shape (K, 3),
whose hull is the body, or nearly so if it is curved. ``support``, ``reach`` and ``overlap`` are the
functions that a region takes from its body. A symmetric body contains -x with each x. A flat body
lies in a plane, and places above and below it count as inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scanfab.base.typing import FloatArray

# points of curved surfaces, and directions over which a shadow is averaged
POINTS, POINTS_OF_A_RIM, AXES = 2000, 128, 200
# of a hull: planes that cut lines, all directions together, and the lines along each direction
MOST_CUTS, FEWEST_LINES, MOST_LINES = 40_000_000, 400, 10_000
# volume of the ball of radius 1 by the number of its axes
VOLUME_OF_BALL = {0: 1.0, 2: math.pi, 3: 4.0 / 3.0 * math.pi}


def on_sphere() -> FloatArray:
    """Points of the sphere of radius 1 along a spiral, with nearly equal shares of its surface."""
    z = 1.0 - (2.0 * np.arange(POINTS) + 1.0) / POINTS
    turn = np.arange(POINTS) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - z**2)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])


def on_circle() -> FloatArray:
    """Points of the circle of radius 1 about z."""
    turn = np.arange(POINTS_OF_A_RIM) * 2.0 * np.pi / POINTS_OF_A_RIM
    return np.column_stack([np.cos(turn), np.sin(turn), np.zeros(POINTS_OF_A_RIM)])


class Product:
    """
    A ball or disc of radius 1, times edges from -1 to 1 along the axes that follow: a cylinder is
    a disc times an edge, a cube three edges.
    """

    is_symmetric = True

    def __init__(self, is_round: int, edges: int) -> None:
        self.is_round, size = is_round, is_round + edges
        """The number of axes of the ball (3) or disc (2); 0 without one."""
        axes = np.eye(3)[is_round:size]
        self.planes = np.column_stack([np.concatenate([axes, -axes]), np.ones(2 * edges)])
        self.form = np.repeat([1.0, 0.0], [is_round, 3 - is_round])
        self.volume = VOLUME_OF_BALL[is_round] * 2.0**edges
        self.is_flat, self.size = size == 2, size
        self.outline = {0: np.zeros((1, 3)), 2: on_circle(), 3: on_sphere()}[is_round]
        for axis in axes:
            # forwards and backwards, so that the corners of a square come in order around it
            self.outline = np.concatenate([self.outline + axis, self.outline[::-1] - axis])

    def support(self, along: FloatArray) -> FloatArray:
        """The place in the body that is furthest along each vector, shape (N, 3)."""
        place = np.where(along < 0.0, -1.0, 1.0) * (np.arange(3) < self.size)
        across = np.linalg.norm(along[:, : self.is_round], axis=1, keepdims=True)
        place[:, : self.is_round] = along[:, : self.is_round] / np.where(across > 0.0, across, 1.0)
        return place

    def reach(self, frame: FloatArray) -> float:
        """
        The radius of a ball that holds the image, frame @ x.

        For a cylinder whose axis does not stand square on its ends it is a little too large.
        """
        if not self.is_round:
            return _furthest(self.outline @ frame.T)
        ends, axis = frame[:, : self.is_round], frame[:, self.is_round : self.size].sum(axis=1)
        widest = np.linalg.svd(ends, compute_uv=False)[0]
        square = widest**2 + axis @ axis
        return float(np.sqrt(square + 2.0 * np.linalg.norm(ends.T @ axis)))

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        The same as :meth:`scanfab.Convex.overlap`, moved by ``length * shift``.

        Each factor overlaps itself by a shorter edge, the lens of two circles, or two caps.
        """
        step = np.abs(shift[:, self.is_round : self.size]).T
        edge = np.maximum(2.0 - length * step, 0.0)
        shared, slope = [*edge], [*np.where(edge > 0.0, step, 0.0)]
        across = np.linalg.norm(shift[:, : self.is_round], axis=1)
        q = np.minimum(length * across, 2.0)
        if self.is_round == 2:
            chord = np.sqrt(4.0 - q**2)
            shared.append(2.0 * np.arccos(0.5 * q) - 0.5 * q * chord)
            slope.append(across * chord)
        elif self.is_round == 3:
            shared.append(self.volume * (1.0 - 0.75 * q + q**3 / 16.0))
            slope.append(np.pi * across * (1.0 - 0.25 * q**2))
        others = [np.prod(shared[:i] + shared[i + 1 :], axis=0) for i in range(len(shared))]
        return np.prod(shared, axis=0), np.sum(np.multiply(slope, others), axis=0)


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex polyhedron about the origin."""

    outline: FloatArray
    planes: FloatArray
    areas: FloatArray
    """The area of the face in each plane, shape (P,)."""
    volume: float

    is_symmetric, is_flat, form = False, False, np.zeros(3)

    def support(self, along: FloatArray) -> FloatArray:
        """The corner that is furthest along each vector."""
        return np.asarray(self.outline[np.argmax(along @ self.outline.T, axis=1)])

    def reach(self, frame: FloatArray) -> float:
        """The distance of the corner of the image that is furthest from the origin."""
        return _furthest(self.outline @ frame.T)

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        With the hull's own chords t: g = V Σ max(0, t - z) / Σ t, and -g' = A #(t ≥ z) / #(t > 0).

        A few hundred lines along each of many directions tell these shares to some 1e-3, and their
        sum over the directions far better. Volume and projected area are exact, the latter by
        A = ½ Σ A_f |n·n_f| over the faces.
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
        """The share of the chords that is longer than a length: of their sum, of their number."""
        step = float(np.linalg.norm(shift))
        axis = shift / step
        u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        sides = np.array([u / np.linalg.norm(u), np.cross(axis, u / np.linalg.norm(u))])
        across = self.outline @ sides.T
        low, extent = across.min(axis=0), np.ptp(across, axis=0)
        # lines at irrational steps, so that no row of them runs along an edge
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


def _furthest(points: FloatArray) -> float:
    return float(np.linalg.norm(points, axis=1).max())
