"""scanfab map: the fabric of each block of the sample."""

from __future__ import annotations

from typing import Any

import click
from click.core import ParameterSource

from scanfab.cli.options import SourceCommand, checked, open_series, options
from scanfab.pipeline.options import MAP_OPTIONS, Output


@click.command(cls=SourceCommand)
@options(*MAP_OPTIONS, declared=MAP_OPTIONS)
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
    from scanfab.pipeline.map_settings import BLOCK_OPTIONS, MapSettings

    if all(chosen[name] is None for name in BLOCK_OPTIONS):
        # discs have no map, so do not ask for blocks first
        asked = {name: chosen[name] for name in chosen.keys() - vars(Output())}
        reading, _ = checked({**asked, "slices": 1}, MapSettings)
        for series in open_series(sources, reading):
            if len(series) and (space := series[0].read().space).is_plane:
                raise click.UsageError(f"a map needs spheres, but all grains are discs in {space}")
    if frame is not None:
        ctx = click.get_current_context()
        if ctx.get_parameter_source("frames") is ParameterSource.COMMANDLINE:
            raise click.UsageError("--frame and --frames choose frames in two ways: name one")
        # --frame overrides frames of the settings file
        ctx.set_parameter_source("frames", ParameterSource.COMMANDLINE)
        chosen["frames"] = str(frame)
    return write_table(sources, chosen, MapSettings, frame)
