"""Rows of the fabric table as text, and files that are complete or untouched."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import astuple
from pathlib import Path
from typing import IO

from scanfab.errors import SettingsError
from scanfab.table import COLUMNS, Row

__all__ = ["FILE_FORMATS", "CsvWriter", "open_result"]

FILE_FORMATS = {".csv": "comma-separated values, numbers that read back the same"}


class CsvWriter:
    """
    Writes rows as CSV, each at once; a value that does not exist is an empty cell.

    The header comes with the first row: a computation that fails before writes nothing.
    """

    def __init__(self, stream: IO[str]) -> None:
        self.stream = stream
        self._writer = csv.writer(stream, lineterminator="\n")
        self._started = False

    def write(self, row: Row) -> None:
        """Write one row; floats in the shortest form that reads back the same."""
        if not self._started:
            self._writer.writerow(COLUMNS)
            self._started = True
        self._writer.writerow(
            [
                "" if value is None else repr(float(value)) if isinstance(value, float) else value
                for value in astuple(row)
            ]
        )
        self.stream.flush()


def check_suffix(path: Path) -> None:
    """SettingsError if results cannot be written to a file of this name."""
    if path.suffix.lower() not in FILE_FORMATS:
        raise SettingsError(
            f"{path}: results can be written as {', '.join(FILE_FORMATS)}, "
            f"not as {path.suffix or 'a file without a suffix'}"
        )


@contextmanager
def open_result(path: Path) -> Iterator[IO[str]]:
    """
    Open FILE.part; it becomes FILE if all goes well, else FILE stays as it was.

    Raises
    ------
    SettingsError
        If the suffix is not known.
    """
    check_suffix(path)
    part = path.with_name(path.name + ".part")
    with open(part, "w", newline="", encoding="utf-8") as stream:
        yield stream
    os.replace(part, path)
