"""Options of commands, made of their declarations, and how a wrong value is told."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from scanfab.base.option import GROUPS, Option
from scanfab.cli.settings_file import in_file
from scanfab.io.options import READING_OPTIONS
from scanfab.pipeline.options import DECLARED, as_options

Command = Callable[..., Any]

READING = READING_OPTIONS
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
METAVARS: dict[type, str] = {int: "N", float: "X", Path: "FILE"}
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
        raise click.UsageError(in_file(before + as_options(error))) from None


def write_groups(
    command: click.Command, ctx: click.Context, formatter: click.HelpFormatter
) -> None:
    """The options of a command in their groups, those first that most need."""
    found: dict[str, list[tuple[str, str]]] = {group: [] for group in TITLES}
    for parameter in command.get_params(ctx):
        record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
        if record is not None:
            one = DECLARED.get(str(parameter.name))
            group = "output" if one is None else "" if one.first else one.group
            # all groups in one column
            found[group].append((record[0].ljust(COLUMN), record[1]))
    for group, records in found.items():
        if records:
            with formatter.section(TITLES[group]):
                formatter.write_dl(records, col_max=COLUMN)


def options(
    *chosen: str | Option, **changes: Any
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Declared options of a command, by name or themselves and in this order, with changes."""

    def add(command: Command) -> Command:
        for one in reversed(chosen):
            declared = DECLARED[one] if isinstance(one, str) else one
            command = _click_option(declared, **changes)(command)
        return command

    return add


def in_order(declared: Mapping[str, Option]) -> list[Option]:
    """The options of a table, in the order of the help."""
    order = ("output", "sample", "reading", "window", "scan", "fabric")
    return sorted(declared.values(), key=lambda one: order.index(one.group))


def _click_option(option: Option, **changes: Any) -> Callable[..., Any]:
    is_folder = option.metavar == "DIR"
    a_path = click.Path(dir_okay=is_folder, file_okay=not is_folder, path_type=Path)
    attributes: dict[str, Any] = {
        "type": a_path if option.kind is Path else option.kind,
        **({} if option.default is None else {"default": option.default}),
        "metavar": option.metavar or METAVARS.get(option.kind),
        "multiple": option.several,
        **({"is_flag": True} if option.kind is bool else {}),
        "help": option.help,
        "shell_complete": partial(_completed, option),
        "callback": _output if option.name == "output" else None,
    }
    attributes |= changes
    words, default = as_options(attributes["help"]), attributes.get("default")
    is_shown = default not in (None, ()) and default is not False
    if is_shown and "(default: " not in words:
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
    before = text[: text.rfind(",") + 1] if ",..." in (option.metavar or "") else ""
    named = [before + word for word in words if word not in before.split(",")]
    found = [CompletionItem(word) for word in named if word.startswith(text)]
    return [*found, CompletionItem(text, type="file")] if option.files else found


def _output(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """The file; ``-`` is standard output, which gets CSV wherever it goes."""
    ctx.meta[AS_CSV] = path == Path("-")
    return None if path == Path("-") else path


def check_labels(labels: tuple[str, ...], tables: tuple[Any, ...]) -> None:
    """A usage error if some tables have a label, and others none."""
    if labels and len(labels) != len(tables):
        raise click.UsageError(f"--label: expected one a table: {len(tables)}, found {len(labels)}")


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
