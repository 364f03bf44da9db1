"""One frame of a map: from its grains and contacts to a row for each variant and block."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scanfab.base.errors import Note, joined
from scanfab.base.space import SPACE
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray
from scanfab.fabric.blocks import homogeneity_of, jackknife_errors, ratio_jackknife
from scanfab.fabric.contact import axial_error, contact_fabric
from scanfab.fabric.tensor import FabricTensor, axial, tensor_values
from scanfab.packing.packing import Packing
from scanfab.packing.sample import VARIANTS, Sample, Variant
from scanfab.pipeline.frame import (
    FrameResult,
    as_sample,
    check_space,
    frame_values,
    naming_frame,
)
from scanfab.pipeline.frames import Readable
from scanfab.pipeline.maps.measurement import MapMeasurement, measure_map
from scanfab.pipeline.maps.region import Region
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.variant_columns import doubts_of_lines, edge_of, left_out_of
from scanfab.scan.blocks import Blocks
from scanfab.table.columns import row_of

HOMOGENEITY = "homogeneity"
"""The code of a note: whether the blocks of a variant scatter more than their errors."""
# the chance below which a sample is said not to be homogeneous
UNLIKELY = 0.01
# parts of a block, less one
FREEDOM = 7.0


@dataclass(frozen=True, eq=False)
class MapResult(FrameResult):
    """The rows of one frame of a map, and where its blocks lie."""

    blocks: tuple[Blocks, Blocks] | None = None
    """Of the whole sample and of the RV; None without grains."""


def map_frame(
    frame: Packing | Sample | Readable, plan: Plan, *, number: int = 0, source: str = ""
) -> MapResult:
    """
    Map one frame of a series.

    Parameters
    ----------
    frame, plan, number, source
        As for :func:`scanfab.pipeline.frame.compute_frame`.

    Returns
    -------
    MapResult
        With rows without numbers if the frame has no grains.

    Raises
    ------
    ScanfabError
        If the frame cannot be read or measured.
    """
    sample = as_sample(frame, plan)
    with naming_frame(number):
        return _mapped(sample, plan, number, source)


def _mapped(sample: Sample, plan: Plan, number: int, source: str) -> MapResult:
    assert plan.map_settings is not None
    check_space(sample, plan)
    known = frame_values(sample, plan, number, source)
    columns = plan.map_settings.columns
    if not sample.grains.any():
        nothing = {**known, "grains": 0, "rattlers": 0, "contacts": 0}
        rows = [
            row_of(columns, {**nothing, "variant": variant, "block": block})
            for variant in plan.variants
            for block in range(plan.map_settings.blocks)
        ]
        return MapResult(source, number, sample, (), rows)
    measurement = measure_map(sample, plan.in_frame(sample), f"frame {number}")
    regions = [Region(measurement, in_window=in_window) for in_window in (False, True)]
    variants = [
        BlocksOfVariant(measurement, one, regions[one.in_window])
        for one in (VARIANTS[name] for name in plan.variants)
    ]
    rows = [
        row_of(columns, {**known, "variant": one.variant.name, **values})
        for one in variants
        for values in one.rows()
    ]
    notes = [
        *sample.doubts_of_escaped(),
        *measurement.notes,
        *joined(note for one in variants for note in one.notes()),
    ]
    return MapResult(source, number, sample, (), rows, tuple(notes), measurement.blocks)


class BlocksOfVariant:
    """All blocks of one variant."""

    def __init__(self, measurement: MapMeasurement, variant: Variant, region: Region) -> None:
        self.measurement = measurement
        self.variant = variant
        self.region = region
        self.sample, self.plan = measurement.sample, measurement.plan
        self.blocks = region.blocks
        self.fabrics = measurement.sums.fabrics[variant.name]
        self.parts = measurement.parts[variant.name]
        self.axis = np.asarray(self.plan.axis)
        self.edge = edge_of(variant, self.plan, measurement.solids)

    def rows(self) -> Iterator[dict[str, Any]]:
        """The values of each block by their columns."""
        count = len(self.blocks)
        middles = self.blocks.middles
        arrays: dict[str, Any] = {
            "block": np.arange(count),
            **dict(zip("xyz", middles.T, strict=True)),
            **self._grains,
            **self._void,
            **self._solid_fraction(),
            "segments": self.fabrics.segments.sum(axis=0).astype(np.int64),
            "at_surface": self.region.at_surface.astype(np.int64),
        }
        if self.blocks.edges is not None:
            arrays |= dict(zip(("r_inner", "r_outer"), self.blocks.radii.T, strict=True))
        scan = self.measurement.sums.scan
        same = {
            "directions": len(self.plan.rule),
            "replicates": scan.replicates,
            "spacing": self.plan.spacing / math.sqrt(scan.replicates),
            "cutoff": self.plan.cutoff,
            "edge": self.edge,
        }
        tensors, contacts = self.fabrics.tensors, self._contacts_by_block()
        for block in range(count):
            values = {name: _known(array[block]) for name, array in arrays.items()}
            tensor = FabricTensor(tensors[block]) if self.fabrics.exists[block] else None
            yield {**same, **tensor_values("vs", tensor, self.axis), **values, **contacts[block]}

    @cached_property
    def _void(self) -> dict[str, FloatArray]:
        """Columns of the void fabric and its errors; NaN where there is none."""
        fabrics, without = self.fabrics, self.parts.without
        exists = fabrics.exists
        found = {
            "mean_length": fabrics.mean_length,
            "alpha_vs_axial": axial(fabrics.tensors, self.axis),
            "alpha_vs_axial_se": fabrics.axial_errors(self.axis),
            "alpha_vs_axial_sample_se": jackknife_errors(without.axial, without.is_met),
            "mean_length_se": jackknife_errors(without.mean_length, without.is_met),
        }
        return {name: np.where(exists, values, np.nan) for name, values in found.items()}

    def _solid_fraction(self) -> dict[str, FloatArray]:
        """1 - void with its middle in the block / volume of the block in the window."""
        volumes = self.region.volumes
        void, every = self.parts.void, volumes.sum(axis=1)
        known = every > 0
        if not self.variant.in_window:
            # beyond an open sample nobody knows what is void
            known &= ~self.region.at_surface
        if self.variant.in_window or self.region.at_surface.any():
            # a surface takes segments that reach it, and long ones have their middles far inside
            known &= self._void_length() <= self.blocks.heights.min()
        share = void.sum(axis=2).mean(axis=0) / np.where(known, every, 1.0)
        parts = volumes > 0
        rest = np.where(parts, every[:, None] - volumes, 1.0)
        without = 1.0 - (void.sum(axis=2, keepdims=True) - void) / np.where(rest > 0, rest, 1.0)
        errors = jackknife_errors(without, parts & (rest > 0))
        return {
            "solid_fraction": np.where(known, 1.0 - share, np.nan),
            "solid_fraction_se": np.where(known, errors, np.nan),
        }

    def _void_length(self) -> float:
        """The mean length of void segments without a cut-off, roughly, from the grains' volumes."""
        radius = self.sample.packing.radius[self.sample.grains]
        volume = float(np.sum(self._grains["grains"]) * np.mean(SPACE.volume(radius)))
        if volume == 0.0:
            return math.inf
        chord = 4.0 * float(np.sum(radius**3) / (3.0 * np.sum(radius**2)))
        return chord * max(float(self.region.volumes.sum()) - volume, 0.0) / volume

    @cached_property
    def _grains(self) -> dict[str, Any]:
        """Columns of grains; coordination is NaN without any."""
        counted = self.sample.counted(self.variant, self.plan.window)
        removed = self.sample.removed(self.variant)
        numbers = self.sample.numbers_of(self.variant)
        bodies = self.sample.packing.bodies
        places = self.sample.packing.position if bodies is None else bodies.place
        # a clump is one grain, where its middle is
        rows = np.flatnonzero(self.sample.once(counted))
        block, part = self.region.parts_of(places[rows])
        solid = ~removed[rows]
        grains = self.region.sums(block, part, solid)
        contacts = self.region.sums(block, part, solid * numbers[rows])
        total = grains.sum(axis=1)
        mean = contacts.sum(axis=1) / np.where(total > 0, total, 1.0)
        rattlers = self.region.sums(block, part, self.sample.rattlers[rows]).sum(axis=1)
        return {
            "grains": total.astype(np.int64),
            "rattlers": rattlers.astype(np.int64),
            "coordination": np.where(total > 0, mean, np.nan),
            "coordination_se": ratio_jackknife(contacts, grains),
        }

    def _contacts_by_block(self) -> list[dict[str, Any]]:
        """Columns of the contact fabric of each block."""
        chosen = self.sample.fabric_contacts(self.variant, self.plan.window)
        contacts = self.sample.contacts
        normals = np.compress(chosen, contacts.normal, axis=0)
        block, part = self.region.parts_of(np.compress(chosen, contacts.point, axis=0))
        along = 1.5 * (normals @ self.axis) ** 2 - 0.5
        errors = ratio_jackknife(
            self.region.sums(block, part, along), self.region.sums(block, part, np.ones(len(along)))
        )
        order = np.argsort(block, kind="stable")
        ends = np.searchsorted(block[order], np.arange(len(self.blocks) + 1))
        found = []
        for number, error in enumerate(errors):
            own = normals[order[ends[number] : ends[number + 1]]]
            tensor = contact_fabric(own)
            found.append(
                {
                    "contacts": len(own),
                    **tensor_values("c", tensor, self.axis),
                    "alpha_c_axial_se": axial_error(own, self.axis),
                    "alpha_c_axial_sample_se": _known(error),
                }
            )
        return found

    def notes(self) -> Iterator[Note]:
        """Lines and blocks that are doubtful, and whether the sample is homogeneous."""
        scan, kept = self.measurement.sums.scan, float(self.fabrics.segments.sum())
        left_out = left_out_of(scan, self.variant, self.edge, kept)
        texts = doubts_of_lines(scan, self.variant, left_out)
        texts |= {"few_segments": self._too_few(), HOMOGENEITY: self._homogeneity()}
        return (Note(code, text, (self.variant.name,)) for code, text in texts.items() if text)

    def _too_few(self) -> str:
        fabrics = self.fabrics
        lacking = int((~fabrics.exists).sum())
        if not lacking:
            return ""
        empty = int((~fabrics.is_met).sum())
        found = f"{lacking} of {counted(len(self.blocks), 'block')} have no void fabric"
        if empty == lacking:
            return f"{found}: no void segment has its middle there"
        those = f"{empty} hold no void segment at all, the others" if empty else "they hold"
        return (
            f"{found}: {those} none in more than 5 % of the directions: choose fewer blocks, "
            f"closer lines (`spacing`, `tolerance`) or a shorter `cutoff`"
        )

    def _homogeneity(self) -> str:
        """What the test says, in words."""
        found = self._void
        inner = self.fabrics.exists & ~self.region.at_surface
        values = np.where(inner, found["alpha_vs_axial"], np.nan)
        variances = found["alpha_vs_axial_sample_se"] ** 2
        variances = variances + np.nan_to_num(found["alpha_vs_axial_se"]) ** 2
        weights = self.fabrics.segments.sum(axis=0)
        test = homogeneity_of(values, variances, weights, FREEDOM)
        if test is None:
            if not self.region.at_surface.any():
                return "too few blocks to tell whether the sample is homogeneous"
            better = "" if self.variant.in_window else "those of the RV by `variants=c` and "
            few = int(inner.sum())
            return (
                f"whether the sample is homogeneous cannot be told: all blocks"
                f"{f' but {few}' * bool(few)} are at a surface or empty: choose smaller blocks, "
                f"or {better}`edge=start`"
            )
        chance = "p < 0.0001" if test.chance < 1e-4 else f"p = {test.chance:.2g}"
        scatter = (
            f"alpha_vs_axial of {test.blocks} blocks scatters {test.ratio:.2g} times as much as "
            f"their errors explain ({chance})"
        )
        if test.chance < UNLIKELY:
            return f"{scatter}: the sample is not homogeneous"
        return f"{scatter}: no sign that the sample is not homogeneous"


def _known(value: Any) -> Any:
    """As a row has it: None for NaN."""
    if isinstance(value, np.floating):
        return float(value) if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
