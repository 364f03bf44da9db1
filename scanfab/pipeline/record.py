"""
Finished rows of a table, and what made them: settings, versions, inputs with size and hash.

A :class:`Record` is read from a complete FILE with its FILE.manifest.json, or from the FILE.part of
an interrupted run. It tells a run that resumes, and a merge of several tables, whether these rows
are the ones that would be computed now.

FILE.part is a text that grows with each finished frame. Its first line holds the settings of the
run. Each further line holds one frame: its rows, with all columns and digits, and size and hash of
the input files that no earlier frame was made of. If a complete FILE is resumed, the second line
holds all its frames. A last line without its end belongs to a frame that was not finished. At the
end of the run the manifest is written, then FILE appears in one step, and FILE.part is removed
last.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shlex
import shutil
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import IO, Any, NamedTuple

from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.files import locked, named_errors, undone_at_end, whole_file
from scanfab.base.option import flag_of, options_of
from scanfab.base.spelling import shortest
from scanfab.io.files import without_temporary
from scanfab.io.reader import READING, ReadOptions
from scanfab.io.series import Series
from scanfab.io.sources import open_sources
from scanfab.pipeline.map_settings import BLOCK_OPTIONS, MapSettings, is_map
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import SHAPES, STRAIN_MODES, as_written
from scanfab.table.columns import row_of
from scanfab.table.formats import json_line, read_rows
from scanfab.table.row import Row
from scanfab.table.writing import ALL, Excerpt, manifest_of

# Settings that may differ if rows come from a complete table: they say which frames and which
# series were computed, and the inputs are compared by their content.
FREE = ("frames", "sources")
# entries of a manifest that are lists
LISTS = ("inputs", "warnings", "notes")
# a file is read by so many bytes at a time
PIECE = 1 << 20
# entries of the settings that are no options
HIDDEN = ("scanfab", "sources", "references")
# errors that a damaged JSON file causes
DAMAGED = (ValueError, KeyError, TypeError, AttributeError, RecursionError)

FrameRows = dict[tuple[str, int], list[Row]]
"""The rows of each frame, by source and number of the frame."""


class Record(NamedTuple):
    """Finished rows, and what made them."""

    path: Path
    """The table, or its FILE.part."""
    settings: Settings
    manifest: dict[str, Any]
    """The manifest of a table; of a FILE.part only the entries ``settings`` and ``inputs``."""
    inputs: dict[str, dict[str, Any]]
    """The entries of the inputs in the manifest, by path."""
    rows: FrameRows
    """Rows of a damaged table may be fewer than a frame has."""

    @classmethod
    def of(cls, path: Path, manifest: dict[str, Any], rows: Sequence[Mapping[str, Any]]) -> Record:
        """Make a record of rows as they were read; SettingsError if the settings are invalid."""
        settings = restored_settings(manifest["settings"], path)
        known = {one.name for one in settings.columns}
        if lost := sorted({*rows[0]} - known if rows else ()):
            advice = "install the package that made them"
            raise SettingsError(
                f"{path}: nothing here makes its columns {', '.join(lost)}: {advice}"
            )
        found = FrameRows()
        for row in rows:
            if wrong := [name for name, value in row.items() if value != value]:
                expected = "expected a number or an empty cell, found nan"
                raise SettingsError(f"{path}: {expected} in the column {wrong[0]}")
            complete = row_of(settings.columns, row)
            found.setdefault((row["source"], row["frame"]), []).append(complete)
        inputs = {str(entry.get("path")): entry for entry in manifest["inputs"]}
        return cls(path, settings, manifest, inputs, found)

    def differing(self, asked: Mapping[str, Any]) -> str:
        """The names of the settings that differ from others; those of a table except ``FREE``."""
        before, free = self.manifest["settings"], FREE if "frames" in self.manifest else ()
        names = {name for name in (*before, *asked) if before.get(name) != asked.get(name)}
        words = {"scanfab": "version of scanfab"}
        return ", ".join(sorted(words.get(name, name) for name in names - {*free}))

    def has(self, file: Path, may_grow: bool = False, by_lines: bool = False) -> bool:
        """Whether an input is unchanged, or has only grown, behind a whole line if ``by_lines``."""
        known, found = self.inputs.get(str(file), {}), file.stat()
        size = known.get("size", math.inf)
        if found.st_size < size or (found.st_size > size and not may_grow):
            return False
        digest, ends_line = hash_of(file, size, found.st_mtime_ns)
        # if a line is not whole, its last number may have got more digits
        return digest == known.get("sha256") and (ends_line or not by_lines)


def asked_for(
    sources: Sequence[str], reading: ReadOptions, settings: Settings, excerpt: Excerpt = ALL
) -> dict[str, Any]:
    """
    The settings that decide the bytes of a result, as users write them, in the types of JSON.

    Parameters
    ----------
    sources : sequence of str
        The sources as given.
    reading : ReadOptions
        The options of the series.
    settings : Settings
        The settings of the computation. The number of workers is left out: it changes no result.
    excerpt : Excerpt, optional
        Columns and digits of the result.
    """
    found = {"scanfab": version("scanfab"), "sources": list(sources)}
    for part in (reading, settings):
        names = [option.name for option in options_of(type(part)) if option.decides]
        found |= {name: as_written(getattr(part, name)) for name in names}
    return dict(json.loads(json.dumps({**found, **excerpt.asked()}, default=os.fspath)))


def restored_settings(asked: Mapping[str, Any], path: Path) -> Settings:
    """Make the settings of a table's manifest; SettingsError if any cannot be used any more."""
    kind = MapSettings if is_map(asked) else Settings
    try:
        # null and [] stand for options that were not given
        given = {name: value for name, value in asked.items() if value not in (None, [])}
        return kind(**{name: given[name] for name in kind.__dataclass_fields__ if name in given})
    except (AttributeError, TypeError, ValueError, SettingsError) as error:
        what = f"the settings of the manifest cannot be used: {error}"
        raise SettingsError(f"{path}: {what}") from None


