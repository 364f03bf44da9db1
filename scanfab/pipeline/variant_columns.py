"""Values of the fabric table for one variant and cut-off, from the scans of a frame."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from scanfab.base.arrays import compressed, in_parts
from scanfab.base.errors import Note
from scanfab.fabric import predicted
from scanfab.fabric.forces import doubts_of_forces
from scanfab.fabric.measured import BlockedSums, Measured
from scanfab.fabric.registry import GROUPS, OWN_FABRICS, checked_values
from scanfab.packing.columns import RV_COLUMN, sample_values
from scanfab.packing.sample import Variant
from scanfab.packing.search import near_pairs
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.state import contact_forces, doubts_of_state, sample_state
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids
from scanfab.table.columns import installed_fabrics, table_columns

# the user is warned if a larger fraction of the segments leaves the sample
MOST_LEFT_OUT = 0.01
NO_INNER_WINDOW = (
    "the sample is flat or too small for `edge=ends`: the whole is then measured in an ellipsoid "
    "that lies one largest radius inside the hull of the grain centres, and none fits"
)


class VariantColumns:
    """Computes the columns of one variant and cut-off."""

    def __init__(self, measurement: Measurement, variant: Variant, place: int) -> None:
        self.measurement, self.variant, self.place = measurement, variant, place
        self.sample, self.plan, self.sums = measurement.sample, measurement.plan, measurement.sums
        self.window = self.plan.window if variant.in_window else None
        self.cutoff = self.plan.cutoffs[place]
        self.rv = self.plan.rvs_of(variant.name)[0].fraction
        """Size of the variant's RV; None unless there are several RVs."""
        self.edge = edge_of(variant, self.plan, measurement.solids)
        self.index = "abcd".index(variant.name)
        kept = float(self.sums.segments[:, self.index].sum())
        self.left_out = left_out_of(self.sums, variant, self.edge, kept)

    def columns(self) -> dict[str, Any]:
        """Values by column, without the columns that are the same in all rows of a frame."""
        plan, measured = self.plan, self.measured
        row = sample_values(self.sample, self.variant, self.window, len(measured.normals))
        row |= {
            "solid_fraction": self.solid_fraction,
            "directions": len(plan.rule),
            "replicates": self.sums.replicates,
            "lines": int(self.sums.lines[:, self.index].sum()),
            "segments": measured.segment_count,
            # spacing of all replicates together, as users give it for a fixed scan
            "spacing": plan.spacing / plan.space.apart(self.sums.replicates),
            "cutoff": self.cutoff,
        }
        for fabric in OWN_FABRICS.values():
            row |= fabric.values(measured)
        for name, fabric in installed_fabrics().items():
            row |= checked_values(name, fabric, measured)
        more: dict[str, Any] = {
            RV_COLUMN.name: self.rv,
            "edge": self.edge,
            "left_out": self.left_out,
        }
        if predicted.WINDOW_ALPHA.name in plan.more_columns:
            more[predicted.WINDOW_ALPHA.name] = self.window_alpha
        if predicted.PREDICTED_ALPHA.name in plan.more_columns:
            more[predicted.PREDICTED_ALPHA.name] = self.predicted_alpha
        for group in plan.groups:
            more |= GROUPS[group].values(measured)
        return row | {name: more[name] for name in plan.more_columns if name in more}

    @cached_property
    def measured(self) -> Measured:
        """Input of the fabrics."""
        sample, plan, measurement = self.sample, self.plan, self.measurement
        name, groups = self.variant.name, plan.groups
        length, segments = measurement.kept(name, self.place)
        count = self.sums.segments[:, self.index].sum()
        if measurement.gaps is not None:
            count = measurement.gaps.in_blocks(name, self.place)[1].sum()
        chosen = sample.fabric_contacts(self.variant, self.window)
        points = compressed(chosen, sample.contacts.point)
        places = points
        if self.window is not None:
            # images of the points next to the centre of the RV
            places = self.window.center + self.window.branches(points, sample.packing)
        state = sample_state(sample, self.variant, self.window) if "state" in groups else None
        words = name, self.place, plan.moment
        return Measured(
            axis=np.asarray(plan.axis),
            axes=self.sums.axes,
            weights=plan.rule.weights,
            length=length,
            segments=segments,
            meets_solids=bool(sample.solids(self.variant, self.window).any()),
            blocked=BlockedSums(
                measurement.blocked.axes,
                measurement.block_rule.weights,
                measurement.blocked.kept(*words),
                [
                    measurement.blocked.kept(*words, without=block)
                    for block in range(2**plan.space.dimension)
                ],
            ),
            normals=compressed(chosen, sample.contacts.normal),
            points=points,
            blocks=in_parts(measurement.blocks[self.variant.in_window].of, places),
            space=plan.space,
            segment_count=int(count),
            forces=contact_forces(sample, chosen) if "forces" in groups else None,
            state=state,
        )

    @cached_property
    def solid_fraction(self) -> float | None:
        """1 - void length / line length in the window, weighted over the directions."""
        cell, weights = self.sample.packing.cell, self.plan.rule.weights
        if self.window is None and not (cell is not None and cell.is_endless):
            return None
        length = float(weights @ self.sums.line_length[:, self.index].sum(axis=0))
        void = float(weights @ self.sums.void[:, self.index].sum(axis=0))
        return None if length == 0 else 1.0 - void / length

    @property
    def predicted_alpha(self) -> float | None:
        """Anisotropy predicted from contacts; None if the formula does not hold."""
        solid, packing = self.solid_fraction, self.sample.packing
        longest = predicted.LONGEST_GAP * float(packing.radius[self.sample.grains].min())
        if solid is None or packing.bodies is not None or self.plan.moment != 1:
            return None
        if self.cutoff > longest or self.measured.void is None:
            return None
        solids = self.sample.grains & ~self.sample.removed(self.variant)
        counted = self.sample.counted(self.variant, self.window)
        pairs = near_pairs(packing, solids, counted, self.window, self.cutoff)
        return predicted.predicted_alpha(pairs, 1.0 - solid, self.cutoff, self.plan.axis)

    @property
    def window_alpha(self) -> float | None:
        """Anisotropy due to the window alone; 0 if the edge rule cuts no segments."""
        fabric = self.measured.void
        if self.window is None or fabric is None:
            return None
        if self.plan.edge != CLIP:
            return 0.0
        if self.plan.moment != 1:
            return None
        axis = self.measured.axis
        return predicted.window_alpha(self.window.shape, fabric, self.cutoff, axis)

    def notes(self) -> Iterator[Note]:
        """Notes on a missing or doubtful fabric, and on lines that meet no grain."""
        texts = doubts_of_lines(self.sums, self.variant, self.left_out) | self._doubts_of_void()
        if "state" in self.plan.groups:
            texts |= doubts_of_state(self.sample, self.window)
        if "forces" in self.plan.groups:
            texts |= doubts_of_forces(self.measured)
        about = self.variant.name if self.rv is None else f"{self.variant.name} (RV {self.rv:g})"
        return (Note(code, text, (about,)) for code, text in texts.items())

    def _doubts_of_void(self) -> dict[str, str]:
        void, window = self.measured.void, self.window
        if not self.measured.meets_solids:
            with_rattlers = replace(self.variant, without_rattlers=False)
            rattlers = self.sample.number(self.sample.solids(with_rattlers, window))
            if not rattlers:
                return {"no_solid": f"no grain reaches into the {window}"}
            reaching = " that reach into the RV" if self.variant.in_window else ""
            return {"no_solid": f"no grain is left, all {rattlers}{reaching} are rattlers"}
        if self.edge == ENDS and window is None and self.measurement.solids.inner is None:
            return {"no_inner_window": NO_INNER_WINDOW}
        if self.measured.segment_count == 0:
            times = self.cutoff / float(self.sample.packing.radius[self.sample.grains].min())
            text = (
                f"no void segment reaches the cut-off {self.cutoff:g}, {times:.4g} times the "
                f"smallest radius: lengths are in the dump's unit, did you mean 1rmin?"
            )
            return {"cutoff_too_long": text}
        if void is None:
            text = "in some direction no void segment is kept, so there is no void fabric"
            return {"empty_direction": text}
        filled = f"{void.filled:.0%} of the directions keep no void segment in a replicate"
        text = f"{filled}: choose a smaller spacing"
        return {"filled_directions": text} if void.filled > 0.01 else {}


