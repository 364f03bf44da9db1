"""Extended XYZ: grains in rows, and a line that names columns and cell."""

from __future__ import annotations

import re
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.columns import has_radius
from scanfab.io.files import bare_name, first_bytes, plain
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbers
from scanfab.io.growing import leave_out_last
from scanfab.io.reader import Carries, FileKind, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, skip_rows, spelt, text_of
from scanfab.packing.cell import Cell

COUNT = re.compile(rb"\A(?:\xef\xbb\xbf)?[ \t]*([0-9]{1,15})[ \t]*\r?\n")
# key=value, the value in quotes if it has blanks
PAIR = re.compile(r"([A-Za-z_][\w.-]*)\s*=\s*(?:\"([^\"]*)\"|([^\s\"]+))")
PROPERTIES = re.compile(r"[^:]+:[SIRL]:[1-9][0-9]?(:[^:]+:[SIRL]:[1-9][0-9]?)*")
# the longest line that names columns
HEAD = 1 << 16
TRUTHS = {"T": True, "F": False, "TRUE": True, "FALSE": False, "1": True, "0": False}
POSITIONS = ("pos", "position", "positions")


class XyzReader(GrainsOnly):
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
        return "grains" if has_radius([one[0] for one in _first_head(path).columns]) else "points"

    def carries(self, path: Path) -> Carries:
        """The line above the rows has a cell, or none."""
        return "nothing" if _cell(_first_head(path)) is None else "cell"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One behind the other."""
        found: list[Snapshot] = []
        with open(plain(path), "rb") as stream:
            size = stream.seek(0, 2)
            start = stream.seek(0)
            while (head := _next_head(path, stream)) is not None:
                rows = skip_rows(stream, head.rows)
                if rows == head.rows - 1:  # the last line of the file may have no end
                    stream.seek(max(size - HEAD, 0))
                    rows += bool(stream.read().rpartition(b"\n")[2].strip())
                if rows < head.rows:
                    reason = f"expected {head.rows} rows, the file ends after {rows}"
                    leave_out_last(path, len(found), reason)
                    break
                stop = stream.tell()
                steps = [head.words.get(key, "") for key in ("step", "timestep")]
                step = next(
                    (int(one) for one in steps if re.fullmatch(r"[-+]?[0-9]{1,18}", one)), None
                )
                time = head.numbers("time", 1)
                found.append(Snapshot(path, step, time[0] if time else None, start, stop))
                start = stop
        if not found:
            raise ReadError(f"{path}: the file is empty")
        return found

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """Columns by their names; ``pos`` are the centres."""
        path, data = snapshot.path, text_of(snapshot)
        above = len(data) - len(data.lstrip())
        start = data.find(b"\n", data.find(b"\n", above) + 1) + 1
        head = _head(path, data[above:start])
        parts = {name: [f"{name} {k}" for k in range(width)] for name, _, width in head.columns}
        kinds = {part: kind for name, kind, _ in head.columns for part in parts[name]}
        layout = Layout(
            tuple(kinds),
            line=data.count(b"\n", 0, start) + 1,
            whole=[part for part, kind in kinds.items() if kind == "I"],
            text=[part for part, kind in kinds.items() if kind in "SL"],
        )
        rows = read_rows(snapshot, data[start:], layout, count=head.rows)
        found: Columns = {}
        for name, kind, width in head.columns:
            own = [rows[part] for part in parts[name]]
            values = own[0] if width == 1 else np.column_stack(own)
            where = f"{path}: the column {name}"
            if kind == "L":
                values = np.char.upper(values.astype(str))
                if not np.isin(values, list(TRUTHS)).all():
                    raise ReadError(f"{where}: expected T or F in each row")
                values = np.isin(values, [word for word, truth in TRUTHS.items() if truth])
            if kind == "I" and values.dtype.kind != "i":
                raise ReadError(f"{where}: expected whole numbers")
            is_position = name.lower() in POSITIONS and "position" not in found
            if is_position and values.shape[1:] != (3,):
                raise ReadError(f"{where}: expected three coordinates in each row")
            found["position" if is_position else name] = values
        return found, _cell(head)


class _Head(NamedTuple):
    """The two lines above the rows of a frame."""

    path: Path
    rows: int
    words: dict[str, str]
    columns: list[tuple[str, str, int]]
    """Name, kind and width of each."""

    def numbers(self, key: str, count: int) -> list[float] | None:
        """The numbers behind a key; None without it."""
        if key not in self.words:
            return None
        return numbers(f"{self.path}: {key}", self.words[key].encode(), count)


def _cell(head: _Head) -> Cell | None:
    """Of ``Lattice``, ``Origin`` and ``pbc``."""
    vectors = head.numbers("lattice", 9)
    if vectors is None:
        return None
    periodic = [TRUTHS.get(one) for one in head.words.get("pbc", "T T T").upper().split()]
    if len(periodic) != 3 or None in periodic:
        raise ReadError(f"{head.path}: pbc: expected three of T and F, found {head.words['pbc']}")
    origin = head.numbers("origin", 3) or [0.0, 0.0, 0.0]
    vectors_by_row = np.reshape(vectors, (3, 3))
    return cell_of(f"{head.path}: Lattice", vectors_by_row, map(bool, periodic), origin)


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
    if not PROPERTIES.fullmatch(words["properties"]) or len(set(parts[::3])) < len(parts) // 3:
        raise ReadError(
            f"{path}: expected Properties=NAME:KIND:WIDTH:... with the kinds S, I, R and L, and "
            f"each name once, found {words['properties'][:100]!r}"
        )
    columns = list(zip(parts[::3], parts[1::3], map(int, parts[2::3]), strict=True))
    return _Head(path, int(count[1]), words, columns)
