"""The tables of the report: results, frames, settings and inputs, spelt for readers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scanfab.compare import SummaryRow
from scanfab.rerun import spelt_settings
from scanfab.tabular import number_of, numbers_of
from scanfab.writers.page import Part

__all__ = ["frame_table", "input_table", "overview", "results_table", "settings_table"]

# frames of a source and variant that the table shows
MOST_FRAMES = 12
MOST_INPUTS = 20

SETTING_MEANINGS = {
    "variants": "a whole sample, b without rattlers, c RV, d RV without rattlers",
    "rv": "radius of the RV over half the smallest extent of the grains",
    "rv_radius": "radius of the RV, dump's unit",
    "rv_center": "centre of the RV, dump's unit",
    "boundary": "particles that are boundary, not grains",
    "cutoff": "shortest void segment that counts (rmin: smallest grain radius)",
    "spacing": "distance between neighbouring scan lines",
    "directions": "rule of the scan directions",
    "tolerance": "wanted standard error of the scan",
    "min_contacts": "a grain with fewer contacts is a rattler",
    "contact_tolerance": "relative tolerance of contacts by geometry",
    "axis": "loading axis",
    "strain": "where the axial strain comes from",
    "frames": "which frames",
    "seed": "of the random numbers",
    "contacts": "where the contacts come from",
}


def overview(table: Path, rows: Sequence[Mapping[str, Any]]) -> str:
    """What was measured, in a sentence."""
    if not rows:
        return f"{table}: an empty table."
    sources = list(dict.fromkeys(str(row["source"]) for row in rows))
    frames = len({(row["source"], row["frame"]) for row in rows})
    variants = ", ".join(sorted({str(row["variant"]) for row in rows}))
    grains = numbers_of(rows, "grains")
    strains = numbers_of(rows, "strain")
    parts = [
        f"{frames} {'frame' if frames == 1 else 'frames'} of {', '.join(sources)}",
        f"variants {variants}",
    ]
    if grains:
        parts.append(f"{min(grains):.0f} to {max(grains):.0f} grains")
    if strains:
        parts.append(f"axial strain {100 * min(strains):.3g} to {100 * max(strains):.3g} %")
    return "; ".join(parts) + "."


def results_table(
    summary: Iterable[SummaryRow], rows: Sequence[Mapping[str, Any]]
) -> list[list[str]]:
    """One line for each source and variant."""
    lines = []
    for one in summary:
        group = [
            row
            for row in rows
            if (row["source"], row["variant"]) == (one.source, one.variant)
            and row["alpha_vs_axial"] is not None
        ]
        first, last = (group[0], group[-1]) if group else ({}, {})
        lines.append(
            [
                one.source,
                one.variant,
                str(one.frames),
                _with_error(*_pair(first, "alpha_vs_axial")),
                _with_error(*_pair(last, "alpha_vs_axial")),
                _with_error(*_pair(last, "alpha_c_axial")),
                _with_error(one.slope, one.slope_se),
                _spell(one.r2),
            ]
        )
    return lines


def _pair(row: Mapping[str, Any], name: str) -> tuple[float | None, float | None]:
    return number_of(row, name), number_of(row, f"{name}_se")


def _with_error(value: float | None, error: float | None) -> str:
    """A small number, with two digits of its error if that is known."""
    if value is None:
        return "-"
    if error is None or error <= 0:
        return f"{value:.5f}"
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def _spell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def frame_table(rows: Sequence[Mapping[str, Any]]) -> Part:
    """The columns that matter most, of some frames."""
    columns = [
        "source", "frame", "strain", "variant", "grains", "rattlers", "contacts", "coordination",
        "solid_fraction", "segments", "mean_length", "alpha_vs", "alpha_vs_axial",
        "alpha_vs_axial_se", "alpha_vs_axial_sample_se", "alpha_c_axial",
    ]  # fmt: skip
    columns = [name for name in columns if any(row.get(name) is not None for row in rows)]
    numbers = list(dict.fromkeys((row["source"], row["frame"]) for row in rows))
    step = -(-len(numbers) // MOST_FRAMES)
    shown = {*numbers[::step], numbers[-1]}
    lines = [
        [_spell(row.get(name)) for name in columns]
        for row in rows
        if (row["source"], row["frame"]) in shown
    ]
    note = "" if len(shown) == len(numbers) else f"{len(shown)} of {len(numbers)} frames are shown."
    return Part(columns, lines, note)


def settings_table(asked: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value and meaning of each setting."""
    spelt = spelt_settings(asked)
    names = [name for name in asked if name not in ("scanfab", "sources")]
    return [
        (
            name.replace("_", "-"),
            _plain(spelt.get(name, "auto" if name in ("spacing", "directions") else "-")),
            SETTING_MEANINGS.get(name, ""),
        )
        for name in names
        if name in spelt or name in SETTING_MEANINGS
    ]


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    if isinstance(value, dict):
        return ", ".join(f"{key}={item}" for key, item in value.items())
    return str(value)


def input_table(manifest: Mapping[str, Any]) -> Part:
    """The files with size and hash, not more than fit."""
    files = list(manifest.get("inputs") or [])
    lines = [
        [str(one.get("path")), str(one.get("size")), str(one.get("sha256"))]
        for one in files[:MOST_INPUTS]
    ]
    more = len(files) - len(lines)
    note = f"and {more} more, in the manifest" if more else ""
    return Part(["file", "bytes", "SHA-256"], lines, note)