def no_columns(more: Collection[str] = ()) -> dict[str, Any]:
    """Values by column for a frame without grains."""
    empty = {column.name: None for column in table_columns(more)}
    return {**empty, "grains": 0, "rattlers": 0, "contacts": 0}


def edge_of(variant: Variant, plan: Plan, solids: Solids) -> str | None:
    """The edge rule for a variant; None for a periodic whole, which has no edge."""
    if variant.in_window:
        return plan.edge
    if solids.medium is not None:
        return None
    return ENDS if plan.edge == ENDS else CLIP


def left_out_of(sums: ScanSums, variant: Variant, edge: str | None, kept: float) -> float | None:
    """Fraction of segments dropped because they leave the sample; None if they are cut."""
    if edge != START:
        return None
    left = float(sums.left_out[:, "abcd".index(variant.name)].sum())
    return left / (left + kept) if left + kept else None


def doubts_of_lines(sums: ScanSums, variant: Variant, left_out: float | None) -> dict[str, str]:
    """Notes, by code, on lines that meet no grain and on segments that leave the sample."""
    texts, index = {}, "abcd".index(variant.name)
    channels, others = (int(counts[:, index].sum()) for counts in (sums.channels, sums.lines))
    if channels:
        texts["channels"] = (
            f"{channels} of {channels + others} lines stay in a channel and meet no grain"
        )
    if left_out is not None and left_out > MOST_LEFT_OUT:
        texts["left_out"] = (
            f"{left_out:.1%} of the void segments of the RV leave the sample and are left "
            f"out: these are long segments, so the mean length is too small: choose a smaller "
            f"`rv`, or `edge=ends`, which needs nothing outside the RV"
        )
    return texts
