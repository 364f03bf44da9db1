"""The sums of some axes of a scan: passes over whole and window, by the edge rule."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.errors import SettingsError
from scanfab.base.jit import Flag
from scanfab.base.typing import FloatArray
from scanfab.scan.edges import CLIP, ENDS
from scanfab.scan.kernels import sweep
from scanfab.scan.kernels.axes import Axes, scan_axes
from scanfab.scan.kernels.bins import OF_WHOLE, OF_WINDOW, no_bins
from scanfab.scan.kernels.cells import Beyond
from scanfab.scan.kernels.grid import CellGrains
from scanfab.scan.kernels.periodic import prism_along
from scanfab.scan.kernels.strips import Bins, Counts, Edge, section_along
from scanfab.scan.solids import Solids, margin_of, shortest_gap

# Spheres whose radius is this fraction of the spacing, for each variant, are scanned as fast row by
# row as over lists of chords. Lists pay off sooner if they serve more variants.
FEW_LINES = 0.5
# Fraction of the margin beyond a window: a chord in a list takes longer, so that it pays to list
# fewer solids and to follow more segments.
NARROW = 0.3
# a gap without length never counts
SMALLEST = 5e-324
# vectors and periods of an open sample
NO_CELL = np.zeros((0, 3)), np.zeros(0, bool)
# edge rules that follow no segment: clip and ends
CLIPPED, WEIGHED = Edge(None, None, 0.0), Edge(True, None, 0.0)
# most steps of following lines through a periodic medium: more would take minutes
MOST_STEPS = 1e10


class FollowedTooFarError(SettingsError):
    """Following the lines of a scan through a periodic medium takes more steps than allowed."""


@dataclass
class Following:
    """
    The steps that a scan has taken to follow lines, in all its threads together.

    Whether they are too many does not depend on the threads, because steps are only ever added.
    """

    most: float
    taken: list[float] = field(default_factory=list)
    """Steps of each part of the scan; threads may append to a list without a lock."""

    @property
    def left(self) -> float:
        """Number of further steps that are allowed."""
        return self.most - sum(self.taken, 0.0)

    def add(self, steps: float) -> None:
        """
        Count the steps of a part of the scan.

        Raises
        ------
        FollowedTooFarError
            If the scan has taken too many steps.
        """
        self.taken.append(steps)
        if self.left <= 0.0:
            raise FollowedTooFarError(
                f"void segments that leave the cell are long: following them through its images "
                f"takes more than {self.most:.2g} steps. Much of the cell is empty, or a variant "
                f"keeps few grains: check the cell's size (`cell`) and its periodic axes "
                f"(`periodic`), choose a wider `spacing` or other `variants`, or in an "
                f"auto scan allow more (`max_chords`)"
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

    Returns the tallies of each axis and set of solids, shape (D, 2, TALLY_SIZE). If there are bins,
    the gaps go there instead. ``following`` counts the steps of this part and of other parts.

    Raises
    ------
    FollowedTooFarError
        If following lines takes more steps than allowed.
    """
    first, second = ("a" in variants or "c" in variants), ("b" in variants or "d" in variants)
    whole = "a" in variants or "b" in variants
    window = solids.window is not None and ("c" in variants or "d" in variants)
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
        lines.scan(True, None, None, medium=solids.medium)
        whole = False
    if solids.edge == CLIP and whole and window:
        lines.scan(True, CLIPPED, solids.window)
    else:
        if whole:
            lines.scan_whole()
        if window:
            lines.scan_window()
    lines.following.add(float(lines.tallies[:, 0, sweep.STEPS].sum()))
    if first:
        return lines.tallies
    # without a or c, the solids of b and d are the only ones
    if bins is not None:
        bins.sums[:] = bins.sums[:, :, ::-1].copy()
    return lines.tallies[:, ::-1]


