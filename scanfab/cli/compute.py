"""scanfab compute: the fabric table."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import check_plot, options, sources_argument, usage_errors
from scanfab.cli.settings_file import fill_from_file
from scanfab.cli.sources import SourceCommand, open_series, reading_arguments
from scanfab.cli.talk import talk_options, tell_inputs, working
from scanfab.pipeline.options import OPTIONS, OUTPUT_OPTIONS

if TYPE_CHECKING:
    from scanfab.io.series import Series
    from scanfab.pipeline.compute import Observer
    from scanfab.pipeline.job import Job
    from scanfab.pipeline.settings import Settings
    from scanfab.table.writing import Excerpt

__all__ = ["OF_THE_LINE", "compute"]

# of data that there are figures of
KINDS = ("table", "frames")
# in the order of the help
ORDER = ("output", "sample", "reading", "window", "scan", "fabric")
# what a settings file says nothing of: what is read, where results go, and what is told
OF_THE_LINE = (
    "sources", "quiet", "verbose", "help", *(one.name for one in OUTPUT_OPTIONS if not one.meaning)
)  # fmt: skip


@click.command(cls=SourceCommand)
@sources_argument
@options(*(one.name for group in ORDER for one in OPTIONS.values() if one.group == group))
@talk_options
@click.pass_context
def compute(
    ctx: click.Context,
    /,
    sources: tuple[str, ...],
    output: Path | None,
    resume: bool,
    manifest: Path | None,
    vtk: Path | None,
    plot: Path | None,
    figure: str | None,
    **chosen: Any,
) -> int:
    """
    Compute the fabric table: one row per frame and variant.

    SOURCE is a folder with a series of dumps, files of one series, or - for standard input; what is
    named twice counts once.

    \b
    A folder:       scanfab compute dumps/ --boundary type=2 -o fabric.csv
    Several files:  scanfab compute dumps/*.vtk --variants cd --tolerance 1e-3
    A pipe:         zcat dump.gz | scanfab compute - --format liggghts

    Variants: a whole sample; b whole sample, rattlers removed; c representative volume (RV); d RV,
    rattlers removed. Lengths are in the dump's own units.
    """
    from scanfab.cli.console import announce_compiling, reported_warnings
    from scanfab.pipeline.job import Job
    from scanfab.pipeline.settings import Settings
    from scanfab.table.columns import table_columns
    from scanfab.table.result_file import ResultFile
    from scanfab.table.writing import Excerpt

    if resume and output is None:
        raise click.UsageError("--resume goes with -o FILE")
    _check_figure(plot, figure)
    with reported_warnings() as told:
        chosen, settings_file = fill_from_file(ctx, sources, chosen)
        if plot is not None and chosen.get("cutoffs"):
            raise click.UsageError("--plot is of one cut-off: leave out --cutoffs")
        with settings_file.named_errors():
            reading = reading_arguments(chosen)
            fields, digits = chosen.pop("fields"), int(chosen.pop("digits"))
            settings = Settings(**chosen)
            columns = table_columns(settings.more_columns)
            excerpt = Excerpt.make(columns, fields, digits)
            result = None if output is None else ResultFile(output, columns, excerpt)
        series = open_series(sources, reading)
        if figure is not None and _is_of_frames(figure) and len(series) > 1:
            raise click.UsageError(f"--figure {figure} draws one series: name one source")
        tell_inputs(series, settings.workers)
        announce_compiling()
        with usage_errors():
            job = Job(
                series,
                settings,
                result,
                sources=sources,
                reading=reading,
                resume=resume,
                manifest_path=manifest,
                observers=_observers(vtk, series, settings, resume),
                told=told,
                keep=plot is not None,
            )
        with ExitStack() as stack:
            with usage_errors():
                stack.enter_context(job.begun())
                if plot is not None and job.table is not None:
                    job.table.check_columns(_columns_drawn(figure))
            _write_or_say(job, excerpt)
        job.save_manifests(settings_file.asked())
        if plot is not None:
            _draw(plot, figure, job)
    return 0 if job.found_void_fabric and not job.has_skipped else 1


def _check_figure(plot: Path | None, figure: str | None) -> None:
    if plot is not None or figure is not None:
        check_plot(plot, figure, *KINDS)


def _is_of_frames(figure: str) -> bool:
    from scanfab.viz.figures.page import find_figure

    return find_figure(figure, *KINDS)[0].kind == "frames"


def _columns_drawn(figure: str | None) -> tuple[str, ...]:
    """The columns of the table without which the figures cannot be."""
    from scanfab.table.plots import figures_of
    from scanfab.viz.figures.page import find_figure

    asked = figures_of("table").values() if figure is None else [find_figure(figure, *KINDS)[0]]
    return tuple(dict.fromkeys(name for one in asked for name in one.columns))


def _observers(
    folder: Path | None, series: list[Series], settings: Settings, resume: bool
) -> Sequence[Observer]:
    """What writes the ParaView files of each series."""
    if folder is None:
        return ()
    from scanfab.viz.paraview import vtk_folders

    return vtk_folders(folder, len(series), settings, resume)


def _draw(plot: Path, figure: str | None, job: Job) -> None:
    from scanfab.table.compare import compare_tables
    from scanfab.viz.figures.page import make_figures, save_figures
    from scanfab.viz.scanned_frames import ScannedFrames

    if not job.found_void_fabric:
        click.echo(f"scanfab: {plot} is not drawn: no row has a void fabric", err=True)
    elif figure is not None and _is_of_frames(figure):
        frames = ScannedFrames(job.series[0], job.settings, job.kept)
        save_figures(plot, make_figures(frames, "frames", figure))
    else:
        comparison = compare_tables(job.kept)
        save_figures(plot, make_figures(job.kept, "table", figure, comparison=comparison))


def _write_or_say(job: Job, excerpt: Excerpt) -> None:
    """Write the rows; where that is interrupted or fails, say how far it is and how to go on."""
    from scanfab.base.errors import ScanfabError
    from scanfab.cli.console import is_readable
    from scanfab.cli.signals import telling

    # asked for now, as a signal comes at any moment
    printed = not is_readable()

    def standing() -> str:
        return _standing(job, printed)

    try:
        with telling(standing):
            _write(job, excerpt)
    except (ScanfabError, OSError):
        if job.result is not None and (job.is_over or 0 < job.done < job.frames()):
            click.echo(f"scanfab: stopped {standing()}", err=True)
        raise


def _standing(job: Job, printed: bool) -> str:
    """How far a job is, and how to go on."""
    if not job.done and job.table is not None:
        return (
            f"before the first new frame was finished: {job.table.path} is as it was; the same "
            f"command goes on"
        )
    if not job.done:
        return "before the first frame was finished: nothing is kept"
    done = f"after {job.done} of {job.frames()} frames"
    if job.is_over:
        done = "after the last frame, before the table was complete"
    if job.result is None:
        kept = "the rows printed so far are all" if printed else "nothing is kept"
        return f"{done}; {kept}: with -o FILE, --resume could go on"
    again = "the same command" if job.resume else "the same command with --resume"
    return f"{done}; {again} goes on"


def _write(job: Job, excerpt: Excerpt) -> None:
    """Write the rows as they come; on a terminal, all of them as a table."""
    from scanfab.cli.console import is_readable, print_csv, print_table
    from scanfab.table.columns import table_columns

    with working(job.frames, job.done) as advance:
        if job.result is not None:
            job.write(advance)
            return
        if not is_readable():
            print_csv(job.rows(advance), excerpt, table_columns(job.settings.more_columns))
            return
        rows = list(job.rows(advance))
    print_table(rows, excerpt)
