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
from scanfab.io.columns import grain_table
from scanfab.io.files import Stamp, first_bytes, stamp_of
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbers
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.io.text import spelt, text_of
from scanfab.packing.cell import Cell

# id, type, and its geometry: for a sphere radius and contact radius
OBJECT = re.compile(rb"0 \d{1,15} 1 (1|9|13|14) 5 ")
SPHERE, BONDS = b"1", (b"9", b"13")
ID, TIME, GEOMETRY, PLACE, ACTIVE = b"0", b"2", b"5", b"12", b"24"
# how many values follow the number of a property
SIZES = {
    ID: 1, b"1": 1, TIME: 1, GEOMETRY: 2, b"10": 3, b"11": 3, PLACE: 3, b"15": 3, b"16": 3,
    b"17": 3, b"18": 1, b"19": 3, b"20": 3, b"23": 1, ACTIVE: 2, b"31": 4, b"36": 9, b"37": 1,
}  # fmt: skip
# of these so many values are read
READ = {ID: 1, GEOMETRY: 1, ACTIVE: 2, TIME: 1, PLACE: 3}
PERIODIC = re.compile(rb"^28 ([01])((?: \S+){9})[ \t]*\r?$", re.MULTILINE)


class MusenReader(GrainsOnly):
    """Reader plugin for MUSEN."""

    name = "musen"
    description = "MUSEN's export as text: spheres at all its times, periodic domain"
    extensions: tuple[str, ...] = (".txt",)

    def recognises(self, path: Path) -> bool:
        """By the properties that the first row begins with."""
        return OBJECT.match(first_bytes(path).removeprefix(b"\xef\xbb\xbf")) is not None

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One for each time of the first sphere; ``start`` of a snapshot is its number."""
        times = _export(path, stamp_of(path)).states[0, :, 0].tolist()
        return [
            Snapshot(path, time=time, start=number, stop=number + 1)
            for number, time in enumerate(times)
        ]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
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
        there = {name: values[is_there] for name, values in columns.items()}
        return grain_table(path, there, export.cell, options)


class _Export(NamedTuple):
    """All spheres of a file."""

    id: FloatArray
    radius: FloatArray
    active: FloatArray
    """From when and until when each is there, shape (N, 2)."""
    states: FloatArray
    """Time and place, shape (N, times, 4)."""
    cell: Cell | None
    has_bonds: bool


@lru_cache(maxsize=1)
def _export(path: Path, stamp: Stamp) -> _Export:
    """The spheres of a file, which is parsed once for all its frames while its stamp stays."""
    data = text_of(Snapshot(path))
    lines = data.split(b"\n")
    if lines[-1]:
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    # objects stand above all other lines: one among them is an object whose first word is damaged
    stop = max((k + 1 for k, line in enumerate(lines) if line.startswith(b"0 ")), default=0)
    table: list[list[float]] = []
    keys: dict[int, bytes] = {}
    kinds = set()
    for number, line in enumerate(lines[:stop], start=1):
        where, match = f"{path}, line {number}", OBJECT.match(line)
        if match is None:
            raise ReadError(f"{where}: expected 0 ID 1 TYPE 5 ..., found {spelt(line[:60])}")
        kinds.add(match[1])
        if match[1] != SPHERE:
            continue
        words = line.split()
        if not keys:
            width, keys, places = len(words), *_layout(where, words)
        if len(words) != width or any(words[place] != key for place, key in keys.items()):
            raise ReadError(f"{where}: expected the properties of the first sphere, found others")
        table.append(numbers(where, b" ".join(words[place] for place in places), len(places)))
    if not table:
        raise ReadError(f"{path}: expected spheres (0 ID 1 1 5 RADIUS ...), found none")
    values, active = np.array(table), np.tile((-np.inf, np.inf), (len(table), 1))
    if ACTIVE in keys.values():
        values, active = np.delete(values, (2, 3), axis=1), values[:, 2:4]
    states = values[:, 2:].reshape(len(values), -1, 4)
    has_bonds = not kinds.isdisjoint(BONDS)
    return _Export(values[:, 0], values[:, 1], active, states, _cell(path, data), has_bonds)


def _layout(where: str, words: list[bytes]) -> tuple[dict[int, bytes], list[int]]:
    """
    The numbers of all properties in a row, by their places, and the places of the values we read.

    These are id, radius, times of activity (if exported), and time and place of each state.
    """
    keys, place = {}, 0
    while place < len(words):
        keys[place] = words[place]
        if words[place] not in SIZES:
            raise ReadError(
                f"{where}: expected the number of a property, found {spelt(words[place])}"
            )
        place += 1 + SIZES[words[place]]
    found = [key for key in keys.values() if key in READ]
    times = found.count(TIME)
    expected = [ID, GEOMETRY, *[ACTIVE] * (ACTIVE in found), *[TIME, PLACE] * times]
    if place != len(words) or found != expected or not times:
        raise ReadError(f"{where}: expected 0 ID ... 5 RADIUS ... 2 TIME 12 X Y Z ... in the row")
    return keys, [place + k for place, key in keys.items() for k in range(1, 1 + READ.get(key, 0))]


def _cell(path: Path, data: bytes) -> Cell | None:
    """The periodic domain, if it is switched on: along which axes, its low and its high corner."""
    found = PERIODIC.search(data)
    if found is None or found[1] == b"0":
        return None
    where = f"{path}: its periodic domain (28)"
    along, low, high = np.reshape(numbers(where, found[2], 9), (3, 3))
    edges = high - low
    # a domain that is not periodic along an axis may have no width there
    edges[(along == 0) & (edges <= 0)] = edges.max()
    return cell_of(where, edges, along, low)
