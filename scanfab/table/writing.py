"""Rows of a table to a stream or a file, in any format, all columns and digits or some."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np

from scanfab.base.column import ALL_DIGITS, DEFAULT_DIGITS, Column, no_column
from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder, whole_file
from scanfab.base.option import unusable, whole
from scanfab.table.columns import columns_of
from scanfab.table.formats import TableFormat, format_of


@dataclass(frozen=True)
class Excerpt:
    """Which columns of a table are written, and with how many digits."""

    fields: tuple[str, ...] = ()
    """In the order in which they are written; none: all, as the table has them."""
    digits: int = DEFAULT_DIGITS
    """Significant ones, of floats; with 17 the shortest form that reads back the same."""

    @classmethod
    def make(
        cls,
        columns: type | Sequence[Column],
        fields: str | Sequence[str] | None = None,
        digits: int = DEFAULT_DIGITS,
    ) -> Excerpt:
        """
        What users ask for, of some columns or of those of a kind of rows.

        ``fields`` are their names, one by one or separated by commas.

        Raises
        ------
        SettingsError
            If there is no such column, or no such number of digits.

        Examples
        --------
        >>> from scanfab import Row
        >>> from scanfab.table.writing import Excerpt
        >>> Excerpt.make(Row, "strain,alpha_vs_axial").fields
        ('strain', 'alpha_vs_axial')
        """
        expected = f"1 to {ALL_DIGITS} of them"
        digits = int(whole(expected, lambda count: 1 <= count <= ALL_DIGITS)("digits", digits))
        if fields is None:
            return cls(digits=digits)
        names = _names(fields)
        known = [column.name for column in columns_of(columns)]
        for name in names:
            if name not in known:
                raise SettingsError(f"fields: {no_column(name, known)}")
            if names.count(name) > 1:
                raise SettingsError(f"fields: the column {name} is named more than once")
        return cls(names, digits)

    @property
    def is_all(self) -> bool:
        """Whether nothing is left out."""
        return not self.fields and self.digits == ALL_DIGITS

    def without_lists(self, columns: Sequence[Column]) -> Excerpt:
        """
        The same for a format whose cells hold one value.

        Raises
        ------
        SettingsError
            If all that is asked for are lists.
        """
        lists = {column.name for column in columns if column.kind is list}
        if not lists:
            return self
        fields = self.fields or tuple(column.name for column in columns)
        kept = tuple(name for name in fields if name not in lists)
        if not kept:
            raise SettingsError(
                f"fields: {', '.join(fields)} are lists of numbers: write JSON (.json or .jsonl)"
            )
        return replace(self, fields=kept)

    def columns(self, columns: Sequence[Column]) -> list[Column]:
        """Those that are written, in their order."""
        by_name = {column.name: column for column in columns}
        return [by_name[name] for name in self.fields or by_name]

    def of(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """The columns of a row that are written, by name."""
        values = {name: plain(row[name]) for name in self.fields or row}
        if self.digits == ALL_DIGITS:
            return values
        return {name: self._rounded(value) for name, value in values.items()}

    def asked(self) -> dict[str, Any]:
        """What differs from the default, as a manifest lists it."""
        asked: dict[str, Any] = {"fields": list(self.fields)} if self.fields else {}
        return asked if self.digits == DEFAULT_DIGITS else {**asked, "digits": self.digits}

    def _rounded(self, value: Any) -> Any:
        if not isinstance(value, float):
            return value
        rounded = float(f"{value:.{self.digits}g}")
        # the largest of all floats would be rounded to infinity
        return rounded if math.isfinite(rounded) else value


def _names(fields: str | Sequence[str]) -> tuple[str, ...]:
    if isinstance(fields, str):
        return tuple(name.strip() for name in fields.split(","))
    if not isinstance(fields, Iterable) or not (names := tuple(fields)):
        raise unusable("fields", "names of columns", fields)
    return names


def plain(value: Any) -> Any:
    """A value as all formats can write it: of Python's own kinds, None for what is not finite."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


ALL = Excerpt()


def write_to(
    stream: IO[Any],
    table_format: TableFormat,
    rows: Iterable[Mapping[str, Any]],
    columns: Sequence[Column],
    excerpt: Excerpt = ALL,
) -> None:
    """Write rows to a stream, which is of text or of bytes, as the format has it."""
    if not getattr(table_format, "holds_lists", False):
        excerpt = excerpt.without_lists(columns)
    table_format.write(stream, map(excerpt.of, rows), excerpt.columns(columns))


def write_rows(
    path: Path, rows: Iterable[Mapping[str, Any]], columns: Sequence[Column], excerpt: Excerpt = ALL
) -> None:
    """Write a table to a file, which is complete or untouched."""
    table_format = format_of(path)
    check_folder(path)
    mode = "w" if table_format.is_text else "wb"
    text: Any = {"newline": "", "encoding": "utf-8"} if table_format.is_text else {}
    with whole_file(path) as part, open(part, mode, **text) as stream:
        write_to(stream, table_format, rows, columns, excerpt)
