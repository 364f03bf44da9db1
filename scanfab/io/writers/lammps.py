"""Packings as LAMMPS' text dump and data file."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.typing import FloatArray
from scanfab.io.formats.lammps_box import box_vectors
from scanfab.io.writer import Left
from scanfab.io.written import flat, more_columns, own_columns, standard_columns
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

Columns = dict[str, npt.NDArray[Any]]

# words that begin or end what a reader looks for
MOST_EXACT = 2**53
# of atoms without a type or density, which the data file must name
TYPE, DENSITY = 1, 1.0


class LammpsDumpWriter:
    """``dump custom`` as text, with all digits."""

    name = "lammps"
    description = "LAMMPS dump custom (text), with all digits; contacts beside it"
    extensions = (".lammpstrj", ".dump")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; columns that are no numbers lie beside it."""
        own, notes = own_columns(packing)
        columns, more = flat(own)
        held = {name: values for name, values in columns.items() if _fits(name, values)}
        standard = standard_columns(packing)
        place = dict(zip("xyz", packing.position.T, strict=True))
        rows = {"id": standard.pop("id"), **place, "radius": packing.radius, **standard, **held}
        bounds = _bounds(packing)
        time = "" if packing.time is None else f"ITEM: TIME\n{packing.time!r}\n"
        head = (
            f"{time}ITEM: TIMESTEP\n{packing.step or 0}\nITEM: NUMBER OF ATOMS\n{len(packing)}\n"
            f"{bounds}ITEM: ATOMS {' '.join(rows)}\n"
        )
        with open(path, "wb") as stream:
            stream.write(head.encode())
            _write_rows(stream, rows)
        return Left(
            contacts=True,
            frame=packing.step is None or packing.cell is None,
            columns=tuple(name for name in columns if name not in held),
            notes=(*notes, *more),
        )


class LammpsDataWriter:
    """``read_data`` of ``atom_style sphere``."""

    name = "lammps-data"
    description = "LAMMPS data file of atom_style sphere; contacts, cell and columns beside it"
    extensions = (".data", ".lmp")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; LAMMPS has a place for type and density, all else lies beside it."""
        own, notes = own_columns(packing)
        columns, more = flat(own)
        kind, kind_held = _whole_from_one(columns.get("type"), len(packing))
        density, density_held = _positive(columns.get("density"), len(packing))
        held = [name for name, ok in (("type", kind_held), ("density", density_held)) if ok]
        rows = {
            "id": packing.id,
            "type": kind,
            "diameter": 2.0 * packing.radius,
            "density": density,
            **dict(zip("xyz", packing.position.T, strict=True)),
        }
        box, box_notes = _box_lines(packing)
        step = f", timestep = {packing.step}" if packing.step is not None else ""
        head = (
            f"LAMMPS data file by scanfab{step}\n\n{len(packing)} atoms\n"
            f"{int(kind.max(initial=1))} atom types\n\n{box}\nAtoms # sphere\n\n"
        )
        with open(path, "wb") as stream:
            stream.write(head.encode())
            _write_rows(stream, rows)
        if len(packing) and packing.id.max() >= 2**31:
            notes.append("LAMMPS takes ids above 2147483647 only if it was built for them")
        return Left(
            contacts=True,
            frame=True,
            columns=tuple(name for name in more_columns(packing) if name not in held),
            notes=(*notes, *more, *box_notes),
        )


def _fits(name: str, values: npt.NDArray[Any]) -> bool:
    """Whether a dump's reader gives a column back: numbers, under a name of one word."""
    if len(name.split()) != 1 or values.dtype.kind == "U":
        return False
    exact = values.dtype.kind == "f" or bool(np.all(np.abs(values.astype(float)) < MOST_EXACT))
    return exact and name.lower() not in ("element", "lattice")


def _write_rows(stream: io.BufferedWriter, columns: Columns) -> None:
    import polars

    frame = polars.DataFrame({name: np.array(values) for name, values in columns.items()})
    frame.write_csv(stream, include_header=False, separator=" ", quote_style="never")


