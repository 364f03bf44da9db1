"""
Windows: the RV (representative volume) of c and d, and that of a whole sample, an ellipsoid.

They say which grains and contacts lie in them.
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
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

# for messages: who writes 70 means per cent
RV_MEANING = "which is a fraction of half the sample's smallest extent, such as 0.7"

# half a window's length, in periods: a rod so long would have to miss thousands of its images
MOST_PERIODS = 10


@dataclass(frozen=True, eq=False)
class Window:
    """
    An RV, fixed for a series: a region about a centre; lengths in the dump's unit.

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
        """Of a ball about the centre that holds the window; of a sphere its own."""
        return self.shape.reach

    def contains(self, points: FloatArray, packing: Packing) -> BoolArray:
        """
        Which points lie in the window, through periodic faces too.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Dump's coordinates.
        packing : Packing
            Whose cell repeats, if it does.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        return np.asarray(
            in_parts(lambda some: self.shape.contains(self.branches(some, packing)), points)
        )

    def may_meet(self, points: FloatArray, radius: FloatArray, packing: Packing) -> BoolArray:
        """
        Which spheres may reach into the window, likewise: see :meth:`Convex.may_meet`.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Their centres, in the dump's coordinates.
        radius : ndarray, shape (N,)
            Their radii.
        packing : Packing
            Whose cell repeats, if it does.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        largest = float(radius.max(initial=0.0))

        def meets_any_image(points: FloatArray, radius: FloatArray) -> BoolArray:
            # which image is the nearest to the centre says little of a long window
            branch, shifts = self.images(points, packing, largest)
            meets = np.zeros(len(points), bool)
            for shift in shifts:
                left = np.flatnonzero(~meets)
                meets[left] = self.shape.may_meet(branch[left] + shift, radius[left])
            return meets

        return np.asarray(in_parts(meets_any_image, points, radius))

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
            Whose cell repeats, if it does.

        Raises
        ------
        SettingsError
            If it is wider than a period.
        """
        if packing.cell is None or not packing.is_periodic:
            return
        lattice = packing.cell.lattice
        if self.shape.reach <= 0.5 * lattice.shortest:
            return
        if self.shape.is_sphere:
            raise SettingsError(
                f"the {self} is wider than the cell's shortest period ({lattice.shortest:g}): "
                f"choose a smaller `rv`, {RV_MEANING}"
            )
        if self.shape.reach > MOST_PERIODS * lattice.shortest:
            raise SettingsError(
                f"the {self} reaches through more than {MOST_PERIODS} periods of the cell "
                f"({lattice.shortest:g}): choose a smaller one (`rv`, `rv_size`)"
            )
        for shift in lattice.within(2.0 * self.shape.reach):
            if self.shape.meets_itself(shift):
                period = ", ".join(f"{part:.4g}" for part in shift)
                raise SettingsError(
                    f"the {self} overlaps its own image, ({period}) away in the periodic cell, so "
                    f"that grains would count twice: choose a smaller one (`rv`, `rv_size`)"
                )

    def branches(self, points: FloatArray, packing: Packing) -> FloatArray:
        """
        From the window's centre to an image of each point.

        To the image that lies in the window, if there is one; else to the nearest.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Dump's coordinates.
        packing : Packing
            Whose cell repeats, if it does.

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

    def images(
        self, points: FloatArray, packing: Packing, margin: float = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """
        From the window's centre to all images of points that may lie near the window.

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Dump's coordinates.
        packing : Packing
            Whose cell repeats, if it does.
        margin : float, optional
            How near: from the window's surface, dump's length unit.

        Returns
        -------
        branch : ndarray, shape (N, 3)
            To the nearest image of each point.
        shifts : ndarray, shape (T, 3)
            From there to other images; the first is 0.
        """
        branch = points - self.center
        shifts = np.zeros((1, 3))
        if packing.cell is not None and packing.is_periodic:
            branch = branch + packing.cell.nearest_image(branch) @ packing.cell.vectors
            reach, lattice = self.shape.reach + margin, packing.cell.lattice
            # of images closer than half a period there is one only
            if reach > 0.5 * lattice.shortest:
                shifts = np.concatenate([shifts, lattice.within(reach + lattice.half_extent)])
        return branch, shifts


@dataclass(frozen=True, eq=False)
class SurfaceBox:
    """The box of the grains' surfaces; what is asked of it is the cell's where that is periodic."""

    low: FloatArray
    """Shape (3,)."""
    high: FloatArray
    cell: Cell | None
    space: Space = SPACE
    """The plane in which the grains lie: the box has no extent across it."""

    @classmethod
    def of(cls, packing: Packing, grains: BoolArray) -> SurfaceBox:
        """That of some particles of a packing."""
        position, radius = (
            compressed(grains, values) for values in (packing.position, packing.radius)
        )
        # one coordinate at a time: that is faster by far for millions of grains
        low = np.array([(along - radius).min() for along in position.T])
        high = np.array([(along + radius).max() for along in position.T])
        if packing.space.across is not None:
            low[packing.space.across] = high[packing.space.across] = packing.place_across
        return cls(low, high, packing.cell, packing.space)

    @property
    def extents(self) -> FloatArray:
        """Edges of the box (heights of the cell, along its periodic vectors), shape (3,)."""
        extents = self.high - self.low
        if self.cell is not None:
            extents = np.where(self.cell.periodic, self.cell.heights, extents)
        return extents

    @property
    def smallest_extent(self) -> float:
        """The shortest of the edges; of discs in their plane."""
        return float(self.extents[list(self.space.along)].min())

    @property
    def center(self) -> FloatArray:
        """The middle of the box (of the cell, along its periodic vectors)."""
        middle: FloatArray = 0.5 * (self.low + self.high)
        if self.cell is not None:
            middle = np.where(self.cell.periodic, self.cell.center, middle)
        return middle

    def room_around(self, window: Window) -> float:
        """
        The smallest distance from a window's box to a face.

        Negative if it reaches beyond; infinite if all directions are periodic, as there is no face.
        """
        below, above = window.center - self.low, self.high - window.center
        nearest = np.minimum(below + window.shape.low, above - window.shape.high)
        if self.cell is not None:
            nearest = np.where(self.cell.periodic, np.inf, nearest)
        return float(nearest[list(self.space.along)].min())


def inner_ellipsoid(position: FloatArray, largest: float, space: Space = SPACE) -> Window | None:
    """
    The ellipsoid of a sample's shape that lies a largest radius within the hull of its centres.

    With σ_k the standard deviations of the centres along their principal axes, and facets of their
    convex hull with normals n and distances d from the mean, its semi-axes are σ_k times the
    smallest of (d - r_max) / √(Σ σ_k² n_k²): then it touches the hull moved inwards by r_max, and
    each grain that reaches into it has its centre in the hull.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Centres.
    largest : float
        Radius of the largest grain.
    space : Space, optional
        The plane in which the centres lie, if they do: then it is an ellipse there.

    Returns
    -------
    Window or None
        None of a sample that is flat, or too small to hold any.

    Examples
    --------
    A cube of 11 x 11 x 11 grains, 10 from centre to centre, has the sphere of radius 5 - 0.5:

    >>> import numpy as np
    >>> from scanfab.packing.window import inner_ellipsoid
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(11.0)]), axis=-1).reshape(-1, 3)
    >>> round(inner_ellipsoid(grid, 0.5).radius, 9)
    4.5
    """
    # loaded here, as few scans need it
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
