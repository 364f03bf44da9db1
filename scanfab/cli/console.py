"""
Output for people: warnings, notes and progress on standard error, tables on a terminal.

--quiet and --verbose choose how much a command says beside its result.
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
from scanfab.base.spelling import counted, spelt_time
from scanfab.io.files import without_temporary
from scanfab.pipeline.options import as_options, listening

if TYPE_CHECKING:
    from rich.progress import Progress

    from scanfab.base.column import Column
    from scanfab.io.series import Series
    from scanfab.pipeline.options import Output
    from scanfab.table.row import Row
    from scanfab.table.writing import Excerpt


# seconds between lines of progress, if standard error is not a terminal
EVERY = 60.0
# keys of click's context: which of --quiet and --verbose was given; whether `-o -` asks for CSV
TALK, AS_CSV = "scanfab.talk", "scanfab.as_csv"
LEVELS = {
    "quiet": "Show no progress and no notes; warnings and errors stay.",
    "verbose": "Show which readers, files and versions are used, and how long each step takes.",
}
# column titles that read better than the column names
TITLES = {
    "total": "± total",
    "alpha_vs_axial_total_se": "± total",
    "alpha_c_axial_sample_se": "± total",
    "alpha_vs_axial_se": "± scan",
    "alpha_vs_axial_sample_se": "± sample",
    "slope_se": "±",
    "r2": "R²",
}
# columns of a fabric table on a terminal; a narrow terminal drops the last, never the first STAY
SHOWN = (
    "source", "frame", "strain", "block", "variant", "rv", "cutoff", "grains", "contacts",
    "alpha_vs_axial", "total", "alpha_c_axial", "at_surface", "alpha_vs_axial_se",
    "alpha_vs_axial_sample_se", "alpha_vs", "mean_length", "coordination", "solid_fraction",
    "r_inner", "r_outer", "x", "y", "z",
)  # fmt: skip
# these columns are not shown if all rows have the same value
OFTEN_SAME = ("source", "rv", "cutoff")
STAY = 12


class Command(click.Command):
    """A command that prints warnings and notes; the context keeps them in ``obj``."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        flag: Any = {"is_flag": True, "expose_value": False, "callback": _choose_level}
        for name, words in LEVELS.items():
            self.params.append(click.Option([f"--{name}"], help=words, **flag))

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; its warnings and notes become lines on standard error."""
        # read here, because threads that compute frames have no click context
        is_quiet = level() == "quiet"

        def show(message: Warning) -> None:
            kind = "note" if isinstance(message, ScanfabNote) else "warning"
            if kind == "warning" or not is_quiet:
                say(f"{kind}: {as_options(str(message))}")

        with warnings.catch_warnings():
            # users of the command can do nothing about the warnings of other packages
            warnings.simplefilter("ignore")
            with listening(show) as ctx.obj:
                return super().invoke(ctx)


def _choose_level(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value and TALK in ctx.meta:
        raise click.UsageError("--quiet and --verbose contradict each other: choose one")
    if value:
        ctx.meta[TALK] = parameter.name


def level() -> str:
    """``quiet`` or ``verbose``, as given to the running command; empty for neither."""
    context = click.get_current_context(silent=True)
    return "" if context is None else context.meta.get(TALK, "")


def say(text: str) -> None:
    """Print a line on standard error."""
    # by the stream itself, which a bar on the terminal watches
    click.echo(f"scanfab: {without_temporary(text)}", file=sys.stderr)


def tell_inputs(all_series: Iterable[Series], workers: int) -> None:
    """With --verbose, print the versions in use and which reader reads which files."""
    if level() != "verbose":
        return
    import platform
    from importlib.metadata import version

    used = ", ".join(f"{name} {version(name)}" for name in ("scanfab", "numpy", "numba"))
    say(f"{used}, Python {platform.python_version()}; {counted(workers, 'worker')}")
    for series in all_series:
        for family in (series.grains, *series.contacts):
            reader = "no reader" if family.reader is None else family.reader.name
            files = counted(len(family.files), "file")
            say(f"{series.name}: {family.kind} from {family.pattern} by {reader}, {files}")


def announce(all_series: Iterable[Series] = (), workers: int = 1) -> None:
    """As `tell_inputs`; and unless --quiet, say if code must be compiled before the work starts."""
    from scanfab.base.jit import kernel_folder, when_compiling

    tell_inputs(all_series, workers)
    _, problem = kernel_folder()
    kept = f"it cannot be kept: {problem}" if problem else "later runs start at once"
    words = "compiling for first use, which takes seconds, or minutes on a busy machine"
    if level() != "quiet":
        when_compiling(lambda: say(f"{words}; {kept}"))


class _Work(logging.Handler):
    """Counts frames and shows the library's log messages (the library itself never prints)."""

    def __init__(self, total: Callable[[], int | None], done: int, bar: Progress | None) -> None:
        super().__init__(logging.INFO)
        self.total, self.before, self.done = total, done, done
        self.begun = self.shown = time.monotonic()
        self.latest, self.bar = "", bar
        # read here, because the threads that log have no click context
        self.prints = level() == "verbose"
        if bar is not None:
            bar.add_task(self.state(), completed=done, total=total())

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a message of the library for the progress line; --verbose also prints it."""
        self.latest = record.getMessage()
        if self.prints:
            say(self.latest)
        self.show()

    def advance(self) -> None:
        """Count a frame as done."""
        self.done += 1
        self.show()

    def show(self) -> None:
        """Show the progress: on the bar of a terminal, or as a line each minute."""
        if self.bar is not None:
            (task,) = self.bar.task_ids
            self.bar.update(task, description=self.state(), completed=self.done, total=self.total())
        elif time.monotonic() - self.shown >= EVERY:
            self.shown = time.monotonic()
            say(self.state())

    def state(self) -> str:
        """The number of frames done, the time the others will take, and the latest message."""
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
    Show progress inside the block, which calls the yielded function after each frame.

    A terminal shows a bar with the time left, a log file a line a minute at most. With --verbose
    each step is a line; with --quiet there is nothing. A command that ``prints`` its results as
    they come shows no bar if they go to a terminal.
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
    """A progress bar that disappears at the end."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.table import Column

    # a long text is cut, not the time beside it
    text = TextColumn("{task.description}", table_column=Column(ratio=1, no_wrap=True))
    columns = (SpinnerColumn(), BarColumn(20), TimeElapsedColumn(), text)
    # the bar leaves standard output alone, or rows would go to the terminal in place of their file
    console = Console(stderr=True)
    return Progress(*columns, console=console, transient=True, redirect_stdout=False, expand=True)


