"""The columns of the fabric table that one variant and cut-off fill, from a frame's scans."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from scanfab.fabric.contact import axial_error, contact_fabric
from scanfab.fabric.jackknife import BLOCKS, Jackknife, contact_jackknife, void_jackknife
from scanfab.fabric.tensor import COMPONENTS, FabricTensor
from scanfab.fabric.void import VoidFabric, void_fabric
from scanfab.packing.sample import Variant
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.settings import Settings
from scanfab.table.table import COLUMNS

__all__ = ["FRAME_COLUMNS", "VariantColumns", "no_columns"]


# the same for all variants
FRAME_COLUMNS = (
    "source", "frame", "step", "time", "strain", "variant", "contacts_from", "shear_strain",
)  # fmt: skip


# in smallest radii: a cut-off that nobody means
ABSURD = 100.0


class VariantColumns:
    """The columns of one variant and cut-off."""

    def __init__(
        self, measurement: Measurement, variant: Variant, place: int, settings: Settings
    ) -> None:
        self.measurement = measurement
        self.variant = variant
        self.place = place
        self.settings = settings
        self.sample, self.plan, self.sums = measurement.sample, measurement.plan, measurement.sums
        self.which = "abcd".index(variant.name)

    def columns(self) -> dict[str, Any]:
        """All that depend on the variant."""
        return {**self._sample(), **self._scan(), **self._void(), **self._contact()}

    @cached_property
    def fabric(self) -> VoidFabric | None:
        """The void fabric; a window without any solid has none."""
        if self._no_solid:
            return None
        kept = self.measurement.kept(self.variant.name, self.place)
        return void_fabric(self.sums.axes, self.plan.rule.weights, *kept)

    @cached_property
    def _no_solid(self) -> str:
        """Why the variant's lines meet no grain at all; empty if they do."""
        window = self.plan.window
        if self.sample.solids(self.variant, window).any():
            return ""
        rattlers = self.sample.solids(replace(self.variant, without_rattlers=False), window).sum()
        if rattlers:
            there = " that reach into the RV" if self.variant.in_window else ""
            return f"no grain is left, all {rattlers}{there} are rattlers"
        return f"no grain reaches into the {window}"

    @cached_property
    def segments(self) -> int:
        """Number of the kept segments."""
        if self.measurement.gaps is None:
            return int(self.sums.segments[:, self.which].sum())
        return int(self.measurement.gaps.number[:, self.which, ..., self.place].sum())

    def _sample(self) -> dict[str, Any]:
        window = self.plan.window
        counted = self.sample.counted(self.variant, window)
        return {
            "grains": int((counted & ~self.sample.removed(self.variant)).sum()),
            "rattlers": int((counted & self.sample.rattlers).sum()),
            "coordination": self.sample.coordination(self.variant, window),
        }

    def _scan(self) -> dict[str, Any]:
        return {
            "solid_fraction": self._solid_fraction(),
            "directions": len(self.plan.rule),
            "replicates": self.sums.replicates,
            "lines": int(self.sums.lines[:, self.which].sum()),
            "segments": self.segments,
            # of all replicates together, as a fixed scan is asked for
            "spacing": self.plan.spacing / math.sqrt(self.sums.replicates),
            "cutoff": self.plan.cutoffs[self.place],
        }

    def _solid_fraction(self) -> float | None:
        """1 - void length / line length in the window, weighted like the directions."""
        cell = self.sample.packing.cell
        if not self.variant.in_window and not (cell is not None and all(cell.periodic)):
            return None
        weights = self.plan.rule.weights
        length = float(weights @ self.sums.line_length[:, self.which].sum(axis=0))
        if length == 0:
            return None
        return 1.0 - float(weights @ self.sums.void[:, self.which].sum(axis=0)) / length

    def _void(self) -> dict[str, Any]:
        fabric, axis = self.fabric, self.settings.axis
        value = fabric.tensor.axial(axis) if fabric else None
        scatter = self._void_scatter() if fabric else None
        return {
            "mean_length": fabric.mean_length if fabric else None,
            **_tensor_columns("gvs", fabric.tensor if fabric else None),
            "alpha_vs": fabric.tensor.alpha if fabric else None,
            "alpha_vs_axial": value,
            "alpha_vs_axial_se": fabric.axial_error(axis) if fabric else None,
            **_scatter_columns("alpha_vs_axial", value, scatter),
            **_half_columns(scatter),
            **_axis_columns("gvs", fabric.tensor if fabric else None),
        }

    def _void_scatter(self) -> Jackknife | None:
        gaps, moment = self.measurement.blocked, self.settings.moment
        words = (self.variant.name, self.place, moment)
        return void_jackknife(
            gaps.axes,
            self.measurement.block_rule.weights,
            gaps.kept(*words),
            [gaps.kept(*words, without=block) for block in range(BLOCKS)],
            self.settings.axis,
        )

    def _contact(self) -> dict[str, Any]:
        chosen = self.sample.fabric_contacts(self.variant, self.plan.window)
        contacts, axis = self.sample.contacts, self.settings.axis
        # several times as fast as to index with a mask
        normals = np.compress(chosen, contacts.normal, axis=0)
        tensor = contact_fabric(normals)
        value = tensor.axial(axis) if tensor else None
        scatter: Jackknife | None = None
        if tensor:
            points = np.compress(chosen, contacts.point, axis=0)
            if self.variant.in_window:
                window = self.plan.window
                assert window is not None
                points = window.center + window.branches(points, self.sample.packing)
            places = self.measurement.blocks[self.variant.in_window].of(points)
            scatter = contact_jackknife(normals, places, axis)
        return {
            "contacts": len(normals),
            **_tensor_columns("gc", tensor),
            "alpha_c": tensor.alpha if tensor else None,
            "alpha_c_axial": value,
            "alpha_c_axial_se": axial_error(normals, axis),
            **_scatter_columns("alpha_c_axial", value, scatter),
            **_axis_columns("gc", tensor),
            "coaxiality_deg": (
                self.fabric.tensor.angle_to(tensor) if self.fabric and tensor else None
            ),
        }

    def _too_long(self, cutoff: float) -> str:
        """Of a cut-off that no segment reaches; a large number may be one in another unit."""
        message = f"no void segment reaches the cut-off {cutoff:g}"
        times = cutoff / float(self.sample.packing.radius[self.sample.grains].min())
        if times < ABSURD:
            return message
        return (
            f"{message}, {times:.4g} times the smallest radius: lengths are in the dump's unit, "
            f"did you mean 1rmin?"
        )

    def doubts(self) -> Iterator[str]:
        """Whether there is no void fabric, or a doubtful one, or lines without a grain."""
        channels = int(self.sums.channels[:, self.which].sum())
        if channels:
            lines = channels + int(self.sums.lines[:, self.which].sum())
            yield f"{channels} of {lines} lines stay in a channel and meet no grain"
        if self._no_solid:
            yield self._no_solid
        elif self.segments == 0:
            yield self._too_long(self.plan.cutoffs[self.place])
        elif self.fabric is None:
            yield "in some direction no void segment is kept, so there is no void fabric"
        elif self.fabric.filled > 0.01:
            yield (
                f"{self.fabric.filled:.0%} of the directions keep no void segment in a replicate: "
                f"choose a smaller spacing"
            )


