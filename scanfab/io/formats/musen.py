"""MUSEN's "Export as text": an object in each row, as numbers of properties and their values."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError, note
from scanfab.base.typing import FloatArray
from scanfab.io.files import Stamp, first_bytes, stamp_of
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbered_frames, numbers
from scanfab.io.reader import Snapshot
from scanfab.io.text import Columns, Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

# id, type, and its geometry: for a sphere radius and contact radius
OBJECT = re.compile(rb"0 \d{1,15} 1 (1|9|13|14) 5 ")
SPHERE, BONDS = b"1", (b"9", b"13")
ID, TIME, GEOMETRY, PLACE, ACTIVE = b"0", b"2", b"5", b"12", b"24"
# how many values follow the number of a property, and of how many the first ones are read
SIZES = {
    ID: 1, b"1": 1, TIME: 1, GEOMETRY: 2, b"10": 3, b"11": 3, PLACE: 3, b"15": 3, b"16": 3,
    b"17": 3, b"18": 1, b"19": 3, b"20": 3, b"23": 1, ACTIVE: 2, b"31": 4, b"36": 9, b"37": 1,
}  # fmt: skip
READ = {ID: 1, GEOMETRY: 1, ACTIVE: 2, TIME: 1, PLACE: 3}
# the properties that are read, in a row; times of activity may be missing
ORDER = re.compile(rb"0 5( 24)?( 2 12)+")
# column of the first state of a sphere
FIRST = 4
# the periodic domain, if it is switched on: along which axes, its low and its high corner
PERIODIC = re.compile(rb"^28 1((?: \S+){9})[ \t]*\r?$", re.MULTILINE)


class MusenReader(GrainsOnly):
    """Reader plugin for MUSEN."""

    name = "musen"
    description = "MUSEN's export as text: spheres at all its times, periodic domain"
    extensions: tuple[str, ...] = (".txt",)

    def recognises(self, path: Path) -> bool:
        """By the properties that the first row begins with."""
        return OBJECT.match(first_bytes(path)) is not None

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One for each time of the first sphere; ``start`` of a snapshot is its number."""
        values, *_ = _export(path, stamp_of(path))
        times = values[0, FIRST::4].tolist()
        return numbered_frames(path, ((None, time) for time in times))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The spheres that are active at the time; objects of other kinds are left out."""
        path = snapshot.path
        values, cell, has_bonds = _export(path, stamp_of(path))
        if has_bonds:
            note("MUSEN's bonds are not read: grains that touch are found by geometry")
        id, radius, begin, end = values[:, :FIRST].T
        time, *place = values[:, FIRST + 4 * snapshot.start :][:, :4].T
        if np.any(time != snapshot.time):
            raise ReadError(
                f"{path}: a sphere has no state at the time {snapshot.time}: export all objects at "
                f"the same times"
            )
        is_there = (begin <= time) & (time <= end)
        columns = {"id": id, "radius": radius, **dict(zip("xyz", place, strict=True))}
        return {name: values[is_there] for name, values in columns.items()}, cell


@lru_cache(maxsize=1)
def _export(path: Path, stamp: Stamp) -> tuple[FloatArray, Cell | None, bool]:
    """
    All spheres of a file, the cell, and whether there are bonds.

    A row holds id, radius, from when and until when the sphere is there, and time and place of each
    state. The file is parsed once for all its frames while its stamp stays.
    """
    data = text_of(Snapshot(path))
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    lines = data.split(b"\n")
    # objects stand above all other lines: one among them is an object whose first word is damaged
    stop = max((k + 1 for k, line in enumerate(lines) if line.startswith(b"0 ")), default=0)
    wrong = next((k for k, line in enumerate(lines[:stop]) if not OBJECT.match(line)), None)
    if wrong is not None:
        where = f"{path}, line {wrong + 1}"
        raise ReadError(f"{where}: expected 0 ID 1 TYPE 5 ..., found {spelt(lines[wrong])}")
    kinds = [line.split(b" ", 4)[3] for line in lines[:stop]]
    rows = [line for line, kind in zip(lines, kinds, strict=False) if kind == SPHERE]
    cell, domain = None, PERIODIC.search(data)
    if domain is not None:
        where = f"{path}: its periodic domain (28)"
        along, low, high = np.reshape(numbers(where, domain[1], 9), (3, 3))
        cell = cell_of(where, high - low, along != 0, low)
    return _values(path, rows), cell, not {*kinds}.isdisjoint(BONDS)


def _values(path: Path, rows: list[bytes]) -> FloatArray:
    """What is read of each sphere; all spheres must have the properties of the first one."""
    words, place = rows[0].split() if rows else [], 0
    keys: dict[int, bytes] = {}
    read: list[int] = []
    while place < len(words) and words[place] in SIZES:
        key = keys[place] = words[place]
        read += range(place + 1, place + 1 + READ.get(key, 0))
        place += 1 + SIZES[key]
    order = b" ".join(key for key in keys.values() if key in READ)
    if place != len(words) or not ORDER.fullmatch(order):
        raise ReadError(
            f"{path}: expected properties 0 ID ... 5 RADIUS ... 2 TIME 12 X Y Z ... in the rows of "
            f"spheres, found {spelt(b' '.join([*keys.values(), *words[place:]]))}"
        )
    names = tuple(f"{place}" for place in range(place))
    optional = {*names} - {f"{place}" for place in (*keys, *read)}
    text = b"\n".join([*rows, b""])
    columns = read_rows(Snapshot(path), text, Layout(names, optional=optional))
    if any(np.any(columns[f"{place}"] != float(key)) for place, key in keys.items()):
        raise ReadError(f"{path}: expected the properties of the first sphere in the rows of all")
    values = np.column_stack([columns[f"{place}"] for place in read])
    if ACTIVE not in keys.values():
        values = np.insert(values, [2, 2], [-np.inf, np.inf], axis=1)
    return values
