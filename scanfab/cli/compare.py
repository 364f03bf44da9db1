"""scanfab compare: variants of fabric tables side by side."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import click

import scanfab
from scanfab.cli.console import Command, draw, is_readable, print_csv, print_rows
from scanfab.cli.options import (
    OF_SEVERAL,
    check_labels,
    excerpt_of,
    options,
    tables_argument,
    take_output,
)

if TYPE_CHECKING:
    from scanfab.table.compare import Comparison
    from scanfab.table.row import Row


# columns on a terminal; where there is no room, those that come last are left out
SUMMARY = (
    "source", "variant", "slope", "slope_se", "r2", "peak", "final", "frames", "alpha_vs", "alpha_c"
)  # fmt: skip
FRAMES = (
    "source", "frame", "strain", "shear_strain", "variant", "alpha_vs_axial",
    "alpha_vs_axial_total_se", "alpha_c_axial", "alpha_c_axial_sample_se", "alpha_vs_axial_se",
    "alpha_vs_axial_norm", "alpha_c_axial_norm",
)  # fmt: skip
BARS = " ▁▂▃▄▅▆▇█"
MOST_BARS = 15


@click.command(cls=Command)
@tables_argument(allow_dash=True)
@click.option("--summary", is_flag=True, help="One row per source and variant: slopes and peaks.")
@click.option(
    "--differences", is_flag=True, help="One row per frame and pair of variants: how far apart."
)
@options("strain_max")
@options("cutoff", **OF_SEVERAL)
@options("labels", "output", "EXCERPT", "plot")
@options(
    "figure",
    help="Which figure: evolution, normalised, correlation or columns:NAME,NAME (default: all on "
    "one page).",
)
def compare(tables: tuple[str, ...], summary: bool, differences: bool, **chosen: Any) -> int:
    """
    Set the variants of fabric tables side by side.

    TABLE is what scanfab compute wrote (CSV, TSV, JSON, JSON lines, Parquet), or - for standard
    input. Per frame: both anisotropies, also divided by their own largest absolute value; with
    --summary, per source and variant: the slope of void on contact fabric. On a terminal both.
    """
    from scanfab.table.selection import choose_rows
    from scanfab.table.writing import ALL, write_rows

    asked = take_output(chosen, "table")
    if summary and differences:
        raise click.UsageError("--summary and --differences are two tables: ask for one of them")
    check_labels(chosen["labels"], tables)
    read = [(table, scanfab.read_rows(table)) for table in tables]
    rows = [row for one in choose_rows(read, chosen["cutoff"], chosen["labels"]) for row in one]
    comparison = scanfab.compare_tables(rows, strain_max=chosen["strain_max"])
    found = comparison.frames
    if summary or differences:
        found = comparison.summary if summary else comparison.differences
    if not found:
        lacking = "two variants of one frame" if comparison.frames else "frames"
        raise scanfab.SettingsError(f"there is nothing to compare: the tables hold no {lacking}")
    excerpt = excerpt_of(asked, found.columns)
    if asked.output is not None:
        write_rows(asked.output, found, found.columns, excerpt)
    elif is_readable() and not differences and excerpt == ALL:
        print_comparison(comparison)
    else:
        print_csv(found, excerpt, found.columns)
    draw(asked, rows, "table", comparison=comparison)
    return 0 if any(row.alpha_vs_axial is not None for row in comparison.frames) else 1


def print_comparison(comparison: Comparison) -> None:
    """The summary, with the curves of both anisotropies as bars, then the frames."""
    from scanfab.table.curves import short_names, strain_column
    from scanfab.table.row import variant_of

    names = short_names((row.source for row in comparison.summary), 20)
    is_sheared = strain_column(comparison.frames) == "shear_strain"
    left_out = {"strain" if is_sheared else "shear_strain"}
    if len(names) == 1:
        click.echo(next(iter(names.values())))
        left_out.add("source")

    def shown(rows: Iterable[Row]) -> list[dict[str, Any]]:
        return [{**row, "source": names[row.source], "variant": variant_of(row)} for row in rows]

    summary, frames = shown(comparison.summary), shown(comparison.frames)
    for row in summary:
        own = [one for one in frames if all(one[k] == row[k] for k in ("source", "variant"))]
        row["alpha_vs"] = _bars([one["alpha_vs_axial_norm"] for one in own])
        row["alpha_c"] = _bars([one["alpha_c_axial_norm"] for one in own])
    for rows, columns in ((summary, SUMMARY), (frames, FRAMES)):
        kept = [name for name in columns if name not in left_out]
        print_rows(rows, kept, 1)
        click.echo()
    click.echo(
        "± total: standard error, of α_vs by scan and sample,\n"
        "of α_c by the sample; ± scan: its part of α_vs"
    )


def _bars(values: list[float | None]) -> str:
    """A curve of numbers up to ±1 as a line of bars, by size: in extension all are negative."""
    return "".join(
        "·" if value is None else BARS[round(abs(value) * (len(BARS) - 1))]
        for value in values[:: -(-len(values) // MOST_BARS) or 1]
    )
