"""
Whether a VTK XML file holds what its head promises.

VTK takes all the memory that a head asks for, leaves in it what it was when values are missing,
and follows offsets of cells wherever they lead. So the sizes of all arrays, and the offsets, are
checked here before.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scanfab.base.typing import IntArray
from scanfab.io.parse.vtk_flaws import FlawError
from scanfab.io.parse.vtk_legacy import count_words

__all__ = ["check_xml"]


ROOT = re.compile(rb"<VTKFile\b([^<>]*)>")
# the arrays of a piece stand in sections
SECTIONS = (b"FieldData", b"PointData", b"CellData", b"Points", b"Coordinates")
CELLS = (b"Verts", b"Lines", b"Strips", b"Polys", b"Cells")
TAG = re.compile(
    rb"<(RectilinearGrid|Piece|DataArray|" + b"|".join((*SECTIONS, *CELLS)) + rb")\b([^<>]*)>"
)
ATTRIBUTE = re.compile(rb"\b(\w+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
BLANKS = re.compile(rb"\s*")
TYPES = {
    b"Int8": "i1",
    b"UInt8": "u1",
    b"Int16": "i2",
    b"UInt16": "u2",
    b"Int32": "i4",
    b"UInt32": "u4",
    b"Int64": "i8",
    b"UInt64": "u8",
    b"Float32": "f4",
    b"Float64": "f8",
}
# how each compressor's blocks are unpacked; what it makes of one byte at most
UNPACK: dict[bytes, tuple[Callable[[bytes], bytes] | None, int]] = {
    b"": (None, 1),
    b"vtkZLibDataCompressor": (zlib.decompress, 1032),
    b"vtkLZMADataCompressor": (lzma.decompress, 7200),
    b"vtkLZ4DataCompressor": (None, 255),  # only VTK itself can
}


# bytes of an array that are looked at, and of points for each that they are packed in: they are
# in 10 to 30 where they stand in a lattice
LARGE = 16 << 20
MOST_ALIKE = 100
# cells for each point: grains have no more contacts on average
MOST_CELLS = 32
MOST_COMPONENTS = 64


class _Array(NamedTuple):
    """Where an array is, and how large."""

    values: int
    """How many there are."""
    type: str
    place: int
    """Of its text, or of the sizes before its bytes."""
    sizes: list[int] | None
    """In bytes, of all or of each packed block; None for text."""
    is_raw: bool


def check_xml(data: bytes) -> int:
    """Walk through a VTK XML file; FlawError if something does not fit. The bytes it fills."""
    walk = _Walk(data)
    walk.through()
    return walk.bytes


class _Walk:
    """The pieces of a file, their sections and arrays, in their order."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.head = data.partition(b"<AppendedData")[0]
        root = ROOT.search(self.head)
        words = _attributes(b"" if root is None else root[1])
        self.packing = words.get(b"compressor", b"")
        # numbers of the file, and those of sizes
        self.order = ">" if words.get(b"byte_order") == b"BigEndian" else "<"
        self.size = "u8" if words.get(b"header_type") == b"UInt64" else "u4"
        appended = data[len(self.head) : len(self.head) + 200].partition(b">")[0]
        self.appended_is_raw = b"raw" in appended
        self.appended = data.find(b"_", len(self.head) + len(appended)) + 1
        if self.packing not in UNPACK:
            raise FlawError(f"there is no compressor {_text(self.packing)!r}")
        self.unpack, growth = UNPACK[self.packing]
        # a value takes a byte at least
        self.most = len(data) * growth
        # of all arrays, unpacked
        self.bytes = 0
        self.section = b""

    def through(self) -> None:
        """Walk to the end."""
        piece: dict[bytes, int] = {}
        rows: int | None = None
        cells: dict[bytes, _Array] = {}
        is_of_cells = False
        for tag in TAG.finditer(self.head):
            words = _attributes(tag[2])
            self._check_extent(words)
            if tag[1] == b"Piece":
                piece = self._counts(words)
                _check_cell_count(piece)
            elif tag[1] == b"DataArray":
                name = words.get(b"Name", b"").lower() if is_of_cells else b""
                known = None if name not in (b"", b"offsets", b"types") else rows
                array = self._array(tag, words, known)
                if name:
                    cells[name] = array
                if {b"connectivity", b"offsets"} <= set(cells):
                    self._check_cells(cells.pop(b"offsets"), cells[b"connectivity"], rows or 0)
            else:
                self.section = tag[1]
                cells, is_of_cells = {}, tag[1] in CELLS
                rows = _rows(tag[1], piece)

    def _check_extent(self, words: dict[bytes, bytes]) -> None:
        for name in (b"WholeExtent", b"Extent"):
            for word in words.get(name, b"").split():
                self._count(name, word.removeprefix(b"-"))

    def _counts(self, words: dict[bytes, bytes]) -> dict[bytes, int]:
        """NumberOf... of a piece, by the name of what is counted."""
        return {
            name.removeprefix(b"NumberOf"): self._count(name, word)
            for name, word in words.items()
            if name.startswith(b"NumberOf")
        }

    def _count(self, name: bytes, word: bytes) -> int:
        if not re.fullmatch(rb"[0-9]{1,15}", word) or int(word) > self.most:
            raise FlawError(f"{_text(name)} cannot be {_text(word)!r}")
        return int(word)

    def _array(self, tag: re.Match[bytes], words: dict[bytes, bytes], rows: int | None) -> _Array:
        """An array, if it has its rows; None: how many is not known here."""
        name = _text(words.get(b"Name", b"an array"))
        counts = self._counts(words)
        rows = counts.get(b"Tuples") if rows is None else rows
        expected = (rows or 0) * max(counts.get(b"Components", 1), 1)
        type = TYPES.get(words.get(b"type", b""))
        if type is None:
            # text, in the FieldData of other programs
            if (rows is not None and expected > self.most) or words.get(b"type") != b"String":
                raise FlawError(f"{name}: there is no type {_text(words.get(b'type', b''))!r}")
            return _Array(0, "u1", 0, None, False)
        array = self._found(tag, words, type, expected == 0)
        if array.values < expected:
            raise FlawError(f"{name} has {array.values} of {expected} values")
        size = array.values * int(type[1])
        self.bytes += size
        if self.packing and size > LARGE:
            components = counts.get(b"Components", 1)
            self._check_packed(name, array, None if rows is None else expected, components)
        return array

    def _check_packed(
        self, name: str, array: _Array, expected: int | None, components: int
    ) -> None:
        """
        What kilobytes can be unpacked to must belong to the points.

        An array may be one value over and over, of which a thousand bytes take one; points differ.
        """
        own = expected is not None and self.section != b"FieldData"
        if (not own and name.lower() != "connectivity") or components > MOST_COMPONENTS:
            raise FlawError(f"{name} has {array.values} values, which no points have")
        if expected is not None and array.values > expected:
            raise FlawError(f"{name} has {array.values} values instead of {expected}")
        packed = sum((array.sizes or [])[3:])
        if self.section == b"Points" and array.values * int(array.type[1]) > MOST_ALIKE * packed:
            raise FlawError(f"{array.values // 3} points in {packed} bytes cannot differ")

    def _found(
        self, tag: re.Match[bytes], words: dict[bytes, bytes], type: str, is_empty: bool
    ) -> _Array:
        """The array as it is stored."""
        form = words.get(b"format")
        if form == b"ascii":
            return _Array(count_words(self._content(tag.end())), type, tag.end(), None, False)
        if form == b"binary":
            place, is_raw = tag.end(), False
        else:
            # to VTK any other word means appended, too
            place = self.appended + self._count(b"offset", words.get(b"offset", b""))
            is_raw = self.appended_is_raw
        try:
            sizes = self._sizes(place, is_raw)
        except FlawError:
            if is_empty:
                return _Array(0, type, place, [], is_raw)
            raise
        length = sum(sizes[:1]) if not self.packing else _unpacked(sizes)
        if length > self.most:
            raise FlawError(f"{_text(words.get(b'Name', b''))} cannot have {length} bytes")
        return _Array(length // int(type[1]), type, place, sizes, is_raw)

    def _content(self, place: int) -> bytes:
        """The text of an array; children hold numbers too."""
        end = self.head.find(b"</DataArray", place)
        if end < 0 or self.head.find(b"<DataArray", place, end) >= 0:
            raise FlawError("an array has no end")
        first, *others = self.head[place:end].split(b"<InformationKey")
        return first + b"".join(part.partition(b"</InformationKey>")[2] for part in others)

    def _sizes(self, place: int, is_raw: bool) -> list[int]:
        """The sizes before an array; its bytes, too, are there."""
        width = int(self.size[1])
        if not self.packing:
            sizes = np.frombuffer(self._bytes(place, width, is_raw), self.order + self.size)
            self._bytes(place, width + min(int(sizes[0]), len(self.data)), is_raw, decode=False)
            return [int(sizes[0])]
        first = self._bytes(place, 3 * width, is_raw)
        count = int(np.frombuffer(first, self.order + self.size)[0])
        if count * width > len(self.data):
            raise FlawError(f"an array cannot have {count} blocks")
        head = self._bytes(place, (3 + count) * width, is_raw)
        sizes = np.frombuffer(head, self.order + self.size)
        total = sum(int(size) for size in sizes[3:])
        self._bytes(self._behind_sizes(place, count, is_raw), total, is_raw, decode=False)
        return [int(size) for size in sizes]

    def _behind_sizes(self, place: int, count: int, is_raw: bool) -> int:
        length = (3 + count) * int(self.size[1])
        return place + length if is_raw else self._behind_blanks(place) + _digits(length)

    def _bytes(self, place: int, length: int, is_raw: bool, decode: bool = True) -> bytes:
        """So many bytes at a place; nothing if only to see whether they are there."""
        start = place if is_raw else self._behind_blanks(place)
        stop = start + (length if is_raw else _digits(length))
        if stop > len(self.data) or (not is_raw and self.data.find(b"<", start, stop) >= 0):
            raise FlawError("the bytes of an array end too early")
        if not decode:
            return b""
        if is_raw:
            return self.data[start:stop]
        try:
            return base64.b64decode(self.data[start:stop], validate=True)[:length].ljust(length)
        except binascii.Error:
            raise FlawError("an array is not as base64 writes it") from None

    def _behind_blanks(self, place: int) -> int:
        blanks = BLANKS.match(self.data, place)
        return place if blanks is None else blanks.end()

    def _check_cells(self, offsets: _Array, connectivity: _Array, count: int) -> None:
        """Offsets rise to no more than the number of points that cells name."""
        if self.packing and self.unpack is None:
            return
        ends = self._whole_numbers(offsets)[:count]
        if connectivity.values > ends.max(initial=0) + LARGE:
            raise FlawError(f"connectivity has {connectivity.values} values for {count} cells")
        rises = np.all(np.diff(ends, prepend=0) >= 0)
        if not rises or ends.max(initial=0) > connectivity.values:
            raise FlawError("the offsets of the cells are wrong")

    def _whole_numbers(self, array: _Array) -> IntArray:
        if array.sizes is None:
            try:
                words = self._content(array.place).split()
                return np.fromiter(map(int, words), np.int64, len(words))
            except (ValueError, OverflowError):
                raise FlawError("expected whole numbers for the offsets of cells") from None
        data = self._unpacked_bytes(array)
        length = len(data) - len(data) % int(array.type[1])
        with np.errstate(invalid="ignore"):
            return np.frombuffer(data[:length], self.order + array.type).astype(np.int64)

    def _unpacked_bytes(self, array: _Array) -> bytes:
        assert array.sizes is not None
        width = int(self.size[1])
        if self.unpack is None:
            return self._bytes(array.place, width + sum(array.sizes), array.is_raw)[width:]
        blocks, place = [], self._behind_sizes(array.place, len(array.sizes) - 3, array.is_raw)
        packed = self._bytes(place, sum(array.sizes[3:]), array.is_raw)
        for size in array.sizes[3:]:
            try:
                blocks.append(self.unpack(packed[:size]))
            except (zlib.error, lzma.LZMAError) as error:
                raise FlawError(f"an array cannot be decompressed: {error}") from None
            packed = packed[size:]
        return b"".join(blocks)


def _attributes(text: bytes) -> dict[bytes, bytes]:
    return {name: (double or single).strip() for name, double, single in ATTRIBUTE.findall(text)}


def _rows(section: bytes, piece: dict[bytes, int]) -> int | None:
    """How many rows the arrays of a section have; None if that is not said."""
    if section in (b"PointData", b"Points"):
        return piece.get(b"Points")
    if section == b"CellData":
        return sum(count for name, count in piece.items() if name != b"Points")
    return piece.get(section)


def _check_cell_count(piece: dict[bytes, int]) -> None:
    points = piece.get(b"Points", 0)
    for name, count in piece.items():
        if count > MOST_CELLS * points + LARGE:
            raise FlawError(f"NumberOf{_text(name)} cannot be {count} with {points} points")


def _unpacked(sizes: list[int]) -> int:
    """Bytes of an array in blocks, of which the last may be smaller."""
    count, full, last = sizes[:3]
    return count * full if last == 0 or count == 0 else (count - 1) * full + last


def _digits(length: int) -> int:
    """Letters of so many bytes in base64."""
    return 4 * ((length + 2) // 3)


def _text(word: bytes) -> str:
    return word[:40].decode("latin1")
