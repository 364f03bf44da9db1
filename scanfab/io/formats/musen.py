"""MUSEN's "Export as text": each row is an object, a list of property numbers and values."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError, note
from scanfab.base.typing import Columns
from scanfab.io.files import Stamp, first_bytes, stamp_of
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbered_frames, numbers
from scanfab.io.reader import Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

# the beginning of a row: id, type and geometry (for a sphere radius and contact radius)
OBJECT = re.compile(rb"0 \d{1,15} 1 (1|9|13|14) 5 ")
SPHERE, BONDS = b"1", (b"9", b"13")
TIME, PLACE = b"2", b"12"
# SIZES: how many values each property has; READ: the names of the values that are read
SIZES = {
    b"0": 1, b"1": 1, TIME: 1, b"5": 2, b"10": 3, b"11": 3, PLACE: 3, b"15": 3, b"16": 3,
    b"17": 3, b"18": 1, b"19": 3, b"20": 3, b"23": 1, b"24": 2, b"31": 4, b"36": 9, b"37": 1,
}  # fmt: skip
READ = {b"0": ["id"], b"5": ["radius"], b"24": ["begin", "end"], TIME: ["time"], PLACE: [*"xyz"]}
# the periodic domain, if it is on: a flag for each axis, its lower and its upper corner
PERIODIC = re.compile(rb"^28 1((?: \S+){9})[ \t]*\r?$", re.MULTILINE)


class MusenReader(GrainsOnly):
    """Reader plugin for MUSEN."""

    name = "musen"
    description = "MUSEN's export as text: spheres at all its times, periodic domain"
    extensions: tuple[str, ...] = (".txt",)

    def recognises(self, path: Path) -> bool:
        """Recognised by the first properties of the first row."""
        return OBJECT.match(first_bytes(path)) is not None

    def snapshots(self, path: Path) -> list[Snapshot]:
        """A snapshot for each time of the first sphere; ``start`` is the number of the time."""
        columns, *_ = _export(path, stamp_of(path))
        times = [columns[name][0].item() for name in columns if name.startswith("time ")]
        return numbered_frames(path, ((None, time) for time in times))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The spheres that are active at the time of the snapshot; other objects are ignored."""
        path, number = snapshot.path, snapshot.start
        columns, cell, has_bonds = _export(path, stamp_of(path))
        if has_bonds:
            note("MUSEN's bonds are not read: grains that touch are found by geometry")
        time = columns[f"time {number}"]
        if np.any(time != snapshot.time):
            advice = "export all objects at the same times"
            raise ReadError(f"{path}: a sphere has no state at time {snapshot.time}: {advice}")
        is_there = (columns.get("begin", -np.inf) <= time) & (time <= columns.get("end", np.inf))
        own = {"id": "id", "radius": "radius", **{axis: f"{axis} {number}" for axis in "xyz"}}
        return {name: columns[key][is_there] for name, key in own.items()}, cell


@lru_cache(maxsize=1)
def _export(path: Path, stamp: Stamp) -> tuple[Columns, Cell | None, bool]:
    """
    Read all spheres of a file, the cell, and whether there are bonds.

    The columns are id, radius, begin and end of activity, and for each time ``time 0``, ``x 0`` and
    so on. The result is cached, so that the frames of a file are parsed together.
    """
    data = text_of(Snapshot(path))
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    lines = data.split(b"\n")
    # objects come first; any other line among them is an object with a damaged first word
    stop = max((k + 1 for k, line in enumerate(lines) if line.startswith(b"0 ")), default=0)
    kinds = [match and match[1] for match in map(OBJECT.match, lines[:stop])]
    if None in kinds:
        wrong = kinds.index(None)
        where = f"{path}, line {wrong + 1}"
        raise ReadError(f"{where}: expected 0 ID 1 TYPE 5 ..., found {spelt(lines[wrong])}")
    cell, domain = None, PERIODIC.search(data)
    if domain is not None:
        where = f"{path}: its periodic domain (28)"
        along, low, high = np.reshape(numbers(where, domain[1], 9), (3, 3))
        cell = cell_of(where, high - low, along != 0, low)
    rows = [line for line, kind in zip(lines, kinds, strict=False) if kind == SPHERE]
    return _spheres(path, rows) if rows else {}, cell, not {*kinds}.isdisjoint(BONDS)


def _spheres(path: Path, rows: list[bytes]) -> Columns:
    """The columns of the spheres; all spheres must have the same properties as the first."""
    words, states = rows[0].split(), 0
    names: list[str] = []
    keys: dict[str, bytes] = {}
    while len(names) < len(words) and (key := words[len(names)]) in SIZES:
        states += key == TIME
        behind = f" {states - 1}" * (key in (TIME, PLACE))
        read_names = [f"{name}{behind}" for name in READ.get(key, [])]
        keys[f"{len(names)}"] = key
        names += [f"{len(names)}", *read_names]
        names += [f"{key.decode()}_{len(names)}_{k}" for k in range(len(read_names), SIZES[key])]
    needed = {"id", "radius", *(f"{name} {k}" for k in range(states) for name in ("time", *"xyz"))}
    if len(names) != len(words) or not states or not needed <= {*names}:
        expected = "properties 0 ID ... 5 RADIUS ... 2 TIME 12 X Y Z ... in the rows of spheres"
        found = spelt(b" ".join([*keys.values(), *words[len(names) :]]))
        raise ReadError(f"{path}: expected {expected}, found {found}")
    read = [name for name in names if "_" not in name]
    layout = Layout(tuple(names), optional={*names} - {*read})
    columns = read_rows(Snapshot(path), b"\n".join([*rows, b""]), layout)
    if any(np.any(columns[name] != float(key)) for name, key in keys.items()):
        raise ReadError(f"{path}: expected the same properties in the rows of all spheres")
    return {name: columns[name] for name in read if name not in keys}
