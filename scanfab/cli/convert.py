"""scanfab convert: frames in another format."""

from __future__ import annotations

from typing import Any

import click
from click.shell_completion import CompletionItem

from scanfab.cli.options import READING, GroupedOption, options, usage_errors
from scanfab.cli.settings_file import fill_from_file
from scanfab.cli.sources import SourceCommand, open_series, reading_arguments
from scanfab.cli.talk import talk_options, tell_inputs, working


def _complete(ctx: click.Context, parameter: click.Parameter, text: str) -> list[CompletionItem]:
    """The names of the formats."""
    from scanfab.io.writer import installed_writers

    return [CompletionItem(name) for name in installed_writers() if name.startswith(text)]


@click.command(cls=SourceCommand)
@click.argument("paths", metavar="SOURCE... OUT", nargs=-1, required=True, type=click.Path())
@click.option(
    "--to",
    cls=GroupedOption,
    group="",
    metavar="NAME",
    shell_complete=_complete,
    help="Format to write (default: by the suffix of OUT); scanfab formats lists them.",
)
@options(*READING, "frames")
@talk_options
@click.pass_context
def convert(ctx: click.Context, /, paths: tuple[str, ...], to: str | None, **chosen: Any) -> int:
    """
    Write SOURCE in another format: grains, contacts, forces, cell, step and time.

    OUT is a file for one frame; a folder, or a name with {step}, for a file each. What a format
    cannot hold lies beside each file, and is found there by whoever reads it.
    """
    from scanfab.base.errors import SettingsError
    from scanfab.cli.console import reported_warnings
    from scanfab.io.convert import convert as write
    from scanfab.io.options import parse_frames

    if len(paths) < 2:
        raise click.UsageError("expected SOURCE... OUT: what to read, and where to write")
    sources, out = paths[:-1], paths[-1]
    with reported_warnings():
        chosen, settings_file = fill_from_file(ctx, sources, chosen)
        with settings_file.named_errors():
            reading = reading_arguments(chosen)
            with usage_errors():
                frames = parse_frames(chosen["frames"])
        every = open_series(_existing(sources), reading)
        if len(every) > 1:
            names = ", ".join(one.name for one in every)
            raise click.UsageError(f"one series can be converted at a time, found {names}")
        tell_inputs(every, 1)
        with working(lambda: len(range(every[0].frames_expected())[frames])) as advance:
            try:
                write(every[0], out, to=to, frames=frames, after=advance)
            except SettingsError as error:
                raise click.UsageError(str(error)) from None
    return 0


def _existing(sources: tuple[str, ...]) -> tuple[str, ...]:
    """The sources, with globs in quotes as the shell would have made of them."""
    from scanfab.io.families import expanded

    return tuple(
        str(one) for source in sources for one in ([source] if source == "-" else expanded(source))
    )
