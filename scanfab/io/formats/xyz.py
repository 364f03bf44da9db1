"""Extended XYZ: a row for each grain, and a line above that names columns and cell."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import AnyArray, Columns
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats.shared import GrainsOnly, cell_of, marked_frames, numbers
from scanfab.io.reader import Carries, Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.io.writer import Left, as_arrays, csv_bytes, split
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

COUNT = re.compile(rb"(?:\xef\xbb\xbf)?[ \t]*([0-9]{1,15})[ \t]*\r?\n")
# the two lines above the rows of a frame
FRAME = re.compile(rb"[ \t]*[0-9]{1,15}[ \t]*\r?\n[^\n]*\bProperties[ \t]*=", re.IGNORECASE)
# key=value; a value with blanks is in quotes
PAIR = re.compile(r"([A-Za-z_][\w.-]*)\s*=\s*(?:\"([^\"]*)\"|([^\s\"]+))")
PROPERTIES = re.compile(r"[^:]+:[SIRL]:[1-9][0-9]?(:[^:]+:[SIRL]:[1-9][0-9]?)*")
# longest line with the names of columns, in bytes
HEAD = 1 << 16
# its letter for each of numpy's kinds
LETTERS = {"b": "L", "i": "I", "u": "I", "f": "R", "U": "S"}
TRUTHS = {"T": True, "F": False, "TRUE": True, "FALSE": False, "1": True, "0": False}
POSITIONS = ("pos", "position", "positions")


class Head(NamedTuple):
    """The content of the two lines above the rows of a frame."""

    rows: int
    words: dict[str, str]
    columns: list[tuple[str, str, int]]
    """Name, kind and width of each column."""


class XyzFormat(GrainsOnly):
    """Reader and writer plugin for extended XYZ."""

    name = "xyz"
    description = "extended XYZ with a radius, its cell and step; contacts in companion files"
    extensions: tuple[str, ...] = (".xyz", ".extxyz")

    def recognises(self, path: Path) -> bool:
        """Recognised by a number in line 1, and in line 2 names of columns, or the ending .xyz."""
        head = first_bytes(path, HEAD)
        count = COUNT.match(head)
        if count is None:
            return False
        names_columns = re.search(rb"\bProperties\s*=", head[count.end() :].partition(b"\n")[0])
        return bool(names_columns) or bare_name(path).lower().endswith(self.extensions)

    def names(self, path: Path) -> Sequence[str]:
        """The names of the columns in the first frame."""
        return [name for name, _, _ in _head(path, first_bytes(path, HEAD)).columns]

    def carries(self, path: Path) -> Carries:
        """``cell`` if the line above the rows has a lattice, else ``nothing``."""
        return "nothing" if _cell(path, _head(path, first_bytes(path, HEAD))) is None else "cell"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames, in the order of their steps; an incomplete last one is left out."""
        return marked_frames(path, FRAME, self.table, _moment)

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The columns by name, and the cell; ``pos`` are the centres."""
        path, data = snapshot.path, text_of(snapshot)
        head = _head(path, data[:HEAD])
        parts = {name: [f"{name} {k}" for k in range(width)] for name, _, width in head.columns}
        kinds = {part: kind for name, kind, _ in head.columns for part in parts[name]}
        whole = [part for part, kind in kinds.items() if kind == "I"]
        text = [part for part, kind in kinds.items() if kind in "SL"]
        layout = Layout(tuple(kinds), line=3, whole=whole, text=text)
        rows = read_rows(snapshot, data.split(b"\n", 2)[2], layout, count=head.rows)
        columns: Columns = {}
        for name, kind, width in head.columns:
            values = np.column_stack([rows[part] for part in parts[name]])
            is_position = name.lower() in POSITIONS and "position" not in columns
            if (kind == "I" and values.dtype.kind != "i") or (is_position and width != 3):
                expected = "three coordinates" if is_position else "whole numbers"
                raise ReadError(f"{path}: the column {name}: expected {expected}")
            columns["position" if is_position else name] = values if width > 1 else values[:, 0]
        return columns, _cell(path, head)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; texts with blanks go into a companion file."""
        arrays = as_arrays(packing)
        held, left = split(arrays.own, _is_xyz)
        properties: list[str] = []
        rows: Columns = {}
        for name, values in {"pos": packing.position, **arrays.grains, **held}.items():
            width = int(np.prod(values.shape[1:]))
            properties.append(f"{name}:{LETTERS[values.dtype.kind]}:{width}")
            words = np.where(values, "T", "F") if values.dtype.kind == "b" else values
            # names with a blank cannot clash with names of other columns
            parts = enumerate(words.reshape(len(values), width).T)
            rows |= {f"{name} {place}": part for place, part in parts}
        line = [f"Properties={':'.join(properties)}"]
        if packing.time is not None:
            line.insert(0, f"Time={packing.time!r}")
        if packing.step is not None:
            line.insert(0, f"Timestep={packing.step}")
        if (cell := packing.cell) is not None:
            vectors = " ".join(map(repr, cell.vectors.ravel().tolist()))
            origin = " ".join(map(repr, cell.origin.tolist()))
            along = " ".join("FT"[repeats] for repeats in cell.periodic)
            line.insert(0, f'Lattice="{vectors}" Origin="{origin}" pbc="{along}"')
        head = f"{len(packing)}\n{' '.join(line)}\n"
        path.write_bytes(head.encode() + csv_bytes(rows, " ", with_names=False))
        return Left(contacts=True, columns=left, notes=tuple(arrays.notes))


