"""What goes to people: warnings on standard error, tables on a terminal, rows as CSV."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.cli.options import AS_CSV, usage_errors
from scanfab.cli.talk import QUIET, level
from scanfab.pipeline.options import as_options
from scanfab.pipeline.told import Told

if TYPE_CHECKING:
    from scanfab.base.column import Column
    from scanfab.table.row import Row
    from scanfab.table.writing import Excerpt

# characters between columns
GAP = 2
# heads of columns, where their names say less
TITLES = {
    "total": "± total",
    "alpha_vs_axial_total_se": "± total",
    "alpha_c_axial_sample_se": "± total",
    "alpha_vs_axial_se": "± scan",
    "alpha_vs_axial_sample_se": "± sample",
    "slope_se": "±",
    "r2": "R²",
}
# the columns of a fabric table on a terminal, of which the first ones always stay
SHOWN = (
    "frame", "strain", "block", "variant", "grains", "contacts", "alpha_vs_axial", "total",
    "alpha_c_axial", "at_surface", "alpha_vs_axial_se", "alpha_vs_axial_sample_se", "alpha_vs",
    "mean_length", "coordination", "solid_fraction", "r_inner", "r_outer", "x", "y", "z",
)  # fmt: skip
STAY = 9


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


def target(
    output: Path | None, columns: Sequence[Column], fields: str | None, digits: int
) -> Excerpt:
    """Which columns and digits are asked for; wrong usage if they, or a file, cannot be written."""
    from scanfab.table.writing import Excerpt, check_output

    with usage_errors():
        excerpt = Excerpt.make(columns, fields, digits)
        if output is not None:
            check_output(output)
        return excerpt


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
        print_rows(shown, excerpt.fields, len(excerpt.fields), digits)
    else:
        print_rows(shown, SHOWN, STAY, digits)


def print_rows(
    rows: Sequence[Mapping[str, Any]], columns: Sequence[str], stay: int, digits: int = 3
) -> None:
    """
    Some columns of rows as a table on standard output; none is cut.

    Columns that the rows do not have are left out; where there is no room, those on the right are
    left out too, but for the first ones, which ``stay``.
    """
    from rich.console import Console
    from rich.table import Table

    texts = {}
    for name in columns:
        if not rows or name in rows[0]:
            head = TITLES.get(name, name.replace("_", " ").replace("alpha ", "α_"))
            texts[name] = [head, *(spelt(row[name], digits) for row in rows)]
    widths = {name: max(map(len, column)) + GAP for name, column in texts.items()}
    room = Console().width + GAP
    for name in columns[: stay - 1 : -1]:
        if sum(widths.values()) > room:
            widths.pop(name, None)
    # a terminal that is too narrow for the columns that stay wraps their lines
    console = Console(width=max(room, sum(widths.values())) - GAP, markup=False)
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, GAP, 0, 0))
    for name in widths:
        is_text = any(isinstance(row[name], str) for row in rows)
        table.add_column(texts[name][0], justify="left" if is_text else "right", no_wrap=True)
    for line in zip(*(texts[name][1:] for name in widths), strict=True):
        table.add_row(*line)
    console.print(table)


def spelt(value: Any, digits: int = 3) -> str:
    """A value in so many digits, and a dash for none."""
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)
