"""
Convex regions about the origin: which points, segments and spheres lie in them.

A region is the image of a body under a linear map. The map makes every ellipsoid from the unit ball
and every box from a cube. The formulas of the body hold for the image too, so a window that deforms
with its sample needs no formulas of its own.

The first two columns of the map span a region in a plane, and the third column is the unit normal.
Such a flat region has an area in place of a volume, and lengths in place of areas.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from scanfab.base.space import on_circle, on_sphere
from scanfab.base.typing import BoolArray, FloatArray

# relative differences of lengths below this are rounding
ROUNDING = 1e-12
# a polyhedron and its copy share nothing unless a ball of this size, relative to both, fits in
SLIVER = 1e-9


@dataclass(eq=False)
class Body:
    """
    A convex polyhedron that contains the origin; :mod:`scanfab.base.shapes` adds round bodies.

    Points above and below a body that lies in a plane count as inside.
    """

    corners: FloatArray
    """
    Corners of the polyhedron, shape (K, 3).

    A round body is the hull of its corners, swept by a ball or disc of radius 1 about the origin.
    """
    planes: FloatArray
    """Its flat faces, shape (P, 4): each row n, d keeps the side n·x < d."""
    round: FloatArray = field(default_factory=lambda: np.zeros(3))
    """1 for each axis of its ball or disc, and 0 for the others."""
    is_flat: bool = False
    """Whether it lies in a plane."""

    def overlap(self, shift: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        Volume shared with a copy moved by ``length * shift``, and its slope; see `Convex.overlap`.

        The slope is the projected area of the shared part along the shift, times its length.
        """
        from scipy.optimize import linprog
        from scipy.spatial import ConvexHull, HalfspaceIntersection

        shared, slope = np.zeros((2, len(shift)))
        part = ConvexHull(self.corners)  # all of the body, if the copy lies at its own place
        normals, distance = self.planes[:, :3], self.planes[:, 3]
        depth = np.column_stack([normals, np.ones(len(normals))])
        least = SLIVER * np.linalg.norm(self.corners, axis=1).max()
        for k, vector in enumerate(shift):
            if length != 0.0:
                # the planes of the shared part, and the centre and radius of its largest ball
                room = distance + np.minimum(normals @ (length * vector), 0.0)
                *inside, radius = linprog([0, 0, 0, -1], depth, room, bounds=[(None, None)] * 4).x
                if radius <= least:
                    continue
                bounds = np.column_stack([normals, -room])
                part = ConvexHull(HalfspaceIntersection(bounds, np.array(inside)).intersections)
            a, b, c = np.moveaxis(part.points[part.simplices], 1, 0)
            shared[k] = part.volume
            slope[k] = 0.25 * np.abs(np.cross(b - a, c - a) @ vector).sum()
        return shared, slope


class Quadric(NamedTuple):
    """The points x with x·form x < level."""

    form: FloatArray
    """Symmetric, no eigenvalue below 0, shape (3, 3); 0 if planes alone bound the region."""
    level: float
    """Above 0, so that the origin lies inside."""

    def norm(self, points: FloatArray) -> FloatArray:
        """√(x·form x) of each point, shape (N,)."""
        square = np.einsum("ij,ij->i", points @ self.form, points)
        # rounding makes it negative on the axis of an oblique cylinder
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))


