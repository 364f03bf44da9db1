"""LAMMPS' ``dump netcdf`` (AMBER's convention): frames of one number of atoms, by netCDF4."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.fence import fenced, needed
from scanfab.io.formats.columns import grain_table, has_radius
from scanfab.io.parse.netcdf_files import read_netcdf
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

# classic, with long offsets, with long data; HDF5 is told apart by its content
MAGIC = (b"CDF\x01", b"CDF\x02", b"CDF\x05")
# AMBER's name of each triple, and whether its values are fractions of the box
POSITIONS = (
    ("coordinates", False),
    ("unwrapped_coordinates", False),
    ("scaled_coordinates", True),
)
CELL = ("cell_origin", "cell_lengths", "cell_angles")
# what netCDF reads where nothing was written: atoms that were lost, or left their group
FILL = {"f4": 9.9692099683868690e36, "f8": 9.9692099683868690e36, "i4": -(2**31) + 1}
FILL_LONG = -(2**63) + 2


def is_netcdf(head: bytes) -> bool:
    """Whether a file is NetCDF, of the kinds that LAMMPS writes."""
    return head.startswith(MAGIC)


def netcdf_kind(path: Path) -> FileKind:
    """Grains, or points without a radius."""
    _, words = _read(path, None)
    names = list(words["dimensions"])
    if not any(name in names for name, _ in POSITIONS):
        return "other"
    return "grains" if has_radius(names) else "points"


def index_netcdf(path: Path) -> list[Snapshot]:
    """
    The records; ``start`` of a snapshot is the number of its record.

    LAMMPS writes the step as time, and the length of a step as its scale.
    """
    arrays, words = _read(path, None)
    count = int(words["frames"])
    steps = np.asarray(arrays.get("time", np.zeros(0)), dtype=np.float64)
    if count == 0:
        raise ReadError(f"{path}: expected frames, found none")
    if steps.shape != (count,) or not np.all(np.abs(steps) < 2.0**53):
        raise ReadError(f"{path}: expected a time of each of {count} frames, found {steps.shape}")
    scale = words["scale"].get("time")
    is_lammps = words["program"] == "LAMMPS" and bool(np.all(steps == np.rint(steps)))
    found = []
    for number, one in enumerate(steps.tolist()):
        step = int(one) if is_lammps else None
        time = one if scale is None and not is_lammps else None if scale is None else one * scale
        found.append(Snapshot(path, step, time, start=number, stop=number + 1))
    return found


def read_netcdf_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    The variables of the atoms, by their names.

    Raises
    ------
    ReadError
        If netCDF4 is not installed or cannot read the file, or a value was never written.
    """
    path = snapshot.path
    arrays, words = _read(path, snapshot.start)
    of_atoms = {
        name: values
        for name, values in arrays.items()
        if words["dimensions"][name][1:2] in (("atom",), ["atom"])
    }
    count = min((len(values) for values in of_atoms.values()), default=0)
    there = _written(path, of_atoms, count)
    columns: dict[str, npt.NDArray[Any]] = {}
    cell = _cell(path, arrays)
    for name, scaled in POSITIONS:
        position = of_atoms.pop(name, None)
        if position is None or "position" in columns:
            continue
        if position.shape[1:] != (3,):
            raise ReadError(f"{path}: {name}: expected three numbers for each atom")
        place = doubles(position[there])
        if scaled:
            if cell is None:
                raise ReadError(f"{path}: {name} are fractions of a box, but there is no box")
            place = cell.origin + place @ cell.vectors
        columns["position"] = place
    columns |= {name: values[there] for name, values in of_atoms.items()}
    return grain_table(path, columns, cell, options, f", frame {snapshot.start}")


def _read(path: Path, frame: int | None) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Any]]:
    needed(path, "netCDF4", "netcdf")
    return fenced(read_netcdf, path, 1 << 62, frame)


def _written(path: Path, columns: dict[str, npt.NDArray[Any]], count: int) -> npt.NDArray[np.bool_]:
    """Which rows were written: LAMMPS leaves those behind the last atom of a frame as they are."""
    empty = np.zeros((len(columns), count), dtype=bool)
    for place, values in enumerate(columns.values()):
        filled = values == FILL.get(values.dtype.str[1:], FILL_LONG)
        empty[place] = filled.reshape(count, -1).any(axis=1) if filled.size else False
    lost = empty.all(axis=0)
    if np.any(empty.any(axis=0) & ~lost):
        name = list(columns)[int(np.argmax((empty & ~lost).any(axis=1)))]
        raise ReadError(
            f"{path}: {name} was not written for all atoms: dump all three of x y z, and close the "
            f"file before it is read"
        )
    return np.logical_not(lost)


def _cell(path: Path, arrays: dict[str, npt.NDArray[Any]]) -> Cell | None:
    """Three edges and angles; along an edge of length 0 the sample does not repeat."""
    if not all(arrays.get(name, np.zeros(0)).shape == (3,) for name in CELL):
        return None
    origin, edges, angles = (doubles(arrays[name]) for name in CELL)
    periodic = edges > 0
    if not periodic.any():
        return None
    # any length will do where nothing repeats
    edges = np.where(periodic, edges, edges.max())
    try:
        along = (bool(periodic[0]), bool(periodic[1]), bool(periodic[2]))
        return Cell(_vectors(edges, angles), along, origin)
    except PackingError as error:
        raise ReadError(f"{path}: {', '.join(CELL)}: {error}") from None


@np.errstate(invalid="ignore", over="ignore")
def _vectors(edges: FloatArray, angles: FloatArray) -> FloatArray:
    """Lattice vectors as rows: the first along x, the second in the plane x-y."""
    # cos 90° is zero, which rounding would make a tilt
    alpha, beta, gamma = np.where(angles == 90.0, 0.0, np.cos(np.radians(angles)))
    sine = np.sqrt(1.0 - gamma**2)
    xy = (alpha - beta * gamma) / sine if sine > 0 else np.nan
    rows = [[1, 0, 0], [gamma, sine, 0], [beta, xy, np.sqrt(1.0 - beta**2 - xy**2)]]
    return np.array(rows, dtype=np.float64) * edges[:, None]
