"""Values of the fabric table for one variant and cut-off, from the scans of a frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from scanfab.base.arrays import compressed, in_parts
from scanfab.base.errors import Note
from scanfab.fabric import predicted
from scanfab.fabric.forces import doubts_of_forces
from scanfab.fabric.measured import Measured
from scanfab.fabric.registry import GROUPS, OWN_FABRICS, checked_values
from scanfab.packing.columns import RV_COLUMN, sample_values
from scanfab.packing.sample import Variant
from scanfab.packing.search import near_pairs
from scanfab.pipeline.measurement import Measurement, blocked_sums
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.state import contact_forces, doubts_of_state, sample_state
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.scan import ScanSums
from scanfab.scan.solids import Solids
from scanfab.table.columns import installed_fabrics

# the user is warned if a larger fraction of the segments leaves the sample
MOST_LEFT_OUT = 0.01
NO_INNER_WINDOW = (
    "the sample is flat or too small for `edge=ends`: the whole is then measured in an ellipsoid "
    "that lies one largest radius inside the hull of the grain centres, and none fits"
)


class VariantColumns:
    """Computes the columns of one variant and cut-off."""

    def __init__(self, measurement: Measurement, variant: Variant, place: int) -> None:
        """``place`` is the number of the cut-off among those of the plan."""
        self.measurement, self.variant, self.place = measurement, variant, place
        self.sample, self.plan, self.sums = measurement.sample, measurement.plan, measurement.sums
        self.window = self.plan.window if variant.in_window else None
        self.cutoff = self.plan.cutoffs[place]
        self.rv, _, self.lack = self.plan.rvs_of(variant.name)[0]
        """Size of the variant's RV, None unless there are several; why it has no void fabric."""
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
            RV_COLUMN.name: self.rv,
            "edge": self.edge,
            "left_out": self.left_out,
        }
        for fabric in (*OWN_FABRICS.values(), *(GROUPS[name] for name in plan.settings.with_)):
            row |= fabric.values(measured)
        for name, fabric in installed_fabrics().items():
            row |= checked_values(name, fabric, measured)
        # these take a while, so they are computed only for tables that have them
        more = plan.settings.more_columns
        if predicted.WINDOW_ALPHA.name in more:
            row[predicted.WINDOW_ALPHA.name] = self.window_alpha
        if predicted.PREDICTED_ALPHA.name in more:
            row[predicted.PREDICTED_ALPHA.name] = self.predicted_alpha
        return row

    @cached_property
    def measured(self) -> Measured:
        """Input of the fabrics."""
        sample, plan, measurement = self.sample, self.plan, self.measurement
        settings, name = plan.settings, self.variant.name
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
        has_state = "state" in settings.with_
        return Measured(
            axis=np.asarray(settings.axis),
            axes=self.sums.axes,
            weights=plan.rule.weights,
            length=length,
            segments=segments,
            meets_solids=not self.lack and bool(sample.solids(self.variant, self.window).any()),
            blocked=blocked_sums(
                measurement.blocked, measurement.block_rule, plan, name, self.place
            ),
            normals=compressed(chosen, sample.contacts.normal),
            points=points,
            blocks=in_parts(measurement.blocks[self.variant.in_window].of, places),
            space=plan.space,
            segment_count=int(count),
            forces=contact_forces(sample, chosen) if "forces" in settings.with_ else None,
            state=sample_state(sample, self.variant, self.window) if has_state else None,
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
        solid, packing, settings = self.solid_fraction, self.sample.packing, self.plan.settings
        longest = predicted.LONGEST_GAP * float(packing.radius[self.sample.grains].min())
        if solid is None or packing.bodies is not None or settings.moment != 1:
            return None
        if self.cutoff > longest or self.measured.void is None:
            return None
        solids = self.sample.grains & ~self.sample.removed(self.variant)
        counted = self.sample.counted(self.variant, self.window)
        pairs = near_pairs(packing, solids, counted, self.window, self.cutoff)
        return predicted.predicted_alpha(pairs, 1.0 - solid, self.cutoff, settings.axis)

    @property
    def window_alpha(self) -> float | None:
        """Anisotropy due to the window alone; 0 if the edge rule cuts no segments."""
        fabric, settings = self.measured.void, self.plan.settings
        if (
            self.window is None
            or fabric is None
            or (settings.edge == CLIP and settings.moment != 1)
        ):
            return None
        if settings.edge != CLIP:
            return 0.0
        return predicted.window_alpha(self.window.shape, fabric, self.cutoff, self.measured.axis)

    def notes(self) -> Iterator[Note]:
        """Notes on a missing or doubtful fabric, and on lines that meet no grain."""
        texts = doubts_of_lines(self.sums, self.variant, self.left_out) | self._doubts_of_void()
        if "state" in self.plan.settings.with_:
            texts |= doubts_of_state(self.sample, self.window)
        if "forces" in self.plan.settings.with_:
            texts |= doubts_of_forces(self.measured)
        about = self.variant.name if self.rv is None else f"{self.variant.name} (RV {self.rv:g})"
        return (Note(code, text, (about,)) for code, text in texts.items())

    def _doubts_of_void(self) -> dict[str, str]:
        sample, void = self.sample, self.measured.void
        if self.lack:
            # a note on the RV says why
            return {}
        if not self.measured.meets_solids:
            with_rattlers = replace(self.variant, without_rattlers=False)
            rattlers = sample.number(sample.solids(with_rattlers, self.window))
            if not rattlers:
                return {"no_solid": f"no grain reaches into the {self.window}"}
            reaching = " that reach into the RV" if self.variant.in_window else ""
            return {"no_solid": f"no grain is left, all {rattlers}{reaching} are rattlers"}
        if self.edge == ENDS and self.window is None and self.measurement.solids.inner is None:
            return {"no_inner_window": NO_INNER_WINDOW}
        if self.measured.segment_count == 0:
            times = self.cutoff / float(sample.packing.radius[sample.grains].min())
            text = (
                f"no void segment reaches the cut-off {self.cutoff:g}, {times:.4g} times the "
                f"smallest radius: lengths are in the dump's unit, did you mean 1rmin?"
            )
            return {"cutoff_too_long": text}
        if void is None:
            text = "in some direction no void segment is kept, so there is no void fabric"
            return {"empty_direction": text}
        if void.filled <= 0.01:
            return {}
        text = f"{void.filled:.0%} of the directions keep no void segment in a replicate"
        return {"filled_directions": f"{text}: choose a smaller spacing"}


def edge_of(variant: Variant, plan: Plan, solids: Solids) -> str | None:
    """The edge rule for a variant; None for a periodic whole, which has no edge."""
    if solids.medium is not None and not variant.in_window:
        return None
    edge = plan.settings.edge
    return edge if variant.in_window or edge == ENDS else CLIP


def left_out_of(sums: ScanSums, variant: Variant, edge: str | None, kept: float) -> float | None:
    """Fraction of segments dropped because they leave the sample; None if they are cut."""
    if edge != START:
        return None
    left = float(sums.left_out[:, "abcd".index(variant.name)].sum())
    return left / (left + kept) if left + kept else None


def doubts_of_lines(sums: ScanSums, variant: Variant, left_out: float | None) -> dict[str, str]:
    """Notes, by code, on lines that meet no grain and on segments that leave the sample."""
    texts, index = {}, "abcd".index(variant.name)
    channels, met = (int(counts[:, index].sum()) for counts in (sums.channels, sums.lines))
    if channels:
        text = f"{channels} of {channels + met} lines stay in a channel and meet no grain"
        texts["channels"] = text
    if left_out is not None and left_out > MOST_LEFT_OUT:
        texts["left_out"] = (
            f"{left_out:.1%} of the void segments of the RV leave the sample and are left out: "
            f"these are long segments, so the mean length is too small: choose a smaller `rv`, or "
            f"`edge=ends`, which needs nothing outside the RV"
        )
    return texts
