"""
GSD, the file format of HOOMD-blue.

A property that was never written has HOOMD's default value. The default diameter is 1, which is
hardly ever meant; therefore a file without diameters counts as having no radii.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import AnyArray, Columns
from scanfab.io.fence import fenced
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbered_frames
from scanfab.io.reader import Snapshot
from scanfab.packing.cell import Cell

# the first eight bytes of each file
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
        """Recognised by the first bytes."""
        return first_bytes(path, len(MAGIC)) == MAGIC

    def names(self, path: Path) -> list[str]:
        """The names of all arrays in all frames; without diameters the file holds points."""
        return [name.rpartition("/")[2] for name in fenced(contents_in_worker, path)[1]]

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames with their steps; ``start`` of a snapshot is the number of its frame."""
        steps, _ = fenced(contents_in_worker, path)
        return numbered_frames(path, ((step, None) for step in steps))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The arrays of the particles in the frame, or in the first frame, and the cell."""
        path, where = snapshot.path, f"{snapshot.path}, frame {snapshot.start}"
        arrays = fenced(arrays_in_worker, path, snapshot.start)
        position = arrays.pop("particles/position", np.zeros((0, 3), np.float32))
        count = arrays.pop("particles/N", np.array([0])).tolist()
        box = arrays.get("configuration/box", np.zeros(0)).astype(np.float64).tolist()
        if position.shape != (*count, 3) or len(box) not in (0, 6):
            expected = f"positions of shape {(*count, 3)} and six numbers as box"
            raise ReadError(f"{where}: expected {expected}, found {position.shape} and {box}")
        # not an array of the first frame with another number of particles; not the names of types
        columns: Columns = {
            name.removeprefix("log/").removeprefix(PARTICLES): values
            for name, values in arrays.items()
            if PARTICLES in name and name != "particles/types" and len(values) == len(position)
        }
        columns["position"] = position.astype(np.float64)
        if not box:
            return columns, None
        # edges and tilt factors (of the second and third edge); the box is centred at the origin
        lx, ly, lz, xy, xz, yz = box
        flat = arrays.get("configuration/dimensions", np.array([3])).tolist() == [2]
        if flat:
            # in 2D the edge along z has no meaning, and may be 0
            lz, xz, yz = max(lx, ly), 0.0, 0.0
        vectors = np.array([[lx, 0, 0], [xy * ly, ly, 0], [xz * lz, yz * lz, lz]])
        origin = -0.5 * vectors.sum(axis=0)
        return columns, cell_of(f"{where}: its box", vectors, (True, True, not flat), origin)


@contextmanager
def _opened(path: str) -> Iterator[tuple[Any, list[str]]]:
    """Open a file, with the names of its arrays; ValueError if HOOMD has not written it."""
    import gsd.fl

    with gsd.fl.open(path, mode="r") as file:
        if file.schema != "hoomd":
            raise ValueError(f"its schema is {file.schema!r}, expected 'hoomd'")
        yield file, [name for name in file.find_matching_chunk_names("") if name.startswith(GROUPS)]


def _array(file: Any, number: int, name: str) -> AnyArray:
    """The array of a frame; if it is constant, of the first frame; else an empty text."""
    frames = [k for k in (number, 0) if file.chunk_exists(frame=k, name=name)]
    return np.asarray(file.read_chunk(frame=frames[0], name=name) if frames else "")


def contents_in_worker(path: str) -> tuple[list[int], list[str]]:
    """The steps of all frames, and the names of all arrays."""
    with _opened(path) as (file, names):
        return [int(_array(file, k, STEP).item() or 0) for k in range(file.nframes)], names


def arrays_in_worker(path: str, frame: int) -> Columns:
    """The arrays of numbers of one frame."""
    with _opened(path) as (file, names):
        found = {name: _array(file, frame, name) for name in names}
    return {name: values for name, values in found.items() if values.dtype.kind in "biuf"}
