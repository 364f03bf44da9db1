"""compute_frame(): from the grains and contacts of one frame to its rows of the fabric table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from scanfab.base.arrays import compressed, in_parts
from scanfab.base.errors import Note, PackingError, ScanfabNote, joined
from scanfab.base.typing import BoolArray, IntArray
from scanfab.fabric import predicted
from scanfab.fabric.forces import doubts_of_forces
from scanfab.fabric.measured import Measured
from scanfab.fabric.registry import GROUPS, OWN_FABRICS, checked_values
from scanfab.io.frame import Frame
from scanfab.io.series import other_space
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing
from scanfab.packing.sample import VARIANTS, Sample, Variant
from scanfab.packing.search import near_pairs
from scanfab.pipeline.frames import sample_of
from scanfab.pipeline.map_rows import map_rows, places_of, tilings
from scanfab.pipeline.measurement import (
    Measurement,
    doubts_of_lines,
    edge_of,
    left_out_of,
    measure,
    scatter_of,
)
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.rv import RV, empty_rvs
from scanfab.pipeline.state import contact_forces, doubts_of_state, refuse_forces, sample_state
from scanfab.scan.blocks import Blocks
from scanfab.scan.edges import CLIP, ENDS
from scanfab.table.columns import RV_COLUMN, installed_fabrics, row_of
from scanfab.table.row import Row

# with fewer grains the numbers of a row mean little
FEW_GRAINS = 10


@dataclass(frozen=True, eq=False)
class FrameResult:
    """The rows of one frame, and the data they were made of, for figures and files."""

    source: str
    number: int
    sample: Sample
    measurements: Sequence[Measurement]
    """
    One for each RV. The whole sample has one of its own in an auto scan; in a fixed scan the first
    RV's holds it too. Empty for a map and for a frame without grains.
    """
    rows: list[Row]
    notes: tuple[Note, ...] = ()
    """Doubts about the rows."""
    blocks: tuple[Blocks, Blocks] | None = None
    """For a map the blocks of the whole sample and of the RV; None for a frame without grains."""

    def measured(self, variant: str, rv: float | None = None) -> Measurement:
        """
        The measurement of a variant in a frame that has grains.

        If there are several RVs, ``rv`` is the size of the RV.
        """
        return next(
            one
            for one in self.measurements
            if variant in one.plan.variants and one.plan.rvs_of(variant)[0].fraction == rv
        )


def compute_frame(
    frame: Packing | Sample | Frame, plan: Plan, *, number: int = 0, source: str = ""
) -> FrameResult:
    """
    Compute one frame of a series; frames do not depend on one another.

    Parameters
    ----------
    frame : Packing, Sample or Frame
        The frame; a Frame is read here.
    plan : Plan
        The plan of the series, the same for all its frames.
    number : int, optional
        Number of the frame in the series, from 0.
    source : str, optional
        Name of the series.

    Returns
    -------
    FrameResult
        If the frame has no grains, its rows have no numbers.

    Raises
    ------
    ScanfabError
        If the frame cannot be read or measured.
    """
    if not isinstance(frame, Sample):
        frame = sample_of(frame, plan.settings)
    try:
        return _computed(frame, plan, number, source)
    except PackingError as error:
        raise PackingError(f"frame {number}: {error}") from None


def _computed(frame: Sample, plan: Plan, number: int, source: str) -> FrameResult:
    packing, settings, has_grains = frame.packing, plan.settings, bool(frame.grains.any())
    if has_grains and packing.space != plan.space:
        raise PackingError(f"{other_space(packing.space, plan.space)} (`dim`)")
    known = {
        "source": source,
        "frame": number,
        "step": packing.step,
        "time": packing.time,
        "contacts_from": frame.contacts.source,
        **plan.strains.at(number, frame),
    }
    if not has_grains:
        return FrameResult(source, number, frame, (), list(_empty_rows(known, plan, packing.cell)))
    # rows have the order of the settings; in the frame, RVs without a void fabric come last
    rvs = plan.rvs
    plan = plan.in_frame(frame)
    notes = list(empty_rvs(plan.rvs))
    if plan.strains.file is not None and known["strain"] is None:
        text = f"{settings.strain} has no row for this frame, so its strain is empty"
        notes.append(Note("no_strain_in_file", text, kind=ScanfabNote))
    if plan.map_blocks is not None:
        rows, told, blocks = map_rows(frame, plan, known, f"frame {number}")
        return FrameResult(source, number, frame, (), rows, (*notes, *told), blocks)
    if {"forces", "state"} & {*settings.with_}:
        refuse_forces(frame, settings.with_)
    result = FrameResult(source, number, frame, measure(frame, plan, f"frame {number}"), [])
    doubts: list[Note] = []
    for variant in plan.variants:
        for rv in rvs if VARIANTS[variant].in_window else (RV(),):
            measurement = result.measured(variant, rv.fraction)
            for place in range(len(plan.cutoffs)):
                # one at a time, because each holds the contacts of its variant
                one = VariantColumns(measurement, VARIANTS[variant], place)
                values = {**known, "variant": variant, **one.columns()}
                result.rows.append(row_of(settings.columns, values))
                doubts += one.notes()
    few = tuple(dict.fromkeys(row.variant for row in result.rows if 0 < row.grains < FEW_GRAINS))
    if few:
        text = f"fewer than {FEW_GRAINS} grains: the numbers of these rows mean little"
        doubts.append(Note("few_grains", text, few, ScanfabNote))
    notes += [note for measurement in result.measurements for note in measurement.notes]
    return replace(result, notes=(*notes, *joined(doubts)))


def _empty_rows(known: Mapping[str, Any], plan: Plan, cell: Cell | None) -> Iterator[Row]:
    """The rows of a frame without grains."""
    empty, settings = {**known, "grains": 0, "rattlers": 0, "contacts": 0}, plan.settings
    for variant in plan.variants:
        places = [{"block": block} for block in range(settings.blocks)]
        if plan.map_blocks is not None:
            columns = places_of(tilings(plan, cell)[VARIANTS[variant].in_window])
            parts = zip(*(values.tolist() for values in columns.values()), strict=True)
            places = [dict(zip(columns, part, strict=True)) for part in parts]
        for rv, place in product(plan.rvs_of(variant), places):
            own = {"variant": variant, RV_COLUMN.name: rv.fraction, **place}
            yield from [row_of(settings.columns, {**empty, **own})] * len(plan.cutoffs)


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
        plan, measured, sample = self.plan, self.measured, self.sample
        counted = sample.counted(self.variant, self.window)
        row = {
            "grains": sample.number(counted & ~sample.removed(self.variant)),
            "rattlers": sample.number(counted & sample.rattlers),
            "contacts": len(measured.normals),
            "coordination": sample.coordination(self.variant, self.window),
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
        name, place, groups = self.variant.name, self.place, plan.settings.with_
        length, segments = measurement.kept(name, place)
        chosen = sample.fabric_contacts(self.variant, self.window)
        state = sample_state(sample, self.variant, self.window) if "state" in groups else None
        return Measured(
            axis=np.asarray(plan.settings.axis),
            axes=self.sums.axes,
            weights=plan.rule.weights,
            length=length,
            segments=segments,
            meets_solids=not self.lack and bool(sample.solids(self.variant, self.window).any()),
            void_scatter=scatter_of(measurement.blocked, plan, name, place),
            blocks=self._blocks_of(chosen),
            normals=compressed(chosen, sample.contacts.normal),
            space=plan.space,
            segment_count=int(measurement.kept(name, place, moment=1)[1].sum()),
            forces=contact_forces(sample, chosen) if "forces" in groups else None,
            state=state,
        )

    def _blocks_of(self, chosen: BoolArray) -> IntArray:
        """The block of the sample that each chosen contact lies in."""
        places = compressed(chosen, self.sample.contacts.point)
        if self.window is not None:
            places = self.window.placed(places, self.sample.packing)
        blocks = self.measurement.blocks[self.variant.in_window]
        numbers: IntArray = in_parts(blocks.of, places)
        return numbers

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
        holds = packing.bodies is None and settings.moment == 1 and self.cutoff <= longest
        if solid is None or not holds or self.measured.void is None:
            return None
        solids = self.sample.grains & ~self.sample.removed(self.variant)
        counted = self.sample.counted(self.variant, self.window)
        pairs = near_pairs(packing, solids, counted, self.window, self.cutoff)
        return predicted.predicted_alpha(pairs, 1.0 - solid, self.cutoff, settings.axis)

    @property
    def window_alpha(self) -> float | None:
        """Anisotropy due to the window alone; 0 if the edge rule cuts no segments."""
        fabric, settings = self.measured.void, self.plan.settings
        is_cut = settings.edge == CLIP
        if self.window is None or fabric is None or (is_cut and settings.moment != 1):
            return None
        shape, axis = self.window.shape, self.measured.axis
        return predicted.window_alpha(shape, fabric, self.cutoff, axis) if is_cut else 0.0

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
            grain = "no grain but rattlers" if self.variant.without_rattlers else "no grain"
            place = "is left" if self.window is None else f"reaches into the {self.window}"
            return {"no_solid": f"{grain} {place}"}
        if self.edge == ENDS and self.window is None and self.measurement.solids.inner is None:
            text = "the sample is flat or too small for `edge=ends`: no ellipsoid fits into it"
            return {"no_inner_window": text}
        if self.measured.segment_count == 0:
            times = self.cutoff / float(sample.packing.radius[sample.grains].min())
            text = f"no void segment reaches the cut-off {self.cutoff:g}, {times:.4g} times the "
            advice = "check the radii, or choose a shorter cut-off or a larger RV"
            if times > 5.0:
                advice = "lengths are in the dump's unit, did you mean 1rmin?"
            return {"cutoff_too_long": f"{text}smallest radius: {advice}"}
        if void is None:
            text = "in some direction no void segment is kept, so there is no void fabric"
            return {"empty_direction": text}
        if void.filled <= 0.01:
            return {}
        text = f"{void.filled:.0%} of the directions keep no void segment in a replicate"
        return {"filled_directions": f"{text}: choose a smaller spacing"}
