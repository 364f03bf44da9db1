"""
The scan: lines in many directions through a packing, as sums by replicate and axis.

:func:`scan_lines` sums all void segments. :func:`scan_gaps` also sorts them, by the block of their
middle and by cut-off, which takes about twice as long where lines are far apart. It serves what
other sums cannot tell: the sample's own scatter, maps, every cut-off in one pass, and higher
moments of the lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.blocks import Blocks, partition_of
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import CLIP, ENDS
from scanfab.scan.kernels import sweep
from scanfab.scan.kernels.strips import Bins
from scanfab.scan.lines import drawn_lines
from scanfab.scan.solids import Solids, check_lines, shortest_gap
from scanfab.scan.tallies import MOST_STEPS, Following, tally_triads

JOBS_A_THREAD, MOST_AXES = 4, 16


@dataclass(frozen=True, eq=False)
class ScanSums:
    """
    The sums of a scan for replicate r, variant v (a, b, c, d) and axis d.

    A segment that is not shorter than the cut-off is kept, and counts in ``length`` and
    ``segments``. All segments count in ``void``. Lengths have the dump's unit.

    Attributes
    ----------
    axes : ndarray
        Unit vectors, shape (R, D, 3).
    length : ndarray
        Sum of the lengths of the kept segments, shape (R, 4, D).
    segments : ndarray
        Number of the kept segments, shape (R, 4, D). By the rules ``start`` and ``ends`` it is half
        the number of their ends in the window; ``length`` is then weighted as well, so that the
        ratio of the two is the mean length.
    lines : ndarray of int
        Number of lines that meet the window (for the whole: any solid), shape (R, 4, D).
    void : ndarray
        Length of all void in the window, kept or not, shape (R, 4, D). For a periodic whole it is
        the void in the measured length of its lines; for an open whole it is 0.
    line_length : ndarray
        Length of the lines in the window, shape (R, 4, D). For a periodic whole it is the measured
        length of its lines; for an open whole it is 0.
    chords : ndarray of int
        Number of chords that all spheres cut from the lines, shape (R,). For spheres that few lines
        meet, this may be the expected number, not the counted one.
    channels : ndarray of int
        Number of lines of a periodic whole that never meet a grain, shape (R, 4, D).
    steps : ndarray of int
        Number of steps of following lines through a periodic medium where solids are not listed,
        shape (R,). A line takes a step for each cell that it crosses and each grain in the cell; a
        step costs about as much as a chord.
    left_out : ndarray
        Number of segments that are not counted because they leave the sample, shape (R, 4, D). By
        the rule ``start`` each counts half the number of its ends in the window; otherwise it is 0.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import Solids, direction_rule, scan_lines, sphere
    >>> solids = Solids(np.zeros((1, 3)), np.ones(1), np.zeros(1, bool), window=sphere(2.0))
    >>> sums = scan_lines(solids, direction_rule("3"), spacing=0.5, cutoff=0.0, variants="c")
    >>> sums.segments.shape, bool((sums.length <= sums.void).all())
    ((16, 4, 3), True)
    """

    axes: FloatArray
    length: FloatArray
    segments: FloatArray | IntArray
    lines: IntArray
    void: FloatArray
    line_length: FloatArray
    chords: IntArray
    channels: IntArray
    steps: IntArray
    left_out: FloatArray

    def __repr__(self) -> str:
        sums = zip("abcd", self.segments.sum((0, 2)), self.lines.sum((0, 2)), strict=True)
        told = [
            f"{name} {kept:g} on {counted(lines, 'line')}" for name, kept, lines in sums if lines
        ]
        axes = counted(self.axes.shape[1], "axis", "axes")
        head = f"ScanSums: {counted(self.replicates, 'replicate')} of {axes}"
        return f"{head}; segments kept: {', '.join(told) or 'none'}"

    @property
    def work(self) -> IntArray:
        """Chords and steps, which take most of the time, shape (R,)."""
        return self.chords + self.steps

    @property
    def replicates(self) -> int:
        """Number of replicates R."""
        return len(self.axes)

    def kept(self, variant: str) -> tuple[FloatArray, FloatArray | IntArray]:
        """
        The sums of the kept segments of one variant, as :func:`scanfab.void_fabric` takes them.

        Parameters
        ----------
        variant : str
            One of a, b, c, d.

        Returns
        -------
        length : ndarray, shape (R, D)
            Sum of the lengths of the kept segments, dump's length unit.
        segments : ndarray, shape (R, D)
            Number of the kept segments.
        """
        which = "abcd".index(variant)
        return self.length[:, which], self.segments[:, which]


def scan_lines(
    solids: Solids,
    rule: DirectionRule,
    *,
    spacing: float,
    cutoff: float,
    variants: str = "abcd",
    replicates: Iterable[int] = range(16),
    seed: int = 0,
    workers: int = 1,
    most_steps: float = MOST_STEPS,
) -> ScanSums:
    """
    Scan with one square grid of lines for each axis and replicate (in a plane, one row of lines).

    In each replicate the rule is turned at random, and the grid of each axis is shifted at random.
    The random numbers depend only on the seed and on the replicate's number.

    Parameters
    ----------
    solids : Solids
        The spheres and the window that the lines meet.
    rule : DirectionRule
        The axes of the lines.
    spacing : float
        Distance between neighbouring lines of one axis and replicate, dump's length unit.
    cutoff : float
        Segments shorter than this are not kept, dump's length unit. Segments shorter than 1e-9 of
        the smallest radius are never kept: they are rounding between surfaces that coincide.
    variants : str, optional
        Letters out of abcd; the sums of the other variants are 0.
    replicates : iterable of int, optional
        Numbers of the replicates.
    seed, workers : int, optional
        Seed of the random numbers; threads to use. The result does not depend on the threads.
    most_steps : float, optional
        Most steps of following lines through a periodic medium, see :attr:`ScanSums.steps`.

    Returns
    -------
    ScanSums
        Lengths and numbers of the segments of each replicate, variant and axis.

    Raises
    ------
    SettingsError
        If the spacing makes more lines than can be scanned in reasonable time, if following lines
        takes more steps than allowed, or if the axes do not lie in the plane of the solids.

    Examples
    --------
    In a window of radius R, one sphere of radius r leaves void segments of the mean length
    (4/3) (R³ - r³) / (R² + r²), here 1.87:

    >>> import numpy as np
    >>> from scanfab import Solids, direction_rule, scan_lines, sphere
    >>> solids = Solids(np.zeros((1, 3)), np.ones(1), np.zeros(1, bool), window=sphere(2.0))
    >>> sums = scan_lines(solids, direction_rule("lebedev:5"), spacing=0.05, cutoff=0.0)
    >>> length, segments = sums.kept("c")
    >>> round(float(length.sum() / segments.sum()), 2)
    1.87
    """
    check_lines(solids, rule, spacing)
    triads, offsets = drawn_lines(rule, seed, replicates)

    some = partial(
        tally_triads, solids,
        spacing=spacing, cutoff=cutoff, variants=variants, following=Following(most_steps),
    )  # fmt: skip
    return sums_of(triads, in_parts(some, triads, offsets, workers), variants, solids.edge)


def in_parts(
    scan: Callable[[FloatArray, FloatArray], FloatArray],
    triads: FloatArray,
    offsets: FloatArray,
    workers: int,
) -> FloatArray:
    """
    Scan along the axes of all replicates, in jobs of a few axes that threads share.

    ``scan`` takes the triads and shifts of some axes, shapes (A, 3, 3) and (A, 2) or (A, 1), and
    returns its sums for each axis, shape (A, ...). The result has the shape (R, D, ...).
    """
    count = offsets.shape[0] * offsets.shape[1]
    triads, shifts = triads.reshape(count, 3, 3), offsets.reshape(count, -1)
    # enough jobs to keep all threads busy to the end; more would only add overhead
    axes = min(max(count // (JOBS_A_THREAD * workers), 1), MOST_AXES)
    parts = [slice(first, first + axes) for first in range(0, count, axes)]

    lines = [triads[part] for part in parts], [shifts[part] for part in parts]
    if workers == 1 or len(parts) == 1:
        found = list(map(scan, *lines))
    else:
        with ThreadPoolExecutor(workers) as pool:
            found = list(pool.map(scan, *lines))
    sums = np.concatenate(found)
    return sums.reshape(*offsets.shape[:2], *sums.shape[1:])


def sums_of(triads: FloatArray, tallies: FloatArray, variants: str, edge: str = CLIP) -> ScanSums:
    """Make the sums of replicates from line triads and tallies, shape (R, D, 2, TALLY_SIZE)."""
    wanted = np.array([variant in variants for variant in "abcd"])[:, None]
    # whole or window, set of solids: the axes of a variant; before them the sum and the replicate
    both = tallies[..., : sweep.CHORDS].reshape(*tallies.shape[:3], 2, -1).transpose(4, 0, 3, 2, 1)
    variant = np.where(wanted, both.reshape(*both.shape[:2], 4, -1), 0.0)
    length, kept, void, lines, line_length, astray = variant
    in_window = np.array([[False], [False], [True], [True]])
    return ScanSums(
        axes=triads[:, :, 2],
        length=length,
        segments=kept.astype(np.int64) if edge == CLIP else kept,
        lines=lines.astype(np.int64),
        void=void,
        line_length=line_length,
        chords=tallies[..., sweep.CHORDS].sum(axis=(1, 2)).astype(np.int64),
        channels=(astray * ~in_window).astype(np.int64),
        steps=tallies[..., sweep.STEPS].sum(axis=(1, 2)).astype(np.int64),
        left_out=astray * in_window,
    )


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
    Scan the lines of :func:`scan_lines`, and sort gaps by block and cut-off.

    Parameters
    ----------
    solids, rule, spacing, variants, replicates, seed, workers, most_steps
        As for :func:`scan_lines`.
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

    some = partial(
        _binned, solids,
        spacing=spacing, least=least, blocks=blocks, variants=variants,
        following=Following(most_steps),
    )  # fmt: skip
    found = in_parts(some, triads, offsets, workers)
    tallies = found[:, :, -2 * sweep.TALLY_SIZE :].reshape(*offsets.shape[:2], 2, sweep.TALLY_SIZE)
    sums = found[:, :, : -2 * sweep.TALLY_SIZE]
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
