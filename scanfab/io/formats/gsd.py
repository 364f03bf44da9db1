"""
GSD, the files of HOOMD-blue.

A property that was never written has HOOMD's default value. The default diameter is 1, which nobody
means, so a file without diameters has no radii.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.io.columns import has_radius
from scanfab.io.fence import fenced, needed
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbered_frames
from scanfab.io.reader import FileKind, Snapshot
from scanfab.io.text import Columns
from scanfab.packing.cell import Cell

# the first eight bytes of a file
MAGIC = (0x65DF65DF65DF65DF).to_bytes(8, "little")
STEP, PARTICLES = "configuration/step", "particles/"
GROUPS = (PARTICLES, "configuration/", "log/particles/")


class GsdReader(GrainsOnly):
    """Reader plugin for GSD."""

    name = "gsd"
    description = "GSD of HOOMD-blue: centres, diameters, bodies, box"
    extensions: tuple[str, ...] = (".gsd",)
    requires = ("gsd", '"scanfab[gsd]"')

    def recognises(self, path: Path) -> bool:
        """By the first bytes."""
        return first_bytes(path, len(MAGIC)) == MAGIC

    def kind(self, path: Path) -> FileKind:
        """Grains, or points if no diameters were ever written."""
        if not self.recognises(path):
            return "other"
        return "grains" if has_radius([_bare(name) for name in _read(path, None)[1]]) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames with their steps; ``start`` of a snapshot is the number of its frame."""
        return numbered_frames(path, ((step, None) for step in _read(path, None)[0]))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """What the frame, or else the first one, has of each particle."""
        path = snapshot.path
        _, _, arrays = _read(path, snapshot.start)
        count = arrays.pop("particles/N", np.zeros(0)).tolist()
        position = arrays.pop("particles/position", np.zeros((0, 3), np.float32))
        if position.shape[1:] != (3,) or (count and [len(position)] != count):
            found = f"{count} particles, but positions of shape {position.shape}"
            raise ReadError(f"{path}, frame {snapshot.start}: {found}")
        columns: Columns = {"position": position.astype(np.float64)}
        for name, values in arrays.items():
            # the first frame may have had another number of particles; types are texts
            is_column = PARTICLES in name and name != "particles/types"
            if is_column and len(values) == len(position):
                columns[_bare(name)] = values
        box, where = arrays.get("configuration/box"), f"{path}: configuration/box"
        if box is None:
            return columns, None
        if box.shape != (6,):
            raise ReadError(f"{where}: expected six numbers, found {box.tolist()}")
        # edges and tilt factors (of the second and third edge), about the origin
        lx, ly, lz, xy, xz, yz = box.astype(np.float64).tolist()
        flat = arrays.get("configuration/dimensions", np.array([3])).tolist() == [2]
        if flat:
            # the edge across the plane means nothing, and may be 0
            lz, xz, yz = max(lx, ly), 0.0, 0.0
        vectors = np.array([[lx, 0, 0], [xy * ly, ly, 0], [xz * lz, yz * lz, lz]])
        along = (True, True, not flat)
        return columns, cell_of(where, vectors, along, -0.5 * vectors.sum(axis=0))


def _read(path: Path, frame: int | None) -> tuple[list[int], list[str], Columns]:
    needed(path, "gsd", "gsd")
    return fenced(read_in_worker, path, frame)


def read_in_worker(path: str, frame: int | None) -> tuple[list[int], list[str], Columns]:
    """
    The steps of all frames and the names of all arrays; the arrays of a frame if one is given.

    ValueError says why a file cannot be read.
    """
    import gsd.fl

    with gsd.fl.open(path, mode="r") as file:
        if file.schema != "hoomd":
            raise ValueError(f"its schema is {file.schema!r}, expected 'hoomd'")
        names = [name for name in file.find_matching_chunk_names("") if name.startswith(GROUPS)]

        def array(number: int, name: str) -> npt.NDArray[Any]:
            """What does not change is written in the first frame only; texts if not even there."""
            own = [one for one in (number, 0) if file.chunk_exists(frame=one, name=name)]
            return np.asarray(file.read_chunk(frame=own[0], name=name) if own else "")

        if frame is None:
            steps = (array(number, STEP) for number in range(file.nframes))
            return [int(step.item() or 0) for step in steps], names, {}
        found = {name: array(frame, name) for name in names}
        return [], names, {name: own for name, own in found.items() if own.dtype.kind in "biuf"}


def _bare(name: str) -> str:
    return name.removeprefix("log/").removeprefix(PARTICLES)
