"""The periodic cell of a packing: three lattice vectors, an origin, and which of them repeat."""

from __future__ import annotations

from functools import cached_property
from itertools import product

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import MOST, all_within, cast
from scanfab.base.errors import PackingError
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import spelt_place
from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.lattice import Lattice

# The longest periodic edge over the smallest height; the search for images can count so far.
WIDEST = 1e9


class Cell:
    """
    A cell that repeats along some of its lattice vectors.

    Parameters
    ----------
    vectors : array_like, shape (3, 3) or (3,)
        Lattice vectors as rows, in the dump's length unit; three numbers are the edges of an
        orthogonal cell.
    periodic : tuple of bool, optional
        Along which lattice vectors the packing repeats; all by default.
    origin : array_like, shape (3,), optional
        Corner of the cell, in the dump's length unit.
    space : Space, optional
        The plane of discs: two vectors lie in it, and the third does not repeat.

    Raises
    ------
    PackingError
        If the vectors span no volume, or if the cell is absurdly flat.

    Examples
    --------
    >>> from scanfab import Cell
    >>> cell = Cell([2.0, 3.0, 4.0], periodic=(True, True, False))
    >>> cell.wrap([[2.5, -0.5, 9.0]])
    array([[0.5, 2.5, 9. ]])
    """

    def __init__(
        self,
        vectors: npt.ArrayLike,
        periodic: tuple[bool, bool, bool] = (True, True, True),
        origin: npt.ArrayLike = (0.0, 0.0, 0.0),
        space: Space = SPACE,
    ) -> None:
        edges = cast("cell: vectors", vectors, np.float64, (3, ...))
        edges = np.diag(edges) if edges.ndim == 1 else edges
        self.vectors: FloatArray = cast("cell: vectors", edges, np.float64, (3, 3))
        self.origin: FloatArray = cast("cell: origin", origin, np.float64, (3,))
        x, y, z = cast("cell: periodic", periodic, np.bool_, (3,)).tolist()
        self.periodic: tuple[bool, bool, bool] = (x, y, z)
        self.space = space
        if not all(all_within(one, -MOST, MOST) for one in (self.vectors, self.origin)):
            raise PackingError(
                f"the cell's vectors and origin must be finite numbers, none above {MOST:g}"
            )
        edges = np.linalg.norm(self.vectors, axis=1)
        if np.any(edges == 0) or abs(np.linalg.det(self.vectors / edges[:, None])) < 1e-6:
            raise PackingError(f"the cell's vectors span no volume: {self.vectors.tolist()}")
        along = list(self.periodic)
        if edges[along].max(initial=0.0) > WIDEST * self.heights[along].min(initial=np.inf):
            raise PackingError(
                f"the cell is more than {WIDEST:g} times as long as it is high: one of its numbers "
                f"is wrong: {self.vectors.tolist()}"
            )

    def __repr__(self) -> str:
        edges = np.diag(self.vectors)
        if np.array_equal(self.vectors, np.diag(edges)):
            shape = " x ".join(f"{edge:.4g}" for edge in edges)
        else:
            shape = ", ".join(spelt_place(vector) for vector in self.vectors)
        along = [name for name, repeats in zip("xyz", self.periodic, strict=True) if repeats]
        words = {3: "periodic", 0: "not periodic"}
        repeats = words.get(len(along), f"periodic along {' and '.join(along)}")
        return f"Cell: {shape} from {spelt_place(self.origin)}, {repeats}"

    @property
    def is_periodic(self) -> bool:
        """Whether the packing repeats along any lattice vector."""
        return any(self.periodic)

    @property
    def heights(self) -> FloatArray:
        """Perpendicular distances between opposite faces, shape (3,), dump's length unit."""
        return np.asarray(1.0 / np.linalg.norm(np.linalg.inv(self.vectors), axis=0))

    @property
    def is_endless(self) -> bool:
        """Whether the packing repeats along all vectors; of discs, along both in their plane."""
        return sum(self.periodic) == self.space.dimension

    @property
    def own_vectors(self) -> FloatArray:
        """The vectors, shape (3, 3); of discs the two in their plane, shape (2, 2)."""
        if self.space.across is None:
            return self.vectors
        inside = self.vectors[:, self.space.across] == 0.0
        return self.vectors[np.ix_(inside, self.space.along)]

    @property
    def volume(self) -> float:
        """Volume, in the cube of the dump's length unit; in a plane the area."""
        return abs(float(np.linalg.det(self.own_vectors)))

    @property
    def center(self) -> FloatArray:
        """The middle of the cell, shape (3,), dump's length unit."""
        return np.asarray(self.origin + 0.5 * self.vectors.sum(axis=0))

    def fractional(self, position: npt.ArrayLike) -> FloatArray:
        """
        Coordinates along the lattice vectors, 0 to 1 inside the cell.

        Parameters
        ----------
        position : array_like, shape (N, 3)
            Dump's length unit.

        Returns
        -------
        ndarray, shape (N, 3)
            Dimensionless.
        """
        from_origin = np.asarray(position, dtype=np.float64) - self.origin
        return np.asarray(from_origin @ np.linalg.inv(self.vectors))

    def surely_holds(self, position: FloatArray) -> bool:
        """
        Whether all positions lie in the cell along its periodic vectors, as in most dumps.

        Only the corners of the box around the positions are tested, which suffices as fractions are
        linear. In a tilted cell the box may reach beyond the cell although no position does. To
        place all positions would take ten times as long, and three times their memory.

        Parameters
        ----------
        position : ndarray, shape (N, 3)
            Dump's length unit.

        Returns
        -------
        bool
            False also if the box reaches beyond the cell.
        """
        if len(position) == 0:
            return True
        sides = [(along.min(), along.max()) for along in position.T]
        fractions = self.fractional(list(product(*sides)))[:, list(self.periodic)]
        return bool(np.all((fractions >= 0.0) & (fractions < 1.0)))

    def place(self, position: npt.ArrayLike) -> tuple[FloatArray, IntArray]:
        """
        Move positions into the cell, and count the lattice vectors that this takes.

        Parameters
        ----------
        position : array_like, shape (N, 3)
            Dump's length unit.

        Returns
        -------
        position : ndarray, shape (N, 3)
            Inside the cell along its periodic vectors.
        turns : ndarray of int, shape (N, 3)
            Lattice vectors from there to the given position; 0 along vectors that do not repeat.
        """
        position = np.asarray(position, dtype=np.float64)
        turns = np.where(self.periodic, np.floor(self.fractional(position)), 0.0)
        wrapped: FloatArray = position - turns @ self.vectors
        # a position a rounding error below a face lands on the opposite face: the same place
        on_face = np.where(self.periodic, np.floor(self.fractional(wrapped)), 0.0)
        wrapped -= on_face @ self.vectors
        return wrapped, (turns + on_face).astype(np.int64)

    def wrap(self, position: npt.ArrayLike) -> FloatArray:
        """
        Positions moved into the cell along its periodic vectors.

        Parameters
        ----------
        position : array_like, shape (N, 3)
            Dump's length unit.

        Returns
        -------
        ndarray, shape (N, 3)
        """
        return self.place(position)[0]

    @cached_property
    def lattice(self) -> Lattice:
        """The lattice of the periodic vectors, by its shortest vectors."""
        return Lattice.of(self.vectors, self.periodic)

    @property
    def short_vectors(self) -> FloatArray:
        """The vectors of the cell, with the periodic ones reduced, shape (3, 3)."""
        vectors = self.vectors.copy()
        vectors[np.flatnonzero(self.periodic)] = self.lattice.vectors
        return vectors

    def nearest_image(self, branch: npt.ArrayLike) -> IntArray:
        """
        The lattice translation that makes each branch vector shortest, in any cell.

        Parameters
        ----------
        branch : array_like, shape (M, 3)
            Vectors from first to second centres, dump's length unit.

        Returns
        -------
        ndarray of int, shape (M, 3)
            Numbers of lattice vectors to add to each branch; 0 along vectors that do not repeat.
        """
        return self.lattice.nearest(np.asarray(branch, dtype=np.float64))

    def images_outside(
        self, position: FloatArray, margin: float
    ) -> tuple[FloatArray, IntArray, IntArray]:
        """
        Periodic images of points in the cell that lie outside within a margin of it.

        Parameters
        ----------
        position : ndarray, shape (N, 3)
            Points inside the cell, dump's length unit.
        margin : float
            Distance from the cell's faces, dump's length unit.

        Returns
        -------
        position : ndarray, shape (K, 3)
            The images.
        row : ndarray of int, shape (K,)
            The point that each image repeats.
        image : ndarray of int, shape (K, 3)
            Lattice translation from that point.
        """
        periodic = list(self.periodic)
        fractions, reach = self.fractional(position)[:, periodic], margin / self.heights[periodic]
        # only points near a face have images near the cell
        near = np.flatnonzero(((fractions <= reach) | (fractions >= 1.0 - reach)).any(axis=1))
        steps = [range(-int(most) - 1, int(most) + 2) for most in reach]
        shifts = [shift for shift in product(*steps) if any(shift)]
        moved = (fractions[near] + shift for shift in shifts)
        rows = [near[((one >= -reach) & (one <= 1.0 + reach)).all(axis=1)] for one in moved]
        row = np.concatenate(rows)
        image = np.zeros((len(row), 3), np.int64)
        image[:, periodic] = np.repeat(shifts, [len(some) for some in rows], axis=0)
        return np.take(position, row, axis=0) + image.astype(np.float64) @ self.vectors, row, image

    def images_near_origin(
        self, position: FloatArray, reach: FloatArray
    ) -> tuple[FloatArray, npt.NDArray[np.intp]]:
        """
        All images of points that lie within a reach of the origin.

        Parameters
        ----------
        position : ndarray, shape (N, 3)
            Points, dump's length unit.
        reach : ndarray, shape (N,)
            Distance from the origin for the images of each point, dump's length unit.

        Returns
        -------
        position : ndarray, shape (K, 3)
            The images.
        row : ndarray of int, shape (K,)
            The point that each image repeats.
        """
        nearest = position + self.nearest_image(position) @ self.vectors
        most = np.floor(reach.max(initial=0.0) / self.lattice.heights + 1.0)
        images, rows = [], []
        for shift in self.lattice.steps(most) @ self.lattice.vectors:
            moved = nearest + shift
            rows.append(np.flatnonzero(np.linalg.norm(moved, axis=1) < reach))
            images.append(moved[rows[-1]])
        return np.concatenate(images), np.concatenate(rows)
