"""The scan: lines in many directions through a packing, as sums by replicate and axis."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.jit import Flag
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.directions import DirectionRule
from scanfab.scan.kernels import sweep
from scanfab.scan.kernels.axes import scan_axes, scan_cell
from scanfab.scan.kernels.bins import Bins, no_bins
from scanfab.scan.lines import drawn_lines
from scanfab.scan.solids import CellGrains, Solids, check_spacing, clip_of, shortest_gap

__all__ = [
    "MOST_STEPS",
    "FollowedTooFarError",
    "Following",
    "ScanSums",
    "in_parts",
    "scan_lines",
    "sums_of",
    "tally_triads",
]


JOBS_A_THREAD, MOST_AXES = 4, 16
# steps of following lines through a periodic medium: more take minutes
MOST_STEPS = 1e10
# of the spacing and for each variant: spheres of such a radius are scanned as fast row by row as
# over lists of chords; for the more variants the lists serve, the sooner they pay
FEW_LINES = 0.5


@dataclass(frozen=True, eq=False)
class ScanSums:
    """
    What a scan adds up, for replicate r, variant v (a, b, c, d) and axis d.

    A segment counts in ``length`` and ``segments`` if it is kept, that is not shorter than the
    cut-off; ``void`` is the length of all. Lengths in the dump's unit.

    Attributes
    ----------
    axes : ndarray
        Unit vectors, shape (R, D, 3).
    length : ndarray
        Sum of the lengths of the kept segments, shape (R, 4, D).
    segments : ndarray of int
        Number of the kept segments, shape (R, 4, D).
    lines : ndarray of int
        Lines that meet the window (for the whole: any solid), shape (R, 4, D).
    void : ndarray
        Length of all void in the window, kept or not, shape (R, 4, D). For a periodic whole that in
        the measured length of its lines; 0 for an open one.
    line_length : ndarray
        Length of the lines in the window, shape (R, 4, D); for the whole likewise.
    chords : ndarray of int
        Chords that all spheres together cut from the lines, shape (R,); of spheres that few lines
        meet, at times as many as are to be expected.
    channels : ndarray of int
        Lines of the whole that meet no grain however far they go, shape (R, 4, D).
    steps : ndarray of int
        Steps of following lines through a periodic medium, beyond what is listed of it, shape (R,).
        A line makes one for each grain of each cell that it crosses; a step costs about as much as
        a chord.

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
    segments: IntArray
    lines: IntArray
    void: FloatArray
    line_length: FloatArray
    chords: IntArray
    channels: IntArray
    steps: IntArray

    def __repr__(self) -> str:
        sums = zip("abcd", self.segments.sum((0, 2)), self.lines.sum((0, 2)), strict=True)
        told = [f"{name} {kept} on {counted(lines, 'line')}" for name, kept, lines in sums if lines]
        axes = counted(self.axes.shape[1], "axis", "axes")
        head = f"ScanSums: {counted(self.replicates, 'replicate')} of {axes}"
        return f"{head}; segments kept: {', '.join(told) or 'none'}"

    @property
    def work(self) -> IntArray:
        """What takes time beside the lines themselves: chords and steps, shape (R,)."""
        return self.chords + self.steps

    @property
    def replicates(self) -> int:
        """Number of replicates R."""
        return len(self.axes)

    def kept(self, variant: str) -> tuple[FloatArray, IntArray]:
        """
        What is kept of one variant, as :func:`scanfab.void_fabric` takes it.

        Parameters
        ----------
        variant : str
            One of a, b, c, d.

        Returns
        -------
        length : ndarray, shape (R, D)
            Sum of the lengths of the kept segments, dump's length unit.
        segments : ndarray of int, shape (R, D)
            Number of the kept segments.
        """
        which = "abcd".index(variant)
        return self.length[:, which], self.segments[:, which]

    @classmethod
    def concatenate(cls, parts: Iterable[ScanSums]) -> ScanSums:
        """
        All replicates of several scans.

        Parameters
        ----------
        parts : iterable of ScanSums
            Along as many axes each.

        Returns
        -------
        ScanSums
        """
        parts = list(parts)
        return cls(
            *(
                np.concatenate([getattr(part, field.name) for part in parts])
                for field in fields(cls)
            )
        )


