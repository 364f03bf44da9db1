"""The sources of a command line, and how to read them."""

from __future__ import annotations

import re
import sys
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import usage_errors, write_groups
from scanfab.io.options import take_reading

if TYPE_CHECKING:
    from scanfab.io.follow import FollowedSeries
    from scanfab.io.series import Series


# numbers that may stand apart behind an option, as users write them
COUNTS = {"--cell": (3, 6), "--rv-center": (3,), "--rv-size": (2, 3)}


class SourceCommand(click.Command):
    """A command with sources: help in groups, and options whose numbers may stand apart."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options in their groups."""
        write_groups(self, ctx, formatter)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Join the numbers behind an option into one word, as click knows no variable count."""
        joined: list[str] = []
        rest = list(args)
        while rest:
            word = rest.pop(0)
            joined.append(word)
            numbers = _leading_numbers(rest, COUNTS[word]) if word in COUNTS else 0
            if numbers:
                joined.append(" ".join(rest[:numbers]))
                del rest[:numbers]
        return super().parse_args(ctx, joined)


def reading_arguments(options: dict[str, Any]) -> dict[str, Any]:
    """Take the reading options out of a command's, as arguments of ``read_series``."""
    with usage_errors():
        taken = take_reading(options)
    if taken["format"] is not None:
        _check_format(taken["format"])
    return taken


def follow_one(
    sources: tuple[str, ...], reading: dict[str, Any], seconds: float | None
) -> FollowedSeries:
    """The series of a command line that is still being written."""
    from scanfab.io.follow import follow_series

    if len(sources) > 1 or "-" in sources:
        raise click.UsageError("--follow takes one folder, or one file that grows")
    if seconds is not None and not seconds >= 0:
        raise click.UsageError(f"--follow-for: expected 0 or more, found {seconds:g}")
    return follow_series(sources[0], seconds=seconds, **reading)


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


def _leading_numbers(words: list[str], counts: tuple[int, ...]) -> int:
    """The largest of the counts that so many numbers follow; of fewer all that follow."""
    count = 0
    while count < len(words) and re.fullmatch(r"[-+]?[\d.]+([eE][-+]?\d+)?", words[count]):
        count += 1
    return max((one for one in counts if one <= count), default=count)


def _check_format(name: str) -> None:
    from scanfab.io.reader import reader_named

    with usage_errors("--format: "):
        reader_named(name)
