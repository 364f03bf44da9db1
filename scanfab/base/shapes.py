"""Shapes of windows, from sizes or from a triangulated surface, and the bodies they are made of."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Body, Convex
from scanfab.base.errors import SettingsError
from scanfab.base.option import number, numbers, unusable
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray

# Relative rounding of coordinates in STL files, which hold 4-byte numbers: points that are closer
# than this, relative to the largest coordinate or the size of the surface, count as the same.
TOLERANCE = 1e-6
# Every line is cut by every face, so the faces must not be too many.
MOST_FACES = 1000


class Product(Body):
    """
    The product of a ball or disc of radius 1 and of edges from -1/2 to 1/2 along the other axes.

    A cylinder is a disc times an edge; a cube is three edges. A ball has 3 round axes, a disc 2.
    """

    def __init__(self, round_axes: int, edges: int) -> None:
        size = round_axes + edges
        axes = np.eye(3)[round_axes:size]
        planes = np.column_stack([np.concatenate([axes, -axes]), np.full(2 * edges, 0.5)])
        corners = np.zeros((1, 3))
        for axis in axes:
            # one copy is reversed, so that the corners of a square follow one another around it
            corners = np.concatenate([corners + 0.5 * axis, corners[::-1] - 0.5 * axis])
        bent = np.repeat([1.0, 0.0], [round_axes, 3 - round_axes])
        super().__init__(corners, planes, bent, is_flat=size == 2)
        self.round_axes, self.size = round_axes, size

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        Volume shared with a copy moved by ``length * shift``, and its slope.

        The results are those of :meth:`scanfab.Convex.overlap`. They are products over the factors
        of the body: an edge shares a shorter edge, a disc a lens, and a ball two caps.
        """
        step = np.abs(shift[:, self.round_axes : self.size]).T
        edge = np.maximum(1.0 - length * step, 0.0)
        shared, slope = [*edge], [*np.where(edge > 0.0, step, 0.0)]
        across = np.linalg.norm(shift[:, : self.round_axes], axis=1)
        q = np.minimum(length * across, 2.0)
        if self.round_axes == 2:
            chord = np.sqrt(4.0 - q**2)
            shared.append(2.0 * np.arccos(0.5 * q) - 0.5 * q * chord)
            slope.append(across * chord)
        elif self.round_axes == 3:
            shared.append(4.0 / 3.0 * np.pi * (1.0 - 0.75 * q + q**3 / 16.0))
            slope.append(np.pi * across * (1.0 - 0.25 * q**2))
        others = [np.prod(shared[:i] + shared[i + 1 :], axis=0) for i in range(len(shared))]
        return np.prod(shared, axis=0), np.sum(np.multiply(slope, others), axis=0)


BALL, DISC, COLUMN = Product(3, 0), Product(2, 0), Product(2, 1)
SQUARE, BLOCK = Product(0, 2), Product(0, 3)


