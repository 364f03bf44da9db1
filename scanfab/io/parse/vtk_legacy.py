"""Legacy VTK files (``# vtk DataFile``), section by section: PolyData, grids of cells, boxes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.parse.vtk_data import Arrays, Cells, Content, FlawError, numbers

# numpy's types of VTK's; a binary file has the most significant byte first
TYPES = {
    "bit": "u1",  # eight to a byte in a binary file
    "char": "i1",
    "signed_char": "i1",
    "unsigned_char": "u1",
    "short": "i2",
    "unsigned_short": "u2",
    "int": "i4",
    "unsigned_int": "u4",
    "vtkidtype": "i4",  # as VTK writes it, whatever it has in memory
    "float": "f4",
    "long": "i8",
    "unsigned_long": "u8",
    "vtktypeint64": "i8",
    "vtktypeuint64": "u8",
    "double": "f8",
}
SECTIONS = {
    "vertices": "Verts",
    "lines": "Lines",
    "polygons": "Polys",
    "triangle_strips": "Strips",
    "cells": "Cells",
}
# the order of the rows of cell arrays, whatever that of the sections
ORDER = ("Verts", "Lines", "Polys", "Strips", "Cells")
COORDINATES = {"points": 3, "x_coordinates": 1, "y_coordinates": 1, "z_coordinates": 1}
# attributes with a fixed number of values for each point or cell
COMPONENTS = {
    "vectors": 3,
    "normals": 3,
    "tensors": 9,
    "tensors6": 6,
    "global_ids": 1,
    "pedigree_ids": 1,
    "edge_flags": 1,
}
HEAD = re.compile(
    rb"# vtk DataFile Version (\d{1,4})\.[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s", re.IGNORECASE
)
# letters that are looked for words at a time
PART = 1 << 24


def read_legacy(data: bytes) -> Content:
    """
    Read a file; of a box with coordinates along its axes the points are its two corners.

    Raises
    ------
    FlawError
        If it does not hold what its headers promise.
    """
    walk = _Walk(data)
    walk.through()
    return walk.content()


class _Walk:
    """A place in the file that moves behind one section after the other."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        head = HEAD.match(data)
        if head is None:
            raise FlawError(
                "expected a version, a title, and ASCII or BINARY in the first three lines"
            )
        self.place = head.end()
        self.is_ascii = head[2].upper() == b"ASCII"
        self.has_offsets = int(head[1]) >= 5
        # where the words of an ASCII file begin
        self.words = _word_starts(data) if self.is_ascii else np.zeros(0, np.int64)
        self.points: FloatArray | None = None
        self.axes: list[FloatArray] = []
        self.cells: dict[str, Cells] = {}
        self.types: IntArray | None = None
        self.point_arrays: Arrays = {}
        self.cell_arrays: Arrays = {}
        self.field_arrays: Arrays = {}
        # where the next attributes belong, and how many rows they have
        self.arrays, self.rows = self.field_arrays, 0

    @property
    def point_count(self) -> int:
        return 0 if self.points is None else len(self.points)

    @property
    def cell_count(self) -> int:
        return sum(len(cells.offsets) - 1 for cells in self.cells.values())

    def content(self) -> Content:
        """What was found."""
        points = self.points
        if points is None:
            points = _corners(self.axes)
        cells = [self.cells[kind] for kind in ORDER if kind in self.cells]
        if "Cells" in self.cells:
            types = np.zeros(0, np.int64) if self.types is None else self.types
            cells = [self.cells["Cells"]._replace(types=types)]
        return Content(points, tuple(cells), self.point_arrays, self.cell_arrays, self.field_arrays)

    def through(self) -> None:
        """Walk to the end."""
        while (words := self._line()) is not None:
            self._section(words[0].lower(), words)

    def _section(self, key: str, words: list[str]) -> None:
        if key in SECTIONS:
            self._cells(key, words)
        elif key in ("point_data", "cell_data"):
            self._attributes(key, words)
        elif key in COORDINATES:
            self._coordinates(key, words)
        elif key == "cell_types":
            if _count(words, 1) != self.cell_count:
                raise FlawError(f"CELL_TYPES has {words[1]} types for {self.cell_count} cells")
            self.types = self._values(words[0], self.cell_count, "int").astype(np.int64)
        elif key == "metadata":
            self._metadata()
        elif key == "field":
            self._field(words)
        elif key not in ("dataset", "dimensions"):
            self._attribute(key, words)

    def _coordinates(self, key: str, words: list[str]) -> None:
        count = _count(words, 1)
        if key == "points" and self.points is not None:
            raise FlawError("POINTS stand there twice")
        values = self._values(words[0], COORDINATES[key] * count, _word(words, 2))
        if key == "points":
            self.points = doubles(values.reshape(-1, 3))
        else:
            self.axes.append(doubles(values))

    def _attributes(self, key: str, words: list[str]) -> None:
        """The number of rows of the attributes that follow."""
        self.rows = _count(words, 1)
        is_of_points = key == "point_data"
        self.arrays = self.point_arrays if is_of_points else self.cell_arrays
        if self.rows != (self.point_count if is_of_points else self.cell_count):
            raise FlawError(
                f"{words[0]} has {self.rows} rows for {self.point_count} points and "
                f"{self.cell_count} cells"
            )

    def _metadata(self) -> None:
        """Lines of no interest, up to an empty one, whose counts must hold nevertheless."""
        promised = named = 0
        while (line := self._raw_line()) is not None and line.strip():
            words = _words(line)
            key = words[0].upper()
            if key == "INFORMATION":
                promised += _count(words, 1)
            named += key == "NAME"
            if key == "DATA" and len(words) > 2 and _count(words, 1) != len(words) - 2:
                raise FlawError(f"METADATA has {len(words) - 2} of {words[1]} values")
        if named != promised:
            raise FlawError(f"METADATA has {named} of {promised} entries")

    def _attribute(self, key: str, words: list[str]) -> None:
        """Values for each point or cell."""
        if key == "scalars":
            components = _count(words, 3) if len(words) > 3 else 1
            table = self.place
            following = self._line()
            if following is None or following[0].lower() != "lookup_table":
                self.place = table
            self._array(words, components, _word(words, 2))
        elif key in COMPONENTS:
            self._array(words, COMPONENTS[key], _word(words, 2))
        elif key == "texture_coordinates":
            self._array(words, _count(words, 2), _word(words, 3))
        elif key == "color_scalars":
            self._colours(words)
        elif key == "lookup_table":
            self._values(words[0], 4 * _count(words, 2), "unsigned_char")
        else:
            raise FlawError(f"expected the keyword of a section, found {words[0][:40]!r}")

    def _array(self, words: list[str], components: int, type: str) -> None:
        values = self._values(words[0], self.rows * components, type)
        self._keep(self.arrays, _word(words, 1), values, self.rows, components)

    def _colours(self, words: list[str]) -> None:
        """From 0 to 1 in a text, from 0 to 255 in a binary file."""
        components = _count(words, 2)
        type = "float" if self.is_ascii else "unsigned_char"
        values = self._values(words[0], self.rows * components, type)
        self._keep(self.arrays, _word(words, 1), values, self.rows, components)

    def _keep(
        self, arrays: Arrays, name: str, values: npt.NDArray[Any], rows: int, components: int
    ) -> None:
        # names cannot hold blanks: VTK writes them as %20
        named = unquote(name.encode("latin1").decode("utf-8", "replace"))
        arrays[named] = values if components == 1 else values.reshape(rows, components)

    def _field(self, words: list[str]) -> None:
        """Arrays of any shape, each behind a line NAME COMPONENTS TUPLES TYPE."""
        for _ in range(_count(words, 2)):
            header = self._line()
            if header is not None and header[0].lower() == "metadata":
                self._metadata()
                header = self._line()
            if header is None:
                raise FlawError(f"{words[0]} has less than {words[2]} arrays")
            components, tuples = _count(header, 1), _count(header, 2)
            if self.rows and tuples != self.rows:
                raise FlawError(f"{header[0][:40]!r} has {tuples} of {self.rows} rows")
            values = self._values(header[0], components * tuples, _word(header, 3))
            self._keep(self.arrays, header[0], values, tuples, components)

    def _cells(self, key: str, words: list[str]) -> None:
        """Cells: count and points of each, or since version 5.1 offsets and points."""
        kind, count, size = SECTIONS[key], _count(words, 1), _count(words, 2)
        if kind in self.cells:
            raise FlawError(f"{words[0]} stand there twice")
        if not self.has_offsets:
            flat = self._whole(words[0], size, "int")
            self.cells[kind] = _from_list(kind, flat, count, words[0])
            return
        found = []
        for keyword, length in (("OFFSETS", count), ("CONNECTIVITY", size)):
            header = self._line()
            if header is None or header[0].upper() != keyword:
                raise FlawError(f"{words[0]} has no {keyword}")
            found.append(self._whole(words[0], length, _word(header, 1)))
        ends, points = found
        if count == 0:
            ends = np.zeros(1, np.int64)
        if ends[0] != 0 or ends[-1] != size or np.any(np.diff(ends) < 0):
            raise FlawError(f"{words[0]}: the offsets of the cells are wrong")
        self.cells[kind] = Cells(kind, ends, points)

    def _whole(self, name: str, count: int, type: str) -> IntArray:
        if TYPES.get(type.lower(), "f")[0] == "f":
            raise FlawError(f"{name[:40]}: expected whole numbers, found the type {type[:40]!r}")
        return self._values(name, count, type).astype(np.int64)

    def _values(self, name: str, count: int, type: str) -> npt.NDArray[Any]:
        """So many values; the place moves behind them."""
        stored = TYPES.get(type.lower())
        if stored is None:
            raise FlawError(f"{name[:40]}: there is no type {type[:40]!r}")
        begin, size = self.place, int(stored[1])
        if not self.is_ascii:
            bits = type.lower() == "bit"
            needed = (count + 7) // 8 if bits else count * size
            if begin + needed > len(self.data):
                found = (len(self.data) - begin) * 8 // (1 if bits else 8 * size)
                raise FlawError(f"{name[:40]} has {found} of {count} values")
            self.place += needed
            values = np.frombuffer(self.data, f">{stored}", needed // size, begin)
            return np.unpackbits(values)[:count] if bits else values.astype(stored)
        first = int(np.searchsorted(self.words, begin))
        if len(self.words) - first < count:
            raise FlawError(f"{name[:40]} has {len(self.words) - first} of {count} values")
        last = first + count
        self.place = int(self.words[last]) if last < len(self.words) else len(self.data)
        try:
            return numbers(self.data[begin : self.place], count, stored)
        except FlawError as flaw:
            raise FlawError(f"{name[:40]}: {flaw}") from None

    def _line(self) -> list[str] | None:
        """Words of the next line that has any; None at the end."""
        while (line := self._raw_line()) is not None:
            if line.strip():
                return _words(line)
        return None

    def _raw_line(self) -> bytes | None:
        if self.place >= len(self.data):
            return None
        end = self.data.find(b"\n", self.place)
        end = len(self.data) if end < 0 else end + 1
        line, self.place = self.data[self.place : end], end
        return line


def _word_starts(data: bytes) -> IntArray:
    """Places of the first letters of all words."""
    return np.concatenate([np.zeros(0, np.int64), *_word_starts_by_part(data)])


def _word_starts_by_part(data: bytes) -> Iterator[IntArray]:
    is_blank = True
    for start in range(0, len(data), PART):
        letters = np.frombuffer(data, np.uint8, min(PART, len(data) - start), start)
        filled = (letters != 32) & ((letters < 9) | (letters > 13))
        begins = filled.copy()
        begins[1:] &= ~filled[:-1]
        begins[0] &= is_blank
        is_blank = not filled[-1]
        yield start + np.flatnonzero(begins)


def _from_list(kind: str, flat: IntArray, count: int, name: str) -> Cells:
    """Cells from so many times a count and as many points."""
    width = len(flat) // max(count, 1)
    if width and width * count == len(flat) and np.all(flat[::width] == width - 1):
        # nearly always they have as many points each
        points = flat.reshape(count, width)[:, 1:].ravel()
        return Cells(kind, (width - 1) * np.arange(count + 1), points)
    heads: list[int] = []
    place = 0
    while place < len(flat) and flat[place] >= 0 and len(heads) <= count:
        heads.append(place)
        place += int(flat[place]) + 1
    if place != len(flat) or len(heads) != count:
        raise FlawError(f"{name}: {len(flat)} numbers are not {count} cells")
    return Cells(kind, np.cumsum([0, *flat[heads]]), np.delete(flat, heads))


def _corners(axes: list[FloatArray]) -> FloatArray:
    """The low and high corner of a box, shape (2, 3); no points without three axes."""
    if len(axes) != 3 or any(one.size == 0 for one in axes):
        return np.zeros((0, 3))
    return np.array([[one.min() for one in axes], [one.max() for one in axes]])


def _words(line: bytes) -> list[str]:
    return [word.decode("latin1") for word in line.split()]


def _count(words: list[str], place: int) -> int:
    """A whole number in a header."""
    word = _word(words, place)
    if not re.fullmatch(r"[0-9]{1,18}", word):
        raise FlawError(f"{words[0][:40]}: expected a whole number, found {word[:40]!r}")
    return int(word)


def _word(words: list[str], place: int) -> str:
    if place >= len(words):
        raise FlawError(f"{words[0][:40]}: the line is incomplete")
    return words[place]
