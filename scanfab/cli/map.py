"""scanfab map: the fabric by place."""

from __future__ import annotations

from typing import Any

import click

from scanfab.cli.options import SourceCommand, in_order, options
from scanfab.pipeline.options import MAP_OPTIONS


@click.command(cls=SourceCommand)
@options(*in_order(MAP_OPTIONS), declared=MAP_OPTIONS)
def map(sources: tuple[str, ...], **chosen: Any) -> int:
    """
    Fabric by place: a row for each frame, variant and block of the sample.

    Blocks are a grid, slices along the axis, or shells about the centre. A void segment belongs to
    the block in which its middle lies.

    \b
    A profile:  scanfab map dumps/ --slices 8 --frames -1: --plot profile.png
    A grid:     scanfab map dumps/ --grid 5,5,5 --tolerance 1e-3 -o map.csv --vtk paraview/

    SOURCE is as for compute. A warning says whether the sample is homogeneous, that is, whether its
    blocks scatter more than their errors.
    """
    from scanfab.cli.rows import write_table
    from scanfab.pipeline.maps.settings import MapSettings

    return write_table(sources, chosen, MapSettings)