def sphere(radius: float, space: Space = SPACE) -> Convex:
    """
    A sphere about the origin; in a plane a circle.

    Parameters
    ----------
    radius : float
        Radius in the dump's length unit.
    space : Space, optional
        The coordinate plane of a circle; default: three dimensions.

    Returns
    -------
    Convex
        Usable as the shape of a :class:`scanfab.Window` or the window of :class:`scanfab.Solids`.

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
    frame = _frame("radius", [radius] * space.dimension, space.basis[: space.dimension], space)
    return Convex(DISC if space.is_plane else BALL, frame, f"radius {radius:g}")


def box(
    edges: Sequence[float] | FloatArray, turn: npt.ArrayLike | None = None, space: Space = SPACE
) -> Convex:
    """
    A box about the origin; in a plane a rectangle.

    Parameters
    ----------
    edges : sequence of 3 floats
        Full lengths of the edges, dump's length unit; two for a rectangle.
    turn : array_like, shape (3, 3), optional
        Orthonormal rows, the directions of the edges; default: the coordinates in alphabetic order.
    space : Space, optional
        The coordinate plane of a rectangle; default: three dimensions.

    Returns
    -------
    Convex

    Examples
    --------
    >>> from scanfab import box
    >>> box([2.0, 3.0, 4.0]).high
    array([1. , 1.5, 2. ])
    """
    frame, body = _frame("edges", edges, turn, space), SQUARE if space.is_plane else BLOCK
    return Convex(body, frame, "box " + " x ".join(f"{edge:g}" for edge in edges))


def ellipsoid(
    semi_axes: Sequence[float] | FloatArray, turn: npt.ArrayLike | None = None, space: Space = SPACE
) -> Convex:
    """
    An ellipsoid about the origin; in a plane an ellipse.

    Parameters
    ----------
    semi_axes : sequence of 3 floats
        Lengths of the semi-axes, dump's length unit; two for an ellipse.
    turn : array_like, shape (3, 3), optional
        Orthonormal rows, the directions of the semi-axes, shape (2, 3) for an ellipse; default: the
        coordinates in alphabetic order.
    space : Space, optional
        The coordinate plane of an ellipse; default: three dimensions.

    Returns
    -------
    Convex

    Examples
    --------
    >>> from scanfab import ellipsoid
    >>> ellipsoid([2.0, 3.0, 4.0]).high
    array([2., 3., 4.])
    """
    name, body = ("ellipse", DISC) if space.is_plane else ("ellipsoid", BALL)
    frame = _frame("semi_axes", semi_axes, turn, space)
    size = f"{name} of semi-axes {', '.join(f'{axis:g}' for axis in semi_axes)}"
    return Convex(body, frame, size)


def _frame(
    name: str, lengths: Sequence[float] | FloatArray, turn: npt.ArrayLike | None, space: Space
) -> FloatArray:
    """Columns of the given lengths along the rows of a turn; in a plane, then its normal."""
    expected = f"{space.dimension} lengths above 0"
    parse = numbers(expected, lambda every: len(every) == space.dimension and min(every) > 0)
    axes = np.eye(3)[sorted(space.along)] if turn is None else turn
    rows = np.multiply(np.array(parse(name, lengths))[:, None], axes)
    return np.column_stack([*rows, *([space.normal] if space.is_plane else [])])


def cylinder(radius: float, height: float, axis: npt.ArrayLike = (0.0, 0.0, 1.0)) -> Convex:
    """
    A cylinder about the origin.

    Parameters
    ----------
    radius, height : float
        Radius, and distance between the two ends, dump's length unit.
    axis : array_like, shape (3,), optional
        Vector of any length along the axis; default: z.

    Returns
    -------
    Convex

    Examples
    --------
    >>> from scanfab import cylinder
    >>> cylinder(1.0, 6.0).high
    array([1., 1., 3.])
    """
    if not np.linalg.norm(axis) > 0:
        raise unusable("axis", "a vector that is not 0", axis)
    # singular vectors of a single row: its direction and two others normal to it
    turn = np.linalg.svd(np.array(axis, dtype=float).reshape(1, 3))[2][::-1]
    size = f"cylinder of radius {radius:g}, height {height:g}"
    frame = _frame("radius, height", [radius, radius, height], turn, SPACE)
    return Convex(COLUMN, frame, size)


def polyhedron(points: FloatArray, triangles: IntArray) -> tuple[Convex, FloatArray]:
    """
    The convex polyhedron inside a triangulated surface, moved so that its centroid is the origin.

    Parameters
    ----------
    points : ndarray, shape (N, 3)
        Corners, dump's length unit; several points may lie at the same place.
    triangles : ndarray of int, shape (T, 3)
        Indices into the points, in either orientation.

    Returns
    -------
    Convex
        The region.
    ndarray, shape (3,)
        The centroid in the coordinates of the points.

    Raises
    ------
    SettingsError
        If the surface is flat, not closed or not convex, or has more than 1000 faces.

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
    # coordinates from the middle of the surface lose fewer digits by rounding
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    points = points - middle
    try:
        hull, extent = ConvexHull(points), float(np.ptp(points, axis=0).max())
    except (QhullError, ValueError):
        hull = None
    if hull is None or hull.volume < TOLERANCE * extent**3:
        raise SettingsError("the surface encloses no volume: it is flat, or has no faces")
    # The triangles span tetrahedra with a point inside. Together these fill the hull, unless the
    # surface has holes or dents.
    filled = float(np.abs(np.linalg.det(points[triangles.reshape(-1, 3)])).sum()) / 6.0
    if abs(filled - hull.volume) > 10.0 * tolerance * hull.area:
        raise SettingsError(
            f"the surface is not closed, or not convex: its faces enclose "
            f"{filled / hull.volume:.6g} times the volume of its convex hull"
        )
    # triangles of the same face have nearly the same plane, of which the outermost is kept
    planes = np.column_stack([hull.equations[:, :3], -hull.equations[:, 3]])
    left, kept = planes[np.argsort(-planes[:, 3], kind="stable")], []
    while len(left):
        kept.append(left[0].copy())  # a view would keep the whole array in memory
        apart = np.abs(left - left[0]) / [1.0, 1.0, 1.0, extent]
        left = left[apart.max(axis=1) > max(TOLERANCE, tolerance / extent)]
    planes = np.array(kept)
    if len(planes) > MOST_FACES:
        raise SettingsError(
            f"the surface has {len(planes)} faces, expected at most {MOST_FACES}, because every "
            f"line is cut by every face: make the surface coarser"
        )
    # the hull is split into tetrahedra that meet at the origin, which lies inside
    corners = points[hull.simplices]
    volume = np.abs(np.linalg.det(corners))
    centroid = volume @ corners.sum(axis=1) / (4.0 * volume.sum())
    planes[:, 3] -= planes[:, :3] @ centroid
    body = Body(points[hull.vertices] - centroid, planes)
    return Convex(body, np.eye(3), f"surface of {len(planes)} faces"), middle + centroid
