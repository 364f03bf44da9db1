"""
Whether a legacy VTK file holds what its headers promise.

VTK fills what is missing with whatever memory holds, takes all the memory that a header asks for,
and walks off the end of a list of cells. So the file is walked through here before, section by
section, and nothing is handed on that does not fit.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from scanfab.base.typing import IntArray
from scanfab.io.parse.vtk_flaws import FlawError

__all__ = ["check_legacy", "count_words"]


# bytes of a value in a binary file
SIZES = {
    "bit": 1,  # eight of them in fact
    "char": 1,
    "signed_char": 1,
    "unsigned_char": 1,
    "short": 2,
    "unsigned_short": 2,
    "int": 4,
    "unsigned_int": 4,
    "vtkidtype": 4,  # as VTK writes it, whatever it has in memory
    "float": 4,
    "long": 8,
    "unsigned_long": 8,
    "vtktypeint64": 8,
    "vtktypeuint64": 8,
    "double": 8,
}
CELLS = ("vertices", "lines", "polygons", "triangle_strips", "cells")
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


def check_legacy(data: bytes) -> int:
    """Walk through a legacy VTK file; FlawError if something does not fit. The bytes it fills."""
    _Walk(data).through()
    return len(data)


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
        # points and cells so far, and values of each attribute
        self.points = self.cells = self.rows = 0

    def through(self) -> None:
        """Walk to the end."""
        while (words := self._line()) is not None:
            self._section(words[0].lower(), words)

    def _section(self, key: str, words: list[str]) -> None:
        if key in CELLS:
            self._cells(words)
        elif key in ("point_data", "cell_data"):
            self._attributes(key, words)
        elif key in COORDINATES:
            self._coordinates(key, words)
        elif key == "cell_types":
            if _count(words, 1) != self.cells:
                raise FlawError(f"CELL_TYPES has {words[1]} types for {self.cells} cells")
            self._numbers(*self._values(words[0], self.cells, "int"), self.cells, "int")
        elif key == "metadata":
            self._metadata()
        elif key == "field":
            self._field(words)
        elif key not in ("dataset", "dimensions"):
            self._attribute(key, words)

    def _coordinates(self, key: str, words: list[str]) -> None:
        count = _count(words, 1)
        if key == "points":
            if self.points:
                raise FlawError("POINTS stand there twice")
            self.points = count
        self._values(words[0], COORDINATES[key] * count, _word(words, 2))

    def _attributes(self, key: str, words: list[str]) -> None:
        """The number of rows of the attributes that follow."""
        self.rows = _count(words, 1)
        if self.rows != (self.points if key == "point_data" else self.cells):
            raise FlawError(
                f"{words[0]} has {self.rows} rows for {self.points} points and {self.cells} cells"
            )

    def _metadata(self) -> None:
        """Lines of no interest, up to an empty one; but VTK relies on the counts in them."""
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
        name = words[0]
        if key == "scalars":
            components = _count(words, 3) if len(words) > 3 else 1
            table = self.place
            following = self._line()
            if following is None or following[0].lower() != "lookup_table":
                self.place = table
            self._values(name, self.rows * components, _word(words, 2))
        elif key in COMPONENTS:
            self._values(name, self.rows * COMPONENTS[key], _word(words, 2))
        elif key == "texture_coordinates":
            self._values(name, self.rows * _count(words, 2), _word(words, 3))
        elif key == "color_scalars":
            self._values(name, self.rows * _count(words, 2), "unsigned_char")
        elif key == "lookup_table":
            self._values(name, 4 * _count(words, 2), "unsigned_char")
        else:
            raise FlawError(f"expected the keyword of a section, found {name[:40]!r}")

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
            self._values(header[0], components * tuples, _word(header, 3))

    def _cells(self, words: list[str]) -> None:
        """Cells: count and points of each, or since version 5.1 offsets and points."""
        count, size = _count(words, 1), _count(words, 2)
        if not self.has_offsets:
            start, stop = self._values(words[0], size, "int")
            if not _is_list_of_cells(self._numbers(start, stop, size, "int"), count):
                raise FlawError(f"{words[0]}: {size} numbers are not {count} cells")
            self.cells += count
            return
        numbers = []
        for keyword, length in (("OFFSETS", count), ("CONNECTIVITY", size)):
            header = self._line()
            if header is None or header[0].upper() != keyword:
                raise FlawError(f"{words[0]} has no {keyword}")
            type = _word(header, 1).lower()
            start, stop = self._values(words[0], length, type)
            numbers.append(self._numbers(start, stop, length, type))
        ends = numbers[0]
        if count and (ends[0] != 0 or ends[-1] != size or np.any(np.diff(ends) < 0)):
            raise FlawError(f"{words[0]}: the offsets of the cells are wrong")
        self.cells += max(count - 1, 0)

    def _values(self, name: str, count: int, type: str) -> tuple[int, int]:
        """Move behind so many values; where they begin and end."""
        size = SIZES.get(type.lower())
        if size is None:
            raise FlawError(f"{name[:40]}: there is no type {type[:40]!r}")
        begin = self.place
        if self.is_ascii:
            first = int(np.searchsorted(self.words, begin))
            found = len(self.words) - first
            last = first + count
            stop = int(self.words[last]) if last < len(self.words) else len(self.data)
        else:
            found = (len(self.data) - begin) // size
            bits = type.lower() == "bit"
            stop = begin + ((count + 7) // 8 if bits else count * size)
            found = 8 * found if bits else found
        if found < count:
            raise FlawError(f"{name[:40]} has {found} of {count} values")
        self.place = stop
        return begin, stop

    def _numbers(self, start: int, stop: int, count: int, type: str) -> IntArray:
        """Whole numbers between two places."""
        if not self.is_ascii:
            dtype = f">i{SIZES[type]}"
            return np.frombuffer(self.data, dtype, count, start).astype(np.int64)
        try:
            return np.fromiter(map(int, self.data[start:stop].split()), np.int64, count)
        except (ValueError, OverflowError):
            raise FlawError("expected whole numbers for the points of cells") from None

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
    return np.flatnonzero(_begins_word(data))


def count_words(data: bytes) -> int:
    """How many words there are between blanks."""
    return int(np.count_nonzero(_begins_word(data)))


def _begins_word(data: bytes) -> npt.NDArray[np.bool_]:
    letters = np.frombuffer(data, np.uint8)
    begins: npt.NDArray[np.bool_] = (letters != 32) & ((letters < 9) | (letters > 13))
    begins[1:] &= ~begins[:-1]
    return begins


def _is_list_of_cells(numbers: IntArray, count: int) -> bool:
    """Whether the numbers are so many times a count and as many points."""
    # nearly always they have as many points each
    width = len(numbers) // max(count, 1)
    if width and width * count == len(numbers) and np.all(numbers[::width] == width - 1):
        return True
    place = cells = 0
    while place < len(numbers):
        if numbers[place] < 0:
            return False
        place += int(numbers[place]) + 1
        cells += 1
    return place == len(numbers) and cells == count


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
