"""Blocks of space: to which of them a place belongs, where they are, and how large."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

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

    A place x has the coordinates f = M x + t. Where one repeats, its fractional part counts; where
    it does not, places with f outside 0 to 1 are in no block. Of the axis i, a place lies in the
    part ⌊p_i f_i⌋. With shells, it also lies in the shell ⌊s |(f - ½) E|⌋, if the distance
    |(f - ½) E| is not above 1. Block numbers from 0 count the first axis fastest, and shells last.
    """

    matrix: FloatArray
    """M, shape (3, 3), per length unit."""
    shift: FloatArray
    """t, shape (3,), dimensionless."""
    parts: tuple[int, int, int] = (2, 2, 2)
    """p: how many parts there are along each axis."""
    repeats: tuple[bool, bool, bool] = (True, True, True)
    """Along which axes."""
    edges: FloatArray | None = None
    """E, shape (3, 3): the parallelepiped's edges as rows, over the outermost shell's radius."""
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
        The octants about a centre, of places within a reach of it; dump's length unit.

        In a plane quadrants.

        One of the axes that part them is the given one: then they are mirror images of one another
        with respect to it, as they must be in order to differ by chance alone.
        """
        along = np.asarray(axis, dtype=np.float64)
        # about x, y or z the octants are those of the coordinates
        is_coordinate = np.count_nonzero(along) == 1
        parting = np.eye(3) if is_coordinate else line_triads(along[None], space)[0]
        matrix = parting / (4.0 * reach)
        return cls(matrix, 0.5 - matrix @ center, _halves(parting, space))

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

        In a plane not across it.

        Parameters
        ----------
        vectors, origin, periodic : ndarray, shapes (3, 3), (3,), (3,)
            The cell: lattice vectors as rows, its corner, and which vectors repeat.
        position : ndarray, shape (N, 3)
            Of the grains, dump's length unit.
        space : Space, optional
            The plane in which they lie, if they do.
        """
        inverse = np.linalg.inv(vectors)
        matrix = inverse.T
        shift = -matrix @ origin
        along = (position - origin) @ inverse
        low, high = along.min(axis=0), along.max(axis=0)
        # far less than a period, about the middle
        scale = np.where(periodic, 1.0, 0.25 / (1.0 + high - low))
        middle = np.where(periodic, 0.0, 0.5 - scale * 0.5 * (low + high))
        return cls(scale[:, None] * matrix, scale * shift + middle, _halves(vectors, space))

    @classmethod
    def of_edges(
        cls,
        edges: FloatArray,
        corner: FloatArray,
        parts: tuple[int, int, int],
        repeats: npt.ArrayLike = (False, False, False),
    ) -> Blocks:
        """
        Equal parts of a parallelepiped.

        Parameters
        ----------
        edges : ndarray, shape (3, 3)
            As rows, dump's length unit.
        corner : ndarray, shape (3,)
            From which they run.
        parts : tuple of int
            Of each edge.
        repeats : array_like of bool, shape (3,)
            Along which edges it is the period of a periodic medium.

        Examples
        --------
        >>> import numpy as np
        >>> from scanfab.scan.blocks import Blocks
        >>> halves = Blocks.of_edges(np.diag([2.0, 1.0, 1.0]), np.zeros(3), (2, 1, 1))
        >>> halves.of(np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]]))
        array([ 0,  1, -1])
        """
        matrix = np.asarray(np.linalg.inv(edges).T, np.float64)
        first, second, third = (bool(one) for one in np.asarray(repeats))
        return cls(matrix, -matrix @ corner, parts, (first, second, third))

    def with_shells(self, number: int, radius: float) -> Blocks:
        """So many shells about the middle of the parallelepiped, up to a radius, in its place."""
        edges = np.asarray(np.linalg.inv(self.matrix.T) / radius, np.float64)
        return replace(self, parts=(1, 1, 1), edges=edges, shells=number)

    def moved(self, origin: FloatArray) -> Blocks:
        """Blocks of the dump's coordinates as blocks of places from an origin."""
        return replace(self, shift=self.shift + self.matrix @ origin)

    def finer(self, splits: tuple[int, int, int]) -> Blocks:
        """Each block in so many parts along each axis."""
        first, second, third = (p * s for p, s in zip(self.parts, splits, strict=True))
        return replace(self, parts=(first, second, third))

    def of_finer(self, splits: tuple[int, int, int]) -> IntArray:
        """For each block of :meth:`finer` its block here, and which part of it, shape (2, K)."""
        fine = self.finer(splits)
        rest = np.arange(len(fine))
        block, part, blocks_before, parts_before = np.zeros_like(rest), np.zeros_like(rest), 1, 1
        for parts, split in zip(self.parts, splits, strict=True):
            along, rest = rest % (parts * split), rest // (parts * split)
            block += blocks_before * (along // split)
            part += parts_before * (along % split)
            blocks_before, parts_before = blocks_before * parts, parts_before * split
        return np.array([block + blocks_before * rest, part])

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
        numbers, none = np.zeros(len(places), np.int64), np.zeros(len(places), bool)
        before, square = 1, np.zeros((len(places), 3))
        axes = zip(self.matrix, self.shift, self.parts, self.repeats, strict=True)
        for axis, (matrix, shift, parts, repeats) in enumerate(axes):
            along = places @ matrix + shift
            if repeats:
                along -= np.floor(along)
            none |= (along < 0.0) | (along > 1.0)
            # rounding makes a whole period of what is just below 0
            part = np.clip(np.where(none, 0.0, along) * parts, 0, parts - 1)
            numbers += before * part.astype(np.int64)
            before *= parts
            if self.edges is not None:
                square += (along - 0.5)[:, None] * self.edges[axis]
        distance = np.linalg.norm(square, axis=1)
        none |= distance > 1.0
        shell = np.minimum(distance * self.shells, self.shells - 1)
        return np.where(none, -1, numbers + before * np.where(none, 0, shell).astype(np.int64))

    @property
    def corner_edges(self) -> tuple[FloatArray, FloatArray]:
        """The corner and the edges, as rows, of the parallelepiped; shapes (3,), (3, 3)."""
        edges = np.asarray(np.linalg.inv(self.matrix.T), np.float64)
        return -self.shift @ edges, edges

    @property
    def radius(self) -> float:
        """Of the outermost shell; 0 without shells."""
        if self.edges is None:
            return 0.0
        return float(np.linalg.norm(self.corner_edges[1][0]) / np.linalg.norm(self.edges[0]))

    @property
    def heights(self) -> FloatArray:
        """How thick the blocks are between opposite faces; of shells each the same; shape (3,)."""
        if self.edges is not None:
            return np.full(3, self.radius / self.shells)
        heights: FloatArray = 1.0 / np.linalg.norm(self.matrix, axis=1) / np.array(self.parts)
        return heights

    def lattice(self, offset: float) -> FloatArray:
        """Of each block of the grid a place by its number's order: 0 a corner, ½ the middle."""
        corner, edges = self.corner_edges
        steps = [(np.arange(parts) + offset) / parts for parts in self.parts]
        z, y, x = np.meshgrid(*reversed(steps), indexing="ij")
        return corner + np.column_stack([x.ravel(), y.ravel(), z.ravel()]) @ edges

    @property
    def middles(self) -> FloatArray:
        """Of the blocks; of shells their centre; shape (B, 3)."""
        return np.tile(self.lattice(0.5), (self.shells, 1))

    @property
    def corners(self) -> FloatArray:
        """Of the blocks of a grid, shape (B, 8, 3), the first axis fastest."""
        _, edges = self.corner_edges
        z, y, x = np.meshgrid(*3 * [[0.0, 1.0]], indexing="ij")
        to_corner = np.column_stack([x.ravel(), y.ravel(), z.ravel()]) / np.array(self.parts)
        return np.asarray(self.lattice(0.0)[:, None] + to_corner @ edges)

    @property
    def radii(self) -> FloatArray:
        """Inner and outer radius of the shells, shape (S, 2)."""
        bounds = self.radius * np.arange(self.shells + 1) / self.shells
        return np.column_stack([bounds[:-1], bounds[1:]])

    @property
    def volumes(self) -> FloatArray:
        """Of the blocks, where :attr:`parts` are those of a grid or shells are whole, (B,)."""
        if self.edges is None:
            each = 1.0 / abs(np.linalg.det(self.matrix)) / math.prod(self.parts)
            return np.full(len(self), each)
        inner, outer = self.radii.T
        return np.asarray(4.0 / 3.0 * np.pi * (outer**3 - inner**3) / math.prod(self.parts))

    @property
    def form(self) -> FloatArray:
        """|(f - ½) E|² as a form of f - ½: xx, yy, zz, xy, xz, yz; shape (6,)."""
        if self.edges is None:
            return np.zeros(6)
        square = self.edges @ self.edges.T
        i, j = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]).T
        return np.asarray(square[i, j] * np.where(i == j, 1.0, 2.0))


def partition_of(whole: Blocks, window: Blocks) -> Partition:
    """Blocks as the numbers that kernels take."""
    both = whole, window
    octants = all(one.parts == (2, 2, 2) and all(one.repeats) and one.edges is None for one in both)
    return Partition(
        to_block=np.array([np.column_stack([one.matrix, one.shift]) for one in both]),
        parts=np.array([[*one.parts, one.shells] for one in both], dtype=np.float64),
        repeats=np.array([one.repeats for one in both], dtype=np.float64),
        form=np.array([one.form for one in both]),
        halves=True if octants else None,
    )


def _halves(vectors: FloatArray, space: Space) -> tuple[int, int, int]:
    """Two parts along each of three vectors, but for the one across a plane."""
    one, two, three = (2 if space.across is None or not v[space.across] else 1 for v in vectors)
    return one, two, three
