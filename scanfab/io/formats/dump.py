"""What all dumps of LIGGGHTS and LAMMPS have in common: a box, and columns with names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table
from scanfab.io.formats.shared import cell_of
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Columns
from scanfab.packing.cell import Cell


class Dump(NamedTuple):
    """One snapshot of any dump."""

    names: list[str]
    """Of all columns. Their numbers from 1 if the dump does not name them."""
    columns: Columns
    """Shape (N,) each. Of columns with the same name this is the first."""
    cell: Cell | None


def numbers_as_names(width: int) -> list[str]:
    """The names of columns that have none."""
    return [f"{place + 1}" for place in range(width)]


def dump_grains(snapshot: Snapshot, dump: Dump, options: ReadOptions) -> GrainTable:
    """The grains of a snapshot; ReadError if the columns have no names and users give none."""
    path, columns = snapshot.path, dump.columns
    if "1" in columns:
        if not options.columns:
            raise ReadError(
                f"{path}: this dump does not name its {len(columns)} columns: name them as the "
                f"deck lists them, by their numbers from 1: "
                f'`columns="id=1,type=2,x=3,y=4,z=5,radius=6"`'
            )
        options = replace(options, columns={key: str(own) for key, own in options.columns.items()})
    # LAMMPS called ids so until 2008
    if "tag" in columns and "id" not in {*columns, *options.columns}:
        columns["id"] = columns.pop("tag")
    where = "" if snapshot.step is None else f", step {snapshot.step}"
    return grain_table(path, columns, dump.cell, options, where)


@np.errstate(over="ignore", invalid="ignore")
def box_cell(
    where: str | Path,
    bounds: FloatArray,
    periodic: tuple[bool, bool, bool],
    *,
    is_around: bool = True,
) -> Cell | None:
    """
    The cell of a box; None if the box has no volume and is not periodic.

    Parameters
    ----------
    where : str or Path
        The beginning of error messages.
    bounds : ndarray, shape (3, 2), (3, 3) or (3, 4)
        The lower and the upper bound of each axis, then the tilt (xy, xz, yz) if there is one. Or
        three vectors (rows) with the coordinates of the origin behind them. Dump's length unit.
    periodic : tuple of bool
        Along which vectors the box repeats.
    is_around : bool, optional
        Whether the bounds are those of the box *around* the tilted box, as in dumps. Data files
        have the bounds of the box before it was tilted.

    Raises
    ------
    ReadError
        If the box is periodic and has no volume.
    """
    if bounds.shape[1] == 4:
        return cell_of(where, bounds[:, :3], periodic, bounds[:, 3])
    low, high = bounds[:, 0], bounds[:, 1]
    xy, xz, yz = bounds[:, 2] if bounds.shape[1] == 3 else np.zeros(3)
    if is_around:
        low = low - [min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0]
        high = high - [max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0]
    edges = high - low
    vectors = np.diag(edges)
    vectors[[1, 2, 2], [0, 0, 1]] = xy, xz, yz
    return cell_of(where, np.zeros((3, 3)) if np.any(edges <= 0) else vectors, periodic, low)
