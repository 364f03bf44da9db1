"""Scan one frame: its solids, and the sums over its lines."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scanfab.base.arrays import compressed
from scanfab.base.convex import Convex
from scanfab.base.errors import Note
from scanfab.base.shapes import sphere
from scanfab.base.typing import FloatArray, IntArray
from scanfab.fabric.errors import Jackknife
from scanfab.fabric.measured import void_scatter
from scanfab.packing.sample import Sample, Variant
from scanfab.packing.window import Window, inner_ellipsoid
from scanfab.pipeline.plan import NOISE, Plan
from scanfab.pipeline.tolerance import scan_to_tolerance
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import design_of, usual_rule
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.kernels.grid import CellGrains
from scanfab.scan.scan import GapSums, ScanSums, scan_gaps
from scanfab.scan.solids import Inner, Solids, margin_of, most_lines
from scanfab.scan.tallies import FollowedTooFarError

# A separate scan measures the error due to the sample. Its replicates show its noise, which is
# subtracted. A spacing in mean radii gives the same number of segments per grain in small and large
# samples (about 900 in dense packings), so noise and scatter fall together as grains are added.
BLOCK_REPLICATES = range(2)
# Least number of axes times grains of this scan. With the usual directions, the error of an RV of a
# few hundred grains would change with the seed by a quarter; with these, by a tenth or less.
AXES_TIMES_GRAINS = 80_000
# Most chords of this scan. Dense packings of similar grains need 1,250 per grain; grains that
# overlap many times or differ much in size would need more. The most leave a noise of about 8e-5 in
# alpha, which is subtracted: less than half of the error due to a random sample of ten million
# grains, and a twentieth of that of a hundred thousand.
CHORDS_A_GRAIN = 2_000
FEWEST_CHORDS, MOST_CHORDS = 3e7, 5e7
# the user is warned if a larger fraction of the segments leaves the sample
MOST_LEFT_OUT = 0.01


@dataclass(frozen=True, eq=False)
class Measurement:
    """The results of the scans of one frame."""

    sample: Sample
    plan: Plan
    """The plan with the final rule and spacing."""
    solids: Solids
    """The spheres that lines may meet; the origin is the centre of the RV, else of the grains."""
    sums: ScanSums
    gaps: GapSums | None
    """All gaps of the same lines; None unless several cut-offs or another moment need them."""
    blocked: GapSums
    """Gaps of a second scan with fewer lines, by the block that their middle lies in."""
    blocks: tuple[Blocks, Blocks]
    """Octants of the whole sample and of the window, in the dump's coordinates."""
    notes: tuple[Note, ...] = ()
    """Notes on tolerances that the scan did not meet."""

    def kept(
        self, variant: str, place: int = 0, moment: int | None = None
    ) -> tuple[FloatArray, FloatArray | IntArray]:
        """
        Sums of kept segments as :meth:`GapSums.kept`, at the plan's cut-off number ``place``.

        The ``moment`` is by default that of the settings.
        """
        if self.gaps is None:
            return self.sums.kept(variant)
        moment = self.plan.settings.moment if moment is None else moment
        return self.gaps.kept(variant, place, moment)

    def spheres_of(self, variant: Variant) -> tuple[FloatArray, FloatArray, Convex | None]:
        """
        The spheres of a variant and the region of its lines, for figures and views.

        Returns the positions (N, 3) from the solids' origin, the radii (N,), and the region that
        clips the lines, if any. A periodic whole is shown in part, within a sphere.
        """
        solids, medium, cell = self.solids, self.solids.medium, self.sample.packing.cell
        position, radius, removed = solids.position, solids.radius, solids.removed
        window = solids.window if variant.in_window else None
        if medium is not None and cell is not None and not variant.in_window:
            window = sphere(0.5 * float(np.linalg.norm(medium.vectors, axis=1).max()))
            position, row = cell.images_near_origin(medium.position, medium.radius + window.reach)
            radius, removed = medium.radius[row], medium.removed[row]
        solid = ~removed if variant.without_rattlers else np.ones(len(radius), bool)
        return position[solid], radius[solid], window

    def at_cutoffs(self, cutoffs: Iterable[float]) -> Measurement:
        """The measurement of the same lines at other cut-offs, in the dump's unit."""
        plan = replace(self.plan, cutoffs=tuple(sorted(cutoffs)))
        blocked = _scan_octants(self.solids, plan, self.blocks)
        gaps = _all_gaps(self.solids, plan, self.sums, self.blocks)
        return replace(self, plan=plan, gaps=gaps, blocked=blocked)


def measure(sample: Sample, plan: Plan, where: str = "the frame") -> list[Measurement]:
    """
    Scan one frame that has grains; all RVs are scanned along the same lines.

    In a fixed scan, the whole sample is measured together with the first RV. ``where`` names the
    frame in the log.
    """
    found = []
    for part in plan.scans():
        first = _measure(sample, part, where)
        others = first.plan.along(first.sums.replicates)
        found += [first, *(_measure(sample, other, where) for other in others)]
    return found


