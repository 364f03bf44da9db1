"""
Whether a legacy ASCII VTK file is complete.

VTK fills what is missing with whatever memory holds, and says nothing. What a cut file lacks is in
its last section: that one is counted.
"""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["missing_values"]

SECTION = re.compile(
    rb"^[ \t]*(POINTS|VERTICES|LINES|POLYGONS|TRIANGLE_STRIPS|CELLS|CELL_TYPES|SCALARS|VECTORS|"
    rb"NORMALS|TENSORS|FIELD|POINT_DATA|CELL_DATA|METADATA|LOOKUP_TABLE)\b(.*)$",
    re.MULTILINE,
)
ARRAY = re.compile(rb"^[ \t]*\S+[ \t]+(\d+)[ \t]+(\d+)[ \t]+[a-zA-Z_]\w*[ \t\r]*$", re.MULTILINE)
COMPONENTS = {b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9}


def missing_values(file: Path) -> str | None:
    """What the last section lacks, for a message; None if it is complete."""
    data = file.read_bytes()
    count, key, words, body = 0, b"", [b""], b""
    for match in SECTION.finditer(data):
        if match[1] == b"LOOKUP_TABLE":
            # behind SCALARS, whose values follow it
            body = data[match.end() :]
            continue
        key, words, body = match[1], match[2].split(), data[match.end() :]
        if key in (b"POINT_DATA", b"CELL_DATA"):
            count = _whole(words[-1:])
    if key == b"FIELD":
        return _missing_arrays(_whole(words[-1:]), body)
    expected = _expected(key, words, body, count)
    found = len(body.split()) if expected else 0
    return f"{key.decode()} has {found} of {expected} values" if found < expected else None


def _expected(key: bytes, words: list[bytes], body: bytes, count: int) -> int:
    """How many words a section has behind its first line."""
    if key == b"POINTS":
        return 3 * _whole(words[:1])
    if key == b"SCALARS":
        return count * max(_whole(words[2:3]), 1)
    if key in COMPONENTS:
        return count * COMPONENTS[key]
    if key in (b"POINT_DATA", b"CELL_DATA", b"METADATA"):
        return 0
    # VERTICES n size; since version 5.1 with the words OFFSETS type ... CONNECTIVITY type ...
    numbers = _whole(words[:1]), _whole(words[-1:])
    return sum(numbers) + 4 if body.lstrip().startswith(b"OFFSETS") else numbers[1]


def _missing_arrays(arrays: int, body: bytes) -> str | None:
    """The last array of a FIELD, or how many have not even begun."""
    headers = list(ARRAY.finditer(body))
    if len(headers) < arrays:
        return f"FIELD has {len(headers)} of {arrays} arrays"
    if not headers:
        return None
    expected = int(headers[-1][1]) * int(headers[-1][2])
    found = len(body[headers[-1].end() :].split())
    return f"FIELD has {found} of {expected} values" if found < expected else None


def _whole(words: list[bytes]) -> int:
    return int(words[0]) if words and words[0].isdigit() else 0
