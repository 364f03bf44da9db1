"""VTK's XML files: PolyData, grids of cells and boxes, all of their pieces."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.typing import IntArray
from scanfab.io.parse.vtk_arrays import LARGE, StoredArray, XmlFile, arrays_in
from scanfab.io.parse.vtk_data import Arrays, Cells, Content, FlawError, joined

# sections of cells, in the order of the rows of cell arrays
CELLS = ("Verts", "Lines", "Polys", "Strips", "Cells")
# cells for each point: grains have no more contacts on average
MOST_CELLS = 32


def read_xml(data: bytes, room: Callable[[int], None] = lambda needed: None) -> Content:
    """
    Read a file, all of its pieces; of a box the points are its two corners.

    Parameters
    ----------
    data : bytes
        The file.
    room : callable, optional
        Called with the bytes that all arrays fill, before any is read; may raise.

    Raises
    ------
    FlawError
        If the file does not hold what its elements promise.
    """
    file = XmlFile(data)
    pieces = [_Piece(file, piece) for piece in file.root.iter("Piece")]
    field = [file.array(one, None, "FieldData") for one in file.field()]
    room(sum(one.bytes for one in pieces) + sum(one.bytes for one in field))
    content = joined([piece.content() for piece in pieces])
    return content._replace(field_arrays={one.name: file.values(one) for one in field if one.name})


def count_rows(data: bytes, section: str, name: str) -> tuple[int, int]:
    """
    How many cells of a section a file counts, and how many rows an array of the cells has.

    Raises
    ------
    FlawError
        If the file does not hold what its elements promise.
    """
    file = XmlFile(data)
    pieces = [_Piece(file, piece) for piece in file.root.iter("Piece")]
    arrays = [one for piece in pieces for one in piece.found.get("CellData", [])]
    rows = [one.length // one.components for one in arrays if one.name == name]
    return sum(piece.counts.get(section, 0) for piece in pieces), sum(rows)


class _Piece:
    """One piece: its arrays, found and measured, then read."""

    def __init__(self, file: XmlFile, element: ElementTree.Element) -> None:
        self.file = file
        counts = {
            name.removeprefix("NumberOf"): file.count(dict(element.attrib), name, "")
            for name in element.attrib
            if name.startswith("NumberOf")
        }
        _check_cell_count(counts)
        self.counts = counts
        self.points = counts.get("Points", 0)
        self.found: dict[str, list[StoredArray]] = {}
        for section in element:
            rows = self._rows(section.tag)
            self.found.setdefault(section.tag, []).extend(
                file.array(
                    one, rows if section.tag not in CELLS else self._listed(one, rows), section.tag
                )
                for one in arrays_in(section)
            )

    def _rows(self, section: str) -> int | None:
        """How many rows the arrays of a section have; None if that is not said."""
        if section in ("PointData", "Points"):
            return self.points
        if section == "CellData":
            return sum(count for name, count in self.counts.items() if name != "Points")
        return self.counts.get(section)

    def _listed(self, element: ElementTree.Element, rows: int | None) -> int | None:
        """Offsets and types have a row for each cell; how many points they have is not said."""
        return rows if element.get("Name", "").lower() in ("offsets", "types") else None

    @property
    def bytes(self) -> int:
        """What all arrays fill."""
        return sum(array.bytes for arrays in self.found.values() for array in arrays)

    # a float may be a NaN that signals when it is cast
    @np.errstate(invalid="ignore")
    def content(self) -> Content:
        """The piece, read."""
        if self.file.root.get("type") == "RectilinearGrid":
            return Content(self._corners(), (), {}, {}, {})
        points = np.zeros((0, 3))
        if self.points:
            flat = [self.file.values(one) for one in self.found.get("Points", [])]
            if not flat:
                raise FlawError("there are no Points")
            if flat[0].shape[1:] != (3,):
                raise FlawError("Points need three components")
            points = doubles(flat[0][: self.points])
        cells = tuple(self._cells(kind) for kind in CELLS if kind in self.found)
        rows = sum(len(one.offsets) - 1 for one in cells)
        return Content(
            points, cells, self._named("PointData", self.points), self._named("CellData", rows), {}
        )

    def _named(self, section: str, rows: int) -> Arrays:
        return {one.name: self._whole(one, rows) for one in self.found.get(section, []) if one.name}

    def _whole(self, array: StoredArray, rows: int) -> npt.NDArray[Any]:
        values: npt.NDArray[Any] = self.file.values(array)
        if len(values) < rows:
            raise FlawError(f"{array.name} has {len(values)} of {rows} rows")
        # YADE writes values of lines that it has lost: who reads them must see how many
        return values

    def _cells(self, kind: str) -> Cells:
        count = self.counts.get(kind, 0)
        arrays = {one.name.lower(): one for one in self.found[kind]}
        if count == 0 or not {"connectivity", "offsets"} <= set(arrays):
            if count:
                raise FlawError(f"{kind} have no connectivity or no offsets")
            none: IntArray = np.zeros(0, np.int64)
            return Cells(kind, np.zeros(1, np.int64), none, none if kind == "Cells" else None)
        try:
            ends = self._integers(arrays["offsets"])[:count]
        except FlawError as flaw:
            raise FlawError(f"the offsets of the cells are wrong: {flaw}") from None
        if np.any(np.diff(ends, prepend=0) < 0) or ends[-1] > arrays["connectivity"].length:
            raise FlawError("the offsets of the cells are wrong")
        if arrays["connectivity"].length > ends[-1] + LARGE:
            raise FlawError(
                f"connectivity has {arrays['connectivity'].length} values for {count} cells"
            )
        points = self._integers(arrays["connectivity"])
        types = None
        if kind == "Cells":
            if "types" not in arrays:
                raise FlawError("the cells have no types")
            types = self._integers(arrays["types"])[:count]
        return Cells(kind, np.concatenate([np.zeros(1, np.int64), ends]), points, types)

    def _integers(self, array: StoredArray) -> IntArray:
        if array.type[0] == "f":
            raise FlawError(f"{array.name}: expected whole numbers")
        return np.asarray(self.file.values(array)).ravel().astype(np.int64)

    def _corners(self) -> npt.NDArray[Any]:
        """The low and high corner of a box whose coordinates stand along three axes."""
        axes = [self.file.values(one) for one in self.found.get("Coordinates", [])]
        if len(axes) != 3 or any(one.size == 0 for one in axes):
            raise FlawError("expected coordinates along three axes")
        return np.array([[float(one.min()), float(one.max())] for one in axes]).T


def _check_cell_count(counts: dict[str, int]) -> None:
    points = counts.get("Points", 0)
    for name, count in counts.items():
        if count > MOST_CELLS * points + LARGE:
            raise FlawError(f"NumberOf{name} cannot be {count} with {points} points")
