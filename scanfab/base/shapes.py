"""The shapes of windows: by their sizes, or by their surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Body, Convex, Quadric, image_of, on_circle, on_sphere
from scanfab.base.errors import SettingsError
from scanfab.base.option import number
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray, IntArray

# of a surface's size, or of its distance from the origin, whichever is larger: what 4 bytes a
# number, as STL has them, cannot tell apart
TOLERANCE = 1e-6
# each line is cut by all faces
MOST_FACES = 1000
# of a hull: planes that cut lines, all directions together, and the lines along each direction
MOST_CUTS, FEWEST_LINES, MOST_LINES = 40_000_000, 400, 10_000
# of radius 1, by the number of its axes
VOLUME_OF_BALL = {0: 1.0, 2: math.pi, 3: 4.0 / 3.0 * math.pi}


class Product(Body):
    """
    A ball or disc of radius 1, times edges from -1 to 1 along the axes that follow: a cylinder is
    a disc times an edge, a cube three edges.
    """

    def __init__(self, is_round: int, edges: int) -> None:
        self.is_round, size = is_round, is_round + edges
        """Of how many axes the ball or disc is."""
        axes = np.eye(3)[is_round:size]
        self.planes = np.column_stack([np.concatenate([axes, -axes]), np.ones(2 * edges)])
        self.form = np.repeat([1.0, 0.0], [is_round, 3 - is_round])
        self.volume = VOLUME_OF_BALL[is_round] * 2.0**edges
        self.is_flat, self.size = size == 2, size
        self.outline = {0: np.zeros((1, 3)), 2: on_circle(), 3: on_sphere()}[is_round]
        for axis in axes:
            # one way and back, so that the corners of a square follow one another around it
            self.outline = np.concatenate([self.outline + axis, self.outline[::-1] - axis])

    def support(self, along: FloatArray) -> FloatArray:
        """The end of a radius, and of each edge."""
        place = np.where(along < 0.0, -1.0, 1.0) * (np.arange(3) < self.size)
        across = np.linalg.norm(along[:, : self.is_round], axis=1, keepdims=True)
        place[:, : self.is_round] = along[:, : self.is_round] / np.where(across > 0.0, across, 1.0)
        return place

    def reach(self, frame: FloatArray) -> float:
        """Of a cylinder whose axis does not stand square on its ends a little more."""
        if not self.is_round:
            return super().reach(frame)
        ends, axis = frame[:, : self.is_round], frame[:, self.is_round : self.size].sum(axis=1)
        widest = np.linalg.svd(ends, compute_uv=False)[0]
        square = widest**2 + axis @ axis
        return float(np.sqrt(square + 2.0 * np.linalg.norm(ends.T @ axis)))

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """Each factor overlaps itself by a shorter edge, the lens of two circles, or two caps."""
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
class Hull(Body):
    """A convex polyhedron about the origin."""

    outline: FloatArray
    planes: FloatArray
    areas: FloatArray
    """Of the face in each plane, shape (P,)."""
    volume: float

    is_symmetric = False

    def support(self, along: FloatArray) -> FloatArray:
        """A corner."""
        return np.asarray(self.outline[np.argmax(along @ self.outline.T, axis=1)])

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


BALL, DISC, COLUMN = Product(3, 0), Product(2, 0), Product(2, 1)
SQUARE, BLOCK = Product(0, 2), Product(0, 3)


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
    quadric, corner = Quadric(1.0, np.zeros((3, 3)), radius * radius), np.full(3, radius)
    frame, size = radius * np.eye(3), f"radius {radius:g}"
    return Convex(np.zeros((0, 4)), quadric, -corner, corner, radius, size, BALL, frame)


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
    return image_of(BLOCK, _frame(np.multiply(0.5, edges), turn), size)


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
    return image_of(BALL, _frame(semi_axes, turn), size)


def circle(radius: float, plane: Space) -> Convex:
    """A circle about the origin, in a coordinate plane; it holds what the sphere holds there."""
    high = radius * (1.0 - plane.normal)
    frame = np.array([radius, radius, 1.0]) * plane.basis.T
    return replace(sphere(radius), low=-high, high=high, body=DISC, frame=frame)


def rectangle(edges: Sequence[float] | FloatArray, plane: Space) -> Convex:
    """A rectangle about the origin, edges along the plane's coordinates, in alphabetic order."""
    frame = _frame(np.multiply(0.5, edges), None, plane)
    return image_of(SQUARE, frame, "box {:g} x {:g}".format(*edges))


def ellipse(
    semi_axes: Sequence[float] | FloatArray, plane: Space, turn: FloatArray | None = None
) -> Convex:
    """
    An ellipse about the origin.

    Its semi-axes lie along the rows of a turn, unit vectors of the plane of shape (2, 3); by
    default along the plane's coordinates, in alphabetic order.
    """
    size = "ellipse of semi-axes {:g}, {:g}".format(*semi_axes)
    return image_of(DISC, _frame(semi_axes, turn, plane), size)


def _frame(
    sizes: Sequence[float] | FloatArray, turn: npt.ArrayLike | None, plane: Space | None = None
) -> FloatArray:
    """Columns of these lengths along the rows of a turn; of a plane with its normal behind."""
    axes = np.eye(3) if plane is None else np.eye(3)[sorted(plane.along)]
    rows = np.multiply(np.asarray(sizes, dtype=float)[:, None], axes if turn is None else turn)
    return np.column_stack([*rows, *([] if plane is None else [plane.normal])])


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
    return image_of(COLUMN, _frame([radius, radius, 0.5 * height], turn), size)


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

    rows, triangles = np.unique(triangles, return_inverse=True)
    points = np.asarray(points, dtype=float)[rows]
    tolerance = TOLERANCE * float(np.abs(points).max(initial=0.0))
    # numbers about the middle lose less by rounding
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    points = points - middle
    try:
        hull, extent = ConvexHull(points), float(np.ptp(points, axis=0).max())
    except (QhullError, ValueError):
        hull = None
    if hull is None or hull.volume < TOLERANCE * extent**3:
        raise SettingsError("the surface encloses no volume: it is flat, or has no faces")
    # tetrahedra of the triangles with a place inside fill the hull, unless some are missing or
    # lie within it
    filled = float(np.abs(np.linalg.det(points[triangles.reshape(-1, 3)])).sum()) / 6.0
    if abs(filled - hull.volume) > 10.0 * tolerance * hull.area:
        raise SettingsError(
            f"the surface is not closed, or not convex: its faces span {filled / hull.volume:.6g} "
            f"times the volume of its hull"
        )
    planes = _faces(hull.equations, extent)
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
