"""
What VTK does not notice in a damaged file, looked for before VTK reads it.

VTK fills the arrays of an ASCII file that was cut off with zeros or with what memory holds. It
reserves memory for the counts of an XML file before it looks at the arrays, and drops values
beyond the count in silence.
"""

from __future__ import annotations

import base64
import binascii
import re
import xml.etree.ElementTree as ElementTree
from urllib.parse import unquote

HEAD = re.compile(rb"# vtk DataFile[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s", re.IGNORECASE)
# the header of a section, or of an array in a FIELD: NAME COMPONENTS TUPLES TYPE
SECTION = re.compile(
    rb"^(?:(POINTS|VERTICES|LINES|POLYGONS|TRIANGLE_STRIPS|CELLS|CELL_TYPES|OFFSETS|CONNECTIVITY"
    rb"|POINT_DATA|CELL_DATA|SCALARS|VECTORS|NORMALS|TENSORS|[XYZ]_COORDINATES)[ \t]+"
    rb"|\S+[ \t]+(?=\d+[ \t]+\d+[ \t]+(?!nan|inf)[a-z]))([^\n]*)\n",
    re.MULTILINE | re.IGNORECASE,
)
CELLS = (b"VERTICES", b"LINES", b"POLYGONS", b"TRIANGLE_STRIPS", b"CELLS")
VALUES = {b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9}
ARRAYS = (b"SCALARS", *VALUES)
# VTK passes over what is no letter of it, and shifts all values behind
BASE64 = re.compile(r"\s*[A-Za-z0-9+/=]*\s*")
METADATA = re.compile(rb"^METADATA", re.MULTILINE)


def is_ascii(head: bytes) -> bool:
    """Whether a legacy file is a text."""
    match = HEAD.match(head)
    return match is not None and match[1].upper() == b"ASCII"


def damaged(reason: str) -> ValueError:
    """The error for a file that does not hold what its headers say."""
    return ValueError(f"the file is damaged or incomplete: {reason}")


def check_text(data: bytes) -> set[str]:
    """
    The names of all arrays of an ASCII legacy file: VTK may give up, and drop them all in silence.

    Raises
    ------
    ValueError
        If the last section has too few values.
    """
    rows = cells = ids = points = 0
    kind, words = b"", [b""]
    last: re.Match[bytes] | None = None
    names = set()
    for last in SECTION.finditer(data):
        kind, words = (last[1] or b"").upper(), last[2].split() or [b""]
        points += kind == b"POINTS"
        if not kind or kind in ARRAYS:
            name = words[0] if kind else last[0].split()[0]
            names.add(unquote(name.decode("utf-8", "replace")))
        if kind in (b"POINT_DATA", b"CELL_DATA"):
            rows = _whole(words[0])
        elif kind in CELLS:
            cells, ids = _whole(words[0]), _whole(words[-1])
    if last is None or points > 1:
        raise damaged("expected the keywords of sections, and POINTS at most once")
    behind = METADATA.split(data[last.end() :], 1)[0].split()
    if kind == b"SCALARS":
        table = behind[:1] and behind[0].upper() == b"LOOKUP_TABLE"
        expected = rows * (_whole(words[2]) if len(words) > 2 else 1) + 2 * bool(table)
    elif not kind:
        expected = _whole(words[0]) * _whole(words[1])
    else:
        has_count = kind not in (*VALUES, b"OFFSETS", b"CONNECTIVITY")
        count = _whole(words[0]) if has_count else 0
        known = {b"POINTS": 3 * count, b"OFFSETS": cells, b"CONNECTIVITY": ids}
        known |= {name: values * rows for name, values in VALUES.items()}
        # behind the number of rows stands at least the header of an array
        known |= {b"POINT_DATA": min(rows, 1), b"CELL_DATA": min(rows, 1)}
        expected = known.get(kind, ids if kind in CELLS else count)
    if len(behind) < expected:
        header = last[0].split()[0].decode("utf-8", "replace")
        raise damaged(f"{header} has {len(behind)} of {expected} values")
    return names


def _whole(word: bytes | str) -> int:
    if not re.fullmatch(
        r"\d{1,15}", text := word if isinstance(word, str) else word.decode("latin1")
    ):
        raise damaged(f"expected a whole number, found {text[:40]!r}")
    return int(text)


