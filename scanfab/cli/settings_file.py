"""scanfab.toml beside the dumps sets options of compute; the command line overrides them."""

from __future__ import annotations

from collections.abc import Iterable
from glob import glob
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from scanfab.base.errors import SettingsError
from scanfab.base.spelling import meant
from scanfab.pipeline.options import OPTIONS

SECTION = "compute"
META = "scanfab.settings_file"
KEYS = {
    option.flag.removeprefix("--"): option
    for option in OPTIONS.values()
    if option.decides or option.name == "workers"
}
"""The options that the file may hold: those that say how samples are read and computed."""


def take_settings_file(ctx: click.Context, sources: Iterable[str]) -> None:
    """
    Use the options of the settings file beside the sources as defaults of the command.

    A file with an error is a usage error in every command, and so are two settings files.
    """
    from scanfab.io.families import SETTINGS_FILE

    folders = {Path(s) if Path(s).is_dir() else Path(s).parent for s in sources if s != "-"}
    files = [folder / SETTINGS_FILE for folder in sorted(folders)]
    files = [path for path in files if path.is_file()]
    if len(files) > 1:
        raise click.UsageError(
            f"the sources have several settings files: {', '.join(map(str, files))}; "
            f"compute them one by one"
        )
    for path in files:
        given = _read(path)
        try:
            typed = {KEYS[key].name: _as_typed(key, given[key], path.parent) for key in given}
        except SettingsError as error:
            raise click.UsageError(f"{path}: {error}") from None
        ctx.default_map, ctx.meta[META] = typed, (path, list(given))


def as_listed(ctx: click.Context) -> dict[str, Any]:
    """The settings file as manifests list it, with the options that were used; empty if none."""
    if META not in ctx.meta:
        return {}
    path, keys = ctx.meta[META]
    taken = ParameterSource.DEFAULT_MAP
    used = [key for key in keys if ctx.get_parameter_source(KEYS[key].name) is taken]
    return {"path": str(path), "used": used, "not_used": [key for key in keys if key not in used]}


def _read(path: Path) -> dict[str, Any]:
    """Read the options of the section [compute]; any other section or option is a usage error."""
    import tomllib

    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except RecursionError:
        raise click.UsageError(f"{path}: its lists are nested too deeply") from None
    except ValueError as error:
        advice = 'text needs quotes, as in boundary = "type=2"'
        raise click.UsageError(f"{path}: {error}: {advice}") from None
    for name, value in content.items():
        if name != SECTION or not isinstance(value, dict):
            raise click.UsageError(
                f"{path}: {name!r} is not known: put options into the section [{SECTION}]"
            )
    options: dict[str, Any] = content.get(SECTION, {})
    for key in (key for key in options if key not in KEYS):
        hint = meant(key, KEYS, "option")
        raise click.UsageError(f"{path}: {key!r} cannot be set in a settings file: {hint}")
    return options


def _as_typed(key: str, value: Any, folder: Path) -> Any:
    """
    A value of the settings file as users would type it; SettingsError if it is not valid.

    Files that an option names are looked for in the folder of the settings file first.
    """
    option, several = KEYS[key], value if isinstance(value, list) else [value]
    words = [str(item) for item in several]
    file = words[0] if option.takes_file and len(words) == 1 else ""
    if file not in option.form.split("|") and glob(file, root_dir=folder):
        words = [str(folder / file)]
    typed = words if option.several else ",".join(words)
    option.parse(key, typed)
    return typed
