"""
Convex regions about the origin: what lies in them, and how much of them.

A region is the image of a body under a linear map. The map makes every ellipsoid from the ball of
radius 1 and every box from a cube, and it carries over the closed formulas of the body, so that a
window that deforms with its sample needs no formula of its own.

A region in a plane is spanned by the map's first two columns; the third is the unit normal. Its
volume is an area, and its areas are lengths.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scanfab.base.bodies import AXES, POINTS, Hull, Product, on_circle, on_sphere
from scanfab.base.typing import BoolArray, FloatArray

# steps towards the nearest place of a region, and the share of a distance that may be rounding
STEPS, ROUNDING = 200, 1e-12


class Quadric(NamedTuple):
    """
    The places x with x·(m I + D) x below a level; D = 0 for a sphere, however its axes are turned.
    """

    isotropic: float
    """m, not negative."""
    deviator: FloatArray
    """D, symmetric, shape (3, 3), no eigenvalue below -m."""
    level: float
    """Above 0: the origin lies inside."""

    @property
    def form(self) -> FloatArray:
        """The matrix m I + D."""
        return self.isotropic * np.eye(3) + self.deviator


# the quadric of a region that only planes bound
EVERYWHERE = Quadric(0.0, np.zeros((3, 3)), 1.0)


@dataclass(frozen=True, eq=False)
class Convex:
    """
    A convex region about the origin, bounded; its surface is not part of it.

    Planes and quadric alone decide which places lie in it. Volume, shadow and surface follow from
    the body and the frame whose image it is, and so does the region after a deformation.

    Parameters
    ----------
    planes : ndarray
        Rows n, d with unit vectors n: of each plane the side n·x < d, shape (P, 4).
    quadric : Quadric
        The second bound of the region; ``EVERYWHERE`` where the planes are the only one.
    low : ndarray
        The box along x, y and z that holds the region, shape (3,).
    high : ndarray, shape (3,)
        Its opposite corner.
    reach : float
        Radius of the ball about the origin that holds the region; of a sphere its own.
    size : str
        Its size in messages, for instance ``radius 2``.
    body : Product or Hull
        The body whose image it is.
    frame : ndarray, shape (3, 3)
        The region holds the places frame @ x with x in the body.

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
    size: str
    body: Product | Hull
    frame: FloatArray

    def __repr__(self) -> str:
        return f"Convex: {self} about the origin"

    def __str__(self) -> str:
        return self.size

    @property
    def is_sphere(self) -> bool:
        """Whether all its diameters are equal; in a plane it is then a circle."""
        return not len(self.planes) and not self.quadric.deviator.any()

    @property
    def is_flat(self) -> bool:
        """Whether it lies in a plane; the third column of the frame is then the normal."""
        return self.body.is_flat

    @property
    def volume(self) -> float:
        """Volume, in the dump's length unit cubed; in a plane the area."""
        return float(self.body.volume * abs(np.linalg.det(self.frame)))

    @property
    def mean_shadow(self) -> float:
        """Mean projected area over all directions, within some per cent; in a plane a length."""
        axes = on_sphere()[:: POINTS // AXES]
        if self.is_flat:
            axes = on_circle()[:, :2] @ np.linalg.qr(self.frame[:, :2])[0].T
        return float(self.overlap(axes, 0.0)[1].mean())

    @property
    def outline(self) -> FloatArray:
        """Points of the surface, shape (K, 3), whose hull is the region, or nearly so if curved."""
        return self.body.outline @ self.frame.T

    def contains(self, points: FloatArray) -> BoolArray:
        """
        Which points lie inside.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            From the origin of the region.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        isotropic, deviator, level = self.quadric
        form = isotropic * np.einsum("ij,ij->i", points, points)
        form += np.einsum("ij,ij->i", points @ deviator, points)
        # roots are compared, as distances are everywhere else, so that rounding is the same
        inside = np.sqrt(form) < np.sqrt(level)
        for plane in self.planes:
            inside &= points @ plane[:3] < plane[3]
        return np.asarray(inside)

    def share(self, start: FloatArray, branch: FloatArray) -> FloatArray:
        """
        Which share of each straight piece lies inside.

        Parameters
        ----------
        start : ndarray, shape (N, 3)
            Where it begins, from the origin of the region.
        branch : ndarray, shape (N, 3)
            From there to where it ends; not of length 0.

        Returns
        -------
        ndarray, shape (N,)
            Length inside over length, 0 to 1.
        """
        form, level = self.quadric.form, self.quadric.level
        first, last = np.zeros(len(start)), np.ones(len(start))
        if form.any():
            # x·form·x - level = a t² + 2 b t + c along x = start + t branch
            a = np.einsum("ni,ij,nj->n", branch, form, branch)
            b = np.einsum("ni,ij,nj->n", start, form, branch)
            c = np.einsum("ni,ij,nj->n", start, form, start) - level
            root = np.sqrt(np.maximum(b * b - a * c, 0.0))
            # along the axis of a cylinder a is 0: all of the piece is inside, or none
            steep = a > ROUNDING * (self.quadric.isotropic * np.einsum("ni,ni->n", branch, branch))
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
        return np.asarray(np.maximum(last - first, 0.0))

    def may_meet(self, points: FloatArray, radius: FloatArray) -> BoolArray:
        """
        Which spheres reach inside; a sphere that nearly touches may count too.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Their centres, from the origin of the region.
        radius : ndarray, shape (N,)
            Their radii.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        near = np.sqrt(np.einsum("ij,ij->i", points, points)) < self.reach + radius
        for plane in self.planes:
            near &= points @ plane[:3] < plane[3] + radius
        if self.is_sphere:
            return np.asarray(near)
        # Near an edge, or a quadric that is no sphere, these are too many. For a centre p outside,
        # walk from a place x inside as near to p as the way to the place furthest along p - x
        # allows. The distance of p is at most |p - x|, and at least that of the plane through the
        # furthest place; a sphere between the two after all steps may reach inside.
        left = np.flatnonzero(near)
        left = left[~self.contains(points[left])]
        at = np.zeros((len(left), 3))
        for _ in range(STEPS):
            toward = points[left] - at
            distance, furthest = np.linalg.norm(toward, axis=1), self.support(toward)
            # the distance is 0 once the walk has reached a centre on the surface
            over = np.where(distance > 0.0, distance, 1.0)
            missed = np.einsum("ij,ij->i", points[left] - furthest, toward) / over >= radius[left]
            near[left[missed]] = False
            unsure = ~missed & (distance >= radius[left])
            left, toward, at = left[unsure], toward[unsure], at[unsure]
            if not len(left):
                break
            way = furthest[unsure] - at
            square = np.einsum("ij,ij->i", way, way)
            share = np.einsum("ij,ij->i", toward, way) / np.where(square > 0.0, square, 1.0)
            at = at + np.clip(share, 0.0, 1.0)[:, None] * way
        return np.asarray(near)

    def support(self, along: FloatArray) -> FloatArray:
        """
        The place of the region that is furthest along each vector.

        Parameters
        ----------
        along : ndarray, shape (N, 3)
            Of any length but 0.

        Returns
        -------
        ndarray, shape (N, 3)
        """
        return np.asarray(self.body.support(along @ self.frame) @ self.frame.T)

    def overlap(self, axes: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """
        The volume that the region shares with itself moved along axes, and how fast it falls.

        Parameters
        ----------
        axes : ndarray, shape (N, 3)
            Unit vectors.
        length : float
            How far it is moved, dump's length unit.

        Returns
        -------
        shared : ndarray, shape (N,)
            The covariogram g, a volume.
        slope : ndarray, shape (N,)
            -dg/dlength, the area of the lines with a piece in it that is at least so long; at
            length 0 the projected area.
        """
        scale = abs(np.linalg.det(self.frame))
        shared, slope = self.body.overlap(axes @ np.linalg.inv(self.frame).T, length)
        return scale * shared, scale * slope

    def meets_itself(self, shift: FloatArray) -> bool:
        """
        Whether the region overlaps its copy that is moved by a vector.

        Parameters
        ----------
        shift : ndarray, shape (3,)
            Dump's length unit.

        Returns
        -------
        bool
        """
        if self.body.is_symmetric:
            # if any place lies in both, so does the middle of the two centres, half the shift
            return bool(self.contains(0.5 * shift[None])[0])
        from scipy.optimize import linprog

        # how deep a ball fits into both
        normals, distance = self.planes[:, :3], self.planes[:, 3]
        both = distance + np.minimum(normals @ shift, 0.0)
        depth = np.column_stack([normals, np.ones(len(normals))])
        found = linprog([0, 0, 0, -1], depth, both, bounds=[(None, None)] * 4)
        return bool(found.x[3] > ROUNDING * self.reach)

    def deformed(self, gradient: FloatArray) -> Convex:
        """
        The image of the region under the map gradient @ x.

        A sphere becomes an ellipsoid, a box leans: planes and a quadric again.

        Parameters
        ----------
        gradient : ndarray, shape (3, 3)
            Not singular.

        Returns
        -------
        Convex
        """
        if np.array_equal(gradient, np.eye(3)):
            return self
        return image_of(self.body, gradient @ self.frame, f"deformed, first {self.size}")


def image_of(body: Product | Hull, frame: FloatArray, size: str) -> Convex:
    """The places frame @ x with x in the body."""
    inverse = np.linalg.inv(frame)
    planes = np.column_stack([body.planes[:, :3] @ inverse, body.planes[:, 3]])
    planes /= np.linalg.norm(planes[:, :3], axis=1, keepdims=True)
    quadric = EVERYWHERE
    if body.form.any():
        form = inverse.T @ np.diag(body.form) @ inverse
        # scaled to an isotropic part of 1, whatever the unit of length
        level = 3.0 / np.trace(form)
        quadric = Quadric(1.0, level * form - np.eye(3), float(level))
    # the supports along -x, -y, -z are not those along x, y, z with the other sign in every body
    along = np.concatenate([np.eye(3), -np.eye(3)])
    ends = np.einsum("ij,ij->i", body.support(along @ frame) @ frame.T, along)
    reach = body.reach(frame)
    return Convex(planes, quadric, -ends[3:], ends[:3], reach, size, body, frame)
