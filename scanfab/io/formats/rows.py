"""
Write packings with a row for each sphere: CSV, TSV, Parquet, and LAMMPS.

LAMMPS reads text dumps and data files.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from scanfab.base.typing import AnyArray, Columns, FloatArray
from scanfab.io.formats.table import FRAME_NAMES, plain_name
from scanfab.io.writer import Left, csv_bytes, more_columns, table_columns
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

# doubles hold whole numbers up to here exactly
MOST_EXACT = 2**53
# limit of ids and types in the usual builds of LAMMPS
MOST_SMALL = 2**31
TURNED = (
    "LAMMPS cannot store this cell, as its first vector is not along x, or its second not in the "
    "plane x-y: the box in the file is the box around the cell"
)


class CsvWriter:
    """Tables with commas between the values."""

    name = "csv"
    description = "a table of spheres with commas; contacts and cell in companion files"
    extensions: tuple[str, ...] = (".csv",)
    separator = ","

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; a column that numbers frames (`time`) goes into a companion file."""
        known, own, notes = table_columns(packing)
        times = {name: values for name, values in own.items() if plain_name(name) in FRAME_NAMES}
        left = tuple(name for name, values in times.items() if len(np.unique(values)) > 1)
        held = {name: values for name, values in own.items() if name not in left}
        path.write_bytes(self.table({**known, **held}))
        return Left(contacts=True, frame=True, columns=left, notes=tuple(notes))

    def table(self, columns: Columns) -> bytes:
        """The bytes of the file."""
        return csv_bytes(columns, self.separator)


class TsvWriter(CsvWriter):
    """Tables with tabs between the values."""

    name = "tsv"
    description = "a table of spheres with tabs; contacts and cell in companion files"
    extensions = (".tsv",)
    separator = "\t"


class ParquetWriter(CsvWriter):
    """Apache Parquet."""

    name = "parquet"
    description = "a table of spheres as Apache Parquet; contacts and cell in companion files"
    extensions = (".parquet",)

    def table(self, columns: Columns) -> bytes:
        """The bytes of the file."""
        import polars

        stream = io.BytesIO()
        polars.DataFrame(columns).write_parquet(stream)
        return stream.getvalue()


class LammpsDumpWriter:
    """``dump custom`` as text, with all digits."""

    name = "lammps"
    description = "LAMMPS dump custom (text), with all digits; contacts in companion files"
    extensions = (".lammpstrj", ".dump")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; columns of texts go into a companion file."""
        known, own, notes = table_columns(packing)
        held = {name: values for name, values in own.items() if _is_dumped(name, values)}
        rows = {**known, **held}
        time = "" if packing.time is None else f"ITEM: TIME\n{packing.time!r}\n"
        head = (
            f"{time}ITEM: TIMESTEP\n{packing.step or 0}\nITEM: NUMBER OF ATOMS\n{len(packing)}\n"
            f"ITEM: BOX BOUNDS {_bounds(packing)}ITEM: ATOMS {' '.join(rows)}\n"
        )
        path.write_bytes(head.encode() + csv_bytes(rows, " ", with_names=False))
        left = tuple(name for name in own if name not in held)
        # frame=True: edges that are read back from bounds have a rounding error
        return Left(contacts=True, frame=True, columns=left, notes=tuple(notes))


class LammpsDataWriter:
    """``read_data`` of ``atom_style sphere``."""

    name = "lammps-data"
    description = "LAMMPS data file of atom_style sphere; companion files for the rest"
    extensions = (".data", ".lmp")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame with type and density; all other columns go into a companion file."""
        _, own, notes = table_columns(packing)
        # LAMMPS requires type and density: where the packing has no valid values, they are 1
        kinds = {"type": np.ones(len(packing), np.int64), "density": np.ones(len(packing))}
        held = [name for name in kinds if name in own and _is_data(name, own[name])]
        kinds |= {name: own[name].astype(kinds[name].dtype) for name in held}
        rows = {"id": packing.id, "type": kinds["type"], "diameter": 2.0 * packing.radius}
        rows |= {"density": kinds["density"], **dict(zip("xyz", packing.position.T, strict=True))}
        low, high, tilt, is_turned = _box(packing)
        sides = zip(low.tolist(), high.tolist(), "xyz", strict=True)
        box = "".join(f"{a!r} {b!r} {axis}lo {axis}hi\n" for a, b, axis in sides)
        if tilt.any():
            box += f"{' '.join(map(repr, tilt.tolist()))} xy xz yz\n"
        step = f", timestep = {packing.step}" if packing.step is not None else ""
        head = (
            f"LAMMPS data file by scanfab{step}\n\n{len(packing)} atoms\n"
            f"{rows['type'].max(initial=1)} atom types\n\n{box}\nAtoms # sphere\n\n"
        )
        path.write_bytes(head.encode() + csv_bytes(rows, " ", with_names=False))
        if len(packing) and packing.id.max() >= MOST_SMALL:
            notes.append("LAMMPS takes ids above 2147483647 only if it was built for them")
        left = tuple(name for name in more_columns(packing) if name not in held)
        notes += [TURNED] if is_turned else []
        return Left(contacts=True, frame=True, columns=left, notes=tuple(notes))


