"""From a manifest back to what was asked for: the command that repeats it, and its source."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping
from typing import Any

from scanfab.base.errors import ReadError
from scanfab.base.option import flag_of
from scanfab.base.spelling import shortest
from scanfab.io.options import READING_OPTIONS
from scanfab.io.series import Series
from scanfab.io.sources import READING, open_sources
from scanfab.pipeline.maps.settings import BLOCK_OPTIONS, MapSettings, is_map
from scanfab.pipeline.record import asked_for
from scanfab.pipeline.settings import Settings

# options that take their numbers one by one
APART = ("rv_center", "rv_size", "cell")


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
    kind = MapSettings(slices=1) if is_map(asked) else Settings()
    # those that make it a map have no usual value
    usual = {
        **{one.name: one.default for one in READING_OPTIONS},
        **asked_for((), {}, kind),
        **dict.fromkeys(BLOCK_OPTIONS),
    }
    words = ["scanfab", "map" if is_map(asked) else "compute", *map(str, asked["sources"])]
    for name, value in given_settings(asked).items():
        if usual.get(name) != value or flag_of(name)[2:] in named:
            words += _words(flag_of(name), name, value)
    if output is not None:
        words += ["-o", output]
    return shlex.join(words)


def given_settings(asked: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a manifest that say something, as users write them."""
    says_nothing: tuple[Any, ...] = (None, [], {})
    return {
        name: value
        for name, value in asked.items()
        if name not in ("scanfab", "sources") and value not in says_nothing
    }


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
    given = given_settings(asked)
    return open_sources(sources, **{name: given[name] for name in READING if name in given})[0]


def _words(flag: str, name: str, value: Any) -> list[str]:
    """An option as words of a command line."""
    if isinstance(value, bool):
        return [flag] * value
    if isinstance(value, dict):
        value = [f"{key}={column}" for key, column in value.items()]
    if isinstance(value, list):
        parts = [shortest(one) if isinstance(one, float) else str(one) for one in value]
        if name == "boundary":
            return [word for rule in parts for word in (flag, rule)]
        if name in APART:
            return [flag, *parts]
        value = ",".join(parts)
    text = shortest(value) if isinstance(value, float) else str(value)
    # a value that starts with a dash would be taken for an option
    return [f"{flag}={text}"] if text.startswith("-") else [flag, text]
