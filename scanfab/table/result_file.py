"""
A result file that is complete or untouched, and that an interrupted computation can go on with.

Rows go to FILE.part as JSON lines with all columns and digits. At the end they are written as FILE.
The settings of the run, and what the input files of each frame held, go to FILE.manifest.json.part,
so that nobody goes on with other settings or other files. No finished row is ever lost: a part that
a new run does not go on with is kept under another name, and a part that another run writes to is
left alone. The manifest of FILE is written before FILE, as FILE.manifest.json.new, so that a run
that is killed in its last moment leaves no table without a manifest.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from scanfab.base.column import Column
from scanfab.base.ending import undone_at_end
from scanfab.base.errors import ReadError, ScanfabNote, SettingsError
from scanfab.base.files import check_folder, kind_of, locked, named_errors, whole_file
from scanfab.table.columns import columns_of
from scanfab.table.formats import JsonLines, format_of, json_line
from scanfab.table.writing import ALL, Excerpt, write_rows


class PartWriter:
    """Writes rows to FILE.part, each as soon as it comes."""

    def __init__(self, stream: IO[str]) -> None:
        self.stream = stream

    def write(self, row: Mapping[str, Any]) -> None:
        """Write one row."""
        self.stream.write(json_line(ALL.of(row)) + "\n")
        self.stream.flush()


class ResultFile:
    """
    A file for rows of one kind.

    Parameters
    ----------
    path : Path
        Its suffix is the format.
    kind : type or sequence of Column
        The class of the rows, or their columns.
    excerpt : Excerpt, optional
        Which columns of them are written, and with how many digits.

    Raises
    ------
    SettingsError
        If the suffix is not known, or there is no such folder.
    """

    def __init__(self, path: Path, kind: type | Sequence[Column], excerpt: Excerpt = ALL) -> None:
        format_of(path)
        check_folder(path)
        self.path = path
        self.kind = kind
        self.excerpt = excerpt
        self.part = path.with_name(path.name + ".part")
        self.manifest, self._coming = _manifests(path)
        self._record = path.with_name(self.manifest.name + ".part")
        self._lock: IO[bytes] | None = None
        for one in (self.part, self._record):
            if (found := kind_of(one)) is not None:
                raise SettingsError(
                    f"{one}: is {found}, expected a file or nothing, as rows are kept there until "
                    f"{path.name} is complete: remove it, or name another `output=FILE`"
                )

    @property
    def has_part(self) -> bool:
        """Whether an earlier run has left something in FILE.part."""
        return self.part.exists() and self.part.stat().st_size > 0

    @property
    def has_table(self) -> bool:
        """Whether an earlier run has made FILE, with its manifest."""
        return self.path.is_file() and self.manifest.is_file()

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other runs away from FILE.part; a ScanfabError if one writes to it."""
        if self._lock is not None:
            yield
            return
        self._settle()
        with locked(self.part) as self._lock, undone_at_end(self._remove_empty_part):
            try:
                yield
            finally:
                self._remove_empty_part()
                self._lock = None

    def finished_rows(
        self, asked: dict[str, Any], rows_per_frame: int, usual: Mapping[str, Any] | None = None
    ) -> list[dict[str, Any]]:
        """
        The rows of the finished frames in FILE.part, which is cut behind them; none without it.

        Parameters
        ----------
        asked : dict
            What is asked for now.
        rows_per_frame : int
            A frame with fewer rows is not finished.
        usual : mapping, optional
            Settings that hold where FILE.part says nothing of them, as they are newer than it.

        Raises
        ------
        SettingsError
            If FILE.part was made with other settings.
        ReadError
            If what stands beside it is damaged.
        """
        if not self.has_part:
            return []
        before, _ = self._recorded()
        differing = differing_settings({**(usual or {}), **before}, asked)
        if differing:
            raise SettingsError(
                f"{self.part}: was made with other settings ({', '.join(differing)}): repeat "
                f"them, or leave out `resume` to start afresh; then it is kept under another name"
            )
        complete = self._lines_of_part()
        kept = complete[: len(complete) // rows_per_frame * rows_per_frame]
        with open(self.part, "r+b") as stream:
            stream.truncate(sum(map(len, kept)))
        return self._rows()

    def recorded_inputs(self) -> list[dict[str, Any]]:
        """What the files of the frames in FILE.part held."""
        return self._recorded()[1]

    @contextmanager
    def writer(
        self,
        asked: dict[str, Any],
        resume: bool = False,
        save_manifest: Callable[[Path], object] = lambda path: None,
    ) -> Iterator[PartWriter]:
        """Write rows to FILE.part, behind those that are there if resumed; then make FILE of it."""
        with self.alone():
            going_on = resume and self.has_part
            inputs = self.recorded_inputs() if going_on else []
            if not going_on:
                # before its settings are overwritten: rows of others must not look like these
                self._put_part_aside()
            self._coming.unlink(missing_ok=True)
            self._begin_record(asked, inputs)
            with named_errors(self.part), open(self.part, "a", encoding="utf-8") as stream:
                yield PartWriter(stream)
            save_manifest(self._coming)
            # the manifest that stands there is of the table that was FILE before
            self.manifest.unlink(missing_ok=True)
            write_rows(self.path, self._rows(), columns_of(self.kind), self.excerpt)
            self._remove_part()
            self._settle()
            self._record.unlink(missing_ok=True)

    def save(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Write rows that are all there."""
        with self.writer({}) as writer:
            for row in rows:
                writer.write(row)

    def record(self, inputs: Sequence[Mapping[str, Any]]) -> None:
        """Keep what files held, before rows come that are of them."""
        if not inputs:
            return
        lines = "".join(json.dumps(one) + "\n" for one in inputs)
        with named_errors(self._record), open(self._record, "a", encoding="utf-8") as stream:
            stream.write(lines)

    def _lines_of_part(self) -> list[bytes]:
        """The rows that were written to their end."""
        lines = self.part.read_bytes().splitlines(keepends=True)
        return [line for line in lines if line.endswith(b"\n")]

    def _put_part_aside(self) -> None:
        """Keep what FILE.part holds under another name, so that a resumed run can find it."""
        if rows := len(self._lines_of_part()):
            self._copy_aside(rows)
        # not moved: it is this very file that other runs find locked
        os.truncate(self.part, 0)

    def _copy_aside(self, rows: int) -> None:
        other, number = self, 0
        while other.path.exists() or other.part.exists():
            number += 1
            name = f"{self.path.stem}.{number}{self.path.suffix}"
            other = ResultFile(self.path.with_name(name), self.kind, self.excerpt)
        hint = ""
        if self._record.exists():
            shutil.copyfile(self._record, other._record)
            hint = f"; what made it goes on with it by `output={other.path}` `resume`"
        with whole_file(other.part) as copy:
            shutil.copyfile(self.part, copy)
        warnings.warn(
            f"{self.part}: {rows} finished rows of an earlier run are kept as {other.part}{hint}",
            ScanfabNote,
            stacklevel=5,
        )

    def _settle(self) -> None:
        """Finish what a run that was killed behind its last row has left to do."""
        if is_finished(self.path) and self._coming.exists() and not self.manifest.exists():
            # another process may do it at the same time
            with suppress(FileNotFoundError):
                self.part.unlink(missing_ok=True)
                self._record.unlink(missing_ok=True)
                os.replace(self._coming, self.manifest)

    def _remove_part(self) -> None:
        if self._holds_part():
            if sys.platform == "win32" and self._lock is not None:
                self._lock.close()  # Windows removes no file that is open
            self.part.unlink()

    def _remove_empty_part(self) -> None:
        """Without a row there is nothing to go on with."""
        if self._holds_part() and not self.part.stat().st_size:
            self._remove_part()
            self._record.unlink(missing_ok=True)

    def _holds_part(self) -> bool:
        """Whether FILE.part is still ours: once it has become FILE, the next run may have one."""
        if self._lock is None or self._lock.closed or not self.part.exists():
            return False
        return os.path.samestat(os.fstat(self._lock.fileno()), self.part.stat())

    def _begin_record(self, asked: dict[str, Any], inputs: list[dict[str, Any]]) -> None:
        """Whole or not at all, as the process may be killed here too."""
        with whole_file(self._record) as part:
            lines = [json.dumps(one) + "\n" for one in ({"settings": asked}, *inputs)]
            part.write_text("".join(lines), "utf-8")

    def _recorded(self) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Settings and inputs of the rows in FILE.part."""
        if not self._record.exists():
            return {}, []
        try:
            lines = self._record.read_text("utf-8").splitlines(keepends=True)
            # an entry that was not written to its end is of a frame that has no rows
            first, *inputs = [json.loads(one) for one in lines if one.endswith("\n")]
            settings = first["settings"]
            if not all(isinstance(one, dict) for one in (settings, *inputs)):
                raise TypeError
        except (ValueError, TypeError, KeyError, IndexError, RecursionError):
            raise ReadError(
                f"{self._record}: expected what an interrupted run has kept there of its settings "
                f"and inputs, found something else: leave out `resume` to start afresh; then "
                f"{self.part.name} is kept under another name"
            ) from None
        return settings, inputs

    def _rows(self) -> list[dict[str, Any]]:
        return JsonLines().read(self.part.read_bytes(), str(self.part))


def is_finished(table: Path) -> bool:
    """Whether FILE is the table of the last run: FILE.part is gone, or its rows are in FILE."""
    part = table.with_name(table.name + ".part")
    if not table.exists() or not part.exists():
        return table.exists()
    settled, coming = _manifests(table)
    is_newer = table.stat().st_mtime_ns >= part.stat().st_mtime_ns
    return is_newer and coming.exists() and not settled.exists()


def manifest_of(table: Path) -> Path:
    """Where the manifest of a table is, if it has one: it may still wait for its name."""
    settled, coming = _manifests(table)
    return coming if is_finished(table) and coming.exists() and not settled.exists() else settled


def _manifests(table: Path) -> tuple[Path, Path]:
    """The manifest of a table, and the one of the table that is being made."""
    settled = table.with_name(table.name + ".manifest.json")
    return settled, settled.with_name(settled.name + ".new")


def differing_settings(
    before: dict[str, Any], asked: dict[str, Any], but: tuple[str, ...] = ()
) -> list[str]:
    """The names of the settings that differ, in alphabetical order, ``but`` for some."""
    # through JSON, as tuples come back as lists
    now = json.loads(json.dumps(asked))
    names = {*before, *now}.difference(but)
    return sorted(
        "version of scanfab" if name == "scanfab" else name
        for name in names
        if before.get(name) != now.get(name)
    )
