"""Kratos' DEM application: ``.mdpa`` input, and HDF5 files with a group for each time."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.columns import grain_table
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly
from scanfab.io.parse.hdf import is_hdf, read_hdf_file
from scanfab.io.reader import Carries, FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, spelt, text_of

START = re.compile(rb"^[ \t]*Begin[ \t]+(?:ModelPartData|Properties|Nodes|Table)\b", re.MULTILINE)
COMMENT = re.compile(rb"//[^\n]*")
# the first and the last line of a block, which may hold others
BORDER = re.compile(rb"^[ \t]*(Begin|End)[ \t]+([^\r\n]*?)[ \t]*\r?\n?$", re.MULTILINE)
NODES, RADII, ELEMENTS = b"Nodes", b"NodalData RADIUS", b"Elements"
# the columns of the blocks; the second one of radii says whether the value is fixed
LAYOUTS = {
    NODES: Layout(("id", "x", "y", "z"), whole=["id"]),
    RADII: Layout(("id", "fixed", "radius"), whole=["id"]),
    ELEMENTS: Layout(("element", "properties", "node"), whole=["node"]),
}
# of a group in HDF5
DATASETS = {"id", "x", "y", "z", "radius"}


class KratosReader(GrainsOnly):
    """Reader plugin for Kratos DEM."""

    name = "kratos"
    description = "Kratos DEM: .mdpa (nodes with a RADIUS), HDF5 with groups of x y z radius"
    extensions: tuple[str, ...] = (".mdpa", ".hdf5", ".h5")

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
        if is_hdf(first_bytes(path)):
            return "grains"
        return "grains" if _blocks(path, _plain_text(path), RADII) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, or the groups with their times; ``start`` is then the number of the group."""
        if not is_hdf(first_bytes(path)):
            return [Snapshot(path)]
        groups = _groups(path)
        if not groups:
            raise ReadError(f"{path}: expected groups with id, x, y, z and radius, found none")
        return [
            Snapshot(path, time=time, start=number, stop=number + 1)
            for number, (_, time) in enumerate(groups)
        ]

    def carries(self, path: Path) -> Carries:
        """It has no cell."""
        return "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Nodes with a radius; the arrays of a group."""
        path = snapshot.path
        if not is_hdf(first_bytes(path)):
            return grain_table(path, _nodes(path), None, options)
        groups = _groups(path)
        if snapshot.start >= len(groups):
            raise ReadError(f"{path}: there is no group {snapshot.start} among {len(groups)}")
        name = groups[snapshot.start][0]
        own = read_hdf_file(path).below(name)
        shapes = {values.shape for values in own.values()}
        if len(shapes) != 1 or len(shapes.pop()) != 1:
            raise ReadError(f"{path}: group {name}: expected columns of one length")
        return grain_table(path, own, None, options, f", group {name}")


def _groups(path: Path) -> list[tuple[str, float | None]]:
    """The groups at the top that hold grains, in the order of their numbers, with their times."""
    file = read_hdf_file(path, with_data=False)
    found = []
    for name, attributes in file.attributes.items():
        if "/" not in name and name.isdecimal() and file.below(name).keys() >= DATASETS:
            time = attributes.get("time")
            found.append((name, float(time) if isinstance(time, int | float) else None))
    return sorted(found, key=lambda one: int(one[0]))


def _plain_text(path: Path) -> bytes:
    """Without comments."""
    data = text_of(Snapshot(path))
    return COMMENT.sub(b"", data) if b"//" in data else data


def _blocks(path: Path, data: bytes, kind: bytes) -> list[tuple[bytes, int, int]]:
    """The blocks of a kind: title, first byte and end of the rows. All blocks must be complete."""
    found, begun = [], []
    for border in BORDER.finditer(data):
        words = border[2].split()
        if border[1] == b"Begin":
            begun.append((words, border.end()))
            continue
        if not begun or begun[-1][0][:1] != words[:1]:
            raise ReadError(f"{path}: expected no {spelt(border[0])} here: a block is incomplete")
        title, start = begun.pop()
        if title[: len(kind.split())] == kind.split():
            found.append((b" ".join(title), start, border.start()))
    if begun:
        last = spelt(b" ".join(begun[-1][0]))
        raise ReadError(f"{path}: the block {last} has no end: the file is incomplete")
    return found


def _rows(path: Path, data: bytes, kind: bytes) -> Columns:
    """The rows of all blocks of a kind."""
    blocks = _blocks(path, data, kind)
    if not blocks:
        raise ReadError(f"{path}: expected a block of {kind.decode()}, found none")
    layout, parts = LAYOUTS[kind], []
    for _, start, stop in blocks:
        layout = layout._replace(line=data.count(b"\n", 0, start) + 1)
        parts.append(read_rows(Snapshot(path), data[start:stop], layout, what=kind.decode()))
    return {name: np.concatenate([part[name] for part in parts]) for name in layout.names}


def _nodes(path: Path) -> Columns:
    """The nodes that have a radius, in the order of the radii."""
    data = _plain_text(path)
    elements = _blocks(path, data, ELEMENTS)
    for title, _, _ in elements:
        if b"Particle" not in title or b"Cluster" in title:
            raise ReadError(
                f"{path}: expected elements that are spheres, found {title.decode()}: their "
                f"shapes lie in other files"
            )
    nodes, radii = _rows(path, data, NODES), _rows(path, data, RADII)
    lost = np.setdiff1d(radii["id"], nodes["id"])
    if len(lost):
        raise ReadError(f"{path}: the node {lost[0]} has a radius, but no place among the nodes")
    lost = np.setdiff1d(_rows(path, data, ELEMENTS)["node"] if elements else [], radii["id"])
    if len(lost):
        raise ReadError(
            f"{path}: the sphere at node {lost[0]:g} and {len(lost) - 1} more have no radius in "
            f"{RADII.decode()}"
        )
    order = np.argsort(nodes["id"], kind="stable")
    row = order[np.searchsorted(nodes["id"][order], radii["id"])]
    places = {axis: nodes[axis][row] for axis in "xyz"}
    return {"id": radii["id"], **places, "radius": radii["radius"]}
