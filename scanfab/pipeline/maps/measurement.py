"""One frame scanned block by block: for the fabric of each, and for both of its errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scanfab.base.arrays import concatenated
from scanfab.base.errors import Note
from scanfab.base.typing import FloatArray, IntArray
from scanfab.fabric.blocks import BlockFabrics, WithoutParts
from scanfab.packing.sample import Sample
from scanfab.pipeline.maps.blocks import splits_of
from scanfab.pipeline.measurement import coarse_spacing, solids_of
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.tolerance import Errors, Goal, scan_to_tolerance
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import DirectionRule, design_of
from scanfab.scan.edges import CLIP, START
from scanfab.scan.gaps import GapSums, scan_gaps
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids

# Of the scan for the sample's scatter in each block: replicates, from which its noise is known, and
# axes, so many that the choice of them adds little: along 16 the error of a block of a hundred
# grains would scatter by a quarter of its value.
PART_REPLICATES, PART_AXES = 4, 96
# chords that it may cut: lines are set further apart where there would be more
MOST_CHORDS = 1e9
# numbers that a scan may hold at a time
MOST_NUMBERS = 3e7


@dataclass(frozen=True, eq=False)
class MapSums:
    """What the scan of a map adds up."""

    fabrics: dict[str, BlockFabrics]
    """Of each variant."""
    scan: ScanSums
    """Of the same lines: how many there are, and what they took."""

    @property
    def replicates(self) -> int:
        """Number of replicates R."""
        return self.scan.replicates

    @property
    def chords(self) -> FloatArray:
        """As of ScanSums."""
        return np.asarray(self.scan.chords)

    @property
    def steps(self) -> FloatArray:
        """As of ScanSums."""
        return np.asarray(self.scan.steps)

    @property
    def work(self) -> FloatArray:
        """As of ScanSums."""
        return np.asarray(self.scan.work)


@dataclass(frozen=True, eq=False)
class MedianBlock(Goal):
    """The error of the median block of each variant is to meet the tolerance."""

    blocks: tuple[Blocks, Blocks]
    """In the coordinates of the solids."""

    def scan(
        self, solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
    ) -> MapSums:
        """As planned, a few replicates at a time."""
        parts = []
        for some in _chunks(replicates, len(plan.rule), plan, self.blocks, 1):
            sums = _scan(
                solids, plan, plan.rule, plan.spacing, some, (plan.cutoff,), self.blocks, most_steps
            )
            parts.append(_reduced(sums, plan))
        return self.concatenate(parts)

    def concatenate(self, parts: Sequence[MapSums]) -> MapSums:
        """All replicates."""
        fabrics = {
            name: concatenated([one.fabrics[name] for one in parts]) for name in parts[0].fabrics
        }
        return MapSums(fabrics, ScanSums.concatenate([one.scan for one in parts]))

    def errors(self, sums: MapSums, plan: Plan, variant: str) -> Errors:
        """The median of the blocks that hold any segment: of many, it is sure enough to plan by."""
        found = sums.fabrics[variant]
        if not found.is_met.any():
            return Errors(math.inf, math.inf, 1.0)
        errors = np.where(found.exists, found.axial_errors(np.asarray(plan.axis)), np.inf)
        median = float(np.median(errors[found.is_met]))
        return Errors(median, median, float(np.median(found.filled.mean(axis=0)[found.is_met])))


@dataclass(frozen=True, eq=False)
class PartSums:
    """Of one variant what the scan of the parts of the blocks tells."""

    without: WithoutParts
    void: FloatArray
    """Volume of the void with its middle in each part, by each replicate, shape (R, B, P)."""


@dataclass(frozen=True, eq=False)
class MapMeasurement:
    """What the scans of one frame say of its blocks."""

    sample: Sample
    plan: Plan
    """With the rule and the spacing as they were in the end."""
    blocks: tuple[Blocks, Blocks]
    """Of the whole sample and of the window, in the dump's coordinates."""
    splits: tuple[tuple[int, int, int], tuple[int, int, int]]
    """In how many parts along each axis these are split."""
    sums: MapSums
    parts: dict[str, PartSums]
    """Of each variant."""
    solids: Solids
    notes: tuple[Note, ...] = ()
    """What the scan did not reach."""


