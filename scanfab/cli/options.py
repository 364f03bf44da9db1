"""Options and sources of the command line, made from the declarations in the library."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.shell_completion import CompletionItem

from scanfab.base.errors import ReadError, SettingsError, UnknownFormatError, note
from scanfab.base.files import kind_of
from scanfab.base.option import GROUPS, Option
from scanfab.cli.console import AS_CSV, Command
from scanfab.cli.settings_file import as_listed, take_settings_file
from scanfab.io.reader import READING, ReadOptions
from scanfab.pipeline.options import DECLARED, OPTIONS, Output, as_options
from scanfab.pipeline.settings import Settings

if TYPE_CHECKING:
    from scanfab.base.column import Column
    from scanfab.io.series import Series
    from scanfab.table.writing import Excerpt

Function = Callable[..., Any]
S = TypeVar("S", bound=Settings)

# groups of options that several commands share
SETS: dict[str, Sequence[str]] = {
    "READING": READING,
    "SAMPLE": ("boundary", "min_contacts", "rattlers", "min_force", "contact_tolerance"),
    "WINDOW": ["reference", *(name for name in OPTIONS if name.startswith("rv"))],
    "EXCERPT": ("fields", "digits"),
}
# --cutoff of commands that take tables
OF_SEVERAL: dict[str, Any] = {
    "type": float,
    "default": None,
    "metavar": "C",
    "help": "If a table has several cut-offs, use the rows of this one (in the table's unit).",
}
METAVARS: dict[type, str] = {int: "N", float: "X", Path: "FILE"}
# how many numbers, separated by blanks, may follow these options
COUNTS = {"--cell": (3, 6), "--rv-center": (3,), "--rv-size": (2, 3)}
TITLES = {"": "Most used options", **{group: group.capitalize() for group in GROUPS}}
# width of the first column of the help; an option that is wider gets a line of its own
COLUMN = 22
NUMBER = re.compile(r"[-+]?[\d.]+([eE][-+]?\d+)?")


@contextmanager
def usage_errors() -> Iterator[None]:
    """Turn errors of settings into usage errors."""
    try:
        yield
    except (SettingsError, UnknownFormatError) as error:
        raise click.UsageError(as_options(error)) from None


class SourceCommand(Command):
    """A command that takes sources; its help has groups, and some options take several numbers."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        a_source = click.Path(allow_dash=True)
        named: Any = {"metavar": "SOURCE...", "nargs": -1, "required": True}
        argument = click.Argument(["sources"], type=a_source, callback=_expanded, **named)
        self.params.insert(0, argument)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options in their groups; the most used options come first."""
        records: dict[str, list[tuple[str, str]]] = {group: [] for group in TITLES}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
            if record is not None:
                option = DECLARED.get(str(parameter.name), Option("", str, ""))
                # pad, so that the texts of all groups are aligned
                padded = record[0].ljust(COLUMN), record[1]
                records["" if option.first else option.group].append(padded)
        for group in (group for group in TITLES if records[group]):
            with formatter.section(TITLES[group]):
                formatter.write_dl(records[group], col_max=COLUMN)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Join the numbers that follow an option into one word: click allows no variable count."""
        args = list(args)
        for first in range(len(args), 0, -1):
            counts = COUNTS.get(args[first - 1], ())
            found = len(list(takewhile(NUMBER.fullmatch, args[first:]))) if counts else 0
            if count := max((known for known in counts if known <= found), default=found):
                args[first : first + count] = [" ".join(args[first : first + count])]
        return super().parse_args(ctx, args)


def options(
    *names: str, declared: Mapping[str, Option] = DECLARED, **changes: Any
) -> Callable[[Function], Function]:
    """Add declared options to a command, by name or by set, in this order, with changes."""
    listed = [option_name for name in names for option_name in SETS.get(name, (name,))]

    def add(command: Function) -> Function:
        for name in reversed(listed):
            command = _click_option(declared[name], changes)(command)
        return command

    return add


def _click_option(option: Option, changes: Mapping[str, Any]) -> Callable[[Function], Function]:
    """The click option for a declared option; ``changes`` replaces its attributes."""
    is_folder = option.form == "DIR"
    a_path = click.Path(dir_okay=is_folder, file_okay=not is_folder, path_type=Path)
    attributes = {
        "type": a_path if option.kind is Path else option.kind,
        "metavar": option.form or METAVARS.get(option.kind),
        **({} if option.default is None else {"default": option.default}),
        "is_flag": option.kind is bool or None,
        "multiple": option.several,
        "help": option.help,
        "shell_complete": partial(_completed, option),
        "callback": _output if option.name == "output" else None,
        **changes,
    }
    words = as_options(attributes["help"])
    attributes |= {"help": words, "show_default": "(default: " not in words}
    return click.option(option.flag, option.name, **attributes)


