"""Rows of frames written as they come: what the commands that compute have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from scanfab.cli.options import usage_errors
from scanfab.cli.settings_file import fill_from_file
from scanfab.cli.signals import ending_in_order
from scanfab.cli.sources import follow_one, open_series, reading_arguments
from scanfab.cli.talk import tell_inputs, working

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from scanfab.io.follow import FollowedSeries
    from scanfab.io.series import Series
    from scanfab.pipeline.job import Job
    from scanfab.pipeline.settings import Settings
    from scanfab.pipeline.told import Told
    from scanfab.table.writing import Excerpt, ResultFile


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
    drawn: Sequence[str] = (),
    draw: Callable[[Job], object] = lambda job: None,
) -> Job:
    """
    A job whose rows are written, with its manifests and ParaView files.

    ``chosen`` are the options of reading, and of settings of that kind; ``check`` refuses what does
    not go together, and ``drawn`` are the columns that figures need, if some are to be drawn. A
    series that is followed is drawn again whenever there is nothing else to do.
    """
    from scanfab.cli.console import announce_compiling
    from scanfab.pipeline.job import Job
    from scanfab.viz.paraview import vtk_folders

    if resume and output is None:
        raise click.UsageError("--resume goes with -o FILE")
    way = _way(chosen)
    if way.is_cluster and vtk is not None:
        raise click.UsageError("--vtk is written where frames are computed: not with --scheduler")
    chosen, settings_file = fill_from_file(ctx, sources, chosen)
    check([], chosen)
    with settings_file.named_errors():
        reading = reading_arguments(chosen)
        settings, excerpt, result = _asked(chosen, kind, output)
    series, followed = way.opened(sources, reading)
    check(series, chosen)
    tell_inputs(series, settings.workers)
    with ExitStack() as stack:
        with usage_errors():
            executor = stack.enter_context(way.executor())
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
                more=settings_file.asked(),
                observers=() if vtk is None else vtk_folders(vtk, len(series), settings, resume),
                told=told,
                executor=executor,
            )
        if followed is not None:
            stack.enter_context(ending_in_order(followed.end))
            followed.idle = _Redraw(job, draw)
        with usage_errors():
            stack.enter_context(job.begun(drawn))
        _write_or_say(job, excerpt)
    return job


def _asked(
    chosen: dict[str, Any], kind: type[Settings], output: Path | None
) -> tuple[Settings, Excerpt, ResultFile | None]:
    """What the options that are not those of reading ask for, and the file that it goes to."""
    from scanfab.table.writing import Excerpt, ResultFile

    fields, digits = chosen.pop("fields"), int(chosen.pop("digits"))
    settings = kind(**chosen)
    excerpt = Excerpt.make(settings.columns, fields, digits)
    result = None if output is None else ResultFile(output, settings.columns, excerpt)
    return settings, excerpt, result


class _Way(NamedTuple):
    """How frames come, and where they are computed."""

    follows: bool
    seconds: float | None
    scheduler: str | None
    scheduler_file: Path | None

    @property
    def is_cluster(self) -> bool:
        return bool(self.scheduler or self.scheduler_file)

    def opened(
        self, sources: tuple[str, ...], reading: dict[str, Any]
    ) -> tuple[list[Series], FollowedSeries | None]:
        """The series, and the one that is followed, which may hold no frames yet."""
        if not self.follows:
            return open_series(sources, reading), None
        followed = follow_one(sources, reading, self.seconds)
        return [followed], followed

    def executor(self) -> AbstractContextManager[Executor | None]:
        """That of a cluster, while it is connected; None for this machine."""
        from scanfab.pipeline.cluster import dask_executor

        if not self.is_cluster:
            return nullcontext()
        return dask_executor(self.scheduler, scheduler_file=self.scheduler_file)


def _way(chosen: dict[str, Any]) -> _Way:
    """Taken out of the options."""
    follows, seconds = chosen.pop("follow"), chosen.pop("follow_for")
    scheduler, file = chosen.pop("scheduler"), chosen.pop("scheduler_file")
    return _Way(follows or seconds is not None, seconds, scheduler, file)


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
    if job.result is not None and job.done == job.taken_over > 0 and job.result.path.exists():
        return (
            f"before the first new frame was finished: {job.result.path} is as it was; the same "
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
        if is_table := is_readable():
            rows = list(job.rows(advance))
        else:
            print_csv(job.rows(advance), excerpt, job.settings.columns)
    if is_table:
        print_table(rows, excerpt)
    job.save_manifests()