def _tensor_columns(prefix: str, tensor: FabricTensor | None) -> dict[str, float | None]:
    values: Iterable[tuple[str, float | None]] = (
        tensor.components().items() if tensor else ((name, None) for name in COMPONENTS)
    )
    return {f"{prefix}_{name}": value for name, value in values}


def _axis_columns(prefix: str, tensor: FabricTensor | None) -> dict[str, float | None]:
    """Direction of the largest principal value."""
    axis = [None] * 3 if tensor is None else tensor.major_axis.tolist()
    return {f"{prefix}_axis_{name}": one for name, one in zip("xyz", axis, strict=True)}


def _scatter_columns(
    name: str, value: float | None, scatter: Jackknife | None
) -> dict[str, float | None]:
    """The sample's standard error, and the values without each block."""
    without = [
        None if value is None or scatter is None else value + float(scatter.shift[block])
        for block in range(BLOCKS)
    ]
    return {
        f"{name}_sample_se": None if scatter is None else scatter.error,
        **{f"{name}_without_{block + 1}": one for block, one in enumerate(without)},
    }


def _half_columns(scatter: Jackknife | None) -> dict[str, float | None]:
    """Half the differences between the replicates that the values without each block come from."""
    halves = [None] * BLOCKS if scatter is None else scatter.half.tolist()
    return {f"alpha_vs_axial_half_{block + 1}": half for block, half in enumerate(halves)}


def no_columns() -> dict[str, Any]:
    """The columns of a frame without grains."""
    empty = {name: None for name in COLUMNS if name not in FRAME_COLUMNS}
    return {**empty, "grains": 0, "rattlers": 0, "contacts": 0}
