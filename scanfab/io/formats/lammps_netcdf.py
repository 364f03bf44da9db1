"""LAMMPS' ``dump netcdf`` (AMBER's convention): frames of one number of atoms, by netCDF4."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import has_radius
from scanfab.io.fence import fenced, needed
from scanfab.io.formats.dump import Dump
from scanfab.io.formats.shared import cell_of, numbered_frames
from scanfab.io.reader import Carries, FileKind, ReadOptions, Snapshot
from scanfab.io.text import Columns
from scanfab.packing.cell import Cell

carries: Carries = "cell"
# classic, with long offsets, with long data; HDF5 is told apart by its content
MAGIC = (b"CDF\x01", b"CDF\x02", b"CDF\x05")
# AMBER's name of each triple, and whether its values are fractions of the box
POSITIONS = {"coordinates": False, "unwrapped_coordinates": False, "scaled_coordinates": True}
CELL = ("cell_origin", "cell_lengths", "cell_angles")
# what netCDF reads where nothing was written: atoms that were lost, or left their group
FILL = {"f4": 9.9692099683868690e36, "f8": 9.9692099683868690e36, "i4": -(2**31) + 1}
FILL_LONG = -(2**63) + 2


class Contents(NamedTuple):
    """What a file holds of one frame, or (names and times alone) of all."""

    names: list[str]
    """Of all variables."""
    times: FloatArray
    """Of all frames, as they are stored."""
    scale: float | None
    """By which the times are multiplied, if the file says so."""
    program: str
    atoms: Columns
    """The frame's variables with a value, or several, for each atom."""
    others: Columns


def fits(head: bytes) -> bool:
    """Whether a file is NetCDF, of the kinds that LAMMPS writes."""
    return head.startswith(MAGIC)


def kind(path: Path) -> FileKind:
    """Grains, or points without a radius."""
    names = _read(path, None).names
    if not any(name in names for name in POSITIONS):
        return "other"
    return "grains" if has_radius(names) else "points"


def snapshots(path: Path) -> list[Snapshot]:
    """The frames; ``start`` of a snapshot is the number of its frame."""
    file = _read(path, None)
    times, scale = file.times, file.scale
    if len(times) == 0 or not np.all(np.abs(times) < 2.0**53):
        raise ReadError(f"{path}: expected frames with their times, found none")
    # LAMMPS writes the step as time, and the length of a step as its scale
    are_steps = file.program == "LAMMPS" and bool(np.all(times == np.rint(times)))
    scale = 1.0 if scale is None and not are_steps else scale
    steps = [int(time) if are_steps else None for time in times.tolist()]
    seconds = [None if scale is None else time * scale for time in times.tolist()]
    return numbered_frames(path, zip(steps, seconds, strict=True))


def read(snapshot: Snapshot, options: ReadOptions) -> Dump:
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
    columns = {name: values[there] for name, values in file.atoms.items()}
    found = [name for name in POSITIONS if name in columns]
    for name in found:
        position = columns.pop(name)
        if name == found[0] and position.shape[1:] == (3,):
            columns["position"] = doubles(position)
    if found and POSITIONS[found[0]]:
        if cell is None:
            raise ReadError(f"{path}: {found[0]} are fractions of a box, but there is no box")
        columns["position"] = cell.origin + columns["position"] @ cell.vectors
    return Dump(list(columns), columns, cell)


def _read(path: Path, frame: int | None) -> Contents:
    needed(path, "netCDF4", "netcdf")
    return fenced(read_in_worker, path, frame)


def read_in_worker(path: str, frame: int | None) -> Contents:
    """The variables of a frame; ValueError says why it cannot be read."""
    import netCDF4

    atoms: Columns = {}
    others: Columns = {}
    with netCDF4.Dataset(path, "r") as file:
        # what was never written must be seen as it is
        file.set_auto_maskandscale(False)
        time = file.variables["time"] if "frame" in file.dimensions else np.zeros(0)
        if frame is not None and not 0 <= frame < len(time):
            raise ValueError(f"there is no frame {frame} among {len(time)}")
        for name, variable in file.variables.items() if frame is not None else ():
            dimensions, kind = variable.dimensions, np.dtype(variable.dtype).kind
            if dimensions[:1] == ("frame",) and kind in "iuf":
                values = np.asarray(variable[frame])
                group = atoms if dimensions[1:2] == ("atom",) else others
                group[name] = values.astype(values.dtype.newbyteorder("="))
        scale = getattr(time, "scale_factor", None)
        return Contents(
            list(file.variables),
            np.asarray(time[:], np.float64),
            None if scale is None else float(scale),
            str(getattr(file, "program", "")),
            atoms,
            others,
        )


def _written(path: Path, atoms: Columns) -> npt.NDArray[np.bool_]:
    """Which atoms were written: LAMMPS leaves those behind the last one of a frame as they are."""
    empty = []
    for values in atoms.values():
        is_fill = values == FILL.get(values.dtype.str[1:], FILL_LONG)
        empty.append(is_fill.any(axis=tuple(range(1, values.ndim))))
    lost: npt.NDArray[np.bool_] = np.all(empty, axis=0)
    for name, column in zip(atoms, empty, strict=True):
        if np.any(column & ~lost):
            told = "dump all three of x y z, and close the file before it is read"
            raise ReadError(f"{path}: {name} was not written for all atoms: {told}")
    return np.logical_not(lost)


@np.errstate(invalid="ignore", over="ignore", divide="ignore")
def _cell(path: Path, arrays: Columns) -> Cell | None:
    """Three edges and angles; along an edge of length 0 the sample is not periodic."""
    if not all(name in arrays and arrays[name].shape == (3,) for name in CELL):
        return None
    origin, edges, angles = (doubles(arrays[name]) for name in CELL)
    periodic = edges > 0
    if not periodic.any():
        return None
    # any length will do along an axis that is not periodic
    edges = np.where(periodic, edges, edges.max())
    # cos 90° is zero, which rounding would make a tilt
    alpha, beta, gamma = np.where(angles == 90.0, 0.0, np.cos(np.radians(angles)))
    sine = np.sqrt(1.0 - gamma**2)
    xy = (alpha - beta * gamma) / sine
    # the first vector along x, the second in the plane x-y
    rows = [[1, 0, 0], [gamma, sine, 0], [beta, xy, np.sqrt(1.0 - beta**2 - xy**2)]]
    return cell_of(f"{path}: {', '.join(CELL)}", np.array(rows) * edges[:, None], periodic, origin)
