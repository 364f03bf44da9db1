"""Files of tables: CSV, TSV, JSON, JSON lines, Parquet, and the formats of plugins."""

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
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS

if TYPE_CHECKING:
    import polars

Rows = Iterable[Mapping[str, Any]]
Columns = Sequence[Column]

# cells of these columns stay texts even if they look like numbers: a source may be called 2024
TEXT_COLUMNS = {one.name for one in (*OWN_COLUMNS, *MORE_COLUMNS) if one.kind is str}
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


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

    def write(self, stream: IO[Any], rows: Rows, columns: Columns) -> None:
        """Write rows, whose values are of these columns and in their order."""
        ...


class OwnFormat:
    """Base of the formats of the package, which are recognised by the first characters."""

    is_text = holds_lists = True
    start = b""

    def recognises(self, data: bytes) -> bool:
        """Whether a file begins as the format does."""
        return data.removeprefix(BYTE_ORDER_MARK).lstrip().startswith(self.start)


class SeparatedText(OwnFormat):
    """CSV or TSV; a text of no other format is read as one of the two."""

    holds_lists = False

    def __init__(self, suffix: str, delimiter: str, description: str) -> None:
        self.suffix, self.delimiter, self.description = suffix, delimiter, description

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows; an empty cell is None."""
        text = _text(data, name)
        delimiter = "\t" if "\t" in text.split("\n", 1)[0] else ","
        lines = csv.reader(io.StringIO(text), delimiter=delimiter)
        rows = []
        try:
            names = next(lines, [])
            for line in lines:
                if len(line) != len(names):
                    raise csv.Error(f"expected {len(names)} cells, found {len(line)}")
                rows.append({key: _value(key, cell) for key, cell in zip(names, line, strict=True)})
        except csv.Error as error:
            raise ReadError(f"{name}, line {lines.line_num}: {error}") from None
        if not names:
            raise ReadError(f"{name}: expected a table, found nothing")
        return rows

    def write(self, stream: IO[str], rows: Rows, columns: Columns) -> None:
        """
        Write each row as soon as it comes, floats in the shortest form that reads back the same.

        The header comes with the first row: a computation that fails before that writes nothing.
        """
        writer = csv.writer(stream, delimiter=self.delimiter, lineterminator="\n")
        name = getattr(stream, "name", "")
        lines = (row.values() for row in rows)
        first = list(islice(lines, 1))
        for line in chain([[one.name for one in columns]], first, lines):
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
    return cell or None


def _text(data: bytes, name: str) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ReadError(f"{name}: expected a table as text or Parquet, found other bytes") from None


class Json(OwnFormat):
    """An object for each row, all in one array or each on a line of its own (JSON lines)."""

    def __init__(self, suffix: str, start: bytes, description: str) -> None:
        self.suffix, self.start, self.description = suffix, start, description
        self.is_array = start == b"["

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The objects."""
        text = _text(data, name)
        try:
            lines = [text] if self.is_array else filter(str.strip, text.split("\n"))
            rows = [json.loads(line) for line in lines]
            rows = list(rows[0]) if self.is_array else rows
        except (ValueError, RecursionError) as error:  # also an integer of too many digits
            raise ReadError(f"{name}: cannot be read as JSON: {error}") from None
        if not all(isinstance(row, dict) for row in rows):
            raise ReadError(f"{name}: expected JSON objects, one for each row")
        return rows

    def write(self, stream: IO[str], rows: Rows, columns: Columns) -> None:
        """Write an object a line; there is no header."""
        lines = map(json_line, rows)
        if not self.is_array:
            stream.writelines(line + "\n" for line in lines)
        else:
            text = ",\n".join(lines)
            stream.write(f"[\n{text}\n]\n" if text else "[]\n")


def json_line(row: Mapping[str, Any]) -> str:
    """A row as a JSON object on one line; SettingsError for values that JSON does not know."""
    try:
        return json.dumps(dict(row), ensure_ascii=False, allow_nan=False)
    except TypeError as error:
        raise SettingsError(f"a row holds what JSON cannot: {error}") from None


