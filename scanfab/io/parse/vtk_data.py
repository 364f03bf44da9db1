"""What VTK files hold, whatever their syntax: points, cells, arrays; how they fit together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.typing import FloatArray, IntArray

Arrays = dict[str, npt.NDArray[Any]]

VTK_VERTEX, VTK_POLY_VERTEX, VTK_LINE = 1, 2, 3
# bit of vtkGhostType: the point or cell is another piece's
DUPLICATE = 1
# bytes of text whose words are in memory at a time, and from which on a faster parser pays
PART = 4 << 20
LONG = 1 << 20


class FlawError(Exception):
    """A file does not hold what its headers promise."""


class Cells(NamedTuple):
    """Cells of one section: which points each has."""

    kind: str
    """``Verts``, ``Lines``, ``Polys`` or ``Strips`` of PolyData, or ``Cells`` of a grid."""
    offsets: IntArray
    """Where the points of each begin, and where the last end, shape (K + 1,)."""
    points: IntArray
    types: IntArray | None = None
    """VTK's numbers of the kinds of cells, shape (K,); of a grid only."""


class Content(NamedTuple):
    """A file, or a piece of one, as it is stored."""

    points: FloatArray
    """Shape (N, 3)."""
    cells: tuple[Cells, ...]
    """In the order of the rows of the cell arrays."""
    point_arrays: Arrays
    cell_arrays: Arrays
    field_arrays: Arrays
    """Of the file as a whole, any number of rows."""


class Mesh(NamedTuple):
    """What readers ask of a VTK file."""

    points: FloatArray
    """Shape (N, 3)."""
    point_arrays: Arrays
    """N rows each."""
    lines: IntArray
    """Points of each line, shape (M, 2)."""
    line_arrays: Arrays
    """M rows each."""
    has_faces: bool
    """Triangles, boxes and the like."""
    field_arrays: Arrays
    """Of the file as a whole, any number of rows."""


def numbers(text: bytes, count: int, type: str) -> npt.NDArray[Any]:
    """
    The first so many numbers of a text, of a numpy type such as ``f4``.

    Raises
    ------
    FlawError
        If there are fewer, or a word is no such number.
    """
    is_real = type[0] == "f"
    if len(text) > LONG and (fast := _fast(text, count, is_real)) is not None:
        return _stored(fast, type)
    found = np.empty(count, np.float64 if is_real else np.uint64 if type == "u8" else np.int64)
    read: Any = float if is_real else int
    place = filled = 0
    while filled < count:
        words, place = _some_words(text, place)
        if not words:
            raise FlawError(f"{filled} of {count} values")
        words = words[: count - filled]
        try:
            # _ may stand between the digits of Python's own numbers
            if any(b"_" in word for word in words):
                raise ValueError
            found[filled : filled + len(words)] = np.fromiter(
                map(read, words), found.dtype, len(words)
            )
        except (ValueError, OverflowError):
            what = "numbers" if is_real else "whole numbers"
            raise FlawError(f"expected {what}, found something else") from None
        filled += len(words)
    return _stored(found, type)


def _fast(text: bytes, count: int, is_real: bool) -> npt.NDArray[Any] | None:
    """The numbers of a long text by polars; None if it cannot, so that others say what is wrong."""
    import polars

    kind = polars.Float64 if is_real else polars.Int64
    lines = text.translate(bytes.maketrans(b" \t\r\v\f", b"\n\n\n\n\n"))
    try:
        table = polars.read_csv(lines, has_header=False, schema={"0": kind}, quote_char=None)
    except (polars.exceptions.PolarsError, polars.exceptions.PanicException):
        return None
    # between two blanks there is no number
    found = table["0"].drop_nulls()
    return found.to_numpy()[:count] if len(found) >= count else None


def _stored(found: npt.NDArray[Any], type: str) -> npt.NDArray[Any]:
    """Numbers as the file's own type; FlawError if it cannot hold a whole one."""
    with np.errstate(over="ignore", invalid="ignore"):
        stored = found.astype(type)
    if type[0] != "f" and not np.array_equal(stored.astype(found.dtype), found):
        raise FlawError(f"a whole number is too large for its type ({type})")
    return stored


def _some_words(text: bytes, place: int) -> tuple[list[bytes], int]:
    """The words of the next part of a text, and where the one behind it begins."""
    while place < len(text):
        stop = place + PART
        while stop < len(text) and not text[stop : stop + 1].isspace():
            stop += 1
        words = text[place:stop].split()
        if words:
            return words, stop
        place = stop
    return [], place


def joined(pieces: Sequence[Content]) -> Content:
    """Pieces one behind the other; of their arrays those that all have which are not empty."""
    if len(pieces) == 1:
        return pieces[0]
    filled = [one for one in pieces if len(one.points)] or list(pieces[:1])
    if not filled:
        raise FlawError("expected a piece, found none")
    starts = np.cumsum([0, *(len(one.points) for one in filled)])
    kinds = list(dict.fromkeys(cells.kind for one in filled for cells in one.cells))
    for one in filled:
        if len(filled) > 1 and [cells.kind for cells in one.cells] != kinds:
            raise FlawError("the pieces hold different kinds of cells")
    return Content(
        np.concatenate([one.points for one in filled]),
        tuple(_joined_cells([one.cells[k] for one in filled], starts) for k in range(len(kinds))),
        _common([one.point_arrays for one in filled]),
        # rows go section by section, and piece by piece within one
        _common([_rows_of(one, k) for k in range(len(kinds)) for one in filled]),
        filled[0].field_arrays,
    )


