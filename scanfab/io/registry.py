"""The readers that are installed, found through entry points; knows no format itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path

from scanfab.base.errors import ReadError, UnknownFormatError
from scanfab.base.plugins import Offer, having, load_offers
from scanfab.io.files import bare_name
from scanfab.io.reader import Reader, ReadOptions

GROUP = "scanfab.readers"
# the reader that any text is tried with
TABLE = "table"


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


def lacking(plugin: object) -> str | None:
    """What to install for a plugin whose package is not there; None if nothing lacks."""
    module, words = getattr(plugin, "requires", (None, ""))
    return None if module is None or find_spec(module) is not None else f"pip install {words}"


def reader_named(name: str, options: ReadOptions | None = None) -> Reader:
    """The reader that a user names; UnknownFormatError lists those that exist."""
    readers = installed_readers()
    if name not in readers:
        raise UnknownFormatError(
            f"there is no reader called {name!r}; the readers are {', '.join(readers)}"
        )
    advice = lacking(readers[name].plugin)
    if advice is not None:
        raise UnknownFormatError(f"{name} needs another package: {advice}")
    return _told(readers[name].plugin, options)


def _told(reader: Reader, options: ReadOptions | None) -> Reader:
    """The reader, with what users say of its files if it needs that to know what they hold."""
    tell = getattr(reader, "told", None)
    told: Reader = reader if tell is None or options is None else tell(options)
    return told


def reader_for(path: Path, options: ReadOptions | None = None) -> Reader | None:
    """The reader that knows a file by its content or extension; any other text may be a table."""
    readers = [_told(one.plugin, options) for one in installed_readers().values()]
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
    likely = [reader for reader in readers if name.endswith(reader.extensions)]
    tables = [one for one in readers if one.name == TABLE and one not in likely]
    return next((reader for reader in [*likely, *tables] if _can_open(reader, path)), None)


def why_not(path: Path, options: ReadOptions) -> str:
    """What the last reader of files with such an ending says of one that it cannot read."""
    reason = ""
    for one in installed_readers().values():
        reader = _told(one.plugin, options)
        if reader.name == TABLE or bare_name(path).lower().endswith(reader.extensions):
            try:
                reader.kind(path)
            except ReadError as error:
                reason = str(error).removeprefix(f"{path}").lstrip(":, ")
    return reason


def _can_open(reader: Reader, path: Path) -> bool:
    """An extension alone proves little: many programs write .txt."""
    try:
        return reader.kind(path) != "other"
    except ReadError:
        return False
