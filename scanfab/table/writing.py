"""Rows of a table as text or Parquet, one at a time."""

from __future__ import annotations

import csv
import json
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Protocol

from scanfab.base.column import no_column
from scanfab.base.errors import SettingsError
from scanfab.base.files import named_errors
from scanfab.table.columns import columns_of

__all__ = ["FILE_FORMATS", "Excerpt", "RowWriter", "check_suffix", "row_writer"]

# with so many digits every number reads back the same
ALL_DIGITS = 17

FILE_FORMATS = {
    ".csv": "comma-separated values; numbers read back the same, a missing value is an empty cell",
    ".tsv": "the same with tabs",
    ".json": "one array of objects; a missing value is null",
    ".jsonl": "JSON lines: one object a line",
    ".parquet": "Apache Parquet (needs pyarrow: pip install 'scanfab[parquet]')",
}


@dataclass(frozen=True)
class Excerpt:
    """Which columns of a table are written, and with how many digits."""

    fields: tuple[str, ...] = ()
    """In the order in which they are written; none: all, as the table has them."""
    digits: int = ALL_DIGITS
    """Significant ones, of floats; with 17 the shortest form that reads back the same."""

    @classmethod
    def make(cls, kind: type, fields_text: str | None, digits: int = ALL_DIGITS) -> Excerpt:
        """
        What users ask for, of rows of a kind.

        Raises
        ------
        SettingsError
            If there is no such column, or no such number of digits.

        Examples
        --------
        >>> from scanfab.table.table import Row
        >>> from scanfab.table.writing import Excerpt
        >>> Excerpt.make(Row, "strain,alpha_vs_axial").fields
        ('strain', 'alpha_vs_axial')
        """
        if not 1 <= digits <= ALL_DIGITS:
            raise SettingsError(f"digits: expected 1 to {ALL_DIGITS} of them, found {digits}")
        if fields_text is None:
            return cls(digits=digits)
        names = tuple(name.strip() for name in fields_text.split(","))
        known = [column.name for column in columns_of(kind)]
        for name in names:
            if name not in known:
                raise SettingsError(f"fields: {no_column(name, known)}")
            if names.count(name) > 1:
                raise SettingsError(f"fields: the column {name} is named more than once")
        return cls(names, digits)

    @property
    def is_all(self) -> bool:
        """Whether nothing is left out."""
        return self == Excerpt()

    def of(self, row: Any) -> dict[str, Any]:
        """The columns of a row that are written, by name."""
        values = dict(row)
        if self.fields:
            values = {name: values[name] for name in self.fields}
        if self.digits == ALL_DIGITS:
            return values
        return {name: self._rounded(value) for name, value in values.items()}

    def asked(self) -> dict[str, Any]:
        """What differs from the default, as a manifest lists it."""
        asked: dict[str, Any] = {"fields": list(self.fields)} if self.fields else {}
        return asked if self.digits == ALL_DIGITS else {**asked, "digits": self.digits}

    def _rounded(self, value: Any) -> Any:
        return float(f"{value:.{self.digits}g}") if isinstance(value, float) else value


ALL = Excerpt()


class RowWriter(Protocol):
    """Writes rows, which are of one kind, to a stream."""

    def write(self, row: Any) -> None:
        """Write one row."""
        ...

    def close(self) -> None:
        """Write what comes after the last row; the stream stays open."""
        ...


class CsvWriter:
    """
    Rows as CSV or TSV, each at once.

    The header comes with the first row: a computation that fails before writes nothing. Floats are
    in the shortest form that reads back the same.
    """

    def __init__(
        self, stream: IO[str], delimiter: str = ",", header: bool = True, excerpt: Excerpt = ALL
    ) -> None:
        self.stream = stream
        self.excerpt = excerpt
        self._writer = csv.writer(stream, delimiter=delimiter, lineterminator="\n")
        self._header = header

    def write(self, row: Any) -> None:
        """Write one row."""
        values = self.excerpt.of(row)
        cells = [
            "" if value is None else repr(float(value)) if isinstance(value, float) else value
            for value in values.values()
        ]
        with _named_after(self.stream):
            if self._header:
                self._writer.writerow(values)
                self._header = False
            self._writer.writerow(cells)
            self.stream.flush()

    def close(self) -> None:
        """Nothing comes after the last row."""


