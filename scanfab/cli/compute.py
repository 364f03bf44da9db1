"""scanfab compute: the fabric table."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import (
    axis_option,
    check_plot,
    completed,
    cutoff_option,
    excerpt_options,
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
from scanfab.cli.running import Run
from scanfab.cli.settings_file import SettingsFile, fill_from_file
from scanfab.cli.sources import SourceCommand, open_series, reading_arguments
from scanfab.cli.talk import talk_options, tell_inputs

if TYPE_CHECKING:
    from scanfab.cli.console import Told
    from scanfab.table.result_file import ResultFile
    from scanfab.table.writing import Excerpt

__all__ = ["OF_THE_LINE", "compute"]

# what a settings file says nothing of: where results go
OF_THE_LINE = (
    "sources", "output", "resume", "manifest_path", "vtk_folder", "plot", "figure", "quiet",
    "verbose", "help",
)  # fmt: skip


@click.command(cls=SourceCommand)
@sources_argument
@reading_options
@sample_options
@frames_option
@click.option(
    "--variants",
    default="abcd",
    show_default=True,
    shell_complete=completed("abcd", "ab", "cd", "ac", *"abcd"),
    help="Which variants to compute.",
)
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
    shell_complete=completed("1", "2"),
    help="Mean length of the void segments (1), or mean of the squares over the mean (2).",
)
@click.option(
    "--spacing",
    default="auto",
    show_default=True,
    metavar="L",
    shell_complete=completed("auto"),
    help="Distance between neighbouring lines, likewise; auto meets --tolerance.",
)
@click.option(
    "--directions",
    default="auto",
    show_default=True,
    metavar="N|RULE",
    shell_complete=completed(
        "auto",
        *(f"{rule}:" for rule in ("lebedev", "design", "icosahedral", "product", "fibonacci")),
    ),
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
    default=1e10,
    show_default=True,
    metavar="N",
    help="An auto scan stops before it cuts more chords from grains than this, in each frame: by "
    "default after one or two minutes of one processor (lines count like chords).",
)
@axis_option
@click.option(
    "--strain",
    default="auto",
    show_default=True,
    metavar="auto|cell|boundary|grains|FILE.csv",
    shell_complete=completed("auto", "cell", "boundary", "grains", files=True),
    help="Where the axial strain comes from.",
)
@seed_option
@workers_option
@click.option(
    "--on-error",
    default="stop",
    show_default=True,
    metavar="stop|skip",
    shell_complete=completed("stop", "skip"),
    help="What a frame that cannot be read does.",
)
@output_option
@excerpt_options
@click.option(
    "--resume",
    is_flag=True,
    help="Go on with FILE.part of an interrupted run, or add what is missing to a complete FILE.",
)
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
    shell_complete=completed(
        "evolution", "normalised", "correlation", "rose", "projection", "histogram", "cutoffs"
    ),
    help="Which figure: of the table evolution, normalised or correlation (default: all on one "
    "page); of the first and last frame rose (or rose:30,60,90 for these polar angles), "
    "projection, histogram or cutoffs.",
)
@talk_options
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

    SOURCE is a folder with a series of dumps, files of one series, or - for standard input; what is
    named twice counts once.

    Variants: a whole sample; b whole sample, rattlers removed; c representative volume (RV); d RV,
    rattlers removed. Lengths are in the dump's own units.
    """
    from scanfab.base.files import check_folder
    from scanfab.cli.console import announce_compiling, reported_warnings
    from scanfab.pipeline.manifest import asked_for
    from scanfab.pipeline.settings import Settings
    from scanfab.table.result_file import ResultFile
    from scanfab.table.table import Row
    from scanfab.table.writing import Excerpt

    if resume and output is None:
        raise click.UsageError("--resume goes with -o FILE")
    _check_figure(plot, figure)
    with reported_warnings() as told:
        options, settings_file = fill_from_file(ctx, sources, options)
        if options.get("cutoffs") and (vtk_folder is not None or plot is not None):
            raise click.UsageError("--vtk and --plot are of one cut-off: leave out --cutoffs")
        reading = reading_arguments(options)
        with usage_errors():
            excerpt = Excerpt.make(Row, options.pop("fields"), int(options.pop("digits")))
            settings = Settings.make(**options)
            result = None if output is None else ResultFile(output, Row, excerpt)
            if manifest_path is not None:
                check_folder(manifest_path)
        asked = {**asked_for(sources, reading, settings), **excerpt.asked()}
        series = open_series(sources, reading)
        if figure is not None and _is_of_frames(figure) and len(series) > 1:
            raise click.UsageError(f"--figure {figure} draws one series: name one source")
        tell_inputs(series, settings.workers)
        announce_compiling()
        run = Run(series, settings, vtk_folder, resume, keep=plot is not None)
        if resume and result is not None:
            with usage_errors():
                asked = run.go_on(result, asked)
                if plot is not None and run.table is not None:
                    run.table.check_columns(_columns_drawn(figure))
        _write_or_say(run, asked, result, excerpt)
        for path in _manifests(output, manifest_path):
            _write_manifest(path, asked, run, told, settings_file)
        if plot is not None:
            _draw(plot, figure, run)
    return 0 if run.found and not told.skipped and not run.skipped else 1


