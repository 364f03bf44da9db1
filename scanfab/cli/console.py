"""
What goes to people: warnings, notes and progress on standard error, tables on a terminal.

How much a command says beside its result is chosen by --quiet and --verbose.
"""

from __future__ import annotations

import logging
import shutil
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any

import click

from scanfab.base.column import DEFAULT_DIGITS
from scanfab.base.errors import ScanfabNote
from scanfab.base.spelling import spelt_time
from scanfab.io.files import without_temporary
from scanfab.pipeline.options import as_options
from scanfab.pipeline.told import Told

if TYPE_CHECKING:
    from rich.progress import Progress

    from scanfab.base.column import Column
    from scanfab.io.series import Series
    from scanfab.pipeline.options import Output
    from scanfab.table.row import Row
    from scanfab.table.writing import Excerpt


# seconds between lines of progress, where standard error is no terminal
EVERY = 60.0
# of the context of a command: --quiet or --verbose, and whether -o - asks for CSV
TALK, AS_CSV = "scanfab.talk", "scanfab.as_csv"
LEVELS = {
    "quiet": "No progress and no notes; warnings and errors stay.",
    "verbose": "Say which readers, files and versions are used, and how long steps take.",
}
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


class Command(click.Command):
    """A command that tells warnings and notes; the context has what was told as its ``obj``."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        flag: Any = {"is_flag": True, "expose_value": False, "callback": _choose_level}
        for name, words in LEVELS.items():
            self.params.append(click.Option([f"--{name}"], help=words, **flag))

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        with _reported_warnings() as ctx.obj:
            return super().invoke(ctx)


def _choose_level(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value and TALK in ctx.meta:
        raise click.UsageError("--quiet and --verbose exclude one another")
    if value:
        ctx.meta[TALK] = parameter.name


@contextmanager
def _reported_warnings() -> Iterator[Told]:
    """Warnings and notes of scanfab as single lines on standard error, each text once."""
    told, is_quiet = Told(), level() == "quiet"

    def show(message: Any, category: type[Warning], *rest: Any, **more: Any) -> None:
        is_note = issubclass(category, ScanfabNote)
        if told.add(category, str(message)) and not (is_note and is_quiet):
            say(f"{'note' if is_note else 'warning'}: {as_options(str(message))}")

    with warnings.catch_warnings():
        # those of other packages are heard and left out
        warnings.simplefilter("always")
        warnings.showwarning = show
        yield told


def level() -> str:
    """Which of the two options the command that runs now was given; empty for neither."""
    context = click.get_current_context(silent=True)
    return "" if context is None else context.meta.get(TALK, "")


def say(text: str) -> None:
    """A line on standard error."""
    click.echo(f"scanfab: {without_temporary(text)}", err=True)


def tell_inputs(every: Iterable[Series], workers: int) -> None:
    """With --verbose: versions, and what is read by which reader."""
    if level() != "verbose":
        return
    import platform
    from importlib.metadata import version

    used = ", ".join(f"{name} {version(name)}" for name in ("scanfab", "numpy", "numba"))
    say(f"{used}, Python {platform.python_version()}; {workers} workers")
    for one in every:
        for family in (one.grains, *one.contacts):
            reader = "no reader" if family.reader is None else family.reader.name
            files = f"{len(family.files)} files"
            say(f"{one.name}: {family.kind} from {family.pattern} by {reader}, {files}")


def announce(every: Iterable[Series] = (), workers: int = 1) -> None:
    """The same; and unless --quiet, say so if something has to be compiled first."""
    from scanfab.base.jit import kernel_folder, when_compiling

    tell_inputs(every, workers)
    _, problem = kernel_folder()
    kept = f"it cannot be kept: {problem}" if problem else "it is kept for later runs"
    words = "compiling what no earlier run has needed: seconds, or minutes on a busy machine"
    if level() != "quiet":
        when_compiling(lambda: say(f"{words}; {kept}"))


class _Work(logging.Handler):
    """Counts frames, and hears what the library, which never prints by itself, logs meanwhile."""

    def __init__(self, total: Callable[[], int | None], done: int, bar: Progress | None) -> None:
        super().__init__(logging.INFO)
        self.total, self.before, self.done = total, done, done
        self.begun = self.shown = time.monotonic()
        self.latest, self.bar = "", bar
        # asked for now, as the threads that log have no command
        self.prints = level() == "verbose"
        if bar is not None:
            bar.add_task(self.state(), completed=done, total=total())

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a message of the library; --verbose prints it."""
        self.latest = record.getMessage()
        if self.prints:
            say(self.latest)
        self.show()

    def advance(self) -> None:
        """A frame is done."""
        self.done += 1
        self.show()

    def show(self) -> None:
        """Say how far the work is: by the bar of a terminal, or by a line each minute."""
        if self.bar is not None:
            (task,) = self.bar.task_ids
            self.bar.update(task, description=self.state(), completed=self.done, total=self.total())
        elif time.monotonic() - self.shown >= EVERY:
            self.shown = time.monotonic()
            say(self.state())

    def state(self) -> str:
        """How many frames are done, how long the others will take, and the latest message."""
        total, now = self.total(), self.done - self.before
        if not total:
            return self.latest
        text = f"{self.done} of {total} frames"
        if now:
            rest = (time.monotonic() - self.begun) / now * max(total - self.done, 0)
            text += f", about {spelt_time(rest)}"
        return f"{text}; {self.latest}" if self.latest else text


