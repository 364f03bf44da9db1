"""A table as people see it in a session: the values that matter, with their errors."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from typing import Any

from scanfab.table.reading import number_of, total_error

Rows = Sequence[Mapping[str, Any]]

# what of a fabric table is shown, with its title; of other tables the first columns
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
MOST_COLUMNS = 8
# of a long table, from both ends
ENDS = 5


def as_text(rows: Rows, names: Sequence[str]) -> str:
    """A few lines: how many rows, and those at both ends."""
    heads, cells = _table(rows, names)
    if not cells:
        return f"Table of {_count(rows)}"
    widths = [max(map(len, column)) for column in zip(heads, *cells, strict=True)]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True))
        for line in (heads, *cells)
    ]
    return "\n".join([f"Table of {_count(rows)}", *lines])


def as_html(rows: Rows, names: Sequence[str]) -> str:
    """The same for a notebook."""
    heads, cells = _table(rows, names)
    head = "".join(f"<th>{html.escape(one)}</th>" for one in heads)
    body = "".join(
        f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in line)}</tr>" for line in cells
    )
    return (
        f"<table><caption>Table of {_count(rows)}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def with_error(value: float | None, error: float | None) -> str:
    """
    A value to two digits of its standard error; a dash for none.

    Examples
    --------
    >>> from scanfab.table.preview import with_error
    >>> with_error(0.0123456, 0.00078)
    '0.01235 ± 0.00078'
    """
    if value is None:
        return "-"
    if error is None or not error > 0:
        return f"{value:.3g}"
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def _count(rows: Rows) -> str:
    return f"{len(rows)} row{'' if len(rows) == 1 else 's'}"


def _table(rows: Rows, names: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Titles, and the cells of each line; dots for the rows in the middle of a long table."""
    shown = _shown(rows, names)
    is_long = len(rows) > 2 * ENDS + 1
    lines = [*rows[:ENDS], *rows[-ENDS:]] if is_long else list(rows)
    cells = [[_cell(row, name) for name in shown] for row in lines]
    if is_long:
        cells.insert(ENDS, ["..."] * len(shown))
    return [SHOWN.get(name, name) for name in shown], cells


def _shown(rows: Rows, names: Sequence[str]) -> list[str]:
    """The columns to show: of a fabric table those that tell its rows apart, and the results."""
    if "alpha_vs_axial" not in names and "alpha_c_axial" not in names:
        return list(names[:MOST_COLUMNS])
    known = [name for name in SHOWN if name in names]
    same = [
        name
        for name in ("source", "strain", "shear_strain", "cutoff")
        if len({row.get(name) for row in rows}) <= 1
    ]
    return [name for name in known if name not in same]


def _cell(row: Mapping[str, Any], name: str) -> str:
    value = row.get(name)
    if name in ("alpha_vs_axial", "alpha_c_axial"):
        # without the sample's part the scan's alone would say too little
        return with_error(number_of(row, name), total_error(row, name))
    if isinstance(value, float):
        return f"{value:.3g}"
    return "-" if value is None else str(value)