def _head(path: Path, text: bytes) -> Head:
    """Parse the first two lines of a frame."""
    lines, count = text[:HEAD].split(b"\n", 2), COUNT.match(text)
    if count is None or len(lines) < 3:
        expected = "expected a number of rows and a line with Properties="
        raise ReadError(f"{path}: {expected}, found {spelt(text)}")
    pairs = PAIR.findall(lines[1].decode("utf-8", "replace"))
    words = {key.lower(): quoted or bare for key, quoted, bare in pairs}
    if "properties" not in words:
        table = '`format="table"`, `skip=2` and `columns="x=2,y=3,z=4,radius=5"` read it'
        raise ReadError(f"{path}: this is plain XYZ, without Properties=... in line 2: {table}")
    parts = words["properties"].split(":")
    if not PROPERTIES.fullmatch(words["properties"]) or len(set(parts[::3])) < len(parts) // 3:
        expected = "expected Properties=NAME:KIND:WIDTH:... (kinds S, I, R, L), each name once"
        raise ReadError(f"{path}: {expected}, found {words['properties'][:100]!r}")
    columns = list(zip(parts[::3], parts[1::3], map(int, parts[2::3]), strict=True))
    return Head(int(count[1]), words, columns)


def _moment(path: Path, text: bytes) -> tuple[int | None, float | None]:
    """The step and the time of a frame."""
    head = _head(path, text)
    step = head.words.get("step", head.words.get("timestep", ""))
    time = _numbers(path, head, "time", 1)
    return int(step) if re.fullmatch(r"[-+]?[0-9]{1,18}", step) else None, time[0] if time else None


def _numbers(path: Path, head: Head, key: str, count: int) -> list[float] | None:
    """The numbers that belong to a key; None without the key."""
    text = head.words.get(key)
    return None if text is None else numbers(f"{path}: {key}", text.encode(), count)


def _cell(path: Path, head: Head) -> Cell | None:
    """The cell from ``Lattice``, ``Origin`` and ``pbc``; None without ``Lattice``."""
    vectors, origin = _numbers(path, head, "lattice", 9), _numbers(path, head, "origin", 3)
    if vectors is None:
        return None
    periodic = [TRUTHS.get(word) for word in head.words.get("pbc", "T T T").upper().split()]
    if len(periodic) != 3 or None in periodic:
        raise ReadError(f"{path}: pbc: expected three of T and F, found {head.words['pbc']}")
    edges = np.reshape(vectors, (3, 3))
    return cell_of(f"{path}: Lattice", edges, map(bool, periodic), origin or [0.0] * 3)


def _is_xyz(name: str, values: AnyArray) -> bool:
    """Whether extended XYZ can hold a column: its name and its texts must be single words."""
    if re.search(r"[\s:\"=]", name) or not name or int(np.prod(values.shape[1:])) > 99:
        return False
    if name.lower() in POSITIONS or values.dtype == np.uint64:
        return False
    texts = values.ravel() if values.dtype.kind == "U" else ()
    return all(text.split() == [text] for text in texts)
