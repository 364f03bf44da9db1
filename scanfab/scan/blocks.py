"""Blocks of space: the block that holds a place, and the positions and sizes of blocks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.strips import Partition
from scanfab.scan.lines import line_triads


@dataclass(frozen=True, eq=False)
class Blocks:
    """
    Blocks of space: parts of a parallelepiped, of a periodic cell, or of shells about a centre.

    A place x has the coordinates f with x = corner + f E, where E are the edges. Along a periodic
    edge only the fractional part of f counts; along another edge, places with f outside 0 to 1 lie
    in no block. Along edge i a place lies in the part ⌊p_i f_i⌋. If there are s shells about the
    middle, it also lies in the shell ⌊s d / R⌋, provided that its distance d from the middle is at
    most R. Blocks are numbered from 0, the first edge fastest and shells last.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.scan.blocks import Blocks
    >>> halves = Blocks(np.zeros(3), np.diag([2.0, 1.0, 1.0]), (2, 1, 1))
    >>> halves.of(np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]]))
    array([ 0,  1, -1])
    """

    corner: FloatArray
    """Corner at which the edges begin, dump's length unit, shape (3,)."""
    edges: FloatArray
    """Edges of the parallelepiped as rows, shape (3, 3)."""
    parts: tuple[int, ...] = (2, 2, 2)
    """p: number of parts along each edge."""
    repeats: Sequence[bool] | BoolArray = (False, False, False)
    """Which edges are periods of a periodic medium."""
    radius: float = 0.0
    """R: radius of the outermost shell; 0 without shells."""
    shells: int = 1
    """s: number of shells of equal thickness."""

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
        The octants about a centre (in a plane, quadrants), for places within a reach of it.

        One of the axes that divide them is the given axis. They are then mirror images of one
        another with respect to it, so that they differ by chance alone.
        """
        along = np.asarray(axis, dtype=np.float64)
        # for x, y or z these are the octants of the coordinates
        is_coordinate = np.count_nonzero(along) == 1
        parting = np.eye(3) if is_coordinate else line_triads(along[None], space)[0]
        none = np.zeros(3, bool)
        return cls.of_periods(reach * parting, np.zeros(3), none, center[None], space)

    @classmethod
    def of_periods(
        cls,
        vectors: FloatArray,
        origin: FloatArray,
        periodic: BoolArray,
        position: FloatArray,
        space: Space,
    ) -> Blocks:
        """
        Halves of a cell's periods; along its other vectors, halves of the extent of positions.

        Parameters
        ----------
        vectors, origin, periodic : ndarray, shapes (3, 3), (3,), (3,)
            The cell: lattice vectors as rows, its corner, and which vectors are periodic.
        position : ndarray, shape (N, 3)
            Positions of the grains, dump's length unit.
        space : Space
            For discs: their plane, across which there are no halves.
        """
        along = (position - origin) @ np.linalg.inv(vectors)
        low, high = along.min(axis=0), along.max(axis=0)
        # far more than the extent of the positions, about their middle
        length = np.where(periodic, 1.0, 4.0 * (1.0 + high - low))
        start = np.where(periodic, 0.0, 0.5 * (low + high - length))
        edges, across = length[:, None] * vectors, space.across
        # no parts across a plane; all edges repeat, so no place is outside
        parts = tuple(2 if across is None or not edge[across] else 1 for edge in edges)
        return cls(origin + start @ vectors, edges, parts, (True, True, True))

    def moved(self, origin: FloatArray) -> Blocks:
        """The same blocks, for places relative to an origin."""
        return replace(self, corner=self.corner - origin)

    @cached_property
    def splits(self) -> tuple[int, ...]:
        """Parts along each edge that split a block in eight; the longest edges are split first."""
        if self.radius:
            return 2, 2, 2
        length = np.linalg.norm(self.edges, axis=1) / self.parts
        splits = np.ones(3, np.int64)
        for _ in range(3):
            # the first one of edges that are equal but for rounding
            left = length / splits
            splits[np.argmax(left > 0.999 * left.max())] *= 2
        return tuple(splits.tolist())

    def finer(self) -> Blocks:
        """Blocks that are the eight parts of each block."""
        return replace(self, parts=tuple(np.multiply(self.parts, self.splits).tolist()))

    def by_part(self, values: FloatArray) -> FloatArray:
        """Values of the blocks of :meth:`finer`, (..., 8 B), as (..., B, 8): by block and part."""
        shape = values.shape[:-1]
        counts = zip(reversed(self.parts), reversed(self.splits), strict=True)
        apart = values.reshape(*shape, self.shells, *(n for pair in counts for n in pair))
        # shell, z block, z part, y block, ...: the parts come last
        apart = np.moveaxis(apart, (-5, -3, -1), (-3, -2, -1))
        return apart.reshape(*shape, len(self), 8)

    @cached_property
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
        # rounding turns a coordinate just below 0 into 1, a whole period
        part = np.clip(along * parts, 0, parts - 1).astype(np.int64)
        numbers = part @ np.cumprod([1, *self.parts[:2]])
        if self.radius:
            distance = np.linalg.norm((along - 0.5) @ self.edges, axis=1) / self.radius
            none |= distance > 1.0
            numbers += before * np.minimum(distance * self.shells, self.shells - 1).astype(np.int64)
        return np.where(none, -1, numbers)

    @property
    def heights(self) -> FloatArray:
        """Distances between opposite faces of a block; for shells the thickness; shape (3,)."""
        if self.radius:
            return np.full(3, self.radius / self.shells)
        return np.asarray(1.0 / np.linalg.norm(self.matrix, axis=1) / self.parts)

    @property
    def middles(self) -> FloatArray:
        """Middles of the blocks; for shells their common centre; shape (B, 3)."""
        steps = (_steps(self.parts) + 0.5) / self.parts
        return np.tile(self.corner + steps @ self.edges, (self.shells, 1))

    @property
    def corners(self) -> FloatArray:
        """Corners of the blocks of a grid, the first edge fastest, shape (B, 8, 3)."""
        steps = _steps(self.parts)[:, None] + _steps((2, 2, 2))
        return np.asarray(self.corner + steps / self.parts @ self.edges)

    @property
    def bounds(self) -> FloatArray:
        """Radii at which the shells begin and end, from 0 to the outermost, shape (S + 1,)."""
        return np.asarray(self.radius * np.arange(self.shells + 1) / self.shells)

    @property
    def volumes(self) -> FloatArray:
        """Volumes of the blocks of a grid, or of whole shells, shape (B,)."""
        whole = np.full(self.shells, abs(np.linalg.det(self.edges)))
        if self.radius:
            whole = 4.0 / 3.0 * np.pi * np.diff(self.bounds**3)
        parts = math.prod(self.parts)
        return np.repeat(whole / parts, parts)


def _steps(parts: Sequence[int]) -> FloatArray:
    """Numbers of all parts along three edges, the first edge fastest, shape (N, 3)."""
    return np.indices(parts[::-1]).reshape(3, -1)[::-1].T.astype(np.float64)


def partition_of(whole: Blocks, window: Blocks) -> Partition:
    """The numbers of the blocks of whole and window, for kernels."""
    both = whole, window
    octants = all(one.parts == (2, 2, 2) and all(one.repeats) and not one.radius for one in both)
    i, j = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]).T
    # zeros where there are no shells
    square = np.array([one.edges @ one.edges.T / (one.radius or np.inf) ** 2 for one in both])
    return Partition(
        to_block=np.array([np.column_stack([one.matrix, one.shift]) for one in both]),
        parts=np.array([[*one.parts, one.shells] for one in both], dtype=np.float64),
        repeats=np.array([one.repeats for one in both], dtype=np.float64),
        # contiguous rows: kernels would be compiled once more for an array in another order
        form=np.ascontiguousarray(square[:, i, j] * np.where(i == j, 1.0, 2.0)),
        halves=True if octants else None,
    )
