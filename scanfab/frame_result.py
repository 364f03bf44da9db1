"""One frame: from its classified grains and contacts to the rows of the fabric table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scanfab.measurement import Measurement, measure
from scanfab.plan import Plan
from scanfab.settings import Settings
from scanfab.table import Row
from scanfab.variant_columns import VariantColumns, no_columns
from scanfab.variants import VARIANTS, Sample

__all__ = ["FrameResult", "frame_result"]


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
            Row(**frame, variant=variant, **no_columns())
            for variant in settings.variants
            for _ in settings.cutoffs or (settings.cutoff,)
        ]
        return FrameResult(name, number, sample, None, empty)
    measurement = measure(sample, plan, settings)
    rows = []
    for variant in settings.variants:
        for place in range(len(plan.cutoffs)):
            row = VariantColumns(measurement, VARIANTS[variant], place, settings)
            row.warn_of_few_segments(f"frame {number}, variant {variant}")
            rows.append(Row(**frame, variant=variant, **row.columns()))
    return FrameResult(name, number, sample, measurement, rows)
