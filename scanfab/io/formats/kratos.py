"""Kratos' DEM application: ``.mdpa`` input, and HDF5 files with a group for each time."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.binary_files import is_hdf, read_hdf_file
from scanfab.io.files import Stamp, first_bytes, stamp_of
from scanfab.io.formats.shared import GrainsOnly, numbered_frames
from scanfab.io.mesh import joined_arrays
from scanfab.io.reader import Carries, FileKind, Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

START = re.compile(rb"^[ \t]*Begin[ \t]+(?:ModelPartData|Properties|Nodes|Table)\b", re.MULTILINE)
COMMENT = re.compile(rb"//[^\n]*")
BORDER = re.compile(rb"^[ \t]*(Begin|End)\b", re.MULTILINE)
# a block: its kind, the rest of its first line, and its rows
BLOCK = re.compile(
    rb"^[ \t]*Begin[ \t]+(Nodes|NodalData[ \t]+RADIUS|Elements)\b([^\n]*)\n(.*?)^[ \t]*End\b",
    re.MULTILINE | re.DOTALL,
)
# the columns of these blocks; `fixed` says whether Kratos may change the value
COLUMNS = {
    "Nodes": ("id", "x", "y", "z"),
    "NodalData RADIUS": ("id", "fixed", "radius"),
    "Elements": ("element", "properties", "id"),
}
RADII = re.compile(rb"^[ \t]*Begin[ \t]+NodalData[ \t]+RADIUS\b", re.MULTILINE)
# the datasets that a group of grains in HDF5 must have
DATASETS = {"id", "x", "y", "z", "radius"}


class KratosReader(GrainsOnly):
    """Reader plugin for Kratos DEM."""

    name = "kratos"
    description = "Kratos DEM: .mdpa (nodes with a RADIUS), HDF5 with groups of x y z radius"
    extensions: tuple[str, ...] = (".mdpa", ".hdf5", ".h5")
    has_cell: Carries = "nothing"

    def recognises(self, path: Path) -> bool:
        """Recognised by the blocks of ``.mdpa``, or the datasets in the groups of an HDF5 file."""
        head = first_bytes(path)
        if is_hdf(head):
            return bool(_groups(path))
        return START.search(COMMENT.sub(b"", head)) is not None and b"\x00" not in head

    def kind(self, path: Path) -> FileKind:
        """Grains if nodes have radii; the meshes of walls have none."""
        if not self.recognises(path):
            return "other"
        is_grains = is_hdf(first_bytes(path)) or RADII.search(_text(path))
        return "grains" if is_grains else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One snapshot, or in HDF5 one for each group; ``start`` is the number of the group."""
        if not is_hdf(first_bytes(path)):
            return [Snapshot(path)]
        return numbered_frames(path, ((None, time) for time in _groups(path).values()))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The nodes with a radius, in the order of the radii; in HDF5 the arrays of the group."""
        path = snapshot.path
        if is_hdf(first_bytes(path)):
            name = [*_groups(path)][snapshot.start]
            arrays = read_hdf_file(path, group=name).below(name)
            if any(values.shape != arrays["id"].shape for values in arrays.values()):
                raise ReadError(f"{path}: group {name}: expected columns of one length")
            return arrays, None
        data = _text(path)
        parts: dict[str, list[Columns]] = {kind: [] for kind in COLUMNS}
        for block in BLOCK.finditer(data):
            kind, title = " ".join(block[1].decode().split()), block[2]
            if kind == "Elements" and (b"Particle" not in title or b"Cluster" in title):
                raise ReadError(f"{path}: expected elements that are spheres, found {spelt(title)}")
            line = data.count(b"\n", 0, block.start(3)) + 1
            layout = Layout(COLUMNS[kind], line=line, whole=["id"])
            parts[kind].append(read_rows(snapshot, block[3], layout, what=kind))
        if not (parts["Nodes"] and parts["NodalData RADIUS"]):
            raise ReadError(f"{path}: expected blocks of Nodes and of NodalData RADIUS")
        nodes, radii = joined_arrays(parts["Nodes"]), joined_arrays(parts["NodalData RADIUS"])
        place = {id: row for row, id in enumerate(nodes["id"].tolist())}
        ids = radii["id"].tolist()
        lost = {id for part in parts["Elements"] for id in part["id"].tolist()} - {*ids}
        lost |= {*ids} - place.keys()
        if lost:
            nodes_lost = f"{len(lost)} nodes, such as {min(lost)}"
            raise ReadError(f"{path}: no place or RADIUS for {nodes_lost}")
        rows = np.array([place[id] for id in ids], dtype=int)
        places = {axis: nodes[axis][rows] for axis in "xyz"}
        return {"id": radii["id"], **places, "radius": radii["radius"]}, None


def _groups(path: Path) -> dict[str, float | None]:
    """The top groups that hold grains, in the order of their numbers, and their times."""
    return _groups_at(path, stamp_of(path))


@lru_cache(maxsize=1)
def _groups_at(path: Path, _stamp: Stamp) -> dict[str, float | None]:
    """The groups of a file as it was at some moment: a series asks for them at each frame."""
    file, times = read_hdf_file(path, with_data=False), {}
    for name in sorted(filter(str.isdecimal, file.attributes), key=int):
        if file.below(name).keys() >= DATASETS:
            time = file.attributes[name].get("time")
            times[name] = float(time) if isinstance(time, int | float) else None
    return times


def _text(path: Path) -> bytes:
    """The text without comments; ReadError if a block has no end."""
    data = COMMENT.sub(b"", text_of(Snapshot(path)))
    borders = BORDER.findall(data)
    if borders.count(b"Begin") != borders.count(b"End"):
        raise ReadError(f"{path}: a block has no end or no beginning: the file is incomplete")
    return data