def _check_figure(plot: Path | None, figure: str | None) -> None:
    if plot is None and figure is None:
        return
    from scanfab.viz.figures.fitted import TABLE_FIGURES
    from scanfab.viz.figures.scanned import FRAME_FIGURES, parse_figure

    check_plot(plot, figure, [*TABLE_FIGURES, *FRAME_FIGURES])
    if figure is not None and _is_of_frames(figure):
        with usage_errors():
            parse_figure(figure)


def _is_of_frames(figure: str) -> bool:
    from scanfab.viz.figures.fitted import TABLE_FIGURES

    return figure not in TABLE_FIGURES


def _columns_drawn(figure: str | None) -> tuple[str, ...]:
    """The columns of the table without which a figure cannot be."""
    of_curves = ("strain", "alpha_c_axial")
    needed = () if figure is not None and _is_of_frames(figure) else of_curves
    return ("variant", "alpha_vs_axial", *needed)


def _draw(plot: Path, figure: str | None, run: Run) -> None:
    from scanfab.viz.figures.fitted import plot_rows
    from scanfab.viz.figures.scanned import plot_frames

    if not run.found:
        click.echo(f"scanfab: {plot} is not drawn: no row has a void fabric", err=True)
    elif figure is not None and _is_of_frames(figure):
        plot_frames(plot, run.series[0], run.settings, run.kept, figure)
    else:
        plot_rows(plot, run.kept, figure)


def _write_or_say(
    run: Run, asked: dict[str, Any], result: ResultFile | None, excerpt: Excerpt
) -> None:
    """Write the rows; where that is interrupted or fails, say how far it is and how to go on."""
    from scanfab.base.errors import ScanfabError
    from scanfab.cli.console import is_readable
    from scanfab.cli.signals import telling

    printed = not is_readable()

    def standing() -> str:
        return _standing(run, result, printed)

    try:
        with telling(standing):
            _write(run, asked, result, excerpt)
    except (ScanfabError, OSError):
        if result is not None and 0 < run.done < run.frames():
            click.echo(f"scanfab: stopped {standing()}", err=True)
        raise


def _standing(run: Run, result: ResultFile | None, printed: bool) -> str:
    """How far a run is, and how to go on."""
    if not run.done and run.table is not None and result is not None:
        return (
            f"before the first new frame was finished: {result.path} is as it was; the same "
            f"command goes on"
        )
    if not run.done:
        return "before the first frame was finished: nothing is kept"
    if result is None:
        kept = "the rows printed so far are all" if printed else "nothing is kept"
        return f"{run.standing()}; {kept}: with -o FILE, --resume could go on"
    again = "the same command" if run.resume else "the same command with --resume"
    return f"{run.standing()}; {again} goes on"


def _write(run: Run, asked: dict[str, Any], result: ResultFile | None, excerpt: Excerpt) -> None:
    """Write the rows as they come."""
    from scanfab.cli.console import is_readable, print_table
    from scanfab.table.columns import table_columns
    from scanfab.table.writing import row_writer

    if result is not None:
        with result.writer(asked, run.resume) as writer:
            for row in run.rows():
                writer.write(row)
    elif is_readable():
        print_table(list(run.rows()), excerpt)
    else:
        printer = row_writer(".csv", sys.stdout, table_columns(), excerpt=excerpt)
        for row in run.rows():
            printer.write(row)


def _manifests(output: Path | None, asked: Path | None) -> list[Path]:
    paths = [] if output is None else [output.with_name(output.name + ".manifest.json")]
    return paths if asked is None else [*paths, asked]


def _write_manifest(
    path: Path, asked: dict[str, Any], run: Run, told: Told, settings_file: SettingsFile | None
) -> None:
    from scanfab.base.files import whole_file
    from scanfab.pipeline.manifest import manifest

    # what was told of the rows that an earlier run has finished
    before = run.table.warnings if run.table is not None else []
    found = manifest(asked, run.series, [*dict.fromkeys([*before, *told.texts])], told.notes)
    if settings_file is not None:
        found["settings_file"] = settings_file.asked()
    text = json.dumps(found, indent=1, ensure_ascii=False)
    with whole_file(path) as part:
        # names of files need be no text; what replaces their letters is how JSON spells them
        part.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
