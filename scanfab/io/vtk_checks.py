"""
What VTK does not notice in a damaged XML file, looked for before VTK reads it.

VTK drops the values of an array that are more than its piece counts, passes over letters that are
no base64, and takes a word that should be a number for 0.
"""

from __future__ import annotations

import base64
import binascii
import re
import xml.etree.ElementTree as ElementTree

BASE64 = re.compile(r"[A-Za-z0-9+/=]*")


def damaged(reason: str) -> ValueError:
    """The error for a file that does not hold what its headers say."""
    return ValueError(f"the file is damaged or incomplete: {reason}")


def check_xml(data: bytes) -> None:
    """
    ValueError if an array of an XML file has fewer or more values than its piece counts.

    Only the elements before the appended bytes are parsed. For an array in base64 or in appended
    bytes, the sizes that stand before its values are read.
    """
    end = data.find(b"<AppendedData")
    try:
        root = ElementTree.fromstring(data if end < 0 else data[:end] + b"</VTKFile>")
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise damaged(f"no sound XML: {error}") from None
    sections = [(one, dict[str, int]()) for one in root.iter("FieldData")]
    for piece in root.iter("Piece"):
        named = [(name, word) for name, word in piece.items() if name.startswith("NumberOf")]
        counts = {name.removeprefix("NumberOf"): _whole(word) for name, word in named}
        for name in {name for name, count in counts.items() if count} - {one.tag for one in piece}:
            raise damaged(f"it counts {counts[name]} {name}, but there are none")
        sections += [(section, counts) for section in piece]
    for section, counts in sections:
        for array in section.iter("DataArray"):
            rows = _rows(section.tag, array, counts)
            if rows is None or array.get("type") == "String":
                continue
            expected = rows * (_whole(array.get("NumberOfComponents", "1")) or 1)
            stored = _stored(data, array, root, end)
            name = array.get("Name", section.tag)
            if section.tag == "CellData" and stored > expected:
                # VTK would give the values to other lines than theirs
                raise ValueError(
                    f"{name} has {stored} values for {expected} contacts: YADE's VTKRecorder loses "
                    f"those that cross a periodic cell: use export.VTKExporter for contacts, or "
                    f'`contacts="geometric"`'
                )
            if stored != expected:
                raise damaged(f"{name} has {stored} of {expected} values")


def _rows(section: str, array: ElementTree.Element, counts: dict[str, int]) -> int | None:
    """How many rows an array must have; None if the file does not say."""
    if section == "FieldData":
        tuples = array.get("NumberOfTuples")
        return None if tuples is None else _whole(tuples)
    if section in ("PointData", "Points"):
        return counts.get("Points", 0)
    if section == "CellData":
        return sum(count for name, count in counts.items() if name != "Points")
    # of the arrays that describe cells, one has a row for each point of each cell
    is_counted = array.get("Name", "").lower() in ("offsets", "types")
    return counts.get(section, 0) if is_counted else None


def _stored(data: bytes, array: ElementTree.Element, root: ElementTree.Element, end: int) -> int:
    """How many values an array has: its words, or as its sizes say."""
    text = " ".join([array.text or "", *(child.tail or "" for child in array)]).strip()
    if array.get("format") == "ascii":
        return len(text.split())
    size = re.fullmatch(r"(?:U?Int|Float)(8|16|32|64)", array.get("type", ""))
    if size is None:
        raise damaged(f"there is no type {array.get('type', '')[:40]!r}")
    width = 8 if root.get("header_type") == "UInt64" else 4
    if array.get("format") != "binary":
        start = data.find(b"_", end) + 1 + _whole(array.get("offset", ""))
        head = data[start : start + 4 * width] if end >= 0 else b""
    else:
        head = text[: 4 * width].encode()
    if array.get("format") == "binary" or b"raw" not in data[end : end + 100]:
        digits = head.split(b"=")[0]
        try:
            # VTK passes over all letters that are no base64, and so shifts the values behind them
            if not BASE64.fullmatch(text):
                raise binascii.Error
            head = base64.b64decode(digits + b"=" * (-len(digits) % 4), validate=True)
        except binascii.Error:
            raise damaged("an array is not as base64 writes it") from None
    order = "big" if root.get("byte_order") == "BigEndian" else "little"
    sizes = [int.from_bytes(head[k : k + width], order) for k in range(0, 3 * width, width)]  # type: ignore[arg-type]
    blocks, full, last = sizes
    packed = blocks * full - (full - last if blocks and last else 0)
    length = packed if root.get("compressor") else sizes[0]
    return length // (int(size[1]) // 8)


def _whole(word: str) -> int:
    if not re.fullmatch(r"\s*\d{1,15}\s*", word):
        raise damaged(f"expected a whole number, found {word[:40]!r}")
    return int(word)
