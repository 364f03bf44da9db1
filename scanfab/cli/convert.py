"""scanfab convert: frames in another format."""

from __future__ import annotations

from typing import Any

import click

from scanfab.cli.options import READING, options, usage_errors
from scanfab.cli.sources import SourceCommand, expanded_sources, open_one, reading_of
from scanfab.cli.talk import talk_options, tell_inputs, working


def _expanded(ctx: click.Context, parameter: click.Parameter, paths: tuple[str, ...]) -> Any:
    if len(paths) < 2:
        raise click.UsageError("expected SOURCE... OUT: what to read, and where to write")
    return (*expanded_sources(ctx, paths[:-1]), paths[-1])


@click.command(cls=SourceCommand)
@click.argument(
    "paths", metavar="SOURCE... OUT", nargs=-1, required=True, type=click.Path(), callback=_expanded
)
@options("to", *READING, "frames")
@talk_options
def convert(paths: tuple[str, ...], to: str | None, frames: str | None, **chosen: Any) -> int:
    """
    Write SOURCE in another format: grains, contacts, forces, cell, step and time.

    OUT is a file for one frame; a folder, or a name with {step}, for a file each. What a format
    cannot hold lies beside each file, and is found there by whoever reads it.
    """
    from scanfab.io.convert import convert as write
    from scanfab.io.options import parse_frames

    with usage_errors():
        reading, part = reading_of(chosen), parse_frames(frames)
    series = open_one(paths[:-1], reading, "converted")
    tell_inputs([series], 1)
    with (
        working(lambda: len(range(series.frames_expected())[part])) as advance,
        usage_errors(),
    ):
        write(series, paths[-1], to=to, frames=part, after=advance)
    return 0