def _bounds(packing: Packing) -> str:
    """The box of a dump: as its older readers know it if that is exact, else by three vectors."""
    cell = packing.cell
    if cell is None:
        low, high = _extent(packing)
        rows = _digits(np.column_stack([low, high]))
        return f"ITEM: BOX BOUNDS ff ff ff\n{rows}"
    flags = " ".join("pp" if repeats else "ff" for repeats in cell.periodic)
    bounds = _exact_bounds(cell)
    if bounds is None:
        table, kind = np.column_stack([cell.vectors, cell.origin]), "abc origin "
    else:
        table, kind = bounds, "xy xz yz " if bounds.shape[1] == 3 else ""
    rows = _digits(table)
    return f"ITEM: BOX BOUNDS {kind}{flags}\n{rows}"


def _digits(table: FloatArray) -> str:
    """Rows of numbers with all digits, as LAMMPS writes bounds and nobody else does."""
    return "".join(" ".join(f"{x:.16e}" for x in row) + "\n" for row in table.tolist())


def _exact_bounds(cell: Cell) -> FloatArray | None:
    """Bounds, with the tilt behind if there is one, from which the very same cell is read again."""
    vectors, low = cell.vectors, cell.origin
    if np.any(np.triu(vectors, 1)) or np.any(np.diag(vectors) <= 0):
        return None
    xy, xz, yz = tilt = vectors[[1, 2, 2], [0, 0, 1]]
    high = low + np.diag(vectors)
    around_low = low + np.array([min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0])
    around_high = high + np.array([max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0])
    bounds = np.column_stack([around_low, around_high, tilt])
    again, origin = box_vectors(bounds)
    if not (np.array_equal(again, vectors) and np.array_equal(origin, low)):
        return None
    return bounds if tilt.any() else bounds[:, :2]


def _extent(packing: Packing) -> tuple[FloatArray, FloatArray]:
    """The box of the grains' surfaces; of no grains one from 0 to 1."""
    if len(packing) == 0:
        return np.zeros(3), np.ones(3)
    radius = packing.radius[:, None]
    low: FloatArray = (packing.position - radius).min(axis=0)
    high: FloatArray = (packing.position + radius).max(axis=0)
    return low, high


def _box_lines(packing: Packing) -> tuple[str, list[str]]:
    """The box of a data file: LAMMPS has its first vector along x and its second in x and y."""
    cell, tilt = packing.cell, np.zeros(3)
    notes = []
    low, high = _extent(packing)
    if cell is not None:
        vectors = cell.vectors
        if np.any(np.triu(vectors, 1)) or np.any(np.diag(vectors) <= 0):
            corners = (
                cell.origin
                + np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) @ vectors
            )
            low, high = corners.min(axis=0), corners.max(axis=0)
            notes.append(
                "the box in the file is the one around the cell, which LAMMPS cannot have: its "
                "first vector is not along x, or its second not in x and y"
            )
        else:
            low, high = cell.origin, cell.origin + np.diag(vectors)
            tilt = vectors[[1, 2, 2], [0, 0, 1]]
    lines = "".join(
        f"{a!r} {b!r} {axis}lo {axis}hi\n"
        for a, b, axis in zip(low.tolist(), high.tolist(), "xyz", strict=True)
    )
    if tilt.any():
        lines += f"{' '.join(map(repr, tilt.tolist()))} xy xz yz\n"
    return lines, notes


def _whole_from_one(values: npt.NDArray[Any] | None, count: int) -> tuple[npt.NDArray[Any], bool]:
    """Types as LAMMPS numbers them, and whether they are the column's own."""
    ok = values is not None and values.dtype.kind in "iuf" and count > 0
    if ok:
        assert values is not None
        ok = bool(np.all((values >= 1) & (values < 2**31) & (values == np.floor(values))))
    if not ok or values is None:
        return np.full(count, TYPE), False
    return values.astype(np.int64), True


def _positive(values: npt.NDArray[Any] | None, count: int) -> tuple[FloatArray, bool]:
    """Densities, and whether they are the column's own."""
    if values is None or values.dtype.kind not in "iuf" or not np.all(values > 0):
        return np.full(count, DENSITY), False
    return values.astype(np.float64), True
