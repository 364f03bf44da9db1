"""
The binary dumps of LAMMPS, new and old, and of LIGGGHTS, whose layout is the old one of LAMMPS.

Knows where numbers stand, not what columns mean. The old layout has no names of columns.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.lengths import MOST
from scanfab.base.typing import FloatArray
from scanfab.io.files import check_memory, plain
from scanfab.io.parse.growing import warn_incomplete
from scanfab.io.parse.lammps_box import box_of_bounds, box_vectors
from scanfab.io.reader import Snapshot
from scanfab.packing.cell import Cell

MAGIC = (b"DUMPCUSTOM", b"DUMPATOM")
# no sound header says more: what does is damaged, and would only take memory
MOST_COLUMNS, MOST_TEXT = 1000, 1 << 16
MOST_BLOCKS = 1 << 20
MOST_STEP = 1 << 62
# the header is never longer
HEADER_BYTES = 1 << 18


@dataclass(frozen=True)
class BinaryDump:
    """One snapshot."""

    names: list[str] | None
    """Of the columns; None in the old layout."""
    values: FloatArray
    """Shape (N, columns)."""
    cell: Cell | None


@dataclass(frozen=True)
class _Header:
    step: int
    time: float | None
    count: int
    flags: tuple[int, ...]
    """Low and high face of each axis: 0 is periodic."""
    bounds: FloatArray
    """Shape (3, 2), or (3, 3) with the tilt."""
    names: list[str] | None
    width: int
    blocks: int
    """Number of blocks, of which each process wrote one."""
    order: str
    """Of the bytes: < or >."""
    size: int
    """Bytes of the header."""


class _NoHeaderError(Exception):
    """Bytes that are no header."""


class _Bytes:
    """Numbers one behind the other."""

    def __init__(self, data: bytes) -> None:
        self.data, self.place, self.order = data, 0, "<"

    def take(self, kinds: str) -> tuple[int | float, ...]:
        """Numbers of these kinds, as :mod:`struct` names them."""
        layout = struct.Struct(self.order + kinds)
        if self.place + layout.size > len(self.data):
            raise _NoHeaderError("the file ends too early")
        found = layout.unpack_from(self.data, self.place)
        self.place += layout.size
        return found

    def whole(self, kind: str, low: int, high: int) -> int:
        """One whole number between these."""
        (found,) = self.take(kind)
        if not low <= found <= high:
            raise _NoHeaderError(f"expected a number from {low} to {high}, found {found}")
        return int(found)

    def text(self) -> str:
        """A text behind its length."""
        length = self.whole("i", 0, MOST_TEXT)
        if self.place + length > len(self.data):
            raise _NoHeaderError("the file ends too early")
        self.place += length
        return self.data[self.place - length : self.place].decode("utf-8", "replace")


def is_binary(head: bytes) -> bool:
    """Whether a file begins with the header of a snapshot, by its first bytes."""
    return names_of_binary(head) is not False


def names_of_binary(head: bytes) -> list[str] | bool | None:
    """The names of the columns; None if there are none, False if it is no such file."""
    try:
        return _header(head).names
    except _NoHeaderError:
        return False


def index_binary(path: Path) -> list[Snapshot]:
    """
    The snapshots of a file, in the order of their steps.

    An incomplete last one (the program is still writing) is left out with a warning if there is a
    complete one before it.

    Raises
    ------
    ReadError
        If there is no complete snapshot.
    """
    file = plain(path)
    size, start = file.stat().st_size, 0
    found: list[Snapshot] = []
    with open(file, "rb") as stream:
        while start < size:
            try:
                header, stop = _skim(stream, start, size)
            except _NoHeaderError as error:
                text = f"{path}: snapshot {len(found) + 1} is damaged or incomplete: {error}"
                if not found:
                    raise ReadError(text) from None
                warn_incomplete(f"{text}; it is left out")
                break
            found.append(Snapshot(path, header.step, header.time, start, stop))
            start = stop
    if not found:
        raise ReadError(f"{path}: the file is empty")
    return sorted(found, key=lambda one: one.step or 0)


def read_binary(snapshot: Snapshot) -> BinaryDump:
    """
    Read one snapshot.

    Raises
    ------
    ReadError
        If its counts do not agree with one another, or with the bytes that are there.
    """
    path, file = snapshot.path, plain(snapshot.path)
    with open(file, "rb") as stream:
        size = stream.seek(0, 2)
        try:
            header, stop = _skim(stream, snapshot.start, size)
        except _NoHeaderError as error:
            raise ReadError(f"{path}: expected a binary dump: {error}") from None
        check_memory(path, 2.0 * (stop - snapshot.start))
        stream.seek(snapshot.start + header.size)
        rows = stream.read(stop - snapshot.start - header.size)
    parts, place = [], 0
    for _ in range(header.blocks):
        (length,) = struct.unpack_from(header.order + "i", rows, place)
        parts.append(np.frombuffer(rows, header.order + "f8", length, place + 4))
        place += 4 + 8 * length
    values = np.concatenate(parts).astype(np.float64).reshape(-1, header.width)
    return BinaryDump(header.names, values, _cell(path, header))


def _skim(stream: IO[bytes], start: int, size: int) -> tuple[_Header, int]:
    """The header of a snapshot, and the byte behind its last block."""
    stream.seek(start)
    header = _header(stream.read(HEADER_BYTES))
    place, count = start + header.size, 0
    for _ in range(header.blocks):
        stream.seek(place)
        found = stream.read(4)
        if len(found) < 4:
            raise _NoHeaderError("the file ends too early")
        (length,) = struct.unpack(header.order + "i", found)
        if length < 0 or length % header.width or place + 4 + 8 * length > size:
            raise _NoHeaderError(f"a block of {length} numbers, {header.width} a row")
        count += length // header.width
        place += 4 + 8 * length
    if count != header.count:
        raise _NoHeaderError(f"the header counts {header.count} rows, found {count}")
    return header, place


def _header(data: bytes) -> _Header:
    """The header at the beginning of some bytes."""
    found = _Bytes(data)
    (marker,) = found.take("q")
    is_new = data[8:].startswith(MAGIC)
    if is_new:
        found.place += len(MAGIC[0] if data[8:].startswith(MAGIC[0]) else MAGIC[1])
        if found.take("i") != (1,):
            found.order, found.place = ">", found.place - 4
            found.whole("i", 1, 1)
        found.whole("i", 1, 2)
        (marker,) = found.take("q")
    if not 0 <= marker < MOST_STEP:
        raise _NoHeaderError(f"the step {marker}")
    count = found.whole("q", 0, len(data) << 40)
    is_tilted = found.whole("i", 0, 1)
    flags = tuple(found.whole("i", 0, 3) for _ in range(6))
    bounds = np.array(found.take("6d"), dtype=np.float64).reshape(3, 2)
    if is_tilted:
        bounds = np.column_stack([bounds, found.take("3d")])
    if not (np.all(np.abs(bounds) < MOST) and np.all(bounds[:, 0] <= bounds[:, 1])):
        raise _NoHeaderError("its bounds are none")
    width, time, names = found.whole("i", 1, MOST_COLUMNS), None, None
    if is_new:
        found.text()  # units
        if found.whole("b", 0, 1):
            (time,) = found.take("d")
        names = found.text().split()
        if len(names) != width:
            raise _NoHeaderError(f"{len(names)} names for {width} columns")
    blocks = found.whole("i", 1, MOST_BLOCKS)
    return _Header(
        int(marker), time, count, flags, bounds, names, width, blocks, found.order, found.place
    )


def _cell(path: Path, header: _Header) -> Cell | None:
    """The box, periodic where both faces are; None if it has no volume and does not repeat."""
    faces = header.flags
    periodic = (faces[0] == faces[1] == 0, faces[2] == faces[3] == 0, faces[4] == faces[5] == 0)
    try:
        vectors, origin = box_vectors(*box_of_bounds(header.bounds))
        return Cell(vectors, periodic, origin)
    except PackingError:
        if not any(periodic):
            return None
        raise ReadError(f"{path}: the box repeats, but its bounds span no volume") from None
