"""
Binary dumps of LAMMPS (new and old layout), of LIGGGHTS (old layout), and NetCDF dumps.

The new layout has names of columns, the old layout has none. All numbers are little endian. ``dump
netcdf`` follows AMBER's convention and is read by netCDF4; all its frames have as many atoms.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns, FloatArray
from scanfab.io.fence import fenced
from scanfab.io.files import first_bytes, leave_out_last, plain
from scanfab.io.formats import shared
from scanfab.io.reader import FileKind, Snapshot
from scanfab.packing.cell import Cell

# minus the length of the word, the word itself, the number 1, and the revision of the layout
NEW_LAYOUT = re.compile(rb".{8}DUMP(?:CUSTOM|ATOM)\x01\0\0\0.{4}", re.DOTALL)
# a larger number means that the file is damaged
MOST_COLUMNS = 1000
# first bytes of the three kinds of NetCDF: classic, 64-bit offsets, 64-bit data
NETCDF = (b"CDF\x01", b"CDF\x02", b"CDF\x05")
# AMBER's names of centres, and the letter that text dumps put behind x, y and z for them
POSITIONS = {"coordinates": "", "unwrapped_coordinates": "u", "scaled_coordinates": "s"}
CELL = ("cell_origin", "cell_lengths", "cell_angles")


class Header(NamedTuple):
    """The header of a snapshot; the blocks of rows below it were written by one process each."""

    step: int
    time: float | None
    rows: int
    periodic: list[bool]
    bounds: FloatArray
    """Lower and upper bound of each axis, shape (3, 2); shape (3, 3) with the tilt."""
    names: list[str]
    """The names of the columns; in the old layout their numbers from 1."""
    blocks: int


class BinaryDump(shared.GrainsOnly):
    """Reads binary dumps, for the readers of both programs."""

    def recognises(self, path: Path) -> bool:
        """Whether the file begins with the header of a snapshot."""
        return bool(self.names(path))

    def names(self, path: Path) -> list[str]:
        """The columns of the first snapshot; numbers in the old layout; empty for other files."""
        try:
            return _header(BytesIO(first_bytes(path, shared.HEADER_BYTES))).names
        except (ValueError, struct.error):
            return []

    def kind(self, path: Path) -> FileKind:
        """Grains; points if the columns have names and none is a radius."""
        return "grains" if self.names(path)[:1] == ["1"] else super().kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The snapshots in the order of their steps; an incomplete last one is left out."""
        return sorted((found for found, *_ in _frames(path)), key=lambda frame: frame.step or 0)

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The columns of a snapshot and its cell; ReadError if the file has changed meanwhile."""
        path = snapshot.path
        _, header, blocks = next(_frames(path, snapshot.start))
        parts = [np.fromfile(plain(path), "<f8", length, "", at) for at, length in blocks]
        values = np.concatenate(parts).reshape(-1, len(header.names))
        columns = {name: values[:, header.names.index(name)] for name in header.names}
        return columns, shared.box_cell(path, header.bounds, header.periodic)


def _frames(path: Path, start: int = 0) -> Iterator[tuple[Snapshot, Header, list[tuple[int, int]]]]:
    """From byte ``start``: snapshots with their header and the (offset, length) of their blocks."""
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
    """Read a header from the stream; ValueError or struct.error if there is none."""
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
    # the old layout has no magic number: check that its numbers are in range
    is_box = np.all(bounds[:, 0] <= bounds[:, 1]) and np.all(np.abs(bounds) <= MOST)
    is_sound = min(step, rows) >= 0 and tilted in (0, 1) and {*faces} <= {0, 1, 2, 3}
    if not (is_sound and is_box and 0 < width == len(names) <= MOST_COLUMNS and blocks > 0):
        raise ValueError("step, box or number of columns is out of range")
    # flags of the lower and the upper face of each axis; 0 means periodic
    periodic = [faces[axis : axis + 2] == [0, 0] for axis in (0, 2, 4)]
    return Header(step, time, rows, periodic, bounds, names, blocks)


def _take(stream: IO[bytes], kinds: str) -> tuple[Any, ...]:
    """The next numbers of the stream, in a format of :mod:`struct`."""
    return struct.unpack(kinds, stream.read(struct.calcsize(kinds)))


def _text(stream: IO[bytes]) -> str:
    """The next text of the stream: its length, then its bytes."""
    (length,) = _take(stream, "<i")
    return stream.read(max(length, 0)).decode("utf-8", "replace")


class NetcdfDump(shared.GrainsOnly):
    """Reads NetCDF dumps, for the readers of both programs."""

    def recognises(self, path: Path) -> bool:
        """Whether the first bytes are of a kind of NetCDF that LAMMPS writes."""
        return first_bytes(path).startswith(NETCDF)

    def names(self, path: Path) -> list[str]:
        """The names of all variables."""
        return self._contents(path)[0]

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames; ``start`` of a snapshot is the number of its frame."""
        return shared.numbered_frames(path, self._contents(path)[1])

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The variables of the atoms, and the cell; ReadError if a value was never written."""
        columns, box = fenced(variables_in_worker, snapshot.path, snapshot.start)
        for name, letter in POSITIONS.items():
            if name in columns and columns[name].shape[1:] == (3,):
                named = zip("xyz", columns.pop(name).T, strict=True)
                columns |= {f"{axis}{letter}": values for axis, values in named}
        return columns, _netcdf_cell(snapshot.path, box)

    def _contents(self, path: Path) -> tuple[list[str], list[tuple[int, float]]]:
        """The names of all variables, and the step and the time of each frame."""
        if find_spec("netCDF4") is None:
            raise ReadError(f'{path}: needs another package: pip install "scanfab[netcdf]"')
        return fenced(contents_in_worker, path)


@contextmanager
def _opened(path: str) -> Iterator[Any]:
    """Open a file; ValueError if LAMMPS has not written it."""
    import netCDF4

    with netCDF4.Dataset(path, "r") as file:
        if getattr(file, "program", "") != "LAMMPS" or "time" not in file.variables:
            raise ValueError("expected a file that LAMMPS wrote by dump netcdf")
        # keep raw values; netCDF4 masks values that were never written
        file.set_auto_scale(False)
        yield file


def contents_in_worker(path: str) -> tuple[list[str], list[tuple[int, float]]]:
    """The names of all variables, and the step and the time of each frame."""
    with _opened(path) as file:
        # LAMMPS stores the step as time, and the time step as its scale factor
        time = file.variables["time"]
        steps, scale = np.asarray(time[:], np.float64), float(time.scale_factor)
        if not np.all((np.abs(steps) < 2.0**53) & (steps == np.rint(steps))):
            raise ValueError("a frame has no step")
        return [*file.variables], [(int(step), step * scale) for step in steps.tolist()]


def variables_in_worker(path: str, frame: int) -> tuple[Columns, Columns]:
    """The columns of the atoms in a frame, and its other variables; ValueError if one has gaps."""
    atoms: dict[str, Any] = {}
    others: Columns = {}
    with _opened(path) as file:
        for name, variable in file.variables.items():
            dimensions, kind = variable.dimensions, np.dtype(variable.dtype).kind
            if dimensions[:1] == ("frame",) and kind in "iuf":
                values = np.ma.asarray(variable[frame])
                group = atoms if dimensions[1:2] == ("atom",) else others
                group[name] = values.astype(values.dtype.newbyteorder("="))
    # rows without any value: atoms that were lost or left their group
    gaps = [np.ma.getmaskarray(a).reshape(len(a), -1).any(axis=1) for a in atoms.values()]
    lost = np.logical_and.reduce(gaps)
    for name, gap in zip(atoms, gaps, strict=True):
        if np.any(gap & ~lost):
            advice = "dump all three of x y z, and close the file before it is read"
            raise ValueError(f"{name} was not written for all atoms: {advice}")
    return {name: np.ma.getdata(values)[~lost] for name, values in atoms.items()}, others


@np.errstate(invalid="ignore", over="ignore", divide="ignore")
def _netcdf_cell(path: Path, arrays: Columns) -> Cell | None:
    """The cell from three edges and angles; along an edge of length 0 it is not periodic."""
    if not all(name in arrays and arrays[name].shape == (3,) for name in CELL):
        return None
    origin, edges, angles = (doubles(arrays[name]) for name in CELL)
    periodic = edges > 0
    # along an axis that is not periodic, any length will do
    edges = np.where(periodic, edges, edges.max())
    # the cosine of 90° must be exactly 0: rounding would tilt the cell
    alpha, beta, gamma = np.where(angles == 90.0, 0.0, np.cos(np.radians(angles)))
    sine = np.sqrt(1.0 - gamma**2)
    xy = (alpha - beta * gamma) / sine
    # the first vector is along x, the second in the plane x-y
    rows = [[1, 0, 0], [gamma, sine, 0], [beta, xy, np.sqrt(1.0 - beta**2 - xy**2)]]
    where, vectors = f"{path}: {', '.join(CELL)}", np.array(rows) * edges[:, None]
    return shared.cell_of(where, vectors, periodic, origin)
