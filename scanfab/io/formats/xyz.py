"""Extended XYZ, read and written: grains in rows, and a line that names columns and cell."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.files import check_memory, first_bytes, plain
from scanfab.io.formats.columns import grain_table, has_radius
from scanfab.io.parse.growing import leave_out_last
from scanfab.io.parse.text_table import parse_columns
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.io.text import skip_rows
from scanfab.packing.cell import Cell

COUNT = re.compile(rb"\A(?:\xef\xbb\xbf)?[ \t]*([0-9]{1,15})[ \t]*\r?\n")
# key=value, the value in quotes if it has blanks
PAIR = re.compile(r"([A-Za-z_][\w.-]*)\s*=\s*(?:\"([^\"]*)\"|([^\s\"]+))")
# the longest line that names columns
HEAD = 1 << 16
KINDS = {"S": str, "I": np.int64, "R": np.float64, "L": str}
TRUTHS = {"T": True, "F": False, "TRUE": True, "FALSE": False, "1": True, "0": False}
POSITIONS = ("pos", "position", "positions")


class XyzReader:
    """Reader and writer plugin for extended XYZ."""

    name = "xyz"
    description = "extended XYZ with a radius, its cell and step; contacts lie beside it"
    extensions: tuple[str, ...] = (".xyz", ".extxyz")

    def recognises(self, path: Path) -> bool:
        """A number of rows, and a line behind it that names columns."""
        head = first_bytes(path, HEAD)
        count = COUNT.match(head)
        if count is None:
            return False
        line = head[count.end() :].partition(b"\n")[0]
        return re.search(rb"\bProperties\s*=", line) is not None

    def kind(self, path: Path) -> FileKind:
        """Grains, with or without a radius."""
        with open(plain(path), "rb") as stream:
            head = _head(path, stream)
        names = [name for name, _, _ in head.properties]
        return "grains" if has_radius(names) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One behind the other."""
        found: list[Snapshot] = []
        with open(plain(path), "rb") as stream:
            while (head := _head_or_end(path, stream)) is not None:
                rows = skip_rows(stream, head.count)
                if rows < head.count:
                    reason = f"expected {head.count} rows, the file ends after {rows}"
                    leave_out_last(path, len(found), reason)
                    break
                found.append(head.snapshot(path, stream.tell()))
        if not found:
            raise ReadError(f"{path}: the file is empty")
        return found

    def carries(self, path: Path) -> Carries:
        """The line above the rows has a cell, or none."""
        with open(plain(path), "rb") as stream:
            return "nothing" if _head(path, stream).cell is None else "cell"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names; ``pos`` are the centres."""
        path = snapshot.path
        with open(plain(path), "rb") as stream:
            stream.seek(snapshot.start)
            head = _head(path, stream)
            stop = os.fstat(stream.fileno()).st_size if snapshot.stop is None else snapshot.stop
            check_memory(path, 12.0 * (stop - stream.tell()))
            data = stream.read(max(stop - stream.tell(), 0))
        columns = _numbers(head, data) or _columns(path, head, data)
        named = next((name for name in columns if name.lower() in POSITIONS), None)
        if named is not None:
            columns["position"] = columns.pop(named)
            if columns["position"].shape[1:] != (3,):
                raise ReadError(f"{path}: {named}: expected three coordinates in each row")
        return grain_table(path, columns, head.cell, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It has none."""
        raise ReadError(f"{snapshot.path}: extended XYZ holds no contacts")


