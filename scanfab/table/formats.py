"""File formats of tables, by suffix: CSV, TSV, JSON, JSON lines, Parquet, and those of plugins."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Protocol

from scanfab.base.column import Column
from scanfab.base.errors import ReadError, SettingsError
from scanfab.base.files import named_errors
from scanfab.base.plugins import having, load_plugins
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS

if TYPE_CHECKING:
    import polars

# columns of words, which may look like numbers: a source may be called 2024
TEXT_COLUMNS = {one.name for one in (*OWN_COLUMNS, *MORE_COLUMNS) if one.kind is str}


class TableFormat(Protocol):
    """
    A file format for tables.

    A package offers one under the entry point ``scanfab.table_formats``; a file here needs a line
    in ``OWN_FORMATS``. A format whose cells may be lists of numbers says ``holds_lists = True``;
    other formats leave such columns out.
    """

    suffix: str
    """Of its files, in small letters."""
    description: str
    """For ``scanfab formats``."""
    is_text: bool
    """Whether it is written to a stream of text."""

    def recognises(self, data: bytes) -> bool:
        """Whether a file's content is of this format."""
        ...

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows of a file's content; ReadError if it is broken, with the file's name."""
        ...

    def write(
        self, stream: IO[Any], rows: Iterable[Mapping[str, Any]], columns: Sequence[Column]
    ) -> None:
        """Write rows, whose values are of these columns and in their order."""
        ...


@dataclass
class SeparatedText:
    """CSV or TSV."""

    suffix: str
    delimiter: str
    description: str
    is_text: bool = True

    def recognises(self, data: bytes) -> bool:
        """By the separator in the first line."""
        return self.delimiter.encode() in data.split(b"\n", 1)[0]

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows; an empty cell is None."""
        text = _text(data, name)
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

    def write(
        self, stream: IO[str], rows: Iterable[Mapping[str, Any]], columns: Sequence[Column]
    ) -> None:
        """
        Write each row as soon as it comes, floats in the shortest form that reads back the same.

        The header comes with the first row: a computation that fails before that writes nothing.
        """
        writer = csv.writer(stream, delimiter=self.delimiter, lineterminator="\n")
        name = getattr(stream, "name", "")
        rows = iter(rows)
        first = list(next(rows, {}).values())
        lines = chain([[one.name for one in columns], first], (row.values() for row in rows))
        for line in filter(None, lines):
            with named_errors("standard output" if name == "<stdout>" else name):
                writer.writerow([repr(cell) if isinstance(cell, float) else cell for cell in line])
                stream.flush()


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


class JsonArray:
    """One array of objects."""

    suffix = ".json"
    description = "one array of objects; a missing value is null"
    is_text = True
    holds_lists = True

    def recognises(self, data: bytes) -> bool:
        """By the bracket that an array starts with."""
        return _first_character(data) == b"["

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The objects."""
        return _objects(name, _parsed(name, _text(data, name)))

    def write(
        self, stream: IO[str], rows: Iterable[Mapping[str, Any]], columns: Sequence[Column]
    ) -> None:
        """Write an object a line between brackets."""
        lines = ",\n".join(json_line(row) for row in rows)
        stream.write(f"[\n{lines}\n]\n" if lines else "[]\n")


class JsonLines:
    """One object a line."""

    suffix = ".jsonl"
    description = "JSON lines: one object a line"
    is_text = True
    holds_lists = True

    def recognises(self, data: bytes) -> bool:
        """By the brace that an object starts with."""
        return _first_character(data) == b"{"

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The objects."""
        lines = [line for line in _text(data, name).split("\n") if line.strip()]
        return _objects(name, [_parsed(name, line) for line in lines])

    def write(
        self, stream: IO[str], rows: Iterable[Mapping[str, Any]], columns: Sequence[Column]
    ) -> None:
        """Write an object a line; there is no header."""
        stream.writelines(json_line(row) + "\n" for row in rows)


