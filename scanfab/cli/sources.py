"""Commands with sources: from their line to checked options, and to series of frames."""

from __future__ import annotations

import re
import sys
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from scanfab.cli.console import Command
from scanfab.cli.options import usage_errors, write_groups
from scanfab.cli.settings_file import in_file, take_settings_file, tell_used

if TYPE_CHECKING:
    from scanfab.io.series import Series
    from scanfab.pipeline.settings import Settings

S = TypeVar("S", bound="Settings")

# numbers that may stand apart behind an option, as users write them
COUNTS = {"--cell": (3, 6), "--rv-center": (3,), "--rv-size": (2, 3)}
NUMBER = re.compile(r"[-+]?[\d.]+([eE][-+]?\d+)?")


class SourceCommand(Command):
    """A command with sources: help in groups, and options whose numbers may stand apart."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options in their groups."""
        write_groups(self, ctx, formatter)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Join the numbers behind an option into one word, as click knows no variable count."""
        joined: list[str] = []
        rest = list(args)
        while rest:
            joined.append(rest.pop(0))
            counts = COUNTS.get(joined[-1], ())
            found = len(list(takewhile(NUMBER.fullmatch, rest))) if counts else 0
            if taken := max((count for count in counts if count <= found), default=found):
                joined.append(" ".join(rest[:taken]))
                del rest[:taken]
        try:
            return super().parse_args(ctx, joined)
        except click.BadParameter as error:
            flag = "" if error.param is None else error.param.opts[0]
            if (told := in_file(f"{flag}: {error.message}")).startswith(flag):
                raise
            raise click.UsageError(told) from None


def _expanded(ctx: click.Context, parameter: click.Parameter, given: Any) -> Any:
    """
    The sources, globs as a shell would have expanded them.

    The settings file beside them becomes the defaults of the command.
    """
    from scanfab.base.errors import ReadError
    from scanfab.io.families import expanded

    try:
        sources = [given] if isinstance(given, str) else given
        every = [str(path) for one in sources for path in expanded(one)]
    except ReadError as error:
        raise click.UsageError(str(error)) from None
    for path in every:
        if path != "-" and not Path(path).exists():
            raise click.UsageError(f"{path}: there is no such file, folder or glob")
    take_settings_file(ctx, every)
    # calibrate names its one source in the command that it recommends, as it was given
    return given if isinstance(given, str) else tuple(every)


a_source = click.Path(allow_dash=True)
sources_argument = click.argument(
    "sources", metavar="SOURCE...", nargs=-1, required=True, type=a_source, callback=_expanded
)
source_argument = click.argument("source", type=a_source, callback=_expanded)


def checked(chosen: dict[str, Any], kind: type[S]) -> tuple[dict[str, Any], S]:
    """The options of a command as those of reading and as settings; wrong ones are wrong usage."""
    with usage_errors():
        reading = reading_of(chosen)
        return reading, kind(**chosen)


def reading_of(chosen: dict[str, Any]) -> dict[str, Any]:
    """Take the options of reading out of those of a command."""
    from scanfab.io.options import take_reading

    tell_used(click.get_current_context())
    return take_reading(chosen)


def open_series(sources: tuple[str, ...], reading: dict[str, Any]) -> list[Series]:
    """The series of a command line; ``-`` is one that comes by standard input."""
    from dataclasses import replace

    from scanfab.base.errors import ReadError
    from scanfab.io.files import PART, temporary_copy
    from scanfab.io.sources import open_sources, read_series

    if "-" not in sources:
        return open_sources(sources, **reading)
    if reading["format"] is None:
        raise click.UsageError("standard input needs --format NAME")
    if len(sources) > 1:
        raise click.UsageError("standard input is a series of its own: name no other source")
    copy = temporary_copy(iter(partial(sys.stdin.buffer.read, PART), b""), "standard input")
    if copy.stat().st_size == 0:
        raise ReadError("standard input: expected a dump, found nothing")
    return [replace(read_series(copy, **reading), name="-")]


def open_one(sources: tuple[str, ...], reading: dict[str, Any], done: str) -> Series:
    """The one series of a command that takes no more."""
    found = open_series(sources, reading)
    if len(found) > 1:
        names = ", ".join(one.name for one in found)
        raise click.UsageError(f"one series can be {done} at a time, found {names}")
    return found[0]
