"""The columns of the fabric table that one variant and cut-off fill, from a frame's scans."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from scanfab.base.errors import Note
from scanfab.base.typing import FloatArray, IntArray
from scanfab.fabric.forces import doubts_of_forces
from scanfab.fabric.jackknife import BlockedSums
from scanfab.fabric.measured import Measured, SampleState
from scanfab.fabric.registry import GROUPS, OWN_FABRICS, checked_values
from scanfab.fabric.spectrum import LONGEST_GAP, PREDICTED_ALPHA, predicted_alpha
from scanfab.fabric.window import WINDOW_ALPHA, window_alpha
from scanfab.packing.columns import RV_COLUMN, sample_values
from scanfab.packing.near import near_pairs
from scanfab.packing.sample import Variant
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.state import contact_forces, doubts_of_state, sample_state
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids
from scanfab.table.columns import installed_fabrics, table_columns

# in smallest radii: a cut-off that nobody means
ABSURD = 100.0
# of the segments: so many may leave the sample
MOST_LEFT_OUT = 0.01
NO_INNER_WINDOW = (
    "the sample is flat or too small: by the rule `edge=ends` the whole is measured in the "
    "ellipsoid that lies a largest radius within the hull of its centres, and there is none"
)


class VariantColumns:
    """The columns of one variant and cut-off."""

    def __init__(self, measurement: Measurement, variant: Variant, place: int) -> None:
        self.measurement = measurement
        self.variant = variant
        self.place = place
        self.sample, self.plan, self.sums = measurement.sample, measurement.plan, measurement.sums
        self.which = "abcd".index(variant.name)

    def columns(self) -> dict[str, Any]:
        """All that depend on the variant."""
        contacts = len(self.measured.normals)
        found = sample_values(self.sample, self.variant, self.plan.window, contacts) | self._scan()
        for fabric in OWN_FABRICS.values():
            found |= fabric.values(self.measured)
        for name, fabric in installed_fabrics().items():
            found |= checked_values(name, fabric, self.measured)
        asked = {RV_COLUMN.name: self.rv, **self._window(), **self._edge()}
        if PREDICTED_ALPHA.name in self.plan.more_columns:
            asked[PREDICTED_ALPHA.name] = self.predicted_alpha
        for group in self.plan.groups:
            asked |= GROUPS[group].values(self.measured)
        # the strain of the frame is not known here
        return found | {name: asked[name] for name in self.plan.more_columns if name in asked}

    @property
    def rv(self) -> float | None:
        """The size of the variant's RV, where there are several."""
        return self.plan.rvs_of(self.variant.name)[0].fraction

    @cached_property
    def measured(self) -> Measured:
        """What the fabrics are computed from."""
        length, segments = self.measurement.kept(self.variant.name, self.place)
        chosen = self.sample.fabric_contacts(self.variant, self.plan.window)
        contacts = self.sample.contacts
        # np.compress is several times as fast as to index with a mask
        points = np.compress(chosen, contacts.point, axis=0)
        return Measured(
            axis=np.asarray(self.plan.axis),
            axes=self.sums.axes,
            weights=self.plan.rule.weights,
            length=length,
            segments=segments,
            meets_solids=not self._no_solid,
            blocked=self._blocked_sums(),
            normals=np.compress(chosen, contacts.normal, axis=0),
            points=points,
            blocks=self._blocks_of(points),
            space=self.plan.space,
            segment_count=self.segments,
            forces=contact_forces(self.sample, chosen) if "forces" in self.plan.groups else None,
            state=self._state,
        )

    @property
    def _state(self) -> SampleState | None:
        if "state" not in self.plan.groups:
            return None
        return sample_state(self.sample, self.variant, self.plan.window)

    @cached_property
    def _no_solid(self) -> str:
        """Why the variant's lines meet no grain at all; empty if they do."""
        window = self.plan.window
        if self.sample.solids(self.variant, window).any():
            return ""
        with_rattlers = replace(self.variant, without_rattlers=False)
        rattlers = self.sample.number(self.sample.solids(with_rattlers, window))
        if rattlers:
            there = " that reach into the RV" if self.variant.in_window else ""
            return f"no grain is left, all {rattlers}{there} are rattlers"
        return f"no grain reaches into the {window}"

    @cached_property
    def segments(self) -> int:
        """Number of the kept segments."""
        if self.measurement.gaps is None:
            return int(self.sums.segments[:, self.which].sum())
        return int(self.measurement.gaps.in_blocks(self.variant.name, self.place)[1].sum())

    def _scan(self) -> dict[str, Any]:
        """The values of the columns that scan/columns.py declares."""
        return {
            "solid_fraction": self._solid_fraction(),
            "directions": len(self.plan.rule),
            "replicates": self.sums.replicates,
            "lines": int(self.sums.lines[:, self.which].sum()),
            "segments": self.segments,
            # of all replicates together, as a fixed scan is asked for
            "spacing": self.plan.spacing / self.plan.space.apart(self.sums.replicates),
            "cutoff": self.plan.cutoffs[self.place],
        }

    def _edge(self) -> dict[str, Any]:
        """The rule at the window's surface, and what leaves the sample by it."""
        return {"edge": self.edge, "left_out": self.left_out}

    @property
    def edge(self) -> str | None:
        """The rule of this variant; a whole that repeats has no edge."""
        return edge_of(self.variant, self.plan, self.measurement.solids)

    @cached_property
    def left_out(self) -> float | None:
        """Share of the segments that leave the sample, and so are not counted."""
        kept = float(self.sums.segments[:, self.which].sum())
        return left_out_of(self.sums, self.variant, self.edge, kept)

    def _solid_fraction(self) -> float | None:
        """1 - void length / line length in the window, weighted like the directions."""
        cell = self.sample.packing.cell
        if not self.variant.in_window and not (cell is not None and cell.is_endless):
            return None
        weights = self.plan.rule.weights
        length = float(weights @ self.sums.line_length[:, self.which].sum(axis=0))
        if length == 0:
            return None
        return 1.0 - float(weights @ self.sums.void[:, self.which].sum(axis=0)) / length

    @property
    def predicted_alpha(self) -> float | None:
        """What contacts predict at a small cut-off, in a region whose porosity is known."""
        cutoff, packing = self.plan.cutoffs[self.place], self.sample.packing
        solid = self._solid_fraction()
        longest = LONGEST_GAP * float(packing.radius[self.sample.grains].min())
        if solid is None or packing.bodies is not None or self.plan.moment != 1:
            return None
        if cutoff > longest or self.measured.void is None:
            return None
        window = self.plan.window if self.variant.in_window else None
        pairs = near_pairs(self.sample, self.variant, window, cutoff)
        return predicted_alpha(pairs, 1.0 - solid, cutoff, self.plan.axis)

    def _blocked_sums(self) -> BlockedSums:
        gaps = self.measurement.blocked
        words = (self.variant.name, self.place, self.plan.moment)
        return BlockedSums(
            gaps.axes,
            self.measurement.block_rule.weights,
            gaps.kept(*words),
            [gaps.kept(*words, without=block) for block in range(2**self.plan.space.dimension)],
        )

    def _window(self) -> dict[str, Any]:
        """What the window alone would give, where its column is there."""
        name, window, fabric = WINDOW_ALPHA.name, self.plan.window, self.measured.void
        if name not in self.plan.more_columns:
            return {}
        if self.plan.edge != CLIP and self.variant.in_window:
            # by the other rules no window has one
            return {name: 0.0 if fabric else None}
        value: float | None = None
        if self.variant.in_window and window is not None and fabric and self.plan.moment == 1:
            cutoff = self.plan.cutoffs[self.place]
            value = window_alpha(window.shape, fabric, cutoff, self.measured.axis)
        return {name: value}

    def _blocks_of(self, points: FloatArray) -> IntArray:
        """The block of each place; of the window those next to its centre."""
        if self.variant.in_window:
            window = self.plan.window
            assert window is not None
            points = window.center + window.branches(points, self.sample.packing)
        return self.measurement.blocks[self.variant.in_window].of(points)

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

    def notes(self) -> Iterator[Note]:
        """Whether there is no void fabric, or a doubtful one, or lines without a grain."""
        texts = doubts_of_lines(self.sums, self.variant, self.left_out)
        texts |= self._of_void_fabric() | self._of_groups()
        about = self.variant.name if self.rv is None else f"{self.variant.name} (RV {self.rv:g})"
        return (Note(code, text, (about,)) for code, text in texts.items() if text)

    def _of_groups(self) -> dict[str, str]:
        """Why columns that were asked for are empty."""
        found: dict[str, str] = {}
        if "state" in self.plan.groups:
            found |= doubts_of_state(self.sample, self.variant, self.plan.window)
        if "forces" in self.plan.groups:
            found |= doubts_of_forces(self.measured)
        return found

    def _of_void_fabric(self) -> dict[str, str]:
        void = self.measured.void
        if self._no_solid:
            return {"no_solid": self._no_solid}
        is_inner = self.edge == ENDS and not self.variant.in_window
        if is_inner and self.measurement.solids.inner is None:
            return {"no_inner_window": NO_INNER_WINDOW}
        if self.segments == 0:
            return {"cutoff_too_long": self._too_long(self.plan.cutoffs[self.place])}
        if void is None:
            text = "in some direction no void segment is kept, so there is no void fabric"
            return {"empty_direction": text}
        if void.filled <= 0.01:
            return {}
        return {
            "filled_directions": f"{void.filled:.0%} of the directions keep no void segment "
            f"in a replicate: choose a smaller spacing"
        }


