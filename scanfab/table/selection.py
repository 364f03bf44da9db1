"""Choosing the rows of fabric tables to compare or report: one cut-off, each frame once."""

from __future__ import annotations

import math
import os
import reprlib
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scanfab.base.errors import SettingsError, warn
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS
from scanfab.table.row import is_number, variant_of

Rows = list[dict[str, Any]]

NEEDED = ("source", "frame", "strain", "variant", "alpha_vs_axial", "alpha_c_axial")
NAMES = ("source", "variant")
NUMBERS = tuple(one.name for one in (*OWN_COLUMNS, *MORE_COLUMNS) if one.kind in (int, float))
# columns that only other tables have, and how to call these tables
OTHER_TABLES = {
    "alpha_vs_axial_norm": "a table of scanfab compare",
    "slope_origin": "the summary of scanfab compare",
    "difference": "the differences of scanfab compare",
    "at_surface": "a table of scanfab map",
}
# cut-offs that agree in three digits, as they are printed, are the same
ROUNDING = 5e-3


def choose_rows(
    tables: Iterable[tuple[Path | str, Iterable[Mapping[str, Any]]]],
    cutoff: float | None = None,
    labels: Sequence[str] | None = None,
) -> list[Rows]:
    """
    The rows of several fabric tables to compare, for each table in order.

    A row that an earlier table holds too is left out, with a warning.

    Parameters
    ----------
    tables : iterable of (name, rows)
        The name, for messages, and the rows by column, as :func:`scanfab.read_rows` returns them.
    cutoff : float, optional
        Keep the rows of this cut-off, in the unit of the tables, to three digits.
    labels : sequence of str, optional
        A name for each table in place of its source, to compare two runs of one sample.

    Raises
    ------
    SettingsError
        If a table is not one of compute, a value is of another kind, no row has the cut-off, or
        there are not as many labels as tables.

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
    if labels and len(labels) != len(named):
        raise SettingsError(
            f"labels: expected one for each table, in their order: found {len(labels)} for "
            f"{len(named)}"
        )
    for number, (name, rows) in enumerate(named):
        for row in rows:
            if row.get("source", "") is None:
                row["source"] = ""  # the source of a packing without a name, which CSV leaves empty
        check_rows(rows, name)
        if cutoff is not None:
            named[number] = name, _of_cutoff(name, rows, cutoff)
    if labels:
        for (_, rows), label in zip(named, labels, strict=True):
            several = len({row["source"] for row in rows}) > 1
            for row in rows:
                row["source"] = f"{label}, {row['source']}" if several else label
        return [rows for _, rows in named]
    return _each_once(named)


def check_rows(rows: Sequence[Mapping[str, Any]], table: str = "") -> None:
    """
    SettingsError if rows are not those of a fabric table; it names table, row and column.

    Other programs write tables too, so a word or a list may stand where a number should be.
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
        wrong = [(name, "a name") for name in NAMES if not isinstance(row[name], str)]
        numbers = [name for name in NUMBERS if row.get(name) is not None]
        wrong += [(name, "a number") for name in numbers if not is_number(row[name])]
        if not wrong and (row["frame"] is None or row["frame"] % 1 != 0):
            wrong = [("frame", "a whole number")]
        for name, expected in wrong:
            found = reprlib.repr(row[name])
            raise SettingsError(f"{where}{name}: expected {expected}, found {found}")


def _of_cutoff(name: str, rows: Rows, cutoff: float) -> Rows:
    """The rows of one cut-off; frames without grains have no cut-off and keep a row a variant."""
    known = sorted({row["cutoff"] for row in rows if row.get("cutoff") is not None})
    nearest = min(known, key=lambda one: abs(one - cutoff), default=math.nan)
    if not abs(nearest - cutoff) <= ROUNDING * abs(nearest):
        there = ", ".join(f"{one:.3g}" for one in known) or "none in this table"
        raise SettingsError(
            f"{name}: no row has the cut-off {cutoff:g}: expected one of the table's: {there}"
        )
    kept: dict[tuple[Any, ...], dict[str, Any]] = {}
    for place, row in enumerate(rows):
        if row.get("cutoff") == nearest:
            kept[place,] = row
        elif row.get("cutoff") is None:
            kept.setdefault((row["source"], row["frame"], variant_of(row)), row)
    return list(kept.values())


def _each_once(tables: Sequence[tuple[str, Rows]]) -> list[Rows]:
    """Leaves out rows that an earlier table holds, however the path of their source is spelt."""
    known: dict[tuple[Any, ...], tuple[str, dict[str, Any]]] = {}
    chosen: list[Rows] = []
    for name, rows in tables:
        chosen.append([])
        for row in rows:
            source = row["source"]
            place = os.path.abspath(source) if source not in ("", "-") else source
            key = (place, row["frame"], variant_of(row), row.get("cutoff"))
            earlier, twin = known.setdefault(key, (name, row))
            if twin is row or {**twin, "source": source} != row:
                chosen[-1].append(row)
            else:
                warn(f"{name}: rows of {source} that {earlier} holds already count once")
    return chosen