class Parquet(OwnFormat):
    """A file whose columns have the kinds that they are declared with."""

    suffix = ".parquet"
    description = "Apache Parquet"
    is_text = False
    start = b"PAR1"

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows."""
        import polars

        try:
            return polars.read_parquet(io.BytesIO(data)).to_dicts()
        except Exception as error:  # polars raises kinds of its own
            raise ReadError(f"{name}: cannot be read as Parquet: {error}") from None

    def write(self, stream: IO[bytes], rows: Rows, columns: Columns) -> None:
        """Write the file when all rows are known."""
        data_frame(list(rows), columns).write_parquet(stream)


def data_frame(rows: Sequence[Mapping[str, Any]], columns: Columns) -> polars.DataFrame:
    """
    Rows, whose values are of Python's own kinds, as a data frame of polars.

    A column has its declared kind. In tables of other programs, where fractions stand among counts
    or words among numbers, it has a kind that holds all its values.
    """
    import polars

    kinds = {int: polars.Int64, float: polars.Float64, str: polars.String}
    found = []
    for one in columns:
        values = [row.get(one.name) for row in rows]
        try:
            series = polars.Series(one.name, values, kinds.get(one.kind))
        except (TypeError, ValueError, OverflowError):
            series = polars.Series(one.name, values, strict=False)
        if series.null_count() > values.count(None):
            raise SettingsError(f"{one.name}: its values are of kinds that no column can hold")
        found.append(series)
    return polars.DataFrame(found)


# In the order in which they are listed. A file is recognised in the opposite order, as any text
# may be separated by commas.
OWN_FORMATS: tuple[TableFormat, ...] = (
    SeparatedText(".csv", ",", "comma-separated values; a missing value is an empty cell"),
    SeparatedText(".tsv", "\t", "the same with tabs"),
    Json(".json", b"[", "one array of objects; a missing value is null"),
    Json(".jsonl", b"{", "JSON lines: one object a line"),
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
    offers = load_plugins("scanfab.table_formats", "table format", make)
    return tuple(one.plugin for one in offers.values())


def known_formats() -> dict[str, TableFormat]:
    """All formats by suffix; other packages cannot replace those of this one."""
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
    # looking for the formats of other packages takes a while, so it is done only if needed
    found = {one.suffix: one for one in OWN_FORMATS}.get(suffix) or known_formats().get(suffix)
    if found is None:
        raise SettingsError(
            f"{path}: results can be written as {', '.join(known_formats())}, "
            f"not as {path.suffix or 'a file without a suffix'}"
        )
    return found


def read_rows(path: Path | str, *, whole: bool = False) -> list[dict[str, Any]]:
    """
    The rows of a table by column; a missing value is None.

    The content tells the format. A format of another package comes first, unless the suffix is
    that of an own one.

    Parameters
    ----------
    path : path
        A file, or ``-`` for standard input.
    whole : bool, optional
        Refuse a text whose last line has no end, as its last number may have lost digits.

    Returns
    -------
    list of dict
        :func:`scanfab.load` makes a table of them.

    Raises
    ------
    ReadError
        If the file cannot be read as a table; names the line of a text file.

    Examples
    --------
    >>> from scanfab.table.formats import read_rows
    >>> rows = read_rows("sample_data/yade_triaxial/engine.csv")
    >>> rows[0]["contacts"]
    2076
    """
    check_file(Path(path), "a table", "as - in place of its name")
    try:
        data = sys.stdin.buffer.read() if str(path) == "-" else Path(path).read_bytes()
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror}") from None
    suffix = Path(path).suffix.lower()
    if not data and suffix == ".jsonl":
        return []
    others = () if suffix in [one.suffix for one in OWN_FORMATS] else foreign_formats()
    found = next(one for one in (*others, *reversed(OWN_FORMATS)) if one.recognises(data))
    rows = found.read(data, str(path))
    if whole and found.is_text and not data.endswith(b"\n"):
        raise ReadError(
            f"{path}: its last line has no end, so it may be cut off: copy it again, or remove it "
            f"and run its command again"
        )
    return rows
