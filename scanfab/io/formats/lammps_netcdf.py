"""LAMMPS' ``dump netcdf`` (AMBER's convention): frames of one number of atoms, by netCDF4."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table, has_radius
from scanfab.io.fence import fenced, needed
from scanfab.io.formats.shared import cell_of
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

Arrays = dict[str, npt.NDArray[Any]]

# classic, with long offsets, with long data; HDF5 is told apart by its content
MAGIC = (b"CDF\x01", b"CDF\x02", b"CDF\x05")
# AMBER's name of each triple, and whether its values are fractions of the box
POSITIONS = {"coordinates": False, "unwrapped_coordinates": False, "scaled_coordinates": True}
CELL = ("cell_origin", "cell_lengths", "cell_angles")
# what netCDF reads where nothing was written: atoms that were lost, or left their group
FILL = {"f4": 9.9692099683868690e36, "f8": 9.9692099683868690e36, "i4": -(2**31) + 1}
FILL_LONG = -(2**63) + 2


class NetcdfFrame(NamedTuple):
    """What a file holds of one frame, or (the time alone) of all."""

    names: list[str]
    """Of all variables in the file."""
    frames: int
    """How many there are."""
    time: FloatArray
    """Of all frames, as it is stored."""
    scale: float | None
    """By which the time is multiplied, if the file says so."""
    program: str
    atoms: Arrays
    """The frame's variables that have a value, or several, for each atom."""
    others: Arrays


def is_netcdf(head: bytes) -> bool:
    """Whether a file is NetCDF, of the kinds that LAMMPS writes."""
    return head.startswith(MAGIC)


def netcdf_kind(path: Path) -> FileKind:
    """Grains, or points without a radius."""
    names = _read(path, None).names
    if not any(name in names for name in POSITIONS):
        return "other"
    return "grains" if has_radius(names) else "points"


def index_netcdf(path: Path) -> list[Snapshot]:
    """The frames; ``start`` of a snapshot is the number of its frame."""
    file = _read(path, None)
    if file.frames == 0:
        raise ReadError(f"{path}: expected frames, found none")
    times = file.time
    if times.shape != (file.frames,) or not np.all(np.abs(times) < 2.0**53):
        raise ReadError(f"{path}: expected a time of each of {file.frames} frames")
    # LAMMPS writes the step as time, and the length of a step as its scale
    are_steps = file.program == "LAMMPS" and bool(np.all(times == np.rint(times)))
    scale = 1.0 if file.scale is None and not are_steps else file.scale
    found = []
    for number, time in enumerate(times.tolist()):
        step, seconds = int(time) if are_steps else None, None if scale is None else time * scale
        found.append(Snapshot(path, step, seconds, start=number, stop=number + 1))
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
    file = _read(path, snapshot.start)
    there, cell = _written(path, file.atoms), _cell(path, file.others)
    columns: Arrays = {name: values[there] for name, values in file.atoms.items()}
    for name, scaled in POSITIONS.items():
        position = columns.pop(name, None)
        if position is None or "position" in columns:
            continue
        if position.shape[1:] != (3,):
            raise ReadError(f"{path}: {name}: expected three numbers for each atom")
        columns["position"] = doubles(position)
        if scaled:
            if cell is None:
                raise ReadError(f"{path}: {name} are fractions of a box, but there is no box")
            columns["position"] = cell.origin + columns["position"] @ cell.vectors
    return grain_table(path, columns, cell, options, f", frame {snapshot.start}")


def _read(path: Path, frame: int | None) -> NetcdfFrame:
    needed(path, "netCDF4", "netcdf")
    return fenced(read_in_worker, path, frame)


def read_in_worker(path: str, frame: int | None) -> NetcdfFrame:
    """The variables of a frame; ValueError says why it cannot be read."""
    import netCDF4

    atoms: Arrays = {}
    others: Arrays = {}
    with netCDF4.Dataset(path, "r") as file:
        # what was never written must be seen as it is
        file.set_auto_maskandscale(False)
        count = len(file.dimensions["frame"]) if "frame" in file.dimensions else 0
        if frame is not None and not 0 <= frame < count:
            raise ValueError(f"there is no frame {frame} among {count}")
        time = file.variables.get("time")
        steps = np.zeros(0)
        if time is not None and time.dtype is not str and time.dtype.kind in "iuf":
            steps = np.asarray(time[:], np.float64)
        scale = getattr(time, "scale_factor", None)
        for name, variable in file.variables.items() if frame is not None else ():
            own = variable.dimensions
            if own[:1] == ("frame",) and variable.dtype is not str and variable.dtype.kind in "iuf":
                values = np.asarray(variable[frame])
                group = atoms if own[1:2] == ("atom",) else others
                group[name] = values.astype(values.dtype.newbyteorder("="))
        return NetcdfFrame(
            list(file.variables),
            count,
            steps,
            float(scale) if isinstance(scale, float | np.floating) else None,
            str(getattr(file, "program", "")),
            atoms,
            others,
        )


def _written(path: Path, atoms: Arrays) -> npt.NDArray[np.bool_]:
    """Which atoms were written: LAMMPS leaves those behind the last one of a frame as they are."""
    count = max((len(values) for values in atoms.values()), default=0)
    empty = np.zeros((len(atoms), count), dtype=bool)
    for place, values in enumerate(atoms.values()):
        filled = values == FILL.get(values.dtype.str[1:], FILL_LONG)
        empty[place] = filled.reshape(count, -1).any(axis=1) if filled.size else False
    lost = empty.all(axis=0)
    if np.any(empty & ~lost):
        name = list(atoms)[int(np.argmax((empty & ~lost).any(axis=1)))]
        raise ReadError(
            f"{path}: {name} was not written for all atoms: dump all three of x y z, and close the "
            f"file before it is read"
        )
    return np.logical_not(lost)


def _cell(path: Path, arrays: Arrays) -> Cell | None:
    """Three edges and angles; along an edge of length 0 the sample is not periodic."""
    if not all(arrays.get(name, np.zeros(0)).shape == (3,) for name in CELL):
        return None
    origin, edges, angles = (doubles(arrays[name]) for name in CELL)
    periodic = edges > 0
    if not periodic.any():
        return None
    # any length will do along an axis that is not periodic
    edges = np.where(periodic, edges, edges.max())
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        # cos 90° is zero, which rounding would make a tilt
        alpha, beta, gamma = np.where(angles == 90.0, 0.0, np.cos(np.radians(angles)))
        sine = np.sqrt(1.0 - gamma**2)
        xy = (alpha - beta * gamma) / sine
        # the first vector along x, the second in the plane x-y
        rows = [[1, 0, 0], [gamma, sine, 0], [beta, xy, np.sqrt(1.0 - beta**2 - xy**2)]]
        vectors = np.array(rows) * edges[:, None]
    return cell_of(f"{path}: {', '.join(CELL)}", vectors, periodic, origin)
