"""One frame: from its classified grains and contacts to the rows of the fabric table."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.adaptive import scan_to_tolerance
from scanfab.cell import Cell
from scanfab.directions import direction_rule
from scanfab.errors import ScanfabWarning
from scanfab.fabric.contact import axial_error, contact_fabric
from scanfab.fabric.jackknife import BLOCKS, Jackknife, contact_jackknife, void_jackknife
from scanfab.fabric.tensor import COMPONENTS, FabricTensor
from scanfab.fabric.void import VoidFabric, void_fabric
from scanfab.gaps import Blocks, GapSums, scan_gaps
from scanfab.plan import Plan
from scanfab.scan import CellGrains, ScanSums, Solids
from scanfab.settings import AUTO_RULE, Settings
from scanfab.table import COLUMNS, Row
from scanfab.variants import VARIANTS, Sample, Variant

__all__ = ["FrameResult", "Measurement", "frame_result", "measure"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

# the same for all variants
FRAME_COLUMNS = ("source", "frame", "step", "time", "strain", "variant", "contacts_from")
# of the scan for the sample's scatter: its own noise is known, and taken off
BLOCK_REPLICATES = 8
BLOCK_SEGMENTS = 500_000
# where grains overlap many times there are far more chords than segments, and all are listed
BLOCK_CHORDS = 30_000_000


@dataclass(frozen=True, eq=False)
class Measurement:
    """What the scans of one frame say."""

    sample: Sample
    plan: Plan
    """With the rule and the spacing as they were in the end."""
    solids: Solids
    """What the lines met."""
    sums: ScanSums
    gaps: GapSums | None
    """All gaps of the same lines, where more than one cut-off or moment is asked for."""
    blocked: GapSums
    """Gaps of fewer lines, by the octant of their middle."""
    blocks: tuple[Blocks, Blocks]
    """Octants of the whole sample and of the window, of places in the dump's coordinates."""

    def spheres_of(self, variant: Variant) -> tuple[FloatArray, FloatArray, float]:
        """
        What a few lines of a variant meet, to be looked at.

        Positions (N, 3) and radii (N,) of its solids, and the radius of the sphere about the origin
        that its lines are clipped to, 0 for none. Of a periodic whole that is a part.
        """
        solids, medium = self.solids, self.solids.medium
        position, radius, removed = solids.position, solids.radius, solids.removed
        reach = solids.window_radius if variant.in_window else 0.0
        cell = self.sample.packing.cell
        if medium is not None and cell is not None and not variant.in_window:
            reach = 0.5 * float(np.linalg.norm(medium.vectors, axis=1).max())
            position, row = _reaching_in(medium.position, medium.radius, reach, cell)
            radius, removed = medium.radius[row], medium.removed[row]
        solid = ~removed if variant.without_rattlers else np.ones(len(radius), bool)
        return position[solid], radius[solid], reach


@dataclass(frozen=True, eq=False)
class FrameResult:
    """The rows of one frame, and what they were made from, for those who want to see it."""

    source: str
    number: int
    sample: Sample
    measurement: Measurement | None
    """None if there is nothing to scan."""
    rows: list[Row]

    @property
    def scanned(self) -> Measurement:
        """The measurement of a frame that has grains."""
        assert self.measurement is not None
        return self.measurement


def frame_result(
    name: str,
    number: int,
    sample: Sample,
    plan: Plan | None,
    settings: Settings,
    strain: float | None,
) -> FrameResult:
    """Scan one frame; of a frame without grains there are rows without numbers."""
    frame: dict[str, Any] = {
        "source": name,
        "frame": number,
        "step": sample.packing.step,
        "time": sample.packing.time,
        "strain": strain,
        "contacts_from": sample.contacts.source,
    }
    if plan is None or not sample.grains.any():
        empty = [
            Row(**frame, variant=variant, **_nothing())
            for variant in settings.variants
            for _ in settings.cutoffs or (settings.cutoff,)
        ]
        return FrameResult(name, number, sample, None, empty)
    measurement = measure(sample, plan, settings)
    rows = []
    for variant in settings.variants:
        for place in range(len(plan.cutoffs)):
            row = _Columns(measurement, VARIANTS[variant], place, settings)
            row.warn_of_few_segments(f"frame {number}, variant {variant}")
            rows.append(Row(**frame, variant=variant, **row.columns()))
    return FrameResult(name, number, sample, measurement, rows)