class FollowedTooFarError(SettingsError):
    """To follow the lines of a scan through a periodic medium takes more steps than allowed."""


class Following:
    """
    The steps that following the lines of a scan has taken, of all its threads together.

    Whether they are too many does not depend on the threads: no part of a scan takes any back.
    """

    def __init__(self, most: float) -> None:
        self.most = most
        self._taken = 0.0
        self._lock = threading.Lock()

    @property
    def left(self) -> float:
        """How many more are allowed."""
        return self.most - self._taken

    def add(self, steps: float) -> None:
        """
        Count the steps of a part of the scan.

        Raises
        ------
        FollowedTooFarError
            If they are too many.
        """
        with self._lock:
            self._taken += steps
        if self._taken >= self.most:
            raise FollowedTooFarError(
                f"void segments that leave the cell are long: following them through its images "
                f"takes more than {self.most:.2g} steps. Much of the cell is empty, or a variant "
                f"keeps few grains: check the cell's size (`cell`) and its periodic axes "
                f"(`periodic`), choose a wider `spacing` or other `variants`, or allow more "
                f"(`max_chords`)"
            )


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
    Scan with one square grid of lines for each axis and replicate.

    In each replicate the rule is turned at random and the grid of every axis is shifted at random.
    The random numbers depend on the seed and the replicate's number alone.

    Parameters
    ----------
    solids : Solids
        What the lines meet.
    rule : DirectionRule
        The axes.
    spacing : float
        Distance between neighbouring lines of one axis and replicate, dump's length unit.
    cutoff : float
        Segments shorter than this are not kept, dump's length unit; nor, at 0, are those below 1e-9
        of the smallest radius, which rounding makes between surfaces that coincide.
    variants : str, optional
        Which of a, b, c, d to scan; the sums of the others are 0.
    replicates : iterable of int, optional
        Numbers of the replicates.
    seed, workers : int, optional
        Seed of the random numbers; threads to use. The result does not depend on the threads.
    most_steps : float, optional
        Of following lines through a periodic medium, see :attr:`ScanSums.steps`.

    Returns
    -------
    ScanSums
        Lengths and numbers of the segments of each replicate, variant and axis.

    Raises
    ------
    SettingsError
        If the spacing asks for more lines than can be scanned in reasonable time, or following
        lines takes more steps than allowed.

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
    check_spacing(solids, spacing)
    triads, offsets = drawn_lines(rule, seed, replicates)
    following = Following(most_steps)

    def some(triads: FloatArray, offsets: FloatArray) -> FloatArray:
        return tally_triads(solids, triads, offsets, spacing, cutoff, variants, following=following)

    return sums_of(triads, in_parts(some, triads, offsets, workers), variants)


