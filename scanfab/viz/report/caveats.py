"""What a reader of a table should know before believing it, in plain words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scanfab.base.errors import SettingsError
from scanfab.scan.directions import direction_rule
from scanfab.table.row import number_of, numbers_of, variant_of

# scatter of alpha_vs_axial between samples of N grains: seen 3.5e-4 for 4,600 and some 1e-3 for 500
SCATTER = 0.024
# share of the largest void anisotropy from which an error is worth a word
NOTABLE = 0.1
SOME_BIAS = 1e-5
VOID = "alpha_vs_axial"


def caveats_of(rows: Sequence[Mapping[str, Any]], asked: Iterable[Mapping[str, Any]]) -> list[str]:
    """
    Warnings about a table, one sentence or two each.

    Parameters
    ----------
    rows : sequence of mapping
        Of fabric tables.
    asked : iterable of mapping
        The settings of their manifests.
    """
    found = [_bias(str(one["directions"])) for one in asked if one.get("directions")]
    found += [_missing(rows), *_unknown_errors(rows), *_large_errors(rows), _few_frames(rows)]
    return [text for text in dict.fromkeys(found) if text]


def _bias(name: str) -> str:
    try:
        bias = direction_rule(name).bias
    except SettingsError:
        return ""
    if bias < SOME_BIAS:
        return ""
    return (
        f"The scan directions ({name}) are not spread evenly: a sample without any anisotropy "
        f"would get α = {bias:.2g}. Changes of α between frames mean more than its value."
    )


def _missing(rows: Sequence[Mapping[str, Any]]) -> str:
    empty = sum(row["alpha_vs_axial"] is None for row in rows)
    if not empty:
        return ""
    return (
        f"{empty} of {len(rows)} rows have no void fabric: no void segment was long enough, or "
        f"some direction kept none."
    )


def _groups(rows: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], list[Mapping[str, Any]]]:
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        if row["alpha_vs_axial"] is not None:
            groups.setdefault((row["source"], variant_of(row)), []).append(row)
    return groups


def _unknown_errors(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Variants of whose scan no error is known."""
    found = []
    for (source, variant), group in _groups(rows).items():
        if numbers_of(group, f"{VOID}_se"):
            continue
        why = (
            "it was made of one replicate"
            if f"{VOID}_se" in group[0]
            else f"the table has no column {VOID}_se"
        )
        found.append(
            f"Variant {variant} of {source} has no standard error of the scan: {why}. Without "
            f"that part there is no error in all, and none behind ±."
        )
    return found


def _large_errors(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sources whose total error is large beside their signal, and what would make it smaller."""
    large: dict[str, list[_Doubt]] = {}
    for (source, variant), group in _groups(rows).items():
        doubt = _Doubt.of(variant, group)
        if doubt.total > NOTABLE * doubt.signal:
            large.setdefault(source, []).append(doubt)
    return [
        f"{source}: where α_vs is largest, its standard error, of scan and sample together, is "
        f"more than a tenth of it {'; '.join(map(str, doubts))}. {_what_helps(doubts)}"
        for source, doubts in large.items()
    ]


@dataclass(frozen=True)
class _Doubt:
    """How large the errors of one variant are beside its signal, where that is largest."""

    variant: str
    signal: float
    scan: float
    sample: float
    is_guess: bool
    """Whether the sample's part is but a rule of thumb."""

    @classmethod
    def of(cls, variant: str, group: Sequence[Mapping[str, Any]]) -> _Doubt:
        peak = max(group, key=lambda row: abs(float(row[VOID])))
        known = numbers_of([peak], f"{VOID}_sample_se") or numbers_of(group, f"{VOID}_sample_se")
        scans = numbers_of([peak], f"{VOID}_se") or numbers_of(group, f"{VOID}_se")
        grains = number_of(peak, "grains")
        guess = 0.0 if grains is None else SCATTER / max(grains, 1.0) ** 0.5
        return cls(
            variant=variant,
            signal=abs(float(peak[VOID])),
            # of the other frames only where the peak's own are not known
            scan=max(scans, default=0.0),
            sample=max(known, default=guess),
            is_guess=not known and guess > 0,
        )

    @property
    def total(self) -> float:
        return math.hypot(self.scan, self.sample)

    def __str__(self) -> str:
        guess = ", guessed from the number of grains" if self.is_guess else ""
        return (
            f"in variant {self.variant} ({self.total:.2g} beside {self.signal:.2g}; scan "
            f"{self.scan:.2g}, sample {self.sample:.2g}{guess})"
        )


def _what_helps(doubts: Sequence[_Doubt]) -> str:
    # a part that is less than half of the other hardly adds to the whole
    lines = any(one.scan > 0.5 * one.sample for one in doubts)
    grains = any(one.sample > 0.5 * one.scan for one in doubts)
    if lines and not grains:
        return "More lines would help: a smaller `tolerance` or `spacing`."
    if lines:
        return "It takes more grains, and more lines: a smaller `tolerance` or `spacing`."
    return "Only more grains would help; more lines cannot."


def _few_frames(rows: Sequence[Mapping[str, Any]]) -> str:
    groups = _groups(rows)
    if groups and max(len(group) for group in groups.values()) < 3:
        return (
            "There are fewer than three frames: no line is fitted to void against contact fabric."
        )
    return ""
