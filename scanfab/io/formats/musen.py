"""MUSEN's "Export as text": an object in each row, as numbers of properties and their values."""

from __future__ import annotations

import re
import warnings
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError, ScanfabNote
from scanfab.base.typing import FloatArray
from scanfab.io.files import Stamp, first_bytes, stamp_of
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbered_frames, numbers
from scanfab.io.reader import Snapshot
from scanfab.io.text import Columns, spelt, text_of
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
# the periodic domain, if it is switched on: along which axes, its low and its high corner
PERIODIC = re.compile(rb"^28 1((?: \S+){9})[ \t]*\r?$", re.MULTILINE)


class Export(NamedTuple):
    """All spheres of a file."""

    id: FloatArray
    radius: FloatArray
    active: FloatArray
    """From when and until when each is there, shape (N, 2)."""
    states: FloatArray
    """Time and place, shape (N, times, 4)."""
    cell: Cell | None
    has_bonds: bool


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
        times = _export(path, stamp_of(path)).states[0, :, 0].tolist()
        return numbered_frames(path, ((None, time) for time in times))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The spheres that are active at the time; objects of other kinds are left out."""
        path = snapshot.path
        export = _export(path, stamp_of(path))
        if export.has_bonds:
            warnings.warn(
                "MUSEN's bonds are not read: bonded grains need not touch, and contacts are found "
                "by geometry",
                ScanfabNote,
                stacklevel=2,
            )
        time, place = np.split(export.states[:, snapshot.start], [1], axis=1)
        other = np.flatnonzero(time[:, 0] != snapshot.time)
        if len(other):
            raise ReadError(
                f"{path}: the sphere {export.id[other[0]]:g} has no state at the time "
                f"{snapshot.time}: export all objects at the same times"
            )
        is_there = np.all((export.active[:, :1] <= time) & (time <= export.active[:, 1:]), axis=1)
        columns = {"id": export.id, "radius": export.radius, "position": place}
        return {name: values[is_there] for name, values in columns.items()}, export.cell


@lru_cache(maxsize=1)
def _export(path: Path, stamp: Stamp) -> Export:
    """The spheres of a file, which is parsed once for all its frames while its stamp stays."""
    data = text_of(Snapshot(path))
    lines = data.split(b"\n")
    if lines[-1]:
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    # objects stand above all other lines: one among them is an object whose first word is damaged
    stop = max((k + 1 for k, line in enumerate(lines) if line.startswith(b"0 ")), default=0)
    table: list[list[float]] = []
    kinds, row = set(), None
    for number, line in enumerate(lines[:stop], start=1):
        where, match = f"{path}, line {number}", OBJECT.match(line)
        if match is None:
            raise ReadError(f"{where}: expected 0 ID 1 TYPE 5 ..., found {spelt(line[:60])}")
        kinds.add(match[1])
        if match[1] != SPHERE:
            continue
        row = row or _row_like(where, line)
        found = row.fullmatch(line)
        if found is None:
            raise ReadError(f"{where}: expected the properties of the first sphere, found others")
        table.append(numbers(where, b" ".join(found.groups()), row.groups))
    if not table:
        raise ReadError(f"{path}: expected spheres (0 ID 1 1 5 RADIUS ...), found none")
    values = np.array(table)
    if values.shape[1] % 4 == 2:
        # times of activity were not exported
        values = np.insert(values, [2, 2], [-np.inf, np.inf], axis=1)
    states = values[:, 4:].reshape(len(values), -1, 4)
    has_bonds = not kinds.isdisjoint(BONDS)
    cell, domain = None, PERIODIC.search(data)
    if domain is not None:
        where = f"{path}: its periodic domain (28)"
        along, low, high = np.reshape(numbers(where, domain[1], 9), (3, 3))
        edges = high - low
        # a domain that is not periodic along an axis may have no width there
        edges[(along == 0) & (edges <= 0)] = edges.max()
        cell = cell_of(where, edges, along, low)
    return Export(values[:, 0], values[:, 1], values[:, 2:4], states, cell, has_bonds)


def _row_like(where: str, line: bytes) -> re.Pattern[bytes]:
    """
    The pattern of all rows with the properties of the first sphere; its groups are what is read.

    These are id, radius, times of activity (if exported), and time and place of each state.
    """
    words, parts, found = line.split(), [], []
    while words and words[0] in SIZES:
        key, read = words[0], READ.get(words[0], 0)
        parts += [key, *[rb"(\S+)"] * read, *[rb"\S+"] * (SIZES[key] - read)]
        found += [key] * (read > 0)
        words = words[1 + SIZES[key] :]
    times = found.count(TIME)
    expected = [ID, GEOMETRY, *[ACTIVE] * (ACTIVE in found), *[TIME, PLACE] * times]
    if words or not times or found != expected:
        raise ReadError(
            f"{where}: expected properties 0 ID ... 5 RADIUS ... 2 TIME 12 X Y Z ... in the row, "
            f"found {spelt(b' '.join([*found, *words]))}"
        )
    return re.compile(rb"[ ]+".join(parts) + rb"\s*")
