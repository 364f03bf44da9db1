"""What some axes of a scan add up: the passes over whole and window, by the rule at its surface."""

from __future__ import annotations

import threading
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.jit import Flag
from scanfab.base.typing import FloatArray
from scanfab.scan.edges import CLIP, ENDS
from scanfab.scan.kernels import sweep
from scanfab.scan.kernels.axes import Axes, Followed, scan_axes, scan_cell
from scanfab.scan.kernels.bins import OF_WHOLE, OF_WINDOW, Bins, no_bins
from scanfab.scan.kernels.strips import Counts, Edge
from scanfab.scan.solids import Inner, Solids, clip_of, shortest_gap

# of the spacing and for each variant: spheres of such a radius are scanned as fast row by row as
# over lists of chords; for the more variants the lists serve, the sooner they pay
FEW_LINES = 0.5
# of the margin beyond a window: in lists each chord takes longer, so that more is followed alone
NARROW = 0.3
# a gap of no length at all never counts
SMALLEST = 5e-324
# what counts at the window's surface by the rules that follow no segment
CLIPPED, WEIGHED = Edge(None, None, 0.0), Edge(True, None, 0.0)
# steps of following lines through a periodic medium: more take minutes
MOST_STEPS = 1e10


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
        self.check(self._taken)

    def __reduce__(self) -> tuple[type, tuple[float]]:
        # another process counts its own; whoever adds up all parts checks their sum
        return Following, (self.most,)

    def check(self, taken: float) -> None:
        """FollowedTooFarError if so many steps are too many."""
        if taken >= self.most:
            raise FollowedTooFarError(
                f"void segments that leave the cell are long: following them through its images "
                f"takes more than {self.most:.2g} steps. Much of the cell is empty, or a variant "
                f"keeps few grains: check the cell's size (`cell`) and its periodic axes "
                f"(`periodic`), choose a wider `spacing` or other `variants`, or allow more "
                f"(`max_chords`)"
            )


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
    Scan along given line triads (D, 3, 3) with given shifts (D, 2), or (D, 1) in a plane.

    Returns the tallies of each axis and set of solids, shape (D, 2, TALLY_SIZE); where there are
    bins, the gaps go there instead. ``following`` counts the steps of this and of other parts.

    Raises
    ------
    FollowedTooFarError
        If these are too many.
    """
    first, second = ("a" in variants or "c" in variants), ("b" in variants or "d" in variants)
    whole, window = ("a" in variants or "b" in variants), ("c" in variants or "d" in variants)
    lines = _Lines(
        solids,
        Axes(np.ascontiguousarray(triads), offsets, spacing),
        max(cutoff, shortest_gap(solids), SMALLEST),
        first,
        True if first and second else None,
        no_bins(len(triads)) if bins is None else bins,
        Following(MOST_STEPS) if following is None else following,
        np.zeros((len(triads), 2, sweep.TALLY_SIZE)),
    )
    if solids.medium is not None and whole:
        lines.scan_cell()
        whole = False
    if solids.edge == CLIP and (whole or window):
        lines.scan(True if whole else None, CLIPPED if window else None)
    if solids.edge != CLIP and whole:
        lines.scan_whole()
    if solids.edge != CLIP and window:
        lines.scan_window()
    if first:
        return lines.tallies
    # without a or c, the solids of b and d are the only ones
    if bins is not None:
        bins.sums[:] = bins.sums[:, :, ::-1].copy()
    return lines.tallies[:, ::-1]


class _Lines(NamedTuple):
    """The lines of some axes through the solids, and what they add up."""

    solids: Solids
    axes: Axes
    cutoff: float
    first: bool
    """Whether the first set of solids has all of them; else it is that of b and d."""
    both: Flag
    bins: Bins
    following: Following
    tallies: FloatArray

    def by_lists(self, radius: FloatArray, variants: int) -> bool:
        """Whether to list chords: for bins, or as most are of spheres that meet but few lines."""
        few = np.sum(radius**2) < FEW_LINES * variants * self.axes.spacing * np.sum(radius)
        return bool(few) or self.bins.cutoffs.size > 0

    def scan_cell(self) -> None:
        """The whole of a periodic packing, which has no edge."""
        solids = self.solids
        assert solids.medium is not None
        medium = solids.medium
        if not self.first:
            solid = ~medium.removed
            medium = medium._replace(
                position=medium.position[solid],
                radius=medium.radius[solid],
                removed=medium.removed[solid],
            )
        if not len(medium.radius):
            return
        counts = Counts(self.cutoff, self.both, True, None, None)
        by_lists = self.by_lists(medium.radius, 1 + bool(self.both))
        followed = Followed(solids.medium_cells, not self.first, self.following.left)
        scan_cell(medium, self.axes, counts, by_lists, self.bins, followed, self.tallies)
        self.following.add(float(self.tallies[:, 0, sweep.STEPS].sum()))

    def scan(self, whole: Flag, window: Edge | None, inner: Inner | None = None) -> None:
        """One pass of the sweep; ``inner`` takes the place of the window."""
        solids = self.solids
        position, radius, removed = solids.position, solids.radius, solids.removed
        shape = solids.window
        # a mask of all would copy
        solid = slice(None) if self.first else ~removed
        if inner is not None:
            position, shape = position - inner.center, inner.shape
            solid = solids.near_inner & (self.first | ~removed)
        elif window is not None and solids.edge != CLIP:
            solid = solids.near_window(window.margin) & (self.first | ~removed)
        passes = (1 + bool(self.both)) * ((whole is not None) + (window is not None))
        followed, before = None, float(self.tallies[:, 0, sweep.STEPS].sum())
        if window is not None and window.start is not None:
            followed = Followed(solids.cells, not self.first, self.following.left)
        position, radius = np.ascontiguousarray(position[solid]), radius[solid]
        scan_axes(
            position,
            radius,
            removed[solid],
            solids.bounds if self.first else solids.bounds_left,
            self.axes,
            clip_of(shape),
            Counts(self.cutoff, self.both, whole, window, None),
            self.by_lists(radius, passes),
            self.bins,
            followed,
            self.tallies,
        )
        self.following.add(float(self.tallies[:, 0, sweep.STEPS].sum()) - before)

    def scan_whole(self) -> None:
        """The whole of an open sample: up to its outermost solids, or in a window of its own."""
        inner = self.solids.inner
        if self.solids.edge != ENDS:
            self.scan(True, None)
        elif inner is not None:
            bins = self.bins.of_whole(inner.center)
            inside = self._replace(tallies=np.zeros_like(self.tallies), bins=bins)
            inside.scan(None, WEIGHED, inner)
            found = inside.tallies
            self.tallies[..., sweep.WHOLE : sweep.WINDOW] += found[..., sweep.WINDOW : sweep.CHORDS]
            self.tallies[..., sweep.CHORDS] += found[..., sweep.CHORDS]
            self.bins.sums[:, OF_WHOLE] += bins.sums[:, OF_WINDOW]

    def scan_window(self) -> None:
        """The window, by a rule that knows what is cut."""
        solids = self.solids
        if solids.edge == ENDS:
            self.scan(None, WEIGHED)
        elif len(solids.grain_radius):
            margin = solids.margin
            if self.by_lists(solids.radius, 1 + bool(self.both)):
                # but for the cut-off: segments that reach it are known to count
                margin = min(margin, max(NARROW * margin, 1.01 * self.cutoff))
            self.scan(None, Edge(None, True, margin))
