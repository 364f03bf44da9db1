"""The rows of one frame of a map: one for each variant and block."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from scanfab.base.errors import Note, joined
from scanfab.base.space import SPACE
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray
from scanfab.fabric.contact import axial_error, contact_fabric
from scanfab.fabric.errors import homogeneity_of, part_errors, ratio, ratio_with_errors
from scanfab.fabric.tensor import FabricTensor, axial, tensor_values
from scanfab.packing.sample import VARIANTS, Sample, Variant
from scanfab.pipeline.maps.measurement import MapMeasurement, measure_map
from scanfab.pipeline.maps.region import Region
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.variant_columns import doubts_of_lines, edge_of, left_out_of
from scanfab.scan.blocks import Blocks
from scanfab.table.columns import row_of
from scanfab.table.row import Row

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
    assert plan.map_settings is not None
    found = measure_map(sample, plan, where)
    variants = [VARIANTS[name] for name in plan.variants]
    regions = {kind: Region.of(sample, found, kind) for kind in {one.in_window for one in variants}}
    rows, notes = [], [*found.notes]
    for variant in variants:
        one = BlocksOfVariant(found, regions[variant.in_window], variant)
        same = {**known, "variant": variant.name}
        rows += [row_of(plan.map_settings.columns, {**same, **own}) for own in one.rows()]
        notes += one.notes()
    return rows, joined(notes), found.blocks


class BlocksOfVariant:
    """All blocks of one variant."""

    def __init__(self, measured: MapMeasurement, region: Region, variant: Variant) -> None:
        self.region, self.variant = region, variant
        self.sample, self.blocks = region.sample, region.blocks
        self.plan, self.scan = measured.plan, measured.sums
        self.fabrics = measured.sums.fabrics[variant.name]
        self.parts = measured.parts[variant.name]
        self.axis = np.asarray(self.plan.axis)
        self.edge = edge_of(variant, self.plan, measured.solids)

    def rows(self) -> Iterator[dict[str, Any]]:
        """The values of each block by their columns."""
        blocks, fabrics = self.blocks, self.fabrics
        same = {
            "directions": len(self.plan.rule),
            "replicates": self.scan.replicates,
            "spacing": self.plan.spacing / math.sqrt(self.scan.replicates),
            "cutoff": self.plan.cutoff,
            "edge": self.edge,
        }
        arrays: dict[str, Any] = {
            "block": np.arange(len(blocks)),
            **dict(zip("xyz", blocks.middles.T, strict=True)),
            **self.grains,
            **self.void,
            **self._solid_fraction(),
            "segments": fabrics.segments.sum(axis=0).astype(np.int64),
            "at_surface": self.region.at_surface.astype(np.int64),
        }
        if blocks.radius:
            arrays |= {"r_inner": blocks.bounds[:-1], "r_outer": blocks.bounds[1:]}
        listed = {name: _without_nan(values) for name, values in arrays.items()}
        tensors, exists = fabrics.tensors.mean(axis=0), fabrics.exists
        for block, contacts in enumerate(self._contacts()):
            tensor = FabricTensor(tensors[block]) if exists[block] else None
            own = {name: values[block] for name, values in listed.items()}
            yield {**same, **tensor_values("vs", tensor, self.axis), **contacts, **own}

    @cached_property
    def void(self) -> dict[str, FloatArray]:
        """Columns of the void fabric and its errors; NaN where there is none."""
        fabrics, rest = self.fabrics, self.parts.rest
        held = self.parts.segments.sum(axis=0) > 0
        found = {
            "mean_length": ratio(fabrics.length.sum(axis=0), fabrics.number.sum(axis=0)),
            "alpha_vs_axial": axial(fabrics.tensors.mean(axis=0), self.axis),
            "alpha_vs_axial_se": fabrics.axial_errors(self.axis),
            "alpha_vs_axial_sample_se": part_errors(axial(rest.tensors, self.axis), held),
            "mean_length_se": part_errors(ratio(rest.length, rest.number), held),
        }
        return {name: np.where(fabrics.exists, values, np.nan) for name, values in found.items()}

    @cached_property
    def grains(self) -> dict[str, Any]:
        """Columns of grains; coordination is NaN without any."""
        sample, variant = self.sample, self.variant
        bodies = sample.packing.bodies
        places = sample.packing.position if bodies is None else bodies.place
        # a clump is one grain, where its middle is
        rows = np.flatnonzero(sample.once(sample.counted(variant, self.plan.window)))
        solid = ~sample.removed(variant)[rows]
        grains, contacts, rattlers = self.region.sums(
            places[rows], solid, solid * sample.numbers_of(variant)[rows], sample.rattlers[rows]
        )
        coordination, error = ratio_with_errors(contacts, grains)
        return {
            "grains": grains.sum(axis=1).astype(np.int64),
            "rattlers": rattlers.sum(axis=1).astype(np.int64),
            "coordination": coordination,
            "coordination_se": error,
        }

    def _contacts(self) -> Iterator[dict[str, Any]]:
        """Columns of the contact fabric of each block."""
        chosen = self.sample.fabric_contacts(self.variant, self.plan.window)
        normals = np.compress(chosen, self.sample.contacts.normal, axis=0)
        points = np.compress(chosen, self.sample.contacts.point, axis=0)
        along = SPACE.axial((normals @ self.axis) ** 2)
        _, errors = ratio_with_errors(*self.region.sums(points, along, np.ones(len(along))))
        block = self.blocks.of(self.region.placed(points))
        order = np.argsort(block, kind="stable")
        starts = np.searchsorted(block[order], np.arange(len(self.blocks) + 1))
        # before the first and behind the last are those that are in no block
        groups = np.split(normals[order], starts)[1:-1]
        for own, error in zip(groups, _without_nan(errors), strict=True):
            yield {
                "contacts": len(own),
                **tensor_values("c", contact_fabric(own), self.axis),
                "alpha_c_axial_se": axial_error(own, self.axis),
                "alpha_c_axial_sample_se": error,
            }

    def _solid_fraction(self) -> dict[str, FloatArray]:
        """1 - void with its middle in the block / volume of the block in the window."""
        region, void = self.region, self.parts.void
        every = region.volumes.sum(axis=1)
        known = every > 0
        if region.window is None:
            # beyond an open sample nobody knows what is void
            known &= ~region.at_surface
        if region.window is not None or region.at_surface.any():
            # a surface takes segments that reach it, and long ones have their middles far inside
            known &= self._void_length() <= self.blocks.heights.min()
        left = every[:, None] - region.volumes
        total = void.sum(axis=2)
        without = 1.0 - ratio(total[..., None] - void, left)
        found = {
            "solid_fraction": 1.0 - ratio(total.mean(axis=0), every),
            "solid_fraction_se": part_errors(without, (region.volumes > 0) & (left > 0)),
        }
        return {name: np.where(known, values, np.nan) for name, values in found.items()}

    def _void_length(self) -> float:
        """The mean length of void segments without a cut-off, roughly, from the grains' volumes."""
        radius = self.sample.packing.radius[self.sample.grains]
        solid = float(np.sum(self.grains["grains"]) * np.mean(SPACE.volume(radius)))
        if solid == 0.0:
            return math.inf
        chord = 4.0 * float(np.sum(radius**3) / (3.0 * np.sum(radius**2)))
        return chord * max(float(self.region.volumes.sum()) - solid, 0.0) / solid

    def notes(self) -> Iterator[Note]:
        """Lines and blocks that are doubtful, and whether the sample is homogeneous."""
        kept = float(self.fabrics.segments.sum())
        left_out = left_out_of(self.scan, self.variant, self.edge, kept)
        texts = doubts_of_lines(self.scan, self.variant, left_out)
        texts |= {"few_segments": self._too_few(), HOMOGENEITY: self._homogeneity()}
        return (Note(code, text, (self.variant.name,)) for code, text in texts.items() if text)

    def _too_few(self) -> str:
        lacking, empty = (int((~one).sum()) for one in (self.fabrics.exists, self.fabrics.is_met))
        if not lacking:
            return ""
        return (
            f"{lacking} of {counted(len(self.blocks), 'block')} have no void fabric: {empty} hold "
            f"no void segment at all, {lacking - empty} none in more than 5 % of the directions: "
            f"choose fewer blocks, closer lines (`spacing`, `tolerance`) or a shorter `cutoff`"
        )

    def _homogeneity(self) -> str:
        """What the test says, in words."""
        at_surface = self.region.at_surface
        inner = self.fabrics.exists & ~at_surface
        values = np.where(inner, self.void["alpha_vs_axial"], np.nan)
        variances = self.void["alpha_vs_axial_sample_se"] ** 2
        variances = variances + np.nan_to_num(self.void["alpha_vs_axial_se"]) ** 2
        test = homogeneity_of(values, variances, self.fabrics.segments.sum(axis=0), FREEDOM)
        if test is None and not at_surface.any():
            return "too few blocks to tell whether the sample is homogeneous"
        if test is None:
            better = "" if self.variant.in_window else "those of the RV by `variants=c` and "
            but = f" but {inner.sum()}" if inner.any() else ""
            return (
                f"whether the sample is homogeneous cannot be told: all blocks{but} are at a "
                f"surface or empty: choose smaller blocks, or {better}`edge=start`"
            )
        chance = "p < 0.0001" if test.chance < 1e-4 else f"p = {test.chance:.2g}"
        sign = "" if test.chance < UNLIKELY else "no sign that "
        return (
            f"alpha_vs_axial of {test.blocks} blocks scatters {test.ratio:.2g} times as much as "
            f"their errors explain ({chance}): {sign}the sample is not homogeneous"
        )


def _without_nan(values: Any) -> list[Any]:
    """An array as rows have it: None for NaN."""
    return [None if one != one else one for one in values.tolist()]
