"""What a command line says: options, made of their declarations, and sources; or wrong usage."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.shell_completion import CompletionItem

from scanfab.base.errors import ReadError, SettingsError, UnknownFormatError
from scanfab.base.option import GROUPS, Option
from scanfab.cli.console import AS_CSV, Command
from scanfab.cli.settings_file import take_settings_file, tell_used
from scanfab.io.options import READING_OPTIONS, take_reading
from scanfab.pipeline.options import DECLARED, Output, as_options
from scanfab.pipeline.settings import Settings

if TYPE_CHECKING:
    from scanfab.base.column import Column
    from scanfab.io.series import Series
    from scanfab.table.writing import Excerpt

Function = Callable[..., Any]
S = TypeVar("S", bound=Settings)

# options that several commands have
SETS: dict[str, Sequence[str]] = {
    "READING": [one.name for one in READING_OPTIONS],
    "SAMPLE": ("boundary", "min_contacts", "rattlers", "min_force", "contact_tolerance"),
    "WINDOW": ("rv", "rv_radius", "rv_center", "rv_shape", "rv_size", "rv_axis", "rv_follows"),
    "EXCERPT": ("fields", "digits"),
}
# the cut-off of commands that take tables
OF_SEVERAL: dict[str, Any] = {
    "type": float,
    "default": None,
    "metavar": "C",
    "help": "If a table has several cut-offs, take the rows of this one; in the table's unit.",
}
METAVARS: dict[type, str] = {int: "N", float: "X", Path: "FILE"}
# numbers that may stand apart behind an option, as users write them
COUNTS = {"--cell": (3, 6), "--rv-center": (3,), "--rv-size": (2, 3)}
TITLES = {"": "What most need", **{group: group.capitalize() for group in GROUPS}}
# letters for an option and what it takes; what is longer has a line of its own
COLUMN = 22
NUMBER = re.compile(r"[-+]?[\d.]+([eE][-+]?\d+)?")


@contextmanager
def usage_errors(before: str = "") -> Iterator[None]:
    """Settings that cannot be are wrong usage; ``before`` stands before the message."""
    try:
        yield
    except (SettingsError, UnknownFormatError) as error:
        raise click.UsageError(before + as_options(error)) from None


class SourceCommand(Command):
    """A command with sources: help in groups, and options whose numbers may stand apart."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        a_source = click.Path(allow_dash=True)
        named: Any = {"metavar": "SOURCE...", "nargs": -1, "required": True}
        argument = click.Argument(["sources"], type=a_source, callback=_expanded, **named)
        self.params.insert(0, argument)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options in their groups, those first that most users need."""
        records: dict[str, list[tuple[str, str]]] = {group: [] for group in TITLES}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
            if record is not None:
                one = DECLARED.get(str(parameter.name))
                group = "output" if one is None else "" if one.first else one.group
                # all groups in one column
                records[group].append((record[0].ljust(COLUMN), record[1]))
        for group in (group for group in TITLES if records[group]):
            with formatter.section(TITLES[group]):
                formatter.write_dl(records[group], col_max=COLUMN)

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
        return super().parse_args(ctx, joined)


def options(
    *names: str, declared: Mapping[str, Option] = DECLARED, **changes: Any
) -> Callable[[Function], Function]:
    """Declared options of a command, by name or by set, in this order, with changes."""
    every = [one for name in names for one in SETS.get(name, (name,))]

    def add(command: Function) -> Function:
        for name in reversed(every):
            command = _click_option(declared[name], changes)(command)
        return command

    return add


def in_order(declared: Mapping[str, Option]) -> list[str]:
    """The names of options in the order of the help."""
    order = ("output", "sample", "reading", "window", "scan", "fabric")
    return sorted(declared, key=lambda name: order.index(declared[name].group))


def _click_option(option: Option, changes: Mapping[str, Any]) -> Callable[[Function], Function]:
    """An option as click has it; changes are those of its attributes there."""
    is_folder = option.metavar == "DIR"
    a_path = click.Path(dir_okay=is_folder, file_okay=not is_folder, path_type=Path)
    attributes = {
        "type": a_path if option.kind is Path else option.kind,
        "metavar": option.form or METAVARS.get(option.kind),
        "multiple": option.several,
        "help": option.help,
        "shell_complete": partial(_completed, option),
        "callback": _output if option.name == "output" else None,
        **({} if option.default is None else {"default": option.default}),
        **({"is_flag": True} if option.kind is bool else {}),
        **changes,
    }
    words, default = as_options(attributes["help"]), attributes.get("default")
    # a switch has no default to show, which is False, but an option whose default is 0 has one
    if default is not None and default != () and default is not False and "(default: " not in words:
        # 1e10 and 0, where click would write 10000000000.0 and 0.0
        short = f"{default:g}".replace("e+", "e") if isinstance(default, float) else default
        words += f"  [default: {short}]"
    return click.option(option.flag, option.name, **attributes | {"help": words})


def _completed(
    option: Option, ctx: click.Context, parameter: click.Parameter, text: str
) -> list[CompletionItem]:
    """What a shell offers for an option, which may take other words too: some words, and files."""
    words = option.choices() if callable(option.choices) else option.choices
    # of a list the last word
    before = text[: text.rfind(",") + 1] if ",..." in option.form else ""
    named = [before + word for word in words if word not in before.split(",")]
    found = [CompletionItem(word) for word in named if word.startswith(text)]
    takes_files = option.also.startswith(("FILE", "PATH"))
    return [*found, CompletionItem(text, type="file")] if takes_files else found


def _output(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """The file; ``-`` is standard output, which gets CSV wherever it goes."""
    ctx.meta[AS_CSV] = path == Path("-")
    return None if path == Path("-") else path


def take_output(chosen: dict[str, Any], *kinds: str) -> Output:
    """
    Take what is to be written, and where, out of the options of a command.

    A figure that is not of these kinds, or cannot be drawn to its file, is wrong usage.
    """
    from scanfab.viz.figures.page import find_figure
    from scanfab.viz.figures.style import check_plot_file

    asked = Output(**{name: chosen.pop(name) for name in vars(Output()) if name in chosen})
    if asked.plot is None and asked.figure is not None:
        raise click.UsageError("--figure goes with --plot FILE")
    if asked.figure is not None:
        with usage_errors():
            find_figure(asked.figure, *kinds)
    if asked.plot is not None:
        with usage_errors("--plot: "):
            check_plot_file(asked.plot)
    return asked


def excerpt_of(asked: Output, columns: Sequence[Column]) -> Excerpt:
    """Which columns and digits are asked for; wrong usage if they, or a file, cannot be written."""
    from scanfab.table.writing import Excerpt, check_output

    with usage_errors():
        if asked.output is not None:
            check_output(asked.output)
        return Excerpt.make(columns, asked.fields, asked.digits)


def tables_argument(**more: Any) -> Callable[[Function], Function]:
    """The argument of commands that take tables."""
    a_table = click.Path(exists=True, dir_okay=False, **more)
    return click.argument("tables", metavar="TABLE...", nargs=-1, required=True, type=a_table)


def check_labels(labels: tuple[str, ...], tables: tuple[Any, ...]) -> None:
    """A usage error if some tables have a label, and others none."""
    if labels and len(labels) != len(tables):
        raise click.UsageError(f"--label: expected one a table: {len(tables)}, found {len(labels)}")


def _expanded(
    ctx: click.Context, parameter: click.Parameter, sources: tuple[str, ...]
) -> tuple[str, ...]:
    """
    The sources, globs as a shell would have expanded them.

    The settings file beside them becomes the defaults of the command.
    """
    from scanfab.io.families import expanded

    try:
        every = tuple(str(path) for one in sources for path in expanded(one))
    except ReadError as error:
        raise click.UsageError(str(error)) from None
    for path in every:
        if path != "-" and not Path(path).exists():
            raise click.UsageError(f"{path}: there is no such file, folder or glob")
    take_settings_file(ctx, every)
    return every


def checked(chosen: dict[str, Any], kind: type[S]) -> tuple[dict[str, Any], S]:
    """The options of a command as those of reading and as settings; wrong ones are wrong usage."""
    tell_used(click.get_current_context())
    with usage_errors():
        return take_reading(chosen), kind(**chosen)


def open_series(sources: tuple[str, ...], reading: dict[str, Any]) -> list[Series]:
    """The series of a command line; ``-`` is one that comes by standard input."""
    from dataclasses import replace

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
