"""scanfab.toml beside the dumps: options of compute, below those of the command line."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from scanfab.base.errors import SettingsError, note
from scanfab.base.option import unusable
from scanfab.pipeline.options import OPTIONS

SECTION = "compute"
META = "scanfab.settings_file"
KEYS = {
    one.flag.removeprefix("--"): one
    for one in OPTIONS.values()
    if one.decides or one.name == "workers"
}
"""What the file may hold: the options that say how samples are read and computed."""


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
        try:
            ctx.default_map = {KEYS[key].name: _as_typed(key, one) for key, one in given.items()}
        except SettingsError as error:
            raise click.UsageError(f"{path}: {error}") from None
        ctx.meta[META] = path, list(given)


def as_listed(ctx: click.Context) -> dict[str, Any]:
    """The file as a manifest lists it: which of its options the command took; empty without one."""
    if META not in ctx.meta:
        return {}
    path, keys = ctx.meta[META]
    taken = ParameterSource.DEFAULT_MAP
    used = [key for key in keys if ctx.get_parameter_source(KEYS[key].name) is taken]
    return {"path": str(path), "used": used, "not_used": [key for key in keys if key not in used]}


def tell_used(ctx: click.Context) -> None:
    """Say by a note which options the file has given."""
    if (file := as_listed(ctx)) and file["used"]:
        note(f"options from {file['path']}: {', '.join(file['used'])}")


def _read(path: Path) -> dict[str, Any]:
    """The options in the one section that there may be, each of them a known one."""
    import tomllib

    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except ValueError as error:
        advice = 'text stands in quotes, as in boundary = "type=2"'
        raise click.UsageError(f"{path}: {error}: {advice}") from None
    for name, value in content.items():
        if name != SECTION or not isinstance(value, dict):
            raise click.UsageError(
                f"{path}: {name!r} has no meaning: options stand in the section [{SECTION}]"
            )
    options: dict[str, Any] = content.get(SECTION, {})
    for key in (key for key in options if key not in KEYS):
        near = get_close_matches(key, KEYS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else "it may say how samples are computed"
        raise click.UsageError(f"{path}: {key!r} cannot be set in a settings file: {hint}")
    return options


def _as_typed(key: str, value: Any) -> Any:
    """A value of the settings file as users would type it, if the option can have it."""
    option, several = KEYS[key], value if isinstance(value, list) else [value]
    for one in several:
        # a truth value would count as the number 1
        if isinstance(one, bool) or not isinstance(one, str | int | float):
            raise unusable(key, "numbers or text in quotes, one or a list of them", one)
    words = [str(one) for one in several]
    typed = words if option.several else ",".join(words)
    option.parse(key, typed)
    return typed
