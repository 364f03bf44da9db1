"""Tables read back: CSV, TSV, JSON, JSON lines and Parquet, told apart by their content."""

from __future__ import annotations

import csv
import io
import json
import math
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError
from scanfab.base.streams import check_file_or_pipe
from scanfab.table.columns import OWN_COLUMNS

__all__ = ["is_number", "number_of", "numbers_of", "read_rows", "total_error"]

# words that may look like numbers: a source may be called 2024
TEXT_COLUMNS = {column.name for column in OWN_COLUMNS if column.kind is str}


def read_rows(path: Path | str) -> list[dict[str, Any]]:
    """
    The rows of a table by column; a missing value is None.

    Parameters
    ----------
    path : path
        A file, or ``-`` for standard input.

    Raises
    ------
    ReadError
        If the file cannot be read as a table; names the line of a text file.

    Examples
    --------
    >>> from scanfab.table.reading import read_rows
    >>> rows = read_rows("sample_data/yade_triaxial/engine.csv")
    >>> rows[0]["contacts"]
    2076
    """
    check_file_or_pipe(Path(path))
    try:
        data = sys.stdin.buffer.read() if str(path) == "-" else Path(path).read_bytes()
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror}") from None
    if data.startswith(b"PAR1"):
        return _read_parquet(path, data)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ReadError(f"{path}: expected a table as text or Parquet, found other bytes") from None
    start = text.lstrip()[:1]
    if start == "[":
        return _objects(path, _parse(path, text))
    if start == "{":
        lines = [line for line in text.split("\n") if line.strip()]
        return _objects(path, [_parse(path, line) for line in lines])
    return _read_csv(path, text)


def is_number(value: object) -> bool:
    """Whether a value is a finite number: no truth value, and no integer beyond all floats."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def number_of(row: Mapping[str, Any], name: str) -> float | None:
    """A row's number in a column that need not exist; None for anything else there."""
    value = row.get(name)
    return float(value) if is_number(value) else None  # type: ignore[arg-type]


def numbers_of(rows: Iterable[Mapping[str, Any]], name: str) -> list[float]:
    """The numbers of such a column."""
    return [value for row in rows if (value := number_of(row, name)) is not None]


def total_error(row: Mapping[str, Any], name: str) -> float | None:
    """
    The standard error to quote beside an anisotropy: of the scan and of the sample together.

    Parameters
    ----------
    row : mapping
        Of a fabric table.
    name : str
        ``alpha_vs_axial``: √(scan² + sample²), None where either part is not known.
        ``alpha_c_axial``: the sample's, as contacts are counted, not scanned.

    Examples
    --------
    >>> from scanfab.table.reading import total_error
    >>> row = {"alpha_vs_axial_se": 3e-4, "alpha_vs_axial_sample_se": 4e-4}
    >>> round(total_error(row, "alpha_vs_axial"), 7)
    0.0005
    """
    sample = number_of(row, f"{name}_sample_se")
    if name == "alpha_c_axial":
        return sample
    scan = number_of(row, f"{name}_se")
    return None if scan is None or sample is None else math.hypot(scan, sample)


def _parse(path: Path | str, text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:  # also an integer of too many digits
        raise ReadError(f"{path}: cannot be read as JSON: {error}") from None


def _objects(path: Path | str, rows: list[Any]) -> list[dict[str, Any]]:
    if not all(isinstance(row, dict) for row in rows):
        raise ReadError(f"{path}: expected JSON objects, one for each row")
    return rows


def _read_parquet(path: Path | str, data: bytes) -> list[dict[str, Any]]:
    try:
        from pyarrow import parquet
    except ImportError:
        raise ReadError(
            f"{path}: Parquet files need the package pyarrow: pip install 'scanfab[parquet]'"
        ) from None
    try:
        rows: list[dict[str, Any]] = parquet.read_table(io.BytesIO(data)).to_pylist()
    except Exception as error:  # pyarrow raises kinds of its own
        raise ReadError(f"{path}: cannot be read as Parquet: {error}") from None
    return rows


def _read_csv(path: Path | str, text: str) -> list[dict[str, Any]]:
    first = text.split("\n", 1)[0]
    reader = csv.reader(io.StringIO(text), delimiter="\t" if "\t" in first else ",")
    try:
        names = next(reader, [])
        rows = []
        for row in reader:
            if len(row) != len(names):
                raise ReadError(
                    f"{path}, line {reader.line_num}: expected {len(names)} cells, found {len(row)}"
                )
            rows.append({name: _value(name, cell) for name, cell in zip(names, row, strict=True)})
    except csv.Error as error:
        raise ReadError(f"{path}, line {reader.line_num}: {error}") from None
    if not names:
        raise ReadError(f"{path}: expected a table, found nothing")
    return rows


def _value(name: str, cell: str) -> int | float | str | None:
    if cell == "":
        return None
    if name not in TEXT_COLUMNS:
        for kind in (int, float):
            try:
                return kind(cell)
            except ValueError:
                continue
    return cell