class _Head:
    """The two lines above the rows of a frame."""

    def __init__(self, path: Path, count: int, line: str, start: int) -> None:
        self.path, self.count, self.start = path, count, start
        self.words = {key.lower(): quoted or bare for key, quoted, bare in PAIR.findall(line)}
        self.properties = self._properties()

    def _properties(self) -> list[tuple[str, str, int]]:
        """Name, kind and width of each column."""
        parts = self.words.get("properties", "").split(":")
        names, kinds, widths = parts[::3], parts[1::3], parts[2::3]
        sound = len(names) == len(kinds) == len(widths) and set(kinds) <= set(KINDS)
        if not sound or not all(re.fullmatch("[1-9][0-9]?", width) for width in widths):
            raise ReadError(
                f"{self.path}: expected Properties=NAME:KIND:WIDTH:... with the kinds S, I, R and "
                f"L, found {self.words.get('properties', 'none')[:100]!r}"
            )
        if len(set(names)) < len(names):
            raise ReadError(f"{self.path}: a column is named twice in {':'.join(parts)[:100]!r}")
        return list(zip(names, kinds, map(int, widths), strict=True))

    def _numbers(self, key: str, count: int) -> list[float] | None:
        if key not in self.words:
            return None
        try:
            numbers = [float(word) for word in self.words[key].split()]
        except ValueError:
            numbers = []
        if len(numbers) != count:
            raise ReadError(
                f"{self.path}: {key}: expected {count} numbers, found {self.words[key][:100]!r}"
            )
        return numbers

    @property
    def cell(self) -> Cell | None:
        """Of ``Lattice``, ``Origin`` and ``pbc``."""
        vectors = self._numbers("lattice", 9)
        if vectors is None:
            return None
        truths = self.words.get("pbc", "T T T").upper().split()
        if len(truths) != 3 or not set(truths) <= set(TRUTHS):
            raise ReadError(f"{self.path}: pbc: expected three of T and F, found {truths}")
        along = (TRUTHS[truths[0]], TRUTHS[truths[1]], TRUTHS[truths[2]])
        try:
            origin = self._numbers("origin", 3) or [0.0, 0.0, 0.0]
            return Cell(np.array(vectors).reshape(3, 3), along, origin)
        except PackingError as error:
            if not any(along):
                return None
            raise ReadError(f"{self.path}: Lattice: {error}") from None

    def snapshot(self, path: Path, stop: int) -> Snapshot:
        """The frame, with its step and time if the line names them."""
        step = time = None
        for key in ("timestep", "step"):
            if re.fullmatch(r"[-+]?[0-9]{1,18}", self.words.get(key, "")):
                step = int(self.words[key])
        numbers = self._numbers("time", 1)
        if numbers is not None:
            time = numbers[0]
        return Snapshot(path, step, time, self.start, stop)


def _head(path: Path, stream: IO[bytes]) -> _Head:
    head = _head_or_end(path, stream)
    if head is None:
        raise ReadError(f"{path}: expected a number of rows, found the end of the file")
    return head


def _head_or_end(path: Path, stream: IO[bytes]) -> _Head | None:
    """The head of the next frame; None at the end."""
    start = stream.tell()
    first = stream.readline(100)
    while first and not first.strip():
        first = stream.readline(100)
    if not first:
        return None
    count = COUNT.match(first)
    line = stream.readline(HEAD)
    if count is None or not line.endswith(b"\n"):
        raise ReadError(
            f"{path}: expected a number of rows and a line with Properties=, found {first[:50]!r}"
        )
    return _Head(path, int(count[1]), line.decode("utf-8", "replace"), start)


def _numbers(head: _Head, data: bytes) -> dict[str, npt.NDArray[Any]] | None:
    """The columns of a long frame, parsed at once; None if they are not all plain numbers."""
    places, whole = {}, set()
    total = 0
    for name, kind, width in head.properties:
        places[name] = range(total, total + width)
        whole |= set(places[name]) if kind == "I" else set()
        total += width
    if not {kind for _, kind, _ in head.properties} <= {"I", "R"}:
        return None
    columns = parse_columns(data, 0, len(data), whole)
    if columns is None or (len(columns[0]), len(columns)) != (head.count, total):
        return None
    return {
        name: columns[where[0]] if len(where) == 1 else np.column_stack([columns[k] for k in where])
        for name, where in places.items()
    }


def _columns(path: Path, head: _Head, data: bytes) -> dict[str, npt.NDArray[Any]]:
    """The columns, each of one or several values in a row."""
    total = sum(width for _, _, width in head.properties)
    rows = io.BytesIO(data).readlines()[: head.count]
    if len(rows) < head.count:
        raise ReadError(f"{path}: expected {head.count} rows, found {len(rows)}: it is incomplete")
    words = [row.split() for row in rows]
    for number, row in enumerate(words):
        if len(row) != total or not rows[number].endswith(b"\n"):
            raise ReadError(
                f"{path}: row {number + 1} of {head.count}: expected {total} words and the end of "
                f"the line, found {len(row)} words"
            )
    found: dict[str, npt.NDArray[Any]] = {}
    place = 0
    for name, kind, width in head.properties:
        flat = [word for row in words for word in row[place : place + width]]
        values = _converted(path, name, kind, flat)
        found[name] = values if width == 1 else values.reshape(head.count, width)
        place += width
    return found


def _converted(path: Path, name: str, kind: str, words: list[bytes]) -> npt.NDArray[Any]:
    try:
        if kind == "L":
            return np.array([TRUTHS[word.decode().upper()] for word in words], dtype=np.bool_)
        if kind == "S":
            return np.array([word.decode("utf-8", "replace") for word in words], dtype=str)
        if any(b"_" in word for word in words):
            raise ValueError
        read: Any = int if kind == "I" else float
        return np.fromiter(map(read, words), KINDS[kind], len(words))
    except (ValueError, OverflowError, KeyError):
        raise ReadError(
            f"{path}: the column {name}: expected values of the kind {kind}, found something else"
        ) from None
