"""File formats of tables: CSV, TSV, JSON, JSON lines, Parquet, and formats of plugins."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from itertools import chain, islice
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Protocol

from scanfab.base.column import Column
from scanfab.base.errors import ReadError, SettingsError
from scanfab.base.files import check_file, named_errors
from scanfab.base.plugins import having, load_plugins
from scanfab.base.spelling import counted
from scanfab.table.columns import KINDS

if TYPE_CHECKING:
    import polars

Rows = Iterable[Mapping[str, Any]]
Columns = Sequence[Column]

# cells of these columns stay text even if they look like numbers: a source may be named 2024
TEXT_COLUMNS = {name for name, kind in KINDS.items() if kind is str}
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


class TableFormat(Protocol):
    """
    A file format for tables.

    Another package offers a format under the entry point ``scanfab.table_formats``; a format of
    this package is listed in ``OWN_FORMATS``. A format whose cells can hold lists of numbers sets
    ``holds_lists = True``; other formats leave out columns of lists.
    """

    suffix: str
    """Suffix of its files, in lower case."""
    description: str
    """Description for ``scanfab formats``."""
    is_text: bool
    """Whether it writes to a text stream; if not, it writes bytes."""

    def recognises(self, data: bytes) -> bool:
        """Whether the content of a file is in this format."""
        ...

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """Read rows from the content of a file; ReadError names the file if it is broken."""
        ...

    def write(self, stream: IO[Any], rows: Rows, columns: Columns) -> None:
        """Write rows; each has the values of these columns, in the same order."""
        ...


class OwnFormat:
    """Base class of the formats of this package, which recognise files by their first bytes."""

    is_text = holds_lists = True
    start = b""

    def recognises(self, data: bytes) -> bool:
        """Whether the content begins with the characters of this format."""
        return data.removeprefix(BYTE_ORDER_MARK).lstrip().startswith(self.start)


class SeparatedText(OwnFormat):
    """CSV or TSV; any text that no other format recognises is read as one of these two."""

    holds_lists = False

    def __init__(self, suffix: str, delimiter: str, description: str) -> None:
        self.suffix, self.delimiter, self.description = suffix, delimiter, description

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """Read rows; an empty cell becomes None."""
        text = _text(data, name)
        delimiter = "\t" if "\t" in text.split("\n", 1)[0] else ","
        lines = csv.reader(io.StringIO(text), delimiter=delimiter)
        rows = []
        try:
            names = next(lines, [])
            if len({*names}) < len(names):
                raise csv.Error("two columns have the same name")
            for line in filter(None, lines):
                if len(line) != len(names):
                    expected = f"expected {counted(len(names), 'cell')} as in line 1"
                    raise csv.Error(f"{expected}, found {len(line)}: is this a table?")
                rows.append({key: _value(key, cell) for key, cell in zip(names, line, strict=True)})
        except csv.Error as error:
            raise ReadError(f"{name}, line {lines.line_num}: {error}") from None
        if not names:
            raise ReadError(f"{name}: expected a table, found an empty file")
        return rows

    def write(self, stream: IO[str], rows: Rows, columns: Columns) -> None:
        """
        Write each row as soon as it is computed.

        A float is written as the shortest text that reads back to the same number. The header is
        written together with the first row, so that a run that fails before writes nothing.
        """
        writer = csv.writer(stream, delimiter=self.delimiter, lineterminator="\n")
        name = getattr(stream, "name", "")
        lines = (row.values() for row in rows)
        first = list(islice(lines, 1))
        for line in chain([[column.name for column in columns]], first, lines):
            with named_errors("standard output" if name == "<stdout>" else name):
                writer.writerow(line)
                stream.flush()


def _value(name: str, cell: str) -> int | float | str | None:
    if name not in TEXT_COLUMNS:
        for kind in (int, float):
            try:
                return kind(cell)
            except ValueError:
                continue
    # a packing without a name has an empty source
    return cell or ("" if name == "source" else None)


def _text(data: bytes, name: str) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ReadError(f"{name}: expected text in UTF-8 or Parquet, found other bytes") from None


class Json(OwnFormat):
    """A JSON object for each row: all in one array, or one on each line (JSON lines)."""

    def __init__(self, suffix: str, start: bytes, description: str) -> None:
        self.suffix, self.start, self.description = suffix, start, description
        self.is_array = start == b"["

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """Read one row from each object."""
        text = _text(data, name)
        try:
            lines = filter(str.strip, text.split("\n"))
            rows = list(json.loads(text)) if self.is_array else [json.loads(one) for one in lines]
        except (ValueError, RecursionError) as error:  # also an integer of too many digits
            raise ReadError(f"{name}: cannot be read as JSON: {error}") from None
        if not all(isinstance(row, dict) for row in rows):
            raise ReadError(f"{name}: expected JSON objects, one for each row")
        return rows

    def write(self, stream: IO[str], rows: Rows, columns: Columns) -> None:
        """Write one object per row."""
        lines = map(json_line, rows)
        if not self.is_array:
            stream.writelines(line + "\n" for line in lines)
        else:
            text = ",\n".join(lines)
            stream.write(f"[\n{text}\n]\n" if text else "[]\n")


def json_line(row: Mapping[str, Any]) -> str:
    """A row as a JSON object on one line; SettingsError for values that JSON cannot hold."""
    try:
        return json.dumps(dict(row), ensure_ascii=False, allow_nan=False)
    except TypeError as error:
        raise SettingsError(f"a row holds a value that JSON cannot hold: {error}") from None


class Parquet(OwnFormat):
    """Apache Parquet, whose columns keep the kinds that they are declared with."""

    suffix, description = ".parquet", "Apache Parquet"
    is_text, start = False, b"PAR1"

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """Read the rows."""
        import polars

        try:
            return polars.read_parquet(io.BytesIO(data)).to_dicts()
        except Exception as error:  # polars raises kinds of its own
            raise ReadError(f"{name}: cannot be read as Parquet: {error}") from None

    def write(self, stream: IO[bytes], rows: Rows, columns: Columns) -> None:
        """Write the file once all rows are computed."""
        data_frame(list(rows), columns).write_parquet(stream)


def data_frame(rows: Sequence[Mapping[str, Any]], columns: Columns) -> polars.DataFrame:
    """
    Turn rows of plain Python values into a polars data frame.

    A column gets its declared kind. If values do not fit, as in tables of other programs that mix
    whole numbers with fractions or words with numbers, it gets a kind that holds them all.
    """
    import polars

    kinds = {int: polars.Int64, float: polars.Float64, str: polars.String}
    series_of_columns = []
    for column in columns:
        values = [row.get(column.name) for row in rows]
        try:
            series = polars.Series(column.name, values, kinds.get(column.kind))
        except (TypeError, ValueError, OverflowError):
            series = polars.Series(column.name, values, strict=False)
        if series.null_count() > values.count(None):
            raise SettingsError(f"{column.name}: no column can hold values of so different kinds")
        series_of_columns.append(series)
    return polars.DataFrame(series_of_columns)


# Formats in the order of the list that users see. Files are recognised in the opposite order,
# because any text could be a table with commas.
OWN_FORMATS: tuple[TableFormat, ...] = (
    SeparatedText(".csv", ",", "comma-separated values; a missing value is an empty cell"),
    SeparatedText(".tsv", "\t", "tab-separated values; a missing value is an empty cell"),
    Json(".json", b"[", "one array of objects; a missing value is null"),
    Json(".jsonl", b"{", "JSON lines: one object a line"),
    Parquet(),
)


@cache
def foreign_formats() -> tuple[TableFormat, ...]:
    """Formats that other packages offer."""
    members: dict[str, Any] = {"suffix": str, "description": str, "is_text": bool}
    members |= dict.fromkeys(("recognises", "read", "write"), Callable)
    make = having("an object with the members of scanfab.table.formats.TableFormat", **members)
    offers = load_plugins("scanfab.table_formats", "table format", make)
    return tuple(offer.plugin for offer in offers.values())


def known_formats() -> dict[str, TableFormat]:
    """All formats by suffix; other packages cannot replace the formats of this package."""
    foreign = {form.suffix: form for form in reversed(foreign_formats())}
    own = {form.suffix: form for form in OWN_FORMATS}
    return own | foreign | own


def format_of(path: Path) -> TableFormat:
    """
    The format of results that are written to a file of this name.

    Raises
    ------
    SettingsError
        If no format has the suffix of the file.
    """
    suffix = path.suffix.lower()
    # other packages are asked only if needed, because looking for them is slow
    own = {form.suffix: form for form in OWN_FORMATS}
    table_format = own.get(suffix) or known_formats().get(suffix)
    if table_format is None:
        listed, found = ", ".join(known_formats()), path.suffix or "a file without a suffix"
        raise SettingsError(f"{path}: results can be written as {listed}, not as {found}")
    return table_format


def read_rows(path: Path | str, *, whole: bool = False) -> list[dict[str, Any]]:
    """
    Read the rows of a table as dicts by column; a missing value is None.

    The content decides the format. Formats of other packages are tried first, unless the suffix
    belongs to a format of this package.

    Parameters
    ----------
    path : path
        A file, or ``-`` for standard input.
    whole : bool, optional
        Refuse a text without a line end at its end, because its last number may be cut off.

    Returns
    -------
    list of dict
        Rows; :func:`scanfab.load` returns a :class:`scanfab.Table` instead.

    Raises
    ------
    ReadError
        If the file cannot be read as a table; the message names the line of a text file.

    Examples
    --------
    >>> from scanfab.table.formats import read_rows
    >>> rows = read_rows("sample_data/yade_triaxial/engine.csv")
    >>> rows[0]["contacts"]
    2076
    """
    check_file(Path(path), is_table=True)
    try:
        data = sys.stdin.buffer.read() if str(path) == "-" else Path(path).read_bytes()
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror}") from None
    suffix = Path(path).suffix.lower()
    if not data and suffix == ".jsonl":
        return []
    others = () if suffix in [form.suffix for form in OWN_FORMATS] else foreign_formats()
    table_format = next(form for form in (*others, *reversed(OWN_FORMATS)) if form.recognises(data))
    rows = table_format.read(data, str(path))
    if whole and table_format.is_text and not data.endswith(b"\n"):
        raise ReadError(
            f"{path}: the last line has no line end, so the file may be cut off: copy it again, or "
            f"remove it and run its command again"
        )
    return rows
