"""What a reader of a table should know before believing it, in plain words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from scanfab.directions import direction_rule
from scanfab.errors import SettingsError
from scanfab.tabular import numbers_of

__all__ = ["caveats_of"]

# scatter of alpha_vs_axial between samples of N grains: seen 3.5e-4 for 4,600 and some 1e-3 for 500
SCATTER = 0.024
# share of the largest void anisotropy from which an error is worth a word
NOTABLE = 0.1
SOME_BIAS = 1e-5


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
    found += [_missing(rows), *_scan_errors(rows), *_few_grains(rows), _few_frames(rows)]
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
            groups.setdefault((row["source"], row["variant"]), []).append(row)
    return groups


def _signal(group: Sequence[Mapping[str, Any]]) -> float:
    return max(abs(float(row["alpha_vs_axial"])) for row in group)


def _scan_errors(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Variants whose scan is too coarse for their signal."""
    found = []
    for (source, variant), group in _groups(rows).items():
        known = numbers_of(group, "alpha_vs_axial_se")
        if not known:
            found.append(
                f"Variant {variant} of {source} has no standard error of the scan: "
                f"it was made of one replicate."
            )
        elif max(known) > NOTABLE * _signal(group):
            found.append(
                f"Variant {variant} of {source}: the scan's standard error ({max(known):.1g}) is "
                f"more than a tenth of the largest void anisotropy ({_signal(group):.2g}). More "
                f"lines would help: a smaller --tolerance or --spacing."
            )
    return found


def _few_grains(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sources of so few grains that another sample would look different."""
    small: dict[str, list[str]] = {}
    for (source, variant), group in _groups(rows).items():
        grains = int(min(numbers_of(group, "grains"), default=0))
        known = numbers_of(group, "alpha_vs_axial_sample_se")
        scatter = max(known) if known else SCATTER / max(grains, 1) ** 0.5
        if grains and scatter > NOTABLE * _signal(group):
            small.setdefault(source, []).append(
                f"by about {scatter:.1g} in variant {variant} ({grains} grains, "
                f"largest value {_signal(group):.2g})"
            )
    return [
        f"{source} has few grains. Another sample of the same material would differ in α_vs "
        f"{'; '.join(parts)}. More lines cannot help, only more grains."
        for source, parts in small.items()
    ]


def _few_frames(rows: Sequence[Mapping[str, Any]]) -> str:
    groups = _groups(rows)
    if groups and max(len(group) for group in groups.values()) < 3:
        return (
            "There are fewer than three frames: no line is fitted to void against contact fabric."
        )
    return ""
