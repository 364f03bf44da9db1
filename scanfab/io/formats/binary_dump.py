"""
The binary dumps of LAMMPS, new and old, and of LIGGGHTS, which has LAMMPS' old layout.

The new layout names its columns, the old one does not.
"""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from scanfab.base.arrays import MOST
from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import has_radius
from scanfab.io.files import check_memory, first_bytes, plain
from scanfab.io.formats.dump import Dump, box_cell, numbers_as_names
from scanfab.io.formats.shared import HEADER_BYTES
from scanfab.io.growing import leave_out_last
from scanfab.io.reader import Carries, FileKind, ReadOptions, Snapshot

carries: Carries = "cell"
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


def names_in(head: bytes) -> list[str] | None:
    """The names of the columns, by a file's first bytes; their numbers if it has none; or None."""
    try:
        return _header(BytesIO(head)).names
    except (ValueError, struct.error):
        return None


def fits(head: bytes) -> bool:
    """Whether a file starts with the header of a snapshot."""
    return names_in(head) is not None


def kind(path: Path) -> FileKind:
    """Grains, unless the columns have names and none is a radius."""
    names = names_in(first_bytes(path, HEADER_BYTES)) or ["1"]
    return "grains" if names[0] == "1" or has_radius(names) else "points"


def snapshots(path: Path) -> list[Snapshot]:
    """The snapshots of a file, in the order of their steps; an incomplete last one is left out."""
    found: list[Snapshot] = []
    with open(plain(path), "rb") as stream:
        size, start = stream.seek(0, 2), 0
        while start < size or not found:
            try:
                header, _, stop = _snapshot(stream, start, size)
            except (ValueError, struct.error) as error:
                leave_out_last(path, len(found), f"expected a whole binary snapshot: {error}")
                break
            found.append(Snapshot(path, header.step, header.time, start, stop))
            start = stop
    return sorted(found, key=lambda one: one.step or 0)


def read(snapshot: Snapshot, options: ReadOptions) -> Dump:
    """One snapshot; ReadError if the file is not as it was when its snapshots were found."""
    path = snapshot.path
    with open(plain(path), "rb") as stream:
        size = stream.seek(0, 2)
        check_memory(path, 2.0 * ((snapshot.stop or size) - snapshot.start))
        try:
            header, blocks, _ = _snapshot(stream, snapshot.start, size)
        except (ValueError, struct.error) as error:
            raise ReadError(f"{path}: expected a binary dump: {error}") from None
        parts = [np.fromfile(plain(path), f"{header.order}f8", *block) for block in blocks]
    values = np.concatenate(parts).astype(np.float64).reshape(-1, len(header.names))
    columns = {name: values[:, header.names.index(name)] for name in header.names}
    return Dump(header.names, columns, box_cell(path, header.bounds, header.periodic))


def _snapshot(
    stream: IO[bytes], start: int, size: int
) -> tuple[Header, list[tuple[int, str, int]], int]:
    """The header that begins at a byte, the blocks of rows behind it, and where these end."""
    stream.seek(start)
    header = _header(stream)
    blocks, width = [], len(header.names)
    for _ in range(header.blocks):
        (length,) = _take(stream, f"{header.order}i")
        place = stream.tell()
        if length < 0 or length % width or place + 8 * length > size:
            raise ValueError(f"a block of {length} numbers, {width} a row")
        blocks.append((length, "", place))
        stream.seek(place + 8 * length)
    rows = sum(length for length, *_ in blocks) // width
    if rows != header.rows:
        raise ValueError(f"the header counts {header.rows} rows, found {rows}")
    return header, blocks, stream.tell()


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
        stream.seek(4, 1)
    step, count, tilted = _take(stream, f"{order}2qi")
    # of the lower and the upper face of each axis; 0 is periodic
    faces = np.reshape(_take(stream, f"{order}6i"), (3, 2))
    bounds = np.reshape(_take(stream, f"{order}6d"), (3, 2))
    if tilted:
        bounds = np.column_stack([bounds, _take(stream, f"{order}3d")])
    (width,) = _take(stream, f"{order}i")
    # a file of the old layout is known by numbers that can be nothing else
    is_box = np.all(bounds[:, 0] <= bounds[:, 1]) and np.all(np.abs(bounds) <= MOST)
    is_sound = min(step, count) >= 0 and tilted in (0, 1) and np.all((faces >= 0) & (faces <= 3))
    if not (is_sound and is_box and 0 < width <= MOST_COLUMNS):
        raise ValueError("step, box or number of columns cannot be right")
    names = numbers_as_names(width)
    if magic:
        _text(stream, order)  # units
        if _take(stream, "b")[0]:
            (time,) = _take(stream, f"{order}d")
        names = _text(stream, order).split()
    (blocks,) = _take(stream, f"{order}i")
    if len(names) != width or blocks < 1:
        raise ValueError(f"{len(names)} names for {width} columns in {blocks} blocks")
    x, y, z = (bool(both) for both in (faces == 0).all(axis=1))
    return Header(step, time, count, (x, y, z), bounds, names, blocks, order)


def _take(stream: IO[bytes], kinds: str) -> tuple[Any, ...]:
    """The next numbers, of the kinds that :mod:`struct` knows."""
    return struct.unpack(kinds, stream.read(struct.calcsize(kinds)))


def _text(stream: IO[bytes], order: str) -> str:
    """The next text, which stands behind its length."""
    (length,) = _take(stream, f"{order}i")
    return stream.read(max(length, 0)).decode("utf-8", "replace")
