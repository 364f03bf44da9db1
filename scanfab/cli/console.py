"""What goes to people: warnings on standard error, tables on a terminal."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import click

from scanfab.base import column
from scanfab.base.column import DEFAULT_DIGITS
from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.cli.options import AS_CSV
from scanfab.cli.tables import Column, print_columns, spelt
from scanfab.cli.talk import Level, level
from scanfab.pipeline.options import as_options
from scanfab.pipeline.told import Told
from scanfab.table.row import Row
from scanfab.table.writing import Excerpt

# titles of the columns that a terminal always shows, and of those for which there may be room, the
# most telling first
KEYS = {
    "frame": "frame",
    "block": "block",
    "strain": "strain",
    "variant": "variant",
    "grains": "grains",
    "contacts": "contacts",
    "alpha_vs_axial": "α_vs axial",
    "total": "± total",
    "alpha_c_axial": "α_c axial",
}
MORE = {
    "at_surface": "at surface",
    "alpha_vs_axial_se": "± scan",
    "alpha_vs_axial_sample_se": "± sample",
    "alpha_vs": "α_vs",
    "mean_length": "mean length",
    "coordination": "coordination",
    "solid_fraction": "solid fraction",
    "r_inner": "from r",
    "r_outer": "to r",
    "x": "x",
    "y": "y",
    "z": "z",
}
ORDER = (
    "frame", "strain", "block", "x", "y", "z", "r_inner", "r_outer", "variant",
    "grains", "contacts", "coordination", "solid_fraction",
    "mean_length", "alpha_vs", "alpha_vs_axial", "total", "alpha_vs_axial_se",
    "alpha_vs_axial_sample_se", "alpha_c_axial", "at_surface",
)  # fmt: skip


@contextmanager
def reported_warnings() -> Iterator[Told]:
    """Warnings and notes of scanfab as single lines on standard error, each text once."""
    told, is_quiet = Told(), level() is Level.QUIET

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


def is_readable() -> bool:
    """Whether results go to a terminal, as a table to be read, and not as CSV."""
    return sys.stdout.isatty() and not click.get_current_context().meta.get(AS_CSV)


def announce_compiling() -> None:
    """A line on standard error if something has to be compiled first."""
    from scanfab.base.jit import kernel_folder, when_compiling

    _, problem = kernel_folder()
    kept = f"it cannot be kept: {problem}" if problem else "it is kept for later runs"
    words = (
        f"scanfab: compiling what no earlier run has needed: seconds, or minutes on a busy "
        f"machine; {kept}"
    )
    if level() is not Level.QUIET:
        when_compiling(lambda: click.echo(words, err=True))


def print_csv(
    rows: Iterable[Mapping[str, Any]], excerpt: Excerpt, columns: Sequence[column.Column]
) -> None:
    """Rows as CSV on standard output, each as it comes."""
    from scanfab.table.formats import OWN_FORMATS
    from scanfab.table.writing import write_to

    write_to(sys.stdout, OWN_FORMATS[0], rows, columns, excerpt)


def print_table(rows: Iterable[Row], excerpt: Excerpt) -> None:
    """A readable table on standard output: the columns that were asked for, or those that fit."""
    from scanfab.table.row import total_error

    values = [dict(row) for row in rows]
    for row in values:
        row["total"] = total_error(row, "alpha_vs_axial")
    # three digits say enough on a terminal, unless others were asked for
    digits = 3 if excerpt.digits == DEFAULT_DIGITS else excerpt.digits
    titles = {name: name for name in excerpt.fields} or {**KEYS, **MORE}
    ranks = {} if excerpt.fields else {name: rank for rank, name in enumerate(MORE, start=1)}
    print_columns(
        [
            Column(titles[name], [spelt(row[name], digits) for row in values], ranks.get(name, 0))
            for name in excerpt.fields or ORDER
            # only maps have blocks
            if excerpt.fields or not values or name in values[0]
        ]
    )
