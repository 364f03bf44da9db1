"""The arrays of VTK's XML files: text, base64, or bytes behind all elements; packed or not."""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.io.parse.vtk_data import FlawError, numbers

TYPES = {
    "Int8": "i1",
    "UInt8": "u1",
    "Int16": "i2",
    "UInt16": "u2",
    "Int32": "i4",
    "UInt32": "u4",
    "Int64": "i8",
    "UInt64": "u8",
    "Float32": "f4",
    "Float64": "f8",
    "String": "u1",  # letters, a zero behind each text
}
# what each compressor makes of one byte at most
GROWTH = {
    "": 1,
    "vtkZLibDataCompressor": 1032,
    "vtkLZMADataCompressor": 7200,
    "vtkLZ4DataCompressor": 255,
}
BLANKS = re.compile(rb"\s*")

# bytes of an array that are looked at, and of points for each that they are packed in: they are
# in 10 to 30 where they stand in a lattice
LARGE = 16 << 20
MOST_ALIKE = 100
MOST_COMPONENTS = 64


class StoredArray(NamedTuple):
    """Where an array is, and how large."""

    name: str
    type: str
    components: int
    length: int
    """How many values there are."""
    is_text: bool
    content: bytes
    """Where its bytes are found, or its text."""
    place: int
    """Of the sizes before its bytes; -1: it is a text."""
    sizes: list[int]
    """In bytes, of all or of each packed block."""
    is_raw: bool

    @property
    def bytes(self) -> int:
        """What all values fill."""
        return self.length * int(self.type[1])


def elements_of(data: bytes) -> ElementTree.Element:
    """
    The elements before the appended bytes.

    Raises
    ------
    FlawError
        If they are no XML, not all there, or hold definitions (which may stand for gigabytes).
    """
    head, *behind = data.split(b"<AppendedData", 1)
    if b"<!DOCTYPE" in head or b"<!ENTITY" in head:
        raise FlawError("definitions (DOCTYPE, ENTITY) do not belong into a VTK file")
    parser: Any = ElementTree.XMLPullParser(("start", "end"))
    try:
        parser.feed(head)
        if not behind:
            parser.close()
        root: ElementTree.Element | None = None
        depth = 0
        for event, element in parser.read_events():
            root = element if root is None else root
            depth += 1 if event == "start" else -1
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise FlawError(f"no sound XML: {error}") from None
    # only the root goes on behind the appended bytes
    if root is None or depth != len(behind):
        raise FlawError("the elements of the file have no end")
    return root


