"""What an auto scan goes on for: how it is scanned, and whose error is to meet the tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from scanfab.fabric.void import void_fabric
from scanfab.pipeline.plan import Plan
from scanfab.scan.scan import ScanSums, scan_lines
from scanfab.scan.solids import Solids

__all__ = ["EACH_VARIANT", "Errors", "Goal"]


class Errors(NamedTuple):
    """Standard errors of the axial anisotropy by the scan."""

    reported: float
    """By the scatter of the replicates: what the table says."""
    expected: float
    """Less noisy, to plan by."""


class Goal(Protocol):
    """What is scanned, and what is to meet the tolerance."""

    def scan(
        self, solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
    ) -> Any:
        """Sums, with their ``replicates``, ``chords``, ``steps`` and ``work``."""
        ...

    def concatenate(self, parts: Sequence[Any]) -> Any:
        """All replicates of several such sums."""
        ...

    def errors(self, sums: Any, plan: Plan, variant: str) -> Errors | None:
        """Of one variant; None if it has no fabric."""
        ...

    def empty_share(self, sums: Any, variant: str) -> float:
        """Share of the replicates' axes without a segment; 1 where none has any."""
        ...


class EachVariant:
    """The plain scan: the error of each variant is to meet the tolerance."""

    def scan(
        self, solids: Solids, plan: Plan, replicates: range, most_steps: float = math.inf
    ) -> ScanSums:
        """As planned."""
        return scan_lines(
            solids,
            plan.rule,
            spacing=plan.spacing,
            cutoff=plan.cutoff,
            variants=plan.variants,
            replicates=replicates,
            seed=plan.seed,
            workers=plan.workers,
            most_steps=most_steps,
        )

    def concatenate(self, parts: Sequence[ScanSums]) -> ScanSums:
        """All replicates."""
        return ScanSums.concatenate(parts)

    def errors(self, sums: ScanSums, plan: Plan, variant: str) -> Errors | None:
        """By the replicates, and about a polynomial."""
        fabric = void_fabric(sums.axes, plan.rule.weights, *sums.kept(variant))
        if fabric is None:
            return None
        reported = fabric.axial_error(plan.axis) or 0.0
        expected = fabric.expected_error(plan.axis, plan.rule.degree)
        return Errors(reported, expected or reported)

    def empty_share(self, sums: ScanSums, variant: str) -> float:
        """Of all replicates and axes."""
        return float(np.mean(sums.kept(variant)[1] == 0))


EACH_VARIANT = EachVariant()
