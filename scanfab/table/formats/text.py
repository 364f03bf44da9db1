"""Tables as text whose cells are separated by commas or tabs."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import IO, Any

from scanfab.base.column import Column
from scanfab.base.errors import ReadError
from scanfab.base.files import named_errors
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS

# words that may look like numbers: a source may be called 2024
TEXT_COLUMNS = {one.name for one in (*OWN_COLUMNS, *MORE_COLUMNS) if one.kind is str}


@dataclass
class SeparatedText:
    """CSV or TSV."""

    suffix: str
    delimiter: str
    description: str
    is_text: bool = True
    appends: bool = True

    def check(self) -> None:
        """It needs no package."""

    def recognises(self, data: bytes) -> bool:
        """Whether it may be: by the separator of the first line."""
        return self.delimiter.encode() in data.split(b"\n", 1)[0]

    def writer(self, stream: IO[str], columns: Sequence[Column], header: bool) -> TextWriter:
        """Of rows that are written at once; the header comes with the first."""
        return TextWriter(stream, self.delimiter, header, [column.name for column in columns])

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows; an empty cell is None."""
        text = text_of(data, name)
        first = text.split("\n", 1)[0]
        reader = csv.reader(io.StringIO(text), delimiter="\t" if "\t" in first else ",")
        try:
            names = next(reader, [])
            rows = []
            for row in reader:
                if len(row) != len(names):
                    raise ReadError(
                        f"{name}, line {reader.line_num}: expected {len(names)} cells, "
                        f"found {len(row)}"
                    )
                rows.append({key: _value(key, cell) for key, cell in zip(names, row, strict=True)})
        except csv.Error as error:
            raise ReadError(f"{name}, line {reader.line_num}: {error}") from None
        if not names:
            raise ReadError(f"{name}: expected a table, found nothing")
        return rows


class TextWriter:
    """
    Rows as lines, each at once.

    The header comes with the first row: a computation that fails before writes nothing. Floats are
    in the shortest form that reads back the same.
    """

    def __init__(
        self,
        stream: IO[str],
        delimiter: str = ",",
        header: bool = True,
        names: Sequence[str] = (),
    ) -> None:
        self.stream = stream
        self.names = names
        self._writer = csv.writer(stream, delimiter=delimiter, lineterminator="\n")
        self._header = header

    def write(self, row: Mapping[str, Any]) -> None:
        """Write one row."""
        cells = [
            "" if value is None else repr(float(value)) if isinstance(value, float) else value
            for value in row.values()
        ]
        with named_after(self.stream):
            if self._header:
                self._writer.writerow(row)
                self._header = False
            self._writer.writerow(cells)
            self.stream.flush()

    def close(self) -> None:
        """Nothing comes after the last row; where there is none, the names of the columns."""
        if self._header and self.names:
            self._writer.writerow(self.names)


def named_after(stream: IO[Any]) -> AbstractContextManager[None]:
    """Errors of writing that name the stream's file."""
    name = str(getattr(stream, "name", ""))
    return named_errors("standard output" if name == "<stdout>" else name)


def text_of(data: bytes, name: str) -> str:
    """A file's content as text."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ReadError(f"{name}: expected a table as text or Parquet, found other bytes") from None


def _value(name: str, cell: str) -> int | float | str | None:
    if cell == "":
        return None
    if name not in TEXT_COLUMNS:
        for kind in (int, float):
            try:
                return kind(cell)
            except ValueError:
                continue
    return cell
