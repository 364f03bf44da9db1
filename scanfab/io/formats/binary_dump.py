"""
Dumps that are no text: LAMMPS' binary ones, new and old, LIGGGHTS' (the old layout), and NetCDF.

The new layout names its columns, the old one does not. The bytes of all numbers are in the order of
today's processors (little endian). ``dump netcdf`` is AMBER's convention, read by netCDF4: all
frames have one number of atoms.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns, FloatArray
from scanfab.io.fence import fenced
from scanfab.io.files import check_memory, first_bytes, leave_out_last, plain
from scanfab.io.formats import shared
from scanfab.io.reader import FileKind, Snapshot
from scanfab.packing.cell import Cell

# minus the length of the word, the word, the number 1, and the revision of the layout
NEW_LAYOUT = re.compile(rb".{8}DUMP(?:CUSTOM|ATOM)\x01\0\0\0.{4}", re.DOTALL)
# more stand in damaged files only
MOST_COLUMNS = 1000
# NetCDF: classic, with long offsets, with long data; HDF5 is told apart by its content
NETCDF = (b"CDF\x01", b"CDF\x02", b"CDF\x05")
# AMBER's name of the centres, and what dumps of text add to x, y and z
POSITIONS = {"coordinates": "", "unwrapped_coordinates": "u", "scaled_coordinates": "s"}
CELL = ("cell_origin", "cell_lengths", "cell_angles")


class Header(NamedTuple):
    """What stands above the blocks of rows, of which each process wrote one."""

    step: int
    time: float | None
    rows: int
    periodic: list[bool]
    bounds: FloatArray
    """Shape (3, 2), or (3, 3) with the tilt."""
    names: list[str]
    """Of the columns; their numbers from 1 in the old layout."""
    blocks: int


class BinaryDump(shared.GrainsOnly):
    """What DumpReader needs of binary dumps."""

    def recognises(self, path: Path) -> bool:
        """By the header of a snapshot."""
        return bool(self.names(path))

    def names(self, path: Path) -> list[str]:
        """Those of the first snapshot, numbers in the old layout; none in another file."""
        try:
            return _header(BytesIO(first_bytes(path, shared.HEADER_BYTES))).names
        except (ValueError, struct.error):
            return []

    def kind(self, path: Path) -> FileKind:
        """Grains, unless the columns have names and none is a radius."""
        return "grains" if self.names(path)[:1] == ["1"] else super().kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """In the order of their steps; an incomplete last one is left out."""
        return sorted((found for found, *_ in _frames(path)), key=lambda one: one.step or 0)

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """ReadError if the file is not as it was when its snapshots were found."""
        path = snapshot.path
        found, header, blocks = next(_frames(path, snapshot.start))
        check_memory(path, 2.0 * ((found.stop or 0) - found.start))
        parts = [np.fromfile(plain(path), "<f8", length, "", at) for at, length in blocks]
        values = np.concatenate(parts).reshape(-1, len(header.names))
        columns = {name: values[:, header.names.index(name)] for name in header.names}
        return columns, shared.box_cell(path, header.bounds, header.periodic)


def _frames(path: Path, start: int = 0) -> Iterator[tuple[Snapshot, Header, list[tuple[int, int]]]]:
    """From a byte on: each snapshot, its header, and where its blocks are and how many numbers."""
    with open(plain(path), "rb") as stream:
        size, count = stream.seek(0, 2), 0
        while start < size or not count:
            stream.seek(start)
            try:
                header, blocks = _header(stream), []
                for _ in range(header.blocks):
                    (length,) = _take(stream, "<i")
                    blocks.append((stream.tell(), length))
                    if length < 0 or stream.seek(8 * length, 1) > size:
                        raise ValueError(f"a block of {length} numbers")
                numbers = sum(length for _, length in blocks)
                if numbers != header.rows * len(header.names):
                    raise ValueError(f"{header.rows} rows are not {numbers} numbers")
            except (ValueError, struct.error) as error:
                leave_out_last(path, count, f"expected a whole binary snapshot: {error}")
                return
            stop, count = stream.tell(), count + 1
            yield Snapshot(path, header.step, header.time, start, stop), header, blocks
            start = stop


def _header(stream: IO[bytes]) -> Header:
    """The header that begins where the stream is; ValueError or struct.error if there is none."""
    start, time = stream.tell(), None
    new = NEW_LAYOUT.match(stream.read(26))
    stream.seek(start + (new.end() if new else 0))
    step, rows, tilted, *faces = _take(stream, "<2q7i")
    bounds = np.reshape(_take(stream, "<6d"), (3, 2))
    if tilted:
        bounds = np.column_stack([bounds, _take(stream, "<3d")])
    (width,) = _take(stream, "<i")
    names = shared.numbered(min(width, MOST_COLUMNS))
    if new:
        _text(stream)  # units
        if _take(stream, "b")[0]:
            (time,) = _take(stream, "<d")
        names = _text(stream).split()
    (blocks,) = _take(stream, "<i")
    # the old layout has no mark: it is recognised by the ranges of its numbers
    is_box = np.all(bounds[:, 0] <= bounds[:, 1]) and np.all(np.abs(bounds) <= MOST)
    is_sound = min(step, rows) >= 0 and tilted in (0, 1) and {*faces} <= {0, 1, 2, 3}
    if not (is_sound and is_box and 0 < width == len(names) <= MOST_COLUMNS and blocks > 0):
        raise ValueError("step, box or columns cannot be right")
    # of the lower and the upper face of each axis; 0 is periodic
    periodic = [faces[axis : axis + 2] == [0, 0] for axis in (0, 2, 4)]
    return Header(step, time, rows, periodic, bounds, names, blocks)


def _take(stream: IO[bytes], kinds: str) -> tuple[Any, ...]:
    """The next numbers, of the kinds that :mod:`struct` knows."""
    return struct.unpack(kinds, stream.read(struct.calcsize(kinds)))


def _text(stream: IO[bytes]) -> str:
    """The next text, which stands behind its length."""
    (length,) = _take(stream, "<i")
    return stream.read(max(length, 0)).decode("utf-8", "replace")


class NetcdfDump(shared.GrainsOnly):
    """What DumpReader needs of NetCDF."""

    def recognises(self, path: Path) -> bool:
        """By the first bytes of the kinds that LAMMPS writes."""
        return first_bytes(path).startswith(NETCDF)

    def names(self, path: Path) -> list[str]:
        """Of all variables."""
        return [*_read_netcdf(path, None)[0]]

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames; ``start`` of a snapshot is the number of its frame."""
        return shared.numbered_frames(path, _read_netcdf(path, None)[1])

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The variables of the atoms; ReadError if a value was never written."""
        columns, box = _read_netcdf(snapshot.path, snapshot.start)
        for name, letter in POSITIONS.items():
            if name in columns and columns[name].shape[1:] == (3,):
                named = zip("xyz", columns.pop(name).T, strict=True)
                columns |= {f"{axis}{letter}": values for axis, values in named}
        return columns, _netcdf_cell(snapshot.path, box)


def _read_netcdf(path: Path, frame: int | None) -> tuple[Any, Any]:
    if find_spec("netCDF4") is None:
        raise ReadError(f'{path}: needs another package: pip install "scanfab[netcdf]"')
    return fenced(read_in_worker, path, frame)


def read_in_worker(path: str, frame: int | None) -> tuple[Any, Any]:
    """
    The columns of the atoms in a frame, and its other variables.

    If ``frame`` is None: the names of all variables, and the step and the time of each frame.
    ValueError says what is wrong.
    """
    import netCDF4

    with netCDF4.Dataset(path, "r") as file:
        if getattr(file, "program", "") != "LAMMPS" or "time" not in file.variables:
            raise ValueError("expected what LAMMPS writes by dump netcdf")
        # values that were never written are masked
        file.set_auto_scale(False)
        if frame is None:
            # LAMMPS writes the step as time, and the length of a step as its scale
            time = file.variables["time"]
            steps, scale = np.asarray(time[:], np.float64), float(time.scale_factor)
            if not np.all((np.abs(steps) < 2.0**53) & (steps == np.rint(steps))):
                raise ValueError("a frame has no step")
            return [*file.variables], [(int(step), step * scale) for step in steps.tolist()]
        atoms: dict[str, Any] = {}
        others: Columns = {}
        for name, variable in file.variables.items():
            dimensions, kind = variable.dimensions, np.dtype(variable.dtype).kind
            if dimensions[:1] == ("frame",) and kind in "iuf":
                values = np.ma.asarray(variable[frame])
                group = atoms if dimensions[1:2] == ("atom",) else others
                group[name] = values.astype(values.dtype.newbyteorder("="))
    # some atoms were lost, or left their group
    gaps = [np.ma.getmaskarray(one).reshape(len(one), -1).any(axis=1) for one in atoms.values()]
    lost = np.logical_and.reduce(gaps)
    for name, gap in zip(atoms, gaps, strict=True):
        if np.any(gap & ~lost):
            told = "dump all three of x y z, and close the file before it is read"
            raise ValueError(f"{name} was not written for all atoms: {told}")
    return {name: np.ma.getdata(values)[~lost] for name, values in atoms.items()}, others


@np.errstate(invalid="ignore", over="ignore", divide="ignore")
def _netcdf_cell(path: Path, arrays: Columns) -> Cell | None:
    """Three edges and angles; along an edge of length 0 the sample is not periodic."""
    if not all(name in arrays and arrays[name].shape == (3,) for name in CELL):
        return None
    origin, edges, angles = (doubles(arrays[name]) for name in CELL)
    periodic = edges > 0
    # any length will do along an axis that is not periodic
    edges = np.where(periodic, edges, edges.max())
    # cos 90° is zero, which rounding would make a tilt
    alpha, beta, gamma = np.where(angles == 90.0, 0.0, np.cos(np.radians(angles)))
    sine = np.sqrt(1.0 - gamma**2)
    xy = (alpha - beta * gamma) / sine
    # the first vector along x, the second in the plane x-y
    rows = [[1, 0, 0], [gamma, sine, 0], [beta, xy, np.sqrt(1.0 - beta**2 - xy**2)]]
    where, vectors = f"{path}: {', '.join(CELL)}", np.array(rows) * edges[:, None]
    return shared.cell_of(where, vectors, periodic, origin)
