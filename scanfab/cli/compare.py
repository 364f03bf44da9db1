"""scanfab compare: variants of fabric tables side by side."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import check_plot, output_option, plot_option, usage_errors

if TYPE_CHECKING:
    from scanfab.compare import Comparison

__all__ = ["compare"]

BARS = " ▁▂▃▄▅▆▇█"


@click.command()
@click.argument(
    "tables",
    metavar="TABLE...",
    nargs=-1,
    required=True,
    type=click.Path(exists=True, dir_okay=False, allow_dash=True),
)
@click.option("--summary", is_flag=True, help="One row per source and variant: slopes and peaks.")
@click.option(
    "--differences", is_flag=True, help="One row per frame and pair of variants: how far apart."
)
@click.option(
    "--strain-max", type=float, metavar="X", help="Leave frames beyond this strain out of the fits."
)
@click.option(
    "--cutoff",
    type=float,
    metavar="C",
    help="Take the rows of this cut-off from tables of several; in the tables' unit.",
)
@click.option(
    "--label",
    "labels",
    multiple=True,
    metavar="NAME",
    help="Name of a table in place of its source, once a table, in their order.",
)
@output_option
@plot_option
@click.option(
    "--figure",
    metavar="NAME",
    help="Which figure: evolution, normalised or correlation (default: all on one page).",
)
def compare(
    tables: tuple[str, ...],
    summary: bool,
    differences: bool,
    strain_max: float | None,
    cutoff: float | None,
    labels: tuple[str, ...],
    output: Path | None,
    plot: Path | None,
    figure: str | None,
) -> int:
    """
    Set the variants of fabric tables side by side.

    TABLE is what scanfab compute wrote (CSV, TSV, JSON, JSON lines, Parquet), or - for standard
    input. Per frame: both anisotropies, also divided by their own largest absolute value; with
    --summary, per source and variant: the slope of void on contact fabric. On a terminal both.
    """
    from scanfab.cli.console import reported_warnings
    from scanfab.compare import compare_tables
    from scanfab.errors import SettingsError
    from scanfab.figures import TABLE_FIGURES, plot_rows
    from scanfab.selection import choose_rows
    from scanfab.tabular import read_rows
    from scanfab.writers.rows import check_suffix

    check_plot(plot, figure, TABLE_FIGURES)
    if summary and differences:
        raise click.UsageError("--summary and --differences are two tables: ask for one of them")
    if labels and len(labels) != len(tables):
        raise click.UsageError(f"--label: expected one a table: {len(tables)}, found {len(labels)}")
    if output is not None:
        with usage_errors():
            check_suffix(output)
    with reported_warnings():
        read = [(table, read_rows(table)) for table in tables]
        rows = [row for one in choose_rows(read, cutoff, labels) for row in one]
        comparison = compare_tables(rows, strain_max=strain_max)
        chosen: Sequence[Any] = comparison.frames
        if summary:
            chosen = comparison.summary
        elif differences:
            chosen = comparison.differences
        if not chosen:
            lacking = "two variants of one frame" if comparison.frames else "frames"
            raise SettingsError(f"there is nothing to compare: the tables hold no {lacking}")
        if output is not None:
            _write_file(chosen, output)
        elif sys.stdout.isatty() and not differences:
            _print(comparison)
        else:
            _write_csv(chosen)
        if plot is not None:
            plot_rows(plot, rows, figure, strain_max)
    return 0 if any(row.alpha_vs_axial is not None for row in comparison.frames) else 1


def _write_csv(rows: Sequence[Any]) -> None:
    from scanfab.writers.rows import CsvWriter

    writer = CsvWriter(sys.stdout)
    for row in rows:
        writer.write(row)


def _write_file(rows: Sequence[Any], output: Path) -> None:
    from scanfab.writers.results import ResultFile

    with ResultFile(output, type(rows[0])).writer({}) as writer:
        for row in rows:
            writer.write(row)


def _print(comparison: Comparison) -> None:
    """The summary, with a bar of the evolution for each curve, then the frames."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in ("source", "variant", "frames", "α_vs", "α_c", "slope", "R²", "peak", "final"):
        table.add_column(title, justify="left" if title == "source" else "right")
    for row in comparison.summary:
        curve = [f for f in comparison.frames if (f.source, f.variant) == (row.source, row.variant)]
        table.add_row(
            row.source,
            row.variant,
            str(row.frames),
            _bars([frame.alpha_vs_axial_norm for frame in curve]),
            _bars([frame.alpha_c_axial_norm for frame in curve]),
            *(_spell(value) for value in (row.slope, row.r2, row.peak, row.final)),
        )
    console.print(table)
    frames = Table(box=None, header_style="bold", pad_edge=False)
    titles = ("source", "frame", "strain", "variant", "α_vs", "α_c", "α_vs/max", "α_c/max")
    for title in titles:
        frames.add_column(title, justify="left" if title == "source" else "right")
    for frame in comparison.frames:
        frames.add_row(
            frame.source,
            str(frame.frame),
            _spell(frame.strain),
            frame.variant,
            _spell(frame.alpha_vs_axial),
            _spell(frame.alpha_c_axial),
            _spell(frame.alpha_vs_axial_norm),
            _spell(frame.alpha_c_axial_norm),
        )
    console.print()
    console.print(frames)


def _bars(values: Sequence[float | None], longest: int = 30) -> str:
    """A curve of numbers up to 1 as a line of bars; negative ones are blank."""
    step = -(-len(values) // longest) if values else 1
    return "".join(
        "·" if value is None else BARS[round(max(value, 0.0) * (len(BARS) - 1))]
        for value in values[::step]
    )


def _spell(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
