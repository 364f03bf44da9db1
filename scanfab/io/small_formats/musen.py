"""MUSEN's "Export as text": an object in each row, as numbers of properties and their values."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, ReadError, ScanfabNote
from scanfab.base.typing import FloatArray
from scanfab.io.files import Stamp, first_bytes, stamp_of
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.counted_rows import spelt, text_of
from scanfab.io.parse.text_table import parse_some
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

# id, type, and for a sphere two numbers as its geometry, radius and contact radius
FIRST = re.compile(rb"\A(?:\xef\xbb\xbf)?0 \d{1,15} 1 (?:1|9|13|14) 5 ")
ID, TIME, GEOMETRY, PLACE, ACTIVE = b"0", b"2", b"5", b"12", b"24"
# the rows of spheres: id, type, and the type of a sphere
SPHERES = re.compile(
    rb"^[ \t\r\f\v]*0[ \t\r\f\v]+\S+[ \t\r\f\v]+1[ \t\r\f\v]+1(?:[ \t\r\f\v].*)?$", re.MULTILINE
)
WHOLE = re.compile(rb"[-+]?\d{1,99}")
# solid and liquid ones
BOND = re.compile(rb"\n0 \S+ 1 (?:9|13) ")
PERIODIC = re.compile(rb"^28[ \t]+([01])((?:[ \t]+\S+){9})[ \t]*\r?$", re.MULTILINE)
# how many values follow the number of a property
SIZES = {
    ID: 1, b"1": 1, TIME: 1, GEOMETRY: 2, b"10": 3, b"11": 3, PLACE: 3, b"15": 3, b"16": 3,
    b"17": 3, b"18": 1, b"19": 3, b"20": 3, b"23": 1, ACTIVE: 2, b"31": 4, b"36": 9, b"37": 1,
}  # fmt: skip


class MusenReader:
    """Reader plugin for MUSEN."""

    name = "musen"
    description = "MUSEN's export as text: spheres at all its times, periodic domain"
    extensions: tuple[str, ...] = (".txt",)

    def recognises(self, path: Path) -> bool:
        """By the properties that the first row begins with."""
        return FIRST.match(first_bytes(path)) is not None

    def kind(self, path: Path) -> FileKind:
        """Grains; bonds among them are no contacts."""
        return "grains" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One for each time of the first sphere; ``start`` of a snapshot is its number."""
        times = _export(path).states[0, :, 0].tolist()
        return [
            Snapshot(path, time=time, start=number, stop=number + 1)
            for number, time in enumerate(times)
        ]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The spheres that are active at the time; objects of other kinds are passed over."""
        path, export = snapshot.path, _export(snapshot.path)
        if export.has_bonds:
            warnings.warn(
                "MUSEN's bonds are not read: bonded grains need not touch, and contacts are found "
                "by geometry",
                ScanfabNote,
                stacklevel=2,
            )
        time, place = np.split(export.states[:, snapshot.start], [1], axis=1)
        lacking = np.flatnonzero(time[:, 0] != snapshot.time)
        if len(lacking):
            raise ReadError(
                f"{path}: the sphere {export.id[lacking[0]]:g} has no state at the time "
                f"{snapshot.time}: export all objects at the same times"
            )
        is_there = np.all((export.active[:, :1] <= time) & (time <= export.active[:, 1:]), axis=1)
        columns = {"id": export.id, "radius": export.radius, "position": place}
        there = {name: values[is_there] for name, values in columns.items()}
        return grain_table(path, there, export.cell, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It has none."""
        raise ReadError(f"{snapshot.path}: MUSEN's export holds bonds, but no contacts")


class _Export(NamedTuple):
    """All spheres of a file."""

    id: FloatArray
    radius: FloatArray
    active: FloatArray
    """From when and until when each is there, shape (N, 2)."""
    states: FloatArray
    """Time and place at each time of the first sphere, shape (N, times, 4); NaN if it has fewer."""
    cell: Cell | None
    has_bonds: bool


def _export(path: Path) -> _Export:
    """The spheres of a file, which is read once for all its frames."""
    return _export_of(path, stamp_of(path))


@lru_cache(maxsize=1)
def _export_of(path: Path, stamp: Stamp) -> _Export:
    """What a file holds, as it stood then."""
    data = text_of(Snapshot(path))
    rows = [row[0] for row in SPHERES.finditer(data)]
    if not rows:
        raise ReadError(f"{path}: expected spheres (0 ID 1 1 5 RADIUS ...), found none")
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    table = _regular(path, rows)
    table = _row_by_row(path, rows) if table is None else table
    unknown = np.flatnonzero(np.isnan(table[:, 5]))
    if len(unknown):
        raise _no_state(path, rows[unknown[0]])
    states = table[:, 5:].reshape(len(table), -1, 4)
    return _Export(
        table[:, 0],
        table[:, 1],
        table[:, 3:5],
        states,
        _cell(path, data),
        BOND.search(data) is not None,
    )


