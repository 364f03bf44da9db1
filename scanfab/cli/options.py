"""Options of commands, made of their declarations, and how a wrong value is told."""

from __future__ import annotations

import glob
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from scanfab.base.option import GROUPS, Option
from scanfab.pipeline.options import DECLARED, as_options

Command = Callable[..., Any]
Completion = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]

READING = (
    "format", "columns", "contact_columns", "skip", "radius", "cell", "periodic", "bodies",
    "max_unpacked", "contacts", "dim",
)  # fmt: skip
SAMPLE = ("boundary", "min_contacts", "rattlers", "min_force", "contact_tolerance")
WINDOW = ("rv", "rv_radius", "rv_center", "rv_shape", "rv_size", "rv_axis", "rv_follows")
EXCERPT = ("fields", "digits")
# the cut-off of commands that take tables
OF_SEVERAL = {
    "type": float,
    "default": None,
    "metavar": "C",
    "help": "Take the rows of this cut-off from tables of several; in the tables' unit.",
}

TITLES = {"": "What most need", **{group: group.capitalize() for group in GROUPS}}

# letters for an option and what it takes; what is longer has a line of its own
COLUMN = 22
# of the context: -o - asks for CSV on standard output, on a terminal too
AS_CSV = "scanfab.as_csv"


@contextmanager
def usage_errors(before: str = "") -> Iterator[None]:
    """Settings that cannot be are wrong usage; ``before`` stands before the message."""
    from scanfab.base.errors import SettingsError, UnknownFormatError

    try:
        yield
    except (SettingsError, UnknownFormatError) as error:
        raise click.UsageError(f"{before}{as_options(error)}") from None


def completed(option: Option) -> Completion:
    """
    What a shell offers for an option: some words, and files.

    The option takes other words too, or complains of them in words of its own.
    """

    def complete(ctx: click.Context, parameter: click.Parameter, text: str) -> list[CompletionItem]:
        found = [CompletionItem(word) for word in option.choices() if word.startswith(text)]
        return [*found, CompletionItem(text, type="file")] if option.files else found

    return complete


class GroupedOption(click.Option):
    """An option that stands in a group of the help, or among the few that most need."""

    def __init__(self, *args: Any, group: str = "output", **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.group = group

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """As click has it, with numbers as they are written: 1e10 and 0, not 10000000000.0."""
        record = super().get_help_record(ctx)
        if record is None or not isinstance(self.default, float):
            return record
        short = f"{self.default:g}".replace("e+", "e")
        return record[0], record[1].replace(f"[default: {self.default}]", f"[default: {short}]")


def write_groups(
    command: click.Command, ctx: click.Context, formatter: click.HelpFormatter
) -> None:
    """The options of a command in their groups, those first that most need."""
    found: dict[str, list[tuple[str, str]]] = {group: [] for group in TITLES}
    for parameter in command.get_params(ctx):
        record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
        if record is not None:
            # all groups in one column
            name = record[0].ljust(COLUMN)
            found[getattr(parameter, "group", "output")].append((name, record[1]))
    for group, records in found.items():
        if records:
            with formatter.section(TITLES[group]):
                formatter.write_dl(records, col_max=COLUMN)


def _output(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """The file; ``-`` is standard output, which gets CSV wherever it goes."""
    if path == Path("-"):
        ctx.meta[AS_CSV] = True
        return None
    return path


def _complete_fields(
    ctx: click.Context, parameter: click.Parameter, text: str
) -> list[CompletionItem]:
    """The columns of what a command writes, behind those that are named already."""
    from scanfab.base.column import columns_of_fields
    from scanfab.pipeline.calibration import StepRow
    from scanfab.table.columns import MORE_COLUMNS, map_columns, table_columns
    from scanfab.table.compare import FRAMES, SUMMARY

    columns = {
        "calibrate": columns_of_fields(StepRow),
        "compare": SUMMARY if ctx.params.get("summary") else FRAMES,
        "map": map_columns(("edge",), shells=True),
    }.get(str(ctx.command.name), (*table_columns(), *MORE_COLUMNS))
    before, comma, last = text.rpartition(",")
    names = [one.name for one in columns if one.name not in before.split(",")]
    return [CompletionItem(before + comma + name) for name in names if name.startswith(last)]


a_file = partial(click.Path, dir_okay=False, path_type=Path)
# what only the command line knows of an option
MORE: dict[str, dict[str, Any]] = {
    "fields": {"shell_complete": _complete_fields},
    "output": {"type": a_file(allow_dash=True), "callback": _output},
    "vtk": {"type": click.Path(file_okay=False, path_type=Path)},
}


def click_option(option: Option, **changes: Any) -> Callable[[Command], Command]:
    """An option of a command, as it is declared but for some changes."""
    attributes: dict[str, Any] = {
        "cls": GroupedOption,
        "group": "" if option.first else option.group,
        "type": a_file() if option.kind is Path else option.kind,
        "default": option.default,
        "metavar": option.metavar,
        "multiple": option.several,
        "nargs": option.words,
        "help": option.help,
        "shell_complete": completed(option),
    }
    if option.kind is bool:
        attributes |= {"is_flag": True, "metavar": None}
    attributes |= {**MORE.get(option.name, {}), **changes}
    attributes["help"] = as_options(attributes["help"])
    default = attributes["default"]
    shown = default is not None and default is not False and default != ()
    shown = shown and "(default: " not in attributes["help"]
    return click.option(option.flag, option.name, show_default=shown, **attributes)


def options(*chosen: str | Option, **changes: Any) -> Callable[[Command], Command]:
    """Declared options of a command, by name or themselves, in this order."""

    def add(command: Command) -> Command:
        for one in reversed(chosen):
            declared = DECLARED[one] if isinstance(one, str) else one
            command = click_option(declared, **changes)(command)
        return command

    return add


def _expanded(source: str) -> list[Any]:
    """What a glob names; one that names nothing is a path that does not exist."""
    from scanfab.base.errors import ReadError
    from scanfab.io.families import expanded

    try:
        return [*expanded(source)]
    except ReadError:
        return [source]


class SourceType(click.Path):
    """A path that exists, or a glob in quotes that names some; it stays as it is."""

    def __init__(self) -> None:
        super().__init__(exists=True, allow_dash=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse what does not exist."""
        is_glob = not Path(value).exists() and glob.has_magic(value)
        if self.exists and is_glob and not glob.glob(value):
            self.fail(f"{value!r} matches nothing: there is no file or folder of such a name.")
        for one in _expanded(value):
            super().convert(one, param, ctx)
        return value


def _expand(ctx: click.Context, param: click.Parameter, sources: tuple[str, ...]) -> Any:
    """What the shell would have made of globs that it was not asked to expand."""
    return tuple(one for source in sources for one in _expanded(source))


sources_argument = click.argument(
    "sources", metavar="SOURCE...", nargs=-1, required=True, type=SourceType(), callback=_expand
)


def check_plot(plot: Path | None, figure: str | None, *kinds: str) -> None:
    """A usage error if no such figure of these kinds can be drawn to such a file."""
    from scanfab.viz.figures.page import find_figure
    from scanfab.viz.figures.style import check_plot_file

    if plot is None:
        if figure is not None:
            raise click.UsageError("--figure goes with --plot FILE")
        return
    with usage_errors():
        if figure is not None:
            find_figure(figure, *kinds)
    with usage_errors("--plot: "):
        check_plot_file(plot)
