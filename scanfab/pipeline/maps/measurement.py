"""One frame scanned block by block: for the fabric of each, and for both of its errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from scanfab.base.arrays import concatenated
from scanfab.base.errors import Note
from scanfab.base.typing import FloatArray
from scanfab.fabric.void import BlockFabrics, block_fabrics
from scanfab.packing.sample import Sample
from scanfab.pipeline.measurement import coarse_spacing, solids_of
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.tolerance import Errors, Goal, scan_to_tolerance
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import design_of
from scanfab.scan.edges import CLIP, START
from scanfab.scan.gaps import scan_gaps
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids

# Of the scan for the sample's scatter in each block: replicates, from which its noise is known, and
# axes, so many that the choice of them adds little: along 16 the error of a block of a hundred
# grains would scatter by a quarter of its value.
PART_REPLICATES, PART_AXES = 4, 96
# chords that it may cut: lines are set further apart where there would be more
MOST_CHORDS = 1e9


@dataclass(frozen=True, eq=False)
class MapSums(ScanSums):
    """What the scan of a map adds up: beside the sums of all blocks the fabric of each."""

    fabrics: dict[str, BlockFabrics]
    """Of each variant."""


@dataclass(frozen=True, eq=False)
class PartSums:
    """Of one variant what the scan of the eight parts of the blocks tells."""

    rest: BlockFabrics
    """The fabrics without each part, shape (R, B, 8)."""
    segments: FloatArray
    """Kept segments in each part, shape (R, B, 8)."""
    void: FloatArray
    """Volume of the void with its middle in each part, by each replicate, shape (R, B, 8)."""


class MapMeasurement(NamedTuple):
    """What the scans of one frame say of its blocks."""

    plan: Plan
    """With the rule and the spacing as they were in the end."""
    solids: Solids
    blocks: tuple[Blocks, Blocks]
    """Of the whole sample and of the window, in the dump's coordinates."""
    sums: MapSums
    parts: dict[str, PartSums]
    """Of each variant."""
    notes: list[Note]
    """What the scan did not reach."""


@dataclass(frozen=True, eq=False)
class MedianBlock(Goal):
    """The error of the median block of each variant is to meet the tolerance."""

    blocks: tuple[Blocks, Blocks]
    """In the coordinates of the solids."""

    def scan(
        self, solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
    ) -> MapSums:
        """As planned; replicate by replicate, as the sums of all their axes would be too many."""
        weights, moment, parts = plan.rule.weights, plan.moment, []
        for replicate in replicates:
            sums = scan_gaps(
                solids, plan.rule,
                spacing=plan.spacing, cutoffs=[plan.cutoff], blocks=self.blocks,
                variants=plan.variants, replicates=[replicate], seed=plan.seed,
                workers=plan.workers, most_steps=most_steps,
            )  # fmt: skip
            most_steps -= float(sums.scan.steps.sum())
            fabrics = {
                name: block_fabrics(sums.axes, weights, *sums.in_blocks(name, 0, moment))
                for name in plan.variants
            }
            parts.append(MapSums(**vars(sums.scan), fabrics=fabrics))
        whole: MapSums = concatenated(parts)
        return whole

    def errors(self, sums: MapSums, plan: Plan, variant: str) -> Errors:
        """The median of the blocks that hold any segment: of many, it is sure enough to plan by."""
        found = sums.fabrics[variant]
        is_met = found.is_met
        if not is_met.any():
            return Errors(math.inf, math.inf, 1.0)
        errors = np.where(found.exists, found.axial_errors(np.asarray(plan.axis)), np.inf)
        median = float(np.median(errors[is_met]))
        return Errors(median, median, float(np.median(found.filled.mean(axis=0)[is_met])))


def measure_map(sample: Sample, plan: Plan, where: str = "the frame") -> MapMeasurement:
    """Scan one frame that has grains; ``where`` names it where progress is told."""
    assert plan.map_blocks is not None
    solids = solids_of(sample, plan.window, variants=plan.variants, edge=plan.edge)
    whole = plan.map_blocks.of_whole(sample.packing.cell)
    window = whole if plan.window is None else plan.map_blocks.of_window(plan.window)
    placed = whole.moved(solids.origin), window.moved(solids.origin)
    sums, plan, notes = scan_to_tolerance(solids, plan, where, MedianBlock(placed))
    parts = _part_sums(solids, plan, placed, sums)
    return MapMeasurement(plan, solids, (whole, window), sums, parts, notes)


def _part_sums(
    solids: Solids, plan: Plan, blocks: tuple[Blocks, Blocks], before: ScanSums
) -> dict[str, PartSums]:
    """Along fewer lines, each block in eight parts, for the sample's scatter and for its void."""
    rule, parts = design_of(PART_AXES), []
    most = min(MOST_CHORDS, plan.max_chords)
    spacing = coarse_spacing(solids, PART_REPLICATES * len(rule), before, plan, most)
    for replicate in range(PART_REPLICATES):
        scan = partial(
            scan_gaps, rule=rule, spacing=spacing, cutoffs=[0.0, plan.cutoff],
            blocks=(blocks[0].finer(), blocks[1].finer()), variants=plan.variants,
            replicates=[replicate], seed=plan.seed, workers=plan.workers, most_steps=math.inf,
        )  # fmt: skip
        sums = scan(solids)
        # by the rule start, segments count with what is outside the window, too
        voids = sums if solids.edge != START else scan(replace(solids, edge=CLIP))
        found = {}
        for name in plan.variants:
            by_part = blocks[name in "cd"].by_part
            length, number = map(by_part, sums.in_blocks(name, 1, plan.moment))
            rest = length.sum(axis=-1, keepdims=True) - length
            # what rounding leaves of nothing is none
            left = np.maximum(number.sum(axis=-1, keepdims=True) - number, 0.0)
            void = np.einsum("d,rdbp->rbp", rule.weights, by_part(voids.in_blocks(name)[0]))
            without = block_fabrics(sums.axes, rule.weights, rest, left)
            void *= spacing**2 / rule.weights.sum()
            found[name] = PartSums(without, number.sum(axis=1), void)
        parts.append(found)
    whole: dict[str, PartSums] = concatenated(parts)
    return whole