def measure(sample: Sample, plan: Plan, settings: Settings) -> Measurement:
    """Scan one frame that has grains."""
    if plan.window is not None:
        plan.window.check_fits(sample.packing)
    solids, origin = _solids(sample, plan, settings)
    sums, plan = scan_to_tolerance(solids, plan, settings)
    blocks = _blocks(sample, plan, settings)
    lines: dict[str, Any] = {
        "cutoffs": plan.cutoffs,
        "blocks": tuple(Blocks(one.matrix, one.shift + one.matrix @ origin) for one in blocks),
        "variants": settings.variants,
        "seed": settings.seed,
        "workers": settings.workers,
    }
    gaps: GapSums | None = None
    if settings.lists_gaps:
        every = range(sums.replicates)
        gaps = scan_gaps(solids, plan.rule, spacing=plan.spacing, replicates=every, **lines)
    blocked = scan_gaps(
        solids,
        direction_rule(AUTO_RULE),
        spacing=_block_spacing(sums, plan, settings),
        replicates=range(BLOCK_REPLICATES),
        **lines,
    )
    return Measurement(sample, plan, solids, sums, gaps, blocked, blocks)


def _solids(sample: Sample, plan: Plan, settings: Settings) -> tuple[Solids, FloatArray]:
    """
    The spheres that the lines may meet: all grains, or those that reach into the RV.

    And the origin of their positions in the dump's coordinates.
    """
    packing, window = sample.packing, plan.window
    position, radius = packing.position[sample.grains], packing.radius[sample.grains]
    removed = sample.rattlers[sample.grains]
    origin = position.mean(axis=0) if window is None else window.center
    position = position - origin
    reach = 0.0 if window is None else window.radius
    if packing.cell is not None and packing.is_periodic:
        medium = CellGrains(
            np.ascontiguousarray(position),
            radius,
            removed,
            packing.cell.short_vectors,
            np.array(packing.cell.periodic),
        )
        images, row = _reaching_in(position, radius, reach, packing.cell)
        return Solids(images, radius[row], removed[row], reach, medium), origin
    if not settings.needs_whole:
        near = np.linalg.norm(position, axis=1) < reach + radius
        position, radius, removed = position[near], radius[near], removed[near]
    return Solids(position, radius, removed, reach), origin


