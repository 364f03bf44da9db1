"""Kratos' DEM application: ``.mdpa`` input, and HDF5 files with a group for each time."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly, numbered_frames
from scanfab.io.hdf import is_hdf, read_hdf_file
from scanfab.io.reader import Carries, FileKind, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

START = re.compile(rb"^[ \t]*Begin[ \t]+(?:ModelPartData|Properties|Nodes|Table)\b", re.MULTILINE)
COMMENT = re.compile(rb"//[^\n]*")
# the first and the last line of a block, which may hold others
BORDER = re.compile(rb"^[ \t]*(Begin|End)[ \t]+([^\r\n]*?)[ \t]*\r?\n?$", re.MULTILINE)
NODES, RADII, ELEMENTS = "Nodes", "NodalData RADIUS", "Elements"
# the columns of the blocks; the second one of radii says whether the value is fixed
LAYOUTS = {
    NODES: Layout(("id", "x", "y", "z"), whole=["id"]),
    RADII: Layout(("id", "fixed", "radius"), whole=["id"]),
    ELEMENTS: Layout(("element", "properties", "id"), whole=["id"]),
}
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
        is_ours = self.recognises(path)
        has_radii = is_ours and (is_hdf(first_bytes(path)) or _blocks(path, RADII)[1])
        return "grains" if has_radii else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, or the groups with their times; ``start`` is then the number of the group."""
        if not is_hdf(first_bytes(path)):
            return [Snapshot(path)]
        return numbered_frames(path, ((None, time) for _, time in _groups(path)))

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """Nodes with a radius; the arrays of a group."""
        path = snapshot.path
        if not is_hdf(first_bytes(path)):
            return _spheres(path), None
        names = [name for name, _ in _groups(path)][snapshot.start : snapshot.stop]
        own = {} if not names else read_hdf_file(path).below(names[0])
        shapes = {values.shape for values in own.values()}
        if len(shapes) != 1 or len(shapes.pop()) != 1:
            raise ReadError(f"{path}: group {' '.join(names)}: expected columns of one length")
        return own, None


def _groups(path: Path) -> list[tuple[str, float | None]]:
    """The groups at the top that hold grains, in the order of their numbers, with their times."""
    file = read_hdf_file(path, with_data=False)
    found = []
    for name, attributes in file.attributes.items():
        if "/" not in name and name.isdecimal() and file.below(name).keys() >= DATASETS:
            time = attributes.get("time")
            found.append((name, float(time) if isinstance(time, int | float) else None))
    return sorted(found, key=lambda one: int(one[0]))


def _blocks(path: Path, kind: str) -> tuple[bytes, list[tuple[str, int, int]]]:
    """The text, and each block of a kind: title, first byte and end. All must be complete."""
    data = COMMENT.sub(b"", text_of(Snapshot(path)))
    found, begun = [], []
    for border in BORDER.finditer(data):
        title = " ".join(border[2].decode("utf-8", "replace").split())
        if border[1] == b"Begin":
            begun.append((title, border.end()))
        elif not begun or begun[-1][0].split()[:1] != title.split()[:1]:
            raise ReadError(f"{path}: expected no {spelt(border[0])} here: a block is incomplete")
        else:
            title, start = begun.pop()
            if f"{title} ".startswith(f"{kind} "):
                found.append((title, start, border.start()))
    if begun:
        raise ReadError(f"{path}: the block {begun[-1][0]} has no end: the file is incomplete")
    return data, found


def _rows(path: Path, kind: str) -> Columns:
    """The rows of all blocks of a kind; elements that are no spheres are refused."""
    data, blocks = _blocks(path, kind)
    layout, parts = LAYOUTS[kind], []
    if not blocks and kind != ELEMENTS:
        raise ReadError(f"{path}: expected a block of {kind}, found none")
    for title, start, stop in blocks:
        if kind == ELEMENTS and ("Particle" not in title or "Cluster" in title):
            raise ReadError(
                f"{path}: expected elements that are spheres, found {title}: their shapes lie in "
                f"other files"
            )
        layout = layout._replace(line=data.count(b"\n", 0, start) + 1)
        parts.append(read_rows(Snapshot(path), data[start:stop], layout, what=kind))
    parts = parts or [dict.fromkeys(layout.names, np.zeros(0))]
    return {name: np.concatenate([part[name] for part in parts]) for name in layout.names}


def _spheres(path: Path) -> Columns:
    """The nodes that have a radius, in the order of the radii."""
    elements, nodes, radii = (_rows(path, kind) for kind in (ELEMENTS, NODES, RADII))
    lost = np.setdiff1d(radii["id"], nodes["id"])
    if len(lost):
        raise ReadError(f"{path}: the node {lost[0]} has a radius, but no place among the nodes")
    lost = np.setdiff1d(elements["id"], radii["id"])
    if len(lost):
        raise ReadError(
            f"{path}: the sphere at node {lost[0]:g} and {len(lost) - 1} more have no radius in "
            f"{RADII}"
        )
    order = np.argsort(nodes["id"], kind="stable")
    row = order[np.searchsorted(nodes["id"][order], radii["id"])]
    places = {axis: nodes[axis][row] for axis in "xyz"}
    return {"id": radii["id"], **places, "radius": radii["radius"]}
