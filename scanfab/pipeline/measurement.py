"""One frame scanned: its solids, and the sums that its lines give."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from scanfab.base.arrays import compressed
from scanfab.base.convex import Convex
from scanfab.base.errors import Note
from scanfab.base.shapes import sphere
from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.sample import Sample, Variant
from scanfab.packing.window import Window, inner_ellipsoid
from scanfab.pipeline.plan import NOISE, Plan
from scanfab.pipeline.tolerance import scan_to_tolerance
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import DirectionRule, design_of, usual_rule
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.gaps import GapSums, scan_gaps
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Inner, Solids, margin_of, most_lines

# Of the scan for the sample's scatter: its noise is known from the replicates, and taken off. Lines
# at one distance in mean radii make as many segments for each grain of a small sample as of a large
# one (about 900 in dense packings), so noise and scatter fall together as grains are added.
BLOCK_REPLICATES = 2
# Axes times grains: along the usual directions alone, the error of an RV of a few hundred grains
# would scatter by a quarter of its value with the seed; along so many by a tenth or less.
AXES_TIMES_GRAINS = 80_000
# Chords that this scan may cut: in dense packings of like grains 1,250 a grain are needed. Where
# grains overlap many times or differ much in size there would be more. Of samples of more than a
# million grains the scatter is far below any tolerance in use.
CHORDS_A_GRAIN = 2_000
FEWEST_CHORDS, MOST_CHORDS = 3e7, 1e9


@dataclass(frozen=True, eq=False)
class Measurement:
    """What the scans of one frame say."""

    sample: Sample
    plan: Plan
    """With the rule and the spacing as they were in the end."""
    solids: Solids
    """What the lines met; their origin is the centre of the RV, or of the grains without one."""
    sums: ScanSums
    gaps: GapSums | None
    """All gaps of the same lines, where more than one cut-off or moment is asked for."""
    blocked: GapSums
    """Gaps of fewer lines, by the block of their middle."""
    block_rule: DirectionRule
    """The directions of these lines."""
    blocks: tuple[Blocks, Blocks]
    """Octants of the whole sample and of the window, of places in the dump's coordinates."""
    notes: tuple[Note, ...] = ()
    """On tolerances that the scan did not reach."""

    def kept(self, variant: str, place: int = 0) -> tuple[FloatArray, FloatArray | IntArray]:
        """As :meth:`GapSums.kept`, at one of the plan's cut-offs, with the moment of the table."""
        if self.gaps is None:
            return self.sums.kept(variant)
        return self.gaps.kept(variant, place, self.plan.moment)

    def spheres_of(self, variant: Variant) -> tuple[FloatArray, FloatArray, Convex | None]:
        """
        What a few lines of a variant meet, for figures and views.

        Positions (N, 3) from the solids' origin and radii (N,) of its solids, and the region that
        its lines are clipped to, if any. Of a periodic whole a part is shown, within a sphere.
        """
        solids, medium = self.solids, self.solids.medium
        position, radius, removed = solids.position, solids.radius, solids.removed
        window = solids.window if variant.in_window else None
        cell = self.sample.packing.cell
        if medium is not None and cell is not None and not variant.in_window:
            window = sphere(0.5 * float(np.linalg.norm(medium.vectors, axis=1).max()))
            position, row = cell.images_near_origin(medium.position, medium.radius + window.reach)
            radius, removed = medium.radius[row], medium.removed[row]
        solid = ~removed if variant.without_rattlers else np.ones(len(radius), bool)
        return position[solid], radius[solid], window

    def at_cutoffs(self, cutoffs: Iterable[float]) -> Measurement:
        """The measurement of the same lines at other cut-offs, in the dump's unit."""
        plan = replace(self.plan, cutoffs=tuple(sorted(cutoffs)), lists_gaps=True)
        return _with_gaps(self.sample, self.solids, self.sums, plan, self.notes)


