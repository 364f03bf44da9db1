"""Kratos' DEM application: ``.mdpa`` input, and HDF5 files with a group for each time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import first_bytes
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.counted_rows import counted_rows, spelt, text_of
from scanfab.io.parse.hdf import is_hdf, read_hdf_file
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)

START = re.compile(rb"^[ \t]*Begin[ \t]+(?:ModelPartData|Properties|Nodes|Table)\b", re.MULTILINE)
COMMENT = re.compile(rb"//[^\n]*")
# the first and the last line of a block, which may hold others
BORDER = re.compile(rb"^[ \t]*(Begin|End)[ \t]+([^\r\n]*?)[ \t]*\r?$")
RADII = b"NodalData RADIUS"
# of a group in HDF5
DATASETS = {"id", "x", "y", "z", "radius"}


class KratosReader:
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
        """Grains where nodes have radii; meshes of walls have none."""
        if is_hdf(first_bytes(path)):
            return "grains" if _groups(path) else "other"
        if not self.recognises(path):
            return "other"
        blocks = _blocks(path, _plain_text(Snapshot(path)))
        return "grains" if _of_kind(blocks, RADII) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, or the groups with their times; ``start`` is then the number of the group."""
        if not is_hdf(first_bytes(path)):
            return [Snapshot(path)]
        found = []
        for number, (_, attributes) in enumerate(_groups(path)):
            time = attributes.get("time")
            seconds = float(time) if isinstance(time, int | float) else None
            found.append(Snapshot(path, time=seconds, start=number, stop=number + 1))
        if not found:
            raise ReadError(f"{path}: expected groups with id, x, y, z and radius, found none")
        return found

    def carries(self, path: Path) -> Carries:
        """It has no cell."""
        return "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Nodes with a radius; the arrays of a group."""
        if is_hdf(first_bytes(snapshot.path)):
            return _read_group(snapshot, options)
        return _read_mdpa(snapshot, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It has none."""
        raise ReadError(f"{snapshot.path}: these files of Kratos hold no contacts")


def _groups(path: Path) -> list[tuple[str, dict[str, object]]]:
    """The groups at the top that hold grains, in the order of their numbers."""
    file = read_hdf_file(path, with_data=False)
    found = [
        (name, file.attributes[name])
        for name in file.attributes
        if "/" not in name and name.isdecimal() and file.below(name).keys() >= DATASETS
    ]
    return sorted(found, key=lambda one: int(one[0]))


def _read_group(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    path = snapshot.path
    groups = _groups(path)
    if snapshot.start >= len(groups):
        raise ReadError(f"{path}: there is no group {snapshot.start} among {len(groups)}")
    name = groups[snapshot.start][0]
    own = read_hdf_file(path).below(name)
    shapes = {values.shape for values in own.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1:
        raise ReadError(f"{path}: group {name}: expected columns of one length, found {shapes}")
    return grain_table(path, own, None, options, f", group {name}")


def _plain_text(snapshot: Snapshot) -> bytes:
    """Without comments."""
    data = text_of(snapshot)
    return COMMENT.sub(b"", data) if b"//" in data else data


Block = tuple[list[bytes], int, int]


def _borders(data: bytes) -> Iterator[tuple[re.Match[bytes], int, int]]:
    """The lines that begin or end a block, with their first byte and the one behind the last."""
    place = 0
    nearest = dict.fromkeys((b"Begin", b"End"), -2)
    while True:
        for word, found in nearest.items():
            if found != -1 and found < place:
                nearest[word] = data.find(word, place)
        found = min((one for one in nearest.values() if one >= 0), default=-1)
        if found < 0:
            return
        start = data.rfind(b"\n", 0, found) + 1
        place = data.find(b"\n", found) + 1 or len(data)
        border = BORDER.match(data[start:place].rstrip(b"\n"))
        if border is not None:
            yield border, start, place


def _blocks(path: Path, data: bytes) -> list[Block]:
    """The words of each block's title, and where its rows stand."""
    found: list[Block] = []
    begun: list[tuple[list[bytes], int]] = []
    for border, start, stop in _borders(data):
        words = border[2].split() or [b""]
        if border[1] == b"Begin":
            begun.append((words, stop))
            continue
        if not begun or begun[-1][0][0] != words[0]:
            raise ReadError(f"{path}: expected no {spelt(border[0])} here: a block is incomplete")
        title, first = begun.pop()
        found.append((title, first, start))
    if begun:
        last = b" ".join(begun[-1][0])
        raise ReadError(f"{path}: the block {spelt(last)} has no end: the file is incomplete")
    return found


def _of_kind(blocks: list[Block], kind: bytes) -> list[Block]:
    words = kind.split()
    return [one for one in blocks if one[0][: len(words)] == words]


def _read_mdpa(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    path, data = snapshot.path, _plain_text(snapshot)
    blocks = _blocks(path, data)
    elements = _of_kind(blocks, b"Elements")
    for title, _, _ in elements:
        kind = b" ".join(title[1:]).decode("utf-8", "replace")
        if "Particle" not in kind or "Cluster" in kind:
            raise ReadError(
                f"{path}: expected elements that are spheres, found {kind}: their shapes lie in "
                f"other files"
            )
    nodes = _rows(snapshot, data, _of_kind(blocks, b"Nodes"), 4, "nodes")
    radii = _rows(snapshot, data, _of_kind(blocks, RADII), 3, RADII.decode())
    row = _rows_of(path, nodes[:, 0], radii[:, 0])
    columns: dict[str, npt.NDArray[np.float64]] = {
        "id": radii[:, 0],
        **dict(zip("xyz", nodes[row, 1:].T, strict=True)),
        # the second column says whether the value is fixed
        "radius": radii[:, 2],
    }
    if elements:
        spheres = _rows(snapshot, data, elements, 3, "elements")[:, 2]
        lost = spheres[~np.isin(spheres, radii[:, 0])]
        if len(lost):
            raise ReadError(
                f"{path}: the sphere at node {lost[0]:g} and {len(lost) - 1} more have no radius "
                f"in {RADII.decode()}"
            )
    return grain_table(path, columns, None, options)


def _rows(
    snapshot: Snapshot,
    data: bytes,
    blocks: list[Block],
    width: int,
    names: str,
) -> FloatArray:
    """The rows of all blocks of a kind."""
    parts = [
        counted_rows(snapshot, data, start, end, widths=(width,), names=names)
        for _, start, end in blocks
    ]
    if not parts:
        raise ReadError(f"{snapshot.path}: expected a block of {names}, found none")
    return np.concatenate(parts)


def _rows_of(path: Path, nodes: FloatArray, wanted: FloatArray) -> npt.NDArray[np.int64]:
    """The rows of the nodes with these numbers."""
    order = np.argsort(nodes, kind="stable")
    place = np.searchsorted(nodes[order], wanted)
    known = place < len(nodes)
    rows = order[place[known]]
    known[known] = nodes[rows] == wanted[known]
    if not known.all():
        raise ReadError(
            f"{path}: the node {wanted[~known][0]:g} has a radius, but no place among the nodes"
        )
    return rows.astype(np.int64)