def no_columns(more: Collection[str] = ()) -> dict[str, Any]:
    """The columns of a frame without grains."""
    empty = {column.name: None for column in table_columns(more)}
    return {**empty, "grains": 0, "rattlers": 0, "contacts": 0}


def edge_of(variant: Variant, plan: Plan, solids: Solids) -> str | None:
    """The rule at the surface of a variant's window; a whole that repeats has no edge."""
    if variant.in_window:
        return plan.edge
    if solids.medium is not None:
        return None
    return ENDS if plan.edge == ENDS else CLIP


def left_out_of(sums: ScanSums, variant: Variant, edge: str | None, kept: float) -> float | None:
    """Share of the segments that leave the sample, beside the kept; None by rules that cut them."""
    if edge != START:
        return None
    left = float(sums.left_out[:, "abcd".index(variant.name)].sum())
    return left / (left + kept) if left + kept else None


def doubts_of_lines(sums: ScanSums, variant: Variant, left_out: float | None) -> dict[str, str]:
    """Lines that meet no grain, and too many segments that leave the sample, by notes' codes."""
    found, which = {}, "abcd".index(variant.name)
    channels, others = (int(one[:, which].sum()) for one in (sums.channels, sums.lines))
    if channels:
        found["channels"] = (
            f"{channels} of {channels + others} lines stay in a channel and meet no grain"
        )
    if left_out is not None and left_out > MOST_LEFT_OUT:
        found["left_out"] = (
            f"{left_out:.1%} of the void segments of the RV leave the sample and are left "
            f"out: they are the long ones, so the mean length is too small: choose a smaller `rv`, "
            f"or `edge=ends`, which needs nothing from outside"
        )
    return found
