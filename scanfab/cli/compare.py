"""scanfab compare: variants of fabric tables side by side."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.console import Command, is_readable, print_csv, print_rows, target
from scanfab.cli.options import EXCERPT, OF_SEVERAL, check_labels, check_plot, options
from scanfab.cli.talk import talk_options

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
    from scanfab.table.compare import compare_tables
    from scanfab.table.formats import read_rows
    from scanfab.table.selection import choose_rows
    from scanfab.table.writing import ALL, write_rows
    from scanfab.viz.figures.page import make_figures, save_figures

    check_plot(plot, figure, "table")
    if summary and differences:
        raise click.UsageError("--summary and --differences are two tables: ask for one of them")
    check_labels(labels, tables)
    read = [(table, read_rows(table)) for table in tables]
    rows = [row for one in choose_rows(read, cutoff, labels) for row in one]
    comparison = compare_tables(rows, strain_max=strain_max)
    chosen = comparison.frames
    if summary or differences:
        chosen = comparison.summary if summary else comparison.differences
    if not chosen:
        lacking = "two variants of one frame" if comparison.frames else "frames"
        raise SettingsError(f"there is nothing to compare: the tables hold no {lacking}")
    excerpt = target(output, chosen.columns, fields, digits)
    if output is not None:
        write_rows(output, chosen, chosen.columns, excerpt)
    elif is_readable() and not differences and excerpt == ALL:
        print_comparison(comparison)
    else:
        print_csv(chosen, excerpt, chosen.columns)
    if plot is not None:
        save_figures(plot, make_figures(rows, "table", figure, comparison=comparison))
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