def check_xml(data: bytes) -> None:
    """
    ValueError if an array of an XML file has fewer or more values than its piece counts.

    Only the elements before the appended bytes are parsed; of an array in base64 or of appended
    bytes, the sizes that stand before the bytes are read.
    """
    end = data.find(b"<AppendedData")
    try:
        root = ElementTree.fromstring(data if end < 0 else data[:end] + b"</VTKFile>")
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise damaged(f"no sound XML: {error}") from None
    places = [("FieldData", field, dict[str, int]()) for field in root.iter("FieldData")]
    for piece in root.iter("Piece"):
        counts = {
            name.removeprefix("NumberOf"): _whole(word.strip())
            for name, word in piece.items()
            if name.startswith("NumberOf")
        }
        for name in {name for name, count in counts.items() if count} - {one.tag for one in piece}:
            raise damaged(f"it counts {counts[name]} {name}, but there are none")
        places += [(section.tag, section, counts) for section in piece]
    for name, section, counts in places:
        for array in section.iter("DataArray"):
            expected = _expected(name, array, counts)
            stored = expected if expected is None else _stored(data, array, root, end)
            if expected is not None and stored is not None and stored != expected:
                raise _wrong_count(name, array.get("Name", name), stored, expected)


def _expected(section: str, array: ElementTree.Element, counts: dict[str, int]) -> int | None:
    """How many values an array must have; None if that is not said."""
    if array.get("type") == "String":
        return None
    if section == "FieldData":
        tuples = array.get("NumberOfTuples")
        rows = None if tuples is None else _whole(tuples)
    elif section in ("PointData", "Points"):
        rows = counts.get("Points", 0)
    elif section == "CellData":
        rows = sum(count for name, count in counts.items() if name != "Points")
    elif array.get("Name", "").lower() in ("offsets", "types"):
        rows = counts.get(section, 0)
    else:
        rows = None
    return None if rows is None else rows * (_whole(array.get("NumberOfComponents", "1")) or 1)


def _stored(data: bytes, array: ElementTree.Element, root: ElementTree.Element, end: int) -> int:
    """How many values an array has: its words, or as its sizes say."""
    parts = [array.text or "", *(child.tail or "" for child in array)]
    if array.get("format") == "ascii":
        return sum(len(part.split()) for part in parts)
    size = re.fullmatch(r"(?:U?Int|Float)(8|16|32|64)", array.get("type", ""))
    if size is None:
        raise damaged(f"there is no type {array.get('type', '')[:40]!r}")
    width = 8 if root.get("header_type") == "UInt64" else 4
    head = parts[0].lstrip()[: 4 * width].encode()
    if array.get("format") != "binary":
        if end < 0:
            raise damaged("there are no appended bytes")
        start = data.find(b"_", end) + 1 + _whole(array.get("offset", ""))
        head = data[start : start + 4 * width]
    try:
        if array.get("format") == "binary" or b"raw" not in data[end : end + 100]:
            digits = head.split(b"=")[0].split()[0] if head.strip(b"= \n") else b""
            if BASE64.fullmatch("".join(parts)) is None:
                raise binascii.Error
            head = base64.b64decode(digits + b"=" * (-len(digits) % 4), validate=True)
    except binascii.Error:
        raise damaged("an array is not as base64 writes it") from None
    order = "big" if root.get("byte_order") == "BigEndian" else "little"
    numbers = [int.from_bytes(head[k : k + width], order) for k in range(0, 3 * width, width)]  # type: ignore[arg-type]
    length = numbers[0]
    if root.get("compressor"):
        blocks, full, last = numbers
        length = blocks * full - (full - last if blocks and last else 0)
    return length // (int(size[1]) // 8)


def _wrong_count(section: str, name: str, stored: int, expected: int) -> ValueError:
    if section == "CellData" and stored > expected:
        # VTK would give the values to other lines than theirs
        return ValueError(
            f"{name} has {stored} values for {expected} contacts: YADE's VTKRecorder loses the "
            f"contacts that cross a periodic cell; export them with "
            f"export.VTKExporter.exportInteractions, or find them by geometry "
            f'(`contacts="geometric"`)'
        )
    return damaged(f"{name} has {stored} of {expected} values")