def measure_map(sample: Sample, plan: Plan, where: str = "the frame") -> MapMeasurement:
    """Scan one frame that has grains; ``where`` names it where progress is told."""
    assert plan.map_blocks is not None
    solids = solids_of(sample, plan.window, variants=plan.variants, edge=plan.edge)
    whole = plan.map_blocks.of_whole(sample.packing.cell)
    window = whole if plan.window is None else plan.map_blocks.of_window(plan.window)
    placed = whole.moved(solids.origin), window.moved(solids.origin)
    sums, plan, notes = scan_to_tolerance(solids, plan, where, MedianBlock(placed))
    splits = splits_of(whole), splits_of(window)
    parts = _part_sums(solids, plan, placed, splits, sums.scan)
    return MapMeasurement(sample, plan, (whole, window), splits, sums, parts, solids, tuple(notes))


def _part_sums(
    solids: Solids,
    plan: Plan,
    blocks: tuple[Blocks, Blocks],
    splits: tuple[tuple[int, int, int], tuple[int, int, int]],
    before: ScanSums,
) -> dict[str, PartSums]:
    """Along fewer lines, each block in eight parts, for the sample's scatter and for its void."""
    finer = blocks[0].finer(splits[0]), blocks[1].finer(splits[1])
    rule = design_of(PART_AXES)
    most = min(MOST_CHORDS, plan.max_chords)
    spacing = coarse_spacing(solids, PART_REPLICATES * len(rule), before, plan, most)
    found: dict[str, list[PartSums]] = {name: [] for name in plan.variants}
    # by the rule start, segments count with what is outside the window, too
    clipped = replace(solids, edge=CLIP) if solids.edge == START else None
    for some in _chunks(range(PART_REPLICATES), len(rule), plan, finer, 2):
        words = plan, rule, spacing, some, (0.0, plan.cutoff), finer
        sums = _scan(solids, *words)
        voids = sums if clipped is None else _scan(clipped, *words)
        for name in plan.variants:
            kind = int(name in "cd")
            number = len(blocks[kind])
            order = _order(blocks[kind], splits[kind])
            over, under = (
                one[:, :, order].reshape(*one.shape[:2], number, -1)
                for one in sums.in_blocks(name, 1, plan.moment)
            )
            void = voids.in_blocks(name)[0][:, :, order].reshape(*over.shape)
            void = spacing**2 * np.einsum("d,rdbp->rbp", rule.weights, void)
            axis = np.asarray(plan.axis)
            without = WithoutParts.of(sums.axes, rule.weights, over, under, axis)
            found[name].append(PartSums(without, void / rule.weights.sum()))
    return {
        name: PartSums(
            concatenated([one.without for one in parts]),
            np.concatenate([one.void for one in parts]),
        )
        for name, parts in found.items()
    }


def _order(blocks: Blocks, splits: tuple[int, int, int]) -> IntArray:
    """The finer blocks in the order of their blocks, and of the parts of these."""
    block, part = blocks.of_finer(splits)
    return np.asarray(np.lexsort((part, block)), np.int64)


def _chunks(
    replicates: range, axes: int, plan: Plan, blocks: tuple[Blocks, Blocks], cutoffs: int
) -> Iterator[range]:
    """So many replicates at a time that what they add up fits into memory."""
    each = 3 * axes * len(plan.variants) * cutoffs * max(map(len, blocks))
    some = max(int(MOST_NUMBERS / each), 1)
    for first in range(replicates.start, replicates.stop, some):
        yield range(first, min(first + some, replicates.stop))


def _scan(
    solids: Solids,
    plan: Plan,
    rule: DirectionRule,
    spacing: float,
    replicates: range,
    cutoffs: tuple[float, ...],
    blocks: tuple[Blocks, Blocks],
    most_steps: float = math.inf,
) -> GapSums:
    return scan_gaps(
        solids,
        rule,
        spacing=spacing,
        cutoffs=cutoffs,
        blocks=blocks,
        variants=plan.variants,
        replicates=replicates,
        seed=plan.seed,
        workers=plan.workers,
        most_steps=most_steps,
    )


def _reduced(sums: GapSums, plan: Plan) -> MapSums:
    """What is kept of each replicate: of many, the sums of all axes and blocks are too many."""
    fabrics = {
        name: BlockFabrics.of(sums.axes, plan.rule.weights, *sums.in_blocks(name, 0, plan.moment))
        for name in plan.variants
    }
    return MapSums(fabrics, sums.scan)
