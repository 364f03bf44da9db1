"""
FILE.part: a text that grows with each finished frame, for a run that is interrupted and resumed.

Its first line holds the settings of the run. Each further line holds one frame: its rows, with all
columns and digits, and size and hash of the input files that no earlier frame was made of. A line
that was not written to its end is of a frame that is not finished. So nobody goes on with other
settings or other files, and no finished row is ever lost: a part that a new run does not go on with
is kept under another name, and a part that another run writes to is left alone.

At the end of the run the manifest is written, then FILE appears in one step, and FILE.part is
removed last. A run is finished once FILE is there and not older than FILE.part.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import IO, Any

from scanfab.base.ending import undone_at_end
from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.files import kind_of, locked, named_errors, whole_file
from scanfab.base.spelling import counted
from scanfab.pipeline.record import Record
from scanfab.table.formats import json_line
from scanfab.table.row import Row
from scanfab.table.writing import ALL


def part_of(path: Path) -> Path:
    """Where a table grows until it is complete."""
    return path.with_name(f"{path.name}.part")


def is_unfinished(path: Path) -> bool:
    """Whether a table has a FILE.part with rows that it lacks: rows come before their table."""
    part = part_of(path)
    if not part.exists():
        return False
    return not path.exists() or path.stat().st_mtime_ns < part.stat().st_mtime_ns


class PartFile:
    """
    FILE.part of a table.

    Parameters
    ----------
    output : Path
        The table.

    Raises
    ------
    SettingsError
        If something else has the name of the part.
    """

    _stream: IO[bytes]

    def __init__(self, output: Path) -> None:
        self.output, self.path = output, part_of(output)
        if found := kind_of(self.path):
            raise SettingsError(
                f"{self.path}: is {found}, expected a file or nothing: remove it, or name another "
                f"`output=FILE`"
            )

    @property
    def frames(self) -> int:
        """How many finished frames it holds."""
        return max(len(self._whole_lines()) - 1, 0)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other runs away in the block; a ScanfabError if one writes to it."""
        with locked(self.path) as self._stream, undone_at_end(self._remove_if_empty):
            try:
                yield
            finally:
                self._remove_if_empty()

    def read(self) -> Record:
        """
        The finished frames, in a block of :meth:`alone`; what is not finished is cut off.

        Raises
        ------
        ReadError
            If it is damaged.
        """
        lines = self._whole_lines()
        try:
            first, *frames = map(json.loads, lines)
            inputs = [dict(one) for frame in frames for one in frame["inputs"]]
            found = {"settings": dict(first["settings"]), "inputs": inputs}
            record = Record.of(self.path, found, [row for frame in frames for row in frame["rows"]])
        except (ValueError, TypeError, KeyError, RecursionError):
            raise ReadError(
                f"{self.path}: expected what an interrupted run has kept there, found something "
                f"else: leave out `resume` to start afresh"
            ) from None
        if (size := sum(map(len, lines))) < self.path.stat().st_size:
            self._stream.truncate(size)
        return record

    def begin(self, asked: Mapping[str, Any]) -> None:
        """Start afresh with these settings; finished frames are kept under another name."""
        if self.frames:
            names = (f"{self.output.stem}.{n}{self.output.suffix}" for n in count(1))
            others = map(self.output.with_name, names)
            other = next(one for one in others if not (one.exists() or part_of(one).exists()))
            with whole_file(part_of(other)) as copy:
                shutil.copyfile(self.path, copy)
            note(
                f"{self.path}: {counted(self.frames, 'finished frame')} of an earlier run are kept "
                f"as {part_of(other)}; what made it goes on with it by `output={other}` `resume`"
            )
        with named_errors(self.path):
            # not moved: other runs find this very file locked
            self._stream.truncate(0)
            self._write({"settings": asked})

    def add(self, inputs: Iterable[Mapping[str, Any]], rows: Iterable[Row]) -> None:
        """Keep a finished frame, with the files that no earlier frame was made of."""
        with named_errors(self.path):
            self._write({"inputs": list(inputs), "rows": [ALL.of(row) for row in rows]})

    def remove(self) -> None:
        """Remove it, in a block of :meth:`alone`; from then on the next run may have one."""
        if sys.platform == "win32":
            self._stream.close()  # Windows removes no file that is open
        self.path.unlink(missing_ok=True)
        self._stream.close()

    def _write(self, line: Mapping[str, Any]) -> None:
        # not by way of a buffer, which would be written once more at the end where the disk is full
        data = f"{json_line(line)}\n".encode("utf-8", "surrogatepass")
        while data:
            data = data[os.write(self._stream.fileno(), data) :]

    def _remove_if_empty(self) -> None:
        """Without a frame there is nothing to go on with."""
        if not self._stream.closed and not self.frames:
            self.remove()

    def _whole_lines(self) -> list[bytes]:
        if not self.path.exists():
            return []
        lines = self.path.read_bytes().splitlines(keepends=True)
        return [line for line in lines if line.endswith(b"\n")]
