"""Write packings as tables with a row for each sphere: CSV, TSV, Parquet and extended XYZ."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from scanfab.base.typing import AnyArray, Columns
from scanfab.io.formats.table import FRAME_NAMES, plain_name
from scanfab.io.writer import Left, as_arrays, csv_bytes, flat, table_columns
from scanfab.packing.packing import Packing

# extended XYZ's letter for each of numpy's kinds
LETTERS = {"b": "L", "i": "I", "u": "I", "f": "R", "U": "S"}


class CsvWriter:
    """Tables with commas between the values."""

    name = "csv"
    description = "a table of spheres with commas; contacts and cell in companion files"
    extensions: tuple[str, ...] = (".csv",)
    separator = ","

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; a column that numbers frames (`time`) goes into a companion file."""
        known, own, notes = table_columns(packing)
        numbers = {name: values for name, values in own.items() if values.dtype.kind in "iuf"}
        times = {k: values for k, values in numbers.items() if plain_name(k) in FRAME_NAMES}
        left = {k for k, values in times.items() if len(np.unique(values)) > 1}
        held = {name: own[name] for name in own if name not in left}
        path.write_bytes(self.table({**known, **held}))
        columns = tuple(name for name in own if name in left)
        return Left(contacts=True, frame=True, columns=columns, notes=tuple(notes))

    def table(self, columns: Columns) -> bytes:
        """The bytes of the file."""
        return csv_bytes(columns, self.separator)


class TsvWriter(CsvWriter):
    """Tables with tabs between the values."""

    name = "tsv"
    description = "a table of spheres with tabs; contacts and cell in companion files"
    extensions = (".tsv",)
    separator = "\t"


class ParquetWriter(CsvWriter):
    """Apache Parquet."""

    name = "parquet"
    description = "a table of spheres as Apache Parquet; contacts and cell in companion files"
    extensions = (".parquet",)

    def table(self, columns: Columns) -> bytes:
        """The bytes of the file."""
        import polars

        stream = io.BytesIO()
        polars.DataFrame(columns).write_parquet(stream)
        return stream.getvalue()


class XyzWriter:
    """Extended XYZ: a row for each sphere, and a line above that names columns and cell."""

    name = "xyz"
    description = "extended XYZ with a radius, its cell and step; contacts in companion files"
    extensions: tuple[str, ...] = (".xyz", ".extxyz")

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; texts with blanks go into a companion file."""
        arrays = as_arrays(packing)
        held = {name: values for name, values in arrays.own.items() if _is_xyz(name, values)}
        properties: list[str] = []
        rows: Columns = {}
        for name, values in {"pos": packing.position, **arrays.grains, **held}.items():
            width = int(np.prod(values.shape[1:]))
            properties.append(f"{name}:{LETTERS[values.dtype.kind]}:{width}")
            words = np.where(values, "T", "F") if values.dtype.kind == "b" else values
            # names with a blank cannot clash with names of other columns
            parts = enumerate(words.reshape(len(values), width).T)
            rows |= {f"{name} {place}": part for place, part in parts}
        line = [f"Properties={':'.join(properties)}"]
        if packing.time is not None:
            line.insert(0, f"Time={packing.time!r}")
        if packing.step is not None:
            line.insert(0, f"Timestep={packing.step}")
        if (cell := packing.cell) is not None:
            vectors = " ".join(map(repr, cell.vectors.ravel().tolist()))
            origin = " ".join(map(repr, cell.origin.tolist()))
            along = " ".join("FT"[repeats] for repeats in cell.periodic)
            line.insert(0, f'Lattice="{vectors}" Origin="{origin}" pbc="{along}"')
        head = f"{len(packing)}\n{' '.join(line)}\n"
        path.write_bytes(head.encode() + csv_bytes(rows, " ", with_names=False))
        left = flat({name: values for name, values in arrays.own.items() if name not in held})
        return Left(contacts=True, columns=tuple(left), notes=tuple(arrays.notes))


def _is_xyz(name: str, values: AnyArray) -> bool:
    """Whether extended XYZ can hold a column: its name and its texts must be single words."""
    if re.search(r"[\s:\"=]", name) or not name or int(np.prod(values.shape[1:])) > 99:
        return False
    if name.lower() in ("pos", "position", "positions") or values.dtype == np.uint64:
        return False
    texts = values.ravel() if values.dtype.kind == "U" else ()
    return all(text.split() == [text] for text in texts)