def measure(sample: Sample, plan: Plan, where: str = "the frame") -> tuple[Measurement, ...]:
    """
    Scan one frame that has grains, each RV along the same lines.

    The whole is measured with the first of them. ``where`` names the frame where progress is told.
    """
    first = _measure(sample, plan, where)
    others = first.plan.along(first.sums.replicates)
    return (first, *(_measure(sample, other, where) for other in others))


def _measure(sample: Sample, plan: Plan, where: str) -> Measurement:
    solids = solids_of(sample, plan.window, variants=plan.variants, edge=plan.edge)
    sums, plan, notes = scan_to_tolerance(solids, plan, where)
    return _with_gaps(sample, solids, sums, plan, tuple(notes))


def _with_gaps(
    sample: Sample, solids: Solids, sums: ScanSums, plan: Plan, notes: tuple[Note, ...]
) -> Measurement:
    """Add the gaps of all lines, if the plan needs them, and those of fewer lines by octant."""
    blocks = _octants(sample, plan)
    scan = gap_scan(solids, plan, blocks, plan.cutoffs)
    gaps = None
    if plan.lists_gaps:
        gaps = scan(plan.rule, spacing=plan.spacing, replicates=range(sums.replicates))
    # the directions of an auto scan; more of them for fewer grains
    count = len(solids.grain_radius)
    rule = usual_rule(solids.space)
    if len(rule) * count < AXES_TIMES_GRAINS:
        rule = design_of(AXES_TIMES_GRAINS / max(count, 1), solids.space)
    most = min(max(CHORDS_A_GRAIN * count, FEWEST_CHORDS), MOST_CHORDS)
    spacing = coarse_spacing(solids, BLOCK_REPLICATES * len(rule), sums, plan, most)
    blocked = scan(rule, spacing=spacing, replicates=range(BLOCK_REPLICATES))
    return Measurement(sample, plan, solids, sums, gaps, blocked, rule, blocks, notes)


def gap_scan(
    solids: Solids, plan: Plan, blocks: tuple[Blocks, Blocks], cutoffs: Sequence[float]
) -> Callable[..., GapSums]:
    """
    A scan of all gaps by blocks of the dump's coordinates, with the variants and seed of a plan.

    What is left to name is the rule, spacing and replicates. Its steps are not limited: the scan
    before it tells how long it takes.
    """
    return partial(
        scan_gaps, solids,
        cutoffs=cutoffs, blocks=(blocks[0].moved(solids.origin), blocks[1].moved(solids.origin)),
        variants=plan.variants, seed=plan.seed, workers=plan.workers, most_steps=math.inf,
    )  # fmt: skip


def _octants(sample: Sample, plan: Plan) -> tuple[Blocks, Blocks]:
    """Octants about the middle of the sample (of the cell), and about the centre of the RV."""
    packing, cell = sample.packing, sample.packing.cell
    position = compressed(sample.gathered, packing.position)
    low, high = position.min(axis=0), position.max(axis=0)
    radius = float(packing.radius.max())
    reach = float(np.linalg.norm(high - low)) + radius
    whole = Blocks.about(0.5 * (low + high), reach, plan.axis, plan.space)
    if cell is not None and packing.is_periodic:
        periodic = np.array(cell.periodic)
        whole = Blocks.of_periods(cell.vectors, cell.origin, periodic, position, plan.space)
    if plan.window is None:
        return whole, whole
    reach = plan.window.radius + radius
    return whole, Blocks.about(plan.window.center, reach, plan.axis, plan.space)


def coarse_spacing(solids: Solids, axes: int, before: ScanSums, plan: Plan, most: float) -> float:
    """
    The spacing of a scan for errors: as close as is of use, but it cuts at most so many chords.

    ``axes`` is the number of axes of all its replicates. The scan ``before`` tells how many steps
    it takes to follow lines through a periodic medium.
    """
    if not len(solids.grain_radius):
        return solids.reach
    spacing = NOISE[solids.space.dimension].close * float(solids.grain_radius.mean())
    steps = plan.space.lines(float(before.steps.mean()) / len(plan.rule), spacing / plan.spacing)
    # a line costs as much as a chord, also if it meets nothing
    chords = axes * (solids.chords(spacing) + most_lines(solids, spacing) + steps)
    return spacing * plan.space.apart(max(chords / most, 1.0))


