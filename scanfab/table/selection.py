"""Which rows of fabric tables to compare or report: checked, of one cut-off, each frame once."""

from __future__ import annotations

import math
import os
import reprlib
import textwrap
import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scanfab.base.errors import ScanfabWarning, SettingsError
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS
from scanfab.table.reading import is_number, variant_of

Rows = list[dict[str, Any]]

NEEDED = ("source", "frame", "strain", "variant", "alpha_vs_axial", "alpha_c_axial")
NAMES = ("source", "variant")
NUMBERS = tuple(one.name for one in (*OWN_COLUMNS, *MORE_COLUMNS) if one.kind in (int, float))
# columns that no fabric table has, and the table that they give away
OTHER_TABLES = {
    ("alpha_vs_axial_norm", "alpha_c_axial_norm"): "a table of scanfab compare",
    ("slope", "slope_origin"): "the summary of scanfab compare",
    ("variants", "difference"): "the differences of scanfab compare",
    ("ladder", "value"): "a table of scanfab calibrate",
    ("block", "at_surface"): "a table of scanfab map",
    ("radius_min", "contacts_from"): "the frames of scanfab inspect",
}
# cut-offs that agree in three digits, as they are printed for people, are the same
ROUNDING = 5e-3


def choose_rows(
    tables: Iterable[tuple[Path | str, Iterable[Mapping[str, Any]]]],
    cutoff: float | None = None,
    labels: Sequence[str] | None = None,
) -> list[Rows]:
    """
    The rows of fabric tables that stand side by side, for each table in order.

    Rows that an earlier table holds already count once, with a warning.

    Parameters
    ----------
    tables : iterable of (name, rows)
        The name, for messages, and the rows by column, as
        :func:`scanfab.table.reading.read_rows` returns them.
    cutoff : float, optional
        Keep the rows of this cut-off, in the unit of the tables, to three digits.
    labels : sequence of str, optional
        A name for each table in place of its source, so that two runs of one sample are two.

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
    named = [(str(name), [_with_source(row) for row in rows]) for name, rows in tables]
    if labels and len(labels) != len(named):
        raise SettingsError(
            f"labels: expected one for each table, in their order: found {len(labels)} for "
            f"{len(named)}"
        )
    chosen = []
    for name, rows in named:
        check_rows(rows, name)
        chosen.append((name, rows if cutoff is None else _of_cutoff(name, rows, cutoff)))
    if labels:
        return [_labelled(rows, label) for (_, rows), label in zip(chosen, labels, strict=True)]
    return _each_once(chosen)


def _with_source(row: Mapping[str, Any]) -> dict[str, Any]:
    """A packing without a name has an empty source, which CSV cannot tell from none."""
    return {**row, "source": ""} if "source" in row and row["source"] is None else dict(row)


def check_rows(rows: Sequence[Mapping[str, Any]], table: str = "") -> None:
    """
    SettingsError if rows are not those of a fabric table; names table, row and column.

    Tables come from anywhere: a word or a list among the numbers must not go on as one.
    """
    before = f"{table}: " if table else ""
    if rows:
        _check_columns(before, rows[0])
    for number, row in enumerate(rows, start=1):
        where = f"{before}row {number}"
        _check_columns(f"{where}: ", row)
        for name in NAMES:
            if not isinstance(row[name], str):
                raise SettingsError(f"{where}: {name}: expected a name, {_found(row[name])}")
        for name in NUMBERS:
            if row.get(name) is not None and not is_number(row[name]):
                raise SettingsError(f"{where}: {name}: expected a number, {_found(row[name])}")
        if row["frame"] is None or row["frame"] % 1 != 0:
            raise SettingsError(f"{where}: frame: expected a whole number, {_found(row['frame'])}")


def _check_columns(where: str, row: Mapping[str, Any]) -> None:
    for columns, other in OTHER_TABLES.items():
        if all(name in row for name in columns):
            raise SettingsError(
                f"{where}this is {other}: expected one of scanfab compute, from which it was made"
            )
    missing = [name for name in NEEDED if name not in row]
    if missing:
        raise SettingsError(
            f"{where}there is no column {', '.join(missing)}: expected a table of scanfab compute, "
            f"found the columns {textwrap.shorten(', '.join(map(str, row)), 200)}"
        )


def _found(value: object) -> str:
    return f"found {reprlib.repr(value)}"


def _of_cutoff(name: str, rows: Rows, cutoff: float) -> Rows:
    """The rows of one cut-off; of a frame without grains, which has none, one a variant."""
    known = sorted({row["cutoff"] for row in rows if row.get("cutoff") is not None})
    nearest = min(known, key=lambda one: abs(one - cutoff), default=math.nan)
    if not abs(nearest - cutoff) <= ROUNDING * abs(nearest):
        there = ", ".join(f"{one:.3g}" for one in known) or "none in this table"
        raise SettingsError(
            f"{name}: no row has the cut-off {cutoff:g}: expected one of the table's: {there}"
        )
    empty = {
        (row["source"], row["frame"], variant_of(row)): row
        for row in reversed(rows)
        if row.get("cutoff") is None
    }
    return [
        row for row in rows
        if row.get("cutoff") == nearest
        or row is empty.get((row["source"], row["frame"], variant_of(row)))
    ]  # fmt: skip


def _labelled(rows: Rows, label: str) -> Rows:
    """Rows by the label; the sources of a table of several stay behind it."""
    several = len({row["source"] for row in rows}) > 1
    return [{**row, "source": f"{label}, {row['source']}" if several else label} for row in rows]


def _each_once(tables: Sequence[tuple[str, Rows]]) -> list[Rows]:
    """Without the rows that an earlier table holds, however the path of the source is spelt."""
    known: dict[tuple[Any, ...], tuple[str, Mapping[str, Any]]] = {}
    chosen = []
    for name, rows in tables:
        new = []
        for row in rows:
            key = (_place(row["source"]), row["frame"], variant_of(row), row.get("cutoff"))
            earlier, twin = known.setdefault(key, (name, row))
            if twin is row or {**twin, "source": ""} != {**row, "source": ""}:
                new.append(row)
            else:
                warnings.warn(
                    f"{name}: rows of {row['source']} that {earlier} holds already count once",
                    ScanfabWarning,
                    stacklevel=3,
                )
        chosen.append(new)
    return chosen


def _place(source: str) -> str:
    """One spelling of a source that is a path."""
    return os.path.abspath(source) if source not in ("", "-") else source
