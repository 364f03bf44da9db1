"""scanfab convert: frames in another format."""

from __future__ import annotations

from typing import Any

import click

from scanfab.cli.options import READING, options, usage_errors
from scanfab.cli.sources import SourceCommand, open_one, reading_of, sources_argument
from scanfab.cli.talk import talk_options, tell_inputs, working
from scanfab.pipeline.options import as_options


@click.command(cls=SourceCommand)
@sources_argument
@click.argument("out", type=click.Path())
@options("to", *READING, "frames")
@talk_options
def convert(
    sources: tuple[str, ...], out: str, to: str | None, frames: str | None, **chosen: Any
) -> int:
    """
    Write SOURCE in another format: grains, contacts, forces, cell, step and time.

    OUT is a file for one frame; a folder, or a name with {step}, for a file each. What a format
    cannot hold lies beside each file, and is found there by whoever reads it.
    """
    from scanfab.base.errors import SettingsError
    from scanfab.io.convert import convert as write
    from scanfab.io.options import parse_frames

    with usage_errors():
        reading, part = reading_of(chosen), parse_frames(frames)
    series = open_one(sources, reading, "converted")
    tell_inputs([series], 1)
    with working(lambda: len(range(series.frames_expected())[part])) as advance:
        try:
            write(series, out, to=to, frames=part, after=advance)
        except SettingsError as error:
            raise click.UsageError(as_options(error)) from None
    return 0
