"""
Windows: regions of a sample that are measured, and which grains and contacts lie in them.

The RV (representative volume) of variants c and d is a window, and so is the ellipsoid of a sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scanfab.base.arrays import cast, compressed, in_parts
from scanfab.base.convex import Convex
from scanfab.base.errors import SettingsError
from scanfab.base.shapes import ellipsoid
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import spelt_place
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.packing.packing import Packing

# In messages, because some users write 70 for 70 %.
RV_MEANING = "which is a fraction of half the sample's smallest extent, such as 0.7"

# Half a window may span so many periods. A longer rod would have to miss thousands of its images.
MOST_PERIODS = 10


@dataclass(frozen=True, eq=False)
class Window:
    """
    A region about a centre, such as the RV of a series.

    Parameters
    ----------
    center : array_like, shape (3,)
        Dump's length unit.
    shape : Convex
        The region, as if its centre were the origin.

    Raises
    ------
    PackingError
        If the centre is no point.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import Packing, Window, sphere
    >>> window = Window([0.0, 0.0, 1.0], sphere(2.0))
    >>> window
    Window: radius 2 about (0, 0, 1) (dump's unit)
    >>> packing = Packing([[0, 0, 0], [0, 0, 3.5]], 1.0)
    >>> window.contains(packing.position, packing)
    array([ True, False])
    """

    center: FloatArray
    shape: Convex

    @property
    def radius(self) -> float:
        """Radius of the ball about the centre that just holds the window, dump's length unit."""
        return self.shape.reach

    def contains(self, points: FloatArray, packing: Packing) -> BoolArray:
        """
        Which points lie in the window, through periodic faces too.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Dump's coordinates.
        packing : Packing
            The packing, whose cell may be periodic.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        return in_parts(lambda some: self.shape.contains(self.branches(some, packing)), points)

    def may_meet(self, points: FloatArray, radius: FloatArray, packing: Packing) -> BoolArray:
        """
        Which spheres may reach into the window, through periodic faces too.

        See :meth:`Convex.may_meet`.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Their centres, in the dump's coordinates.
        radius : ndarray, shape (N,)
            Their radii.
        packing : Packing
            The packing, whose cell may be periodic.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        largest = float(radius.max(initial=0.0))

        def meets_any_image(points: FloatArray, radius: FloatArray) -> BoolArray:
            # a long window may be met by an image that is not the nearest one
            branch, shifts = self.images(points, packing, largest)
            meets = np.zeros(len(points), bool)
            for shift in shifts:
                left = np.flatnonzero(~meets)
                meets[left] = self.shape.may_meet(branch[left] + shift, radius[left])
            return meets

        return in_parts(meets_any_image, points, radius)

    def __post_init__(self) -> None:
        """PackingError if the centre is no point."""
        object.__setattr__(self, "center", cast("center", self.center, np.float64, (3,)))

    def __repr__(self) -> str:
        return f"Window: {self.shape} about {spelt_place(self.center)} (dump's unit)"

    def __str__(self) -> str:
        return f"RV ({self.shape} about {np.round(self.center, 9).tolist()})"

    def check_fits(self, packing: Packing) -> None:
        """
        Make sure that no two images of a grain have their centres in the window.

        Parameters
        ----------
        packing : Packing
            The packing, whose cell may be periodic.

        Raises
        ------
        SettingsError
            If two images of the window overlap.
        """
        if packing.cell is None or not packing.is_periodic:
            return
        lattice = packing.cell.lattice
        if self.shape.reach > MOST_PERIODS * lattice.shortest:
            raise SettingsError(
                f"the {self} reaches through more than {MOST_PERIODS} periods of the cell "
                f"({lattice.shortest:g}): choose a smaller RV"
            )
        for shift in lattice.within(2.0 * self.shape.reach):
            if self.shape.meets_itself(shift):
                period = ", ".join(f"{part:.4g}" for part in shift)
                raise SettingsError(
                    f"the {self} overlaps its own image, ({period}) away in the periodic cell, so "
                    f"that grains would count twice: choose a smaller RV"
                )

    def branches(self, points: FloatArray, packing: Packing) -> FloatArray:
        """
        Vectors from the window's centre to the image of each point that lies in the window.

        If no image lies in it, the vector leads to the nearest image.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Dump's coordinates.
        packing : Packing
            The packing, whose cell may be periodic.

        Returns
        -------
        ndarray, shape (N, 3)
        """
        branch, shifts = self.images(points, packing)
        for shift in shifts[1:]:
            outside = np.flatnonzero(~self.shape.contains(branch))
            moved = branch[outside] + shift
            inside = self.shape.contains(moved)
            branch[outside[inside]] = moved[inside]
        return branch

    def placed(self, points: FloatArray, packing: Packing) -> FloatArray:
        """
        The image of each point to which :meth:`branches` leads.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Dump's coordinates.
        packing : Packing
            The packing, whose cell may be periodic.

        Returns
        -------
        ndarray, shape (N, 3)
            Dump's coordinates.
        """
        return self.center + self.branches(points, packing)

    def images(
        self, points: FloatArray, packing: Packing, margin: float = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """
        Vectors from the window's centre to all images of points that may lie near the window.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Dump's coordinates.
        packing : Packing
            The packing, whose cell may be periodic.
        margin : float, optional
            Distance from the window's surface, dump's length unit.

        Returns
        -------
        branch : ndarray, shape (N, 3)
            Vectors to the nearest image of each point.
        shifts : ndarray, shape (T, 3)
            Vectors from the nearest image to the others; the first is 0.
        """
        branch = points - self.center
        shifts = np.zeros((1, 3))
        if packing.cell is not None and packing.is_periodic:
            branch = branch + packing.cell.nearest_image(branch) @ packing.cell.vectors
            reach, lattice = self.shape.reach + margin, packing.cell.lattice
            # only one image of a point is closer than half a period
            if reach > 0.5 * lattice.shortest:
                shifts = np.concatenate([shifts, lattice.within(reach + lattice.half_extent)])
        return branch, shifts


@dataclass(frozen=True, eq=False)
class SurfaceBox:
    """The box around the grains' surfaces; along periodic directions the cell takes its place."""

    low: FloatArray
    """Lower corner, shape (3,)."""
    high: FloatArray
    extents: FloatArray
    """Edges of the box (heights of the cell, along its periodic vectors), shape (3,)."""
    center: FloatArray
    """The middle of the box (of the cell, along its periodic vectors)."""
    periodic: BoolArray
    space: Space
    """The plane in which the grains lie: the box has no extent across it."""

    @classmethod
    def of(cls, packing: Packing, grains: BoolArray) -> SurfaceBox:
        """The box around some particles of a packing."""
        position, radius = compressed(grains, packing.position), compressed(grains, packing.radius)
        # one coordinate at a time is much faster for millions of grains
        low = np.array([(along - radius).min() for along in position.T])
        high = np.array([(along + radius).max() for along in position.T])
        if packing.space.across is not None:
            low[packing.space.across] = high[packing.space.across] = packing.place_across
        extents, center, periodic = high - low, 0.5 * (low + high), np.zeros(3, bool)
        if packing.cell is not None:
            periodic = np.array(packing.cell.periodic)
            extents = np.where(periodic, packing.cell.heights, extents)
            center = np.where(periodic, packing.cell.center, center)
        return cls(low, high, extents, center, periodic, packing.space)

    @property
    def smallest_extent(self) -> float:
        """The shortest edge; of discs the shortest edge in their plane."""
        return float(self.extents[list(self.space.along)].min())

    def room_around(self, window: Window) -> float:
        """
        The smallest distance from a window's box to a face of this box.

        It is negative if the window reaches beyond a face, and infinite if there is no face, as all
        directions are periodic.
        """
        below, above = window.center - self.low, self.high - window.center
        nearest = np.minimum(below + window.shape.low, above - window.shape.high)
        nearest[self.periodic] = np.inf
        return float(nearest[list(self.space.along)].min())


def inner_ellipsoid(position: FloatArray, largest: float, space: Space = SPACE) -> Window | None:
    """
    The ellipsoid of the shape of a sample, one largest radius inside the hull of the centres.

    With σ_k the standard deviations of the centres along their principal axes, and facets of their
    convex hull with normals n and distances d from the mean, its semi-axes are σ_k times the
    smallest of (d - r_max) / √(Σ σ_k² n_k²). So it touches the hull that is moved inwards by r_max,
    and each grain that reaches into it has its centre in the hull.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Centres.
    largest : float
        Radius of the largest grain.
    space : Space, optional
        The plane in which the centres lie. There the window is an ellipse.

    Returns
    -------
    Window or None
        None if the sample is flat, or too small to hold an ellipsoid.

    Examples
    --------
    The centres of 11 x 11 x 11 grains span a cube of edge 10, which gives a sphere of radius 4.5:

    >>> import numpy as np
    >>> from scanfab.packing.window import inner_ellipsoid
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(11.0)]), axis=-1).reshape(-1, 3)
    >>> round(inner_ellipsoid(grid, 0.5).radius, 9)
    4.5
    """
    # few scans need it, so it is loaded here
    from scipy.spatial import ConvexHull, QhullError

    if not len(position):
        return None
    along = list(space.along)
    center = position.mean(axis=0)
    if space.across is not None:
        center[space.across] = position[0, space.across]
    branch = (position - center)[:, along]
    try:
        facets = ConvexHull(branch).equations
    except (QhullError, ValueError):
        return None
    variance, axes = np.linalg.eigh(np.cov(branch.T))
    normals, distance = facets[:, :-1] @ axes, -facets[:, -1]
    scale = float(np.min((distance - largest) / np.sqrt(normals**2 @ variance)))
    if scale <= 0.0:
        return None
    semi_axes = scale * np.sqrt(variance)
    turn = axes.T @ space.basis[: space.dimension]
    return Window(center, ellipsoid(semi_axes, turn, space))
