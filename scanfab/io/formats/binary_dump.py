"""
The binary dumps of LAMMPS, new and old, and of LIGGGHTS, which has LAMMPS' old layout.

The new layout names its columns, the old one does not.
"""

from __future__ import annotations

import struct
from io import BytesIO
from math import inf
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.lengths import MOST
from scanfab.base.typing import FloatArray
from scanfab.io.columns import has_radius
from scanfab.io.files import check_memory, first_bytes, plain
from scanfab.io.formats.dump import Dump, box_cell, numbers_as_names
from scanfab.io.formats.shared import HEADER_BYTES
from scanfab.io.parse.growing import leave_out_last
from scanfab.io.reader import FileKind, Snapshot

MAGIC = (b"DUMPCUSTOM", b"DUMPATOM")
# more stand in damaged files only
MOST_COLUMNS = 1000


class Header(NamedTuple):
    """What stands above the blocks of rows, of which each process wrote one."""

    step: int
    time: float | None
    rows: int
    periodic: tuple[bool, bool, bool]
    bounds: FloatArray
    """Shape (3, 2), or (3, 3) with the tilt."""
    names: list[str]
    """Of the columns; their numbers from 1 in the old layout."""
    blocks: int
    order: str
    """Of the bytes, as :mod:`struct` names it: < or >."""


def names_of_binary(head: bytes) -> list[str] | None:
    """The names of the columns, by a file's first bytes; their numbers if it has none; or None."""
    try:
        return _header(BytesIO(head)).names
    except ValueError:
        return None


def binary_kind(path: Path) -> FileKind:
    """Grains, unless the columns have names and none is a radius."""
    names = names_of_binary(first_bytes(path, HEADER_BYTES)) or ["1"]
    return "grains" if names[0] == "1" or has_radius(names) else "points"


def binary_snapshots(path: Path) -> list[Snapshot]:
    """The snapshots of a file, in the order of their steps; an incomplete last one is left out."""
    found: list[Snapshot] = []
    start = 0
    with open(plain(path), "rb") as stream:
        size = stream.seek(0, 2)
        while start < size or not found:
            stream.seek(start)
            try:
                header = _header(stream)
                _blocks(stream, header, size)
            except ValueError as error:
                leave_out_last(path, len(found), f"expected a whole binary snapshot: {error}")
                break
            found.append(Snapshot(path, header.step, header.time, start, stream.tell()))
            start = stream.tell()
    return sorted(found, key=lambda one: one.step or 0)


def read_binary_dump(snapshot: Snapshot) -> Dump:
    """One snapshot; ReadError if the file is not as it was when its snapshots were found."""
    path = snapshot.path
    with open(plain(path), "rb") as stream:
        size = stream.seek(0, 2)
        check_memory(path, 2.0 * ((snapshot.stop or size) - snapshot.start))
        stream.seek(snapshot.start)
        try:
            header = _header(stream)
            blocks = _blocks(stream, header, size)
        except ValueError as error:
            raise ReadError(f"{path}: expected a binary dump: {error}") from None
        parts = []
        for place, length in blocks:
            stream.seek(place)
            parts.append(np.fromfile(stream, f"{header.order}f8", length))
    values = np.concatenate(parts).astype(np.float64).reshape(-1, len(header.names))
    columns = {name: values[:, header.names.index(name)] for name in header.names}
    return Dump(header.names, columns, box_cell(path, header.bounds, header.periodic))


def _header(stream: IO[bytes]) -> Header:
    """The header that begins where the stream is; ValueError says why there is none."""
    start, order, time = stream.tell(), "<", None
    first = stream.read(8 + len(MAGIC[0]))
    magic = next((one for one in MAGIC if first[8:].startswith(one)), b"")
    stream.seek(start)
    if magic:
        # minus the length of the magic word, that word, the number 1, the revision of the layout
        stream.seek(start + 8 + len(magic))
        order = "<" if stream.read(4) == b"\1\0\0\0" else ">"
        _take(stream, f"{order}i", 1, 2)
    step, count = _take(stream, f"{order}2q", 0)
    (is_tilted,) = _take(stream, f"{order}i", 0, 1)
    # of the lower and the upper face of each axis; 0 is periodic
    faces = np.reshape(_take(stream, f"{order}6i", 0, 3), (3, 2))
    bounds = np.reshape(_take(stream, f"{order}6d", -MOST, MOST), (3, 2))
    if np.any(bounds[:, 0] > bounds[:, 1]):
        raise ValueError("a lower bound of the box is above the upper one")
    if is_tilted:
        bounds = np.column_stack([bounds, _take(stream, f"{order}3d", -MOST, MOST)])
    (width,) = _take(stream, f"{order}i", 1, MOST_COLUMNS)
    names = numbers_as_names(width)
    if magic:
        _text(stream, order)  # units
        if _take(stream, "b", 0, 1)[0]:
            (time,) = _take(stream, f"{order}d")
        names = _text(stream, order).split()
    if len(names) != width:
        raise ValueError(f"{len(names)} names for {width} columns")
    (blocks,) = _take(stream, f"{order}i", 1)
    x, y, z = (bool(both) for both in (faces == 0).all(axis=1))
    return Header(step, time, count, (x, y, z), bounds, names, blocks, order)


def _take(stream: IO[bytes], kinds: str, low: float = -inf, high: float = inf) -> tuple[Any, ...]:
    """The next numbers, of the kinds that :mod:`struct` knows, all of them within two bounds."""
    data = stream.read(struct.calcsize(kinds))
    if len(data) < struct.calcsize(kinds):
        raise ValueError("the file ends too early")
    found = struct.unpack(kinds, data)
    if not all(low <= one <= high for one in found):
        raise ValueError(f"expected numbers from {low} to {high}, found {found}")
    return found


def _text(stream: IO[bytes], order: str) -> str:
    """The next text, which stands behind its length."""
    (length,) = _take(stream, f"{order}i", 0)
    return stream.read(length).decode("utf-8", "replace")


def _blocks(stream: IO[bytes], header: Header, size: int) -> list[tuple[int, int]]:
    """First byte and number of values of each block of rows; the stream is behind them then."""
    found, width = [], len(header.names)
    for _ in range(header.blocks):
        (length,) = _take(stream, f"{header.order}i", 0)
        place = stream.tell()
        if length % width or place + 8 * length > size:
            raise ValueError(f"a block of {length} numbers, {width} a row")
        found.append((place, length))
        stream.seek(place + 8 * length)
    rows = sum(length for _, length in found) // width
    if rows != header.rows:
        raise ValueError(f"the header counts {header.rows} rows, found {rows}")
    return found
