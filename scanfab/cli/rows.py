"""Compute a table, write its rows as they come, and draw it; shared by compute and map."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Any

import click

import scanfab
from scanfab.cli.console import announce, draw, is_readable, print_csv, print_table, working
from scanfab.cli.options import checked, excerpt_of, open_series, take_output, usage_errors
from scanfab.cli.settings_file import as_listed
from scanfab.cli.signals import ending_in_order, tell_if_ended
from scanfab.pipeline.map_settings import MapSettings
from scanfab.pipeline.options import Output
from scanfab.pipeline.settings import Settings

if TYPE_CHECKING:
    from scanfab import Series
    from scanfab.pipeline.job import Job
    from scanfab.table.writing import Excerpt


def write_table(
    sources: tuple[str, ...], chosen: dict[str, Any], kind: type[Settings], frame: int | None = None
) -> int:
    """
    Compute a table with the options of a command, write it, draw it, and return the exit code.

    ``kind`` is the class of the table's settings. If a ``frame`` is given, every series must have
    it.
    """
    from scanfab.io.follow import FollowedSeries
    from scanfab.viz.compute_file import table_job

    ctx = click.get_current_context()
    figures = ("map",) if kind is MapSettings else ("table", "frames")
    outputs = take_output(chosen, *figures)
    cluster = outputs.scheduler or outputs.scheduler_file
    for is_wrong, words in (
        (outputs.plot and chosen.get("cutoffs"), "--plot draws one cut-off: leave out --cutoffs"),
        (outputs.resume and not outputs.output, "--resume needs -o FILE"),
        ((outputs.follow_for or 0) < 0, "--follow-for: expected 0 or more"),
        (outputs.vtk and cluster, "--vtk cannot be used with --scheduler: leave out one of them"),
    ):
        if is_wrong:
            raise click.UsageError(words)
    reading, settings = checked(chosen, kind)
    excerpt = excerpt_of(outputs, settings.columns)
    series = _open(sources, reading, outputs)
    if frame is not None:
        _check_frame(series, frame)
    drawing = _Drawing(outputs, figures)
    if drawing.kind == "frames" and len(series) > 1:
        raise click.UsageError(f"--figure {outputs.figure} draws one series: name one source")
    announce(series, settings.workers)
    with ExitStack() as stack:
        with usage_errors():
            executor = None
            if cluster:
                file = outputs.scheduler_file
                dask = scanfab.dask_executor(outputs.scheduler, scheduler_file=file)
                executor = stack.enter_context(dask)
            listed = as_listed(ctx)
            job = table_job(
                series,
                settings,
                outputs,
                excerpt,
                more={"settings_file": listed} if listed else {},
                told=ctx.obj,
                executor=executor,
            )
            stack.enter_context(job.begun())
        for one in series:
            if isinstance(one, FollowedSeries):
                stack.enter_context(ending_in_order(one.end))
                one.idle = lambda: drawing.redraw(job)
        _write(job, excerpt)
    drawing.draw(job)
    return 0 if job.is_good else 1


def _check_frame(series: Sequence[Series], frame: int) -> None:
    """UsageError if a series, which is not followed, lacks the frame."""
    from scanfab.io.follow import FollowedSeries

    for one in series:
        if not isinstance(one, FollowedSeries) and frame not in range(-len(one), len(one)):
            has = f"{one.name} has {len(one)}, counted from 0"
            raise click.UsageError(f"--frame: there is no frame {frame}: {has}")


def _open(sources: tuple[str, ...], reading: dict[str, Any], outputs: Output) -> Sequence[Series]:
    """The series that the sources name, or the one that is followed."""
    if not outputs.follow and outputs.follow_for is None:
        return open_series(sources, reading)
    if len(sources) > 1 or "-" in sources:
        raise click.UsageError("--follow takes one folder, or one file that grows")
    return [scanfab.follow_series(sources[0], seconds=outputs.follow_for, **reading)]


class _Drawing:
    """Draws the figures of a table that the options name."""

    def __init__(self, outputs: Output, kinds: tuple[str, ...]) -> None:
        from scanfab.viz.figures.figure import find_figure

        self.outputs, self.kind, self._drawn = outputs, kinds[0], 0
        if outputs.figure is not None:
            self.kind = find_figure(outputs.figure, *kinds)[0].kind

    def draw(self, job: Job) -> None:
        """Draw the rows that are computed so far."""
        plot, rows = self.outputs.plot, job.every_row
        if plot is not None and not job.found_void_fabric:
            click.echo(f"scanfab: {plot} is not drawn: no row has a void fabric", err=True)
        elif self.kind == "frames":
            draw(self.outputs, scanfab.ScannedFrames(job.series[0], job.settings, rows), self.kind)
        elif plot is not None:
            draw(self.outputs, scanfab.Table(rows, job.settings.columns), self.kind)

    def redraw(self, job: Job) -> None:
        """Redraw a followed series if it has new frames; figures that need a scan wait."""
        if self.kind != "frames" and job.found_void_fabric and job.done > self._drawn:
            self._drawn = job.done
            self.draw(job)


def _write(job: Job, excerpt: Excerpt) -> None:
    """Write the rows as they come; if that fails or is interrupted, say how to continue."""
    as_table = job.output is None and is_readable()
    prints = job.output is None and not as_table
    tell_if_ended(lambda: _standing(job))
    try:
        # closed here: if the reader of a pipe ends, the last notes are still told
        with (
            working(job.frames, job.done, prints) as advance,
            closing(job.rows(advance)) as computed,
        ):
            if prints:
                print_csv(computed, excerpt, job.settings.columns)
            rows = list(computed)
        if as_table:
            print_table(rows, excerpt)
    except (scanfab.ScanfabError, OSError) as error:
        # with the same wrong option the same command would stop again
        if job.output is not None and job.done and not isinstance(error, scanfab.SettingsError):
            click.echo(f"scanfab: stopped {_standing(job)}", err=True)
        raise


def _standing(job: Job) -> str:
    """How far the job has come, and how to continue it."""
    done = f"after {job.done} of {job.frames()} frames"
    if job.output is None:
        return f"{done}: with -o FILE, --resume could go on"
    return f"{done}; the same command{'' if job.resume else ' with --resume'} goes on"
