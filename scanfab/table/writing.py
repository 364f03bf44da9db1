"""Write rows to a stream or a file, with chosen columns and digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np

from scanfab.base.column import DEFAULT_DIGITS, Column, no_column
from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder, whole_file
from scanfab.base.option import unusable, whole
from scanfab.table.formats import TableFormat, format_of


@dataclass(frozen=True)
class Excerpt:
    """Which columns of a table are written, and with how many digits."""

    fields: tuple[str, ...] = ()
    """Names of the columns in the order of the file; empty for all columns of the table."""
    digits: int = DEFAULT_DIGITS
    """Significant digits of floats; 17: the shortest text that reads back to the same number."""

    @classmethod
    def make(
        cls,
        columns: Sequence[Column],
        fields: str | Sequence[str] | None = None,
        digits: int = DEFAULT_DIGITS,
    ) -> Excerpt:
        """
        Make an excerpt from the options of users.

        ``fields`` are names of ``columns``: a sequence, or a text with commas.

        Raises
        ------
        SettingsError
            If a column does not exist, or the number of digits is not from 1 to 17.

        Examples
        --------
        >>> from scanfab.table.columns import table_columns
        >>> from scanfab.table.writing import Excerpt
        >>> Excerpt.make(table_columns(), "strain,alpha_vs_axial").fields
        ('strain', 'alpha_vs_axial')
        """
        expected = f"a number from 1 to {DEFAULT_DIGITS}"
        digits = int(whole(expected, lambda count: 1 <= count <= DEFAULT_DIGITS)("digits", digits))
        if fields is None:
            return cls(digits=digits)
        if isinstance(fields, str):
            fields = [name.strip() for name in fields.split(",")]
        if not isinstance(fields, Iterable) or not (names := tuple(fields)):
            raise unusable("fields", "names of columns", fields)
        known = [column.name for column in columns]
        for name in names:
            if name not in known:
                raise SettingsError(f"fields: {no_column(name, known)}")
            if names.count(name) > 1:
                raise SettingsError(f"fields: the column {name} is listed more than once")
        return cls(names, digits)

    def columns(self, columns: Sequence[Column]) -> list[Column]:
        """The columns to write, in the order of the file."""
        by_name = {column.name: column for column in columns}
        return [by_name[name] for name in self.fields or by_name]

    def of(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """The values of a row to write, by column."""
        values = {name: plain(row[name]) for name in self.fields or row}
        for name, value in values.items():
            if isinstance(value, float):
                rounded = float(f"{value:.{self.digits}g}")
                # rounding must not turn the largest floats into infinity
                values[name] = rounded if math.isfinite(rounded) else value
        return values

    def asked(self) -> dict[str, Any]:
        """Options that differ from their defaults, for the manifest."""
        options: dict[str, Any] = {"fields": list(self.fields)} if self.fields else {}
        return options if self.digits == DEFAULT_DIGITS else {**options, "digits": self.digits}


def plain(value: Any) -> Any:
    """A value that all formats can write: numpy becomes Python, NaN and infinity become None."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


ALL = Excerpt()


def write_to(
    stream: IO[Any],
    table_format: TableFormat,
    rows: Iterable[Mapping[str, Any]],
    columns: Sequence[Column],
    excerpt: Excerpt = ALL,
) -> None:
    """
    Write rows to a stream of text or bytes, whichever the format needs.

    Columns of lists are left out if the cells of the format cannot hold lists. If no column
    remains, SettingsError is raised.
    """
    chosen = excerpt.columns(columns)
    if not getattr(table_format, "holds_lists", False):
        kept = [column for column in chosen if column.kind is not list]
        if chosen and not kept:
            lists = ", ".join(column.name for column in chosen)
            raise SettingsError(f"fields: .csv and .tsv cannot hold lists of numbers: {lists}")
        chosen, excerpt = kept, replace(excerpt, fields=tuple(column.name for column in kept))
    table_format.write(stream, map(excerpt.of, rows), chosen)


def check_output(path: Path) -> None:
    """Raise SettingsError if no table can be written to a file of this name."""
    format_of(path)
    check_folder(path)


def write_rows(
    path: Path,
    rows: Iterable[Mapping[str, Any]],
    columns: Sequence[Column],
    excerpt: Excerpt = ALL,
    write_manifest: Callable[[], object] | None = None,
) -> None:
    """
    Write a table to a file; on an error the file stays as it was.

    The manifest is written when the table is complete, just before the file appears, so a table
    with a manifest is always complete. Without ``write_manifest``, the manifest of an earlier table
    is removed.
    """
    check_output(path)
    table_format = format_of(path)
    text: Any = {"mode": "w", "newline": "", "encoding": "utf-8"}
    way = text if table_format.is_text else {"mode": "wb"}
    with whole_file(path) as part:
        with open(part, **way) as stream:
            write_to(stream, table_format, rows, columns, excerpt)
        if write_manifest is not None:
            write_manifest()
        else:
            manifest_of(path).unlink(missing_ok=True)


def manifest_of(table: Path) -> Path:
    """Path of the manifest of a table."""
    return table.with_name(f"{table.name}.manifest.json")