def repeat_command(
    asked: Mapping[str, Any], output: str | None = None, named: Collection[str] = ()
) -> str:
    """
    The command line that repeats a computation, quoted for a shell.

    Parameters
    ----------
    asked : mapping
        The ``settings`` of a manifest.
    output : str, optional
        The table.
    named : collection of str, optional
        Options to name even with their default value, because a settings file beside the dumps
        gives them another value.

    Examples
    --------
    >>> from scanfab.io import ReadOptions
    >>> from scanfab.pipeline.record import asked_for, repeat_command
    >>> from scanfab.pipeline.settings import Settings
    >>> repeat_command(asked_for(["dumps"], ReadOptions(), Settings(boundary="type=2", seed=3)))
    'scanfab compute dumps --boundary type=2 --seed 3'
    """
    of_map = is_map(asked)
    usual = asked_for((), ReadOptions(), MapSettings(slices=1) if of_map else Settings())
    # the options that make a table a map have no default
    usual |= dict.fromkeys(BLOCK_OPTIONS)
    words = ["scanfab", "map" if of_map else "compute", *map(str, asked["sources"])]
    for name, value in given_settings(asked).items():
        if usual.get(name) != value or flag_of(name)[2:] in named:
            words += _words(flag_of(name), name, value)
    if output is not None:
        words += ["-o", output]
    return shlex.join(words)


