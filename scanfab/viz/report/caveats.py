"""Warnings of the report about the numbers of a table, in plain words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from scanfab.base.errors import SettingsError
from scanfab.scan.directions import direction_rule
from scanfab.table.row import groups_of, numbers_of

# The report warns of an error above this share of the largest void anisotropy.
NOTABLE = 0.1
# The report warns of scan directions with a larger bias than this.
SOME_BIAS = 1e-5
VOID = "alpha_vs_axial"

Groups = Mapping[tuple[str, str], Sequence[Mapping[str, Any]]]
"""Rows by source and variant."""


def caveats_of(rows: Sequence[Mapping[str, Any]], asked: Iterable[Mapping[str, Any]]) -> list[str]:
    """
    Warnings about tables, each in one or two sentences.

    Parameters
    ----------
    rows : sequence of mapping
        The rows of the fabric tables.
    asked : iterable of mapping
        The settings in their manifests.
    """
    found = [*_biases(asked)]
    filled = [row for row in rows if row[VOID] is not None]
    if len(filled) < len(rows):
        found.append(
            f"{len(rows) - len(filled)} of {len(rows)} rows have no void fabric: no void segment "
            f"was long enough, or some direction kept none."
        )
    groups = groups_of(filled)
    found += [*_unknown_errors(groups), *_large_errors(groups)]
    if groups and max(map(len, groups.values())) < 3:
        found.append(
            "There are fewer than three frames: no line is fitted to void against contact fabric."
        )
    return list(dict.fromkeys(found))


def _biases(asked: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """Warn of rules of scan directions that find anisotropy in an isotropic sample."""
    for one in asked:
        with suppress(SettingsError):
            name = str(one.get("directions") or "")
            bias = direction_rule(name).bias if name else 0.0
            if bias >= SOME_BIAS:
                yield (
                    f"The scan directions ({name}) are not spread evenly: a sample without any "
                    f"anisotropy would get α = {bias:.2g}. Changes of α between frames mean more "
                    f"than its value."
                )


def _unknown_errors(groups: Groups) -> Iterator[str]:
    """Warn of variants without a standard error of the scan."""
    for (source, variant), group in groups.items():
        if not numbers_of(group, f"{VOID}_se"):
            why = "it was made of one replicate"
            if f"{VOID}_se" not in group[0]:
                why = f"the table has no column {VOID}_se"
            yield (
                f"Variant {variant} of {source} has no standard error of the scan: {why}. Without "
                f"that part there is no error in all, and none behind ±."
            )


def _large_errors(groups: Groups) -> Iterator[str]:
    """Warn of sources with a large total error, and say what would make it smaller."""
    large: dict[str, list[tuple[str, float, float]]] = {}
    for (source, variant), group in groups.items():
        peak = max(group, key=lambda row: abs(float(row[VOID])))
        signal = abs(float(peak[VOID]))
        # use the errors of other frames only if the frame of the peak has none
        scan, sample = (
            max(numbers_of([peak], part) or numbers_of(group, part), default=0.0)
            for part in (f"{VOID}_se", f"{VOID}_sample_se")
        )
        total = math.hypot(scan, sample)
        if total > NOTABLE * signal:
            text = (
                f"in variant {variant} ({total:.2g} beside {signal:.2g}; scan {scan:.2g}, sample "
                f"{sample:.2g})"
            )
            large.setdefault(source, []).append((text, scan, sample))
    for source, doubts in large.items():
        # a part that is less than half of the other part hardly adds to the total error
        lines = any(scan > 0.5 * sample for _, scan, sample in doubts)
        grains = any(sample > 0.5 * scan for _, scan, sample in doubts)
        cure = "Only more grains would help; more lines cannot."
        if lines:
            more = "It takes more grains, and more lines" if grains else "More lines would help"
            cure = f"{more}: a smaller `tolerance` or `spacing`."
        yield (
            f"{source}: where α_vs is largest, its standard error, of scan and sample together, is "
            f"more than a tenth of it {'; '.join(text for text, _, _ in doubts)}. {cure}"
        )
