"""Packings as tables with a row for each sphere: CSV, TSV and Parquet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.io.formats.table_names import is_frame_name
from scanfab.io.writer import Left
from scanfab.io.written import flat, free_name, own_columns, standard_columns
from scanfab.packing.packing import Packing

Columns = dict[str, npt.NDArray[Any]]


class _TableWriter:
    def write(self, packing: Packing, path: Path) -> Left:
        """Columns id, x, y, z, radius, and all others; a table holds nothing else."""
        table, notes = table_of(packing)
        self._put(table, path)
        bare = packing.cell is None and packing.step is None and packing.time is None
        return Left(contacts=True, frame=not bare, notes=tuple(notes))

    def _put(self, table: Any, path: Path) -> None:
        raise NotImplementedError


class CsvWriter(_TableWriter):
    """Cells separated by commas."""

    name = "csv"
    description = "a table of spheres with commas; contacts and cell beside it"
    extensions = (".csv",)

    def _put(self, table: Any, path: Path) -> None:
        table.write_csv(path)


class TsvWriter(_TableWriter):
    """Cells separated by tabs."""

    name = "tsv"
    description = "a table of spheres with tabs; contacts and cell beside it"
    extensions = (".tsv",)

    def _put(self, table: Any, path: Path) -> None:
        table.write_csv(path, separator="\t")


class ParquetWriter(_TableWriter):
    """Apache Parquet."""

    name = "parquet"
    description = "a table of spheres as Apache Parquet; contacts and cell beside it"
    extensions = (".parquet",)

    def _put(self, table: Any, path: Path) -> None:
        table.write_parquet(path)


def table_of(packing: Packing) -> tuple[Any, list[str]]:
    """A data frame of polars with a row for each sphere, and what is to be said of it."""
    import polars

    standard = standard_columns(packing)
    own, notes = own_columns(packing)
    columns, more = flat(own)
    columns, told = _of_one_frame(columns)
    place = dict(zip("xyz", packing.position.T, strict=True))
    ordered = {"id": standard.pop("id"), **place, "radius": packing.radius, **standard, **columns}
    return polars.DataFrame({name: values.copy() for name, values in ordered.items()}), [
        *notes,
        *more,
        *told,
    ]


def _of_one_frame(columns: Columns) -> tuple[Columns, list[str]]:
    """The columns, none of them called as if its values told frames apart; and what was changed."""
    found: Columns = {}
    notes = []
    for name, values in columns.items():
        is_number = values.dtype.kind in "iuf"
        if is_number and is_frame_name(name) and len(np.unique(values)) > 1:
            free = free_name(name, [*found, *columns])
            notes.append(
                f"the column {name} is called {free}: {name} tells frames of a table apart"
            )
            found[free] = values
        else:
            found[name] = values
    return found, notes
