"""The columns of a table, in whatever file: text, Parquet, NPZ or ``.xyzd``."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io.files import Stamp, check_memory, first_bytes, plain, stamp_of
from scanfab.io.formats.table_names import unique
from scanfab.io.formats.xyzd import is_xyzd, read_xyzd_columns
from scanfab.io.parse.sheet_binary import (
    IS_NPZ,
    IS_PARQUET,
    npz_shapes,
    parquet_names,
    read_npz,
    read_parquet,
)
from scanfab.io.parse.sheet_columns import Arrays, read_columns
from scanfab.io.parse.sheet_layout import (
    HEAD,
    IN_MEMORY,
    Layout,
    check_width,
    first_rows,
    layout_of,
    read_text,
)
from scanfab.io.parse.text_table import has_pieces, read_to_end
from scanfab.io.unpacking import check_lines

Columns = dict[str, npt.NDArray[Any]]


def names_of(path: Path, skip: int) -> tuple[list[str] | None, int]:
    """The names of the columns, None if there are none, and their number."""
    head = first_bytes(path, 8)
    # doubles may begin as any other file does
    if is_xyzd(path):
        names = ["x", "y", "z", "diameter"]
    elif head.startswith(IS_PARQUET):
        names = parquet_names(path)
    elif head.startswith(IS_NPZ):
        names = [part for name, shape in npz_shapes(path).items() for part in _parts(name, shape)]
    else:
        layout = _layout_by_head(path, skip, stamp_of(path))
        return (None if layout.names is None else list(layout.names)), layout.width
    check_width(path, len(names))
    return names, len(names)


@lru_cache
def _layout_by_head(path: Path, skip: int, stamp: Stamp) -> Layout:
    """Of a file as it stood then, which is asked for several times."""
    return layout_of(path, read_text(path, HEAD), skip)


def has_ids(path: Path, skip: int, found: Mapping[str, str]) -> bool:
    """Whether the first rows of a table of text have whole numbers where ids should be."""
    if first_bytes(path, 8).startswith((IS_PARQUET, IS_NPZ)) or is_xyzd(path):
        return True
    layout = _layout_by_head(path, skip, stamp_of(path))
    names = _keys(layout)
    places = [names.index(found[one]) for one in ("id1", "id2")]
    rows = first_rows(read_text(path, HEAD), layout)
    return all(row[place].strip().isdigit() for row in rows for place in places)


def read_table(path: Path, skip: int, numbers: Sequence[str], whole: Sequence[str]) -> Columns:
    """All columns by their names, or by their numbers if they have none."""
    head = first_bytes(path, 8)
    if is_xyzd(path):
        return dict(read_xyzd_columns(path))
    if head.startswith(IS_PARQUET):
        return _checked(path, read_parquet(path), numbers)
    if head.startswith(IS_NPZ):
        return _checked(path, _unfolded(read_npz(path)), numbers)
    layout, columns = _large(path, skip, whole) or _whole_text(path, skip, numbers, whole)
    return {
        name: columns[place]
        for place, name in enumerate(_keys(layout))
        if layout.names is None or layout.names[place] or not _is_empty(columns[place])
    }


def _large(path: Path, skip: int, whole: Sequence[str]) -> tuple[Layout, Arrays] | None:
    """How a large table of numbers is written, and its columns by their places; None: otherwise."""
    stamp, file = stamp_of(path), plain(path)
    if not has_pieces(file):
        return None
    layout = _layout_by_head(path, skip, stamp)
    is_decoded = first_bytes(path, HEAD) != read_text(path, HEAD)
    if is_decoded or layout.has_commas or not all(layout.are_numbers):
        return None
    check_memory(path, IN_MEMORY * file.stat().st_size)
    check_lines(path, file)
    places = [place for place, name in enumerate(_keys(layout)) if name in whole]
    columns = read_to_end(file, layout.start, layout.separator, places)
    if columns is None or len(columns) != layout.width or stamp_of(path) != stamp:
        return None
    return layout, dict(enumerate(columns))


def _whole_text(
    path: Path, skip: int, numbers: Sequence[str], whole: Sequence[str]
) -> tuple[Layout, Arrays]:
    """The same of any table of text; ReadError if it is none."""
    data = read_text(path)
    if not data.endswith((b"\n", b"\r")):
        warnings.warn(
            f"{path}: the last line has no end: if the file was cut, rows are missing, and its "
            f"last number may be cut, too",
            ScanfabWarning,
            stacklevel=2,
        )
    layout = layout_of(path, data, skip)
    places = {name: place for place, name in enumerate(_keys(layout))}
    needed, ids = ([places[one] for one in some] for some in (numbers, whole))
    return layout, read_columns(path, data, layout, needed, ids)


def read_unnamed(path: Path, skip: int) -> Columns:
    """The columns of a table without names; the first may be ids, which stay exact."""
    rows = first_rows(read_text(path, HEAD), _layout_by_head(path, skip, stamp_of(path)))
    whole = ["1"] if all(row[0].strip().isdigit() for row in rows) else []
    return read_table(path, skip, (), whole)


def _checked(path: Path, columns: Columns, numbers: Sequence[str]) -> Columns:
    for name in numbers:
        if name not in columns or columns[name].dtype.kind not in "biuf":
            raise ReadError(f"{path}: expected numbers in the column {name}")
    return columns


def _keys(layout: Layout) -> list[str]:
    """The names of the columns, or their numbers."""
    return unique(layout.names or [""] * layout.width)


def _is_empty(values: npt.NDArray[Any]) -> bool:
    """Whether a column is what a separator at the end of each row leaves."""
    if values.dtype.kind == "U":
        return not np.any(values != "")
    # the first row tells it of most columns
    return bool(np.all(np.isnan(values[:1])) and np.all(np.isnan(values)))


def _parts(name: str, shape: tuple[int, ...]) -> list[str]:
    if len(shape) == 2 and shape[1] <= 9:
        if name.lower() in ("position", "positions", "pos", "points", "centers", "centres"):
            return list("xyz"[: shape[1]])
        if name.lower() in ("pairs", "contacts", "ids") and shape[1] == 2:
            return ["id1", "id2"]
        return [f"{name}_{axis}" for axis in ("xyz" if shape[1] == 3 else range(shape[1]))]
    return [name] if len(shape) == 1 else []


def _unfolded(arrays: Columns) -> Columns:
    """Arrays as columns, those with as many rows as most have."""
    columns: Columns = {}
    for name, values in arrays.items():
        for place, part in enumerate(_parts(name, values.shape)):
            columns[part] = values if values.ndim == 1 else values[:, place]
    rows = len(columns["x"]) if "x" in columns else max(map(len, columns.values()), default=0)
    return {name: values for name, values in columns.items() if len(values) == rows}
