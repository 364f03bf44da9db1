"""scanfab compare: variants of fabric tables side by side."""

from __future__ import annotations

from pathlib import Path

import click

from scanfab.cli.options import EXCERPT, OF_SEVERAL, check_plot, options, usage_errors
from scanfab.cli.talk import talk_options


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
@options("strain_max")
@options("cutoff", **OF_SEVERAL)
@options("labels", "output", *EXCERPT, "plot")
@options(
    "figure",
    help="Which figure: evolution, normalised, correlation or columns:NAME,NAME (default: all on "
    "one page).",
)
@talk_options
def compare(
    tables: tuple[str, ...],
    summary: bool,
    differences: bool,
    strain_max: float | None,
    cutoff: float | None,
    labels: tuple[str, ...],
    output: Path | None,
    fields: str | None,
    digits: int,
    plot: Path | None,
    figure: str | None,
) -> int:
    """
    Set the variants of fabric tables side by side.

    TABLE is what scanfab compute wrote (CSV, TSV, JSON, JSON lines, Parquet), or - for standard
    input. Per frame: both anisotropies, also divided by their own largest absolute value; with
    --summary, per source and variant: the slope of void on contact fabric. On a terminal both.
    """
    from scanfab.base.errors import SettingsError
    from scanfab.cli.comparison_tables import print_comparison
    from scanfab.cli.console import is_readable, print_csv, reported_warnings
    from scanfab.table.compare import compare_tables
    from scanfab.table.formats import format_of, read_rows
    from scanfab.table.selection import choose_rows
    from scanfab.table.writing import ALL, Excerpt, ResultFile
    from scanfab.viz.figures.page import make_figures, save_figures

    check_plot(plot, figure, "table")
    if summary and differences:
        raise click.UsageError("--summary and --differences are two tables: ask for one of them")
    if labels and len(labels) != len(tables):
        raise click.UsageError(f"--label: expected one a table: {len(tables)}, found {len(labels)}")
    if output is not None:
        with usage_errors():
            format_of(output)
    with reported_warnings():
        read = [(table, read_rows(table)) for table in tables]
        rows = [row for one in choose_rows(read, cutoff, labels) for row in one]
        comparison = compare_tables(rows, strain_max=strain_max)
        chosen = comparison.frames
        if summary or differences:
            chosen = comparison.summary if summary else comparison.differences
        if not chosen:
            lacking = "two variants of one frame" if comparison.frames else "frames"
            raise SettingsError(f"there is nothing to compare: the tables hold no {lacking}")
        with usage_errors():
            excerpt = Excerpt.make(chosen.columns, fields, digits)
        if output is not None:
            ResultFile(output, chosen.columns, excerpt).save(chosen)
        elif is_readable() and not differences and excerpt == ALL:
            print_comparison(comparison)
        else:
            print_csv(chosen, excerpt, chosen.columns)
        if plot is not None:
            save_figures(plot, make_figures(rows, "table", figure, comparison=comparison))
    return 0 if any(row.alpha_vs_axial is not None for row in comparison.frames) else 1
