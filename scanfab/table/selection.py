"""Choose rows of fabric tables to compare or report: one cut-off, and each frame once."""

from __future__ import annotations

import math
import os
import reprlib
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scanfab.base.errors import SettingsError, warn
from scanfab.table.columns import KINDS
from scanfab.table.row import is_number, variant_of

Rows = list[dict[str, Any]]

NEEDED = ("source", "frame", "strain", "variant", "alpha_vs_axial", "alpha_c_axial")
NUMBERS = tuple(name for name, kind in KINDS.items() if kind in (int, float))
# a column that only tables of maps have
MAP = "block"
# columns that show that a table is no fabric table, with a name for such a table
OTHER_TABLES = {
    "alpha_vs_axial_norm": "a table of scanfab compare",
    "slope_origin": "the summary of scanfab compare",
    "difference": "the differences of scanfab compare",
    MAP: "a table of scanfab map, which scanfab report shows",
}
# cut-offs that agree in the three digits that are printed count as equal
ROUNDING = 5e-3


def choose_rows(
    tables: Iterable[tuple[Path | str, Iterable[Mapping[str, Any]]]],
    cutoff: float | None = None,
    labels: Sequence[str] | None = None,
) -> list[Rows]:
    """
    Choose the rows of several fabric tables that are to be compared, table by table.

    A row that an earlier table also holds is dropped with a warning.

    Parameters
    ----------
    tables : iterable of (name, rows)
        The name of each table for messages, and its rows as :func:`scanfab.read_rows` returns them.
    cutoff : float, optional
        Keep only rows with this cut-off, in the unit of the tables, to three digits.
    labels : sequence of str, optional
        A name for each table in place of its source, to compare two runs of the same sample.

    Raises
    ------
    SettingsError
        If a table is no fabric table, a value has the wrong kind, no row has the cut-off, or the
        number of labels is not that of the tables.

    Examples
    --------
    >>> from scanfab.table.selection import choose_rows
    >>> row = dict(source="s", frame=0, strain=None, variant="c", cutoff=1.0,
    ...            alpha_vs_axial=0.01, alpha_c_axial=0.1)
    >>> table = [row, {**row, "cutoff": 2.0}]
    >>> (rows,) = choose_rows([("t.csv", table)], cutoff=2.0, labels=["new"])
    >>> [(row["source"], row["cutoff"]) for row in rows]
    [('new', 2.0)]
    """
    named = [(str(name), [dict(row) for row in rows]) for name, rows in tables]
    check_labels(labels, len(named))
    for number, (name, rows) in enumerate(named):
        check_rows(rows, name)
        if cutoff is not None and rows:
            named[number] = name, _of_cutoff(name, rows, cutoff)
    if labels:
        for (_, rows), label in zip(named, labels, strict=True):
            several = len({row["source"] for row in rows}) > 1
            for row in rows:
                row["source"] = f"{label}, {row['source']}" if several else label
        return [rows for _, rows in named]
    return _each_once(named)


def check_labels(labels: Sequence[str] | None, tables: int) -> None:
    """Raise SettingsError unless there is one label for each table, or none at all."""
    if isinstance(labels, str) or len(labels or ()) not in (0, tables):
        found = repr(labels) if isinstance(labels, str) else len(labels or ())
        raise SettingsError(f"labels: expected one per table: {tables}, found {found}")


def check_rows(rows: Sequence[Mapping[str, Any]], table: str = "") -> None:
    """
    Raise SettingsError if rows are not from a fabric table; it names table, row and column.

    Other programs also write tables, so a word or a list may be found in place of a number.
    """
    before = f"{table}: " if table else ""
    for number, row in enumerate(rows, start=1):
        where = f"{before}row {number}: "
        other = [text for name, text in OTHER_TABLES.items() if name in row]
        missing = [name for name in NEEDED if name not in row]
        if other or missing:
            problem = f"this is {other[0]}" if other else f"there is no column {', '.join(missing)}"
            raise SettingsError(
                f"{where if number > 1 else before}{problem}: expected a table of scanfab compute, "
                f"found the columns {textwrap.shorten(', '.join(map(str, row)), 200)}"
            )
        wrong = [(k, "a name") for k in ("source", "variant") if not isinstance(row[k], str)]
        numbers = [name for name in NUMBERS if row.get(name) is not None]
        wrong += [(name, "a number") for name in numbers if not is_number(row[name])]
        if not wrong and (row["frame"] is None or row["frame"] % 1 != 0):
            wrong = [("frame", "a whole number")]
        if wrong:
            (name, expected), found = wrong[0], reprlib.repr(row[wrong[0][0]])
            raise SettingsError(f"{where}{name}: expected {expected}, found {found}")


def _of_cutoff(name: str, rows: Rows, cutoff: float) -> Rows:
    """Rows with one cut-off; a frame without grains has none and keeps one row per variant."""
    cutoffs = sorted({row["cutoff"] for row in rows if row.get("cutoff") is not None})
    nearest = min(cutoffs, key=lambda value: abs(value - cutoff), default=math.nan)
    if not abs(nearest - cutoff) <= ROUNDING * abs(nearest):
        listed = ", ".join(f"{value:.3g}" for value in cutoffs) or "none in this table"
        expected = f"expected a cut-off of the table: {listed}"
        raise SettingsError(f"{name}: no row has the cut-off {cutoff:g}: {expected}")
    kept: dict[tuple[Any, ...], dict[str, Any]] = {}
    for place, row in enumerate(rows):
        if row.get("cutoff") == nearest:
            kept[place,] = row
        elif row.get("cutoff") is None:
            kept.setdefault((row["source"], row["frame"], variant_of(row)), row)
    return list(kept.values())


def _each_once(tables: Sequence[tuple[str, Rows]]) -> list[Rows]:
    """Drop rows that an earlier table also holds, even if it spells the source's path otherwise."""
    seen: dict[tuple[Any, ...], tuple[str, dict[str, Any]]] = {}
    chosen: list[Rows] = []
    for name, rows in tables:
        chosen.append([])
        for row in rows:
            source = row["source"]
            place = os.path.abspath(source) if source not in ("", "-") else source
            key = (place, row["frame"], variant_of(row), row.get("cutoff"))
            earlier, twin = seen.setdefault(key, (name, row))
            if twin is row or {**twin, "source": source} != row:
                chosen[-1].append(row)
            else:
                warn(f"{name}: rows of {source} that {earlier} also holds are used once")
    return chosen
