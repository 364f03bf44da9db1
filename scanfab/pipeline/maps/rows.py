"""One frame scanned block by block: a row for each variant and block, with both of its errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from scanfab.base.arrays import concatenated
from scanfab.base.errors import Note, joined
from scanfab.base.space import SPACE
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.contact import axial_error, contact_fabric
from scanfab.fabric.errors import homogeneity_of, part_errors, ratio, ratio_with_errors
from scanfab.fabric.tensor import FabricTensor, axial, tensor_values
from scanfab.fabric.void import BlockFabrics, block_fabrics
from scanfab.packing.sample import VARIANTS, Sample, Variant
from scanfab.packing.window import Window
from scanfab.pipeline.maps.blocks import hull_of, near_surface, surface_of, volumes_inside
from scanfab.pipeline.measurement import coarse_spacing, gap_scan, solids_of
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.tolerance import Errors, Goal, scan_to_tolerance
from scanfab.pipeline.variant_columns import doubts_of_lines, edge_of, left_out_of
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import design_of
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids
from scanfab.table.columns import row_of
from scanfab.table.row import Row

# Of the scan for the sample's scatter in each block: replicates, from which its noise is known, and
# axes, so many that the choice of them adds little: along 16 the error of a block of a hundred
# grains would scatter by a quarter of its value.
PART_REPLICATES, PART_AXES = 4, 96
# chords that it may cut: lines are set further apart where there would be more
MOST_CHORDS = 1e9
HOMOGENEITY = "homogeneity"
"""The code of a note: whether the blocks of a variant scatter more than their errors."""
# the chance below which a sample is said not to be homogeneous
UNLIKELY = 0.01
# parts of a block, less one
FREEDOM = 7.0


def map_rows(
    sample: Sample, plan: Plan, known: Mapping[str, Any], where: str
) -> tuple[list[Row], tuple[Note, ...], tuple[Blocks, Blocks]]:
    """
    Map one frame that has grains.

    Parameters
    ----------
    sample, plan
        Of the frame, with its windows.
    known : mapping
        The columns that are the same in all rows of the frame.
    where : str
        Names the frame where progress is told.

    Returns
    -------
    rows : list of Row
    notes : tuple of Note
        What is doubtful about them.
    blocks : two Blocks
        Of the whole sample and of the RV.
    """
    settings, map_blocks = plan.map_settings, plan.map_blocks
    assert settings is not None
    assert map_blocks is not None
    solids = solids_of(sample, plan.window, variants=plan.variants, edge=plan.edge)
    whole = map_blocks.of_whole(sample.packing.cell)
    blocks = whole, whole if plan.window is None else map_blocks.of_window(plan.window)
    sums, plan, notes = scan_to_tolerance(solids, plan, where, MedianBlock(blocks))
    parts = _part_sums(solids, plan, blocks, sums)
    rows = []
    for name in plan.variants:
        variant = VARIANTS[name]
        one = BlocksOfVariant(
            sample, plan, solids, variant, blocks[variant.in_window], sums, parts[name]
        )
        values = ({**known, "variant": name, **own} for own in one.rows())
        rows += [row_of(settings.columns, own) for own in values]
        notes += one.notes()
    return rows, joined(notes), blocks


@dataclass(frozen=True, eq=False)
class MapSums(ScanSums):
    """What the scan of a map adds up: beside the sums of all blocks the fabric of each."""

    fabrics: dict[str, BlockFabrics]
    """Of each variant."""


@dataclass(frozen=True, eq=False)
class MedianBlock(Goal):
    """The error of the median block of each variant is to meet the tolerance."""

    blocks: tuple[Blocks, Blocks]
    """Of the whole and of the window, in the dump's coordinates."""

    def scan(
        self, solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
    ) -> MapSums:
        """As planned; replicate by replicate, as the sums of all their axes would be too many."""
        weights, moment, parts = plan.rule.weights, plan.moment, []
        scan = partial(gap_scan(solids, plan, self.blocks, [plan.cutoff]), plan.rule)
        for one in replicates:
            sums = scan(spacing=plan.spacing, replicates=[one], most_steps=most_steps)
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


@dataclass(frozen=True, eq=False)
class PartSums:
    """What the scan of the eight parts of the blocks tells of one variant; shapes (R, B, 8)."""

    rest: BlockFabrics
    """The fabrics without each part."""
    segments: FloatArray
    """Kept segments in each part."""
    void: FloatArray
    """Volume of the void with its middle in each part."""


