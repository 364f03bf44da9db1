"""Tables as JSON: one array of objects, or one object a line."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import IO, Any

from scanfab.base.column import Column
from scanfab.base.errors import ReadError, SettingsError
from scanfab.table.formats.text import named_after, text_of


class JsonArray:
    """One array of objects."""

    suffix = ".json"
    description = "one array of objects; a missing value is null"
    is_text = True
    appends = False
    holds_lists = True

    def check(self) -> None:
        """It needs no package."""

    def recognises(self, data: bytes) -> bool:
        """By the bracket that an array starts with."""
        return _start(data) == b"["

    def writer(self, stream: IO[str], columns: Sequence[Column], header: bool) -> ArrayWriter:
        """Of rows between brackets."""
        return ArrayWriter(stream)

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The objects."""
        return _objects(name, _parse(name, text_of(data, name)))


class JsonLines:
    """One object a line."""

    suffix = ".jsonl"
    description = "JSON lines: one object a line"
    is_text = True
    appends = True
    holds_lists = True

    def check(self) -> None:
        """It needs no package."""

    def recognises(self, data: bytes) -> bool:
        """By the brace that an object starts with."""
        return _start(data) == b"{"

    def writer(self, stream: IO[str], columns: Sequence[Column], header: bool) -> LinesWriter:
        """Of rows that are written at once; there is no header."""
        return LinesWriter(stream)

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The objects."""
        lines = [line for line in text_of(data, name).split("\n") if line.strip()]
        return _objects(name, [_parse(name, line) for line in lines])


class LinesWriter:
    """Rows as JSON, one object a line."""

    def __init__(self, stream: IO[str]) -> None:
        self.stream = stream

    def write(self, row: Mapping[str, Any]) -> None:
        """Write one row."""
        with named_after(self.stream):
            self.stream.write(_object(row) + "\n")
            self.stream.flush()

    def close(self) -> None:
        """Nothing comes after the last row."""


class ArrayWriter:
    """Rows as one JSON array."""

    def __init__(self, stream: IO[str]) -> None:
        self.stream = stream
        self._before = "[\n"

    def write(self, row: Mapping[str, Any]) -> None:
        """Write one row."""
        self.stream.write(self._before + _object(row))
        self._before = ",\n"

    def close(self) -> None:
        """The end of the array."""
        self.stream.write("\n]\n" if self._before != "[\n" else "[]\n")


def _object(row: Mapping[str, Any]) -> str:
    try:
        return json.dumps(dict(row), ensure_ascii=False, allow_nan=False)
    except TypeError as error:
        raise SettingsError(f"a row holds what JSON cannot: {error}") from None


def _start(data: bytes) -> bytes:
    return data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1]


def _parse(name: str, text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:  # also an integer of too many digits
        raise ReadError(f"{name}: cannot be read as JSON: {error}") from None


def _objects(name: str, rows: list[Any]) -> list[dict[str, Any]]:
    if not all(isinstance(row, dict) for row in rows):
        raise ReadError(f"{name}: expected JSON objects, one for each row")
    return rows
