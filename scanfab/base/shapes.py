"""The shapes of windows besides the sphere, by their sizes or by their surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import BALL, Body, Convex, image_of, points_on_a_rim, sphere
from scanfab.base.errors import SettingsError
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray, IntArray

# of a hull: planes that cut lines, all directions together, and the lines along each direction
MOST_CUTS, FEWEST_LINES, MOST_LINES = 40_000_000, 400, 10_000
# of the size of a surface, or of its distance from the origin, whichever is larger: what 4 bytes a
# number, as STL has them, cannot tell apart
TOLERANCE = 1e-6
# each line is cut by all faces
MOST_FACES = 1000
# held against all planes of the hull at a time, so that a surface of many takes little memory
SOME_FACES = 256


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


COLUMN, DISC = Column(is_flat=False), Column(is_flat=True)
BLOCK = Block(3, list(product((-1.0, 1.0), repeat=3)))
# the corners follow one another around it
SQUARE = Block(2, [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)])


def box(edges: Sequence[float] | FloatArray, turn: npt.ArrayLike | None = None) -> Convex:
    """
    A box about the origin.

    Parameters
    ----------
    edges : sequence of 3 floats
        Full lengths.
    turn : array_like, shape (3, 3), optional
        Orthonormal rows along which the edges lie; x, y, z by default.

    Returns
    -------
    Convex

    Examples
    --------
    >>> from scanfab import box
    >>> box([2.0, 3.0, 4.0]).high
    array([1. , 1.5, 2. ])
    """
    size = "box {:g} x {:g} x {:g}".format(*edges)
    return image_of(BLOCK, _turned(0.5 * np.asarray(edges, dtype=float), turn), size)


def ellipsoid(semi_axes: Sequence[float] | FloatArray, turn: npt.ArrayLike | None = None) -> Convex:
    """
    An ellipsoid about the origin.

    Parameters
    ----------
    semi_axes : sequence of 3 floats
        Half of its diameters.
    turn : array_like, shape (3, 3), optional
        Orthonormal rows along which they lie; x, y, z by default.

    Returns
    -------
    Convex

    Examples
    --------
    >>> from scanfab import ellipsoid
    >>> ellipsoid([2.0, 3.0, 4.0]).high
    array([2., 3., 4.])
    """
    size = "ellipsoid of semi-axes {:g}, {:g}, {:g}".format(*semi_axes)
    return image_of(BALL, _turned(np.asarray(semi_axes, dtype=float), turn), size)


def circle(radius: float, plane: Space) -> Convex:
    """A circle about the origin, in a coordinate plane; it holds what the sphere holds there."""
    high = radius * (1.0 - plane.normal)
    frame = np.array([radius, radius, 1.0]) * plane.basis.T
    return replace(sphere(radius), low=-high, high=high, body=DISC, frame=frame)


def rectangle(edges: Sequence[float] | FloatArray, plane: Space) -> Convex:
    """A rectangle about the origin, edges along the plane's coordinates, in alphabetic order."""
    half = 0.5 * np.asarray(edges, dtype=float)[:, None] * np.eye(3)[sorted(plane.along)]
    frame = np.column_stack([*half, plane.normal])
    return image_of(SQUARE, frame, "box {:g} x {:g}".format(*edges))


def ellipse(semi_axes: Sequence[float] | FloatArray, plane: Space) -> Convex:
    """An ellipse about the origin, semi-axes along the plane's coordinates, in alphabetic order."""
    turn = np.eye(3)[sorted(plane.along)]
    return turned_ellipse(np.asarray(semi_axes, dtype=float), turn, plane)


def turned_ellipse(semi_axes: FloatArray, turn: FloatArray, plane: Space) -> Convex:
    """The same with its semi-axes along unit vectors of the plane, the rows of shape (2, 3)."""
    frame = np.column_stack([*(semi_axes[:, None] * turn), plane.normal])
    return image_of(DISC, frame, "ellipse of semi-axes {:g}, {:g}".format(*semi_axes))


def cylinder(radius: float, height: float, axis: npt.ArrayLike = (0.0, 0.0, 1.0)) -> Convex:
    """
    A cylinder about the origin.

    Parameters
    ----------
    radius, height : float
        From end to end it is as long as its height.
    axis : array_like, shape (3,), optional
        Of any length.

    Returns
    -------
    Convex

    Examples
    --------
    >>> from scanfab import cylinder
    >>> cylinder(1.0, 6.0).high
    array([1., 1., 3.])
    """
    along = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    aside = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    aside /= np.linalg.norm(aside)
    turn = np.array([aside, np.cross(along, aside), along])
    size = f"cylinder of radius {radius:g}, height {height:g}"
    return image_of(COLUMN, _turned(np.array([radius, radius, 0.5 * height]), turn), size)


