"""
Write packings with a row for each sphere: CSV, TSV, Parquet, and LAMMPS.

LAMMPS reads text dumps and data files.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from scanfab.base.typing import AnyArray, Columns
from scanfab.io.formats.table import FRAME_NAMES, plain_name
from scanfab.io.writer import Left, csv_bytes, more_columns, table_columns
from scanfab.packing.packing import Packing

# doubles hold whole numbers up to here exactly
MOST_EXACT = 2**53
# limit of ids and types in the usual builds of LAMMPS
MOST_SMALL = 2**31


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
        kind, lines = _box(packing, is_around=True)
        along = (False,) * 3 if packing.cell is None else packing.cell.periodic
        # 16 digits, as LAMMPS writes bounds
        box = "\n".join(" ".join(f"{x:.16e}" for x in line) for line in lines)
        flags = " ".join([*kind.split(), *("pp" if repeats else "ff" for repeats in along)])
        time = "" if packing.time is None else f"ITEM: TIME\n{packing.time!r}\n"
        head = (
            f"{time}ITEM: TIMESTEP\n{packing.step or 0}\nITEM: NUMBER OF ATOMS\n{len(packing)}\n"
            f"ITEM: BOX BOUNDS {flags}\n{box}\nITEM: ATOMS {' '.join(rows)}\n"
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
        kind, lines = _box(packing)
        keys = ("avec", "bvec", "cvec") if "abc" in kind else ("xlo xhi", "ylo yhi", "zlo zhi")
        last = [[line.pop() for line in lines]] if kind else []
        named = zip([*lines, *last], (*keys, kind), strict=False)
        box = "".join(f"{' '.join(map(repr, line))} {key}\n" for line, key in named)
        step = f", timestep = {packing.step}" if packing.step is not None else ""
        head = (
            f"LAMMPS data file by scanfab{step}\n\n{len(packing)} atoms\n"
            f"{rows['type'].max(initial=1)} atom types\n\n{box}\nAtoms # sphere\n\n"
        )
        path.write_bytes(head.encode() + csv_bytes(rows, " ", with_names=False))
        if len(packing) and packing.id.max() >= MOST_SMALL:
            notes.append("LAMMPS takes ids above 2147483647 only if it was built for them")
        left = tuple(name for name in more_columns(packing) if name not in held)
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


def _box(packing: Packing, *, is_around: bool = False) -> tuple[str, list[list[float]]]:
    """
    The box as LAMMPS has it: a row of numbers for each axis, and the name of its last column.

    A row has the lower and the upper bound, and perhaps the tilt (xy, xz, yz); or a vector and a
    coordinate of the origin, if the first vector is not along x or the second not in the plane x-y.
    Dumps have the bounds of the box around the tilted box (``is_around``). Without a cell the box
    encloses the grains.
    """
    cell, place, radius = packing.cell, packing.position, packing.radius[:, None]
    if cell is None:
        place, radius = (place, radius) if len(packing) else (np.zeros((1, 3)), np.ones((1, 1)))
        low, high = (place - radius).min(axis=0), (place + radius).max(axis=0)
        return "", np.column_stack([low, high]).tolist()
    if np.any(np.triu(cell.vectors, 1)) or np.any(np.diag(cell.vectors) <= 0):
        return "abc origin", np.column_stack([cell.vectors, cell.origin]).tolist()
    tilt = cell.vectors[[1, 2, 2], [0, 0, 1]]
    corners = cell.origin + np.array([np.zeros(3), np.diag(cell.vectors)])
    if is_around:
        corners = cell.origin + np.array(list(np.ndindex(2, 2, 2))) @ cell.vectors
    columns = [corners.min(axis=0), corners.max(axis=0), *([tilt] if tilt.any() else [])]
    return "xy xz yz" if tilt.any() else "", np.column_stack(columns).tolist()
