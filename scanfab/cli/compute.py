"""scanfab compute: the fabric table."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import (
    SourceCommand,
    fill_from_file,
    frame_options,
    open_series,
    output_option,
    reading_arguments,
    reading_options,
)

if TYPE_CHECKING:
    from scanfab.series import Series
    from scanfab.settings import Settings
    from scanfab.table import Row
    from scanfab.writers.results import ResultFile

__all__ = ["compute"]


@click.command(cls=SourceCommand)
@click.argument(
    "sources",
    metavar="SOURCE...",
    nargs=-1,
    required=True,
    type=click.Path(exists=True, allow_dash=True),
)
@reading_options
@frame_options
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
@click.option("--axis", default="z", show_default=True, metavar="x|y|z|X,Y,Z", help="Loading axis.")
@click.option(
    "--strain",
    default="auto",
    show_default=True,
    metavar="auto|cell|boundary|grains|FILE.csv",
    help="Where the axial strain comes from.",
)
@click.option("--seed", default=0, show_default=True, metavar="N", help="Of the random numbers.")
@click.option("--workers", type=int, metavar="N", help="Parallel workers (default: all cores).")
@click.option(
    "--on-error",
    default="stop",
    show_default=True,
    metavar="stop|skip",
    help="What a frame that cannot be read does.",
)
@output_option
@click.option("--resume", is_flag=True, help="Go on with FILE.part of an interrupted run.")
@click.option(
    "--manifest",
    "manifest_path",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Settings, seed, versions, inputs with size and hash, as JSON (with -o FILE also "
    "FILE.manifest.json without asking).",
)
@click.pass_context
def compute(
    ctx: click.Context,
    /,
    sources: tuple[str, ...],
    output: Path | None,
    resume: bool,
    manifest_path: Path | None,
    **options: Any,
) -> int:
    """
    Compute the fabric table: one row per frame and variant.

    SOURCE is a folder with a series of dumps, files of one series, or - for standard input.

    Variants: a whole sample; b whole sample, rattlers removed; c representative volume (RV); d RV,
    rattlers removed. Lengths are in the dump's own units.
    """
    from scanfab.cli.console import announce_compiling, reported_warnings
    from scanfab.errors import SettingsError
    from scanfab.manifest import asked_for
    from scanfab.settings import Settings
    from scanfab.table import Row
    from scanfab.writers.results import ResultFile

    options = fill_from_file(ctx, sources, options)
    reading = reading_arguments(options)
    if resume and output is None:
        raise click.UsageError("--resume goes with -o FILE")
    with reported_warnings() as told:
        try:
            settings = Settings.make(**options)
            result = None if output is None else ResultFile(output, Row)
        except SettingsError as error:
            raise click.UsageError(str(error)) from None
        asked = asked_for(sources, reading, settings)
        series = open_series(sources, reading)
        announce_compiling()
        found = _write(series, settings, asked, result, resume)
        for path in _manifests(output, manifest_path):
            _write_manifest(path, asked, series)
    return 0 if found and not told.skipped else 1


def _write(
    series: list[Series],
    settings: Settings,
    asked: dict[str, Any],
    result: ResultFile | None,
    resume: bool,
) -> bool:
    """Write the rows as they come; whether any of them has a void fabric."""
    from scanfab.cli.console import print_table, with_progress
    from scanfab.writers.rows import CsvWriter

    found = False

    def watched(rows: Iterator[Row]) -> Iterator[Row]:
        nonlocal found
        for row in with_progress(rows):
            found = found or row.alpha_vs is not None
            yield row

    if result is None:
        if sys.stdout.isatty():
            print_table(list(watched(_rows(series, settings, None))))
        else:
            printer = CsvWriter(sys.stdout)
            for row in watched(_rows(series, settings, None)):
                printer.write(row)
        return found
    with _usage_errors():
        done = result.finished_rows(asked, len(settings.variants)) if resume else []
    found = any(row["alpha_vs"] is not None for row in done)
    with result.writer(asked, resume) as writer:
        for row in watched(_rows(series, settings, done[-1] if done else None)):
            writer.write(row)
    return found


@contextmanager
def _usage_errors() -> Iterator[None]:
    from scanfab.errors import SettingsError

    try:
        yield
    except SettingsError as error:
        raise click.UsageError(str(error)) from None


def _rows(series: list[Series], settings: Settings, last: dict[str, Any] | None) -> Iterator[Row]:
    """The rows behind the last one that an earlier run has written."""
    from scanfab.pipeline import compute_rows

    names = [one.name for one in series]
    first = names.index(last["source"]) if last is not None else 0
    for one in series[first:]:
        start = last["frame"] + 1 if last is not None and one.name == last["source"] else 0
        yield from compute_rows(one, settings, start=start)


def _manifests(output: Path | None, asked: Path | None) -> list[Path]:
    paths = [] if output is None else [output.with_name(output.name + ".manifest.json")]
    return paths if asked is None else [*paths, asked]


def _write_manifest(path: Path, asked: dict[str, Any], series: list[Series]) -> None:
    from scanfab.manifest import manifest

    text = json.dumps(manifest(asked, series), indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
