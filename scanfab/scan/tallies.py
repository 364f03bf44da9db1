"""What some axes of a scan add up: the passes over whole and window, by the rule at its surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import Flag
from scanfab.base.typing import FloatArray
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.following import MOST_STEPS, Following
from scanfab.scan.kernels import sweep
from scanfab.scan.kernels.axes import scan_axes, scan_cell
from scanfab.scan.kernels.bins import OF_WHOLE, OF_WINDOW, Bins, no_bins
from scanfab.scan.kernels.cells import Cells
from scanfab.scan.kernels.edges import CLIPPED, WEIGHED
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.kernels.strips import Edge
from scanfab.scan.solids import Inner, Solids, clip_of, shortest_gap

# of the spacing and for each variant: spheres of such a radius are scanned as fast row by row as
# over lists of chords; for the more variants the lists serve, the sooner they pay
FEW_LINES = 0.5
# of the margin beyond a window: in lists each chord takes longer, so that more is followed alone
NARROW = 0.3


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
    tallies = np.zeros((len(triads), 2, sweep.TALLY_SIZE))
    cutoff = max(cutoff, shortest_gap(solids))
    bins = no_bins(len(triads)) if bins is None else bins
    following = Following(MOST_STEPS) if following is None else following
    both: Flag = True if first and second else None
    lines = _Lines(solids, triads, offsets, spacing, cutoff, first, both)
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
    if solids.edge == CLIP:
        if whole or window:
            lines.scan(True if whole else None, CLIPPED if window else None, tallies, bins)
    else:
        if whole:
            lines.scan_whole(tallies, bins)
        if window:
            lines.scan_window(tallies, bins, following)
    if first:
        return tallies
    bins.sums[:] = bins.sums[:, :, ::-1].copy()
    return tallies[:, ::-1]


class _Lines(NamedTuple):
    """The lines of some axes through the listed solids."""

    solids: Solids
    triads: FloatArray
    offsets: FloatArray
    spacing: float
    cutoff: float
    first: bool
    """Whether the first set of solids has all of them; else it is that of b and d."""
    both: Flag

    def scan(
        self,
        whole: Flag,
        window: Edge | None,
        tallies: FloatArray,
        bins: Bins,
        *,
        inner: Inner | None = None,
        cells: Cells | None = None,
        most_steps: float = np.inf,
    ) -> None:
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
        passes = (1 + (self.both is not None)) * ((whole is not None) + (window is not None))
        scan_axes(
            np.ascontiguousarray(position[solid]),
            radius[solid],
            removed[solid],
            np.ascontiguousarray(self.triads),
            self.offsets,
            self.spacing,
            self.cutoff,
            clip_of(shape),
            tallies,
            _few_lines(radius[solid], self.spacing, passes),
            self.both,
            whole,
            window,
            bins,
            cells,
            not self.first,
            most_steps,
        )

    def scan_whole(self, tallies: FloatArray, bins: Bins) -> None:
        """The whole of an open sample: up to its outermost solids, or in a window of its own."""
        if self.solids.edge != ENDS:
            self.scan(True, None, tallies, bins)
            return
        inner = self.solids.inner
        if inner is None:
            return
        found, room = np.zeros_like(tallies), bins.of_whole(inner.center)
        self.scan(None, WEIGHED, found, room, inner=inner)
        tallies[..., sweep.WHOLE : sweep.WINDOW] += found[..., sweep.WINDOW : sweep.CHORDS]
        tallies[..., sweep.CHORDS] += found[..., sweep.CHORDS]
        bins.sums[:, OF_WHOLE] += room.sums[:, OF_WINDOW]

    def scan_window(self, tallies: FloatArray, bins: Bins, following: Following) -> None:
        """The window, by a rule that knows what is cut."""
        solids = self.solids
        cells = solids.cells if solids.edge == START and len(solids.grain_radius) else None
        margin = solids.margin
        if bins.cutoffs.size or _few_lines(solids.radius, self.spacing, 1 + bool(self.both)):
            # but for the cut-off: segments that reach it are known to count
            margin = min(margin, max(NARROW * margin, 1.01 * self.cutoff))
        edge = WEIGHED if cells is None else Edge(None, True, margin, None)
        if solids.edge == START and cells is None:
            return
        before = float(tallies[:, 0, sweep.STEPS].sum())
        self.scan(None, edge, tallies, bins, cells=cells, most_steps=following.left)
        following.add(float(tallies[:, 0, sweep.STEPS].sum()) - before)


def _few_lines(radius: FloatArray, spacing: float, variants: int) -> bool:
    """Whether most chords are of spheres that meet but few lines."""
    return bool(np.sum(radius**2) < FEW_LINES * variants * spacing * np.sum(radius))


def _without_removed(medium: CellGrains) -> CellGrains:
    solid = ~medium.removed
    return medium._replace(
        position=medium.position[solid], radius=medium.radius[solid], removed=medium.removed[solid]
    )
