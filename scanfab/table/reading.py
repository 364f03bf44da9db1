"""Tables read back, of all formats, which are told apart by their content; numbers of rows."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError
from scanfab.base.files import check_file
from scanfab.table.formats import reading_format


def read_rows(path: Path | str) -> list[dict[str, Any]]:
    """
    The rows of a table by column; a missing value is None.

    Parameters
    ----------
    path : path
        A file, or ``-`` for standard input.

    Returns
    -------
    list of dict
        :func:`scanfab.load` makes a table of them.

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
    data = _content(path)
    return reading_format(Path(path), data).read(data, str(path))


def _content(path: str | Path) -> bytes:
    """The bytes of a table, or of what is piped in."""
    check_file(Path(path), "a table", "as - in place of its name")
    try:
        return sys.stdin.buffer.read() if str(path) == "-" else Path(path).read_bytes()
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror}") from None


def read_finished_rows(path: Path) -> list[dict[str, Any]]:
    """
    The rows of a table that a run has written and that is gone on with.

    Raises
    ------
    ReadError
        If the file cannot be read as a table, or has lost its end: a number at the end of a text
        reads well without its last digits.
    """
    data = _content(path)
    format_ = reading_format(path, data)
    rows = format_.read(data, str(path))
    if data and format_.is_text and not data.endswith(b"\n"):
        raise ReadError(
            f"{path}: its last line has no end, expected the whole table as it was written: was it "
            f"cut off when it was copied? Copy it again, or remove it and run its command again"
        )
    return rows


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


def variant_of(row: Mapping[str, Any]) -> str:
    """
    What tells the curves of a source apart: the variant, and the size of its RV if there are more.

    Examples
    --------
    >>> from scanfab.table.reading import variant_of
    >>> variant_of({"variant": "a", "rv": None}), variant_of({"variant": "c", "rv": 0.4})
    ('a', 'c RV 0.4')
    """
    rv = number_of(row, "rv")
    return str(row["variant"]) if rv is None else f"{row['variant']} RV {rv:g}"


def is_of_discs(rows: Iterable[Mapping[str, Any]]) -> bool:
    """
    Whether the void fabric has nothing across a coordinate plane: that of discs, in 2D.

    Examples
    --------
    >>> from scanfab.table.reading import is_of_discs
    >>> is_of_discs([{"gvs_xx": 0.49, "gvs_yy": 0.51, "gvs_zz": 0.0}])
    True
    """
    diagonal = ("gvs_xx", "gvs_yy", "gvs_zz")
    return any(number_of(row, name) == 0.0 for row in rows for name in diagonal)


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
