"""scanfab compute: the fabric table."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import (
    axis_option,
    check_plot,
    cutoff_option,
    frames_option,
    output_option,
    plot_option,
    reading_options,
    sample_options,
    seed_option,
    sources_argument,
    usage_errors,
    window_options,
    workers_option,
)
from scanfab.cli.sources import SourceCommand, fill_from_file, open_series, reading_arguments

if TYPE_CHECKING:
    from scanfab.cli.console import Told
    from scanfab.pipeline import Observer
    from scanfab.series import Series
    from scanfab.settings import Settings
    from scanfab.table import Row
    from scanfab.writers.results import ResultFile

__all__ = ["compute"]


@click.command(cls=SourceCommand)
@sources_argument
@reading_options
@sample_options
@frames_option
@click.option("--variants", default="abcd", show_default=True, help="Which variants to compute.")
@window_options
@cutoff_option
@click.option(
    "--cutoffs",
    metavar="FROM:TO:STEP|L,L,...",
    help="Several cut-offs, a row for each, from one pass over the void segments.",
)
@click.option(
    "--moment",
    default=1,
    show_default=True,
    metavar="1|2",
    help="Mean length of the void segments (1), or mean of the squares over the mean (2).",
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
    "icosahedral:DEGREE, product:DEGREE, fibonacci:N, equal-angle:STEP, equal-angle-full:STEP.",
)
@click.option(
    "--tolerance",
    default=1e-4,
    show_default=True,
    metavar="X",
    help="Target standard error of alpha_vs_axial, for every variant, when something is auto.",
)
@click.option(
    "--max-chords",
    default=1e11,
    show_default=True,
    metavar="N",
    help="An auto scan stops before it cuts more chords from grains than this, in each frame.",
)
@axis_option
@click.option(
    "--strain",
    default="auto",
    show_default=True,
    metavar="auto|cell|boundary|grains|FILE.csv",
    help="Where the axial strain comes from.",
)
@seed_option
@workers_option
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
@click.option(
    "--vtk",
    "vtk_folder",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Write files for ParaView of each frame that is computed now.",
)
@plot_option
@click.option(
    "--figure",
    metavar="NAME",
    help="Which figure: of the table evolution, normalised or correlation (default: all on one "
    "page); of the first and last frame rose (or rose:30,60,90 for these polar angles), "
    "projection, histogram or cutoffs.",
)
@click.pass_context
def compute(
    ctx: click.Context,
    /,
    sources: tuple[str, ...],
    output: Path | None,
    resume: bool,
    manifest_path: Path | None,
    vtk_folder: Path | None,
    plot: Path | None,
    figure: str | None,
    **options: Any,
) -> int:
    """
    Compute the fabric table: one row per frame and variant.

    SOURCE is a folder with a series of dumps, files of one series, or - for standard input.

    Variants: a whole sample; b whole sample, rattlers removed; c representative volume (RV); d RV,
    rattlers removed. Lengths are in the dump's own units.
    """
    from scanfab.cli.console import announce_compiling, reported_warnings
    from scanfab.manifest import asked_for
    from scanfab.settings import Settings
    from scanfab.table import Row
    from scanfab.writers.files import check_folder
    from scanfab.writers.results import ResultFile

    options = fill_from_file(ctx, sources, options)
    reading = reading_arguments(options)
    if options.get("cutoffs") and (vtk_folder is not None or plot is not None):
        raise click.UsageError("--vtk and --plot are of one cut-off: leave out --cutoffs")
    if resume and output is None:
        raise click.UsageError("--resume goes with -o FILE")
    _check_figure(plot, figure)
    with reported_warnings() as told:
        with usage_errors():
            settings = Settings.make(**options)
            result = None if output is None else ResultFile(output, Row)
            if manifest_path is not None:
                check_folder(manifest_path)
        asked = asked_for(sources, reading, settings)
        series = open_series(sources, reading)
        if figure is not None and _is_of_frames(figure) and len(series) > 1:
            raise click.UsageError(f"--figure {figure} draws one series: name one source")
        announce_compiling()
        run = _Run(series, settings, vtk_folder, resume, keep=plot is not None)
        _write(run, asked, result)
        for path in _manifests(output, manifest_path):
            _write_manifest(path, asked, series, told)
        if plot is not None:
            _draw(plot, figure, run)
    return 0 if run.found and not told.skipped and not run.skipped else 1


def _check_figure(plot: Path | None, figure: str | None) -> None:
    if plot is None and figure is None:
        return
    from scanfab.figures import TABLE_FIGURES
    from scanfab.frame_figures import FRAME_FIGURES, parse_figure

    check_plot(plot, figure, [*TABLE_FIGURES, *FRAME_FIGURES])
    if figure is not None and _is_of_frames(figure):
        with usage_errors():
            parse_figure(figure)


def _is_of_frames(figure: str) -> bool:
    from scanfab.figures import TABLE_FIGURES

    return figure not in TABLE_FIGURES


def _draw(plot: Path, figure: str | None, run: _Run) -> None:
    from scanfab.figures import plot_rows
    from scanfab.frame_figures import plot_frames

    if not run.found:
        click.echo(f"scanfab: {plot} is not drawn: no row has a void fabric", err=True)
    elif figure is not None and _is_of_frames(figure):
        plot_frames(plot, run.series[0], run.settings, run.kept, figure)
    else:
        plot_rows(plot, run.kept, figure)


class _Run:
    """The series under way, and what becomes of their rows."""

    def __init__(
        self,
        series: list[Series],
        settings: Settings,
        vtk_folder: Path | None,
        resume: bool,
        keep: bool,
    ) -> None:
        self.series = series
        self.settings = settings
        self.resume = resume
        self.found = False
        """Whether any row has a void fabric."""
        self.skipped = False
        """Whether an earlier run has skipped frames."""
        self.kept: list[dict[str, Any]] = []
        """The rows, if they are wanted."""
        self._keep = keep
        self._observers = _vtk_folders(vtk_folder, series, settings, resume)

    def before(self, done: list[dict[str, Any]]) -> None:
        """Rows of an earlier run."""
        self.found = any(row["alpha_vs"] is not None for row in done)
        self.skipped = self._has_gaps(done)
        self.kept = list(done) if self._keep else []

    def _has_gaps(self, done: list[dict[str, Any]]) -> bool:
        """Whether an earlier run has skipped frames between those that it has written."""
        from scanfab.pipeline import chosen_frames

        for one in self.series:
            written = {row["frame"] for row in done if row["source"] == one.name}
            if not written:
                continue
            chosen = chosen_frames(one, self.settings.frames)
            due = range(chosen.start, max(written) + 1, chosen.step)
            if len(due) > len(written):
                return True
        return False

    def rows(self, last: dict[str, Any] | None) -> Iterator[Row]:
        """The rows behind the last one that an earlier run has written."""
        from scanfab.cli.console import with_progress

        for row in with_progress(self._rows(last)):
            self.found = self.found or row.alpha_vs is not None
            if self._keep:
                self.kept.append(asdict(row))
            yield row

    def _rows(self, last: dict[str, Any] | None) -> Iterator[Row]:
        from scanfab.pipeline import compute_rows

        names = [one.name for one in self.series]
        first = names.index(last["source"]) if last is not None else 0
        for one, observe in list(zip(self.series, self._observers, strict=True))[first:]:
            start = last["frame"] + 1 if last is not None and one.name == last["source"] else 0
            yield from compute_rows(one, self.settings, start=start, observe=observe)


def _vtk_folders(
    folder: Path | None, series: list[Series], settings: Settings, resume: bool
) -> list[Observer | None]:
    """What writes the ParaView files of each series, in folders of their own if several."""
    if folder is None:
        return [None] * len(series)
    from scanfab.export import VtkFolder

    folders = [folder / f"series-{number}" for number in range(1, len(series) + 1)]
    with usage_errors():
        return [
            VtkFolder(one, settings.axis, resume)
            for one in (folders if len(series) > 1 else [folder])
        ]


def _write(run: _Run, asked: dict[str, Any], result: ResultFile | None) -> None:
    """Write the rows as they come."""
    from scanfab.cli.console import print_table
    from scanfab.writers.rows import CsvWriter

    if result is None:
        if sys.stdout.isatty():
            print_table(list(run.rows(None)))
        else:
            printer = CsvWriter(sys.stdout)
            for row in run.rows(None):
                printer.write(row)
        return
    done: list[dict[str, Any]] = []
    if run.resume:
        with usage_errors():
            done = result.finished_rows(asked, run.settings.rows_per_frame)
    run.before(done)
    with result.writer(asked, run.resume) as writer:
        for row in run.rows(done[-1] if done else None):
            writer.write(row)


def _manifests(output: Path | None, asked: Path | None) -> list[Path]:
    paths = [] if output is None else [output.with_name(output.name + ".manifest.json")]
    return paths if asked is None else [*paths, asked]


def _write_manifest(path: Path, asked: dict[str, Any], series: list[Series], told: Told) -> None:
    from scanfab.manifest import manifest
    from scanfab.writers.files import whole_file

    text = json.dumps(manifest(asked, series, told.texts, told.notes), indent=1, ensure_ascii=False)
    with whole_file(path) as part:
        # names of files need be no text; what replaces their letters is how JSON spells them
        part.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