def _reaching_in(
    position: FloatArray, radius: FloatArray, reach: float, cell: Cell
) -> tuple[FloatArray, IntArray]:
    """All images that reach into the sphere about the origin, and the grains that they repeat."""
    nearest = position + cell.nearest_image(position) @ cell.vectors
    lattice = cell.lattice
    most = np.floor((reach + radius.max(initial=0.0)) / lattice.heights + 1.0).astype(int)
    images, rows = [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    for steps in product(*(range(-n, n + 1) for n in most)):
        moved = nearest + np.array(steps, dtype=np.float64) @ lattice.vectors
        chosen = np.flatnonzero(np.linalg.norm(moved, axis=1) < reach + radius)
        images.append(moved[chosen])
        rows.append(chosen)
    return np.concatenate(images), np.concatenate(rows)


def _blocks(sample: Sample, plan: Plan, settings: Settings) -> tuple[Blocks, Blocks]:
    """The octants about the middle of the sample (of the cell), and about the window's centre."""
    packing = sample.packing
    position = packing.position[sample.grains]
    low, high = position.min(axis=0), position.max(axis=0)
    radius = float(packing.radius.max())
    reach = float(np.linalg.norm(high - low)) + radius
    whole = Blocks.about(0.5 * (low + high), reach, settings.axis)
    if packing.cell is not None and packing.is_periodic:
        whole = _cell_blocks(packing.cell, position)
    if plan.window is None:
        return whole, whole
    return whole, Blocks.about(plan.window.center, plan.window.radius + radius, settings.axis)


def _cell_blocks(cell: Cell, position: FloatArray) -> Blocks:
    """Halves of the periods; along the other vectors, of what the grains take."""
    matrix = np.linalg.inv(cell.vectors).T
    shift = -matrix @ cell.origin
    along = cell.fractional(position)
    low, high = along.min(axis=0), along.max(axis=0)
    # far less than a period, about the middle
    scale = np.where(cell.periodic, 1.0, 0.25 / (1.0 + high - low))
    middle = np.where(cell.periodic, 0.0, 0.5 - scale * 0.5 * (low + high))
    return Blocks(scale[:, None] * matrix, scale * shift + middle)


def _block_spacing(sums: ScanSums, plan: Plan, settings: Settings) -> float:
    """Such that the variant with the fewest segments keeps enough, but no more than it has."""
    kept = [int(sums.kept(variant)[1].sum()) for variant in settings.variants]
    fewest = max(min(kept), 1)
    wanted = min(fewest, BLOCK_SEGMENTS)
    axes = len(plan.rule) * sums.replicates
    per_axis = BLOCK_REPLICATES * len(direction_rule(AUTO_RULE)) / axes
    chords = float(sums.chords.sum()) * wanted / fewest
    wider = max(chords / BLOCK_CHORDS, 1.0)
    return plan.spacing * math.sqrt(per_axis * fewest / wanted * wider)


class _Columns:
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
        """The void fabric."""
        return void_fabric(self.sums.axes, self.plan.rule.weights, *self._kept())

    def _kept(self) -> tuple[FloatArray, FloatArray | IntArray]:
        if self.measurement.gaps is None:
            return self.sums.kept(self.variant.name)
        return self.measurement.gaps.kept(self.variant.name, self.place, self.settings.moment)

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
            **_axis_columns("gvs", fabric.tensor if fabric else None),
        }

    def _void_scatter(self) -> Jackknife | None:
        gaps, moment = self.measurement.blocked, self.settings.moment
        words = (self.variant.name, self.place, moment)
        return void_jackknife(
            gaps.axes,
            direction_rule(AUTO_RULE).weights,
            gaps.kept(*words),
            [gaps.kept(*words, without=block) for block in range(BLOCKS)],
            self.settings.axis,
        )

    def _contact(self) -> dict[str, Any]:
        chosen = self.sample.fabric_contacts(self.variant, self.plan.window)
        contacts, axis = self.sample.contacts, self.settings.axis
        normals = contacts.normal[chosen]
        tensor = contact_fabric(normals)
        value = tensor.axial(axis) if tensor else None
        scatter: Jackknife | None = None
        if tensor:
            points = contacts.point[chosen]
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

    def warn_of_few_segments(self, where: str) -> None:
        """Say where there is no void fabric, or a doubtful one, or lines without a grain."""
        channels = int(self.sums.channels[:, self.which].sum())
        if channels:
            lines = channels + int(self.sums.lines[:, self.which].sum())
            warnings.warn(
                f"{where}: {channels} of {lines} lines stay in a channel and meet no grain",
                ScanfabWarning,
                stacklevel=4,
            )
        if self.segments == 0:
            message = f"no void segment reaches the cut-off {self.plan.cutoffs[self.place]:g}"
        elif self.fabric is None:
            message = "in some direction no void segment is kept, so there is no void fabric"
        elif self.fabric.filled > 0.01:
            message = (
                f"{self.fabric.filled:.0%} of the directions keep no void segment in a replicate: "
                f"choose a smaller spacing"
            )
        else:
            return
        warnings.warn(f"{where}: {message}", ScanfabWarning, stacklevel=4)


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


def _nothing() -> dict[str, Any]:
    """The columns of a frame without grains."""
    empty = {name: None for name in COLUMNS if name not in FRAME_COLUMNS}
    return {**empty, "grains": 0, "rattlers": 0, "contacts": 0}
