"""
The gap scan: all void segments, by the block of their middle and by cut-off.

Slower than :mod:`scanfab.scan.scan`, about twice where lines are far apart, and for what that
cannot tell: the sample's own scatter, every cut-off in one pass, and higher moments of the lengths.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from scanfab.base.jit import Flag
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import ENDS
from scanfab.scan.following import MOST_STEPS, Following
from scanfab.scan.kernels.bins import Bins
from scanfab.scan.lines import drawn_lines, line_triads
from scanfab.scan.scan import in_parts
from scanfab.scan.solids import Solids, shortest_gap
from scanfab.scan.tallies import tally_triads

__all__ = ["Blocks", "GapSums", "scan_gaps"]


@dataclass(frozen=True, eq=False)
class Blocks:
    """
    Blocks of space, such as the octants about a centre, or those of a periodic cell.

    Of the axis i, a place x lies in the part ⌊p_i f⌋, where f is the fractional part of
    (M x + t)_i; block numbers from 0 count the first axis fastest.
    """

    matrix: FloatArray
    """M, shape (3, 3), per length unit."""
    shift: FloatArray
    """t, shape (3,), dimensionless."""
    parts: tuple[int, int, int] = (2, 2, 2)
    """p: how many blocks there are along each axis."""

    def __len__(self) -> int:
        return math.prod(self.parts)

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

    def of(self, places: FloatArray) -> IntArray:
        """
        The block of each place, shape (N,).

        Examples
        --------
        >>> import numpy as np
        >>> from scanfab.scan.gaps import Blocks
        >>> Blocks.about(np.zeros(3), 1.0).of(np.array([[-0.1, -0.2, -0.3], [0.1, -0.2, 0.3]]))
        array([0, 5])
        """
        numbers = np.zeros(len(places), dtype=np.int64)
        before = 1
        for matrix, shift, parts in zip(self.matrix, self.shift, self.parts, strict=True):
            along = places @ matrix + shift
            along -= np.floor(along)
            # rounding makes a whole period of what is just below 0
            numbers += before * np.minimum((along * parts).astype(np.int64), parts - 1)
            before *= parts
        return numbers

    def affine(self) -> FloatArray:
        """M and t beside one another, shape (3, 4)."""
        return np.column_stack([self.matrix, self.shift])


def _halves(vectors: FloatArray, space: Space) -> tuple[int, int, int]:
    """Two parts along each of three vectors, but for the one across a plane."""
    one, two, three = (2 if space.across is None or not v[space.across] else 1 for v in vectors)
    return one, two, three


@dataclass(frozen=True, eq=False)
class GapSums:
    """
    Sums over the gaps of replicate r, variant v (a, b, c, d), axis d, block b, at each cut-off c.

    Of the gaps not shorter than the cut-off; lengths in the dump's unit.
    """

    axes: FloatArray
    """Unit vectors, shape (R, D, 3)."""
    cutoffs: FloatArray
    """In ascending order, shape (C,)."""
    number: FloatArray
    """Number of gaps, shape (R, 4, D, B, C)."""
    length: FloatArray
    """Sum of their lengths, same shape."""
    square: FloatArray
    """Sum of their squared lengths, same shape."""

    def kept(
        self, variant: str, cutoff: int = 0, moment: int = 1, without: int | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """
        Numerator and denominator of ℓ for one variant and cut-off, shapes (R, D).

        Parameters
        ----------
        variant : str
            One of a, b, c, d.
        cutoff : int, optional
            Index in ``cutoffs``.
        moment : int, optional
            1: the mean length, Σ l / Σ 1; 2: ℓ² = Σ l² / Σ l.
        without : int, optional
            A block to leave out.
        """
        blocks = np.arange(self.number.shape[3]) != without
        which = "abcd".index(variant)
        over, under = (self.length, self.number) if moment == 1 else (self.square, self.length)
        return over[:, which, ..., cutoff] @ blocks, under[:, which, ..., cutoff] @ blocks


def scan_gaps(
    solids: Solids,
    rule: DirectionRule,
    *,
    spacing: float,
    cutoffs: Sequence[float],
    blocks: tuple[Blocks, Blocks],
    variants: str = "abcd",
    replicates: Iterable[int] = range(16),
    seed: int = 0,
    workers: int = 1,
    most_steps: float = MOST_STEPS,
) -> GapSums:
    """
    Scan as :func:`scanfab.scan_lines` does, with the same lines, and keep more.

    Parameters
    ----------
    solids, rule, spacing, variants, replicates, seed, workers, most_steps
        As for :func:`scanfab.scan_lines`.
    cutoffs : sequence of float
        In ascending order, dump's length unit.
    blocks : two Blocks
        Of the whole sample and of the window, in the coordinates of ``solids``; if one has fewer,
        nothing is in its last ones.

    Raises
    ------
    SettingsError
        If following lines through a periodic medium takes more steps than allowed.
    """
    following = Following(most_steps)
    triads, offsets = drawn_lines(rule, seed, replicates)
    least = np.maximum(np.array(cutoffs, dtype=np.float64), shortest_gap(solids))
    affine = np.array([one.affine() for one in blocks])
    parts = np.array([one.parts for one in blocks], dtype=np.float64)
    halves: Flag = True if np.all(parts == 2.0) else None
    count = max(len(one) for one in blocks)

    def some(triads: FloatArray, offsets: FloatArray) -> FloatArray:
        room = np.zeros((len(triads), 2, 2, count * len(least), 3))
        bins = Bins(affine, parts, halves, least, room)
        tally_triads(solids, triads, offsets, spacing, least[0], variants, bins, following)
        return bins.sums

    sums = in_parts(some, triads, offsets, workers)
    # variants: whole (a, b) and window (c, d)
    sums = sums.reshape(*offsets.shape[:2], 4, count, len(least), 3)
    sums[:, :, [variant not in variants for variant in "abcd"]] = 0.0
    # what reaches a cut-off reaches all below it
    sums = np.flip(np.cumsum(np.flip(sums, axis=4), axis=4), axis=4)
    number, length, square = np.moveaxis(np.swapaxes(sums, 1, 2), -1, 0)
    if solids.edge == ENDS:
        weighed = slice(None) if solids.medium is None else slice(2, None)
        # the third sum is the number of the kept, see kernels/bins
        length, square = length.copy(), square.copy()
        length[:, weighed] -= least * (square - number)[:, weighed]
        square[:, weighed] = np.nan
    return GapSums(triads[:, :, 2], least, number, length, square)
