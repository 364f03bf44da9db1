"""Writing rows to a stream or a file, with chosen columns and digits."""

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
    """Names of columns in the order in which they are written; if empty, all of the table."""
    digits: int = DEFAULT_DIGITS
    """Significant digits of floats; with 17 the shortest text that reads back the same."""

    @classmethod
    def make(
        cls,
        columns: Sequence[Column],
        fields: str | Sequence[str] | None = None,
        digits: int = DEFAULT_DIGITS,
    ) -> Excerpt:
        """
        An excerpt by the options of users.

        ``fields`` are names out of ``columns``, as a sequence or as a text with commas.

        Raises
        ------
        SettingsError
            If there is no such column, or no such number of digits.

        Examples
        --------
        >>> from scanfab.table.columns import table_columns
        >>> from scanfab.table.writing import Excerpt
        >>> Excerpt.make(table_columns(), "strain,alpha_vs_axial").fields
        ('strain', 'alpha_vs_axial')
        """
        expected = f"1 to {DEFAULT_DIGITS} of them"
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
                raise SettingsError(f"fields: the column {name} is named more than once")
        return cls(names, digits)

    def columns(self, columns: Sequence[Column]) -> list[Column]:
        """The columns that are written, in their order."""
        by_name = {column.name: column for column in columns}
        return [by_name[name] for name in self.fields or by_name]

    def of(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """The values of a row that are written, by column."""
        values = {name: plain(row[name]) for name in self.fields or row}
        for name, value in values.items():
            if isinstance(value, float):
                rounded = float(f"{value:.{self.digits}g}")
                # the largest of all floats would be rounded to infinity
                values[name] = rounded if math.isfinite(rounded) else value
        return values

    def asked(self) -> dict[str, Any]:
        """The options that differ from their defaults, for the manifest."""
        asked: dict[str, Any] = {"fields": list(self.fields)} if self.fields else {}
        return asked if self.digits == DEFAULT_DIGITS else {**asked, "digits": self.digits}


def plain(value: Any) -> Any:
    """A value as all formats can write it: numpy's as Python's, and None if it is not finite."""
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
    """
    Write rows to a stream, which is of text or of bytes, as the format has it.

    A format whose cells hold one value leaves out the columns of lists; SettingsError if all that
    is asked for are lists.
    """
    asked = excerpt.columns(columns)
    if not getattr(table_format, "holds_lists", False):
        kept = [one for one in asked if one.kind is not list]
        if asked and not kept:
            lists = ", ".join(one.name for one in asked)
            raise SettingsError(f"fields: {lists} are lists of numbers: write .json or .jsonl")
        asked, excerpt = kept, replace(excerpt, fields=tuple(one.name for one in kept))
    table_format.write(stream, map(excerpt.of, rows), asked)


def check_output(path: Path) -> None:
    """SettingsError if no table can be written to a file of this name."""
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
    Write a table to a file, which is complete or untouched.

    A manifest is written when the table is complete, just before the file appears, so that a table
    with a manifest is always finished. Without a manifest, that of an earlier table is removed.
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
    """Where the manifest of a table is, if it has one."""
    return table.with_name(f"{table.name}.manifest.json")
