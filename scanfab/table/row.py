"""Rows of tables, their numbers, and how interactive sessions show them."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from scanfab.base.column import NoColumnError
from scanfab.base.typing import FloatArray

Rows = Sequence[Mapping[str, Any]]

# repr of a row: width of a "name=value" cell, and number of cells per line
WIDTH, PAIRS = 26, 3
# columns of fabric tables that a session shows, with titles; other tables show their first columns
SHOWN = {
    "source": "source",
    "frame": "frame",
    "block": "block",
    "strain": "strain",
    "shear_strain": "shear strain",
    "variant": "variant",
    "rv": "RV",
    "cutoff": "cut-off",
    "grains": "grains",
    "contacts": "contacts",
    "alpha_vs_axial": "α_vs axial",
    "alpha_c_axial": "α_c axial",
}
ANISOTROPIES = ("alpha_vs_axial", "alpha_c_axial")
# these columns are not shown if all rows have the same value
OFTEN_SAME = ("source", "strain", "shear_strain", "cutoff")
# number of columns shown, and number of rows shown at each end of a long table
MOST_COLUMNS, ENDS = 8, 5


class Row(Mapping[str, Any]):
    """
    One frame and variant of a fabric table: ``row.alpha_vs`` or ``row["alpha_vs"]``.

    A missing value is None. Lengths are in the dump's unit. A computed row has all columns
    (``scanfab.COLUMNS``); a row that is read from a file has the columns of the file.

    Parameters
    ----------
    **values
        Values by the names of their columns.

    Raises
    ------
    ScanfabError
        If there is no such column; the error is also a KeyError and an AttributeError.

    Examples
    --------
    >>> from scanfab import Row
    >>> row = Row(frame=0, variant="c", alpha_vs=0.0125)
    >>> row.alpha_vs == row["alpha_vs"]
    True
    >>> row.alpha_v
    Traceback (most recent call last):
    scanfab.base.column.NoColumnError: there is no column 'alpha_v': did you mean 'alpha_vs'?
    >>> row
    Row(frame=0                     variant='c'                 alpha_vs=0.0125)
    """

    __slots__ = ("_values",)
    _values: dict[str, Any]

    def __init__(self, /, **values: Any) -> None:
        self._values = values

    def __getitem__(self, name: str) -> Any:
        if name not in self._values:
            raise NoColumnError(name, tuple(self))
        return self._values[name]

    def __getattr__(self, name: str) -> Any:
        # Python itself looks up names such as __deepcopy__
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __repr__(self) -> str:
        # the values without each octant are meant for fits, not for readers
        names = [name for name in self if "_without_" not in name and "_half_" not in name]
        spelt = {n: f"{v:.4g}" if isinstance(v := self[n], float) else repr(v) for n in names}
        cells = [f"{n}={text}".ljust(WIDTH) for n, text in spelt.items() if self[n] is not None]
        lines = ["  ".join(cells[k : k + PAIRS]).rstrip() for k in range(0, len(cells), PAIRS)]
        return "Row({})".format("\n    ".join(lines))


def is_number(value: object) -> bool:
    """Whether a value is a finite number; bools and integers beyond all floats are not."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max


def number_of(row: Mapping[str, Any], name: str) -> float | None:
    """A row's number in a column; None if the column is missing or holds no number."""
    value = row.get(name)
    return float(value) if is_number(value) else None  # type: ignore[arg-type]


def numbers_of(rows: Iterable[Mapping[str, Any]], name: str) -> list[float]:
    """All numbers in a column; rows without a number are skipped."""
    return [value for row in rows if (value := number_of(row, name)) is not None]


def column_of(rows: Iterable[Mapping[str, Any]], name: str) -> FloatArray:
    """A column as an array, shape (rows,), with NaN for rows without a number."""
    return np.array([number_of(row, name) for row in rows], np.float64)