class _Layout:
    """Where which property stands in a row: the same in all rows that have the same ones."""

    def __init__(self, path: Path, row: bytes) -> None:
        words = row.split()
        self.width, place = len(words), 0
        self.keys: dict[int, bytes] = {}
        while place < len(words):
            is_whole = WHOLE.fullmatch(words[place]) is not None
            # 015 is 15, as in files that are parsed at once
            key = b"%d" % int(words[place]) if is_whole else words[place]
            self.keys[place] = key
            size = SIZES.get(key)
            if size is None:
                raise ReadError(
                    f"{path}: expected the number of a property, found {spelt(words[place])} in "
                    f"the row that begins {spelt(row[:60])}"
                )
            place += 1 + size
        states, time = [], None
        for key_place, key in self.keys.items():
            if key == TIME:
                time = key_place
            elif key == PLACE and time is not None:
                states += [time + 1, key_place + 1, key_place + 2, key_place + 3]
        found = {key: key_place for key_place, key in self.keys.items()}
        if place != len(words) or not states or not {ID, GEOMETRY} <= found.keys():
            raise _no_state(path, row)
        self.has_active = ACTIVE in found
        own = [key for key in (ID, GEOMETRY, ACTIVE) if key in found]
        self.places = [found[key] + k + 1 for key in own for k in range(SIZES[key])] + states

    def fits(self, words: list[bytes]) -> bool:
        """Whether another row has the same properties at the same places."""
        same = len(words) == self.width
        return same and all(words[place] == key for place, key in self.keys.items())

    def table(self, values: FloatArray) -> FloatArray:
        """Id, two radii, from when and until when, and states; of some times without an end."""
        if self.has_active:
            return values
        always = np.broadcast_to((-np.inf, np.inf), (len(values), 2))
        return np.hstack([values[:, :3], always, values[:, 3:]])


def _regular(path: Path, rows: list[bytes]) -> FloatArray | None:
    """The table of many rows that all have the layout of the first; else None."""
    layout = _Layout(path, rows[0])
    keys, places = len(layout.keys), [*layout.keys, *layout.places]
    found = parse_some(b"\n".join([*rows, b""]), layout.width, places, whole=layout.keys)
    if found is None or np.any(found[:, :keys] != [int(key) for key in layout.keys.values()]):
        return None
    return layout.table(found[:, keys:])


def _row_by_row(path: Path, rows: list[bytes]) -> FloatArray:
    """The table of rows of which each may have another layout."""
    layout, parts = _Layout(path, rows[0]), []
    for row in rows:
        words = row.split()
        if not layout.fits(words):
            layout = _Layout(path, row)
        numbers = _numbers(path, row, [words[place] for place in layout.places])
        parts.append(layout.table(np.array([numbers]))[0])
    table = np.full((len(parts), len(parts[0])), np.nan)
    for own, part in zip(table, parts, strict=True):
        known = min(len(own), len(part))
        own[:known] = part[:known]
    return table


def _no_state(path: Path, row: bytes) -> ReadError:
    return ReadError(f"{path}: expected 2 TIME 12 X Y Z ... in the row of {spelt(row[:60])}")


def _numbers(path: Path, line: bytes, words: Sequence[bytes]) -> list[float]:
    try:
        # float() takes 1_000 for a number
        if b"_" in line and b"_" in b" ".join(words):
            raise ValueError
        return list(map(float, words))
    except ValueError:
        raise ReadError(
            f"{path}: expected numbers, found {spelt(b' '.join(words))} in the row that begins "
            f"{spelt(line[:60])}"
        ) from None


def _cell(path: Path, data: bytes) -> Cell | None:
    """The periodic domain, if it is switched on: along which axes, its low and its high corner."""
    found = PERIODIC.search(data, max(data.rfind(b"\n28"), 0))
    if found is None or found[1] == b"0":
        return None
    along, low, high = np.array(_numbers(path, found[0], found[2].split())).reshape(3, 3)
    edges: FloatArray = high - low
    # a domain that does not repeat along an axis may have no width there
    edges[(along == 0) & (edges <= 0)] = max(edges.max(), 0.0)
    try:
        return Cell(edges, (bool(along[0]), bool(along[1]), bool(along[2])), low)
    except PackingError as error:
        raise ReadError(f"{path}: its periodic domain (28) is no cell: {error}") from None
