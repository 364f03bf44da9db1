"""
Which rows of a table are there, and what made them: settings, versions, inputs with size and hash.

FILE.manifest.json says it of a complete FILE, and FILE.part of its own rows: both are read as a
:class:`Record`. By it a run that goes on with finished rows, and a merge of several tables, tell
whether the rows are those that they would compute now.

FILE.part is a text that grows with each finished frame. Its first line holds the settings of the
run. Each further line holds one frame: its rows, with all columns and digits, and size and hash of
the input files that no earlier frame was made of. A last line that was not written to its end is of
a frame that is not finished. At the end of the run the manifest is written, then FILE appears in
one step, and FILE.part is removed last: a run is finished once FILE is there and not older than
FILE.part.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import IO, Any, NamedTuple

from scanfab.base.ending import undone_at_end
from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.files import locked, named_errors, whole_file
from scanfab.base.option import options_of
from scanfab.base.spelling import counted
from scanfab.pipeline.maps.settings import MapSettings, is_map
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import SHAPES, STRAIN_MODES, as_written
from scanfab.table.columns import row_of
from scanfab.table.formats import json_line, read_rows
from scanfab.table.row import Row
from scanfab.table.writing import ALL, Excerpt, manifest_of

PACKAGES = (
    "scanfab", "numpy", "numba", "scipy", "meshio", "pyvista", "click", "rich", "h5py",
    "matplotlib", "jinja2", "polars",
)  # fmt: skip
# Settings that may differ where rows are taken over from a complete table or merged: such rows are
# of other frames, or of other series, and their inputs are compared by content.
FREE = ("frames", "sources")
# entries of a manifest that are lists, and may be missing in one of an older version
LISTS = ("inputs", "warnings", "notes")
# bytes of a file that are read at a time
PIECE = 1 << 20

FrameRows = dict[tuple[str, int], list[Row]]
"""The rows of each frame, by its source and number."""


class Record(NamedTuple):
    """Finished rows by source and frame, and what made them."""

    path: Path
    """Of the table, or of its FILE.part."""
    settings: Settings
    manifest: dict[str, Any]
    """Of FILE.part only ``settings``, ``inputs`` and ``frames``."""
    rows: FrameRows
    """The rows of a frame may be fewer than it has."""
    columns: frozenset[str]
    """Those that were written; none without a row."""

    @classmethod
    def of(cls, path: Path, manifest: dict[str, Any], rows: Sequence[Mapping[str, Any]]) -> Record:
        """A record of rows as they were read; SettingsError for settings that cannot be used."""
        found = FrameRows()
        try:
            settings = restored_settings(manifest["settings"])
        except SettingsError as error:
            raise SettingsError(f"{path}: {error}") from None
        for row in rows:
            complete = row_of(settings.columns, row)
            found.setdefault((row["source"], row["frame"]), []).append(complete)
        # a manifest of an older version does not say how many frames each series has
        counts = manifest.get("frames") or {source: frame + 1 for source, frame in found}
        columns = frozenset(rows[0] if rows else ())
        return cls(path, settings, {**manifest, "frames": counts}, found, columns)


def asked_for(
    sources: Sequence[str], reading: Mapping[str, Any], settings: Settings, excerpt: Excerpt = ALL
) -> dict[str, Any]:
    """
    The settings that decide the bytes of a result, as users write them, in the types of JSON.

    Parameters
    ----------
    sources : sequence of str
        As given.
    reading : mapping
        Options of ``read_series``.
    settings : Settings
        Of the computation. The number of workers changes no result, so it is left out.
    excerpt : Excerpt, optional
        Columns and digits of the result.
    """
    names = [one.name for one in options_of(type(settings)) if one.decides]
    written = {name: as_written(getattr(settings, name)) for name in names}
    if settings.directions is not None:
        written["directions"] = settings.directions.asked_as
    named = {"scanfab": version("scanfab"), "sources": list(sources)}
    found = {**named, **reading, **written, **excerpt.asked()}
    return dict(json.loads(json.dumps(found, default=os.fspath)))


def differing_settings(
    before: Mapping[str, Any], asked: Mapping[str, Any], but: Collection[str] = ()
) -> str:
    """The names of the settings that differ, ``but`` for some, in alphabetical order."""
    names = {one for one in (*before, *asked) if before.get(one) != asked.get(one)} - {*but}
    return ", ".join(sorted("version of scanfab" if n == "scanfab" else n for n in names))


def restored_settings(asked: Mapping[str, Any]) -> Settings:
    """
    The settings of a manifest.

    Raises
    ------
    SettingsError
        If one of them cannot be used any more.
    """
    kind = MapSettings if is_map(asked) else Settings
    try:
        return kind(**{name: asked[name] for name in kind.__dataclass_fields__ if name in asked})
    except (AttributeError, TypeError, ValueError, SettingsError) as error:
        raise SettingsError(f"the settings of its manifest cannot be used: {error}") from None


def named_files(asked: Mapping[str, Any]) -> list[Path]:
    """The files that the settings name: of strains (``strain``), of a surface (``rv_shape``)."""
    strain, shape = asked.get("strain", "auto"), asked.get("rv_shape", "sphere")
    named = ((strain, STRAIN_MODES), (shape, SHAPES))
    return [Path(name) for name, words in named if name not in words]


def input_entry(path: Path) -> dict[str, Any]:
    """Size and hash of a file, as a manifest lists it; it is read again only if it has changed."""
    found = path.stat()
    # a simulation may write more meanwhile
    digest, _ = hash_of(path, found.st_size, found.st_mtime_ns)
    return {"path": str(path), "size": found.st_size, "sha256": digest}


@cache
def hash_of(path: Path, size: int, _changed: int) -> tuple[str, bool]:
    """The SHA-256 of the first bytes of a file, and whether a line ends with them."""
    digest, piece = hashlib.sha256(), b"\n"
    with open(path, "rb") as stream:
        while size and (piece := stream.read(min(size, PIECE))):
            digest.update(piece)
            size -= len(piece)
        ends = piece.endswith(b"\n") or stream.read(1) in (b"", b"\r", b"\n")
    return digest.hexdigest(), ends


def versions_used() -> dict[str, str]:
    """Of Python and of the packages, as a manifest lists them."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def write_manifest(path: Path, found: Mapping[str, Any], outdated: Path | None = None) -> None:
    """
    Write a manifest as JSON; the file is complete or untouched.

    An ``outdated`` table, which it does not describe, is removed before the manifest appears: they
    would look like a pair if the process were killed between the two.
    """
    text = json.dumps(found, indent=1, ensure_ascii=False)
    with whole_file(path) as part:
        # file names may hold bytes that are no text
        part.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
        if outdated is not None and outdated.is_file():
            outdated.unlink()


