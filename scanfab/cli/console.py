"""What goes to people: warnings and progress on standard error, tables on a terminal."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from scanfab.errors import ScanfabNote, ScanfabWarning, SkippedFrameWarning
from scanfab.table import Row

__all__ = ["announce_compiling", "print_table", "reported_warnings", "with_progress"]

# title of each column on a terminal, and the width of terminal from which it is shown
SHOWN = {
    "frame": ("frame", 0),
    "strain": ("strain", 0),
    "variant": ("variant", 0),
    "grains": ("grains", 0),
    "contacts": ("contacts", 0),
    "coordination": ("coordination", 120),
    "solid_fraction": ("solid fraction", 120),
    "mean_length": ("mean length", 100),
    "alpha_vs": ("α_vs", 100),
    "alpha_vs_axial": ("α_vs axial", 0),
    "alpha_vs_axial_se": ("±", 0),
    "alpha_c_axial": ("α_c axial", 0),
}


class Told:
    """What the warnings amount to."""

    skipped = 0
    """Frames that were skipped."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        """Warnings, each text once."""
        self.notes: list[str] = []
        """Notes, each text once."""

    def hear(self, category: type[Warning], text: str) -> None:
        """Tell a warning or note of scanfab, if it is new."""
        self.skipped += issubclass(category, SkippedFrameWarning)
        known, kind = (
            (self.notes, "note") if issubclass(category, ScanfabNote) else (self.texts, "warning")
        )
        if issubclass(category, ScanfabWarning | ScanfabNote) and text not in known:
            known.append(text)
            click.echo(f"scanfab: {kind}: {text}", err=True)


@contextmanager
def reported_warnings() -> Iterator[Told]:
    """Warnings and notes of scanfab as single lines on standard error, each text once."""
    told = Told()

    def show(message: Any, category: type[Warning], *rest: Any, **more: Any) -> None:
        told.hear(category, str(message))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", ScanfabWarning)
        warnings.simplefilter("always", ScanfabNote)
        warnings.showwarning = show
        yield told


def announce_compiling() -> None:
    """A line on standard error if something has to be compiled first."""
    from scanfab.kernels.cache import when_compiling
    from scanfab.kernels.folder import kernel_folder

    problem = kernel_folder().problem
    kept = f"it cannot be kept: {problem}" if problem else "it is kept for later runs"
    when_compiling(
        lambda: click.echo(
            f"scanfab: compiling what no earlier run has needed, 2 to 20 s; {kept}", err=True
        )
    )


def with_progress(rows: Iterable[Row]) -> Iterator[Row]:
    """The same rows, with a line of progress on standard error if it is a terminal."""
    if not sys.stderr.isatty():
        yield from rows
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("first frame")
        for row in rows:
            progress.update(task, description=f"{row.source}: frame {row.frame} done")
            yield row


def print_table(rows: Iterable[Row]) -> None:
    """A readable table on standard output."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    shown = {name: title for name, (title, width) in SHOWN.items() if width <= console.width}
    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in shown.values():
        table.add_column(title, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*(_spell(getattr(row, name)) for name in shown))
    console.print(table)


def _spell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
