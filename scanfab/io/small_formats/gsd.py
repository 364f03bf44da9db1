"""
GSD, the files of HOOMD-blue.

A property that was never written has its default in HOOMD, and the default diameter is 1: a file
without diameters has none that could be meant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.fence import fenced, needed
from scanfab.io.files import first_bytes
from scanfab.io.formats.columns import grain_table, has_radius
from scanfab.io.parse.gsd_files import read_gsd
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

# the first eight bytes of a file, least first
MAGIC = (0x65DF65DF65DF65DF).to_bytes(8, "little")
PARTICLES = "particles/"


class GsdReader:
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
        names = _read(path, None)[1]["names"]
        return "grains" if has_radius([_bare(name) for name in names]) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames with their steps; ``start`` of a snapshot is the number of its frame."""
        arrays, words = _read(path, None)
        found = []
        for number in range(words["frames"]):
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
        arrays, _ = _read(path, snapshot.start)
        count = int(_one(path, arrays, "particles/N", 0)) if "particles/N" in arrays else None
        own = {name: values for name, values in arrays.items() if PARTICLES in name}
        position = own.pop("particles/position", np.zeros((0, 3), np.float32))
        if position.shape != (len(position) if count is None else count, 3):
            raise ReadError(
                f"{path}{where}: {count} particles, but positions of shape {position.shape}"
            )
        columns: dict[str, npt.NDArray[Any]] = {"position": position.astype(np.float64)}
        for name, values in own.items():
            # the first frame may have had other particles, or texts such as names of types
            if len(values) == len(position) and name not in ("particles/N", "particles/types"):
                columns[_bare(name)] = values
        return grain_table(path, columns, _cell(path, arrays), options, where)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It has none."""
        raise ReadError(f"{snapshot.path}: GSD holds no contacts")


def _read(path: Path, frame: int | None) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Any]]:
    needed(path, "gsd", "gsd")
    return fenced(read_gsd, path, 1 << 62, frame)


def _bare(name: str) -> str:
    return name.removeprefix("log/").removeprefix(PARTICLES)


def _one(
    path: Path, arrays: dict[str, npt.NDArray[Any]], name: str, default: float
) -> npt.NDArray[Any]:
    values = arrays.get(name, np.array([default]))
    if values.shape != (1,):
        raise ReadError(f"{path}: {name}: expected one number, found {values.shape}")
    one: npt.NDArray[Any] = values[0]
    return one


def _cell(path: Path, arrays: dict[str, npt.NDArray[Any]]) -> Cell | None:
    """Edges and tilt factors (of the second and third edge), about the origin."""
    box = arrays.get("configuration/box")
    if box is None:
        return None
    if box.shape != (6,) or not np.all(np.isfinite(box)):
        raise ReadError(f"{path}: configuration/box: expected six numbers, found {box.tolist()}")
    lx, ly, lz, xy, xz, yz = box.astype(np.float64).tolist()
    flat = _one(path, arrays, "configuration/dimensions", 3) == 2
    if flat:
        # a period across the plane has no meaning, and may be 0
        lz, xz, yz = max(lx, ly), 0.0, 0.0
    vectors = np.array([[lx, 0, 0], [xy * ly, ly, 0], [xz * lz, yz * lz, lz]])
    try:
        return Cell(vectors, (True, True, not flat), -0.5 * vectors.sum(axis=0))
    except PackingError as error:
        raise ReadError(f"{path}: configuration/box: {error}") from None
