"""The tables of a comparison on a terminal: what matters most first, as wide as there is room."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from scanfab.cli.tables import GAP, Column, print_columns, spelt, width_of

if TYPE_CHECKING:
    from scanfab.table.compare import Comparison
    from scanfab.table.row import Row


BARS = " ▁▂▃▄▅▆▇█"
LONGEST_BARS = 30
# a shorter curve shows nothing
SHORTEST_BARS = 5

Titled = list[tuple[str, list[str]]]
"""Heads, each with its cells."""


def print_comparison(comparison: Comparison) -> None:
    """The summary, with a bar of the evolution for each curve, then the frames."""
    from rich.console import Console

    from scanfab.table.curves import short_names

    console = Console()
    names = short_names((row.source for row in comparison.summary), max(12, console.width // 5))
    if len(names) == 1:
        console.print(*names, markup=False, highlight=False)
    summary = [*_sources(comparison.summary, names), *_slopes(comparison.summary)]
    left = (console.width - width_of(_ranked(summary))) // 2 - GAP
    if left >= SHORTEST_BARS:
        summary += _curves(comparison, min(left, LONGEST_BARS))
    print_columns(_ranked(summary))
    console.print()
    print_columns(_ranked([*_sources(comparison.frames, names), *_frames(comparison.frames)]))
    console.print(
        "± total: standard error, of α_vs by scan and sample together, of α_c by the sample\n"
        "scan: its part of α_vs",
        highlight=False,
    )


def _sources(rows: Sequence[Row], names: dict[str, str]) -> Titled:
    return [("source", [names[row.source] for row in rows])] if len(names) > 1 else []


def _slopes(rows: Sequence[Row]) -> Titled:
    from scanfab.table.row import variant_of

    return [
        ("variant", [variant_of(row) for row in rows]),
        ("slope", [spelt(row.slope) for row in rows]),
        ("±", [spelt(row.slope_se, 2) for row in rows]),
        ("R²", [spelt(row.r2) for row in rows]),
        ("peak", [spelt(row.peak) for row in rows]),
        ("final", [spelt(row.final) for row in rows]),
        ("frames", [str(row.frames) for row in rows]),
    ]


def _curves(comparison: Comparison, longest: int) -> Titled:
    """Both anisotropies over the frames, as bars."""
    from scanfab.table.row import variant_of

    groups: dict[tuple[str, str], list[Row]] = {}
    for frame in comparison.frames:
        groups.setdefault((frame.source, variant_of(frame)), []).append(frame)
    curves = [groups[row.source, variant_of(row)] for row in comparison.summary]
    return [
        ("α_vs", [_bars([row.alpha_vs_axial_norm for row in curve], longest) for curve in curves]),
        ("α_c", [_bars([row.alpha_c_axial_norm for row in curve], longest) for curve in curves]),
    ]


def _frames(rows: Sequence[Row]) -> Titled:
    from scanfab.table.curves import strain_column
    from scanfab.table.row import variant_of

    sheared = strain_column(rows) == "shear_strain"
    return [
        ("frame", [str(row.frame) for row in rows]),
        (
            "shear strain" if sheared else "strain",
            [spelt(row.shear_strain if sheared else row.strain) for row in rows],
        ),
        ("variant", [variant_of(row) for row in rows]),
        ("α_vs axial", [spelt(row.alpha_vs_axial) for row in rows]),
        ("± total", [spelt(row.alpha_vs_axial_total_se, 2) for row in rows]),
        ("α_c axial", [spelt(row.alpha_c_axial) for row in rows]),
        ("± total", [spelt(row.alpha_c_axial_sample_se, 2) for row in rows]),
        ("scan", [spelt(row.alpha_vs_axial_se, 2) for row in rows]),
        ("α_vs/max", [spelt(row.alpha_vs_axial_norm) for row in rows]),
        ("α_c/max", [spelt(row.alpha_c_axial_norm) for row in rows]),
    ]


def _ranked(columns: Titled) -> list[Column]:
    """From the first, which always stays, to the last, which is left out first."""
    return [
        Column(title, cells, rank, left=title == "source")
        for rank, (title, cells) in enumerate(columns)
    ]


def _bars(values: Sequence[float | None], longest: int) -> str:
    """A curve of numbers up to ±1 as a line of bars, by size: in extension all are negative."""
    step = -(-len(values) // longest) if values else 1
    return "".join(
        "·" if value is None else BARS[round(abs(value) * (len(BARS) - 1))]
        for value in values[::step]
    )
