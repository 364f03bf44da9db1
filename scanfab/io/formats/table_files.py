"""The columns of a table, in whatever file: text, Parquet, NPZ or ``.xyzd``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.io.binary_tables import (
    IS_NPZ,
    IS_PARQUET,
    is_xyzd,
    npz_shapes,
    parquet_names,
    read_npz,
    read_parquet,
    read_xyzd,
)
from scanfab.io.files import first_bytes, plain
from scanfab.io.layout import check_width, text_table
from scanfab.io.reader import Snapshot
from scanfab.io.text import read_rows, text_of, warn_of_end

Columns = dict[str, npt.NDArray[Any]]

POSITIONS = ("position", "positions", "pos", "points", "centers", "centres")
WITH_COMMA = re.compile(rb"[-+0-9.eE]*,[-+0-9.,eE]*")
# a number whose comma may stand before thousands: no decimal number has two, or begins with 0
THOUSANDS = re.compile(rb"[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+")


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
        table = text_table(path, skip)
        return table.names, len(table.layout.names)
    check_width(path, len(names))
    return names, len(names)


def first_rows(path: Path, skip: int) -> list[list[str]]:
    """The words of the first rows of a text; none of other files."""
    if is_xyzd(path) or first_bytes(path, 8).startswith((IS_PARQUET, IS_NPZ)):
        return []
    table = text_table(path, skip)
    return [row[: len(table.layout.names)] for row in table.rows]


def read_table(path: Path, skip: int, numbers: Sequence[str], whole: Sequence[str]) -> Columns:
    """
    All columns of a table by their names, or by their numbers if they have none.

    Parameters
    ----------
    path : Path
        Of the table.
    skip : int
        Lines before it, of a text.
    numbers : sequence of str
        Columns that must hold a number in each row; others may have gaps or hold words.
    whole : sequence of str
        Those of them that are whole numbers.
    """
    head = first_bytes(path, 8)
    if is_xyzd(path):
        found = read_xyzd(path)
    elif head.startswith(IS_PARQUET):
        found = read_parquet(path)
    elif head.startswith(IS_NPZ):
        found = _unfolded(read_npz(path))
    else:
        found = _read_text(path, skip, numbers, whole)
    for name in numbers:
        if name not in found or found[name].dtype.kind not in "biuf":
            raise ReadError(f"{path}: expected numbers in the column {name}, found none")
    return found


def _read_text(path: Path, skip: int, numbers: Sequence[str], whole: Sequence[str]) -> Columns:
    table = text_table(path, skip)
    snapshot = Snapshot(path, start=table.start)
    rows = text_of(snapshot)
    if not rows and not plain(path).read_bytes().endswith(b"\n"):
        warn_of_end(path)
    if table.layout.comma:
        doubtful = next(WITH_COMMA.finditer(rows), None)
        if doubtful and all(THOUSANDS.fullmatch(one[0]) for one in WITH_COMMA.finditer(rows)):
            raise ReadError(
                f"{path}: {doubtful[0].decode()!r} may be a decimal number or have a sign of "
                f"thousands, as may all numbers with a comma: write them with a point, without "
                f"signs of thousands"
            )
    optional = [name for name in table.layout.names if name not in numbers]
    layout = table.layout._replace(whole=whole, optional=optional)
    return read_rows(snapshot, rows, layout)


def _parts(name: str, shape: tuple[int, ...]) -> list[str]:
    """The names of the columns of an array of an NPZ file; none if it cannot be columns."""
    if len(shape) == 2 and shape[1] <= 9:
        if name.lower() in POSITIONS:
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
