"""
A result file that is complete or untouched, and that an interrupted computation can go on with.

Rows go to FILE.part, which becomes FILE at the end. FILE.part is CSV, TSV or JSON lines as FILE is;
for other formats, and where not all columns or digits are wanted, it is JSON lines, and converted
at the end. What was asked for stands beside it in FILE.manifest.json.part, so that nobody goes on
with other settings. No finished row is ever lost: a part that a new run does not go on with is kept
under another name.
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from scanfab.base.ending import undone_at_end
from scanfab.base.errors import ScanfabNote, SettingsError
from scanfab.base.files import check_folder, named_errors, whole_file
from scanfab.table.writing import ALL, Excerpt, RowWriter, check_suffix, row_writer

__all__ = ["ResultFile", "differing_settings"]

LINE_FORMATS = (".csv", ".tsv", ".jsonl")


class ResultFile:
    """
    A file for rows of one kind.

    Parameters
    ----------
    path : Path
        Its suffix is the format.
    kind : type
        The dataclass of the rows.
    excerpt : Excerpt, optional
        Which columns of them are written, and with how many digits.

    Raises
    ------
    SettingsError
        If the suffix is not known, or there is no such folder.
    """

    def __init__(self, path: Path, kind: type, excerpt: Excerpt = ALL) -> None:
        check_suffix(path)
        check_folder(path)
        self.path = path
        self.kind = kind
        self.excerpt = excerpt
        self.suffix = path.suffix.lower()
        self.part = path.with_name(path.name + ".part")
        self.manifest = path.with_name(path.name + ".manifest.json")
        self._asked = path.with_name(self.manifest.name + ".part")
        as_it_is = self.suffix in LINE_FORMATS and excerpt.is_all
        self._part_suffix = self.suffix if as_it_is else ".jsonl"

    def finished_rows(self, asked: dict[str, Any], rows_per_frame: int) -> list[dict[str, Any]]:
        """
        The rows of the finished frames in FILE.part, which is cut behind them; none without it.

        Parameters
        ----------
        asked : dict
            What is asked for now.
        rows_per_frame : int
            A frame with fewer rows is not finished.

        Raises
        ------
        SettingsError
            If FILE.part was made with other settings.
        """
        if not self.part.exists():
            return []
        before = json.loads(self._asked.read_text("utf-8")) if self._asked.exists() else {}
        differing = differing_settings(before, asked)
        if differing:
            raise SettingsError(
                f"{self.part}: was made with other settings ({', '.join(differing)}): repeat "
                f"them, or leave out `resume` to start afresh; then it is kept under another name"
            )
        header, complete = self._lines_of_part()
        frames = max(len(complete) - header, 0) // rows_per_frame
        kept = complete[: header + frames * rows_per_frame] if frames else []
        with open(self.part, "r+b") as stream:
            stream.truncate(sum(map(len, kept)))
        return self._rows()

    @contextmanager
    def writer(self, asked: dict[str, Any], resume: bool = False) -> Iterator[RowWriter]:
        """Write rows to FILE.part, behind those that are there if resumed; then make FILE of it."""
        going_on = resume and self.part.exists() and self.part.stat().st_size > 0
        if not going_on:
            # before its settings are overwritten: rows of other settings must not look like these
            self._put_part_aside()
        self._write_asked(asked)
        try:
            with undone_at_end(self._remove_empty_part), self._open_part(going_on) as stream:
                yield row_writer(
                    self._part_suffix, stream, self.kind, not going_on, self._excerpt_of_part
                )
        except BaseException:
            self._remove_empty_part()
            raise
        # what stands there is of the table that was FILE before
        self.manifest.unlink(missing_ok=True)
        if self._part_suffix == self.suffix:
            os.replace(self.part, self.path)
        else:
            self._convert()
        self._asked.unlink(missing_ok=True)

    @property
    def _excerpt_of_part(self) -> Excerpt:
        return self.excerpt if self._part_suffix == self.suffix else ALL

    def _lines_of_part(self) -> tuple[int, list[bytes]]:
        """How many lines come before the first row, and all whole lines."""
        lines = self.part.read_bytes().splitlines(keepends=True)
        header = 0 if lines[:1] and lines[0].startswith(b"{") else 1
        return header, [line for line in lines if line.endswith(b"\n")]

    def _put_part_aside(self) -> None:
        """Keep FILE.part under another name if it holds rows, so that ``--resume`` can find it."""
        if not self.part.exists():
            return
        header, lines = self._lines_of_part()
        if len(lines) <= header:
            self.part.unlink()
            return
        other, number = self, 0
        while other.path.exists() or other.part.exists():
            number += 1
            name = f"{self.path.stem}.{number}{self.path.suffix}"
            other = ResultFile(self.path.with_name(name), self.kind, self.excerpt)
        hint = ""
        if self._asked.exists():
            shutil.copyfile(self._asked, other._asked)
            hint = f"; what made it goes on with it by `output={other.path}` `resume`"
        os.rename(self.part, other.part)
        warnings.warn(
            f"{self.part}: {len(lines) - header} finished rows of an earlier run are kept as "
            f"{other.part}{hint}",
            ScanfabNote,
            stacklevel=4,
        )

    @contextmanager
    def _open_part(self, going_on: bool) -> Iterator[IO[str]]:
        mode = "a" if going_on else "w"
        with named_errors(self.part), open(self.part, mode, newline="", encoding="utf-8") as stream:
            yield stream

    def _remove_empty_part(self) -> None:
        """Without a row there is nothing to go on with."""
        if self.part.exists() and not self.part.stat().st_size:
            self.part.unlink()
            self._asked.unlink()

    def _write_asked(self, asked: dict[str, Any]) -> None:
        """Whole or not at all, as the process may be killed here too."""
        with whole_file(self._asked) as part:
            part.write_text(json.dumps(asked, indent=1), "utf-8")

    def _rows(self) -> list[dict[str, Any]]:
        from scanfab.table.reading import read_rows

        return read_rows(self.part) if self.part.stat().st_size else []

    def _convert(self) -> None:
        """Write FILE from the JSON lines of FILE.part."""
        with whole_file(self.path) as final, _open_for(self.suffix, final) as stream:
            writer = row_writer(self.suffix, stream, self.kind, excerpt=self.excerpt)
            for row in self._rows():
                writer.write(self.kind(**row))
            writer.close()
        self.part.unlink()


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


def _open_for(suffix: str, path: Path) -> IO[Any]:
    if suffix == ".parquet":
        return open(path, "wb")
    return open(path, "w", newline="", encoding="utf-8")