def _is_dumped(name: str, values: AnyArray) -> bool:
    """Whether a dump can hold a column without loss: numbers, and a name of one word."""
    if len(name.split()) != 1 or values.dtype.kind == "U" or name.lower() in ("element", "lattice"):
        return False
    return values.dtype.kind == "f" or bool(np.all(np.abs(values.astype(float)) < MOST_EXACT))


def _is_data(name: str, values: AnyArray) -> bool:
    """Whether a column holds valid types (whole numbers from 1) or densities (positive)."""
    if values.dtype.kind not in "iuf" or not np.all(values > 0):
        return False
    return name == "density" or bool(np.all((values < MOST_SMALL) & (values == np.floor(values))))


def _box(packing: Packing) -> tuple[FloatArray, FloatArray, FloatArray, bool]:
    """
    Lower and upper corner of the box before it is tilted, and the tilt (xy, xz, yz).

    LAMMPS needs the first vector along x and the second in the plane x-y. For any other cell the
    result is the box around the cell, and the last value is True. Without a cell the box encloses
    the grains.
    """
    cell, no_tilt = packing.cell, np.zeros(3)
    if cell is None and not len(packing):
        return np.zeros(3), np.ones(3), no_tilt, False
    if cell is None:
        place, radius = packing.position, packing.radius[:, None]
        return (place - radius).min(axis=0), (place + radius).max(axis=0), no_tilt, False
    if np.any(np.triu(cell.vectors, 1)) or np.any(np.diag(cell.vectors) <= 0):
        return *_around(cell), no_tilt, True
    high = cell.origin + np.diag(cell.vectors)
    return cell.origin, high, cell.vectors[[1, 2, 2], [0, 0, 1]], False


def _around(cell: Cell) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of the box around a cell."""
    corners = cell.origin + np.array(list(np.ndindex(2, 2, 2))) @ cell.vectors
    return corners.min(axis=0), corners.max(axis=0)


def _bounds(packing: Packing) -> str:
    """The box in a dump: bounds, which older programs read too, or three vectors if need be."""
    cell = packing.cell
    along = (False,) * 3 if cell is None else cell.periodic
    low, high, tilt, is_turned = _box(packing)
    kind, columns = "", [low, high]
    if cell is not None and is_turned:
        kind, columns = "abc origin ", [*cell.vectors.T, cell.origin]
    elif cell is not None and tilt.any():
        kind, columns = "xy xz yz ", [*_around(cell), tilt]
    # 16 digits, as LAMMPS writes bounds
    rows = (" ".join(f"{x:.16e}" for x in row) for row in np.column_stack(columns).tolist())
    flags = " ".join("pp" if repeats else "ff" for repeats in along)
    return "\n".join([f"{kind}{flags}", *rows, ""])