def is_readable() -> bool:
    """Whether results are printed as a table on a terminal, rather than as CSV."""
    return sys.stdout.isatty() and not click.get_current_context().meta.get(AS_CSV)


def print_csv(
    rows: Iterable[Mapping[str, Any]], excerpt: Excerpt, columns: Sequence[Column]
) -> None:
    """Print rows as CSV on standard output, each as soon as it is computed."""
    from scanfab.table.formats import OWN_FORMATS
    from scanfab.table.writing import write_to

    write_to(sys.stdout, OWN_FORMATS[0], rows, columns, excerpt)


def print_table(rows: Iterable[Row], excerpt: Excerpt) -> None:
    """Print a fabric table: the columns that the user chose, or those that fit the terminal."""
    from scanfab.table.curves import short_names
    from scanfab.table.row import same_in_all, total_error

    shown = [{**row, "total": total_error(row, "alpha_vs_axial")} for row in rows]
    digits = digits_of(excerpt)
    if excerpt.fields:
        print_rows(shown, excerpt.fields, len(excerpt.fields), digits)
    else:
        names = short_names(row["source"] for row in shown)
        same = same_in_all(shown, OFTEN_SAME)
        columns = [name for name in SHOWN if name not in same]
        shown = [{**row, "source": names[row["source"]]} for row in shown]
        print_rows(shown, columns, STAY - len(same), digits)


def digits_of(excerpt: Excerpt, usual: int = 3) -> int:
    """The digits that a terminal shows: the user's choice, else a usual number."""
    return usual if excerpt.digits == DEFAULT_DIGITS else excerpt.digits


def print_rows(
    rows: Sequence[Mapping[str, Any]], columns: Sequence[str], stay: int, digits: int = 3
) -> None:
    """
    Print some columns of rows as a table on standard output; no cell is cut.

    Columns that the rows do not have are left out. A narrow terminal drops columns from the right;
    the first ``stay`` columns always remain, and wrap if need be.
    """
    texts = {}
    for name in (name for name in columns if not rows or name in rows[0]):
        head = TITLES.get(name, name.replace("_", " ").replace("alpha ", "α_"))
        cells = [head, *(spelt(row[name], digits) for row in rows)]
        width = max(map(len, cells))
        is_text = any(isinstance(row[name], str) for row in rows)
        texts[name] = [cell.ljust(width) if is_text else cell.rjust(width) for cell in cells]
    room = shutil.get_terminal_size().columns
    for name in reversed(columns[stay:]):
        if len("  ".join(cells[0] for cells in texts.values())) > room:
            texts.pop(name, None)
    for line in zip(*texts.values(), strict=True):
        # through sys.stdout, which escapes letters that the terminal lacks
        click.echo("  ".join(line).rstrip(), file=sys.stdout)


def spelt(value: Any, digits: int = 3) -> str:
    """A value with so many significant digits; a list separated by commas; a dash for None."""
    if isinstance(value, list):
        return ", ".join(spelt(item, digits) for item in value)
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def draw(outputs: Output, data: Any, kind: str, **more: Any) -> None:
    """Draw the figures that the options name; ``more`` goes to every figure."""
    from scanfab.viz.figures.figure import make_figures, save_figures

    if outputs.plot is not None:
        save_figures(outputs.plot, make_figures(data, kind, outputs.figure, **more))