def given_settings(asked: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a manifest that have a value, as users write them."""
    named = {name: asked[name] for name in asked if name not in HIDDEN}
    return {name: value for name, value in named.items() if value not in (None, [], {})}


def reopen(asked: Mapping[str, Any]) -> Series:
    """Open the first series that a manifest names; ReadError if it cannot be read again."""
    sources = [str(source) for source in asked["sources"]]
    if "-" in sources:
        raise ReadError("the frames came by standard input, which cannot be read again")
    given = given_settings(asked)
    return open_sources(sources, **{name: given[name] for name in READING if name in given})[0]


def _words(flag: str, name: str, value: Any) -> list[str]:
    """An option as words of a command line."""
    if isinstance(value, dict):
        value = [f"{key}={column}" for key, column in value.items()]
    values = value if isinstance(value, list) else [value]
    texts = [shortest(one) if isinstance(one, float) else str(one) for one in values]
    if name == "boundary":
        return [word for rule in texts for word in (flag, rule)]
    text = ",".join(texts)
    # a value that starts with a dash would be taken for an option
    return [f"{flag}={text}"] if text.startswith("-") else [flag, text]


def named_files(asked: Mapping[str, Any]) -> list[Path]:
    """The files that the options ``strain`` and ``rv_shape`` name."""
    strain, shape = asked.get("strain", "auto"), asked.get("rv_shape", "sphere")
    named = ((strain, STRAIN_MODES), (shape, SHAPES))
    return [Path(name) for name, words in named if name not in words]


def input_entry(path: Path) -> dict[str, Any]:
    """The entry of an input in a manifest: size and hash. It is read again only if it changed."""
    found = path.stat()
    # only the bytes up to this size count, since a simulation may write more meanwhile
    digest, _ = hash_of(path, found.st_size, found.st_mtime_ns)
    name = without_temporary(str(path))
    name = "-" if name == "standard input" else name
    return {"path": name, "size": found.st_size, "sha256": digest}


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


def write_manifest(path: Path, found: Mapping[str, Any], outdated: Path | None = None) -> None:
    """
    Write a manifest as JSON; the file is complete or untouched.

    A table that is ``outdated``, because the manifest describes another one, is removed before the
    manifest appears. If the process is killed in between, they must not look like a pair.
    """
    text = json.dumps(found, indent=1, ensure_ascii=False)
    with whole_file(path) as part:
        # file names may hold bytes that are not valid text
        part.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
        if outdated is not None:
            outdated.unlink(missing_ok=True)


def read_manifest(table: Path) -> dict[str, Any] | None:
    """Read the manifest beside a table; None if there is none, ReadError if it is damaged."""
    path = manifest_of(table)
    if not path.is_file():
        return None
    try:
        found: dict[str, Any] = json.loads(path.read_text("utf-8"))
        lists = [found["settings"]["sources"], *(found[name] for name in LISTS)]
        entries = [found["versions"], found["frames"], *found["inputs"]]
        if {*map(type, lists)} != {list} or {*map(type, entries)} != {dict}:
            raise TypeError
    except DAMAGED:
        expected = "a manifest of scanfab compute"
        raise ReadError(f"{path}: expected {expected}, found something else") from None
    return found


def read_table(table: Path) -> Record:
    """Read a complete table and its manifest; SettingsError if it does not tell what made it."""
    found = read_manifest(table)
    if found is None:
        what = f"there is no {manifest_of(table).name}, which says what made it"
        raise SettingsError(f"{table}: {what}: run its command again")
    rows = read_rows(table, whole=True)
    if rows and not {"source", "frame"} <= set(rows[0]):
        what = "it lacks the columns source and frame, which tell its rows apart"
        raise SettingsError(f"{table}: {what}: compute it with them")
    return Record.of(table, found, rows)


def part_of(path: Path) -> Path:
    """The path of FILE.part, in which a table grows until it is complete."""
    return path.with_name(f"{path.name}.part")


class PartFile:
    """
    The FILE.part of a table.

    Parameters
    ----------
    output : Path
        The table.
    """

    _stream: IO[bytes]

    def __init__(self, output: Path) -> None:
        self.output, self.path = output, part_of(output)
        self.holds_frames, self._lines = False, list[bytes]()
        """Whether an earlier run has left finished frames, inside a block of :meth:`alone`."""

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Lock the file inside the block; ScanfabError if another run writes to it."""
        with locked(self.path) as self._stream, undone_at_end(self._remove_if_empty):
            lines = self.path.read_bytes().splitlines(keepends=True)
            self._lines = [line for line in lines if line.endswith(b"\n")]
            self.holds_frames = len(self._lines) > 1
            yield

    def read(self) -> Record:
        """Read the finished frames and cut off an unfinished one; ReadError if it is damaged."""
        try:
            first, *frames = map(json.loads, self._lines)
            found = {**first, "inputs": [entry for frame in frames for entry in frame["inputs"]]}
            record = Record.of(self.path, found, [row for frame in frames for row in frame["rows"]])
        except DAMAGED:
            what = "expected what an interrupted run has kept there, found something else"
            raise ReadError(f"{self.path}: {what}: leave out `resume` to start afresh") from None
        if (size := sum(map(len, self._lines))) < self.path.stat().st_size:
            self._stream.truncate(size)
        return record

    def begin(self, asked: Mapping[str, Any]) -> None:
        """Start again with these settings; finished frames are kept under another name."""
        if self.holds_frames:
            names = (f"{self.output.stem}.{n}{self.output.suffix}" for n in count(1))
            others = map(self.output.with_name, names)
            other = next(one for one in others if not (one.exists() or part_of(one).exists()))
            # copied, not renamed, because other runs must find this file locked
            shutil.copyfile(self.path, part_of(other))
            kept = f"the finished frames of an earlier run are kept as {part_of(other)}"
            note(f"{self.path}: {kept}; its command goes on with them by `output={other}` `resume`")
        with named_errors(self.path):
            self._stream.truncate(0)
        self._write({"settings": asked})

    def add(self, inputs: Iterable[Mapping[str, Any]], rows: Iterable[Row]) -> None:
        """Append a finished frame, with the input files that no earlier frame was made of."""
        self._write({"inputs": list(inputs), "rows": [ALL.of(row) for row in rows]})

    def remove(self) -> None:
        """Remove the file and its lock: the table is complete."""
        if sys.platform == "win32":
            self._stream.close()  # Windows removes no file that is open
        self.path.unlink(missing_ok=True)
        self._stream.close()

    def _write(self, line: Mapping[str, Any]) -> None:
        """Write a line without a buffer: a buffer that met a full disk is written again later."""
        data = f"{json_line(line)}\n".encode("utf-8", "surrogatepass")
        with named_errors(self.path):
            while data:
                data = data[os.write(self._stream.fileno(), data) :]

    def _remove_if_empty(self) -> None:
        """Remove the file if it holds no frame: there is nothing to resume."""
        is_there = not self._stream.closed and self.path.exists()
        if is_there and self.path.read_bytes().count(b"\n") < 2:
            self.remove()
