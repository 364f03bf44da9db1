"""Tables on a terminal: the columns that matter most, as many as there is room for, none cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

# characters between columns
GAP = 2


@dataclass(frozen=True)
class Column:
    """A column of a table for people."""

    title: str
    cells: list[str]
    rank: int = 0
    """Which are left out first where there is no room: the largest. Those of 0 always stay."""
    left: bool = False
    """Whether its cells stand to the left, as names do, and numbers do not."""

    @property
    def width(self) -> int:
        """In characters."""
        return max(map(len, [self.title, *self.cells]))


def print_columns(columns: Sequence[Column]) -> None:
    """The columns in their order, those left out that do not fit on the terminal."""
    from rich.console import Console
    from rich.table import Table

    room = Console().width
    shown = list(columns)
    while width_of(shown) > room and (last := max(shown, key=lambda one: one.rank)).rank:
        shown.remove(last)
    # what must stay is not cut either: a terminal that is too narrow for it wraps its lines
    console = Console(width=max(room, width_of(shown)))
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, GAP, 0, 0))
    for one in shown:
        table.add_column(one.title, justify="left" if one.left else "right", no_wrap=True)
    for cells in zip(*(one.cells for one in shown), strict=True):
        table.add_row(*cells)
    console.print(table)


def width_of(columns: Sequence[Column]) -> int:
    """Of a table of these columns, in characters."""
    return sum(one.width for one in columns) + GAP * (len(columns) - 1)


def spelt(value: Any, digits: int = 3) -> str:
    """A value in so many digits, and a dash for none."""
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)
