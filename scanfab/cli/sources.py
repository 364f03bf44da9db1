"""The sources of a command line: how to read them, and the settings file beside them."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from scanfab.cli.options import usage_errors

if TYPE_CHECKING:
    from scanfab.series import Series

__all__ = ["SourceCommand", "fill_from_file", "open_series", "reading_arguments", "settings_file"]

_READING_NAMES = (
    "format", "columns", "contact_columns", "radius", "cell", "periodic", "contacts",
)  # fmt: skip


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
    taken = {name: options.pop(name) for name in _READING_NAMES}
    taken["columns"] = _column_names(taken["columns"])
    taken["cell"] = _cell(taken["cell"])
    _check_periodic(taken["periodic"])
    if taken["format"] is not None:
        _check_format(taken["format"])
    return taken


def open_series(sources: tuple[str, ...], reading: dict[str, Any]) -> list[Series]:
    """The series of a command line; ``-`` is one that comes by standard input."""
    from dataclasses import replace

    from scanfab.errors import ReadError
    from scanfab.opening import open_sources, read_series
    from scanfab.readers.files import temporary_copy

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


def settings_file(sources: tuple[str, ...]) -> Path | None:
    """The scanfab.toml beside the dumps; a usage error if the sources have different ones."""
    from scanfab.opening import SETTINGS_FILE

    folders = {Path(s) if Path(s).is_dir() else Path(s).parent for s in sources if s != "-"}
    found = [folder / SETTINGS_FILE for folder in sorted(folders)]
    found = [path for path in found if path.is_file()]
    if len(found) > 1:
        raise click.UsageError(
            f"the sources have several settings files: {', '.join(map(str, found))}; "
            f"compute them one by one"
        )
    return found[0] if found else None


def fill_from_file(
    ctx: click.Context, sources: tuple[str, ...], options: dict[str, Any]
) -> dict[str, Any]:
    """The options, those that the command line does not name from the settings file."""
    path = settings_file(sources)
    if path is None:
        return options
    parameters = {
        name.removeprefix("--"): parameter
        for parameter in ctx.command.params
        for name in parameter.opts
        if parameter.name in options
    }
    filled = dict(options)
    for key, value in _section(path, "compute").items():
        parameter = parameters.get(key)
        if parameter is not None:
            name = str(parameter.name)
            if ctx.get_parameter_source(name) is ParameterSource.DEFAULT:
                filled[name] = _from_toml(ctx, path, parameter, value)
        elif ctx.command.name == "compute":
            raise click.UsageError(f"{path}: compute has no option {key!r}")
    return filled


def _section(path: Path, name: str) -> dict[str, Any]:
    import tomllib

    try:
        with open(path, "rb") as stream:
            section = tomllib.load(stream).get(name, {})
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise click.UsageError(f"{path}: {error}") from None
    if not isinstance(section, dict):
        raise click.UsageError(f"{path}: expected a section [{name}]")
    return section


def _from_toml(ctx: click.Context, path: Path, parameter: click.Parameter, value: Any) -> Any:
    """A value of the settings file as the command line would give it."""
    if isinstance(value, list) and not parameter.multiple and parameter.nargs == 1:
        value = " ".join(map(str, value))  # the numbers of a cell
    elif parameter.multiple and not isinstance(value, list):
        value = [value]
    elif not isinstance(value, list):
        value = str(value)
    try:
        return parameter.type_cast_value(ctx, value)
    except click.BadParameter as error:
        raise click.UsageError(f"{path}: {parameter.name}: {error.format_message()}") from None


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
    from scanfab.readers.registry import reader_named

    with usage_errors("--format: "):
        reader_named(name)