class _Lines(NamedTuple):
    """The lines of some axes through the solids, and their sums."""

    solids: Solids
    axes: Axes
    cutoff: float
    first: bool
    """Whether the first set of solids has all of them; otherwise it is the set of b and d."""
    both: Flag
    bins: Bins
    following: Following
    tallies: FloatArray

    def listed(self, radius: FloatArray, variants: int) -> Flag:
        """Whether to list chords, as most are of spheres that meet few lines; bins do so anyhow."""
        # the operator @ would wake the threads of BLAS, in each job of a scan
        squares = np.einsum("i,i", radius, radius)
        few = squares < FEW_LINES * variants * self.axes.spacing * float(np.sum(radius))
        return True if few and not self.bins.cutoffs.size else None

    def scan(
        self,
        whole: Flag,
        edge: Edge | None,
        window: Convex | None,
        center: FloatArray | float = 0.0,
        medium: CellGrains | None = None,
    ) -> None:
        """Sweep the lines through a window about a centre once; without a window all lines."""
        solids, both = self.solids, bool(self.both)
        grains = medium or CellGrains(solids.position, solids.radius, solids.removed, *NO_CELL)
        # a mask of all spheres would copy them
        solid = slice(None) if self.first else ~grains.removed
        if window is not None and edge is not None and edge is not CLIPPED:
            solid = solids.near(window, center, edge.margin) & (self.first | ~grains.removed)
        grains = grains._replace(
            position=np.ascontiguousarray(grains.position[solid] - center),
            radius=np.ascontiguousarray(grains.radius[solid]),
            removed=grains.removed[solid],
        )
        if medium is not None and not len(grains.radius):
            return
        axes, prisms, cells = self.axes, None, None
        if medium is not None:
            triads, sections, prisms = prism_along(axes.triads, medium, solids.space.is_plane)
            axes, cells = axes._replace(triads=triads), solids.medium_cells
        else:
            sections = section_along(axes.triads, window)
            if edge is not None and edge.start is not None:
                cells = solids.cells
        scan_axes(
            grains,
            solids.bounds,
            axes,
            sections,
            prisms,
            Counts(self.cutoff, self.both, whole, edge, None),
            self.listed(grains.radius, (1 + both) * ((whole is not None) + (edge is not None))),
            self.bins,
            None if cells is None else Beyond(cells, not self.first, self.following.left),
            self.tallies,
        )

    def scan_whole(self) -> None:
        """
        Scan the whole of an open sample alone, as a window.

        By ``ends`` the window is an ellipsoid. Otherwise it has no end, so that all gaps between
        the first and the last solid of a line count.
        """
        inner, found, sums = self.solids.inner, self.tallies, self.bins.sums
        if self.solids.edge == ENDS:
            if inner is None:
                return
            alone = self._replace(bins=self.bins.of_whole(inner.center))
            alone.scan(None, WEIGHED, inner.shape, inner.center)
        else:
            alone = self._replace(bins=self.bins.of_whole(np.zeros(3)))
            alone.scan(None, CLIPPED, None)
            # the void and the length of a line without an end mean nothing
            found[..., [sweep.WINDOW + sweep.VOID, sweep.WINDOW + sweep.LINE_LENGTH]] = 0.0
        # what was found in the window belongs to the whole
        of_whole, of_window = found[..., : sweep.WINDOW], found[..., sweep.WINDOW : sweep.CHORDS]
        of_whole[:], of_window[:] = of_window, 0.0
        sums[:, OF_WHOLE], sums[:, OF_WINDOW] = sums[:, OF_WINDOW], 0.0

    def scan_window(self) -> None:
        """Scan the window alone."""
        solids = self.solids
        if solids.edge in (CLIP, ENDS):
            self.scan(None, CLIPPED if solids.edge == CLIP else WEIGHED, solids.window)
        elif solids.around is not None and len(solids.around.radius):
            margin = margin_of(solids.around)
            if self.bins.cutoffs.size or self.listed(solids.radius, 1 + bool(self.both)):
                # not below the cut-off: segments that reach it are known to count
                margin = min(margin, max(NARROW * margin, 1.01 * self.cutoff))
            self.scan(None, Edge(None, True, margin), solids.window)