def polyhedron(points: FloatArray, triangles: IntArray) -> tuple[Convex, FloatArray]:
    """
    The convex polyhedron that a triangulated surface encloses, about its centroid.

    Parameters
    ----------
    points : ndarray, shape (N, 3)
        Those at one place count as one.
    triangles : ndarray of int, shape (T, 3)
        Rows of the points, in whatever sense of turn.

    Returns
    -------
    Convex
        The region.
    ndarray, shape (3,)
        The centroid, in the coordinates of the points.

    Raises
    ------
    SettingsError
        If the surface is flat, not closed or not convex, or has more faces than lines should be
        cut by.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import polyhedron
    >>> corners = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]])
    >>> shape, center = polyhedron(corners, np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]))
    >>> center, round(shape.volume, 3)
    (array([1., 1., 1.]), 10.667)
    """
    from scipy.spatial import ConvexHull, QhullError

    points, triangles, tolerance = _merged(points, triangles)
    # numbers about the middle lose less by rounding
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    points = points - middle
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        raise SettingsError("the surface encloses no volume: it is flat, or has no faces") from None
    extent = float(np.ptp(points, axis=0).max())
    if hull.volume < TOLERANCE * extent**3:
        raise SettingsError("the surface encloses no volume: it is flat")
    planes = _faces(hull.equations, extent)
    _check_convex(points, triangles, planes, tolerance)
    if len(planes) > MOST_FACES:
        raise SettingsError(
            f"the surface has {len(planes)} faces, more than {MOST_FACES}, and each of them cuts "
            f"every line: make it coarser"
        )
    # the hull as tetrahedra with the origin, which lies inside
    corners = points[hull.simplices]
    volume = np.abs(np.linalg.det(corners))
    centroid = volume @ corners.sum(axis=1) / (4.0 * volume.sum())
    planes[:, 3] -= planes[:, :3] @ centroid
    # each of its triangles belongs to the plane that faces its way
    sides = corners[:, 1:] - corners[:, :1]
    each = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    face = np.argmax(hull.equations[:, :3] @ planes[:, :3].T, axis=1)
    areas = np.bincount(face, weights=each, minlength=len(planes)).astype(float)
    body = Hull(points[hull.vertices] - centroid, planes, areas, float(hull.volume))
    return image_of(body, np.eye(3), f"surface of {len(planes)} faces"), middle + centroid


def _turned(sizes: FloatArray, turn: npt.ArrayLike | None) -> FloatArray:
    """The frame with columns of these lengths along the rows of a turn."""
    rows = np.eye(3) if turn is None else np.asarray(turn, dtype=float)
    frame: FloatArray = rows.T * sizes
    return frame


def _merged(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray, float]:
    """Points of the triangles, each once, triangles that are some, and what counts as one place."""
    from scipy.spatial import cKDTree

    points = np.asarray(points, dtype=float)
    tolerance = TOLERANCE * float(np.abs(points).max(initial=0.0))
    first = np.arange(len(points))
    if len(points):
        # the lowest row of those at one place; chains of places are shorter than the tolerance
        for one, other in sorted(cKDTree(points).query_pairs(tolerance)):
            first[other] = min(first[other], first[one])
    rows, triangles = np.unique(first[triangles], return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    a, b, c = triangles.T
    return points[rows], triangles[(a != b) & (b != c) & (c != a)], tolerance


def _faces(equations: FloatArray, extent: float) -> FloatArray:
    """The planes of a hull's triangles, those that coincide once, the outermost of them."""
    planes = np.column_stack([equations[:, :3], -equations[:, 3]])
    kept: list[FloatArray] = []
    left = planes[np.argsort(-planes[:, 3], kind="stable")]
    while len(left):
        # a view would keep all of what is left
        kept.append(left[0].copy())
        apart = np.abs(left - left[0]) / [1.0, 1.0, 1.0, extent]
        left = left[apart.max(axis=1) > TOLERANCE]
    return np.array(kept)


def _check_convex(
    points: FloatArray, triangles: IntArray, planes: FloatArray, tolerance: float
) -> None:
    """Each edge of the surface has a triangle on either side, and all of it lies on its hull."""
    edges = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]))
    _, count = np.unique(edges, axis=0, return_counts=True)
    if wrong := int(np.sum(count != 2)):
        raise SettingsError(
            f"the surface is not closed: {wrong} of its {len(count)} edges are not between two "
            f"faces"
        )
    inside = 0
    for first in range(0, len(triangles), SOME_FACES):
        corners = points[triangles[first : first + SOME_FACES]]
        off = np.abs(corners @ planes[:, :3].T - planes[:, 3]).max(axis=1)
        inside += int(np.sum(off.min(axis=1) > 10.0 * tolerance))
    if inside:
        raise SettingsError(
            f"the surface is not convex: {inside} of its {len(triangles)} faces lie inside its hull"
        )
