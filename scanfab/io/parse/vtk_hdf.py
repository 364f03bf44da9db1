"""VTKHDF files (``.vtkhdf``): one PolyData or one grid of cells, or blocks of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.typing import IntArray
from scanfab.io.files import plain
from scanfab.io.parse.fence import fenced
from scanfab.io.parse.vtk_data import Arrays, Cells, Content, FlawError, joined

MAGIC = b"\x89HDF\r\n\x1a\n"
GROUP = "VTKHDF"
BLOCKS = ("MultiBlockDataSet", "PartitionedDataSetCollection")
SECTIONS = {"Vertices": "Verts", "Lines": "Lines", "Polygons": "Polys", "Strips": "Strips"}


class HdfFile(NamedTuple):
    """Arrays and attributes of a file, by the paths of their groups and datasets."""

    arrays: dict[str, npt.NDArray[Any]]
    attributes: dict[str, dict[str, Any]]

    def below(self, group: str) -> dict[str, npt.NDArray[Any]]:
        """The arrays in a group itself, by their names."""
        start = f"{group}/"
        return {
            name.removeprefix(start): values
            for name, values in self.arrays.items()
            if name.startswith(start) and "/" not in name.removeprefix(start)
        }

    def groups(self, group: str) -> list[str]:
        """The names of the groups in a group."""
        start = f"{group}/"
        return [
            name.removeprefix(start)
            for name in self.attributes
            if name.startswith(start)
            and "/" not in name.removeprefix(start)
            and name not in self.arrays
        ]


def is_hdf(head: bytes) -> bool:
    """Whether a file starts as HDF5 does."""
    return head.startswith(MAGIC)


def read_hdf_file(path: Path, with_data: bool = True) -> HdfFile:
    """All arrays and attributes; without data the arrays are empty, but for their names."""
    return HdfFile(*fenced("hdf", plain(path), path, with_data=with_data))


def form_of_hdf(path: Path) -> str | None:
    """``PolyData``, ``UnstructuredGrid``, ...; None if it is another HDF5 file."""
    head = read_hdf_file(path, with_data=False)
    return head.attributes.get(GROUP, {}).get("Type")


def content_of_hdf(path: Path) -> Content:
    """The content of a file; of several blocks all that have points."""
    return content_of(read_hdf_file(path))


def content_of(file: HdfFile) -> Content:
    """The content of a file whose arrays are at hand."""
    form = file.attributes.get(GROUP, {}).get("Type")
    if form in BLOCKS:
        blocks = [f"{GROUP}/{name}" for name in file.groups(GROUP) if name != "Assembly"]
        return joined([_block(file, one) for one in blocks])
    return _block(file, GROUP)


def _block(file: HdfFile, group: str) -> Content:
    attributes = file.attributes.get(group, {})
    form = attributes.get("Type")
    if form not in ("PolyData", "UnstructuredGrid"):
        raise FlawError(f"{group}: a {form} holds neither grains nor contacts")
    if f"{group}/Steps" in file.attributes:
        raise FlawError(f"{group} holds steps in time: write one file for each")
    own = file.below(group)
    if "Points" not in own or own["Points"].shape[1:] != (3,):
        raise FlawError(f"{group}: expected Points of three coordinates")
    points = doubles(own["Points"])
    counts = own.get("NumberOfPoints", np.array([len(points)]))
    if counts.dtype.kind not in "iu" or int(counts.sum()) != len(points):
        raise FlawError(f"{group}: {len(points)} points, but NumberOfPoints are {counts.tolist()}")
    if form == "PolyData":
        cells = [
            _cells(file.below(f"{group}/{name}"), kind, name, counts)
            for name, kind in SECTIONS.items()
            if f"{group}/{name}" in file.attributes
        ]
    else:
        cells = [_cells(own, "Cells", group, counts)]
    return Content(
        points,
        tuple(cells),
        _flat(file.below(f"{group}/PointData")),
        _flat(file.below(f"{group}/CellData")),
        _flat(file.below(f"{group}/FieldData")),
    )


def _flat(arrays: Arrays) -> Arrays:
    """Arrays of one column as one row of values."""
    return {
        name: values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values
        for name, values in arrays.items()
        if values.ndim
    }


def _cells(own: Arrays, kind: str, name: str, points: npt.NDArray[Any]) -> Cells:
    """The cells of all parts, whose offsets and points begin at 0 in each."""
    offsets, named = _whole(own, "Offsets", name), _whole(own, "Connectivity", name)
    counts, ids = _whole(own, "NumberOfCells", name), _whole(own, "NumberOfConnectivityIds", name)
    if not (len(counts) == len(ids) == len(points)) or min(counts.min(), ids.min()) < 0:
        raise FlawError(f"{name}: counts of {len(counts)}, {len(ids)} and {len(points)} parts")
    if counts.sum() == 0 or len(offsets) == 0:
        ends: IntArray = np.zeros(1, np.int64)
    elif len(offsets) != counts.sum() + len(counts) or ids.sum() != len(named):
        raise FlawError(f"{name}: the offsets of the cells are wrong")
    else:
        parts = np.split(offsets, np.cumsum(counts + 1)[:-1])
        starts = np.cumsum([0, *ids[:-1]])
        ends = np.concatenate(
            [[0], *(part[1:] + start for part, start in zip(parts, starts, strict=True))]
        )
        first = np.repeat(np.cumsum([0, *points[:-1]]), ids)
        named = named + first
    types = None
    if kind == "Cells":
        types = _whole(own, "Types", name)[: len(ends) - 1]
    return Cells(kind, ends, named, types)


def _whole(own: Arrays, key: str, name: str) -> IntArray:
    values = own.get(key)
    if values is None or values.dtype.kind not in "iu" or values.ndim != 1:
        raise FlawError(f"{name}: expected whole numbers in {key}")
    return values.astype(np.int64)
