"""Packings as LAMMPS' text dump and data file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.base.typing import AnyArray, FloatArray
from scanfab.io.writer import Left, csv_bytes, more_columns, table_columns
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

# whole numbers up to here are the same as decimals
MOST_EXACT = 2**53
# ids and types of LAMMPS as it is usually built
MOST_SMALL = 2**31
TURNED = (
    "the box in the file is the one around the cell, which LAMMPS cannot have: its first vector is "
    "not along x, or its second not in x and y"
)


class LammpsDumpWriter:
    """``dump custom`` as text, with all digits."""

    name = "lammps"
    description = "LAMMPS dump custom (text), with all digits; contacts beside it"
    extensions = (".lammpstrj", ".dump")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; columns that are no numbers lie beside it."""
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
        # from bounds the edges of the cell come back with a rounding error
        return Left(contacts=True, frame=True, columns=left, notes=tuple(notes))


class LammpsDataWriter:
    """``read_data`` of ``atom_style sphere``."""

    name = "lammps-data"
    description = "LAMMPS data file of atom_style sphere; contacts, cell and columns beside it"
    extensions = (".data", ".lmp")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; LAMMPS has a place for type and density, all else lies beside it."""
        _, own, notes = table_columns(packing)
        # both columns must be there: without a sound one they are 1
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
    """Whether a dump's reader gives a column back: numbers, under a name of one word."""
    if len(name.split()) != 1 or values.dtype.kind == "U" or name.lower() in ("element", "lattice"):
        return False
    return values.dtype.kind == "f" or bool(np.all(np.abs(values.astype(float)) < MOST_EXACT))


def _is_data(name: str, values: AnyArray) -> bool:
    """Whether LAMMPS takes a column as types (whole numbers from 1) or densities (positive)."""
    if values.dtype.kind not in "iuf" or not np.all(values > 0):
        return False
    return name == "density" or bool(np.all((values < MOST_SMALL) & (values == np.floor(values))))


def _box(packing: Packing) -> tuple[FloatArray, FloatArray, FloatArray, bool]:
    """
    Lower and upper corner and tilt (xy, xz, yz) of the box before it was tilted.

    LAMMPS has its first vector along x and its second in x and y. For another cell it is the box
    around it, and the last value is True. Without a cell it is the box of the grains' surfaces.
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
    """The box of a dump: its bounds as older readers know them, or else by three vectors."""
    cell = packing.cell
    along = (False,) * 3 if cell is None else cell.periodic
    low, high, tilt, is_turned = _box(packing)
    kind, columns = "", [low, high]
    if cell is not None and is_turned:
        kind, columns = "abc origin ", [*cell.vectors.T, cell.origin]
    elif cell is not None and tilt.any():
        kind, columns = "xy xz yz ", [*_around(cell), tilt]
    # with all digits, as LAMMPS writes bounds
    rows = (" ".join(f"{x:.16e}" for x in row) for row in np.column_stack(columns).tolist())
    flags = " ".join("pp" if repeats else "ff" for repeats in along)
    return "\n".join([f"{kind}{flags}", *rows, ""])
