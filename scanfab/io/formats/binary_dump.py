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
from scanfab.io.columns import grain_table, has_radius
from scanfab.io.files import check_memory, first_bytes, plain
from scanfab.io.formats.lammps_box import box_cell
from scanfab.io.formats.text_dump import numbered_columns
from scanfab.io.parse.growing import warn_incomplete
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot

MAGIC = (b"DUMPCUSTOM", b"DUMPATOM")
# more stand in damaged files only
MOST_COLUMNS = 1000


class _Header(NamedTuple):
    step: int
    time: float | None
    rows: int
    periodic: tuple[bool, bool, bool]
    bounds: FloatArray
    """Shape (3, 2), or (3, 3) with the tilt."""
    names: list[str]
    """Of the columns; their numbers from 1 in the old layout."""
    blocks: int
    """Number of blocks of rows, of which each process wrote one."""
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
    names = names_of_binary(first_bytes(path, 1 << 16)) or ["1"]
    return "grains" if names[0] == "1" or has_radius(names) else "points"


def index_binary(path: Path) -> list[Snapshot]:
    """
    The snapshots of a file, in the order of their steps.

    An incomplete last snapshot (the program is still writing) is left out with a warning if there
    is a complete one before it.

    Raises
    ------
    ReadError
        If there is no complete snapshot.
    """
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
                text = f"{path}: snapshot {len(found) + 1} is damaged or incomplete: {error}"
                if not found:
                    raise ReadError(text) from None
                warn_incomplete(f"{text}; it is left out")
                break
            found.append(Snapshot(path, header.step, header.time, start, stream.tell()))
            start = stream.tell()
    return sorted(found, key=lambda one: one.step or 0)


def read_binary_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    The grains of a snapshot; users number the columns of the old layout, which has no names.

    Raises
    ------
    ReadError
        If the file is not as it was when it was indexed, or users have to name the columns.
    """
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
    if "1" in columns:
        options = numbered_columns(path, "binary dump", len(columns), options)
    cell = box_cell(f"{path}", header.bounds, header.periodic)
    return grain_table(path, columns, cell, options, f", step {snapshot.step}")


def _header(stream: IO[bytes]) -> _Header:
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
    names = [f"{place + 1}" for place in range(width)]
    if magic:
        _text(stream, order)  # units
        if _take(stream, "b", 0, 1)[0]:
            (time,) = _take(stream, f"{order}d")
        names = _text(stream, order).split()
    if len(names) != width:
        raise ValueError(f"{len(names)} names for {width} columns")
    (blocks,) = _take(stream, f"{order}i", 1)
    x, y, z = (bool(both) for both in (faces == 0).all(axis=1))
    return _Header(step, time, count, (x, y, z), bounds, names, blocks, order)


def _take(stream: IO[bytes], kinds: str, low: float = -inf, high: float = inf) -> tuple[Any, ...]:
    """The next numbers, of the kinds that :mod:`struct` knows, all of them within two bounds."""
    data = stream.read(struct.calcsize(kinds))
    if len(data) < struct.calcsize(kinds):
        raise ValueError("the file ends too early")
    found = struct.unpack(kinds, data)
    for one in found:
        if not low <= one <= high:
            raise ValueError(f"expected a number from {low} to {high}, found {one}")
    return found


def _text(stream: IO[bytes], order: str) -> str:
    """The next text, which stands behind its length."""
    (length,) = _take(stream, f"{order}i", 0)
    return stream.read(length).decode("utf-8", "replace")


def _blocks(stream: IO[bytes], header: _Header, size: int) -> list[tuple[int, int]]:
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