def _part_sums(
    solids: Solids, plan: Plan, blocks: tuple[Blocks, Blocks], before: ScanSums
) -> dict[str, PartSums]:
    """A scan of fewer lines, each block in eight parts, for the sample's scatter and the void."""
    rule, parts = design_of(PART_AXES), []
    most = min(MOST_CHORDS, plan.max_chords)
    spacing = coarse_spacing(solids, PART_REPLICATES * len(rule), before, plan, most)
    finer = blocks[0].finer(), blocks[1].finer()
    scan, clipped = (
        gap_scan(one, plan, finer, [0.0, plan.cutoff])
        for one in (solids, replace(solids, edge=CLIP))
    )
    for replicate in range(PART_REPLICATES):
        sums = voids = scan(rule, spacing=spacing, replicates=[replicate])
        if solids.edge == START:
            # by this rule segments count with what is outside the window, too
            voids = clipped(rule, spacing=spacing, replicates=[replicate])
        found = {}
        for name in plan.variants:
            by_part = blocks[name in "cd"].by_part
            length, number = map(by_part, sums.in_blocks(name, 1, plan.moment))
            rest = length.sum(axis=-1, keepdims=True) - length
            # what rounding leaves of nothing is none
            left = np.maximum(number.sum(axis=-1, keepdims=True) - number, 0.0)
            void = np.einsum("d,rdbp->rbp", rule.weights, by_part(voids.in_blocks(name)[0]))
            void *= spacing**2 / rule.weights.sum()
            without = block_fabrics(sums.axes, rule.weights, rest, left)
            found[name] = PartSums(without, number.sum(axis=1), void)
        parts.append(found)
    whole: dict[str, PartSums] = concatenated(parts)
    return whole


