"""scanfab map: the fabric of each block of the sample."""

from __future__ import annotations

from typing import Any

import click

from scanfab.cli.options import SourceCommand, in_order, options
from scanfab.pipeline.options import MAP_OPTIONS


@click.command(cls=SourceCommand)
@options(*in_order(MAP_OPTIONS), declared=MAP_OPTIONS)
@options("frame", default=None, help="Only this frame; a negative number counts from the end.")
def map(sources: tuple[str, ...], frame: int | None, **chosen: Any) -> int:
    """
    Compute the fabric by place: one row per frame, variant and block of the sample.

    Blocks form a grid, slices along the axis, or shells about the centre. A void segment belongs to
    the block that holds its midpoint.

    \b
    A profile:  scanfab map dumps/ --slices 8 --frames -1: --plot profile.png
    A grid:     scanfab map dumps/ --grid 5,5,5 --tolerance 1e-3 -o map.csv --vtk paraview/

    SOURCE is the same as for compute. A warning says if the sample is not homogeneous, that is, if
    its blocks scatter more than their errors explain.
    """
    from scanfab.cli.rows import write_table
    from scanfab.pipeline.maps.settings import MapSettings

    if frame is not None:
        if chosen["frames"] is not None:
            raise click.UsageError("--frame and --frames choose frames in two ways: name one")
        chosen["frames"] = str(frame)
    return write_table(sources, chosen, MapSettings, frame)