def read_manifest(table: Path) -> dict[str, Any] | None:
    """
    The manifest beside a table; None if there is none.

    Raises
    ------
    ReadError
        If it is not a manifest.
    """
    path = manifest_of(table)
    if not path.is_file():
        return None
    try:
        found = json.loads(path.read_text("utf-8"))
        lists = [found["settings"]["sources"], *(found.get(name, []) for name in LISTS)]
        is_named = all(isinstance(entry, dict) for entry in found.get("inputs", []))
        if not is_named or not all(isinstance(one, list) for one in lists):
            raise TypeError
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        expected = "a manifest of scanfab compute"
        raise ReadError(f"{path}: expected {expected}, found something else") from None
    return {**{name: [] for name in LISTS}, **found}


def read_table(table: Path) -> Record:
    """The record of a finished table, whose manifest is beside it; SettingsError without one."""
    found = read_manifest(table)
    if found is None:
        what = f"there is no {table.name}.manifest.json, which says what made it"
        raise SettingsError(f"{table}: {what}: run its command again")
    rows = read_rows(table, whole=True)
    if rows and not {"source", "frame"} <= set(rows[0]):
        what = "it lacks the columns source and frame, which tell its rows apart"
        raise SettingsError(f"{table}: {what}: compute it with them")
    return Record.of(table, found, rows)


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
    """

    _stream: IO[bytes]

    def __init__(self, output: Path) -> None:
        self.output, self.path = output, part_of(output)
        self.frames = 0
        """How many finished frames it holds, in a block of :meth:`alone`."""
        self._lines: list[bytes] = []

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other runs away in the block; a ScanfabError if one writes to it."""
        with locked(self.path) as self._stream, undone_at_end(self._remove_if_empty):
            lines = self.path.read_bytes().splitlines(keepends=True)
            self._lines = [line for line in lines if line.endswith(b"\n")]
            self.frames = max(len(self._lines) - 1, 0)
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
        try:
            first, *frames = map(json.loads, self._lines)
            found = {**first, "inputs": [one for frame in frames for one in frame["inputs"]]}
            record = Record.of(self.path, found, [row for frame in frames for row in frame["rows"]])
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            what = "expected what an interrupted run has kept there, found something else"
            raise ReadError(f"{self.path}: {what}: leave out `resume` to start afresh") from None
        if (size := sum(map(len, self._lines))) < self.path.stat().st_size:
            self._stream.truncate(size)
        return record

    def begin(self, asked: Mapping[str, Any]) -> None:
        """Start afresh with these settings; finished frames are kept under another name."""
        if self.frames:
            names = (f"{self.output.stem}.{n}{self.output.suffix}" for n in count(1))
            others = map(self.output.with_name, names)
            other = next(one for one in others if not (one.exists() or part_of(one).exists()))
            # not moved: other runs find this very file locked
            shutil.copyfile(self.path, part_of(other))
            kept = f"{counted(self.frames, 'finished frame')} of an earlier run are kept"
            how = f"what made it goes on with it by `output={other}` `resume`"
            note(f"{self.path}: {kept} as {part_of(other)}; {how}")
        with named_errors(self.path):
            self._stream.truncate(0)
            self._write({"settings": asked})
        self.frames = 0

    def add(self, inputs: Iterable[Mapping[str, Any]], rows: Iterable[Row]) -> None:
        """Keep a finished frame, with the files that no earlier frame was made of."""
        with named_errors(self.path):
            self._write({"inputs": list(inputs), "rows": [ALL.of(row) for row in rows]})
        self.frames += 1

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
        is_there = not self._stream.closed and self.path.exists()
        # counted in the file, as a signal may come just before a frame is counted
        if is_there and self.path.read_bytes().count(b"\n") < 2:
            self.remove()