def _measure(sample: Sample, plan: Plan, where: str) -> Measurement:
    """Scan fewer lines for the sample's error, which may set the tolerance, then all lines."""
    solids = solids_of(sample, plan.window, variants=plan.variants, edge=plan.settings.edge)
    blocks = _octants(sample, plan)
    blocked = _scan_octants(solids, plan, blocks)
    aims: dict[str, float] = {}
    if plan.auto:
        # the rows at this cut-off decide
        place = int(np.argmin(np.abs(np.array(plan.cutoffs) - plan.cutoff)))
        for name in plan.variants:
            scatter = scatter_of(blocked, plan, name, place)
            aims[name] = plan.settings.aim(None if scatter is None else scatter.error)
        held = [aims[name] for name in plan.variants if blocked.in_blocks(name, place)[1].any()]
        is_empty = not held or (plan.window is not None and plan.rvs[0].lack != "")
        # wide lines tell the solid fraction where there is no fabric to be measured
        plan = replace(plan.aiming_at(1.0), auto="") if is_empty else plan.aiming_at(min(held))
    sums, plan, notes = scan_to_tolerance(solids, plan, aims, where)
    gaps = _all_gaps(solids, plan, sums, blocks)
    return Measurement(sample, plan, solids, sums, gaps, blocked, blocks, tuple(notes))


def _all_gaps(
    solids: Solids, plan: Plan, sums: ScanSums, blocks: tuple[Blocks, Blocks]
) -> GapSums | None:
    """All gaps of the lines of a scan, if several cut-offs or another moment need them."""
    if not plan.settings.lists_gaps and len(plan.cutoffs) == 1:
        return None
    return gap_scan(solids, plan, blocks, plan.cutoffs, range(sums.replicates))


def _scan_octants(solids: Solids, plan: Plan, blocks: tuple[Blocks, Blocks]) -> GapSums:
    """Scan fewer lines, with gaps by octant, for the error due to the sample."""
    # the directions of an auto scan, or more directions for few grains
    count, rule = len(solids.grain_radius), usual_rule(solids.space)
    if len(rule) * count < AXES_TIMES_GRAINS:
        rule = design_of(AXES_TIMES_GRAINS / max(count, 1), solids.space)
    most = min(max(CHORDS_A_GRAIN * count, FEWEST_CHORDS), MOST_CHORDS)
    axes = len(BLOCK_REPLICATES) * len(rule)
    spacing = coarse_spacing(solids, axes, plan, most)
    while True:
        try:
            lines = replace(plan, rule=rule, spacing=spacing)
            return gap_scan(solids, lines, blocks, plan.cutoffs, BLOCK_REPLICATES, most)
        except FollowedTooFarError:
            # only a scan can tell how far lines run through a periodic medium
            if solids.chords(2.0 * spacing) < 1.0:
                raise
            spacing *= 2.0


def scatter_of(blocked: GapSums, plan: Plan, variant: str, place: int) -> Jackknife | None:
    """Anisotropy of the void fabric without each octant, of a variant at a cut-off of the plan."""
    settings = plan.settings
    return void_scatter(blocked, variant, settings.axis, plan.space, place, settings.moment)


def gap_scan(
    solids: Solids,
    plan: Plan,
    blocks: tuple[Blocks, Blocks],
    cutoffs: Sequence[float],
    replicates: Iterable[int],
    most_steps: float = math.inf,
) -> GapSums:
    """List all gaps along the lines of a plan by block; blocks are in the dump's coordinates."""
    return scan_gaps(
        solids, plan.rule, spacing=plan.spacing, cutoffs=cutoffs,
        blocks=(blocks[0].moved(solids.origin), blocks[1].moved(solids.origin)),
        variants=plan.variants, replicates=replicates, seed=plan.settings.seed,
        workers=plan.workers, most_steps=most_steps,
    )  # fmt: skip


def _octants(sample: Sample, plan: Plan) -> tuple[Blocks, Blocks]:
    """Octants about the middle of the sample or its cell, and about the centre of the RV."""
    packing, cell, window = sample.packing, sample.packing.cell, plan.window
    position, largest = compressed(sample.gathered, packing.position), float(packing.radius.max())
    axis, space = plan.settings.axis, plan.space
    if cell is not None and packing.is_periodic:
        periodic = np.array(cell.periodic)
        whole = Blocks.of_periods(cell.vectors, cell.origin, periodic, position, space)
    else:
        low, high = position.min(axis=0), position.max(axis=0)
        reach = float(np.linalg.norm(high - low)) + largest
        whole = Blocks.about(0.5 * (low + high), reach, axis, space)
    if window is None:
        return whole, whole
    return whole, Blocks.about(window.center, window.radius + largest, axis, space)