def solids_of(
    sample: Sample, window: Window | None = None, *, variants: str = "abcd", edge: str = CLIP
) -> Solids:
    """
    The spheres that scan lines may meet.

    Parameters
    ----------
    sample : Sample
        Its grains are the solids, boundary particles never; its rattlers are those that b and d
        remove.
    window : Window, optional
        The RV, which the lines of c and d are clipped to; without one these have no lines.
    variants : str, optional
        Which of a, b, c, d are to be scanned. Without a and b, grains outside the window are left
        out, and of a periodic packing the whole.
    edge : {"clip", "start", "ends"}, optional
        What counts at the window's surface.

    Returns
    -------
    Solids
        Positions relative to the window's centre; without one, to the mean of the grains' centres.
        ``origin`` is that point.

    Raises
    ------
    SettingsError
        If the window is wider than a period of the cell.
    PackingError
        If the contacts, which tell the rattlers, are not known.

    Examples
    --------
    A scan by hand, of a cubic lattice of touching spheres, whose fabric is isotropic:

    >>> import numpy as np
    >>> from scanfab import Packing, Sample, Window, direction_rule, find_contacts
    >>> from scanfab import scan_lines, solids_of, sphere, void_fabric
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    >>> sample = Sample(find_contacts(Packing(grid, 0.5), 1e-4), boundary=grid[:, 2] < 0.5)
    >>> window = Window(np.full(3, 2.5), sphere(1.8))
    >>> solids = solids_of(sample, window, variants="c")
    >>> rule = direction_rule("lebedev:11")
    >>> sums = scan_lines(solids, rule, spacing=0.1, cutoff=0.5, variants="c")
    >>> fabric = void_fabric(sums.axes, rule.weights, *sums.kept("c"))
    >>> bool(fabric.tensor.alpha < 0.02)
    True
    """
    packing, grains = sample.packing, sample.grains
    cell, space = packing.cell, packing.space
    if window is not None:
        window.check_fits(packing)
    whole = "a" in variants or "b" in variants
    position, radius = compressed(grains, packing.position), packing.radius[grains]
    removed = sample.rattlers[grains]
    origin = position.mean(axis=0) if window is None else window.center.copy()
    if space.across is not None:
        # exactly in the plane, as the mean would not be
        origin[space.across] = packing.place_across
    position = np.ascontiguousarray(position - origin)
    shape = None if window is None else window.shape
    medium, inner, vectors, periodic = None, None, np.eye(3), np.zeros(3, bool)
    if cell is not None and packing.is_periodic:
        vectors, periodic = cell.short_vectors, np.array(cell.periodic)
        if space.across is not None:
            # the one across the plane comes last, as long as discs are wide: then what is expected
            # of mean free paths in space holds here, too
            order = np.argsort(vectors[:, space.across] != 0.0, kind="stable")
            vectors, periodic = vectors[order], periodic[order]
            vectors[2] = 2.0 * float(radius.mean()) * space.normal
    every = CellGrains(position, radius, removed, vectors, periodic)
    around = every if edge == START and shape is not None else None
    margin = 0.0 if around is None else margin_of(around)
    if cell is not None and packing.is_periodic:
        medium = every if whole else None
        reach = 0.0 if shape is None else shape.reach
        position, row = cell.images_near_origin(position, radius + reach + margin)
        radius, removed = radius[row], removed[row]
    elif shape is not None and not whole:
        near = shape.may_meet(position, radius + margin)
        position, radius, removed = position[near], radius[near], removed[near]
    elif edge == ENDS and whole:
        # where all grains of an open sample are known
        gathered = sample.gathered
        largest = float(packing.radius[gathered].max())
        found = inner_ellipsoid(packing.position[gathered], largest, space)
        inner = None if found is None else Inner(found.shape, found.center - origin)
    return Solids(
        position, radius, removed, shape, medium, origin,
        edge=edge, around=around, inner=inner, space=space,
    )  # fmt: skip
