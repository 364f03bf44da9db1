"""scanfab compute: the fabric table."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import CellCommand, open_series, reading_arguments, reading_options

if TYPE_CHECKING:
    from scanfab.series import Series
    from scanfab.settings import Settings
    from scanfab.table import Row

__all__ = ["compute"]


@click.command(cls=CellCommand)
@click.argument(
    "sources",
    metavar="SOURCE...",
    nargs=-1,
    required=True,
    type=click.Path(exists=True, allow_dash=True),
)
@reading_options
@click.option(
    "--contact-tolerance",
    default=0.0,
    show_default=True,
    metavar="X",
    help="Relative: contact if distance < (r1 + r2)(1 + X).",
)
@click.option("--variants", default="abcd", show_default=True, help="Which variants to compute.")
@click.option(
    "--rv",
    default=0.7,
    show_default=True,
    metavar="FRACTION",
    help="Radius of the sphere RV, as a fraction of half the smallest extent of the grains.",
)
@click.option("--rv-radius", type=float, metavar="L", help="The same in the dump's units.")
@click.option(
    "--rv-center", nargs=3, type=float, metavar="X Y Z", help="Centre of the RV (default: middle)."
)
@click.option(
    "--boundary",
    multiple=True,
    metavar="EXPR",
    help='Which particles are boundary: "type=2", "mask=3,4", "id>=13723"; repeated: or.',
)
@click.option(
    "--cutoff",
    default="1rmin",
    show_default=True,
    metavar="L",
    help="Shortest void segment kept: in the dump's units, or with rmin, rmean, rmax.",
)
@click.option(
    "--spacing",
    default="auto",
    show_default=True,
    metavar="L",
    help="Distance between neighbouring lines, likewise; auto meets --tolerance.",
)
@click.option(
    "--directions",
    default="auto",
    show_default=True,
    metavar="N|RULE",
    help="N axes, rounded up to the next exact rule, or lebedev:DEGREE, design:DEGREE, "
    "product:DEGREE, fibonacci:N, equal-angle:STEP, equal-angle-full:STEP.",
)
@click.option(
    "--tolerance",
    default=1e-4,
    show_default=True,
    metavar="X",
    help="Target standard error of alpha_vs_axial, for every variant, when something is auto.",
)
@click.option(
    "--min-contacts",
    default=2,
    show_default=True,
    metavar="N",
    help="A grain with fewer contacts is a rattler.",
)
@click.option("--axis", default="z", show_default=True, metavar="x|y|z|X,Y,Z", help="Loading axis.")
@click.option(
    "--strain",
    default="auto",
    show_default=True,
    metavar="auto|cell|boundary|grains|FILE.csv",
    help="Where the axial strain comes from.",
)
@click.option("--frames", metavar="A:B:C", help="Which frames, as a Python slice (default: all).")
@click.option("--seed", default=0, show_default=True, metavar="N", help="Of the random numbers.")
@click.option("--workers", type=int, metavar="N", help="Parallel workers (default: all cores).")
@click.option(
    "-o",
    "output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Result file, .csv (default: standard output).",
)
def compute(sources: tuple[str, ...], output: Path | None, **options: Any) -> int:
    """
    Compute the fabric table: one row per frame and variant.

    SOURCE is a folder with a series of dumps, files of one series, or - for standard input.

    Variants: a whole sample; b whole sample, rattlers removed; c representative volume (RV); d RV,
    rattlers removed. Lengths are in the dump's own units.
    """
    from scanfab.cli.console import reported_warnings
    from scanfab.errors import SettingsError
    from scanfab.settings import Settings
    from scanfab.writers.rows import check_suffix

    reading = reading_arguments(options)
    with reported_warnings():
        try:
            settings = Settings.make(**options)
            if output is not None:
                check_suffix(output)
        except SettingsError as error:
            raise click.UsageError(str(error)) from None
        series = open_series(sources, reading)
        return _write(_rows(series, settings), output)


def _rows(series: list[Series], settings: Settings) -> Iterator[Row]:
    from scanfab.pipeline import compute_rows

    for one in series:
        yield from compute_rows(one, settings)


def _write(rows: Iterator[Row], output: Path | None) -> int:
    """Write as rows come; 1 if none of them has a void fabric."""
    from scanfab.cli.console import print_table, with_progress
    from scanfab.writers.rows import CsvWriter, open_result

    found = False

    def watched() -> Iterator[Row]:
        nonlocal found
        for row in with_progress(rows):
            found = found or row.alpha_vs is not None
            yield row

    if output is not None:
        with open_result(output) as stream:
            _write_csv(CsvWriter(stream), watched())
    elif sys.stdout.isatty():
        print_table(list(watched()))
    else:
        _write_csv(CsvWriter(sys.stdout), watched())
    return 0 if found else 1


def _write_csv(writer: Any, rows: Iterator[Row]) -> None:
    for row in rows:
        writer.write(row)
