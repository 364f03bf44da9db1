"""The sources of a command line, and how to read them."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import usage_errors

if TYPE_CHECKING:
    from scanfab.io.series import Series

__all__ = ["SourceCommand", "open_series", "reading_arguments"]


class SourceCommand(click.Command):
    """A command with sources, whose --cell takes three or six numbers, or a file."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Join the numbers behind --cell into one word, as click knows no variable count."""
        joined: list[str] = []
        rest = list(args)
        while rest:
            word = rest.pop(0)
            joined.append(word)
            numbers = _leading_numbers(rest) if word == "--cell" else 0
            if numbers:
                joined.append(" ".join(rest[:numbers]))
                del rest[:numbers]
        return super().parse_args(ctx, joined)


def reading_arguments(options: dict[str, Any]) -> dict[str, Any]:
    """Take the reading options out of a command's, as arguments of ``read_series``."""
    from scanfab.io.opening import READING

    taken = {name: options.pop(name) for name in READING}
    taken["columns"] = _column_names(taken["columns"])
    taken["cell"] = _cell(taken["cell"])
    _check_periodic(taken["periodic"])
    if taken["format"] is not None:
        _check_format(taken["format"])
    return taken


def open_series(sources: tuple[str, ...], reading: dict[str, Any]) -> list[Series]:
    """The series of a command line; ``-`` is one that comes by standard input."""
    from dataclasses import replace

    from scanfab.base.errors import ReadError
    from scanfab.io.files import temporary_copy
    from scanfab.io.opening import open_sources, read_series

    if "-" not in sources:
        return open_sources(sources, **reading)
    if reading["format"] is None:
        raise click.UsageError("standard input needs --format NAME")
    if len(sources) > 1:
        raise click.UsageError("standard input is a series of its own: name no other source")
    copy = temporary_copy(sys.stdin.buffer, "standard-input")
    if copy.stat().st_size == 0:
        raise ReadError("standard input: expected a dump, found nothing")
    return [replace(read_series(copy, **reading), name="-")]


def _leading_numbers(words: list[str]) -> int:
    """How many numbers --cell takes: three, or six if six follow."""
    count = 0
    while count < len(words) and re.fullmatch(r"[-+]?[\d.]+([eE][-+]?\d+)?", words[count]):
        count += 1
    return 6 if count >= 6 else min(count, 3)


def _cell(text: str | None) -> tuple[float, ...] | str | None:
    """Numbers, or the name of a file that has those of each frame."""
    if text is None or Path(text).is_file():
        return text
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        numbers = ()
    if len(numbers) not in (3, 6) or min(numbers[:3]) <= 0:
        raise click.UsageError(
            f"--cell: expected three lengths LX LY LZ above 0, or six numbers with XY XZ YZ, or a "
            f"CSV file with those of each frame, found {text!r}"
        )
    return numbers


def _column_names(text: str | None) -> dict[str, str] | None:
    if text is None:
        return None
    names = {}
    for part in text.split(","):
        standard, equals, own = part.partition("=")
        if not (equals and standard.strip() and own.strip()):
            raise click.UsageError(
                f'--columns: expected NAME=COLUMN such as "radius=c_rad,x=px", found {part!r}'
            )
        names[standard.strip()] = own.strip()
    return names


def _check_periodic(letters: str | None) -> None:
    if letters is not None and not re.fullmatch("[xyz]{0,3}", letters):
        raise click.UsageError(f"--periodic: expected letters out of xyz, found {letters!r}")


def _check_format(name: str) -> None:
    from scanfab.io.registry import reader_named

    with usage_errors("--format: "):
        reader_named(name)
