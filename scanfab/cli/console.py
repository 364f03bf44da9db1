"""What goes to people: warnings on standard error, tables on a terminal, rows as CSV."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.cli.options import AS_CSV
from scanfab.cli.talk import QUIET, level
from scanfab.pipeline.options import as_options
from scanfab.pipeline.told import Told

if TYPE_CHECKING:
    from scanfab.base.column import Column
    from scanfab.table.row import Row
    from scanfab.table.writing import Excerpt

Rows = Sequence[Mapping[str, Any]]

# characters between columns
GAP = 2
# the columns of a fabric table on a terminal, in their order
TITLES = {
    "frame": "frame",
    "strain": "strain",
    "block": "block",
    "x": "x",
    "y": "y",
    "z": "z",
    "r_inner": "from r",
    "r_outer": "to r",
    "variant": "variant",
    "grains": "grains",
    "contacts": "contacts",
    "coordination": "coordination",
    "solid_fraction": "solid fraction",
    "mean_length": "mean length",
    "alpha_vs": "α_vs",
    "alpha_vs_axial": "α_vs axial",
    "total": "± total",
    "alpha_vs_axial_se": "± scan",
    "alpha_vs_axial_sample_se": "± sample",
    "alpha_c_axial": "α_c axial",
    "at_surface": "at surface",
}
# those that are left out where there is no room, the least telling first
OPTIONAL = (
    "z", "y", "x", "r_outer", "r_inner", "solid_fraction", "coordination", "mean_length",
    "alpha_vs", "alpha_vs_axial_sample_se", "alpha_vs_axial_se", "at_surface",
)  # fmt: skip


@contextmanager
def reported_warnings() -> Iterator[Told]:
    """Warnings and notes of scanfab as single lines on standard error, each text once."""
    told, is_quiet = Told(), level() == QUIET

    def show(message: Any, category: type[Warning], *rest: Any, **more: Any) -> None:
        is_note = issubclass(category, ScanfabNote)
        if told.add(category, str(message)) and not (is_note and is_quiet):
            kind = "note" if is_note else "warning"
            click.echo(f"scanfab: {kind}: {as_options(str(message))}", err=True)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", ScanfabWarning)
        warnings.simplefilter("always", ScanfabNote)
        warnings.showwarning = show
        yield told


class Command(click.Command):
    """A command that tells warnings and notes; the context has what was told as its ``obj``."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        with reported_warnings() as ctx.obj:
            return super().invoke(ctx)


def is_readable() -> bool:
    """Whether results go to a terminal, as a table to be read, and not as CSV."""
    return sys.stdout.isatty() and not click.get_current_context().meta.get(AS_CSV)


def print_csv(
    rows: Iterable[Mapping[str, Any]], excerpt: Excerpt, columns: Sequence[Column]
) -> None:
    """Rows as CSV on standard output, each as it comes."""
    from scanfab.table.formats import OWN_FORMATS
    from scanfab.table.writing import write_to

    write_to(sys.stdout, OWN_FORMATS[0], rows, columns, excerpt)


def print_table(rows: Iterable[Row], excerpt: Excerpt) -> None:
    """A fabric table on standard output: the columns that were asked for, or those that fit."""
    from scanfab.base.column import DEFAULT_DIGITS
    from scanfab.table.row import total_error

    shown = [{**row, "total": total_error(row, "alpha_vs_axial")} for row in rows]
    # three digits say enough on a terminal, unless others were asked for
    digits = 3 if excerpt.digits == DEFAULT_DIGITS else excerpt.digits
    if excerpt.fields:
        print_rows(shown, {name: name for name in excerpt.fields}, digits=digits)
    else:
        print_rows(shown, TITLES, OPTIONAL, digits)


def print_rows(
    rows: Rows, titles: Mapping[str, str], optional: Sequence[str] = (), digits: int = 3
) -> None:
    """
    Rows as a table on standard output; no column is cut.

    ``titles`` are those of the columns, by their names and in their order; columns that the rows do
    not have are left out, and so are the ``optional`` ones, in this order, where there is no room.
    """
    from rich.console import Console
    from rich.table import Table

    cells = {
        name: [spelt(row[name], digits) for row in rows]
        for name in titles
        if not rows or name in rows[0]
    }
    widths = {name: max(map(len, [titles[name], *cells[name]])) + GAP for name in cells}
    room = Console().width + GAP
    for name in optional:
        if sum(widths.values()) > room:
            widths.pop(name, None)
    # a terminal that is too narrow for the columns that stay wraps their lines
    console = Console(width=max(room, sum(widths.values())) - GAP, markup=False)
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, GAP, 0, 0))
    for name in widths:
        is_text = any(isinstance(row[name], str) for row in rows)
        table.add_column(titles[name], justify="left" if is_text else "right", no_wrap=True)
    for number in range(len(rows)):
        table.add_row(*(cells[name][number] for name in widths))
    console.print(table)


def spelt(value: Any, digits: int = 3) -> str:
    """A value in so many digits, and a dash for none."""
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)
