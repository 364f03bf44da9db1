"""
Rows of a table to a stream, a file, or a result file that an interrupted run can go on with.

Rows of a computation go to FILE.part as JSON lines with all columns and digits. At the end they are
written as FILE. The settings of the run, and what the input files of each frame held, go to
FILE.manifest.json.part, so that nobody goes on with other settings or other files. No finished row
is ever lost: a part that a new run does not go on with is kept under another name, and a part that
another run writes to is left alone. FILE appears after its manifest, in one step, and FILE.part is
removed last. So a run is finished once FILE is there and not older than FILE.part.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import IO, Any

import numpy as np

from scanfab.base.column import DEFAULT_DIGITS, Column, no_column
from scanfab.base.ending import undone_at_end
from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.files import check_folder, kind_of, locked, named_errors, whole_file
from scanfab.base.option import unusable, whole
from scanfab.table.formats import JsonLines, TableFormat, format_of, json_line


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
        columns: Sequence[Column],
        fields: str | Sequence[str] | None = None,
        digits: int = DEFAULT_DIGITS,
    ) -> Excerpt:
        """
        What users ask for, of some columns.

        ``fields`` are their names, one by one or separated by commas.

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

    def for_format(self, table_format: TableFormat, columns: Sequence[Column]) -> Excerpt:
        """
        The same without the columns of lists, for a format whose cells hold one value.

        Raises
        ------
        SettingsError
            If all that is asked for are lists.
        """
        if getattr(table_format, "holds_lists", False):
            return self
        kept = tuple(one.name for one in self.columns(columns) if one.kind is not list)
        if columns and not kept:
            lists = ", ".join(one.name for one in self.columns(columns))
            raise SettingsError(f"fields: {lists} are lists of numbers: write .json or .jsonl")
        return replace(self, fields=kept)

    def columns(self, columns: Sequence[Column]) -> list[Column]:
        """Those that are written, in their order."""
        by_name = {column.name: column for column in columns}
        return [by_name[name] for name in self.fields or by_name]

    def of(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """The columns of a row that are written, by name."""
        values = {name: plain(row[name]) for name in self.fields or row}
        for name, value in values.items():
            if isinstance(value, float):
                rounded = float(f"{value:.{self.digits}g}")
                # the largest of all floats would be rounded to infinity
                values[name] = rounded if math.isfinite(rounded) else value
        return values

    def asked(self) -> dict[str, Any]:
        """What differs from the default, as a manifest lists it."""
        asked: dict[str, Any] = {"fields": list(self.fields)} if self.fields else {}
        return asked if self.digits == DEFAULT_DIGITS else {**asked, "digits": self.digits}


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
    excerpt = excerpt.for_format(table_format, columns)
    table_format.write(stream, map(excerpt.of, rows), excerpt.columns(columns))


def write_rows(
    path: Path, rows: Iterable[Mapping[str, Any]], columns: Sequence[Column], excerpt: Excerpt = ALL
) -> None:
    """Write a table to a file, which is complete or untouched."""
    with prepared_table(path, rows, columns, excerpt):
        pass


@contextmanager
def prepared_table(
    path: Path, rows: Iterable[Mapping[str, Any]], columns: Sequence[Column], excerpt: Excerpt = ALL
) -> Iterator[None]:
    """Write a table under another name; at the end of the block it becomes the file."""
    table_format = format_of(path)
    check_folder(path)
    text: Any = {"mode": "w", "newline": "", "encoding": "utf-8"}
    way = text if table_format.is_text else {"mode": "wb"}
    with whole_file(path) as part:
        with open(part, **way) as stream:
            write_to(stream, table_format, rows, columns, excerpt)
        yield


class ResultFile:
    """
    A file for rows, which is complete or untouched.

    Parameters
    ----------
    path : Path
        Its suffix is the format.
    columns : sequence of Column
        What the rows hold.
    excerpt : Excerpt, optional
        Which columns of them are written, and with how many digits.

    Raises
    ------
    SettingsError
        If the suffix is not known, or there is no such folder.
    """

    _stream: IO[str]

    def __init__(self, path: Path, columns: Sequence[Column], excerpt: Excerpt = ALL) -> None:
        format_of(path)
        check_folder(path)
        self.path, self.columns, self.excerpt = path, columns, excerpt
        self.part, self.manifest = part_of(path), manifest_of(path)
        self._record = part_of(self.manifest)
        self._lock: IO[bytes] | None = None
        for one in (self.part, self._record):
            if found := kind_of(one):
                raise SettingsError(
                    f"{one}: is {found}, expected a file or nothing: remove it, or name another "
                    f"`output=FILE`"
                )

    @property
    def has_part(self) -> bool:
        """Whether an earlier run has left rows in FILE.part."""
        return self.part.exists() and self.part.stat().st_size > 0

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other runs away from FILE.part; a ScanfabError if one writes to it."""
        if self._lock is not None:
            yield
            return
        with locked(self.part) as self._lock, undone_at_end(self._remove_empty_part):
            try:
                yield
            finally:
                self._remove_empty_part()
                self._lock = None

    def finished_rows(
        self, asked: dict[str, Any], rows_per_frame: int, usual: Mapping[str, Any] | None = None
    ) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
        """
        The rows of the finished frames in FILE.part, which is cut behind them, and their inputs.

        Parameters
        ----------
        asked : dict
            The settings of this run.
        rows_per_frame : int
            A frame with fewer rows is not finished.
        usual : mapping, optional
            The values of settings that are newer than FILE.part.

        Raises
        ------
        SettingsError
            If FILE.part was made with other settings.
        ReadError
            If FILE.part, or the record beside it, is damaged.
        """
        before, inputs = self._recorded()
        if differing := differing_settings({**(usual or {}), **before}, asked):
            raise SettingsError(
                f"{self.part}: was made with other settings ({', '.join(differing)}): repeat "
                f"them, or leave out `resume` to start afresh; then it is kept under another name"
            )
        lines = _whole_lines(self.part)
        kept = lines[: len(lines) // rows_per_frame * rows_per_frame]
        os.truncate(self.part, sum(map(len, kept)))
        return JsonLines().read(b"".join(kept), str(self.part)) if kept else [], inputs

    @contextmanager
    def writer(self, asked: dict[str, Any], resume: bool = False) -> Iterator[ResultFile]:
        """Take rows for FILE.part in the block, behind those that are there if resumed."""
        with self.alone():
            going_on = resume and self.has_part
            inputs = self._recorded()[1] if going_on else []
            if not going_on:
                # before the new settings are written: the old rows must not look like rows of these
                self._put_part_aside()
            # whole or not at all, as the process may be killed here too
            with whole_file(self._record) as record:
                record.write_text(_json_lines([{"settings": asked}, *inputs]), "utf-8")
            with named_errors(self.part), open(self.part, "a", encoding="utf-8") as self._stream:
                yield self

    def write(self, row: Mapping[str, Any]) -> None:
        """Write a row to FILE.part, in the block of :meth:`writer`."""
        self._stream.write(json_line(ALL.of(row)) + "\n")
        self._stream.flush()

    def record(self, inputs: Sequence[Mapping[str, Any]]) -> None:
        """Keep size and hash of files, before rows come that are made of them."""
        if inputs:
            with named_errors(self._record), open(self._record, "a", encoding="utf-8") as stream:
                stream.write(_json_lines(inputs))

    def save(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Write FILE of rows that are all there; rows of an earlier run are kept."""
        with self.alone():
            self._put_part_aside()
            write_rows(self.path, rows, self.columns, self.excerpt)
            # that of the table that was FILE before
            self.manifest.unlink(missing_ok=True)

    def remove_part(self) -> None:
        """Remove FILE.part if it is ours: once it is gone, the next run may have one."""
        if self._lock is None or self._lock.closed or not self.part.exists():
            return
        if os.path.samestat(os.fstat(self._lock.fileno()), self.part.stat()):
            if sys.platform == "win32":
                self._lock.close()  # Windows removes no file that is open
            self.part.unlink()
            self._record.unlink(missing_ok=True)

    def _remove_empty_part(self) -> None:
        """Without a row there is nothing to go on with."""
        if not self.has_part:
            self.remove_part()

    def _put_part_aside(self) -> None:
        """Keep the rows of FILE.part under another name, so that a resumed run can find them."""
        if rows := len(_whole_lines(self.part)):
            names = (f"{self.path.stem}.{number}{self.path.suffix}" for number in count(1))
            others = (ResultFile(self.path.with_name(name), self.columns) for name in names)
            other = next(one for one in others if not (one.path.exists() or one.part.exists()))
            text = f"{rows} finished rows of an earlier run are kept as {other.part}"
            if self._record.exists():
                shutil.copyfile(self._record, other._record)
                text += f"; what made it goes on with it by `output={other.path}` `resume`"
            with whole_file(other.part) as copy:
                shutil.copyfile(self.part, copy)
            note(f"{self.part}: {text}")
        # not moved: other runs find this very file locked
        os.truncate(self.part, 0)

    def _recorded(self) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Settings and inputs of the rows in FILE.part."""
        if not self._record.exists():
            return {}, []
        try:
            # the last entry, if it was not written to its end, is of a frame without rows
            first, *inputs = map(json.loads, _whole_lines(self._record))
            settings = first["settings"]
            if not all(isinstance(one, dict) for one in (settings, *inputs)):
                raise TypeError
        except (ValueError, TypeError, KeyError, RecursionError):
            raise ReadError(
                f"{self._record}: expected what an interrupted run has kept there, found something "
                f"else: leave out `resume` to start afresh"
            ) from None
        return settings, inputs


def _json_lines(entries: Iterable[Mapping[str, Any]]) -> str:
    return "".join(json.dumps(one) + "\n" for one in entries)


def _whole_lines(path: Path) -> list[bytes]:
    """The lines of a file that were written to their end."""
    return [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]


def is_unfinished(path: Path) -> bool:
    """Whether a table has a FILE.part with rows that it lacks: rows come before their table."""
    part = part_of(path)
    if not part.exists():
        return False
    return not path.exists() or path.stat().st_mtime_ns < part.stat().st_mtime_ns


def part_of(path: Path) -> Path:
    """Where a file grows until it is complete."""
    return path.with_name(f"{path.name}.part")


def manifest_of(table: Path) -> Path:
    """Where the manifest of a table is, if it has one."""
    return table.with_name(f"{table.name}.manifest.json")


def differing_settings(
    before: dict[str, Any], asked: dict[str, Any], but: tuple[str, ...] = ()
) -> list[str]:
    """The names of the settings that differ, in alphabetical order, ``but`` for some."""
    # through JSON, as tuples come back as lists
    now = json.loads(json.dumps(asked))
    names = {*before, *now}.difference(but)
    differing = [name for name in names if before.get(name) != now.get(name)]
    return sorted("version of scanfab" if name == "scanfab" else name for name in differing)
