"""scanfab.toml beside the dumps: options of compute, below those of the command line."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

import click
from click.core import ParameterSource

from scanfab.base.option import Option
from scanfab.pipeline.options import OPTIONS

SECTION = "compute"
KEY = "scanfab.settings_file"


class SettingsFile(NamedTuple):
    """A settings file, kept in the context of a command."""

    path: Path
    options: dict[str, Any]
    """As they stand in the file."""

    def used(self, ctx: click.Context) -> list[str]:
        """Options that the command has from the file; its line names the others, or it has none."""
        sources = {
            one.opts[0].removeprefix("--"): ctx.get_parameter_source(str(one.name))
            for one in ctx.command.params
        }
        return [key for key in self.options if sources.get(key) is ParameterSource.DEFAULT_MAP]


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
        known = {
            one.flag.removeprefix("--"): one
            for one in OPTIONS.values()
            if one.decides or one.name == "workers"
        }
        ctx.default_map = {
            known[key].name: _value(path, known[key], value)
            for key, value in given.items()
            if _is_known(path, key, known)
        }
        ctx.meta[KEY] = SettingsFile(path, given)


def tell_used(ctx: click.Context) -> None:
    """Say by a note which options the file has given."""
    from scanfab.base.errors import note

    if used := as_listed(ctx).get("used"):
        note(f"options from {ctx.meta[KEY].path}: {', '.join(used)}")


def as_listed(ctx: click.Context) -> dict[str, Any]:
    """The file as a manifest lists it; empty without a file."""
    if KEY not in ctx.meta:
        return {}
    path, options = ctx.meta[KEY]
    used = ctx.meta[KEY].used(ctx)
    others = [key for key in options if key not in used]
    return {"path": str(path), "used": used, "not_used": others}


def in_file(message: str) -> str:
    """A message about an option, with the settings file in front if the option comes from it."""
    ctx = click.get_current_context(silent=True)
    file: SettingsFile | None = None if ctx is None else ctx.meta.get(KEY)
    key = message.partition(":")[0].removeprefix("--")
    if ctx is None or file is None or key not in file.used(ctx):
        return message
    return f"{file.path}: {message.removeprefix('--')}"


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
        raise click.UsageError(
            f'{where}: {error}: text stands in quotes, as in boundary = "type=2"'
        ) from None
    for name, value in content.items():
        if name != SECTION or not isinstance(value, dict):
            raise click.UsageError(
                f"{path}: {name!r} has no meaning: options stand in the section [{SECTION}]"
            )
    options: dict[str, Any] = content.get(SECTION, {})
    return options


def _is_known(path: Path, key: str, known: Iterable[str]) -> bool:
    if key in known:
        return True
    near = get_close_matches(key, known, n=1)
    hint = f"did you mean {near[0]!r}?" if near else "it may say how samples are computed"
    raise click.UsageError(f"{path}: {key!r} cannot be set in a settings file: {hint}")


def _value(path: Path, option: Option, value: Any) -> Any:
    """A value of the settings file as the command line would give it."""
    several = value if isinstance(value, list) else [value]
    for one in several:
        # a truth value would count as the number 1
        if isinstance(one, bool) or not isinstance(one, str | int | float):
            raise click.UsageError(
                f"{path}: {option.flag.removeprefix('--')}: expected numbers or text in quotes, "
                f"one or a list of them, found {one!r}"
            )
    words = [str(one) for one in several]
    return words if option.several else ",".join(words)
