"""The formats of tables by suffix: those below, and what other packages offer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import IO, Any, Protocol

from scanfab.base.column import Column
from scanfab.base.errors import SettingsError
from scanfab.base.plugins import having, load_plugins
from scanfab.table.formats.json_rows import JsonArray, JsonLines
from scanfab.table.formats.parquet import Parquet
from scanfab.table.formats.text import SeparatedText

GROUP = "scanfab.table_formats"


class RowWriter(Protocol):
    """Writes rows to a stream."""

    def write(self, row: Mapping[str, Any]) -> None:
        """Write one row."""
        ...

    def close(self) -> None:
        """Write what comes after the last row; the stream stays open."""
        ...


class TableFormat(Protocol):
    """
    A file format for tables.

    A package offers one under the entry point ``scanfab.table_formats``; a file here needs a line
    in ``OWN_FORMATS``. One whose cells may be lists of numbers says ``holds_lists = True``; from
    others such columns are left out.
    """

    suffix: str
    """Of its files, in small letters."""
    description: str
    """For ``scanfab formats``."""
    is_text: bool
    """Whether it is written to a stream of text."""
    appends: bool
    """Whether each row is a line of its own, so that more rows can be written behind."""

    def check(self) -> None:
        """SettingsError if a package is missing that it needs."""
        ...

    def recognises(self, data: bytes) -> bool:
        """Whether a file's content is of this format."""
        ...

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows of a file's content; ReadError if it is broken, with the file's name."""
        ...

    def writer(self, stream: IO[Any], columns: Sequence[Column], header: bool) -> RowWriter:
        """What writes rows of these columns; without a header behind rows that are there."""
        ...


# in the order in which they are listed; a file is recognised in the opposite one, as any text may
# be separated by commas
OWN_FORMATS: tuple[TableFormat, ...] = (
    SeparatedText(
        ".csv",
        ",",
        "comma-separated values; numbers read back the same, a missing value is an empty cell",
    ),
    SeparatedText(".tsv", "\t", "the same with tabs"),
    JsonArray(),
    JsonLines(),
    Parquet(),
)


@cache
def _foreign_formats() -> tuple[TableFormat, ...]:
    make = having(
        "an object with the members of scanfab.table.formats.registry.TableFormat",
        **dict.fromkeys(("suffix", "description"), str),
        **dict.fromkeys(("is_text", "appends"), bool),
        **dict.fromkeys(("check", "recognises", "read", "writer"), Callable),
    )
    return tuple(load_plugins(GROUP, "table format", make).values())


def known_formats() -> dict[str, TableFormat]:
    """All formats by suffix; the own ones cannot be replaced."""
    own = {one.suffix: one for one in OWN_FORMATS}
    return own | {one.suffix: one for one in _foreign_formats() if one.suffix not in own}


def format_of(path: Path) -> TableFormat:
    """
    The format in which results are written to a file of this name.

    Raises
    ------
    SettingsError
        If there is none, or its package is missing.
    """
    suffix = path.suffix.lower()
    # others are looked for only where they are needed, which takes a while
    own = next((one for one in OWN_FORMATS if one.suffix == suffix), None)
    found = own or known_formats().get(suffix)
    if found is None:
        raise SettingsError(
            f"{path}: results can be written as {', '.join(known_formats())}, "
            f"not as {path.suffix or 'a file without a suffix'}"
        )
    found.check()
    return found


def reading_format(path: Path, data: bytes) -> TableFormat:
    """The format that knows a file's content; others are asked unless the suffix is an own one."""
    own = {one.suffix: one for one in OWN_FORMATS}
    if not data and path.suffix.lower() == ".jsonl":
        return own[".jsonl"]  # without rows it has no content to be told by
    if path.suffix.lower() not in own:
        for one in _foreign_formats():
            if one.recognises(data):
                return one
    # what nothing recognises is text with one column, or broken
    return next((one for one in reversed(OWN_FORMATS) if one.recognises(data)), own[".csv"])
