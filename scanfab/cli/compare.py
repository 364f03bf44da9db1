"""scanfab compare: variants of fabric tables side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.console import Command
from scanfab.cli.options import (
    EXCERPT,
    OF_SEVERAL,
    check_labels,
    check_plot,
    options,
    usage_errors,
)
from scanfab.cli.talk import talk_options

if TYPE_CHECKING:
    from scanfab.table.compare import Comparison
    from scanfab.table.row import Row


# columns on a terminal; where there is no room, those that come last are left out
SUMMARY_TITLES = {
    "source": "source",
    "variant": "variant",
    "slope": "slope",
    "slope_se": "±",
    "r2": "R²",
    "peak": "peak",
    "final": "final",
    "frames": "frames",
    "void_curve": "α_vs",
    "contact_curve": "α_c",
}
FRAME_TITLES = {
    "source": "source",
    "frame": "frame",
    "strain": "strain",
    "shear_strain": "shear strain",
    "variant": "variant",
    "alpha_vs_axial": "α_vs axial",
    "alpha_vs_axial_total_se": "± total",
    "alpha_c_axial": "α_c axial",
    "alpha_c_axial_sample_se": "± sample",
    "alpha_vs_axial_se": "scan",
    "alpha_vs_axial_norm": "α_vs/max",
    "alpha_c_axial_norm": "α_c/max",
}
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
    from scanfab.cli.console import is_readable, print_csv
    from scanfab.table.compare import compare_tables
    from scanfab.table.formats import format_of, read_rows
    from scanfab.table.selection import choose_rows
    from scanfab.table.writing import ALL, Excerpt, ResultFile
    from scanfab.viz.figures.page import make_figures, save_figures

    check_plot(plot, figure, "table")
    if summary and differences:
        raise click.UsageError("--summary and --differences are two tables: ask for one of them")
    check_labels(labels, tables)
    with usage_errors():
        if output is not None:
            format_of(output)
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


def print_comparison(comparison: Comparison) -> None:
    """The summary, with the curves of both anisotropies as bars, then the frames."""
    from scanfab.table.curves import short_names, strain_column

    names = short_names((row.source for row in comparison.summary), 20)
    if len(names) == 1:
        click.echo(next(iter(names.values())))
    curves: dict[tuple[str, str], list[Row]] = {}
    for row in comparison.frames:
        curves.setdefault(_group(row), []).append(row)
    bars = [
        {
            "void_curve": _bars(one.alpha_vs_axial_norm for one in curves[_group(row)]),
            "contact_curve": _bars(one.alpha_c_axial_norm for one in curves[_group(row)]),
        }
        for row in comparison.summary
    ]
    _print(comparison.summary, SUMMARY_TITLES, names, bars)
    click.echo()
    other = "strain" if strain_column(comparison.frames) == "shear_strain" else "shear_strain"
    titles = {name: title for name, title in FRAME_TITLES.items() if name != other}
    _print(comparison.frames, titles, names)
    click.echo(
        "± total: standard error, of α_vs by scan and sample together; ± sample: that of α_c, by "
        "the sample; scan: its part of α_vs"
    )


def _group(row: Row) -> tuple[str, str]:
    from scanfab.table.row import variant_of

    return row.source, variant_of(row)


def _print(
    rows: Sequence[Row],
    titles: dict[str, str],
    names: dict[str, str],
    more: Sequence[dict[str, Any]] = (),
) -> None:
    from scanfab.cli.console import print_rows

    shown = [{**row, "source": names[row.source], "variant": _group(row)[1]} for row in rows]
    for row, bars in zip(shown, more, strict=False):
        row.update(bars)
    if len(names) == 1:
        titles = {name: title for name, title in titles.items() if name != "source"}
    print_rows(shown, titles, tuple(titles)[:0:-1])


def _bars(values: Iterable[float | None]) -> str:
    """A curve of numbers up to ±1 as a line of bars, by size: in extension all are negative."""
    every = list(values)
    return "".join(
        "·" if value is None else BARS[round(abs(value) * (len(BARS) - 1))]
        for value in every[:: -(-len(every) // MOST_BARS) or 1]
    )
