"""scanfab compute: the fabric table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import check_plot, options, sources_argument
from scanfab.cli.sources import SourceCommand
from scanfab.cli.talk import talk_options
from scanfab.pipeline.options import OPTIONS, OUTPUT_OPTIONS

if TYPE_CHECKING:
    from scanfab.io.series import Series
    from scanfab.pipeline.job import Job


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
    from scanfab.cli.console import reported_warnings
    from scanfab.cli.rows import finished_job
    from scanfab.pipeline.settings import Settings

    _check_figure(plot, figure)

    def check(series: list[Series], chosen: dict[str, Any]) -> None:
        if plot is not None and chosen.get("cutoffs"):
            raise click.UsageError("--plot is of one cut-off: leave out --cutoffs")
        if _needs_frames(figure) and len(series) > 1:
            raise click.UsageError(f"--figure {figure} draws one series: name one source")

    def draw(job: Job) -> None:
        # figures of frames scan again: once, at the end
        if plot is not None and not _needs_frames(figure):
            _draw(plot, figure, job)

    with reported_warnings() as told:
        job = finished_job(
            ctx, sources, chosen, Settings, told,
            output=output, resume=resume, manifest=manifest, vtk=vtk, check=check,
            drawn=() if plot is None else _columns_drawn(figure),
            draw=draw,
        )  # fmt: skip
        if plot is not None:
            _draw(plot, figure, job)
    return 0 if job.is_good else 1


def _check_figure(plot: Path | None, figure: str | None) -> None:
    if plot is not None or figure is not None:
        check_plot(plot, figure, *KINDS)


def _needs_frames(figure: str | None) -> bool:
    from scanfab.viz.figures.page import find_figure

    return figure is not None and find_figure(figure, *KINDS)[0].kind == "frames"


def _columns_drawn(figure: str | None) -> tuple[str, ...]:
    """The columns of the table without which the figures cannot be."""
    from scanfab.table.plots import figures_of
    from scanfab.viz.figures.page import find_figure

    asked = figures_of("table").values() if figure is None else [find_figure(figure, *KINDS)[0]]
    return tuple(dict.fromkeys(name for one in asked for name in one.columns))


def _draw(plot: Path, figure: str | None, job: Job) -> None:
    from scanfab.table.compare import compare_tables
    from scanfab.viz.figures.page import make_figures, save_figures
    from scanfab.viz.scanned_frames import ScannedFrames

    if not job.found_void_fabric:
        click.echo(f"scanfab: {plot} is not drawn: no row has a void fabric", err=True)
    elif _needs_frames(figure):
        frames = ScannedFrames(job.series[0], job.settings, job.every_row)
        save_figures(plot, make_figures(frames, "frames", figure))
    else:
        rows = job.every_row
        comparison = compare_tables(rows)
        save_figures(plot, make_figures(rows, "table", figure, comparison=comparison))