class Convex:
    """
    A bounded convex region about the origin, without its surface.

    Planes and quadric decide which points lie in the region. Body and frame give its volume, its
    projected area, its surface, and the region after a deformation.

    Parameters
    ----------
    body : Body
        The body that is mapped.
    frame : ndarray, shape (3, 3)
        The linear map: the region holds the points frame @ x for all x in the body.
    size : str
        Size in words for messages, for instance ``radius 2``.

    Attributes
    ----------
    planes : ndarray
        Flat bounds, shape (P, 4): each row n, d, with a unit vector n, keeps the side n·x < d.
    quadric : Quadric
        Curved bound.
    low : ndarray
        Lower corner of the box along x, y and z that holds the region, shape (3,).
    high : ndarray, shape (3,)
        Upper corner of this box.
    reach : float
        Radius of a ball about the origin that holds the region; for a sphere its own radius. It is
        slightly too large for a sheared cylinder, whose axis is not normal to its ends.
    is_flat : bool
        Whether the region lies in a plane, whose normal is the third column of the frame.

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
    is_flat: bool

    def __init__(self, body: Body, frame: FloatArray, size: str) -> None:
        self.body, self.frame, self.size, self.is_flat = body, frame, size, body.is_flat
        planes = np.column_stack([body.planes[:, :3] @ np.linalg.inv(frame), body.planes[:, 3]])
        self.planes = planes / np.linalg.norm(planes[:, :3], axis=1, keepdims=True)
        corners, ball = body.corners @ frame.T, frame * body.round
        # Lengths in units of the longest semi-axis make the form of a sphere exactly 1.
        widest = float(np.linalg.norm(ball, 2))
        unit = widest or 1.0
        back = body.round[:, None] * np.linalg.inv(frame / unit)
        self.quadric = Quadric(back.T @ back, unit * unit)
        # not every body is symmetric, so the extents along -x, -y, -z are computed as well
        self.low, self.high = (np.diag(self.support(along)) for along in (-np.eye(3), np.eye(3)))
        aside = 2.0 * np.linalg.norm(corners @ ball, axis=1)
        self.reach = float(np.sqrt((widest**2 + np.sum(corners**2, axis=1) + aside).max()))

    def __repr__(self) -> str:
        return f"Convex: {self} about the origin"

    def __str__(self) -> str:
        return self.size

    @property
    def is_sphere(self) -> bool:
        """Whether the region is a sphere, or in a plane a circle."""
        # of all ellipsoids of the same reach the sphere is furthest from the corners of its box
        furthest = (2.0 if self.is_flat else 3.0) * self.reach**2
        return not len(self.planes) and bool(self.high @ self.high > (1.0 - ROUNDING) * furthest)

    @property
    def volume(self) -> float:
        """Volume, in the dump's length unit cubed; in a plane the area."""
        return float(self.overlap(np.zeros((1, 3)), 0.0)[0][0])

    @property
    def mean_shadow(self) -> float:
        """Projected area, averaged over all directions to a few per cent; in a plane a length."""
        axes = on_sphere()[::10]
        if self.is_flat:
            axes = on_circle()[:, :2] @ np.linalg.qr(self.frame[:, :2])[0].T
        return float(self.overlap(axes, 0.0)[1].mean())

    @property
    def outline(self) -> FloatArray:
        """Points of the surface, shape (K, 3); their hull is the region, or nearly if curved."""
        rim = [np.zeros((1, 3)), on_circle(), on_sphere()][np.count_nonzero(self.body.round[1:])]
        return (self.body.corners[:, None] + rim).reshape(-1, 3) @ self.frame.T

    def contains(self, points: FloatArray) -> BoolArray:
        """
        Whether each point lies inside the region.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Coordinates from the origin of the region.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        # Distances are compared, not their squares, to round as all other code that compares them.
        inside = self.quadric.norm(points) < np.sqrt(self.quadric.level)
        for plane in self.planes:
            inside &= points @ plane[:3] < plane[3]
        return np.asarray(inside)

    def share(self, start: FloatArray, branch: FloatArray) -> FloatArray:
        """
        The fraction of each straight segment that lies inside the region.

        Parameters
        ----------
        start, branch : ndarray, shape (N, 3)
            As for :meth:`cut`.

        Returns
        -------
        ndarray, shape (N,)
            Length inside over length, 0 to 1.
        """
        first, last = self.cut(start, branch)
        return np.asarray(np.maximum(last - first, 0.0))

    def cut(self, start: FloatArray, branch: FloatArray) -> tuple[FloatArray, FloatArray]:
        """
        Where each straight segment enters and leaves the region.

        Parameters
        ----------
        start : ndarray, shape (N, 3)
            Start of each segment, from the origin of the region.
        branch : ndarray, shape (N, 3)
            Vector from the start of each segment to its end; no length may be 0.

        Returns
        -------
        first, last : ndarray, shape (N,)
            From 0, the start of the segment, to 1, its end. Outside, first is not below last.
        """
        form, level = self.quadric.form, self.quadric.level
        first, last = np.zeros(len(start)), np.ones(len(start))
        if form.any():
            # x·form·x - level = a t² + 2 b t + c along x = start + t branch
            a = np.einsum("ni,ij,nj->n", branch, form, branch)
            b = np.einsum("ni,ij,nj->n", start, form, branch)
            c = np.einsum("ni,ij,nj->n", start, form, start) - level
            root = np.sqrt(np.maximum(b * b - a * c, 0.0))
            # along the axis of a cylinder a is 0: the quadric keeps the whole segment, or nothing
            steep = a > ROUNDING * np.einsum("ni,ni->n", branch, branch)
            slope = np.where(steep, a, 1.0)
            first = np.where(steep, np.maximum(first, (-b - root) / slope), first)
            last = np.where(steep, np.minimum(last, (root - b) / slope), last)
            last[~steep & (c >= 0.0)] = 0.0
        for plane in self.planes:
            rise, room = branch @ plane[:3], plane[3] - start @ plane[:3]
            with np.errstate(divide="ignore", invalid="ignore"):
                crossing = room / rise
            last = np.where(rise > 0.0, np.minimum(last, crossing), last)
            first = np.where(rise < 0.0, np.maximum(first, crossing), first)
            last[(rise == 0.0) & (room <= 0.0)] = 0.0
        return first, last

    def may_meet(self, points: FloatArray, radius: FloatArray) -> BoolArray:
        """
        Whether each sphere may reach into the region; a near miss may also give True.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Centres of the spheres, from the origin of the region.
        radius : ndarray, shape (N,)
            Radii of the spheres.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        near = np.sqrt(np.einsum("ij,ij->i", points, points)) < self.reach + radius
        for plane in self.planes:
            near &= points @ plane[:3] < plane[3] + radius
        # within a sphere the norm changes by the radius times that of the steepest unit vector
        form, level = self.quadric
        steepest = np.sqrt(np.linalg.eigvalsh(form)[-1])
        return np.asarray(near & (self.quadric.norm(points) < np.sqrt(level) + steepest * radius))

    def support(self, along: FloatArray) -> FloatArray:
        """
        The point of the region that lies furthest along each vector.

        Parameters
        ----------
        along : ndarray, shape (N, 3)
            Vectors of any length above 0.

        Returns
        -------
        ndarray, shape (N, 3)
        """
        along = along @ self.frame
        corner = self.body.corners[np.argmax(along @ self.body.corners.T, axis=1)]
        ball = along * self.body.round
        length = np.linalg.norm(ball, axis=1, keepdims=True)
        return np.asarray((corner + ball / np.where(length > 0.0, length, 1.0)) @ self.frame.T)

    def overlap(self, axes: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        The volume that the region shares with a moved copy of itself, and its slope.

        Parameters
        ----------
        axes : ndarray, shape (N, 3)
            Unit vectors.
        length : float
            Distance z by which the copy is moved, dump's length unit.

        Returns
        -------
        shared : ndarray, shape (N,)
            The covariogram g(z), a volume.
        slope : ndarray, shape (N,)
            -dg/dz: the cross-section of all lines along the axis whose piece in the region is at
            least z long; at z = 0 the projected area.
        """
        scale = abs(np.linalg.det(self.frame))
        shared, slope = self.body.overlap(axes @ np.linalg.inv(self.frame).T, length)
        return scale * shared, scale * slope

    def meets_itself(self, shift: FloatArray) -> bool:
        """
        Whether the region overlaps a copy of itself that is moved.

        Parameters
        ----------
        shift : ndarray, shape (3,)
            The vector by which the copy is moved, dump's length unit.

        Returns
        -------
        bool
        """
        # a box that fills a periodic cell overlaps its image by rounding
        return bool(self.overlap(shift[None], 1.0)[0][0] > 1e-9 * self.volume)

    def deformed(self, gradient: FloatArray) -> Convex:
        """
        The image of the region under a deformation gradient: the points gradient @ x.

        A sphere becomes an ellipsoid, and a box may lean.

        Parameters
        ----------
        gradient : ndarray, shape (3, 3)
            Deformation gradient, not singular.

        Returns
        -------
        Convex
        """
        if np.array_equal(gradient, np.eye(3)):
            return self
        return Convex(self.body, gradient @ self.frame, f"deformed, first {self.size}")
