"""scanfab convert: frames in another format."""

from __future__ import annotations

from typing import Any

import click

import scanfab
from scanfab.cli.console import tell_inputs, working
from scanfab.cli.options import SourceCommand, checked, open_one, options, usage_errors


@click.command(cls=SourceCommand)
@click.argument("out", type=click.Path())
@options("to", "READING", "frames")
def convert(sources: tuple[str, ...], out: str, to: str | None, **chosen: Any) -> int:
    """
    Write SOURCE in another format: grains, contacts, forces, cell, step and time.

    OUT is a file for one frame; for several frames it is a folder, or a file name with {step}.
    What a format cannot hold goes into companion files beside each file; scanfab reads them too.
    """
    if out == "-":
        raise click.UsageError("OUT is a file or a folder: nothing is written to standard output")
    reading, settings = checked(chosen, scanfab.Settings)
    series = open_one(sources, reading, "converted")
    tell_inputs([series], 1)

    def frames() -> int:
        return len(range(series.frames_expected())[settings.frames])

    with working(frames) as advance, usage_errors():
        scanfab.convert(series, out, to=to, frames=settings.frames, after=advance)
    return 0
