"""The tables of a comparison on a terminal: what matters most first, as wide as there is room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from scanfab.comparison import Comparison, FrameRow, SummaryRow

__all__ = ["print_comparison"]

BARS = " ▁▂▃▄▅▆▇█"
LONGEST_BARS = 30
# a shorter curve shows nothing
SHORTEST_BARS = 5
GAP = 2

Column = tuple[str, list[str]]
"""The head and the cells."""


def print_comparison(comparison: Comparison) -> None:
    """The summary, with a bar of the evolution for each curve, then the frames."""
    from rich.console import Console

    from scanfab.writers.curves import short_names

    console = Console()
    names = short_names((row.source for row in comparison.summary), max(12, console.width // 5))
    if len(names) == 1:
        console.print(*names, markup=False, highlight=False)
    summary = [*_sources(comparison.summary, names), *_slopes(comparison.summary)]
    left = (console.width - _width(summary)) // 2 - GAP
    if left >= SHORTEST_BARS:
        summary += _curves(comparison, min(left, LONGEST_BARS))
    _print(console, summary)
    console.print()
    _print(console, [*_sources(comparison.frames, names), *_frames(comparison.frames)])
    console.print(
        "± total: standard error, of α_vs by scan and sample together, of α_c by the sample\n"
        "scan: its part of α_vs",
        highlight=False,
    )


def _sources(rows: Sequence[FrameRow | SummaryRow], names: dict[str, str]) -> list[Column]:
    return [("source", [names[row.source] for row in rows])] if len(names) > 1 else []


def _slopes(rows: Sequence[SummaryRow]) -> list[Column]:
    return [
        ("variant", [row.variant for row in rows]),
        ("slope", [_spell(row.slope) for row in rows]),
        ("±", [_spell(row.slope_se, 2) for row in rows]),
        ("R²", [_spell(row.r2) for row in rows]),
        ("peak", [_spell(row.peak) for row in rows]),
        ("final", [_spell(row.final) for row in rows]),
        ("frames", [str(row.frames) for row in rows]),
    ]


def _curves(comparison: Comparison, longest: int) -> list[Column]:
    """Both anisotropies over the frames, as bars."""
    groups: dict[tuple[str, str], list[FrameRow]] = {}
    for frame in comparison.frames:
        groups.setdefault((frame.source, frame.variant), []).append(frame)
    curves = [groups[row.source, row.variant] for row in comparison.summary]
    return [
        ("α_vs", [_bars([row.alpha_vs_axial_norm for row in curve], longest) for curve in curves]),
        ("α_c", [_bars([row.alpha_c_axial_norm for row in curve], longest) for curve in curves]),
    ]


def _frames(rows: Sequence[FrameRow]) -> list[Column]:
    from scanfab.abscissa import strain_column

    sheared = strain_column([asdict(row) for row in rows]) == "shear_strain"
    return [
        ("frame", [str(row.frame) for row in rows]),
        (
            "shear strain" if sheared else "strain",
            [_spell(row.shear_strain if sheared else row.strain) for row in rows],
        ),
        ("variant", [row.variant for row in rows]),
        ("α_vs axial", [_spell(row.alpha_vs_axial) for row in rows]),
        ("± total", [_spell(row.alpha_vs_axial_total_se, 2) for row in rows]),
        ("α_c axial", [_spell(row.alpha_c_axial) for row in rows]),
        ("± total", [_spell(row.alpha_c_axial_sample_se, 2) for row in rows]),
        ("scan", [_spell(row.alpha_vs_axial_se, 2) for row in rows]),
        ("α_vs/max", [_spell(row.alpha_vs_axial_norm) for row in rows]),
        ("α_c/max", [_spell(row.alpha_c_axial_norm) for row in rows]),
    ]


def _print(console: Console, columns: Sequence[Column]) -> None:
    """As many columns, from the first, as the terminal has room for: none is cut."""
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, GAP, 0, 0))
    shown = [
        column
        for place, column in enumerate(columns, 1)
        if _width(columns[:place]) <= console.width
    ]
    for title, _ in shown:
        table.add_column(title, justify="left" if title == "source" else "right", no_wrap=True)
    for cells in zip(*(cells for _, cells in shown), strict=True):
        table.add_row(*cells)
    console.print(table)


def _width(columns: Sequence[Column]) -> int:
    widths = [max(map(len, [title, *cells])) for title, cells in columns]
    return sum(widths) + GAP * (len(widths) - 1)


def _bars(values: Sequence[float | None], longest: int) -> str:
    """A curve of numbers up to ±1 as a line of bars, by size: in extension all are negative."""
    step = -(-len(values) // longest) if values else 1
    return "".join(
        "·" if value is None else BARS[round(abs(value) * (len(BARS) - 1))]
        for value in values[::step]
    )


def _spell(value: float | None, digits: int = 3) -> str:
    return "-" if value is None else f"{value:.{digits}g}"
