"""
Bodies: the simple shapes from which every convex region is made by a linear map.

A body is a product of a ball and edges, or a polyhedron. It has these members. ``planes``, shape
(P, 4), are its flat faces: each row n, d keeps the side n·x < d. ``form`` is the diagonal of M in
x·M x < 1, which bounds its curved face; it is zero for a body without a curved face. ``volume`` is
the volume of the body before the map. ``outline``, shape (K, 3), are points of its surface; their
hull is the body, or nearly the body if it is curved. A region calls ``support``, ``reach`` and
``overlap`` of its body. A symmetric body contains -x with each x. A flat body lies in a plane;
points above and below it count as inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scanfab.base.typing import FloatArray

# Number of points on a sphere and on a circle, and of directions for the mean of a shadow
POINTS, POINTS_OF_A_RIM, AXES = 2000, 128, 200
# The overlap of a hull is measured along lines: at most MOST_CUTS cuts of a line by a plane in all
# directions together, with FEWEST_LINES to MOST_LINES lines along each direction.
MOST_CUTS, FEWEST_LINES, MOST_LINES = 40_000_000, 400, 10_000
# volume of the unit ball (3 axes) and area of the unit disc (2 axes); 1 for no round part
VOLUME_OF_BALL = {0: 1.0, 2: math.pi, 3: 4.0 / 3.0 * math.pi}


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


class Product:
    """
    The product of a ball or disc of radius 1 and of edges from -1 to 1 along the other axes.

    A cylinder is a disc times an edge; a cube is three edges.
    """

    is_symmetric = True

    def __init__(self, is_round: int, edges: int) -> None:
        self.is_round, size = is_round, is_round + edges
        """Number of axes of the round part: 3 for a ball, 2 for a disc, 0 for none."""
        axes = np.eye(3)[is_round:size]
        self.planes = np.column_stack([np.concatenate([axes, -axes]), np.ones(2 * edges)])
        self.form = np.repeat([1.0, 0.0], [is_round, 3 - is_round])
        self.volume = VOLUME_OF_BALL[is_round] * 2.0**edges
        self.is_flat, self.size = size == 2, size
        self.outline = {0: np.zeros((1, 3)), 2: on_circle(), 3: on_sphere()}[is_round]
        for axis in axes:
            # one copy is reversed, so that the corners of a square follow one another around it
            self.outline = np.concatenate([self.outline + axis, self.outline[::-1] - axis])

    def support(self, along: FloatArray) -> FloatArray:
        """The point of the body that lies furthest along each vector, shape (N, 3)."""
        place = np.where(along < 0.0, -1.0, 1.0) * (np.arange(3) < self.size)
        across = np.linalg.norm(along[:, : self.is_round], axis=1, keepdims=True)
        place[:, : self.is_round] = along[:, : self.is_round] / np.where(across > 0.0, across, 1.0)
        return place

    def reach(self, frame: FloatArray) -> float:
        """
        Radius of a ball about the origin that holds the image frame @ x.

        It is slightly too large for a sheared cylinder, whose axis is not normal to its ends.
        """
        if not self.is_round:
            return _furthest(self.outline @ frame.T)
        ends, axis = frame[:, : self.is_round], frame[:, self.is_round : self.size].sum(axis=1)
        widest = np.linalg.svd(ends, compute_uv=False)[0]
        square = widest**2 + axis @ axis
        return float(np.sqrt(square + 2.0 * np.linalg.norm(ends.T @ axis)))

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        Volume shared with a copy moved by ``length * shift``, and its slope.

        The results are those of :meth:`scanfab.Convex.overlap`. They are products over the factors
        of the body: an edge shares a shorter edge, a disc a lens, and a ball two caps.
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
    """A convex polyhedron that contains the origin."""

    outline: FloatArray
    planes: FloatArray
    areas: FloatArray
    """Area of the face in each plane, shape (P,)."""
    volume: float

    is_symmetric, is_flat, form = False, False, np.zeros(3)

    def support(self, along: FloatArray) -> FloatArray:
        """The corner that lies furthest along each vector, shape (N, 3)."""
        return np.asarray(self.outline[np.argmax(along @ self.outline.T, axis=1)])

    def reach(self, frame: FloatArray) -> float:
        """Distance from the origin to the furthest corner of the image frame @ x."""
        return _furthest(self.outline @ frame.T)

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        Volume shared with a copy moved by ``length * shift``, and its slope.

        Both follow from the chords t that lines along the shift cut from the hull, with z the
        length of the move: g = V Σ max(0, t - z) / Σ t and -g' = A #(t ≥ z) / #(t > 0). A few
        hundred lines give each ratio within about 1e-3; the sum over many directions is far more
        accurate. Volume V and projected area A = ½ Σ A_f |n·n_f| (over the faces) are exact.
        """
        shadow = 0.5 * np.abs(shift @ self.planes[:, :3].T) @ self.areas
        if length == 0.0:
            return np.full(len(shift), self.volume), shadow
        lines = MOST_CUTS // (len(self.planes) * max(len(shift), 1))
        lines = min(max(lines, FEWEST_LINES), MOST_LINES)
        shares = [self._long_shares(vector, length, lines) for vector in shift]
        shared, number = np.array(shares).reshape(-1, 2).T
        return self.volume * shared, shadow * number

    def _long_shares(self, shift: FloatArray, length: float, lines: int) -> tuple[float, float]:
        """Parts of the chords' total length and number that lie above a length, along a shift."""
        step = float(np.linalg.norm(shift))
        axis = shift / step
        u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        sides = np.array([u / np.linalg.norm(u), np.cross(axis, u / np.linalg.norm(u))])
        across = self.outline @ sides.T
        low, extent = across.min(axis=0), np.ptp(across, axis=0)
        # irrational steps keep rows of lines from running along an edge of the hull
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
