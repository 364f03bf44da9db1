"""Kratos' DEM application: ``.mdpa`` input, and HDF5 files with a group for each time."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly, numbered_frames
from scanfab.io.hdf import is_hdf, read_hdf_file
from scanfab.io.mesh import joined_arrays
from scanfab.io.reader import Carries, FileKind, Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

START = re.compile(rb"^[ \t]*Begin[ \t]+(?:ModelPartData|Properties|Nodes|Table)\b", re.MULTILINE)
COMMENT = re.compile(rb"//[^\n]*")
BORDER = re.compile(rb"^[ \t]*(Begin|End)\b", re.MULTILINE)
# what a block holds, which elements these are, and its rows
BLOCK = re.compile(
    rb"^[ \t]*Begin[ \t]+(Nodes|NodalData[ \t]+RADIUS|Elements)\b([^\n]*)\n(.*?)^[ \t]*End\b",
    re.MULTILINE | re.DOTALL,
)
# the columns of these blocks; the second one of radii says whether the value is fixed
COLUMNS = {
    "Nodes": ("id", "x", "y", "z"),
    "NodalData RADIUS": ("id", "fixed", "radius"),
    "Elements": ("element", "properties", "id"),
}
RADII = re.compile(rb"^[ \t]*Begin[ \t]+NodalData[ \t]+RADIUS\b", re.MULTILINE)
# of a group in HDF5
DATASETS = {"id", "x", "y", "z", "radius"}


class KratosReader(GrainsOnly):
    """Reader plugin for Kratos DEM."""

    name = "kratos"
    description = "Kratos DEM: .mdpa (nodes with a RADIUS), HDF5 with groups of x y z radius"
    extensions: tuple[str, ...] = (".mdpa", ".hdf5", ".h5")
    has_cell: Carries = "nothing"

    def recognises(self, path: Path) -> bool:
        """By the blocks of ``.mdpa``, or the datasets in the groups of an HDF5 file."""
        head = first_bytes(path)
        if is_hdf(head):
            return bool(_groups(path))
        return START.search(COMMENT.sub(b"", head)) is not None and b"\x00" not in head

    def kind(self, path: Path) -> FileKind:
        """Grains if nodes have radii; meshes of walls have none."""
        if not self.recognises(path):
            return "other"
        is_grains = is_hdf(first_bytes(path)) or RADII.search(_text(path))
        return "grains" if is_grains else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, or the groups with their times; ``start`` is then the number of the group."""
        if not is_hdf(first_bytes(path)):
            return [Snapshot(path)]
        return numbered_frames(path, ((None, time) for time in _groups(path).values()))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """Nodes with a radius, in the order of the radii; or the arrays of a group."""
        path = snapshot.path
        if is_hdf(first_bytes(path)):
            name = [*_groups(path)][snapshot.start]
            own = read_hdf_file(path).below(name)
            if any(values.shape != own["id"].shape for values in own.values()):
                raise ReadError(f"{path}: group {name}: expected columns of one length")
            return own, None
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
            raise ReadError(f"{path}: no place or RADIUS for {len(lost)} nodes, one is {min(lost)}")
        rows = np.array([place[id] for id in ids], dtype=int)
        places = {axis: nodes[axis][rows] for axis in "xyz"}
        return {"id": radii["id"], **places, "radius": radii["radius"]}, None


def _groups(path: Path) -> dict[str, float | None]:
    """The times of the groups at the top that hold grains, in the order of their numbers."""
    file, found = read_hdf_file(path, with_data=False), {}
    for name in sorted(filter(str.isdecimal, file.attributes), key=int):
        if file.below(name).keys() >= DATASETS:
            time = file.attributes[name].get("time")
            found[name] = float(time) if isinstance(time, int | float) else None
    return found


def _text(path: Path) -> bytes:
    """The text without comments; each block that begins must end."""
    data = COMMENT.sub(b"", text_of(Snapshot(path)))
    borders = BORDER.findall(data)
    if borders.count(b"Begin") != borders.count(b"End"):
        raise ReadError(f"{path}: a block has no end or no beginning: the file is incomplete")
    return data
