"""Map one frame: a row for each variant and block, with errors due to scan and sample."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from scanfab.base.arrays import compressed, concatenated
from scanfab.base.errors import Note, ScanfabNote, ScanfabWarning, joined
from scanfab.base.space import SPACE
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.fabric.errors import homogeneity_of, part_errors, ratio, ratio_with_errors
from scanfab.fabric.tensor import FabricTensor, axial, axial_error, contact_fabric, tensor_values
from scanfab.fabric.void import BlockFabrics, block_fabrics
from scanfab.packing.cell import Cell
from scanfab.packing.sample import VARIANTS, Sample, Variant
from scanfab.packing.window import Window
from scanfab.pipeline.map_blocks import near_surface, volumes_inside
from scanfab.pipeline.measurement import (
    coarse_spacing,
    doubts_of_lines,
    edge_of,
    gap_scan,
    left_out_of,
    solids_of,
)
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.tolerance import Errors, scan_to_tolerance
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import design_of
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids
from scanfab.table.columns import row_of
from scanfab.table.row import Row

# A separate scan measures the error of each block due to the sample. Its replicates show its noise.
# Its axes are so many that their choice adds little: with 16 axes, the error of a block of a
# hundred grains would scatter by a quarter.
PART_REPLICATES, PART_AXES = range(4), 96
# most chords of this scan; lines are set further apart to keep to it
MOST_CHORDS = 1e9
# p-value below which a sample is reported as not homogeneous
UNLIKELY = 0.01
# degrees of freedom of the error of a block: its number of parts minus one
FREEDOM = 7.0


def map_rows(
    sample: Sample, plan: Plan, known: Mapping[str, Any], where: str
) -> tuple[list[Row], tuple[Note, ...], tuple[Blocks, Blocks]]:
    """
    Map one frame that has grains.

    Parameters
    ----------
    sample, plan
        Sample and plan of the frame, with its windows.
    known : mapping
        Values by column that are the same in all rows of the frame.
    where : str
        Name of the frame in the log.

    Returns
    -------
    rows : list of Row
    notes : tuple of Note
        Doubts about the rows.
    blocks : two Blocks
        Blocks of the whole sample and of the RV.
    """
    blocks = tilings(plan, sample.packing.cell)
    scan, aims = partial(_scan_blocks, blocks), dict.fromkeys(plan.variants, plan.settings.aim())
    rows, notes = list[Row](), list[Note]()
    for part in plan.scans():
        solids = solids_of(sample, part.window, variants=part.variants, edge=part.settings.edge)
        sums, final, missed = scan_to_tolerance(solids, part, aims, where, scan, _median_errors)
        parts, notes = _scan_parts(solids, final, blocks, sums), [*notes, *missed]
        for name in part.variants:
            variant, own = VARIANTS[name], blocks[VARIANTS[name].in_window]
            mapped = VariantMap(sample, final, solids, variant, own, sums, parts[name])
            rows += [row_of(plan.settings.columns, {**known, **row}) for row in mapped.rows()]
            notes += mapped.notes()
    return rows, joined(notes), blocks


def tilings(plan: Plan, cell: Cell | None) -> tuple[Blocks, Blocks]:
    """The blocks of the whole sample and of the RV in a frame with this cell."""
    assert plan.map_blocks is not None
    whole = plan.map_blocks.of_whole(cell)
    return whole, whole if plan.window is None else plan.map_blocks.of_window(plan.window)


def places_of(blocks: Blocks) -> dict[str, FloatArray | IntArray]:
    """The columns that say where each block lies, shape (B,)."""
    columns = {"block": np.arange(len(blocks)), **dict(zip("xyz", blocks.middles.T, strict=True))}
    if blocks.radius:
        columns |= {"r_inner": blocks.bounds[:-1], "r_outer": blocks.bounds[1:]}
    return columns


@dataclass(frozen=True, eq=False)
class MapSums(ScanSums):
    """Sums of the scan of a map, with the fabric of each block."""

    fabrics: dict[str, BlockFabrics]
    """Fabrics of the blocks, by variant."""


def _scan_blocks(
    blocks: tuple[Blocks, Blocks],
    solids: Solids,
    plan: Plan,
    replicates: range,
    most_steps: float = math.inf,
) -> MapSums:
    """Scan one replicate after the other; sums by axis of all together would be too large."""
    parts = []
    for replicate in replicates:
        sums = gap_scan(solids, plan, blocks, [plan.cutoff], [replicate], most_steps)
        most_steps -= float(sums.scan.steps.sum())
        fabrics = {}
        for name in plan.variants:
            own = sums.in_blocks(name, 0, plan.settings.moment)
            # the numbers of the second moment are sums of lengths
            segments = sums.in_blocks(name)[1].sum(axis=1)
            fabric = block_fabrics(sums.axes, sums.weights, *own)
            fabrics[name] = replace(fabric, segments=segments)
        parts.append(MapSums(**vars(sums.scan), fabrics=fabrics))
    whole: MapSums = concatenated(parts)
    return whole


def _median_errors(sums: MapSums, plan: Plan, variant: str) -> Errors:
    """Median error of the blocks with segments; over many blocks it is certain enough."""
    fabrics = sums.fabrics[variant]
    is_met = fabrics.is_met
    if not is_met.any():
        return Errors(math.inf, math.inf, 1.0)
    errors = fabrics.axial_errors(np.asarray(plan.settings.axis))
    median = float(np.median(np.where(fabrics.exists, errors, np.inf)[is_met]))
    return Errors(median, median, float(np.median(fabrics.filled.mean(axis=0)[is_met])))


@dataclass(frozen=True, eq=False)
class PartSums:
    """Results for the eight parts of each block of a variant; shapes (R, B, 8)."""

    rest: BlockFabrics
    """Fabrics of the blocks without each part."""
    segments: FloatArray
    """Number of kept segments in each part."""
    void: FloatArray
    """Volume of void whose segments have their middle in each part."""


def _scan_parts(
    solids: Solids, plan: Plan, blocks: tuple[Blocks, Blocks], before: ScanSums
) -> dict[str, PartSums]:
    """Scan fewer lines, with blocks in eight parts, for errors due to the sample and the void."""
    rule, replicates = design_of(PART_AXES), []
    most = min(MOST_CHORDS, plan.max_chords)
    spacing = coarse_spacing(solids, len(PART_REPLICATES) * len(rule), plan, most, before)
    finer, cutoffs = (blocks[0].finer(), blocks[1].finer()), [0.0, plan.cutoff]
    lines, clipped = replace(plan, rule=rule, spacing=spacing), replace(solids, edge=CLIP)
    for replicate in PART_REPLICATES:
        sums = voids = gap_scan(solids, lines, finer, cutoffs, [replicate])
        if solids.edge == START:
            # this edge rule also counts the parts of segments outside the window
            voids = gap_scan(clipped, lines, finer, cutoffs, [replicate])
        variants = {}
        for name in plan.variants:
            by_part = blocks[name in "cd"].by_part
            length, number = map(by_part, sums.in_blocks(name, 1, plan.settings.moment))
            rest = length.sum(axis=-1, keepdims=True) - length
            # rounding must not leave negative numbers
            left = np.maximum(number.sum(axis=-1, keepdims=True) - number, 0.0)
            void = np.einsum("d,rdbp->rbp", rule.weights, by_part(voids.in_blocks(name)[0]))
            void *= spacing**2 / rule.weights.sum()
            without = block_fabrics(sums.axes, rule.weights, rest, left)
            variants[name] = PartSums(without, number.sum(axis=1), void)
        replicates.append(variants)
    whole: dict[str, PartSums] = concatenated(replicates)
    return whole


@dataclass(frozen=True)
class VariantMap:
    """All blocks of one variant."""

    sample: Sample
    plan: Plan
    """The plan with the final rule and spacing."""
    solids: Solids
    variant: Variant
    blocks: Blocks
    """Blocks in the dump's coordinates."""
    scan: MapSums
    parts: PartSums

    @property
    def window(self) -> Window | None:
        """The RV; None for the whole."""
        return self.plan.window if self.variant.in_window else None

    @property
    def fabrics(self) -> BlockFabrics:
        """Void fabrics of the blocks."""
        return self.scan.fabrics[self.variant.name]

    @cached_property
    def at_surface(self) -> BoolArray:
        """Which blocks lie so near to a surface that they lose segments, shape (B,)."""
        window, inner, edge = self.window, self.solids.inner, self.plan.settings.edge
        if window is not None and edge == START:
            # segments are followed beyond the RV, and each end counts in the block that holds it
            return np.zeros(len(self.blocks), bool)
        if window is None and edge == ENDS and inner is not None:
            window = Window(inner.center + self.solids.origin, inner.shape)
        return near_surface(self.blocks, self.sample, window)

    def rows(self) -> Iterator[dict[str, Any]]:
        """Values of each block, by column."""
        blocks, sample, fabrics, plan = self.blocks, self.sample, self.fabrics, self.plan
        axis, replicates = np.asarray(plan.settings.axis), self.scan.replicates
        chosen = sample.fabric_contacts(self.variant, self.window)
        normals = compressed(chosen, sample.contacts.normal)
        points = self._placed(compressed(chosen, sample.contacts.point))
        along = SPACE.axial((normals @ axis) ** 2)
        of_contacts = self._by_part(points, along, np.ones(len(along)))
        arrays: dict[str, Any] = {
            **places_of(blocks),
            **self.grains,
            **self.void,
            **self._solid_fraction(),
            "alpha_c_axial_sample_se": ratio_with_errors(*of_contacts)[1],
            "segments": fabrics.segments.sum(axis=0).astype(np.int64),
            "at_surface": self.at_surface.astype(np.int64),
        }
        number, tensors = blocks.of(points), fabrics.tensors.mean(axis=0)
        for block, exists in enumerate(self.exists):
            own = normals[number == block]
            # rows hold None in place of NaN
            values = {name: array[block].item() for name, array in arrays.items()}
            yield {
                "variant": self.variant.name,
                "directions": len(plan.rule),
                "replicates": replicates,
                "spacing": plan.spacing / math.sqrt(replicates),
                "cutoff": plan.cutoff,
                "edge": edge_of(self.variant, plan, self.solids),
                "contacts": len(own),
                **tensor_values("c", contact_fabric(own), axis),
                "alpha_c_axial_se": axial_error(own, axis),
                **tensor_values("vs", FabricTensor(tensors[block]) if exists else None, axis),
                **{name: None if value != value else value for name, value in values.items()},
            }

    def _placed(self, points: FloatArray) -> FloatArray:
        """The images of points that lie in the window, or are next to it."""
        return points if self.window is None else self.window.placed(points, self.sample.packing)

    def _by_part(self, points: FloatArray, *values: Any) -> list[FloatArray]:
        """Sums of values over points, by the block and part that hold the points, (B, 8) each."""
        number, count = self.blocks.finer().of(points), 8 * len(self.blocks)
        inside = number >= 0
        sums = (np.bincount(number[inside], array[inside], count) for array in values)
        return [self.blocks.by_part(array.astype(np.float64)) for array in sums]

    @cached_property
    def exists(self) -> BoolArray:
        """Which blocks have a void fabric, shape (B,): not those that hold no centre of a grain."""
        return np.asarray(self.fabrics.exists & (self.grains["grains"] > 0))

    @cached_property
    def grains(self) -> dict[str, Any]:
        """Columns of grains; the coordination of a block without grains is NaN."""
        sample, variant, bodies = self.sample, self.variant, self.sample.packing.bodies
        places = sample.packing.position if bodies is None else bodies.place
        # a clump is one grain at its centre
        rows = np.flatnonzero(sample.once(sample.counted(variant, self.window)))
        solid = ~sample.removed(variant)[rows]
        numbers = solid * sample.numbers_of(variant)[rows]
        grains, contacts, rattlers = self._by_part(
            self._placed(places[rows]), solid, numbers, sample.rattlers[rows]
        )
        coordination, error = ratio_with_errors(contacts, grains)
        return {
            "grains": grains.sum(axis=1).astype(np.int64),
            "rattlers": rattlers.sum(axis=1).astype(np.int64),
            "coordination": coordination,
            "coordination_se": error,
        }

    @cached_property
    def void(self) -> dict[str, FloatArray]:
        """Columns of the void fabric and its errors; NaN for blocks without a fabric."""
        fabrics, rest, axis = self.fabrics, self.parts.rest, np.asarray(self.plan.settings.axis)
        held = self.parts.segments.sum(axis=0) > 0
        columns = {
            "mean_length": ratio(fabrics.length.sum(axis=0), fabrics.number.sum(axis=0)),
            "alpha_vs_axial": axial(fabrics.tensors.mean(axis=0), axis),
            "alpha_vs_axial_se": fabrics.axial_errors(axis),
            "alpha_vs_axial_sample_se": part_errors(axial(rest.tensors, axis), held),
            "mean_length_se": part_errors(ratio(rest.length, rest.number), held),
        }
        return {name: np.where(self.exists, values, np.nan) for name, values in columns.items()}

    def _solid_fraction(self) -> dict[str, FloatArray]:
        """1 - volume of the void in the block / volume of the block inside the window."""
        void, radius = self.parts.void, self.sample.packing.radius[self.sample.grains]
        volumes = volumes_inside(self.blocks, self.window)
        volume = volumes.sum(axis=1)
        # outside an open sample, void is not defined
        known = (volume > 0) & ((self.window is not None) | ~self.at_surface)
        if self.window is not None or self.at_surface.any():
            # A surface removes the segments that reach it, and the middles of long segments lie
            # far inside. So the fraction is left out if segments are longer than a block. Their
            # mean length without a cut-off follows roughly from the volumes of the grains.
            solid = float(np.sum(self.grains["grains"]) * np.mean(SPACE.volume(radius)))
            chord = 4.0 * float(np.sum(radius**3) / (3.0 * np.sum(radius**2)))
            free = chord * max(float(volumes.sum()) - solid, 0.0)
            known &= free <= solid * self.blocks.heights.min()
        left, total = volume[:, None] - volumes, void.sum(axis=2)
        without = 1.0 - ratio(total[..., None] - void, left)
        error = part_errors(without, (volumes > 0) & (left > 0))
        return {
            "solid_fraction": np.where(known, 1.0 - ratio(total.mean(axis=0), volume), np.nan),
            "solid_fraction_se": np.where(known, error, np.nan),
        }

    def notes(self) -> Iterator[Note]:
        """Notes on doubtful lines and blocks, and on the homogeneity of the sample."""
        fabrics, variant = self.fabrics, self.variant
        # the scan of all gaps counts the kept ones by block
        kept = float(fabrics.segments.sum())
        left_out = left_out_of(self.scan, variant, edge_of(variant, self.plan, self.solids), kept)
        texts = doubts_of_lines(self.scan, variant, left_out)
        without_grains = self.grains["grains"] == 0
        lacking, bare = int((~self.exists).sum()), int(without_grains.sum())
        empty = int((~fabrics.is_met & ~without_grains).sum())
        if lacking:
            texts["few_segments"] = (
                f"{lacking} of {counted(len(self.blocks), 'block')} have no void fabric: {bare} "
                f"hold no centre of a grain, {empty} have no void segment, "
                f"{lacking - bare - empty} have none in over 5 % of the directions: choose fewer "
                f"blocks, closer lines (`spacing`), a shorter `cutoff`, or another frame for their "
                f"place (such as `reference=-1`)"
            )
        solid = self.sample.counted(variant, self.window) & ~self.sample.removed(variant)
        grains = self.sample.number(solid)
        outside = grains - int(self.grains["grains"].sum())
        # shells leave out the corners of the sample, and the blocks of an RV what lies outside it
        if outside and self.window is None and not self.blocks.radius:
            texts["outside"] = (
                f"{outside} of {grains} grains lie outside the blocks, which are those of the "
                f"reference frame: `reference=-1` takes the last frame"
            )
        notes = [Note(code, text, (variant.name,)) for code, text in texts.items()]
        return iter([*notes, self._homogeneity()])

    def _homogeneity(self) -> Note:
        """The result of the test for homogeneity; a warning only if the sample is not."""
        inner = self.exists & ~self.at_surface
        values = np.where(inner, self.void["alpha_vs_axial"], np.nan)
        variances = self.void["alpha_vs_axial_sample_se"] ** 2
        variances = variances + np.nan_to_num(self.void["alpha_vs_axial_se"]) ** 2
        test = homogeneity_of(values, variances, self.fabrics.segments.sum(axis=0), FREEDOM)
        if test is not None:
            chance = "p < 0.0001" if test.chance < 1e-4 else f"p = {test.chance:.2g}"
            is_homogeneous = test.chance >= UNLIKELY
            result = "as in a homogeneous" if is_homogeneous else "this is not a homogeneous"
            text = (
                f"alpha_vs_axial of {test.blocks} blocks scatters {test.ratio:.2g} times as much "
                f"as their errors explain ({chance}): {result} sample"
            )
            kind = ScanfabNote if is_homogeneous else ScanfabWarning
            # each frame has its own numbers, so it is told on its own
            return Note(text, text, (self.variant.name,), kind)
        text = "too few blocks to tell whether the sample is homogeneous"
        if self.at_surface.any():
            text += f": {inner.sum()} of {len(inner)} are neither empty nor at a surface"
            text += ' (blocks inside the RV are not: `variants="c"` with `edge="start"`)'
        return Note("few_blocks", text, (self.variant.name,), ScanfabNote)