def variant_of(row: Mapping[str, Any]) -> str:
    """
    The variant of a row, with the size of its RV if there are several.

    Examples
    --------
    >>> from scanfab.table.row import variant_of
    >>> variant_of({"variant": "a", "rv": None}), variant_of({"variant": "c", "rv": 0.4})
    ('a', 'c RV 0.4')
    """
    rv = number_of(row, "rv")
    return str(row["variant"]) if rv is None else f"{row['variant']} RV {rv:g}"


def groups_of(rows: Iterable[Mapping[str, Any]]) -> dict[tuple[str, str], list[Any]]:
    """Group rows by source and :func:`variant_of`, in the order of frames in each group."""
    groups: dict[tuple[str, str], list[Any]] = {}
    for row in rows:
        groups.setdefault((row["source"], variant_of(row)), []).append(row)
    for group in groups.values():
        # the last frame is the headline, but parts of a series may be given in any order
        group.sort(key=lambda row: row.get("frame") or 0)
    return groups


def total_error(row: Mapping[str, Any], name: str) -> float | None:
    """
    The standard error to quote for an anisotropy; it combines scan and sample.

    Parameters
    ----------
    row : mapping
        Row of a fabric table.
    name : str
        ``alpha_vs_axial``: √(scan² + sample²), None if either part is missing.
        ``alpha_c_axial``: the error due to the sample, as contacts are counted, not scanned.

    Examples
    --------
    >>> from scanfab.table.row import total_error
    >>> row = {"alpha_vs_axial_se": 3e-4, "alpha_vs_axial_sample_se": 4e-4}
    >>> round(total_error(row, "alpha_vs_axial"), 7)
    0.0005
    """
    sample = number_of(row, f"{name}_sample_se")
    if name == "alpha_c_axial":
        return sample
    scan = number_of(row, f"{name}_se")
    return None if scan is None or sample is None else math.hypot(scan, sample)


def total_errors(rows: Iterable[Mapping[str, Any]], name: str) -> FloatArray:
    """:func:`total_error` of each row, shape (rows,), with NaN where it is not known."""
    return np.array([total_error(row, name) for row in rows], np.float64)


def same_in_all(rows: Rows, names: Iterable[str]) -> set[str]:
    """Those of the columns that have one value in all rows, or are in none."""
    return {name for name in names if len({row.get(name) for row in rows}) <= 1}


def with_error(value: float | None, error: float | None, alone: str = ".3g") -> str:
    """
    A value and its standard error, to two digits of the error; a dash for a missing value.

    ``alone`` is the format of a value whose error is not known.

    Examples
    --------
    >>> from scanfab.table.row import with_error
    >>> with_error(0.0123456, 0.00078)
    '0.01235 ± 0.00078'
    """
    if value is None:
        return "-"
    if error is None or not error > 0:
        return f"{value:{alone}}"
    # count the digits of the rounded error: 0.00099999 is 0.0010
    decimals = max(0, 1 - math.floor(math.log10(float(f"{error:.1e}"))))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def shown_cells(rows: Rows, names: Sequence[str]) -> list[list[str]]:
    """Titles, then the cells of the first and last rows; dots stand for those between them."""

    def cell(row: Mapping[str, Any], name: str) -> str:
        value = row.get(name)
        if name in ANISOTROPIES:
            # quote the total error, as the error of the scan alone would be too small
            return with_error(number_of(row, name), total_error(row, name))
        return "-" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)

    shown = [*names[:MOST_COLUMNS], *(name for name in names[MOST_COLUMNS:] if name == "rv")]
    if any(name in names for name in ANISOTROPIES):
        same = same_in_all(rows, OFTEN_SAME)
        shown = [name for name in SHOWN if name in names and name not in same]
    is_long = len(rows) > 2 * ENDS + 1
    at_ends = [*rows[:ENDS], *rows[-ENDS:]] if is_long else rows
    lines = [[cell(row, name) for name in shown] for row in at_ends]
    if is_long:
        lines.insert(ENDS, ["..."] * len(shown))
    return [[SHOWN.get(name, name) for name in shown], *lines]
