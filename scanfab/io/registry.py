"""Readers and writers that are installed, found through entry points; knows no format itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path

from scanfab.base.errors import ReadError, UnknownFormatError
from scanfab.base.plugins import Offer, having, load_offers
from scanfab.io.files import bare_name
from scanfab.io.reader import Reader
from scanfab.io.writer import Writer

__all__ = [
    "installed_readers",
    "installed_writers",
    "lacking",
    "reader_for",
    "reader_named",
    "writer_for",
    "writer_named",
]

GROUP = "scanfab.readers"
WRITERS = "scanfab.writers"


@cache
def installed_readers() -> dict[str, Offer]:
    """
    All readers by name, with the package of each.

    A plugin that cannot be loaded is one warning with its name.

    Raises
    ------
    ScanfabError
        If two packages offer a reader of the same name.
    """
    return load_readers(entry_points(group=GROUP))


def load_readers(points: Iterable[EntryPoint]) -> dict[str, Offer]:
    """Load entry points; see :func:`installed_readers`."""
    make = having(
        "a class of objects with the members of scanfab.io.reader.Reader",
        **dict.fromkeys(("name", "description"), str),
        extensions=tuple,
        **dict.fromkeys(("recognises", "kind", "snapshots", "read_grains"), Callable),
    )
    return load_offers(points, "reader", lambda reader: make(reader()))


@cache
def installed_writers() -> dict[str, Offer]:
    """All writers by name, with the package of each; as :func:`installed_readers`."""
    return load_writers(entry_points(group=WRITERS))


def load_writers(points: Iterable[EntryPoint]) -> dict[str, Offer]:
    """Load entry points; see :func:`installed_writers`."""
    make = having(
        "a class of objects with the members of scanfab.io.writer.Writer",
        **dict.fromkeys(("name", "description"), str),
        extensions=tuple,
        write=Callable,
    )
    return load_offers(points, "writer", lambda writer: make(writer()))


def lacking(plugin: object) -> str | None:
    """What to install for a plugin whose package is not there; None if nothing lacks."""
    module, words = getattr(plugin, "requires", (None, ""))
    return None if module is None or find_spec(module) is not None else f"pip install {words}"


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


def reader_named(name: str) -> Reader:
    """The reader that a user names; UnknownFormatError lists those that exist."""
    readers = installed_readers()
    if name not in readers:
        raise UnknownFormatError(
            f"there is no reader called {name!r}; the readers are {', '.join(readers)}"
        )
    reader: Reader = readers[name].plugin
    advice = lacking(reader)
    if advice is not None:
        raise UnknownFormatError(f"{name} needs another package: {advice}")
    return reader


def reader_for(path: Path) -> Reader | None:
    """The reader that knows a file by its content, else by its extension; None if none does."""
    readers: list[Reader] = [one.plugin for one in installed_readers().values()]
    # a format that any program may write comes after the programs' own
    readers.sort(key=lambda reader: bool(getattr(reader, "generic", False)))
    for reader in readers:
        try:
            if reader.recognises(path):
                return reader
        except ReadError:
            raise
        except Exception as error:  # as above
            raise ReadError(
                f"{path}: the reader {reader.name!r} failed: {type(error).__name__}: {error}"
            ) from error
    name = bare_name(path).lower()
    return next((r for r in readers if name.endswith(r.extensions) and _can_open(r, path)), None)


def _can_open(reader: Reader, path: Path) -> bool:
    """An extension alone proves little: many programs write .txt."""
    try:
        return reader.kind(path) != "other"
    except ReadError:
        return False
