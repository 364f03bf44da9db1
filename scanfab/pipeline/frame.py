"""compute_frame(): from the grains and contacts of one frame to its rows of the fabric table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from scanfab.base.errors import Note, PackingError, ScanfabNote, joined
from scanfab.base.spelling import spelt_apart
from scanfab.io.frame import Frame
from scanfab.io.series import other_space
from scanfab.packing.columns import RV_COLUMN
from scanfab.packing.packing import Packing
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.pipeline.frames import packing_of, sample_rule
from scanfab.pipeline.maps.rows import map_rows
from scanfab.pipeline.measurement import Measurement, measure
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.rv import RV, empty_rvs
from scanfab.pipeline.state import refuse_forces
from scanfab.pipeline.variant_columns import VariantColumns
from scanfab.scan.blocks import Blocks
from scanfab.table.columns import row_of
from scanfab.table.row import Row

# with fewer grains the numbers of a row mean little
FEW_GRAINS = 10
OTHER_CUTOFFS = "error_at_other_cutoffs"
"""Code of the note that the scan is fine enough for its cut-off, but not for another."""


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
    sample = (
        frame if isinstance(frame, Sample) else sample_rule(plan.settings).sample(packing_of(frame))
    )
    try:
        return _computed(sample, plan, number, source)
    except PackingError as error:
        raise PackingError(f"frame {number}: {error}") from None


def _computed(frame: Sample, plan: Plan, number: int, source: str) -> FrameResult:
    has_grains = bool(frame.grains.any())
    if has_grains and frame.packing.space != plan.space:
        raise PackingError(f"{other_space(frame.packing.space, plan.space)} (`dim`)")
    known = {
        "source": source,
        "frame": number,
        "step": frame.packing.step,
        "time": frame.packing.time,
        "contacts_from": frame.contacts.source,
        **plan.strains.at(number, frame),
    }
    if not has_grains:
        return FrameResult(source, number, frame, (), list(_empty_rows(known, plan)))
    rvs, plan = plan.rvs, plan.in_frame(frame)
    notes = frame.doubts_of_escaped()
    notes += empty_rvs(plan.rvs)
    if plan.map_blocks is not None:
        rows, told, blocks = map_rows(frame, plan, known, f"frame {number}")
        return FrameResult(source, number, frame, (), rows, (*notes, *told), blocks)
    groups, columns = plan.settings.with_, plan.settings.columns
    if "forces" in groups or "state" in groups:
        refuse_forces(frame, groups)
    result = FrameResult(source, number, frame, measure(frame, plan, f"frame {number}"), [])
    doubts: list[Note] = []
    for variant in plan.variants:
        for rv in rvs if VARIANTS[variant].in_window else (RV(),):
            measurement = result.measured(variant, rv.fraction)
            for place in range(len(plan.cutoffs)):
                # one at a time, because each holds the contacts of its variant
                one = VariantColumns(measurement, VARIANTS[variant], place)
                values = {**known, "variant": variant, **one.columns()}
                result.rows.append(row_of(columns, values))
                doubts += one.notes()
    few = tuple(dict.fromkeys(row.variant for row in result.rows if 0 < row.grains < FEW_GRAINS))
    if few:
        text = f"fewer than {FEW_GRAINS} grains: the numbers of these rows mean little"
        doubts.append(Note("few_grains", text, few, ScanfabNote))
    notes += [note for measurement in result.measurements for note in measurement.notes]
    notes += [*joined(doubts), *_large_errors(result.rows, plan)]
    return replace(result, notes=tuple(notes))


def _empty_rows(known: Mapping[str, Any], plan: Plan) -> Iterator[Row]:
    """The rows of a frame without grains."""
    empty, settings = {**known, "grains": 0, "rattlers": 0, "contacts": 0}, plan.settings
    for variant in plan.variants:
        for rv, block in product(plan.rvs_of(variant), range(settings.blocks)):
            own = {"variant": variant, RV_COLUMN.name: rv.fraction, "block": block}
            yield from [row_of(settings.columns, {**empty, **own})] * len(plan.cutoffs)


def _large_errors(rows: list[Row], plan: Plan) -> Iterator[Note]:
    """
    A note if a scan that meets the tolerance for one row misses it for another row.

    This happens for other cut-offs, other RVs and the second moment, which use the same lines.
    """

    def aim_of(row: Row) -> float:
        return plan.settings.aim(row.alpha_vs_axial_sample_se)

    worst = max(rows, key=lambda row: (row.alpha_vs_axial_se or 0.0) / aim_of(row))
    error, rv = worst.alpha_vs_axial_se or 0.0, worst.get(RV_COLUMN.name)
    aim, others = aim_of(worst), plan.settings.lists_gaps or len(plan.rvs) > 1
    if plan.auto and others and error > aim:
        reached, tolerance = spelt_apart(error, aim)
        where = f"at the cut-off {worst.cutoff:g}{f' in the RV {rv:g}' if rv else ''}"
        met = f"which holds at {plan.cutoff:g}{f' in {plan.rvs[0].fraction:g}' if rv else ''}"
        text = f"{where} alpha_vs_axial_se is {reached}, above the tolerance {tolerance}, {met}"
        yield Note(OTHER_CUTOFFS, f"{text}: choose a smaller `tolerance`", (worst.variant,))
