"""One frame scanned: its solids, and the sums that its lines give."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Convex
from scanfab.base.errors import Note
from scanfab.base.shapes import sphere
from scanfab.base.typing import FloatArray
from scanfab.packing.sample import Sample, Variant
from scanfab.pipeline.plan import NOISE, Plan
from scanfab.pipeline.solids import solids_of
from scanfab.pipeline.tolerance import scan_to_tolerance
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import DirectionRule, design_of, usual_rule
from scanfab.scan.gaps import GapSums, scan_gaps
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids, most_lines

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
    """What the scan did not reach."""

    def kept(
        self, variant: str, place: int = 0
    ) -> tuple[FloatArray, FloatArray | npt.NDArray[np.int64]]:
        """As :meth:`GapSums.kept`, at one of the plan's cut-offs, with the moment of the table."""
        if self.gaps is None:
            return self.sums.kept(variant)
        return self.gaps.kept(variant, place, self.plan.moment)

    def spheres_of(self, variant: Variant) -> tuple[FloatArray, FloatArray, Convex | None]:
        """
        What a few lines of a variant meet, to be looked at.

        Positions (N, 3) from the solids' origin and radii (N,) of its solids, and what its lines
        are clipped to, if anything. Of a periodic whole that is a sphere, a part of it.
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
        """The same lines evaluated with other cut-offs, in the dump's unit."""
        plan = replace(self.plan, cutoffs=tuple(sorted(cutoffs)), lists_gaps=True)
        placed, sums = _about(self.solids.origin, self.blocks), self.sums
        gaps = _every_gap(self.solids, placed, sums, plan)
        blocked = _blocked_gaps(self.solids, placed, self.block_rule, sums, plan)
        return replace(self, plan=plan, gaps=gaps, blocked=blocked)


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
    blocks = _blocks(sample, plan)
    placed = _about(solids.origin, blocks)
    gaps = _every_gap(solids, placed, sums, plan) if plan.lists_gaps else None
    block_rule = _block_rule(solids)
    blocked = _blocked_gaps(solids, placed, block_rule, sums, plan)
    return Measurement(sample, plan, solids, sums, gaps, blocked, block_rule, blocks, tuple(notes))


def _every_gap(
    solids: Solids, blocks: tuple[Blocks, Blocks], sums: ScanSums, plan: Plan
) -> GapSums:
    """All gaps of the lines that the sums are of, at the plan's cut-offs."""
    return scan_gaps(
        solids,
        plan.rule,
        spacing=plan.spacing,
        replicates=range(sums.replicates),
        **_lines(blocks, plan),
    )


def _blocked_gaps(
    solids: Solids, blocks: tuple[Blocks, Blocks], rule: DirectionRule, sums: ScanSums, plan: Plan
) -> GapSums:
    """Gaps of fewer lines, for the sample's scatter."""
    return scan_gaps(
        solids,
        rule,
        spacing=_block_spacing(solids, rule, sums, plan),
        replicates=range(BLOCK_REPLICATES),
        **_lines(blocks, plan),
    )


def _lines(blocks: tuple[Blocks, Blocks], plan: Plan) -> dict[str, Any]:
    """What both lists of gaps are made with."""
    return {
        "cutoffs": plan.cutoffs,
        "blocks": blocks,
        "variants": plan.variants,
        "seed": plan.seed,
        "workers": plan.workers,
        # what these scans take is known from the one before them
        "most_steps": math.inf,
    }


def _about(origin: FloatArray, blocks: tuple[Blocks, Blocks]) -> tuple[Blocks, Blocks]:
    """Blocks of the dump's coordinates as blocks of places from an origin."""
    whole, window = (replace(one, shift=one.shift + one.matrix @ origin) for one in blocks)
    return whole, window


def _blocks(sample: Sample, plan: Plan) -> tuple[Blocks, Blocks]:
    """The octants about the middle of the sample (of the cell), and about the window's centre."""
    packing = sample.packing
    position = packing.position[sample.gathered]
    low, high = position.min(axis=0), position.max(axis=0)
    radius = float(packing.radius.max())
    reach = float(np.linalg.norm(high - low)) + radius
    whole = Blocks.about(0.5 * (low + high), reach, plan.axis, plan.space)
    if packing.cell is not None and packing.is_periodic:
        cell = packing.cell
        periodic = np.array(cell.periodic)
        whole = Blocks.of_periods(cell.vectors, cell.origin, periodic, position, plan.space)
    if plan.window is None:
        return whole, whole
    reach = plan.window.radius + radius
    return whole, Blocks.about(plan.window.center, reach, plan.axis, plan.space)


def _block_rule(solids: Solids) -> DirectionRule:
    """The directions of an auto scan; more of them for fewer grains."""
    usual = usual_rule(solids.space)
    axes = AXES_TIMES_GRAINS / max(len(solids.grain_radius), 1)
    return usual if axes <= len(usual) else design_of(axes, solids.space)


def _block_spacing(solids: Solids, rule: DirectionRule, sums: ScanSums, plan: Plan) -> float:
    """As close as is of use, but no closer than the sample's scatter is worth."""
    most = min(max(CHORDS_A_GRAIN * len(solids.grain_radius), FEWEST_CHORDS), MOST_CHORDS)
    return coarse_spacing(solids, BLOCK_REPLICATES * len(rule), sums, plan, most)


def coarse_spacing(solids: Solids, axes: int, before: ScanSums, plan: Plan, most: float) -> float:
    """
    Of a scan for errors: as close as is of use, but of so many chords at the most.

    ``axes`` are those of all its replicates. What following lines through a periodic medium takes
    is known from the scan ``before``.
    """
    if not len(solids.grain_radius):
        return solids.reach
    spacing = NOISE[solids.space.dimension].close * float(solids.grain_radius.mean())
    steps = plan.space.lines(float(before.steps.mean()) / len(plan.rule), spacing / plan.spacing)
    # a line costs as much as a chord, also if it meets nothing
    chords = axes * (solids.chords(spacing) + most_lines(solids, spacing) + steps)
    return spacing * plan.space.apart(max(chords / most, 1.0))
