"""The shapes of windows besides the sphere, by their sizes or by their surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from scanfab.base.bodies import BALL, BLOCK, COLUMN, DISC, SQUARE, Hull
from scanfab.base.convex import Convex, image_of, sphere
from scanfab.base.errors import SettingsError
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray, IntArray

# of the size of a surface, or of its distance from the origin, whichever is larger: what 4 bytes a
# number, as STL has them, cannot tell apart
TOLERANCE = 1e-6
# each line is cut by all faces
MOST_FACES = 1000
# held against all planes of the hull at a time, so that a surface of many takes little memory
SOME_FACES = 256


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