def in_parts(
    scan: Callable[[FloatArray, FloatArray], FloatArray],
    triads: FloatArray,
    offsets: FloatArray,
    workers: int,
) -> FloatArray:
    """
    Scan along the axes of all replicates, a few in each job of several threads.

    ``scan`` takes the triads and shifts of some axes, (A, 3, 3) and (A, 2), and returns what it
    adds up for each, (A, ...); the result has the shape (R, D, ...).
    """
    count = offsets.shape[0] * offsets.shape[1]
    triads, shifts = triads.reshape(count, 3, 3), offsets.reshape(count, 2)
    # so many that no thread waits long for the last one, but not many more
    axes = min(max(count // (JOBS_A_THREAD * workers), 1), MOST_AXES)
    parts = [slice(first, first + axes) for first in range(0, count, axes)]

    def one(part: slice) -> FloatArray:
        return scan(triads[part], shifts[part])

    if workers == 1 or len(parts) == 1:
        sums = np.concatenate([one(part) for part in parts])
    else:
        with ThreadPoolExecutor(workers) as pool:
            sums = np.concatenate(list(pool.map(one, parts)))
    return sums.reshape(*offsets.shape[:2], *sums.shape[1:])


def tally_triads(
    solids: Solids,
    triads: FloatArray,
    offsets: FloatArray,
    spacing: float,
    cutoff: float,
    variants: str,
    bins: Bins | None = None,
    following: Following | None = None,
) -> FloatArray:
    """
    Scan along given line triads (D, 3, 3) with given shifts (D, 2).

    Returns the tallies of each axis and set of solids, shape (D, 2, TALLY_SIZE); where there are
    bins, the gaps go there instead. ``following`` counts the steps of this and of other parts.

    Raises
    ------
    FollowedTooFarError
        If these are too many.
    """
    first, second = ("a" in variants or "c" in variants), ("b" in variants or "d" in variants)
    whole, window = ("a" in variants or "b" in variants), ("c" in variants or "d" in variants)
    tallies = np.zeros((len(triads), 2, sweep.TALLY_SIZE))
    cutoff = max(cutoff, shortest_gap(solids))
    bins = no_bins(len(triads)) if bins is None else bins
    following = Following(MOST_STEPS) if following is None else following
    both: Flag = True if first and second else None
    if solids.medium is not None and whole:
        # without a or c, the solids of b and d are the only ones
        medium = solids.medium if first else _without_removed(solids.medium)
        if len(medium.radius):
            axes = np.ascontiguousarray(triads[:, 2])
            by_lists = _few_lines(medium.radius, spacing, 1 + (both is not None))
            scan_cell(
                medium, axes, offsets, spacing, cutoff, clip_of(None), tallies,
                by_lists, both, bins, following.left,
            )  # fmt: skip
            following.add(float(tallies[:, 0, sweep.STEPS].sum()))
        whole = False
    if whole or window:
        solid = slice(None) if first else ~solids.removed
        scan_axes(
            np.ascontiguousarray(solids.position[solid]),
            solids.radius[solid],
            solids.removed[solid],
            np.ascontiguousarray(triads),
            offsets,
            spacing,
            cutoff,
            clip_of(solids.window),
            tallies,
            _few_lines(solids.radius[solid], spacing, (1 + (both is not None)) * (whole + window)),
            both,
            True if whole else None,
            True if window else None,
            bins,
        )
    if first:
        return tallies
    bins.sums[:] = bins.sums[:, :, ::-1].copy()
    return tallies[:, ::-1]


def _few_lines(radius: FloatArray, spacing: float, variants: int) -> bool:
    """Whether most chords are of spheres that meet but few lines."""
    return bool(np.sum(radius**2) < FEW_LINES * variants * spacing * np.sum(radius))


def _without_removed(medium: CellGrains) -> CellGrains:
    solid = ~medium.removed
    return medium._replace(
        position=medium.position[solid], radius=medium.radius[solid], removed=medium.removed[solid]
    )


def sums_of(triads: FloatArray, tallies: FloatArray, variants: str) -> ScanSums:
    """The sums of replicates from their line triads and tallies, shape (R, D, 2, TALLY_SIZE)."""
    wanted = np.array([variant in variants for variant in "abcd"])[:, None]
    # replicate, set of solids, axis
    entries = np.moveaxis(tallies, (3, 2), (0, 2))

    def of(whole: int, window: int | None = None) -> FloatArray:
        second = 0.0 * entries[0] if window is None else entries[window]
        return np.where(wanted, np.concatenate([entries[whole], second], axis=1), 0.0)

    def both(number: int) -> FloatArray:
        return of(sweep.WHOLE + number, sweep.WINDOW + number)

    return ScanSums(
        axes=triads[:, :, 2],
        length=both(sweep.LENGTH),
        segments=both(sweep.KEPT).astype(np.int64),
        lines=both(sweep.LINES).astype(np.int64),
        void=both(sweep.VOID),
        line_length=both(sweep.LINE_LENGTH),
        chords=entries[sweep.CHORDS].sum(axis=(1, 2)).astype(np.int64),
        channels=of(sweep.CHANNELS).astype(np.int64),
        steps=entries[sweep.STEPS].sum(axis=(1, 2)).astype(np.int64),
    )
