"""Rows of tables, the numbers in their columns, and how a session shows them."""

from __future__ import annotations

import html
import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from scanfab.base.column import NoColumnError
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray

Rows = Sequence[Mapping[str, Any]]

# the repr of a row: width of a name with its value, and how many of them stand on a line
WIDTH, PAIRS = 26, 3
# columns of a fabric table that a session shows, with titles; other tables show their first ones
SHOWN = {
    "source": "source",
    "frame": "frame",
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
# columns that are left out if all rows have the same value
OFTEN_SAME = ("source", "strain", "shear_strain", "cutoff")
MOST_COLUMNS = 8
# rows that are shown at each end of a long table
ENDS = 5


class Record(Mapping[str, Any]):
    """A row whose columns are the fields of a dataclass."""

    __slots__ = ()

    def __getitem__(self, name: str) -> Any:
        if name not in list(self):
            raise NoColumnError(name, tuple(self))
        return getattr(self, name)

    def __iter__(self) -> Iterator[str]:
        return (one.name for one in fields(self))  # type: ignore[arg-type]

    def __len__(self) -> int:
        return len(fields(self))  # type: ignore[arg-type]


class Row(Mapping[str, Any]):
    """
    One frame and variant of a fabric table: ``row.alpha_vs`` or ``row["alpha_vs"]``.

    None is a value that does not exist. Lengths are in the dump's unit. A row that is computed has
    all columns (``scanfab.COLUMNS``), one that is read back has those of its file.

    Parameters
    ----------
    **values
        By the names of the columns.

    Raises
    ------
    ScanfabError
        If a column is asked for that does not exist; also a KeyError and an AttributeError.

    Examples
    --------
    >>> from scanfab import Row
    >>> row = Row(frame=0, variant="c", alpha_vs=0.0125)
    >>> row.alpha_vs == row["alpha_vs"]
    True
    >>> row.alpha_v
    Traceback (most recent call last):
    scanfab.base.column.NoColumnError: there is no column 'alpha_v': did you mean alpha_vs?
    >>> row
    Row(frame=0                     variant='c'                 alpha_vs=0.0125)
    """

    __slots__ = ("_values",)
    _values: dict[str, Any]

    def __init__(self, **values: Any) -> None:
        self._values = values

    def __getitem__(self, name: str) -> Any:
        try:
            return self._values[name]
        except KeyError:
            raise NoColumnError(name, tuple(self)) from None

    def __getattr__(self, name: str) -> Any:
        # Python itself looks for names like __deepcopy__
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
        # the values without each octant serve fits and are of no interest here
        names = [name for name in self if "_without_" not in name and "_half_" not in name]
        spelt = {n: f"{v:.4g}" if isinstance(v := self[n], float) else repr(v) for n in names}
        cells = [f"{n}={text}".ljust(WIDTH) for n, text in spelt.items() if self[n] is not None]
        lines = ["  ".join(cells[k : k + PAIRS]).rstrip() for k in range(0, len(cells), PAIRS)]
        return "Row({})".format("\n    ".join(lines))


def is_number(value: object) -> bool:
    """Whether a value is a finite number; a bool is not, nor an integer larger than any float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max


def number_of(row: Mapping[str, Any], name: str) -> float | None:
    """A row's number in a column; None if the column is missing or holds something else."""
    value = row.get(name)
    return float(value) if is_number(value) else None  # type: ignore[arg-type]


def numbers_of(rows: Iterable[Mapping[str, Any]], name: str) -> list[float]:
    """The numbers in a column, without the rows that have none."""
    return [value for row in rows if (value := number_of(row, name)) is not None]


def column_of(rows: Iterable[Mapping[str, Any]], name: str) -> FloatArray:
    """A column as an array, with NaN where a row has no number."""
    return np.array([number_of(row, name) for row in rows], np.float64)


def variant_of(row: Mapping[str, Any]) -> str:
    """
    The name of a curve of a source: the variant, and the size of its RV if there are several.

    Examples
    --------
    >>> from scanfab.table.row import variant_of
    >>> variant_of({"variant": "a", "rv": None}), variant_of({"variant": "c", "rv": 0.4})
    ('a', 'c RV 0.4')
    """
    rv = number_of(row, "rv")
    return str(row["variant"]) if rv is None else f"{row['variant']} RV {rv:g}"


def groups_of(rows: Iterable[Mapping[str, Any]]) -> dict[tuple[str, str], list[Any]]:
    """Rows by source and :func:`variant_of`, in the order in which these first appear."""
    groups: dict[tuple[str, str], list[Any]] = {}
    for row in rows:
        groups.setdefault((row["source"], variant_of(row)), []).append(row)
    return groups


def total_error(row: Mapping[str, Any], name: str) -> float | None:
    """
    The standard error to quote beside an anisotropy, which combines scan and sample.

    Parameters
    ----------
    row : mapping
        Of a fabric table.
    name : str
        ``alpha_vs_axial``: √(scan² + sample²), None where either part is not known.
        ``alpha_c_axial``: the sample's, as contacts are counted, not scanned.

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


def as_text(rows: Rows, names: Sequence[str]) -> str:
    """The number of rows, and the rows at both ends."""
    lines = _lines(rows, names) if rows else []
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    padded = ["  ".join(map(str.rjust, line, widths)) for line in lines]
    return "\n".join([f"Table of {counted(len(rows), 'row')}", *padded])


def as_html(rows: Rows, names: Sequence[str]) -> str:
    """The same for a notebook."""
    heads, *lines = [[html.escape(cell) for cell in line] for line in _lines(rows, names)]
    head = "".join(f"<th>{one}</th>" for one in heads)
    body = "".join(f"<tr><td>{'</td><td>'.join(line)}</td></tr>" for line in lines)
    return (
        f"<table><caption>Table of {counted(len(rows), 'row')}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def with_error(value: float | None, error: float | None) -> str:
    """
    A value to two digits of its standard error; a dash for none.

    Examples
    --------
    >>> from scanfab.table.row import with_error
    >>> with_error(0.0123456, 0.00078)
    '0.01235 ± 0.00078'
    """
    if value is None:
        return "-"
    if error is None or not error > 0:
        return f"{value:.3g}"
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def _lines(rows: Rows, names: Sequence[str]) -> list[list[str]]:
    """Titles, and the cells of each row; dots for the rows in the middle of a long table."""

    def cell(row: Mapping[str, Any], name: str) -> str:
        value = row.get(name)
        if name in ANISOTROPIES:
            # the error of the scan alone would say too little
            return with_error(number_of(row, name), total_error(row, name))
        return "-" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)

    shown = list(names[:MOST_COLUMNS])
    if any(name in names for name in ANISOTROPIES):
        same = [name for name in OFTEN_SAME if len({row.get(name) for row in rows}) <= 1]
        shown = [name for name in SHOWN if name in names and name not in same]
    is_long = len(rows) > 2 * ENDS + 1
    at_ends = [*rows[:ENDS], *rows[-ENDS:]] if is_long else rows
    lines = [[cell(row, name) for name in shown] for row in at_ends]
    if is_long:
        lines.insert(ENDS, ["..."] * len(shown))
    return [[SHOWN.get(name, name) for name in shown], *lines]