@contextmanager
def working(
    total: Callable[[], int | None] = lambda: None, done: int = 0, prints: bool = False
) -> Iterator[Callable[[], None]]:
    """
    Show progress while something works; what is yielded is to be called after each frame.

    On a terminal progress is a bar with the time that is left, in a log at most a line a minute,
    with --quiet nothing; with --verbose each step is a line. A command that ``prints`` results as
    they come needs no bar if they go to a terminal.
    """
    if level() == "quiet":
        yield lambda: None
        return
    logger = logging.getLogger("scanfab")
    before = logger.level
    has_bar = sys.stderr.isatty() and not (prints and sys.stdout.isatty()) and level() != "verbose"
    with _bar() if has_bar else nullcontext() as bar:
        work = _Work(total, done, bar)
        logger.addHandler(work)
        logger.setLevel(logging.INFO)
        try:
            yield work.advance
        finally:
            logger.removeHandler(work)
            logger.setLevel(before)


def _bar() -> Progress:
    """A line on the terminal that is gone in the end."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    text = TextColumn("{task.description}")
    columns = (SpinnerColumn(), BarColumn(20), TimeElapsedColumn(), text)
    return Progress(*columns, console=Console(stderr=True), transient=True)


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
    Some columns of rows as a table on standard output; no cell is cut.

    Columns that the rows do not have are left out. Where there is no room, those on the right are
    left out too, but for the first ones, which ``stay``: they wrap on a narrow terminal.
    """
    texts = {}
    for name in (name for name in columns if not rows or name in rows[0]):
        head = TITLES.get(name, name.replace("_", " ").replace("alpha ", "α_"))
        cells = [head, *(spelt(row[name], digits) for row in rows)]
        width = max(map(len, cells))
        is_text = any(isinstance(row[name], str) for row in rows)
        texts[name] = [one.ljust(width) if is_text else one.rjust(width) for one in cells]
    room = shutil.get_terminal_size().columns
    for name in columns[: stay - 1 : -1]:
        if len("  ".join(cells[0] for cells in texts.values())) > room:
            texts.pop(name, None)
    for line in zip(*texts.values(), strict=True):
        # by this stream, which spells what a terminal has no letter for
        click.echo("  ".join(line).rstrip(), file=sys.stdout)


def spelt(value: Any, digits: int = 3) -> str:
    """A value in so many digits, several with commas, and a dash for none."""
    if isinstance(value, list):
        return ", ".join(spelt(one, digits) for one in value)
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def draw(asked: Output, data: Any, kind: str, **more: Any) -> None:
    """Draw the figures that are asked for; ``more`` is what figures share."""
    from scanfab.viz.figures.page import make_figures, save_figures

    if asked.plot is not None:
        save_figures(asked.plot, make_figures(data, kind, asked.figure, **more))
