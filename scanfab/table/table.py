"""The fabric table: one row for each frame and variant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from scanfab.table.columns import COLUMNS
from scanfab.table.row import Row

__all__ = ["COLUMNS", "Row", "Table"]


class Table(Sequence[Row]):
    """
    The rows of a computation.

    ``table["alpha_vs"]`` is a column as an array (missing numbers are NaN), ``table[0]`` a row.
    """

    def __init__(self, rows: Iterable[Row]) -> None:
        self.rows = tuple(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    @overload
    def __getitem__(self, key: int) -> Row: ...
    @overload
    def __getitem__(self, key: slice) -> Table: ...
    @overload
    def __getitem__(self, key: str) -> npt.NDArray[Any]: ...
    def __getitem__(self, key: int | slice | str) -> Row | Table | npt.NDArray[Any]:
        if isinstance(key, str):
            if key not in COLUMNS:
                raise KeyError(f"no column {key!r}; the columns are {', '.join(COLUMNS)}")
            values = [getattr(row, key) for row in self.rows]
            text = any(isinstance(value, str) for value in values)
            return np.array(values if text else [np.nan if v is None else v for v in values])
        return Table(self.rows[key]) if isinstance(key, slice) else self.rows[key]

    def select(self, **wanted: Any) -> Table:
        """The rows whose columns have the given values, for instance ``variant="a"``."""
        return Table(
            row
            for row in self.rows
            if all(getattr(row, name) == value for name, value in wanted.items())
        )

    def __repr__(self) -> str:
        return f"Table({len(self)} rows)"
