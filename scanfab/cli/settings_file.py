"""scanfab.toml beside the dumps: options of compute, below those of the command line."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from scanfab.base.option import Option
from scanfab.pipeline.options import OPTIONS

SECTION = "compute"
KEY = "scanfab.settings_file"


def take_settings_file(ctx: click.Context, sources: Iterable[str]) -> None:
    """
    Make the options of the settings file beside the sources defaults of the command.

    A file that cannot be right is a usage error in every command, as are two files.
    """
    from scanfab.io.families import SETTINGS_FILE

    folders = {Path(s) if Path(s).is_dir() else Path(s).parent for s in sources if s != "-"}
    found = [folder / SETTINGS_FILE for folder in sorted(folders)]
    found = [path for path in found if path.is_file()]
    if len(found) > 1:
        raise click.UsageError(
            f"the sources have several settings files: {', '.join(map(str, found))}; "
            f"compute them one by one"
        )
    for path in found:
        given = _read(path)
        options = {key: _option(path, key) for key in given}
        ctx.default_map = {
            one.name: _value(f"{path}: {key}", one, given[key]) for key, one in options.items()
        }
        ctx.meta[KEY] = path, list(given)


def as_listed(ctx: click.Context) -> dict[str, Any]:
    """The file as a manifest lists it: which of its options the command took; empty without one."""
    path, keys = ctx.meta.get(KEY, (None, []))
    taken = {
        one.opts[0].removeprefix("--")
        for one in ctx.command.params
        if ctx.get_parameter_source(str(one.name)) is ParameterSource.DEFAULT_MAP
    }
    used = [key for key in keys if key in taken]
    others = [key for key in keys if key not in taken]
    return {} if path is None else {"path": str(path), "used": used, "not_used": others}


def tell_used(ctx: click.Context) -> None:
    """Say by a note which options the file has given."""
    from scanfab.base.errors import note

    if (file := as_listed(ctx)) and file["used"]:
        note(f"options from {file['path']}: {', '.join(file['used'])}")


def in_file(message: str) -> str:
    """A message about an option, with the settings file in front if the option comes from it."""
    ctx = click.get_current_context(silent=True)
    file = {} if ctx is None else as_listed(ctx)
    is_used = message.partition(":")[0].removeprefix("--") in file.get("used", ())
    return f"{file['path']}: {message.removeprefix('--')}" if is_used else message


def _read(path: Path) -> dict[str, Any]:
    """The options in the one section that there may be."""
    import tomllib

    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise click.UsageError(f"{path}: {error}") from None
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))
        where = f"{path}, line {line[1]}" if line else f"{path}"
        advice = 'text stands in quotes, as in boundary = "type=2"'
        raise click.UsageError(f"{where}: {error}: {advice}") from None
    for name, value in content.items():
        if name != SECTION or not isinstance(value, dict):
            raise click.UsageError(
                f"{path}: {name!r} has no meaning: options stand in the section [{SECTION}]"
            )
    options: dict[str, Any] = content.get(SECTION, {})
    return options


def _option(path: Path, key: str) -> Option:
    """The option of a key: one that says how samples are read and computed."""
    known = {
        one.flag.removeprefix("--"): one
        for one in OPTIONS.values()
        if one.decides or one.name == "workers"
    }
    if key not in known:
        near = get_close_matches(key, known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else "it may say how samples are computed"
        raise click.UsageError(f"{path}: {key!r} cannot be set in a settings file: {hint}")
    return known[key]


def _value(place: str, option: Option, value: Any) -> Any:
    """A value of the settings file as the command line would give it."""
    several = value if isinstance(value, list) else [value]
    for one in several:
        # a truth value would count as the number 1
        if isinstance(one, bool) or not isinstance(one, str | int | float):
            expected = "numbers or text in quotes, one or a list of them"
            raise click.UsageError(f"{place}: expected {expected}, found {one!r}")
    words = [str(one) for one in several]
    return words if option.several else ",".join(words)