def json_line(row: Mapping[str, Any]) -> str:
    """A row as a JSON object on one line; SettingsError for values that JSON does not know."""
    try:
        return json.dumps(dict(row), ensure_ascii=False, allow_nan=False)
    except TypeError as error:
        raise SettingsError(f"a row holds what JSON cannot: {error}") from None


def _first_character(data: bytes) -> bytes:
    return data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1]


def _text(data: bytes, name: str) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ReadError(f"{name}: expected a table as text or Parquet, found other bytes") from None


def _parsed(name: str, text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:  # also an integer of too many digits
        raise ReadError(f"{name}: cannot be read as JSON: {error}") from None


def _objects(name: str, rows: list[Any]) -> list[dict[str, Any]]:
    if not all(isinstance(row, dict) for row in rows):
        raise ReadError(f"{name}: expected JSON objects, one for each row")
    return rows


class Parquet:
    """A file whose columns have the kinds that they are declared with."""

    suffix = ".parquet"
    description = "Apache Parquet"
    is_text = False
    holds_lists = True

    def recognises(self, data: bytes) -> bool:
        """By its magic number."""
        return data.startswith(b"PAR1")

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows."""
        import polars

        try:
            return polars.read_parquet(io.BytesIO(data)).to_dicts()
        except Exception as error:  # polars raises kinds of its own
            raise ReadError(f"{name}: cannot be read as Parquet: {error}") from None

    def write(
        self, stream: IO[bytes], rows: Iterable[Mapping[str, Any]], columns: Sequence[Column]
    ) -> None:
        """Write the file when all rows are known."""
        data_frame(list(rows), columns).write_parquet(stream)


def data_frame(rows: Sequence[Mapping[str, Any]], columns: Sequence[Column]) -> polars.DataFrame:
    """Rows as a data frame of polars; columns of lists have the kind of their entries."""
    import polars

    kinds = {int: polars.Int64, float: polars.Float64, str: polars.String}
    return polars.DataFrame(
        [polars.Series(one.name, [row[one.name] for row in rows], kinds.get(one.kind))
         for one in columns]
    )  # fmt: skip


# In the order in which they are listed. A file is recognised in the opposite order, as any text
# may be separated by commas.
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
def foreign_formats() -> tuple[TableFormat, ...]:
    """The formats of other packages."""
    make = having(
        "an object with the members of scanfab.table.formats.TableFormat",
        **dict.fromkeys(("suffix", "description"), str),
        is_text=bool,
        **dict.fromkeys(("recognises", "read", "write"), Callable),
    )
    return tuple(load_plugins("scanfab.table_formats", "table format", make).values())


def known_formats() -> dict[str, TableFormat]:
    """All formats by suffix; the own ones cannot be replaced."""
    return {one.suffix: one for one in (*OWN_FORMATS, *foreign_formats()[::-1], *OWN_FORMATS)}


def format_of(path: Path) -> TableFormat:
    """
    The format in which results are written to a file of this name.

    Raises
    ------
    SettingsError
        If there is none.
    """
    suffix = path.suffix.lower()
    # other packages are asked only where they are needed, which takes a while
    own = next((one for one in OWN_FORMATS if one.suffix == suffix), None)
    found = own or known_formats().get(suffix)
    if found is None:
        raise SettingsError(
            f"{path}: results can be written as {', '.join(known_formats())}, "
            f"not as {path.suffix or 'a file without a suffix'}"
        )
    return found


def reading_format(path: Path, data: bytes) -> TableFormat:
    """The format that recognises a file's content; plugins come first unless the suffix is own."""
    own = {one.suffix: one for one in OWN_FORMATS}
    if not data and path.suffix.lower() == ".jsonl":
        return own[".jsonl"]  # an empty file has no content to be recognised by
    others: Iterator[TableFormat] = iter(() if path.suffix.lower() in own else foreign_formats())
    recognised = (one for one in chain(others, reversed(OWN_FORMATS)) if one.recognises(data))
    # the rest is text with one column, or broken
    return next(recognised, own[".csv"])