def _completed(
    option: Option, ctx: click.Context, parameter: click.Parameter, text: str
) -> list[CompletionItem]:
    """The completions that a shell offers for an option: its words, and files if it takes any."""
    words = [word for word in option.form.split("|") if word.islower() or word.isdigit()]
    words += option.words() if callable(option.words) else option.words
    # in a list separated by commas, only the last word is completed
    before = text[: text.rfind(",") + 1] if ",..." in option.form else ""
    named = [before + word for word in words if word not in before.split(",")]
    items = [CompletionItem(word) for word in named if word.startswith(text)]
    # files come first: bash forgets the words that it got before them
    return [CompletionItem(text, type="file"), *items] if option.takes_file else items


def _output(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """The output file; ``-`` means CSV on standard output, even on a terminal."""
    ctx.meta[AS_CSV] = path == Path("-")
    if path is not None and kind_of(path) == "a device":
        # a terminal or /dev/null takes what standard output would
        ctx.with_resource(redirect_stdout(ctx.with_resource(open(path, "w"))))  # noqa: SIM115
        ctx.meta[AS_CSV] = True
    return None if ctx.meta[AS_CSV] else path


def take_output(chosen: dict[str, Any], *kinds: str) -> Output:
    """
    Remove the options of output from ``chosen`` and return them.

    It is a usage error if the figure is not of one of these kinds, or its file has a wrong format.
    """
    from scanfab.viz.figures.figure import find_figure
    from scanfab.viz.figures.style import check_plot_file

    outputs = Output(**{name: chosen.pop(name) for name in vars(Output()) if name in chosen})
    if outputs.plot is None and outputs.figure is not None:
        raise click.UsageError("--figure goes with --plot FILE")
    with usage_errors():
        if outputs.figure is not None:
            find_figure(outputs.figure, *kinds)
        if outputs.plot is not None:
            check_plot_file(outputs.plot)
    return outputs


def excerpt_of(outputs: Output, columns: Sequence[Column]) -> Excerpt:
    """The chosen columns and digits; a usage error if they or the file cannot be written."""
    from scanfab.table.writing import Excerpt, check_output

    with usage_errors():
        if outputs.output is not None:
            check_output(outputs.output)
        return Excerpt.make(columns, outputs.fields, outputs.digits)


def tables_argument(**more: Any) -> Callable[[Function], Function]:
    """The argument TABLE... of commands that take tables."""
    a_table = click.Path(exists=True, dir_okay=False, **more)
    return click.argument("tables", metavar="TABLE...", nargs=-1, required=True, type=a_table)


def _expanded(
    ctx: click.Context, parameter: click.Parameter, sources: tuple[str, ...]
) -> tuple[str, ...]:
    """
    The sources, with globs expanded as a shell would.

    The settings file beside the sources sets the defaults of the command.
    """
    from scanfab.io.families import expanded

    try:
        paths = tuple(str(path) for source in sources for path in expanded(source))
    except ReadError as error:
        raise click.UsageError(str(error)) from None
    for path in paths:
        if path != "-" and not Path(path).exists():
            raise click.UsageError(f"{path}: there is no such file, folder or glob")
    take_settings_file(ctx, paths)
    return paths


def checked(chosen: dict[str, Any], kind: type[S]) -> tuple[dict[str, Any], S]:
    """
    The options of reading, taken out of ``chosen``, and the settings that the others are.

    Wrong values are usage errors. A note names the options that the settings file has set.
    """
    file = as_listed(click.get_current_context())
    if file and file["used"]:
        note(f"options from {file['path']}: {', '.join(file['used'])}")
    reading = {name: chosen.pop(name) for name in READING}
    with usage_errors():
        ReadOptions(**reading)
        return reading, kind(**chosen)


def open_series(sources: tuple[str, ...], reading: dict[str, Any]) -> list[Series]:
    """Open the series that the sources name; ``-`` is a series from standard input."""
    from dataclasses import replace

    from scanfab.io.files import PART, temporary_copy
    from scanfab.io.sources import open_sources, read_series

    if "-" not in sources:
        return open_sources(sources, **reading)
    if reading["format"] is None:
        raise click.UsageError("standard input needs --format NAME")
    if len(sources) > 1:
        raise click.UsageError("standard input cannot be combined with other sources: name only -")
    copy = temporary_copy(iter(partial(sys.stdin.buffer.read, PART), b""), "standard input")
    if copy.stat().st_size == 0:
        raise ReadError("standard input: expected a dump, found nothing")
    return [replace(read_series(copy, **reading), name="-", sources=("-",))]


def open_one(sources: tuple[str, ...], reading: dict[str, Any], done: str) -> Series:
    """Open the series of a command that takes only one."""
    all_series = open_series(sources, reading)
    if len(all_series) > 1:
        names = ", ".join(series.name for series in all_series)
        raise click.UsageError(f"only one series can be {done} at a time, found {names}")
    return all_series[0]
