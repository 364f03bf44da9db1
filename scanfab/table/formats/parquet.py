"""Tables as Apache Parquet, by pyarrow."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import IO, Any

from scanfab.base.column import Column
from scanfab.base.errors import ReadError, SettingsError

NEEDS = "Parquet files need the package pyarrow: pip install pyarrow"


class Parquet:
    """A file whose columns have the kinds that they are declared with."""

    suffix = ".parquet"
    description = "Apache Parquet"
    is_text = False
    appends = False
    holds_lists = True

    def check(self) -> None:
        """SettingsError without pyarrow."""
        try:
            import pyarrow  # noqa: F401
        except ImportError:
            raise SettingsError(NEEDS) from None

    def recognises(self, data: bytes) -> bool:
        """By its magic number."""
        return data.startswith(b"PAR1")

    def writer(self, stream: IO[bytes], columns: Sequence[Column], header: bool) -> ParquetWriter:
        """Of a file that is written when all rows are known."""
        return ParquetWriter(stream, columns)

    def read(self, data: bytes, name: str) -> list[dict[str, Any]]:
        """The rows."""
        try:
            from pyarrow import parquet
        except ImportError:
            raise ReadError(f"{name}: {NEEDS}") from None
        try:
            rows: list[dict[str, Any]] = parquet.read_table(io.BytesIO(data)).to_pylist()
        except Exception as error:  # pyarrow raises kinds of its own
            raise ReadError(f"{name}: cannot be read as Parquet: {error}") from None
        return rows


class ParquetWriter:
    """Rows as a Parquet file, written when closed."""

    def __init__(self, stream: IO[bytes], columns: Sequence[Column]) -> None:
        self.stream = stream
        self.columns = columns
        self._rows: list[dict[str, Any]] = []

    def write(self, row: Mapping[str, Any]) -> None:
        """Keep one row."""
        self._rows.append(dict(row))

    def _values(self, name: str) -> list[Any]:
        return [row[name] for row in self._rows]

    def close(self) -> None:
        """Write the file."""
        import pyarrow
        from pyarrow import parquet

        kinds = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
        schema = pyarrow.schema(
            [
                # the kind of a list's entries is found by pyarrow
                (one.name, kinds.get(one.kind) or pyarrow.infer_type(self._values(one.name)))
                for one in self.columns
            ]
        )
        parquet.write_table(pyarrow.Table.from_pylist(self._rows, schema=schema), self.stream)
