"""Packings as tables with a row for each sphere: CSV, TSV, Parquet and extended XYZ."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from scanfab.base.typing import AnyArray, Columns
from scanfab.io.formats.table_names import is_frame_name
from scanfab.io.writer import Left, as_arrays, csv_bytes, flat, table_columns
from scanfab.packing.packing import Packing

# letters of extended XYZ by numpy's kinds
LETTERS = {"b": "L", "i": "I", "u": "I", "f": "R", "U": "S"}


class CsvWriter:
    """Cells separated by commas."""

    name = "csv"
    description = "a table of spheres with commas; contacts and cell beside it"
    extensions: tuple[str, ...] = (".csv",)
    separator = ","

    def write(self, packing: Packing, path: Path) -> Left:
        """Write the columns id, x, y, z, radius and all that do not tell frames apart."""
        known, own, notes = table_columns(packing)
        numbers = {name: values for name, values in own.items() if values.dtype.kind in "iuf"}
        left = {one for one in numbers if is_frame_name(one) and len(np.unique(numbers[one])) > 1}
        held = {name: own[name] for name in own if name not in left}
        path.write_bytes(self.table({**known, **held}))
        columns = tuple(name for name in own if name in left)
        return Left(contacts=True, frame=True, columns=columns, notes=tuple(notes))

    def table(self, columns: Columns) -> bytes:
        """The bytes of the file."""
        return csv_bytes(columns, self.separator)


class TsvWriter(CsvWriter):
    """Cells separated by tabs."""

    name = "tsv"
    description = "a table of spheres with tabs; contacts and cell beside it"
    extensions = (".tsv",)
    separator = "\t"


class ParquetWriter(CsvWriter):
    """Apache Parquet."""

    name = "parquet"
    description = "a table of spheres as Apache Parquet; contacts and cell beside it"
    extensions = (".parquet",)

    def table(self, columns: Columns) -> bytes:
        """The bytes of the file."""
        import polars

        stream = io.BytesIO()
        polars.DataFrame(columns).write_parquet(stream)
        return stream.getvalue()


class XyzWriter:
    """Extended XYZ: rows of words, and a line above them that names columns and cell."""

    name = "xyz"
    description = "extended XYZ with a radius, its cell and step; contacts lie beside it"
    extensions: tuple[str, ...] = (".xyz", ".extxyz")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; texts that are no single words lie beside it."""
        arrays = as_arrays(packing)
        held = {name: values for name, values in arrays.own.items() if _is_xyz(name, values)}
        properties: list[str] = []
        rows: Columns = {}
        for name, values in {"pos": packing.position, **arrays.grains, **held}.items():
            width = int(np.prod(values.shape[1:]))
            properties.append(f"{name}:{LETTERS[values.dtype.kind]}:{width}")
            words = np.where(values, "T", "F") if values.dtype.kind == "b" else values
            # no other column has a name with a blank
            parts = enumerate(words.reshape(len(values), width).T)
            rows |= {f"{name} {place}": part for place, part in parts}
        line = f"{_line(packing)}Properties={':'.join(properties)}"
        table = csv_bytes(rows, " ", with_names=False)
        path.write_bytes(f"{len(packing)}\n{line}\n".encode() + table)
        left = flat({name: values for name, values in arrays.own.items() if name not in held})
        return Left(contacts=True, columns=tuple(left), notes=tuple(arrays.notes))


def _line(packing: Packing) -> str:
    """Cell, step and time, as the line above the rows names them."""
    cell, words = packing.cell, ""
    if cell is not None:
        vectors = " ".join(map(repr, cell.vectors.ravel().tolist()))
        origin = " ".join(map(repr, cell.origin.tolist()))
        along = " ".join("FT"[one] for one in cell.periodic)
        words = f'Lattice="{vectors}" Origin="{origin}" pbc="{along}" '
    words += "" if packing.step is None else f"Timestep={packing.step} "
    return words + ("" if packing.time is None else f"Time={packing.time!r} ")


def _is_xyz(name: str, values: AnyArray) -> bool:
    """Whether extended XYZ has a place for a column: its name and its texts are single words."""
    if re.search(r"[\s:\"=]", name) or not name or int(np.prod(values.shape[1:])) > 99:
        return False
    if name.lower() in ("pos", "position", "positions") or values.dtype == np.uint64:
        return False
    texts = values.ravel() if values.dtype.kind == "U" else ()
    return all(text.split() == [text] for text in texts)
