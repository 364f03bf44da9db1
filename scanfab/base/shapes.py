"""The shapes of windows, made from their sizes or from a surface."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from scanfab.base.bodies import Hull, Product
from scanfab.base.convex import Convex, Quadric, image_of
from scanfab.base.errors import SettingsError
from scanfab.base.option import number
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray

# Numbers of 4 bytes, as STL has them, cannot tell places apart that are closer than this part of a
# surface's size, or of its distance from the origin, whichever is larger.
TOLERANCE = 1e-6
# each line is cut by all faces
MOST_FACES = 1000


BALL, DISC, COLUMN = Product(3, 0), Product(2, 0), Product(2, 1)
SQUARE, BLOCK = Product(0, 2), Product(0, 3)


def sphere(radius: float, space: Space = SPACE) -> Convex:
    """
    A sphere about the origin; in a plane a circle.

    Parameters
    ----------
    radius : float
        Dump's length unit.
    space : Space, optional
        The coordinate plane of a circle, which holds what the sphere holds there.

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
    high, frame = radius * np.diag(space.identity), radius * space.basis.T
    if space.is_plane:
        frame[:, 2] = space.normal
    quadric, body = (
        Quadric(1.0, np.zeros((3, 3)), radius * radius),
        DISC if space.is_plane else BALL,
    )
    return Convex(np.zeros((0, 4)), quadric, -high, high, radius, f"radius {radius:g}", body, frame)


def box(
    edges: Sequence[float] | FloatArray, turn: npt.ArrayLike | None = None, space: Space = SPACE
) -> Convex:
    """
    A box about the origin; in a plane a rectangle.

    Parameters
    ----------
    edges : sequence of 3 floats
        Full lengths; of a rectangle 2.
    turn : array_like, shape (3, 3), optional
        Orthonormal rows along which the edges lie; by default the coordinates in alphabetic order.
    space : Space, optional
        The coordinate plane of a rectangle.

    Returns
    -------
    Convex

    Examples
    --------
    >>> from scanfab import box
    >>> box([2.0, 3.0, 4.0]).high
    array([1. , 1.5, 2. ])
    """
    frame, body = _frame(np.multiply(0.5, edges), turn, space), SQUARE if space.is_plane else BLOCK
    return image_of(body, frame, "box " + " x ".join(f"{one:g}" for one in edges))


def ellipsoid(
    semi_axes: Sequence[float] | FloatArray, turn: npt.ArrayLike | None = None, space: Space = SPACE
) -> Convex:
    """
    An ellipsoid about the origin; in a plane an ellipse.

    Parameters
    ----------
    semi_axes : sequence of 3 floats
        Half of its diameters; of an ellipse 2.
    turn : array_like, shape (3, 3), optional
        Orthonormal rows along which they lie, of an ellipse (2, 3); by default the coordinates in
        alphabetic order.
    space : Space, optional
        The coordinate plane of an ellipse.

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
    size = f"{name} of semi-axes {', '.join(f'{one:g}' for one in semi_axes)}"
    return image_of(body, _frame(semi_axes, turn, space), size)


def _frame(
    sizes: Sequence[float] | FloatArray, turn: npt.ArrayLike | None, space: Space
) -> FloatArray:
    """Columns of these lengths along the rows of a turn; in a plane its normal is the last one."""
    axes = np.eye(3)[sorted(space.along)] if turn is None else turn
    rows = np.multiply(np.asarray(sizes, dtype=float)[:, None], axes)
    return np.column_stack([*rows, *([space.normal] if space.is_plane else [])])


def cylinder(radius: float, height: float, axis: npt.ArrayLike = (0.0, 0.0, 1.0)) -> Convex:
    """
    A cylinder about the origin.

    Parameters
    ----------
    radius, height : float
        The height is the distance of its ends.
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
    return image_of(COLUMN, _frame([radius, radius, 0.5 * height], turn, SPACE), size)


def polyhedron(points: FloatArray, triangles: IntArray) -> tuple[Convex, FloatArray]:
    """
    The convex polyhedron that a triangulated surface encloses, about its centroid.

    Parameters
    ----------
    points : ndarray, shape (N, 3)
        Points at the same place count as one.
    triangles : ndarray of int, shape (T, 3)
        Rows of the points, in either orientation.

    Returns
    -------
    Convex
        The region.
    ndarray, shape (3,)
        The centroid, in the coordinates of the points.

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
    # coordinates about the middle lose less by rounding
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
    # triangles of one face have planes that coincide: the outermost of them is kept
    planes = np.column_stack([hull.equations[:, :3], -hull.equations[:, 3]])
    left, kept = planes[np.argsort(-planes[:, 3], kind="stable")], []
    while len(left):
        kept.append(left[0].copy())  # a view would keep all of what is left
        apart = np.abs(left - left[0]) / [1.0, 1.0, 1.0, extent]
        left = left[apart.max(axis=1) > TOLERANCE]
    planes = np.array(kept)
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
    # each triangle belongs to the plane whose normal is nearest to its own
    sides = corners[:, 1:] - corners[:, :1]
    each = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    face = np.argmax(hull.equations[:, :3] @ planes[:, :3].T, axis=1)
    areas = np.bincount(face, weights=each, minlength=len(planes)).astype(float)
    body = Hull(points[hull.vertices] - centroid, planes, areas, float(hull.volume))
    return image_of(body, np.eye(3), f"surface of {len(planes)} faces"), middle + centroid
