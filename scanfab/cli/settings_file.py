"""scanfab.toml beside the dumps: options of compute, below those of the command line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

SECTION = "compute"


@dataclass(frozen=True)
class SettingsFile:
    """A settings file, and which of its options a command has taken from it."""

    path: Path | None = None
    """None: there is no file."""
    options: dict[str, Any] = field(default_factory=dict)
    """As they stand in the file."""
    used: tuple[str, ...] = ()
    """The others are named on the command line, or are none of this command's."""

    @contextmanager
    def named_errors(self) -> Iterator[None]:
        """Let errors of options that come from the file name it; all are wrong usage."""
        from scanfab.cli.options import usage_errors

        try:
            with usage_errors():
                yield
        except click.UsageError as error:
            option = error.message.partition(":")[0].removeprefix("--").replace(" ", "-")
            if self.path is None or option not in self.used:
                raise
            # the file has the option without the dashes
            text = error.message.removeprefix("--")
            raise click.UsageError(f"{self.path}: {text}") from None

    def asked(self) -> dict[str, Any]:
        """As a manifest lists it; nothing without a file."""
        if self.path is None:
            return {}
        others = [name for name in self.options if name not in self.used]
        listed = {"path": str(self.path), "used": list(self.used), "not_used": others}
        return {"settings_file": listed}


def fill_from_file(
    ctx: click.Context, sources: tuple[str, ...], options: dict[str, Any]
) -> tuple[dict[str, Any], SettingsFile]:
    """
    The options of a command, those that its line does not name from the settings file.

    A note says which; a file that cannot be right is a usage error in every command.
    """
    from scanfab.base.errors import note

    path = _path_beside(sources)
    if path is None:
        return options, SettingsFile()
    given = read_settings_file(path)
    filled, used = dict(options), []
    parameters = _by_option(ctx.command)
    for key, value in given.items():
        parameter = parameters.get(key)
        if parameter is None or parameter.name not in options:
            continue
        name = str(parameter.name)
        if ctx.get_parameter_source(name) is ParameterSource.DEFAULT:
            filled[name] = _from_toml(ctx, path, parameter, value)
            used.append(key)
    if used:
        note(f"options from {path}: {', '.join(used)}")
    return filled, SettingsFile(path, given, tuple(used))


def _path_beside(sources: tuple[str, ...]) -> Path | None:
    """The settings file beside the dumps; a usage error if the sources have different ones."""
    from scanfab.io.families import SETTINGS_FILE

    folders = {Path(s) if Path(s).is_dir() else Path(s).parent for s in sources if s != "-"}
    found = [folder / SETTINGS_FILE for folder in sorted(folders)]
    found = [path for path in found if path.is_file()]
    if len(found) > 1:
        raise click.UsageError(
            f"the sources have several settings files: {', '.join(map(str, found))}; "
            f"compute them one by one"
        )
    return found[0] if found else None


def read_settings_file(path: Path) -> dict[str, Any]:
    """The options in the one section that there may be, all of them known to compute."""
    import tomllib

    try:
        text = path.read_text("utf-8")
        content = tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise click.UsageError(f"{path}: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise click.UsageError(f"{path}{_explained(text, error)}") from None
    for name, value in content.items():
        if name == SECTION and isinstance(value, dict):
            continue
        if name == SECTION:
            raise click.UsageError(f"{path}: expected a section [{SECTION}]")
        what = f"section [{name}]" if isinstance(value, dict) else f"key {name!r}"
        raise click.UsageError(
            f"{path}: the {what} has no meaning: options stand in the section [{SECTION}]"
        )
    options: dict[str, Any] = content.get(SECTION, {})
    known, of_the_line = _options_of_compute()
    for key in options:
        if key in of_the_line:
            raise click.UsageError(
                f"{path}: {key!r} cannot be set in {path.name}, which says how samples are "
                f"computed: what is read, where results go and what is told stand on the command "
                f"line: {of_the_line[key]}"
            )
        if key not in known:
            near = get_close_matches(key, known, n=1)
            hint = f": did you mean {near[0]!r}?" if near else ""
            raise click.UsageError(f"{path}: compute has no option {key!r}{hint}")
    return options


def _options_of_compute() -> tuple[list[str], dict[str, str]]:
    """The options that a settings file may hold, and the others as a command line has them."""
    from scanfab.cli.compute import OF_THE_LINE, compute

    others = {
        key: parameter.opts[0]
        for parameter in compute.params
        if parameter.name in OF_THE_LINE
        for key in (str(parameter.name), parameter.opts[0].lstrip("-"))
    }
    return [key for key in _by_option(compute) if key not in others], others


def _by_option(command: click.Command) -> dict[str, click.Parameter]:
    return {
        name.removeprefix("--"): parameter
        for parameter in command.params
        for name in parameter.opts
        if name.startswith("--")
    }


def _key(parameter: click.Parameter) -> str:
    """As the file has it."""
    return parameter.opts[0].removeprefix("--")


def _explained(text: str, error: ValueError) -> str:
    """What is wrong with a file that is no TOML: most often text without quotes."""
    found = re.search(r"\(at line (\d+), column \d+\)", str(error))
    if found is None:
        return f": {error}"
    line = text.splitlines()[int(found[1]) - 1]
    bare = re.fullmatch(r"\s*([\w-]+)\s*=\s*([^\s\"'\[{#][^\"'#]*?)\s*(#.*)?", line)
    if bare is None:
        return f", line {found[1]}: {line.strip()}: {error}"
    return f', line {found[1]}: text needs quotes: {bare[1]} = "{bare[2]}"'


def _in_toml(value: Any) -> str:
    """What kind of value it is, as the file spells it where that is short."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    return "a list in a list" if isinstance(value, list) else f"a date or time, {value}"


def _from_toml(ctx: click.Context, path: Path, parameter: click.Parameter, value: Any) -> Any:
    """A value of the settings file as the command line would give it."""
    for one in value if isinstance(value, list) else [value]:
        # a truth value would count as the number 1
        if isinstance(one, bool) or not isinstance(one, str | int | float):
            raise click.UsageError(
                f"{path}: {_key(parameter)}: expected numbers or text in quotes, one or a list of "
                f"them, found {_in_toml(one)}"
            )
    if isinstance(value, list) and not parameter.multiple and parameter.nargs == 1:
        value = " ".join(map(str, value))  # the numbers of a cell
    elif parameter.multiple and not isinstance(value, list):
        value = [value]
    elif not isinstance(value, list):
        value = str(value)
    try:
        return parameter.type_cast_value(ctx, value)
    except click.BadParameter as error:
        raise click.UsageError(f"{path}: {_key(parameter)}: {error.format_message()}") from None