class XmlFile:
    """What all arrays of a file share: byte order, compressor, appended bytes."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.root = elements_of(data)
        words = self.root.attrib
        self.packing = words.get("compressor", "")
        self.order = ">" if words.get("byte_order") == "BigEndian" else "<"
        self.size = "u8" if words.get("header_type") == "UInt64" else "u4"
        start = data.find(b"<AppendedData")
        start = len(data) if start < 0 else start
        tag = data[start : start + 200].partition(b">")[0]
        self.appended_is_raw = b"raw" in tag
        self.appended = data.find(b"_", start + len(tag)) + 1
        if self.packing not in GROWTH:
            raise FlawError(f"there is no compressor {self.packing[:40]!r}")
        # a value takes a byte at least
        self.most = len(data) * GROWTH[self.packing]

    def field(self) -> Iterator[ElementTree.Element]:
        """Arrays of the file as a whole."""
        for field in self.root.iter("FieldData"):
            yield from arrays_in(field)

    def count(self, words: dict[str, str], name: str, default: str) -> int:
        """A whole number among the attributes of an element."""
        word = words.get(name, default).strip()
        if not re.fullmatch("[0-9]{1,15}", word) or int(word) > self.most:
            raise FlawError(f"{name} cannot be {word[:40]!r}")
        return int(word)

    def array(self, element: ElementTree.Element, rows: int | None, section: str) -> StoredArray:
        """An array that has its rows; None: how many is not known here."""
        words = element.attrib
        name = words.get("Name", "")
        stored = TYPES.get(words.get("type", ""))
        if stored is None:
            raise FlawError(f"{name or section}: there is no type {words.get('type', '')[:40]!r}")
        components = max(self.count(words, "NumberOfComponents", "1"), 1)
        if rows is None and "NumberOfTuples" in words:
            rows = self.count(words, "NumberOfTuples", "")
        is_text = words["type"] == "String"
        # of a text nobody knows the number of letters
        expected = 0 if is_text else (rows or 0) * components
        array = self._found(element, stored, name, components, is_text, expected == 0)
        if array.length < expected:
            raise FlawError(f"{name or section} has {array.length} of {expected} values")
        if self.packing and array.bytes > LARGE:
            self._check_packed(array, None if rows is None else expected, section)
        return array

    def _check_packed(self, array: StoredArray, expected: int | None, section: str) -> None:
        """
        What kilobytes can be unpacked to must belong to the points.

        An array may be one value over and over, of which a thousand bytes take one; points differ.
        """
        own = expected is not None and section != "FieldData" and not array.is_text
        is_list = array.name.lower() == "connectivity"
        if (not own and not is_list) or array.components > MOST_COMPONENTS:
            raise FlawError(f"{array.name} has {array.length} values, which no points have")
        if expected is not None and array.length > expected:
            raise FlawError(f"{array.name} has {array.length} values instead of {expected}")
        packed = sum(array.sizes[3:])
        if section == "Points" and array.bytes > MOST_ALIKE * packed:
            raise FlawError(f"{array.length // 3} points in {packed} bytes cannot differ")

    def _found(
        self,
        element: ElementTree.Element,
        stored: str,
        name: str,
        components: int,
        is_text: bool,
        is_empty: bool,
    ) -> StoredArray:
        """The array as it is stored."""
        form = element.get("format")
        content, place, is_raw = _text(element), 0, False
        if form == "ascii":
            count = _count_words(content)
            return StoredArray(name, stored, components, count, is_text, content, -1, [], False)
        if form != "binary":
            # to VTK any other word means appended, too
            offset = self.count(dict(element.attrib), "offset", "")
            content, place, is_raw = self.data, self.appended + offset, self.appended_is_raw
        try:
            sizes = self._sizes(content, place, is_raw)
        except FlawError:
            if not is_empty:
                raise
            sizes = [0] if not self.packing else [0, 0, 0]
        length = sizes[0] if not self.packing else _unpacked(sizes)
        if length > self.most:
            raise FlawError(f"{name} cannot have {length} bytes")
        count = length // int(stored[1])
        return StoredArray(name, stored, components, count, is_text, content, place, sizes, is_raw)

    def _sizes(self, content: bytes, place: int, is_raw: bool) -> list[int]:
        """The sizes before an array; its bytes, too, are there."""
        width = int(self.size[1])
        kind = self.order + self.size
        if not self.packing:
            size = int(np.frombuffer(_bytes_at(content, place, width, is_raw), kind)[0])
            _check_bytes_at(content, place, width + min(size, len(self.data)), is_raw)
            return [size]
        count = int(np.frombuffer(_bytes_at(content, place, 3 * width, is_raw), kind)[0])
        if count * width > len(self.data):
            raise FlawError(f"an array cannot have {count} blocks")
        head = _bytes_at(content, place, (3 + count) * width, is_raw)
        sizes = [int(size) for size in np.frombuffer(head, kind)]
        behind = _behind_sizes(content, place, len(head), is_raw)
        _check_bytes_at(content, behind, sum(sizes[3:]), is_raw)
        return sizes

    def values(self, array: StoredArray) -> Any:
        """The values of an array, as many rows as it has; texts as an array of objects."""
        if array.place < 0:
            try:
                flat = numbers(array.content, array.length, array.type)
            except FlawError as flaw:
                raise FlawError(f"{array.name}: {flaw}") from None
        else:
            data = self._unpacked(array)[: array.length * int(array.type[1])]
            flat = np.frombuffer(data, self.order + array.type).astype(array.type)
        if array.is_text:
            return _texts(flat)
        if array.components == 1:
            return flat
        rows = len(flat) // array.components
        return flat[: rows * array.components].reshape(rows, array.components)

    def _unpacked(self, array: StoredArray) -> bytes:
        width = int(self.size[1])
        if not any(array.sizes):
            return b""
        if not self.packing:
            length = width + array.sizes[0]
            return _bytes_at(array.content, array.place, length, array.is_raw)[width:]
        count, full, last = array.sizes[:3]
        place = _behind_sizes(array.content, array.place, (3 + count) * width, array.is_raw)
        packed = _bytes_at(array.content, place, sum(array.sizes[3:]), array.is_raw)
        blocks, start = [], 0
        for k, size in enumerate(array.sizes[3:]):
            length = last if k == count - 1 and last else full
            blocks.append(_unpack(self.packing, packed[start : start + size], length))
            start += size
        return b"".join(blocks)


def arrays_in(section: ElementTree.Element) -> list[ElementTree.Element]:
    return [one for one in section if one.tag in ("DataArray", "Array")]


def _text(element: ElementTree.Element) -> bytes:
    """The text of an array; children (InformationKey) hold numbers too, which are not its own."""
    parts = [element.text or "", *(child.tail or "" for child in element)]
    return " ".join(parts).encode("utf-8") if len(parts) > 1 else parts[0].encode("utf-8")


def _count_words(text: bytes) -> int:
    letters = np.frombuffer(text, np.uint8)
    filled = (letters != 32) & ((letters < 9) | (letters > 13))
    return int(np.count_nonzero(filled[1:] & ~filled[:-1])) + bool(filled[:1].any())


def _unpacked(sizes: list[int]) -> int:
    """Bytes of an array in blocks, of which the last may be smaller."""
    count, full, last = sizes[:3]
    return count * full if last == 0 or count == 0 else (count - 1) * full + last


def _unpack(packing: str, block: bytes, length: int) -> bytes:
    """One block, which must have so many bytes."""
    try:
        if packing == "vtkZLibDataCompressor":
            data = zlib.decompressobj().decompress(block, length + 1)
        elif packing == "vtkLZMADataCompressor":
            data = lzma.LZMADecompressor().decompress(block, length + 1)
        else:
            import lz4.block

            data = lz4.block.decompress(block, uncompressed_size=length)
    except (zlib.error, lzma.LZMAError, EOFError, ValueError, RuntimeError) as error:
        raise FlawError(f"an array cannot be decompressed: {error}") from None
    if len(data) != length:
        raise FlawError(f"an array cannot be decompressed: {len(data)} of {length} bytes")
    return data


def _bytes_at(content: bytes, place: int, length: int, is_raw: bool) -> bytes:
    """So many bytes at a place."""
    start, stop = _check_bytes_at(content, place, length, is_raw)
    if is_raw:
        return content[start:stop]
    try:
        return base64.b64decode(content[start:stop], validate=True)[:length].ljust(length)
    except binascii.Error:
        raise FlawError("an array is not as base64 writes it") from None


def _check_bytes_at(content: bytes, place: int, length: int, is_raw: bool) -> tuple[int, int]:
    """Where so many bytes stand; FlawError if they are not there."""
    start = place if is_raw else _behind_blanks(content, place)
    stop = start + (length if is_raw else _digits(length))
    if stop > len(content) or (not is_raw and content.find(b"<", start, stop) >= 0):
        raise FlawError("the bytes of an array end too early")
    return start, stop


def _behind_sizes(content: bytes, place: int, length: int, is_raw: bool) -> int:
    return place + length if is_raw else _behind_blanks(content, place) + _digits(length)


def _behind_blanks(content: bytes, place: int) -> int:
    blanks = BLANKS.match(content, place)
    return place if blanks is None else blanks.end()


def _digits(length: int) -> int:
    """Letters of so many bytes in base64."""
    return 4 * ((length + 2) // 3)


def _texts(letters: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Texts that end with a zero each."""
    texts = letters.astype(np.uint8).tobytes().decode("utf-8", "replace").split("\0")[:-1]
    return np.array(texts, dtype=str) if texts else np.zeros(0, "U1")