@dataclass(frozen=True)
class BlocksOfVariant:
    """All blocks of one variant."""

    sample: Sample
    plan: Plan
    """With the rule and the spacing as they were in the end."""
    solids: Solids
    variant: Variant
    blocks: Blocks
    """In the dump's coordinates."""
    scan: MapSums
    parts: PartSums

    @property
    def window(self) -> Window | None:
        """The RV; None for the whole."""
        return self.plan.window if self.variant.in_window else None

    @property
    def fabrics(self) -> BlockFabrics:
        """The void fabrics."""
        return self.scan.fabrics[self.variant.name]

    @cached_property
    def at_surface(self) -> BoolArray:
        """Which blocks lie so near to a surface that they lose segments, shape (B,)."""
        mean = float(self.sample.packing.radius[self.sample.gathered].mean())
        window, inner = self.window, self.solids.inner
        if window is not None and self.plan.edge == START:
            # segments are followed beyond the RV, and each end counts in the block that it is in
            return np.zeros(len(self.blocks), bool)
        if window is None and self.plan.edge == ENDS and inner is not None:
            window = Window(inner.center + self.solids.origin, inner.shape)
        surface = hull_of(self.sample) if window is None else surface_of(window)
        return near_surface(self.blocks, *surface, mean)

    def rows(self) -> Iterator[dict[str, Any]]:
        """The values of each block by their columns."""
        blocks, sample, fabrics = self.blocks, self.sample, self.fabrics
        axis, plan, replicates = np.asarray(self.plan.axis), self.plan, self.scan.replicates
        chosen = sample.fabric_contacts(self.variant, self.window)
        normals = np.compress(chosen, sample.contacts.normal, axis=0)
        points = self._placed(np.compress(chosen, sample.contacts.point, axis=0))
        along = SPACE.axial((normals @ axis) ** 2)
        arrays: dict[str, Any] = {
            "block": np.arange(len(blocks)),
            **dict(zip("xyz", blocks.middles.T, strict=True)),
            **self.grains,
            **self.void,
            **self._solid_fraction(),
            "alpha_c_axial_sample_se": ratio_with_errors(
                *self._by_part(points, along, np.ones(len(along)))
            )[1],
            "segments": fabrics.segments.sum(axis=0).astype(np.int64),
            "at_surface": self.at_surface.astype(np.int64),
        }
        if blocks.radius:
            arrays |= {"r_inner": blocks.bounds[:-1], "r_outer": blocks.bounds[1:]}
        # rows have None in the place of NaN
        listed = {
            name: [None if one != one else one for one in values.tolist()]
            for name, values in arrays.items()
        }
        number = blocks.of(points)
        order = np.argsort(number, kind="stable")
        starts = np.searchsorted(number[order], np.arange(len(blocks) + 1))
        # without the contacts before the first block, which are in none
        groups = np.split(normals[order], starts)[1:-1]
        tensors = fabrics.tensors.mean(axis=0)
        for block, (own, exists) in enumerate(zip(groups, fabrics.exists, strict=True)):
            yield {
                "directions": len(plan.rule),
                "replicates": replicates,
                "spacing": plan.spacing / math.sqrt(replicates),
                "cutoff": plan.cutoff,
                "edge": edge_of(self.variant, plan, self.solids),
                "contacts": len(own),
                **tensor_values("c", contact_fabric(own), axis),
                "alpha_c_axial_se": axial_error(own, axis),
                **tensor_values("vs", FabricTensor(tensors[block]) if exists else None, axis),
                **{name: values[block] for name, values in listed.items()},
            }

    def _placed(self, points: FloatArray) -> FloatArray:
        """The images of places that are next to the window's centre."""
        if self.window is None:
            return points
        return self.window.center + self.window.branches(points, self.sample.packing)

    def _by_part(self, points: FloatArray, *values: Any) -> list[FloatArray]:
        """Sums of values by the block and part that their places lie in, shape (B, 8) each."""
        number, count = self.blocks.finer().of(points), 8 * len(self.blocks)
        inside = number >= 0
        found = (np.bincount(number[inside], one[inside], count) for one in values)
        return [self.blocks.by_part(one.astype(np.float64)) for one in found]

    @cached_property
    def grains(self) -> dict[str, Any]:
        """Columns of grains; coordination is NaN without any."""
        sample, variant, bodies = self.sample, self.variant, self.sample.packing.bodies
        places = sample.packing.position if bodies is None else bodies.place
        # a clump is one grain, where its middle is
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
        """Columns of the void fabric and its errors; NaN where there is none."""
        fabrics, rest, axis = self.fabrics, self.parts.rest, np.asarray(self.plan.axis)
        held = self.parts.segments.sum(axis=0) > 0
        found = {
            "mean_length": ratio(fabrics.length.sum(axis=0), fabrics.number.sum(axis=0)),
            "alpha_vs_axial": axial(fabrics.tensors.mean(axis=0), axis),
            "alpha_vs_axial_se": fabrics.axial_errors(axis),
            "alpha_vs_axial_sample_se": part_errors(axial(rest.tensors, axis), held),
            "mean_length_se": part_errors(ratio(rest.length, rest.number), held),
        }
        return {name: np.where(fabrics.exists, values, np.nan) for name, values in found.items()}

    def _solid_fraction(self) -> dict[str, FloatArray]:
        """1 - void with its middle in the block / volume of the block in the window."""
        void = self.parts.void
        volumes = volumes_inside(self.blocks, self.window)
        every = volumes.sum(axis=1)
        known = every > 0
        if self.window is None:
            # beyond an open sample nobody knows what is void
            known &= ~self.at_surface
        if self.window is not None or self.at_surface.any():
            # A surface takes segments that reach it, and long ones have their middles far inside.
            # Their mean length without a cut-off follows roughly from the grains' volumes.
            radius = self.sample.packing.radius[self.sample.grains]
            solid = float(np.sum(self.grains["grains"]) * np.mean(SPACE.volume(radius)))
            chord = 4.0 * float(np.sum(radius**3) / (3.0 * np.sum(radius**2)))
            free = chord * max(float(volumes.sum()) - solid, 0.0)
            known &= free <= solid * self.blocks.heights.min()
        left, total = every[:, None] - volumes, void.sum(axis=2)
        without = 1.0 - ratio(total[..., None] - void, left)
        found = {
            "solid_fraction": 1.0 - ratio(total.mean(axis=0), every),
            "solid_fraction_se": part_errors(without, (volumes > 0) & (left > 0)),
        }
        return {name: np.where(known, values, np.nan) for name, values in found.items()}

    def notes(self) -> Iterator[Note]:
        """Lines and blocks that are doubtful, and whether the sample is homogeneous."""
        fabrics, variant = self.fabrics, self.variant
        kept = float(fabrics.segments.sum())
        left_out = left_out_of(self.scan, variant, edge_of(variant, self.plan, self.solids), kept)
        texts = doubts_of_lines(self.scan, variant, left_out)
        lacking, empty = (int((~one).sum()) for one in (fabrics.exists, fabrics.is_met))
        if lacking:
            texts["few_segments"] = (
                f"{lacking} of {counted(len(self.blocks), 'block')} have no void fabric: {empty} "
                f"hold no void segment at all, {lacking - empty} none in more than 5 % of the "
                f"directions: choose fewer blocks, closer lines (`spacing`, `tolerance`) or a "
                f"shorter `cutoff`"
            )
        texts[HOMOGENEITY] = self._homogeneity()
        return (Note(code, text, (variant.name,)) for code, text in texts.items())

    def _homogeneity(self) -> str:
        """What the analysis of variance says, in words."""
        inner = self.fabrics.exists & ~self.at_surface
        values = np.where(inner, self.void["alpha_vs_axial"], np.nan)
        variances = self.void["alpha_vs_axial_sample_se"] ** 2
        variances = variances + np.nan_to_num(self.void["alpha_vs_axial_se"]) ** 2
        test = homogeneity_of(values, variances, self.fabrics.segments.sum(axis=0), FREEDOM)
        if test is None:
            few = "too few blocks to tell whether the sample is homogeneous"
            better = "" if self.variant.in_window else "those of the RV by `variants=c` and "
            if not self.at_surface.any():
                return few
            return (
                f"{few}: {inner.sum()} of {len(inner)} are neither empty nor at a surface: choose "
                f"smaller blocks, or {better}`edge=start`"
            )
        chance = "p < 0.0001" if test.chance < 1e-4 else f"p = {test.chance:.2g}"
        sign = "" if test.chance < UNLIKELY else "no sign that "
        return (
            f"alpha_vs_axial of {test.blocks} blocks scatters {test.ratio:.2g} times as much as "
            f"their errors explain ({chance}): {sign}the sample is not homogeneous"
        )