def _rows_of(piece: Content, section: int) -> Arrays:
    """The cell arrays of one section."""
    ends = np.cumsum([0, *(len(cells.offsets) - 1 for cells in piece.cells)])
    rows = slice(ends[section], ends[section + 1])
    return {name: values[rows] for name, values in piece.cell_arrays.items()}


def _joined_cells(parts: Sequence[Cells], starts: IntArray) -> Cells:
    ends = np.cumsum([0, *(len(one.points) for one in parts)])
    offsets = [one.offsets[:-1] + end for one, end in zip(parts, ends, strict=False)]
    points = [one.points + start for one, start in zip(parts, starts, strict=False)]
    types = [one.types for one in parts if one.types is not None]
    return Cells(
        parts[0].kind,
        np.concatenate([*offsets, ends[-1:]]),
        np.concatenate(points),
        np.concatenate(types) if types else None,
    )


def _common(arrays: Sequence[Arrays]) -> Arrays:
    if not arrays:
        return {}
    names = [name for name in arrays[0] if all(name in other for other in arrays)]
    shapes = {name: {one[name].shape[1:] for one in arrays} for name in names}
    return {
        name: np.concatenate([one[name] for one in arrays])
        for name in names
        if len(shapes[name]) == 1
    }


def mesh_of(content: Content) -> Mesh:
    """Points, lines and their arrays; FlawError if they do not fit together."""
    _check_rows(content)
    lines, line_arrays, has_faces = _lines_and_faces(content)
    arrays = dict(content.point_arrays)
    if _are_the_points(content):
        arrays.update(content.cell_arrays)
    own = np.ones(len(content.points), np.bool_)
    ghosts = arrays.get("vtkGhostType")
    if ghosts is not None and ghosts.dtype.kind in "iu" and ghosts.ndim == 1:
        own = (ghosts.astype(np.int64) & DUPLICATE) == 0
    points = content.points
    if not own.all():
        if len(lines):
            raise FlawError("points of other pieces (vtkGhostType) and lines between points")
        points = points[own]
        arrays = {name: values[own] for name, values in arrays.items()}
    return Mesh(points, arrays, lines, line_arrays, has_faces, content.field_arrays)


def _check_rows(content: Content) -> None:
    points = len(content.points)
    for cells in content.cells:
        ends = cells.offsets
        if ends[0] != 0 or np.any(np.diff(ends) < 0) or ends[-1] > len(cells.points):
            raise FlawError(f"the offsets of the cells ({cells.kind}) are wrong")
        named = cells.points[: ends[-1]]
        if named.size and not 0 <= named.min() <= named.max() < points:
            raise FlawError(f"{cells.kind.lower()} name points that do not exist")
        if cells.types is not None and len(cells.types) != len(ends) - 1:
            raise FlawError(f"{len(cells.types)} types for {len(ends) - 1} cells")
    rows = sum(len(cells.offsets) - 1 for cells in content.cells)
    for arrays, count in ((content.point_arrays, points), (content.cell_arrays, rows)):
        for name, values in arrays.items():
            if len(values) != count:
                raise FlawError(f"{name} has {len(values)} of {count} rows")


def _lines_and_faces(content: Content) -> tuple[IntArray, Arrays, bool]:
    """The two ends of each line, the rows of the arrays that are theirs, and what else there is."""
    none: IntArray = np.zeros((0, 2), np.int64)
    lines, chosen, has_faces, row = [none], [np.zeros(0, np.int64)], False, 0
    for cells in content.cells:
        count = len(cells.offsets) - 1
        if cells.kind == "Lines":
            own = np.arange(count)
            lines.append(_ends(cells, own))
            chosen.append(row + own)
        elif cells.types is not None:
            own = np.flatnonzero(cells.types == VTK_LINE)
            if np.any(np.diff(cells.offsets)[own] != 2):
                raise FlawError("types and points of the cells do not fit")
            lines.append(_ends(cells, own))
            chosen.append(row + own)
            known = np.isin(cells.types, (VTK_VERTEX, VTK_POLY_VERTEX, VTK_LINE))
            has_faces |= bool(np.any(~known))
        elif cells.kind != "Verts":
            has_faces |= count > 0
        row += count
    rows = np.concatenate(chosen)
    arrays = {name: values[rows] for name, values in content.cell_arrays.items()}
    return np.concatenate(lines), arrays, has_faces


def _ends(cells: Cells, chosen: IntArray) -> IntArray:
    """The first and last point of some lines, shape (M, 2)."""
    first, last = cells.offsets[chosen], cells.offsets[chosen + 1] - 1
    if np.any(last < first):
        raise FlawError("a line has no points")
    return np.column_stack([cells.points[first], cells.points[last]]).astype(np.int64)


def _are_the_points(content: Content) -> bool:
    """Whether the cells of a grid are one vertex for each point, in their order."""
    if len(content.cells) != 1 or content.cells[0].types is None:
        return False
    (cells,) = content.cells
    return (
        len(cells.points) == len(content.points)
        and bool(np.all(cells.types == VTK_VERTEX))
        and np.array_equal(cells.offsets, np.arange(len(cells.points) + 1))
        and np.array_equal(cells.points, np.arange(len(cells.points)))
    )