def coarse_spacing(
    solids: Solids, axes: int, plan: Plan, most: float, before: ScanSums | None = None
) -> float:
    """
    Spacing of a scan for errors: as close as is useful, but with at most ``most`` chords.

    ``axes`` is the number of axes in all its replicates. A scan ``before`` shows how many steps are
    needed to follow lines through a periodic medium.
    """
    if not len(solids.grain_radius):
        return solids.reach
    spacing, steps = NOISE[solids.space.dimension].close * float(solids.grain_radius.mean()), 0.0
    if before is not None:
        steps = float(before.steps.mean()) / len(plan.rule)
        steps = plan.space.lines(steps, spacing / plan.spacing)
    # each line costs as much as a chord, even if it meets nothing
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
        Its grains are the solids; boundary particles are not. Variants b and d remove its rattlers.
    window : Window, optional
        The RV that clips the lines of c and d; without it c and d have no lines.
    variants : str, optional
        Variants to scan, letters out of abcd. Without a and b, grains outside the window are left
        out.
    edge : {"clip", "start", "ends"}, optional
        How segments at the surface of the window count.

    Returns
    -------
    Solids
        Spheres with positions from ``origin``, which is the centre of the window, or without a
        window the mean of the grain centres.

    Raises
    ------
    SettingsError
        If the window is wider than a period of the cell.
    PackingError
        If the contacts, which decide what is a rattler, are unknown.

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
        # the mean lies beside the plane by rounding
        origin[space.across] = packing.place_across
    position = np.ascontiguousarray(position - origin)
    shape = None if window is None else window.shape
    medium, inner, vectors, periodic = None, None, np.eye(3), np.zeros(3, bool)
    if cell is not None and packing.is_periodic:
        vectors, periodic = cell.short_vectors, np.array(cell.periodic)
        if space.across is not None:
            # The vector across the plane comes last and gets the length of a mean diameter, so that
            # estimates of mean free paths in three dimensions also hold for discs.
            order = np.argsort(vectors[:, space.across] != 0.0, kind="stable")
            vectors, periodic = vectors[order], periodic[order]
            vectors[2] = 2.0 * float(radius.mean()) * space.normal
    all_grains = CellGrains(position, radius, removed, vectors, periodic)
    around = all_grains if edge == START and shape is not None else None
    margin = 0.0 if around is None else margin_of(around)
    if cell is not None and packing.is_periodic:
        medium = all_grains if whole else None
        reach = 0.0 if shape is None else shape.reach
        position, row = cell.images_near_origin(position, radius + reach + margin)
        radius, removed = radius[row], removed[row]
    elif shape is not None and not whole:
        near = shape.may_meet(position, radius + margin)
        position, radius, removed = position[near], radius[near], removed[near]
    elif edge == ENDS and whole:
        # an ellipsoid inside an open sample, out of which no segment depends on what lies outside
        gathered = sample.gathered
        largest = float(packing.radius[gathered].max())
        ellipsoid = inner_ellipsoid(packing.position[gathered], largest, space)
        inner = None if ellipsoid is None else Inner(ellipsoid.shape, ellipsoid.center - origin)
    return Solids(
        position, radius, removed, shape, medium, origin,
        edge=edge, around=around, inner=inner, space=space,
    )  # fmt: skip


def edge_of(variant: Variant, plan: Plan, solids: Solids) -> str | None:
    """The edge rule for a variant; None for a periodic whole, which has no edge."""
    if solids.medium is not None and not variant.in_window:
        return None
    edge = plan.settings.edge
    return edge if variant.in_window or edge == ENDS else CLIP


def left_out_of(sums: ScanSums, variant: Variant, edge: str | None, kept: float) -> float | None:
    """Fraction of segments dropped because they leave the sample; None if they are cut."""
    left = float(sums.left_out[:, "abcd".index(variant.name)].sum())
    return left / (left + kept) if edge == START and left + kept else None


def doubts_of_lines(sums: ScanSums, variant: Variant, left_out: float | None) -> dict[str, str]:
    """Notes, by code, on lines that meet no grain and on segments that leave the sample."""
    texts, index = {}, "abcd".index(variant.name)
    channels, met = (int(counts[:, index].sum()) for counts in (sums.channels, sums.lines))
    if channels:
        text = f"{channels} of {channels + met} lines stay in a channel and meet no grain"
        texts["channels"] = text
    if left_out is not None and left_out > MOST_LEFT_OUT:
        texts["left_out"] = (
            f"{left_out:.1%} of the void segments of the RV leave the sample and are left out: "
            f"these are long segments, so the mean length is too small: choose a smaller `rv`, or "
            f"`edge=ends`, which needs nothing outside the RV"
        )
    return texts
