"""The readers that are installed, found through entry points; knows no format itself."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from scanfab.base.errors import ReadError, ScanfabWarning, UnknownFormatError
from scanfab.io.files import bare_name
from scanfab.io.reader import Reader

__all__ = ["InstalledReader", "installed_readers", "reader_for", "reader_named"]

GROUP = "scanfab.readers"


@dataclass(frozen=True)
class InstalledReader:
    """A reader and the package that it comes from."""

    reader: Reader
    package: str


@cache
def installed_readers() -> dict[str, InstalledReader]:
    """
    All readers by name.

    A plugin that cannot be loaded is one warning with its name.

    Raises
    ------
    UnknownFormatError
        If two packages offer a reader of the same name.
    """
    return load_readers(entry_points(group=GROUP))


def load_readers(points: tuple[EntryPoint, ...] | list[EntryPoint]) -> dict[str, InstalledReader]:
    """Load entry points; see :func:`installed_readers`."""
    found: dict[str, InstalledReader] = {}
    for point in sorted(points, key=lambda point: (point.name, point.value)):
        package = point.dist.name if point.dist is not None else "unknown package"
        try:
            reader: Reader = point.load()()
        except (Exception, SystemExit) as error:  # a foreign plugin may fail in any way
            warnings.warn(
                f"the reader {point.name!r} of {package} cannot be loaded: "
                f"{type(error).__name__}: {error}",
                ScanfabWarning,
                stacklevel=2,
            )
            continue
        if point.name in found:
            raise UnknownFormatError(
                f"two packages offer a reader called {point.name!r}: "
                f"{found[point.name].package} and {package}; remove one of them"
            )
        found[point.name] = InstalledReader(reader, package)
    return found


def reader_named(name: str) -> Reader:
    """The reader that a user names; UnknownFormatError lists those that exist."""
    readers = installed_readers()
    if name not in readers:
        raise UnknownFormatError(
            f"there is no reader called {name!r}; the readers are {', '.join(readers)}"
        )
    return readers[name].reader


def reader_for(path: Path) -> Reader | None:
    """The reader that knows a file by its content, else by its extension; None if none does."""
    readers = [installed.reader for installed in installed_readers().values()]
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
