"""scanfab compare: variants of fabric tables side by side."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import scanfab
from scanfab.cli.console import Command, digits_of, draw, is_readable, print_csv, print_rows
from scanfab.cli.options import (
    OF_SEVERAL,
    excerpt_of,
    options,
    tables_argument,
    take_output,
    usage_errors,
)

if TYPE_CHECKING:
    from scanfab.table.compare import Comparison
    from scanfab.table.row import Row


# columns on a terminal; a narrow terminal drops the last ones
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
    "--differences", is_flag=True, help="One row per frame and pair of variants: their difference."
)
@options("strain_max")
@options(
    "variants", default=None, help="Which variants to compare, as letters (default: all of them)."
)
@options("cutoff", **OF_SEVERAL)
@options("labels", "output", "EXCERPT", "plot")
@options(
    "figure",
    help="Figure to draw: evolution, normalised, correlation or columns:NAME,NAME (default: all on "
    "one page).",
)
@click.option(
    "--no-paper-line",
    is_flag=True,
    help="Leave the dotted line with the slope of the 2017 paper out of the figure correlation.",
)
def compare(tables: tuple[str, ...], summary: bool, differences: bool, **chosen: Any) -> int:
    """
    Set the variants of fabric tables side by side.

    TABLE is a table that scanfab compute wrote (CSV, TSV, JSON, JSON lines, Parquet), or - for
    standard input. Each frame has a row with both anisotropies, as they are and divided by their
    largest absolute value. With --summary each source and variant has a row with the slope of void
    fabric on contact fabric. A terminal shows both tables.
    """
    from scanfab.base.files import refuse_inputs
    from scanfab.pipeline.values import parse_variants
    from scanfab.table.selection import check_labels, choose_rows
    from scanfab.table.writing import ALL, write_rows

    outputs = take_output(chosen, "table")
    if summary and differences:
        raise click.UsageError("--summary and --differences print different tables: choose one")
    if chosen["no_paper_line"] and outputs.plot is None:
        raise click.UsageError("--no-paper-line goes with --plot FILE")
    with usage_errors():
        check_labels(chosen["labels"], len(tables))
        variants = parse_variants("variants", chosen["variants"] or "abcd")
        refuse_inputs([outputs.output, outputs.plot], map(Path, tables))
    read = [(table, scanfab.read_rows(table)) for table in tables]
    rows = [row for table in choose_rows(read, chosen["cutoff"], chosen["labels"]) for row in table]
    if chosen["variants"] is not None:
        rows = _of_variants(rows, variants)
    comparison = scanfab.compare_tables(rows, strain_max=chosen["strain_max"])
    shown = comparison.frames
    if summary or differences:
        shown = comparison.summary if summary else comparison.differences
    if not shown:
        lacking = "two variants of one frame" if comparison.frames else "frames"
        raise scanfab.SettingsError(f"there is nothing to compare: the tables hold no {lacking}")
    excerpt = excerpt_of(outputs, shown.columns)
    if outputs.output is not None:
        write_rows(outputs.output, shown, shown.columns, excerpt)
    elif is_readable() and not differences and excerpt == ALL:
        print_comparison(comparison)
    elif is_readable():
        print_rows(
            shown, excerpt.fields or shown.names, len(excerpt.fields) or 1, digits_of(excerpt, 5)
        )
    else:
        print_csv(shown, excerpt, shown.columns)
    draw(outputs, rows, "table", comparison=comparison, paper_line=not chosen["no_paper_line"])
    return 0 if any(row.alpha_vs_axial is not None for row in comparison.frames) else 1


def _of_variants(rows: list[dict[str, Any]], variants: str) -> list[dict[str, Any]]:
    """The rows of some variants; SettingsError if the tables lack one of them."""
    found = sorted({row["variant"] for row in rows})
    if not set(variants) <= set(found):
        words = f"expected variants of the tables, {', '.join(found)}, found {variants!r}"
        raise scanfab.SettingsError(f"variants: {words}")
    return [row for row in rows if row["variant"] in variants]


def print_comparison(comparison: Comparison) -> None:
    """Print the summary, with the curves of both anisotropies as bars, then the frames."""
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
        own = [frame for frame in frames if all(frame[k] == row[k] for k in ("source", "variant"))]
        row["alpha_vs"] = _bars([frame["alpha_vs_axial_norm"] for frame in own])
        row["alpha_c"] = _bars([frame["alpha_c_axial_norm"] for frame in own])
    for rows, columns in ((summary, SUMMARY), (frames, FRAMES)):
        kept = [name for name in columns if name not in left_out]
        print_rows(rows, kept, 1)
        click.echo()
    click.echo(
        "± total: standard error; of α_vs from scan and sample,\n"
        "of α_c from the sample; ± scan: the part from the scan"
    )


def _bars(values: list[float | None]) -> str:
    """A curve of numbers from -1 to 1 as bars of their absolute values."""
    return "".join(
        "·" if value is None else BARS[round(abs(value) * (len(BARS) - 1))]
        for value in values[:: -(-len(values) // MOST_BARS) or 1]
    )
