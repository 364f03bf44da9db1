"""MUSEN's "Export as text": an object in each row, as numbers of properties and their values."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from operator import itemgetter
from pathlib import Path

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import first_bytes
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.counted_rows import spelt, text_of
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

__all__ = ["MusenReader"]

# id, type, and for a sphere two numbers as its geometry, radius and contact radius
FIRST = re.compile(rb"\A(?:\xef\xbb\xbf)?0 \d{1,15} 1 (?:1|9|13|14) 5 ")
ID, TYPE, TIME, GEOMETRY, PLACE, ACTIVE = b"0", b"1", b"2", b"5", b"12", b"24"
SPHERE = b"1"
PERIODIC = re.compile(rb"^28[ \t]+([01])((?:[ \t]+\S+){9})[ \t]*\r?$", re.MULTILINE)
# how many values follow the number of a property
SIZES = {
    ID: 1, TYPE: 1, TIME: 1, GEOMETRY: 2, b"10": 3, b"11": 3, PLACE: 3, b"15": 3, b"16": 3,
    b"17": 3, b"18": 1, b"19": 3, b"20": 3, b"23": 1, ACTIVE: 2, b"31": 4, b"36": 9, b"37": 1,
}  # fmt: skip


WANTED = (ID, TIME, GEOMETRY, PLACE, ACTIVE)


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
        first = next(_objects(path, text_of(Snapshot(path))), None)
        if first is None:
            raise ReadError(f"{path}: expected spheres (0 ID 1 1 5 RADIUS ...), found none")
        times = [time for time, _ in first[3]]
        return [
            Snapshot(path, time=time, start=number, stop=number + 1)
            for number, time in enumerate(times)
        ]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The spheres that are active at the time; objects of other kinds are passed over."""
        path, data = snapshot.path, text_of(Snapshot(snapshot.path))
        if not data.endswith(b"\n"):
            raise ReadError(f"{path}: the last line has no end: the file is incomplete")
        rows = []
        for id, radius, (begin, end), states in _objects(path, data):
            if len(states) <= snapshot.start or states[snapshot.start][0] != snapshot.time:
                raise ReadError(
                    f"{path}: the sphere {id:g} has no state at the time {snapshot.time}: export "
                    f"all objects at the same times"
                )
            if begin <= states[snapshot.start][0] <= end:
                rows.append((id, radius, *states[snapshot.start][1]))
        table = np.array(rows, dtype=np.float64).reshape(-1, 5)
        columns = dict(zip(("id", "radius", "x", "y", "z"), table.T, strict=True))
        return grain_table(path, columns, _cell(path, data), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It has none."""
        raise ReadError(f"{snapshot.path}: MUSEN's export holds bonds, but no contacts")


Object = tuple[float, float, tuple[float, float], list["State"]]


def _spheres(data: bytes) -> Iterator[tuple[bytes, list[bytes]]]:
    """The rows of spheres, and their words."""
    start = 0
    while start < len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        line = data[start:end]
        words = line.split()
        if words[2:4] == [TYPE, SPHERE] and words[0] == ID:
            yield line, words
        start = end + 1


State = tuple[float, list[float]]


class _Layout:
    """Where which property stands in a row: the same in all rows that have the same ones."""

    def __init__(self, path: Path, words: list[bytes], line: bytes) -> None:
        keys: dict[int, bytes] = {}
        place = 0
        while place < len(words):
            keys[place] = words[place]
            size = SIZES.get(words[place])
            if size is None:
                raise ReadError(
                    f"{path}: expected the number of a property, found {spelt(words[place])} in "
                    f"the row that begins {spelt(line[:60])}"
                )
            place += 1 + size
        self.length = len(words)
        self._keys, self._names = itemgetter(*keys), tuple(keys.values())
        # of the values that are wanted: where each begins among them
        wanted = [(place, key) for place, key in keys.items() if key in WANTED]
        first = np.cumsum([0, *(SIZES[key] for _, key in wanted)]).tolist()
        self.starts = {key: start for (_, key), start in zip(wanted, first, strict=False)}
        self.states, time = [], None
        for (_, key), start in zip(wanted, first, strict=False):
            if key == TIME:
                time = start
            elif key == PLACE and time is not None:
                self.states.append((time, start))
        self.is_whole = place == len(words) and self.starts.keys() >= {ID, GEOMETRY}
        self.values = itemgetter(*(at + k + 1 for at, key in wanted for k in range(SIZES[key])), 0)

    def fits(self, words: list[bytes]) -> bool:
        """Whether another row has the same properties at the same places."""
        return len(words) == self.length and self._keys(words) == self._names


def _objects(path: Path, data: bytes) -> Iterator[Object]:
    layout: _Layout | None = None
    for line, words in _spheres(data):
        if layout is None or not layout.fits(words):
            layout = _Layout(path, words, line)
        yield _object(path, layout, words, line)


def _object(path: Path, layout: _Layout, words: list[bytes], line: bytes) -> Object:
    """Id, radius, the times between which it is active, and its places at all times."""
    if not layout.is_whole or not layout.states:
        raise ReadError(f"{path}: expected 2 TIME 12 X Y Z ... in the row of {spelt(line[:60])}")
    # a word behind the last wanted one keeps them a tuple
    numbers = _numbers(path, line, layout.values(words)[:-1])
    starts = layout.starts
    active = (-np.inf, np.inf)
    if ACTIVE in starts:
        active = (numbers[starts[ACTIVE]], numbers[starts[ACTIVE] + 1])
    states = [(numbers[time], numbers[place : place + 3]) for time, place in layout.states]
    if states[0][0] != states[0][0]:
        raise ReadError(f"{path}: expected 2 TIME 12 X Y Z ... in the row of {spelt(line[:60])}")
    return numbers[starts[ID]], numbers[starts[GEOMETRY]], active, states


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
