"""Rows of frames written as they come: what the commands that compute have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import usage_errors
from scanfab.cli.settings_file import fill_from_file
from scanfab.cli.signals import ending_in_order
from scanfab.cli.sources import follow_one, open_series, reading_arguments
from scanfab.cli.talk import tell_inputs, working

if TYPE_CHECKING:
    from scanfab.io.series import Series
    from scanfab.pipeline.compute import Observer
    from scanfab.pipeline.job import Job
    from scanfab.pipeline.settings import Settings
    from scanfab.pipeline.told import Told
    from scanfab.table.writing import Excerpt

__all__ = ["finished_job"]


def finished_job(
    ctx: click.Context,
    sources: tuple[str, ...],
    chosen: dict[str, Any],
    kind: type[Settings],
    told: Told,
    *,
    output: Path | None,
    resume: bool,
    manifest: Path | None,
    vtk: Path | None,
    check: Callable[[list[Series], dict[str, Any]], None] = lambda series, chosen: None,
    drawn: Sequence[str] | None = None,
    draw: Callable[[Job], object] = lambda job: None,
) -> Job:
    """
    A job whose rows are written, with its manifests and ParaView files.

    ``chosen`` are the options of reading, and of settings of that kind; ``check`` refuses what does
    not go together, and ``drawn`` are the columns that figures need, if some are to be drawn. A
    series that is followed is drawn again whenever there is nothing else to do.
    """
    from scanfab.cli.console import announce_compiling
    from scanfab.pipeline.cluster.dask_executor import dask_executor
    from scanfab.pipeline.job import Job
    from scanfab.table.result_file import ResultFile
    from scanfab.table.writing import Excerpt
    from scanfab.viz.paraview import vtk_folders

    if resume and output is None:
        raise click.UsageError("--resume goes with -o FILE")
    follows, seconds = chosen.pop("follow"), chosen.pop("follow_for")
    scheduler, scheduler_file = chosen.pop("scheduler"), chosen.pop("scheduler_file")
    if (scheduler or scheduler_file) and vtk is not None:
        raise click.UsageError("--vtk is written where frames are computed: not with --scheduler")
    chosen, settings_file = fill_from_file(ctx, sources, chosen)
    check([], chosen)
    with settings_file.named_errors():
        reading = reading_arguments(chosen)
        fields, digits = chosen.pop("fields"), int(chosen.pop("digits"))
        settings = kind(**chosen)
        excerpt = Excerpt.make(settings.columns, fields, digits)
        result = None if output is None else ResultFile(output, settings.columns, excerpt)
    followed = None
    if follows or seconds is not None:
        followed = follow_one(sources, reading, seconds)
    # whether it holds frames is not known yet
    series: list[Series] = open_series(sources, reading) if followed is None else [followed]
    check(series, chosen)
    tell_inputs(series, settings.workers)
    with ExitStack() as stack:
        executor = None
        if scheduler or scheduler_file:
            with usage_errors():
                cluster = dask_executor(scheduler, scheduler_file=scheduler_file)
                executor = stack.enter_context(cluster)
        announce_compiling()
        with usage_errors():
            observers: Sequence[Observer] = ()
            if vtk is not None:
                observers = vtk_folders(vtk, len(series), settings, resume)
            job = Job(
                series,
                settings,
                result,
                sources=sources,
                reading=reading,
                resume=resume,
                manifest_path=manifest,
                observers=observers,
                told=told,
                keep=drawn is not None,
                executor=executor,
            )
        if followed is not None:
            stack.enter_context(ending_in_order(followed.end))
            followed.when_idle(_Redraw(job, draw))
        with usage_errors():
            stack.enter_context(job.begun())
            if drawn is not None and job.table is not None:
                job.table.check_columns(drawn)
        _write_or_say(job, excerpt)
    job.save_manifests(settings_file.asked())
    return job


class _Redraw:
    """Draws what there is, if that is more than before."""

    def __init__(self, job: Job, draw: Callable[[Job], object]) -> None:
        self.job, self.draw = job, draw
        self.done = 0

    def __call__(self) -> None:
        if self.job.found_void_fabric and self.job.done > self.done:
            self.done = self.job.done
            self.draw(self.job)


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

    with working(job.frames, job.done) as advance:
        if job.result is not None:
            job.write(advance)
            return
        if not is_readable():
            print_csv(job.rows(advance), excerpt, job.settings.columns)
            return
        rows = list(job.rows(advance))
    print_table(rows, excerpt)
