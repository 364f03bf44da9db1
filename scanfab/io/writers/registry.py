"""The writers that are installed, found through entry points."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from scanfab.base.errors import UnknownFormatError
from scanfab.base.plugins import Offer, having, load_offers
from scanfab.io.registry import lacking
from scanfab.io.writer import Writer

GROUP = "scanfab.writers"


@cache
def installed_writers() -> dict[str, Offer]:
    """All writers by name, with the package of each."""
    return load_writers(entry_points(group=GROUP))


def load_writers(points: Iterable[EntryPoint]) -> dict[str, Offer]:
    """Load entry points; see :func:`installed_writers`."""
    make = having(
        "a class of objects with the members of scanfab.io.writer.Writer",
        **dict.fromkeys(("name", "description"), str),
        extensions=tuple,
        write=Callable,
    )
    return load_offers(points, "writer", lambda writer: make(writer()))


def writer_named(name: str) -> Writer:
    """The writer that a user names; UnknownFormatError lists those that exist."""
    writers = installed_writers()
    if name not in writers:
        raise UnknownFormatError(
            f"there is no writer called {name!r}; the writers are {', '.join(writers)}"
        )
    writer: Writer = writers[name].plugin
    advice = lacking(writer)
    if advice is not None:
        raise UnknownFormatError(f"{name} needs another package: {advice}")
    return writer


def writer_for(path: Path) -> Writer:
    """The writer of a suffix; UnknownFormatError lists those that exist."""
    for name, one in installed_writers().items():
        if path.name.lower().endswith(one.plugin.extensions):
            return writer_named(name)
    known = (ending for one in installed_writers().values() for ending in one.plugin.extensions)
    raise UnknownFormatError(
        f"{path}: no format has this suffix: expected one of {' '.join(dict.fromkeys(known))}, or "
        f"its name as `to`"
    )
