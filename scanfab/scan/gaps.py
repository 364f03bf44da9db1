"""
The gap scan: all void segments, by the block of their middle and by cut-off.

Slower than :mod:`scanfab.scan.scan`, about twice where lines are far apart, and for what that
cannot tell: the sample's own scatter, maps, every cut-off in one pass, and higher moments of the
lengths.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.scan.blocks import Blocks, partition_of
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import ENDS
from scanfab.scan.kernels.strips import Bins
from scanfab.scan.kernels.sweep import TALLY_SIZE
from scanfab.scan.lines import drawn_lines
from scanfab.scan.scan import ScanSums, in_parts, sums_of
from scanfab.scan.solids import Solids, check_lines, shortest_gap
from scanfab.scan.tallies import MOST_STEPS, Following, tally_triads


@dataclass(frozen=True, eq=False)
class GapSums:
    """
    Sums over the gaps of replicate r, variant v, axis d and block b, at each cut-off c.

    A gap counts if it is not shorter than the cut-off. Lengths have the dump's unit.
    """

    axes: FloatArray
    """Unit vectors, shape (R, D, 3)."""
    weights: FloatArray
    """Weights of the direction rule, shape (D,)."""
    variants: str
    """The variants, in the order of the arrays."""
    number: FloatArray
    """Number of gaps, shape (R, V, D, B, C)."""
    length: FloatArray
    """Sum of their lengths, same shape."""
    square: FloatArray
    """Sum of their squared lengths, same shape."""
    scan: ScanSums
    """Other sums of the same lines: lines, chords, steps, and segments that are left out."""

    def in_blocks(
        self, variant: str, cutoff: int = 0, moment: int = 1
    ) -> tuple[FloatArray, FloatArray]:
        """
        Numerator and denominator of the mean length ℓ in each block, shapes (R, D, B).

        Parameters
        ----------
        variant : str
            One of ``variants``.
        cutoff : int, optional
            Number of the cut-off, in ascending order.
        moment : int, optional
            1: the mean length, Σ l / Σ 1; 2: ℓ² = Σ l² / Σ l.
        """
        which = self.variants.index(variant)
        over, under = (self.length, self.number) if moment == 1 else (self.square, self.length)
        return over[:, which, ..., cutoff], under[:, which, ..., cutoff]

    def kept(
        self, variant: str, cutoff: int = 0, moment: int = 1, without: int | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """
        Numerator and denominator of ℓ of all blocks together, shapes (R, D).

        Parameters
        ----------
        variant, cutoff, moment
            As for :meth:`in_blocks`.
        without : int, optional
            Number of a block to leave out.
        """
        blocks = np.arange(self.number.shape[3]) != without
        over, under = self.in_blocks(variant, cutoff, moment)
        return over @ blocks, under @ blocks


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
    Scan the lines of :func:`scanfab.scan_lines`, and sort gaps by block and cut-off.

    Parameters
    ----------
    solids, rule, spacing, variants, replicates, seed, workers, most_steps
        As for :func:`scanfab.scan_lines`.
    cutoffs : sequence of float
        Cut-offs in ascending order, dump's length unit.
    blocks : two Blocks
        Blocks of the whole sample and of the window, in the coordinates of ``solids``. If their
        numbers differ, the last sums of the smaller number are 0.

    Raises
    ------
    SettingsError
        If the spacing makes more lines than can be scanned in reasonable time, if following
        lines through a periodic medium takes more steps than allowed, or if the axes do not lie in
        the plane of the solids.
    """
    check_lines(solids, rule, spacing)
    triads, offsets = drawn_lines(rule, seed, replicates)
    least = np.maximum(np.array(cutoffs, dtype=np.float64), shortest_gap(solids))
    following = Following(most_steps)

    some = partial(
        _binned, solids,
        spacing=spacing, least=least, blocks=blocks, variants=variants, following=following,
    )  # fmt: skip
    found = in_parts(some, triads, offsets, workers)
    tallies = found[:, :, -2 * TALLY_SIZE :].reshape(*offsets.shape[:2], 2, TALLY_SIZE)
    sums = found[:, :, : -2 * TALLY_SIZE]
    sums = sums.reshape(*offsets.shape[:2], len(variants), -1, len(least), 3)
    number, length, square = np.moveaxis(np.swapaxes(sums, 1, 2), -1, 0)
    scan = sums_of(triads, tallies, variants, solids.edge)
    return GapSums(triads[:, :, 2], rule.weights, variants, number, length, square, scan)


def _binned(
    solids: Solids,
    triads: FloatArray,
    offsets: FloatArray,
    spacing: float,
    least: FloatArray,
    blocks: tuple[Blocks, Blocks],
    variants: str,
    following: Following,
) -> FloatArray:
    """
    Number, length and square of the variants along some axes, (A, V, B, C, 3), and the tallies.

    Both come in one array of the shape (A, ...), so that parts of a scan can be joined. ``least``
    holds the cut-offs.
    """
    # the same number of blocks for the whole and for the window
    axes, kept = len(triads), max(map(len, blocks))
    bins = Bins(partition_of(*blocks), least, np.zeros((axes, 2, 2, kept * len(least), 3)))
    tallies = tally_triads(solids, triads, offsets, spacing, least[0], variants, bins, following)
    rows = ["abcd".index(variant) for variant in variants]
    sums = bins.sums.reshape(axes, 4, kept, len(least), 3)[:, rows]
    if len(least) > 1:
        # a gap that reaches a cut-off reaches all smaller ones
        sums = np.flip(np.cumsum(np.flip(sums, axis=3), axis=3), axis=3)
    if solids.edge == ENDS:
        number, length, square = np.moveaxis(sums, -1, 0)
        weighed = [solids.medium is None or variant in "cd" for variant in variants]
        # the third sum is the number of kept gaps, see kernels/bins
        length[:, weighed] -= least * (square - number)[:, weighed]
        square[:, weighed] = np.nan
    return np.concatenate([sums.reshape(axes, -1), tallies.reshape(axes, -1)], axis=1)
