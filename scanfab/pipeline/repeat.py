"""From a manifest back to what was asked for: the command that repeats it, and its source."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, SettingsError
from scanfab.base.option import flag_of
from scanfab.base.spelling import shortest
from scanfab.io.options import READING_OPTIONS
from scanfab.io.series import Series
from scanfab.io.sources import READING, open_sources
from scanfab.pipeline.maps.settings import BLOCK_OPTIONS, MapSettings, is_map
from scanfab.pipeline.record import asked_for
from scanfab.pipeline.settings import Settings


def repeat_command(
    asked: Mapping[str, Any], output: str | None = None, named: Collection[str] = ()
) -> str:
    """
    The command line that repeats a computation, quoted for a shell.

    Parameters
    ----------
    asked : mapping
        The ``settings`` of a manifest.
    output : str, optional
        The table.
    named : collection of str, optional
        Options to name even with their usual value: those for which a settings file beside the
        dumps has another.

    Examples
    --------
    >>> from scanfab.pipeline.record import asked_for
    >>> from scanfab.pipeline.repeat import repeat_command
    >>> from scanfab.pipeline.settings import Settings
    >>> repeat_command(asked_for(["dumps"], {}, Settings(boundary="type=2", seed=3)))
    'scanfab compute dumps --boundary type=2 --seed 3'
    """
    settings = MapSettings(slices=1) if is_map(asked) else Settings()
    reading = {one.name: one.default for one in READING_OPTIONS}
    usual = spelt_settings(asked_for((), reading, settings))
    # those that make it a map have no usual value
    usual |= dict.fromkeys(BLOCK_OPTIONS)
    words = ["scanfab", "map" if is_map(asked) else "compute", *map(str, asked["sources"])]
    for name, value in spelt_settings(asked).items():
        option = flag_of(name)
        if usual.get(name) != value or option[2:] in named:
            words += _words(option, name, value)
    if output is not None:
        words += ["-o", output]
    return shlex.join(words)


def reopen(asked: Mapping[str, Any]) -> Series:
    """
    The first series that a manifest names.

    Raises
    ------
    ReadError
        If it cannot be read again.
    """
    sources = [str(source) for source in asked["sources"]]
    if "-" in sources:
        raise ReadError("the frames came by standard input, which cannot be read again")
    missing = [source for source in sources if not Path(source).exists()]
    if missing:
        raise ReadError(f"the source {missing[0]} is not there any more")
    spelt = spelt_settings(asked)
    return open_sources(sources, **{name: spelt[name] for name in READING if name in spelt})[0]


def restored_settings(asked: Mapping[str, Any]) -> Settings:
    """
    The settings of a manifest.

    Raises
    ------
    SettingsError
        If one of them cannot be used any more.
    """
    kind = MapSettings if is_map(asked) else Settings
    known = kind.__dataclass_fields__
    spelt = {name: value for name, value in spelt_settings(asked).items() if name in known}
    try:
        return kind(**spelt)
    except (AttributeError, TypeError, ValueError) as error:
        raise SettingsError(f"the settings of the manifest cannot be used: {error}") from None


def spelt_settings(asked: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a manifest that are not empty, as users write them."""
    spelt = {}
    for name, value in asked.items():
        if name not in ("scanfab", "sources") and value is not None and value != []:
            try:
                spelt[name] = _spell(name, value)
            except (KeyError, IndexError, TypeError, ValueError):
                raise ReadError(
                    f"the manifest's setting {name!r} cannot be understood: {value!r}"
                ) from None
    return spelt


def _spell(name: str, value: Any) -> Any:
    if name == "frames" and isinstance(value, list):
        parts = value[:2] if value[2] is None else value
        return ":".join("" if part is None else str(part) for part in parts)
    if name == "columns" and not isinstance(value, dict):
        raise TypeError
    if name == "axis" and isinstance(value, list):
        return ",".join(map(shortest, value))
    if name in ("rv", "grid") and isinstance(value, list):
        return ",".join(map(shortest, value))
    if name == "cutoffs" and isinstance(value, list):
        return ",".join(_length(one) for one in value)
    if isinstance(value, dict) and {"value", "unit"} <= set(value):
        return _length(value)
    if name == "boundary":
        return tuple(str(rule["text"]) for rule in value)
    if isinstance(value, list):
        return tuple(value)
    return value


def _length(value: Mapping[str, Any]) -> str:
    return f"{shortest(value['value'])}{value['unit']}"


def _words(option: str, name: str, value: Any) -> list[str]:
    """An option as words of a command line."""
    if name == "fields":
        return [option, ",".join(value)]
    if name == "columns":
        return [option, ",".join(f"{key}={column}" for key, column in value.items())]
    if isinstance(value, bool):
        return [option] if value else []
    if name == "with_":
        return [option, ",".join(value)]
    if name == "boundary":
        return [word for rule in value for word in (option, rule)]
    if isinstance(value, tuple):
        return [option, *map(shortest, value)]
    # a value that starts with a dash would be taken for an option
    text = shortest(value) if isinstance(value, float) else str(value)
    return [f"{option}={text}"] if text.startswith("-") else [option, text]
