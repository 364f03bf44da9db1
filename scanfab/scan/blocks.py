"""Blocks of space: to which of them a place belongs, where they are, and how large."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.bins import Partition
from scanfab.scan.lines import line_triads


@dataclass(frozen=True, eq=False)
class Blocks:
    """
    Blocks of space: parts of a parallelepiped, of a periodic cell, or of shells about a centre.

    A place x has coordinates f with x = corner + f E, and E the edges. Where one repeats, its
    fractional part counts; where it does not, places with f outside 0 to 1 are in no block. Of the
    axis i, a place lies in the part ⌊p_i f_i⌋. With s shells about the middle, it also lies in the
    shell ⌊s d / R⌋, if its distance d from the middle is not above R. Block numbers from 0 count
    the first axis fastest, and shells last.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.scan.blocks import Blocks
    >>> halves = Blocks(np.zeros(3), np.diag([2.0, 1.0, 1.0]), (2, 1, 1))
    >>> halves.of(np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]]))
    array([ 0,  1, -1])
    """

    corner: FloatArray
    """From which the edges run, dump's length unit, shape (3,)."""
    edges: FloatArray
    """Of the parallelepiped, as rows, shape (3, 3)."""
    parts: tuple[int, ...] = (2, 2, 2)
    """p: how many parts there are along each edge."""
    repeats: Sequence[bool] | BoolArray = (False, False, False)
    """Along which edges it is the period of a periodic medium."""
    radius: float = 0.0
    """R of the outermost shell; 0 without shells."""
    shells: int = 1
    """s: how many shells of equal thickness there are."""

    def __len__(self) -> int:
        return math.prod(self.parts) * self.shells

    @classmethod
    def about(
        cls,
        center: FloatArray,
        reach: float,
        axis: npt.ArrayLike = (0, 0, 1),
        space: Space = SPACE,
    ) -> Blocks:
        """
        The octants about a centre, of places within a reach of it; in a plane quadrants.

        One of the axes that part them is the given one: then they are mirror images of one another
        with respect to it, as they must be in order to differ by chance alone.
        """
        along = np.asarray(axis, dtype=np.float64)
        # about x, y or z the octants are those of the coordinates
        is_coordinate = np.count_nonzero(along) == 1
        parting = np.eye(3) if is_coordinate else line_triads(along[None], space)[0]
        # coordinates from a quarter to three quarters of a period
        edges = 4.0 * reach * parting
        return cls._halves(center - 0.5 * edges.sum(axis=0), edges, space)

    @classmethod
    def of_periods(
        cls,
        vectors: FloatArray,
        origin: FloatArray,
        periodic: BoolArray,
        position: FloatArray,
        space: Space = SPACE,
    ) -> Blocks:
        """
        Halves of a cell's periods; along its other vectors, of what the positions take.

        Parameters
        ----------
        vectors, origin, periodic : ndarray, shapes (3, 3), (3,), (3,)
            The cell: lattice vectors as rows, its corner, and which vectors repeat.
        position : ndarray, shape (N, 3)
            Of the grains, dump's length unit.
        space : Space, optional
            The plane in which they lie, if they do: across it there are no halves.
        """
        along = (position - origin) @ np.linalg.inv(vectors)
        low, high = along.min(axis=0), along.max(axis=0)
        # far more than the positions take, about their middle
        length = np.where(periodic, 1.0, 4.0 * (1.0 + high - low))
        start = np.where(periodic, 0.0, 0.5 * (low + high - length))
        return cls._halves(origin + start @ vectors, length[:, None] * vectors, space)

    @classmethod
    def _halves(cls, corner: FloatArray, edges: FloatArray, space: Space) -> Blocks:
        """Two parts along each edge but the one across a plane; all repeat, so none is outside."""
        across = space.across
        parts = tuple(2 if across is None or not edge[across] else 1 for edge in edges)
        return cls(corner, edges, parts, (True, True, True))

    def moved(self, origin: FloatArray) -> Blocks:
        """Blocks of the dump's coordinates as blocks of places from an origin."""
        return replace(self, corner=self.corner - origin)

    @cached_property
    def splits(self) -> tuple[int, ...]:
        """In how many parts along each edge a block is split in eight, the longest edge first."""
        if self.radius:
            return 2, 2, 2
        length = np.linalg.norm(self.edges, axis=1) / self.parts
        splits = np.ones(3, np.int64)
        for _ in range(3):
            # of edges that are equal but for rounding the first
            left = length / splits
            splits[np.argmax(left > 0.999 * left.max())] *= 2
        return tuple(splits.tolist())

    def finer(self) -> Blocks:
        """The eight parts of each block as blocks."""
        return replace(self, parts=tuple(np.multiply(self.parts, self.splits).tolist()))

    def by_part(self, values: FloatArray) -> FloatArray:
        """Values of the blocks of :meth:`finer`, (..., 8 B), by block and part, (..., B, 8)."""
        shape = values.shape[:-1]
        counts = zip(reversed(self.parts), reversed(self.splits), strict=True)
        apart = values.reshape(*shape, self.shells, *(n for pair in counts for n in pair))
        # shell, z block, z part, y block, ...: the parts come last
        apart = np.moveaxis(apart, (-5, -3, -1), (-3, -2, -1))
        return apart.reshape(*shape, len(self), 8)

    @property
    def matrix(self) -> FloatArray:
        """M of the coordinates f = M x + t, shape (3, 3), per length unit."""
        return np.asarray(np.linalg.inv(self.edges).T, np.float64)

    @property
    def shift(self) -> FloatArray:
        """t, shape (3,), dimensionless."""
        return -self.matrix @ self.corner

    def of(self, places: FloatArray) -> IntArray:
        """
        The block of each place, -1 for none, shape (N,).

        Examples
        --------
        >>> import numpy as np
        >>> from scanfab.scan.blocks import Blocks
        >>> Blocks.about(np.zeros(3), 1.0).of(np.array([[-0.1, -0.2, -0.3], [0.1, -0.2, 0.3]]))
        array([0, 5])
        """
        parts, before = np.array(self.parts), math.prod(self.parts)
        along = places @ self.matrix.T + self.shift
        along -= np.where(self.repeats, np.floor(along), 0.0)
        none = np.any((along < 0.0) | (along > 1.0), axis=1)
        # rounding makes a whole period of what is just below 0
        part = np.clip(along * parts, 0, parts - 1).astype(np.int64)
        numbers = part @ np.cumprod([1, *self.parts[:2]])
        if self.radius:
            distance = np.linalg.norm((along - 0.5) @ self.edges, axis=1) / self.radius
            none |= distance > 1.0
            numbers += before * np.minimum(distance * self.shells, self.shells - 1).astype(np.int64)
        return np.where(none, -1, numbers)

    @property
    def heights(self) -> FloatArray:
        """How thick the blocks are between opposite faces; of shells each the same; shape (3,)."""
        if self.radius:
            return np.full(3, self.radius / self.shells)
        return np.asarray(1.0 / np.linalg.norm(self.matrix, axis=1) / self.parts)

    @property
    def middles(self) -> FloatArray:
        """Of the blocks; of shells their centre; shape (B, 3)."""
        steps = (_steps(self.parts) + 0.5) / self.parts
        return np.tile(self.corner + steps @ self.edges, (self.shells, 1))

    @property
    def corners(self) -> FloatArray:
        """Of the blocks of a grid, shape (B, 8, 3), the first axis fastest."""
        steps = _steps(self.parts)[:, None] + _steps((2, 2, 2))
        return np.asarray(self.corner + steps / self.parts @ self.edges)

    @property
    def bounds(self) -> FloatArray:
        """Radii that begin and end the shells, from 0 to the outermost, shape (S + 1,)."""
        return np.asarray(self.radius * np.arange(self.shells + 1) / self.shells)

    @property
    def volumes(self) -> FloatArray:
        """Of the blocks of a grid, or of whole shells, shape (B,)."""
        whole = np.full(self.shells, abs(np.linalg.det(self.edges)))
        if self.radius:
            whole = 4.0 / 3.0 * np.pi * np.diff(self.bounds**3)
        parts = math.prod(self.parts)
        return np.repeat(whole / parts, parts)


def _steps(parts: Sequence[int]) -> FloatArray:
    """The numbers of all parts along three edges, the first fastest, shape (N, 3)."""
    return np.indices(parts[::-1]).reshape(3, -1)[::-1].T.astype(np.float64)


def partition_of(whole: Blocks, window: Blocks) -> Partition:
    """Blocks as the numbers that kernels take."""
    both = whole, window
    octants = all(one.parts == (2, 2, 2) and all(one.repeats) and not one.radius for one in both)
    i, j = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]).T
    # zeros where there are no shells
    square = np.array([one.edges @ one.edges.T / (one.radius or np.inf) ** 2 for one in both])
    return Partition(
        to_block=np.array([np.column_stack([one.matrix, one.shift]) for one in both]),
        parts=np.array([[*one.parts, one.shells] for one in both], dtype=np.float64),
        repeats=np.array([one.repeats for one in both], dtype=np.float64),
        # in rows: kernels are compiled once more for an array in another order
        form=np.ascontiguousarray(square[:, i, j] * np.where(i == j, 1.0, 2.0)),
        halves=True if octants else None,
    )
