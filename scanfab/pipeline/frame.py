"""One frame: from its classified grains and contacts to the rows of the fabric table."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from scanfab.base.errors import ScanfabWarning
from scanfab.base.spelling import spelt_apart
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.pipeline.measurement import Measurement, measure
from scanfab.pipeline.plan import Plan
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.variant_columns import VariantColumns, no_columns
from scanfab.table.columns import complete_row
from scanfab.table.row import Row

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
    shear_strain: float | None = None,
) -> FrameResult:
    """Scan one frame; of a frame without grains there are rows without numbers."""
    frame: dict[str, Any] = {
        "source": name,
        "frame": number,
        "step": sample.packing.step,
        "time": sample.packing.time,
        "strain": strain,
        "shear_strain": shear_strain,
        "contacts_from": sample.contacts.source,
    }
    if plan is None or not sample.grains.any():
        empty = [
            complete_row({**no_columns(), **frame, "variant": variant})
            for variant in settings.variants
            for _ in settings.cutoffs or (settings.cutoff,)
        ]
        return FrameResult(name, number, sample, None, empty)
    doubt = sample.doubt_of_escaped()
    if doubt is not None:
        warnings.warn(f"frame {number}: {doubt}", ScanfabWarning, stacklevel=2)
    measurement = measure(sample, plan, settings, f"frame {number}")
    rows = []
    doubts: dict[str, list[str]] = {}
    for variant in settings.variants:
        for place in range(len(plan.cutoffs)):
            row = VariantColumns(measurement, VARIANTS[variant], place, settings)
            rows.append(complete_row({**frame, "variant": variant, **row.columns()}))
            for text in row.doubts():
                doubts.setdefault(text, []).append(variant)
    for text, variants in doubts.items():
        warnings.warn(f"frame {number}, {_named(variants)}: {text}", ScanfabWarning, stacklevel=2)
    if plan.auto and settings.lists_gaps:
        _warn_of_large_errors(rows, plan, settings)
    return FrameResult(name, number, sample, measurement, rows)


def _named(variants: Sequence[str]) -> str:
    """The variants that a message is about, each once."""
    named = list(dict.fromkeys(variants))
    return f"variant{'s' if len(named) > 1 else ''} {', '.join(named)}"


def _warn_of_large_errors(rows: list[Row], plan: Plan, settings: Settings) -> None:
    """Other cut-offs and the second moment are measured along lines that are chosen for one."""
    worst = max(rows, key=lambda row: row.alpha_vs_axial_se or 0.0)
    error = worst.alpha_vs_axial_se or 0.0
    if error > settings.tolerance:
        reached, tolerance = spelt_apart(error, settings.tolerance)
        warnings.warn(
            f"frame {worst.frame}, variant {worst.variant}, cut-off {worst.cutoff:g}: "
            f"alpha_vs_axial_se is {reached}, above the tolerance {tolerance}, which "
            f"holds for the mean length at the cut-off {plan.cutoff:g}: choose a smaller "
            f"`tolerance`",
            ScanfabWarning,
            stacklevel=3,
        )
