"""scanfab map: the fabric by place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import check_plot, options, sources_argument
from scanfab.cli.sources import SourceCommand
from scanfab.cli.talk import talk_options
from scanfab.pipeline.options import MAP_OPTIONS

if TYPE_CHECKING:
    from scanfab.pipeline.job import Job


# in the order of the help
ORDER = ("output", "sample", "reading", "window", "scan", "fabric")


@click.command(cls=SourceCommand)
@sources_argument
@options(*(one for group in ORDER for one in MAP_OPTIONS.values() if one.group == group))
@talk_options
@click.pass_context
def map(
    ctx: click.Context,
    /,
    sources: tuple[str, ...],
    output: Path | None,
    resume: bool,
    manifest: Path | None,
    vtk: Path | None,
    plot: Path | None,
    **chosen: Any,
) -> int:
    """
    Fabric by place: a row for each frame, variant and block of the sample.

    Blocks are a grid, slices along the axis, or shells about the centre. A void segment belongs to
    the block in which its middle lies.

    \b
    A profile:  scanfab map dumps/ --slices 8 --frames -1: --plot profile.png
    A grid:     scanfab map dumps/ --grid 5,5,5 --tolerance 1e-3 -o map.csv --vtk paraview/

    SOURCE is as for compute. Whether the sample is homogeneous, that is, whether its blocks scatter
    more than their errors, is told as a warning.
    """
    from scanfab.cli.console import reported_warnings
    from scanfab.cli.rows import finished_job
    from scanfab.pipeline.maps.settings import MapSettings

    check_plot(plot, None, "map")

    def draw(job: Job) -> None:
        if plot is not None:
            _draw(plot, job)

    with reported_warnings() as told:
        job = finished_job(
            ctx, sources, chosen, MapSettings, told,
            output=output, resume=resume, manifest=manifest, vtk=vtk,
            drawn=() if plot is None else _columns_drawn(),
            draw=draw,
        )  # fmt: skip
        draw(job)
    return 0 if job.is_good else 1


def _columns_drawn() -> tuple[str, ...]:
    from scanfab.table.plots import figures_of

    return tuple(dict.fromkeys(name for one in figures_of("map").values() for name in one.columns))


def _draw(plot: Path, job: Job) -> None:
    from scanfab.table.table import Table
    from scanfab.viz.figures.page import make_figures, save_figures

    if not job.found_void_fabric:
        click.echo(f"scanfab: {plot} is not drawn: no row has a void fabric", err=True)
    else:
        save_figures(plot, make_figures(Table(job.every_row, job.settings.columns), "map"))
