"""Options that commands share: how to read the sources."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

if TYPE_CHECKING:
    from scanfab.series import Series

__all__ = [
    "SourceCommand",
    "check_plot",
    "fill_from_file",
    "frame_options",
    "open_series",
    "output_option",
    "plot_option",
    "reading_arguments",
    "reading_options",
    "sample_options",
]

Command = Callable[..., Any]


class SourceCommand(click.Command):
    """A command with sources, whose --cell takes three or six numbers."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Join the numbers behind --cell into one word, as click knows no variable count."""
        joined: list[str] = []
        rest = list(args)
        while rest:
            word = rest.pop(0)
            joined.append(word)
            if word == "--cell":
                numbers = _leading_numbers(rest)
                joined.append(" ".join(rest[:numbers]))
                del rest[:numbers]
        return super().parse_args(ctx, joined)


def reading_options(command: Command) -> Command:
    """Add the options that say how to read the sources."""
    for option in reversed(_READING):
        command = option(command)
    return command


def frame_options(command: Command) -> Command:
    """Add the options that tell boundary, rattlers and the frames to take."""
    return sample_options(_FRAMES(command))


def sample_options(command: Command) -> Command:
    """Add the options that tell boundary and rattlers."""
    for option in reversed(_SAMPLE):
        command = option(command)
    return command


output_option = click.option(
    "-o",
    "output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Result file: .csv .tsv .json .jsonl .parquet (default: CSV on standard output, or a "
    "readable table on a terminal).",
)


plot_option = click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Draw to a file: .png .svg .pdf.",
)


def check_plot(plot: Path | None, figure: str | None, figures: Iterable[str]) -> None:
    """A usage error if no such figure can be drawn to such a file."""
    from scanfab.errors import SettingsError
    from scanfab.writers.plot import check_plot_file

    if plot is None:
        if figure is not None:
            raise click.UsageError("--figure goes with --plot FILE")
        return
    name = "rose" if figure is not None and figure.startswith("rose:") else figure
    if name is not None and name not in figures:
        raise click.UsageError(f"--figure: expected {', '.join(figures)}, found {figure!r}")
    try:
        check_plot_file(plot)
    except SettingsError as error:
        raise click.UsageError(f"--plot: {error}") from None


def reading_arguments(options: dict[str, Any]) -> dict[str, Any]:
    """Take the reading options out of a command's, as arguments of ``read_series``."""
    taken = {name: options.pop(name) for name in _READING_NAMES}
    taken["columns"] = _column_names(taken["columns"])
    taken["cell"] = _numbers(taken["cell"])
    _check_periodic(taken["periodic"])
    if taken["format"] is not None:
        _check_format(taken["format"])
    return taken


def settings_file(sources: tuple[str, ...]) -> Path | None:
    """The scanfab.toml beside the dumps; a usage error if the sources have different ones."""
    from scanfab.series import SETTINGS_FILE

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


def open_series(sources: tuple[str, ...], reading: dict[str, Any]) -> list[Series]:
    """The series of a command line; ``-`` is one that comes by standard input."""
    from dataclasses import replace

    from scanfab.errors import ReadError
    from scanfab.readers.files import temporary_copy
    from scanfab.series import open_sources, read_series

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


_READING: list[Callable[[Command], Command]] = [
    click.option("--format", metavar="NAME", help="Reader to use (default: by content)."),
    click.option(
        "--columns",
        metavar="NAMES",
        help='Names of columns that are not the usual ones: "radius=c_rad,x=px".',
    ),
    click.option(
        "--contact-columns",
        metavar="KEYWORDS",
        help='Columns of a dump local: LIGGGHTS keywords "pos id force", '
        'or LAMMPS names "id1=NAME,id2=NAME".',
    ),
    click.option(
        "--radius",
        type=click.FloatRange(min=0, min_open=True),
        metavar="L",
        help="Radius for dumps without one.",
    ),
    click.option(
        "--cell",
        metavar="LX LY LZ [XY XZ YZ]",
        help="The cell, for formats that do not carry it (periodic in xyz unless --periodic).",
    ),
    click.option("--periodic", metavar="xyz", help="Periodic directions (default: the dump's)."),
    click.option(
        "--contacts",
        default="auto",
        metavar="PATH|file|geometric",
        help="Contacts: a file, folder or glob matched by step; from the dump's own contact files; "
        "or by geometry (default: file if there is one, else geometric).",
    ),
]
_SAMPLE: list[Callable[[Command], Command]] = [
    click.option(
        "--contact-tolerance",
        default=0.0,
        show_default=True,
        metavar="X",
        help="Relative: contact if distance < (r1 + r2)(1 + X).",
    ),
    click.option(
        "--boundary",
        multiple=True,
        metavar="EXPR",
        help='Which particles are boundary: "type=2", "mask=3,4", "id>=13723"; repeated: or.',
    ),
    click.option(
        "--min-contacts",
        default=2,
        show_default=True,
        metavar="N",
        help="A grain with fewer contacts is a rattler.",
    ),
]
_FRAMES = click.option(
    "--frames", metavar="A:B:C", help="Which frames, as a Python slice (default: all)."
)
_READING_NAMES = (
    "format", "columns", "contact_columns", "radius", "cell", "periodic", "contacts",
)  # fmt: skip


def _leading_numbers(words: list[str]) -> int:
    """How many numbers --cell takes: three, or six if six follow."""
    count = 0
    while count < len(words) and re.fullmatch(r"[-+]?[\d.]+([eE][-+]?\d+)?", words[count]):
        count += 1
    return 6 if count >= 6 else min(count, 3)


def _numbers(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        numbers = ()
    if len(numbers) not in (3, 6) or min(numbers[:3]) <= 0:
        raise click.UsageError(
            "--cell: expected three lengths LX LY LZ above 0, or six numbers with XY XZ YZ"
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
    from scanfab.errors import UnknownFormatError
    from scanfab.readers.registry import reader_named

    try:
        reader_named(name)
    except UnknownFormatError as error:
        raise click.UsageError(f"--format: {error}") from None
