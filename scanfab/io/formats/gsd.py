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
from scanfab.io.columns import grain_table, has_radius
from scanfab.io.fence import fenced, needed
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly, cell_of
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

Arrays = dict[str, npt.NDArray[Any]]

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
        _, names, _ = _read(path, None)
        return "grains" if has_radius([_bare(name) for name in names]) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames with their steps; ``start`` of a snapshot is the number of its frame."""
        arrays, _, count = _read(path, None)
        found = []
        for number in range(count):
            step = arrays.get(f"{number}", np.zeros(1, np.int64))
            if step.shape != (1,) or step.dtype.kind not in "iu" or step[0] >= 2**63:
                raise ReadError(f"{path}: frame {number}: expected one whole number as step")
            found.append(Snapshot(path, int(step[0]), start=number, stop=number + 1))
        if not found:
            raise ReadError(f"{path}: expected frames, found none")
        return found

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """What the frame, or else the first one, has of each particle."""
        path, where = snapshot.path, f", frame {snapshot.start}"
        arrays, _, _ = _read(path, snapshot.start)
        count = arrays.pop("particles/N", np.zeros(0))
        position = arrays.pop("particles/position", np.zeros((0, 3), np.float32))
        if position.shape != (*count.tolist(), 3) and (count.size or position.shape[1:] != (3,)):
            raise ReadError(
                f"{path}{where}: {count.tolist()} particles, but positions of shape "
                f"{position.shape}"
            )
        columns: Arrays = {"position": position.astype(np.float64)}
        for name, values in arrays.items():
            # the first frame may have had another number of particles; types are texts
            is_column = PARTICLES in name and name != "particles/types"
            if is_column and len(values) == len(position):
                columns[_bare(name)] = values
        return grain_table(path, columns, _cell(path, arrays), options, where)


def _read(path: Path, frame: int | None) -> tuple[Arrays, list[str], int]:
    needed(path, "gsd", "gsd")
    return fenced(read_in_worker, path, frame)


def read_in_worker(path: str, frame: int | None) -> tuple[Arrays, list[str], int]:
    """
    The arrays of a frame, the names of all arrays, and the number of frames.

    Without a frame the arrays are the steps of all frames, by the numbers of these. ValueError says
    why a file cannot be read.
    """
    import gsd.fl

    arrays: Arrays = {}
    with gsd.fl.open(path, mode="r") as file:
        if file.schema != "hoomd":
            raise ValueError(f"its schema is {file.schema!r}, expected 'hoomd'")
        names = [name for name in file.find_matching_chunk_names("") if name.startswith(GROUPS)]
        for number in range(file.nframes) if frame is None else [frame]:
            for name in [STEP] if frame is None else names:
                # what does not change is written in the first frame only
                for place in (number, 0):
                    if file.chunk_exists(frame=place, name=name):
                        values = np.asarray(file.read_chunk(frame=place, name=name))
                        arrays[f"{number}" if frame is None else name] = values
                        break
        sound = {name: values for name, values in arrays.items() if values.dtype.kind in "biuf"}
        return sound, names, int(file.nframes)


def _bare(name: str) -> str:
    return name.removeprefix("log/").removeprefix(PARTICLES)


def _cell(path: Path, arrays: Arrays) -> Cell | None:
    """Edges and tilt factors (of the second and third edge), about the origin."""
    box = arrays.get("configuration/box")
    if box is None:
        return None
    if box.shape != (6,):
        raise ReadError(f"{path}: configuration/box: expected six numbers, found {box.tolist()}")
    lx, ly, lz, xy, xz, yz = box.astype(np.float64).tolist()
    flat = arrays.get("configuration/dimensions", np.array([3])).tolist() == [2]
    if flat:
        # the edge across the plane means nothing, and may be 0
        lz, xz, yz = max(lx, ly), 0.0, 0.0
    vectors = np.array([[lx, 0, 0], [xy * ly, ly, 0], [xz * lz, yz * lz, lz]])
    origin = -0.5 * vectors.sum(axis=0)
    return cell_of(f"{path}: configuration/box", vectors, (True, True, not flat), origin)
