"""
GSD, the file format of HOOMD-blue.

A property that was never written has HOOMD's default value. The default diameter is 1, which is
hardly ever meant; therefore a file without diameters counts as having no radii.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.base.typing import Columns
from scanfab.io.fence import fenced
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbered_frames
from scanfab.io.reader import Snapshot
from scanfab.packing.cell import Cell

# the first eight bytes of each file
MAGIC = (0x65DF65DF65DF65DF).to_bytes(8, "little")


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
        columns, (*box, dimensions) = fenced(frame_in_worker, path, snapshot.start)
        columns["position"] = columns["position"].astype(np.float64)
        flat = dimensions == 2
        # edges and tilt factors (of the second and third edge); the box is centred at the origin
        lx, ly, lz, xy, xz, yz = box
        if flat:
            # in 2D the edge along z has no meaning, and may be 0
            lz, xz, yz = max(lx, ly), 0.0, 0.0
        vectors = np.array([[lx, 0, 0], [xy * ly, ly, 0], [xz * lz, yz * lz, lz]])
        origin = -0.5 * vectors.sum(axis=0)
        return columns, cell_of(f"{where}: its box", vectors, (True, True, not flat), origin)


def contents_in_worker(path: str) -> tuple[list[int], list[str]]:
    """The steps of all frames, and the names of all arrays."""
    import gsd.hoomd

    with gsd.hoomd.open(path) as file:
        steps = gsd.hoomd.read_log(path, glob_pattern="configuration/step")["configuration/step"]
        return steps.tolist(), file.file.find_matching_chunk_names("particles/")


def frame_in_worker(path: str, number: int) -> tuple[Columns, list[float]]:
    """The arrays of the particles of one frame, the edges and tilt factors, and the dimensions."""
    import gsd.hoomd

    with gsd.hoomd.open(path) as file:
        frame, written = file[number], file.file.find_matching_chunk_names("particles/")
    names = {name.rpartition("/")[2] for name in written} - {"N", "types"}
    columns = {name: getattr(frame.particles, name) for name in names}
    logged = {k.rpartition("/")[2]: v for k, v in frame.log.items() if k.startswith("particles/")}
    return columns | logged, [*frame.configuration.box, frame.configuration.dimensions]