class JsonLinesWriter:
    """Rows as JSON, one object a line."""

    def __init__(self, stream: IO[str], excerpt: Excerpt = ALL) -> None:
        self.stream = stream
        self.excerpt = excerpt

    def write(self, row: Any) -> None:
        """Write one row."""
        values = self.excerpt.of(row)
        text = json.dumps(values, ensure_ascii=False, allow_nan=False) + "\n"
        with _named_after(self.stream):
            self.stream.write(text)
            self.stream.flush()

    def close(self) -> None:
        """Nothing comes after the last row."""


class JsonWriter:
    """Rows as one JSON array."""

    def __init__(self, stream: IO[str], excerpt: Excerpt = ALL) -> None:
        self.stream = stream
        self.excerpt = excerpt
        self._before = "[\n"

    def write(self, row: Any) -> None:
        """Write one row."""
        text = json.dumps(self.excerpt.of(row), ensure_ascii=False, allow_nan=False)
        self.stream.write(self._before + text)
        self._before = ",\n"

    def close(self) -> None:
        """The end of the array."""
        self.stream.write("\n]\n" if self._before != "[\n" else "[]\n")


class ParquetWriter:
    """Rows as a Parquet file, written when closed."""

    def __init__(self, stream: IO[bytes], kind: type, excerpt: Excerpt = ALL) -> None:
        self.stream = stream
        self.kind = kind
        self.excerpt = excerpt
        self._rows: list[dict[str, Any]] = []

    def write(self, row: Any) -> None:
        """Keep one row."""
        self._rows.append(self.excerpt.of(row))

    def close(self) -> None:
        """Write the file."""
        pyarrow = _pyarrow()
        from pyarrow import parquet

        kinds = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
        columns = {column.name: kinds[column.kind] for column in columns_of(self.kind)}
        names = self.excerpt.fields or columns
        schema = pyarrow.schema([(name, columns[name]) for name in names])
        parquet.write_table(pyarrow.Table.from_pylist(self._rows, schema=schema), self.stream)


def row_writer(
    suffix: str, stream: IO[Any], kind: type, header: bool = True, excerpt: Excerpt = ALL
) -> RowWriter:
    """
    The writer for a file of this suffix.

    Parameters
    ----------
    suffix : str
        One of ``FILE_FORMATS``.
    stream : file object
        For text, for ``.parquet`` for bytes.
    kind : type
        The class of the rows.
    header : bool, optional
        Whether CSV and TSV start with the names of the columns.
    excerpt : Excerpt, optional
        Which columns, and how many digits.

    Raises
    ------
    SettingsError
        If there is no such format, or its package is missing.
    """
    if suffix in (".csv", ".tsv"):
        return CsvWriter(stream, "\t" if suffix == ".tsv" else ",", header, excerpt)
    if suffix == ".jsonl":
        return JsonLinesWriter(stream, excerpt)
    if suffix == ".json":
        return JsonWriter(stream, excerpt)
    check_suffix(Path(f"table{suffix}"))
    return ParquetWriter(stream, kind, excerpt)


def _named_after(stream: IO[Any]) -> AbstractContextManager[None]:
    name = str(getattr(stream, "name", ""))
    return named_errors("standard output" if name == "<stdout>" else name)


def check_suffix(path: Path) -> None:
    """SettingsError if results cannot be written to a file of this name."""
    if path.suffix.lower() not in FILE_FORMATS:
        raise SettingsError(
            f"{path}: results can be written as {', '.join(FILE_FORMATS)}, "
            f"not as {path.suffix or 'a file without a suffix'}"
        )
    if path.suffix.lower() == ".parquet":
        _pyarrow()


def _pyarrow() -> Any:
    try:
        import pyarrow
    except ImportError:
        raise SettingsError(
            "Parquet files need the package pyarrow: pip install 'scanfab[parquet]'"
        ) from None
    return pyarrow
