"""Extended XYZ: grains in rows, and a line that names columns and cell."""

from __future__ import annotations

import re
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.columns import grain_table, has_radius
from scanfab.io.files import bare_name, first_bytes, plain
from scanfab.io.growing import leave_out_last
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.io.text import Layout, read_rows, skip_rows, spelt, text_of
from scanfab.packing.cell import Cell

COUNT = re.compile(rb"\A(?:\xef\xbb\xbf)?[ \t]*([0-9]{1,15})[ \t]*\r?\n")
# key=value, the value in quotes if it has blanks
PAIR = re.compile(r"([A-Za-z_][\w.-]*)\s*=\s*(?:\"([^\"]*)\"|([^\s\"]+))")
# the longest line that names columns
HEAD = 1 << 16
TRUTHS = {"T": True, "F": False, "TRUE": True, "FALSE": False, "1": True, "0": False}
POSITIONS = ("pos", "position", "positions")


class XyzReader:
    """Reader plugin for extended XYZ."""

    name = "xyz"
    description = "extended XYZ with a radius, its cell and step; contacts lie beside it"
    extensions: tuple[str, ...] = (".xyz", ".extxyz")

    def recognises(self, path: Path) -> bool:
        """A number of rows, and a line behind it that names columns, or the ending .xyz."""
        head = first_bytes(path, HEAD)
        count = COUNT.match(head)
        if count is None:
            return False
        line = head[count.end() :].partition(b"\n")[0]
        names_columns = re.search(rb"\bProperties\s*=", line) is not None
        return names_columns or bare_name(path).lower().endswith(self.extensions)

    def kind(self, path: Path) -> FileKind:
        """Grains, with or without a radius."""
        head = _first_head(path)
        return "grains" if has_radius([name for name, _, _ in head.properties]) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One behind the other."""
        found: list[Snapshot] = []
        with open(plain(path), "rb") as stream:
            size = stream.seek(0, 2)
            start = stream.seek(0)
            while (head := _next_head(path, stream)) is not None:
                rows = skip_rows(stream, head.rows)
                # the last line of the file may have no end
                if rows < head.rows - 1 or (rows < head.rows and not _has_word(stream, size)):
                    reason = f"expected {head.rows} rows, the file ends after {rows}"
                    leave_out_last(path, len(found), reason)
                    break
                found.append(head.snapshot(start, stream.tell()))
                start = stream.tell()
        if not found:
            raise ReadError(f"{path}: the file is empty")
        return found

    def carries(self, path: Path) -> Carries:
        """The line above the rows has a cell, or none."""
        return "nothing" if _first_head(path).cell() is None else "cell"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names; ``pos`` are the centres."""
        path, data = snapshot.path, text_of(snapshot)
        above = len(data) - len(data.lstrip())
        start = data.find(b"\n", data.find(b"\n", above) + 1) + 1
        head = _head(path, data[above:start])
        columns = _columns(snapshot, head, data[start:], data.count(b"\n", 0, start) + 1)
        named = next((name for name in columns if name.lower() in POSITIONS), None)
        if named is not None:
            columns["position"] = columns.pop(named)
            if columns["position"].shape[1:] != (3,):
                raise ReadError(f"{path}: {named}: expected three coordinates in each row")
        return grain_table(path, columns, head.cell(), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It has none."""
        raise ReadError(f"{snapshot.path}: extended XYZ holds no contacts")


class _Head(NamedTuple):
    """The two lines above the rows of a frame."""

    path: Path
    rows: int
    words: dict[str, str]
    properties: list[tuple[str, str, int]]
    """Name, kind and width of each column."""

    def numbers(self, key: str, count: int) -> list[float] | None:
        """The numbers behind a key; None without it."""
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

    def cell(self) -> Cell | None:
        """Of ``Lattice``, ``Origin`` and ``pbc``."""
        vectors = self.numbers("lattice", 9)
        if vectors is None:
            return None
        truths = self.words.get("pbc", "T T T").upper().split()
        if len(truths) != 3 or not set(truths) <= set(TRUTHS):
            raise ReadError(f"{self.path}: pbc: expected three of T and F, found {truths}")
        along = (TRUTHS[truths[0]], TRUTHS[truths[1]], TRUTHS[truths[2]])
        try:
            origin = self.numbers("origin", 3) or [0.0, 0.0, 0.0]
            return Cell(np.array(vectors).reshape(3, 3), along, origin)
        except PackingError as error:
            if not any(along):
                return None
            raise ReadError(f"{self.path}: Lattice: {error}") from None

    def snapshot(self, start: int, stop: int) -> Snapshot:
        """The frame, with its step and time if the line names them."""
        steps = [self.words.get(key, "") for key in ("timestep", "step")]
        found = [int(word) for word in steps if re.fullmatch(r"[-+]?[0-9]{1,18}", word)]
        time = self.numbers("time", 1)
        step = found[-1] if found else None
        return Snapshot(self.path, step, None if time is None else time[0], start, stop)


def _first_head(path: Path) -> _Head:
    with open(plain(path), "rb") as stream:
        head = _next_head(path, stream)
    if head is None:
        raise ReadError(f"{path}: expected a number of rows, found the end of the file")
    return head


def _next_head(path: Path, stream: IO[bytes]) -> _Head | None:
    """The head of the next frame; None at the end."""
    first = stream.readline(100)
    while first and not first.strip():
        first = stream.readline(100)
    return _head(path, first + stream.readline(HEAD)) if first else None


def _head(path: Path, lines: bytes) -> _Head:
    """The head in two lines."""
    count = COUNT.match(lines)
    if count is None or not lines.endswith(b"\n"):
        raise ReadError(
            f"{path}: expected a number of rows and a line with Properties=, found {spelt(lines)}"
        )
    line = lines[count.end() :].decode("utf-8", "replace")
    words = {key.lower(): quoted or bare for key, quoted, bare in PAIR.findall(line)}
    if "properties" not in words:
        raise ReadError(
            f"{path}: this is plain XYZ, which does not say what its columns are: expected "
            f"Properties=... in its second line; read it as a table, for instance "
            f'`format="table", skip=2, columns="x=2,y=3,z=4,radius=5"`'
        )
    parts = words["properties"].split(":")
    names, kinds, widths = parts[::3], parts[1::3], parts[2::3]
    sound = len(names) == len(kinds) == len(widths) and set(kinds) <= set("SIRL")
    if not sound or not all(re.fullmatch("[1-9][0-9]?", width) for width in widths):
        raise ReadError(
            f"{path}: expected Properties=NAME:KIND:WIDTH:... with the kinds S, I, R and L, found "
            f"{words['properties'][:100]!r}"
        )
    if len(set(names)) < len(names):
        raise ReadError(f"{path}: a column is named twice in {words['properties'][:100]!r}")
    properties = list(zip(names, kinds, map(int, widths), strict=True))
    return _Head(path, int(count[1]), words, properties)


def _has_word(stream: IO[bytes], size: int) -> bool:
    """Whether the last line of a file holds anything."""
    stream.seek(max(size - HEAD, 0))
    return bool(stream.read().rpartition(b"\n")[2].strip())


def _columns(
    snapshot: Snapshot, head: _Head, rows: bytes, line: int
) -> dict[str, npt.NDArray[Any]]:
    """The columns, each of one or several values in a row."""
    parts = {name: [f"{name} {k}" for k in range(width)] for name, _, width in head.properties}
    kinds = {part: kind for name, kind, _ in head.properties for part in parts[name]}
    layout = Layout(
        tuple(kinds),
        line=line,
        whole=[part for part, kind in kinds.items() if kind == "I"],
        text=[part for part, kind in kinds.items() if kind in "SL"],
    )
    columns = read_rows(snapshot, rows, layout, count=head.rows)
    found: dict[str, npt.NDArray[Any]] = {}
    for name, kind, width in head.properties:
        own = [columns[part] for part in parts[name]]
        values = own[0] if width == 1 else np.column_stack(own)
        if kind == "L":
            words = np.char.upper(values.astype(str))
            if not np.isin(words, list(TRUTHS)).all():
                raise ReadError(f"{head.path}: the column {name}: expected T or F in each row")
            values = np.isin(words, [word for word, truth in TRUTHS.items() if truth])
        if kind == "I" and values.dtype.kind != "i":
            raise ReadError(f"{head.path}: the column {name}: expected whole numbers")
        found[name] = values
    return found
