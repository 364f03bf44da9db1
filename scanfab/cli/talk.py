"""How much a command says beside its result: --quiet, --verbose, and the progress of long work."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from scanfab.base.spelling import spelt_time

if TYPE_CHECKING:
    from scanfab.io.series import Series


# seconds between lines of progress, where standard error is no terminal
EVERY = 60.0
KEY = "scanfab.talk"
QUIET, USUAL, VERBOSE = "quiet", "", "verbose"


def level() -> str:
    """What the command that runs now was asked to say beside its result."""
    context = click.get_current_context(silent=True)
    return USUAL if context is None else context.meta.get(KEY, USUAL)


def _choose(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value and KEY in ctx.meta:
        raise click.UsageError("--quiet and --verbose exclude one another")
    if value:
        ctx.meta[KEY] = parameter.name


def talk_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options --quiet and --verbose."""
    add = partial(click.option, is_flag=True, expose_value=False, callback=_choose)
    words = "Say which readers, files and versions are used, and how long steps take."
    command = add("--verbose", help=words)(command)
    return add("--quiet", help="No progress and no notes; warnings and errors stay.")(command)


def tell_inputs(every: Iterable[Series], workers: int) -> None:
    """With --verbose: versions, and what is read by which reader."""
    if level() != VERBOSE:
        return
    import platform
    from importlib.metadata import version

    used = ", ".join(f"{name} {version(name)}" for name in ("scanfab", "numpy", "numba"))
    _say(f"{used}, Python {platform.python_version()}; {workers} workers")
    for one in every:
        for family in (one.grains, *one.contacts):
            reader = "no reader" if family.reader is None else family.reader.name
            files = f"{len(family.files)} files"
            _say(f"{one.name}: {family.kind} from {family.pattern} by {reader}, {files}")


def announce_compiling() -> None:
    """A line on standard error if something has to be compiled first."""
    from scanfab.base.jit import kernel_folder, when_compiling

    _, problem = kernel_folder()
    kept = f"it cannot be kept: {problem}" if problem else "it is kept for later runs"
    words = (
        f"compiling what no earlier run has needed: seconds, or minutes on a busy machine; {kept}"
    )
    if level() != QUIET:
        when_compiling(lambda: _say(words))


def _say(text: str) -> None:
    from scanfab.io.files import without_temporary

    click.echo(f"scanfab: {without_temporary(text)}", err=True)


class _Work(logging.Handler):
    """Work that is counted, and what the library, which never prints by itself, says of it."""

    def __init__(self, total: Callable[[], int | None], done: int) -> None:
        super().__init__(logging.INFO)
        self.total = total
        self.before = self.done = done
        self.begun = self.shown = time.monotonic()
        self.latest = ""
        self.says = level() == VERBOSE

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a message of the library, and print it if that is asked for."""
        self.latest = record.getMessage()
        if self.says:
            _say(self.latest)
        self.show()

    def advance(self) -> None:
        """A frame is done."""
        self.done += 1
        self.show()

    def show(self) -> None:
        """Say how far it is, if that was not said for a minute; a terminal has a bar instead."""
        if time.monotonic() - self.shown >= EVERY:
            self.shown = time.monotonic()
            _say(self.state())

    def state(self) -> str:
        """How many frames are done, how long the others will take, and what was said last."""
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
    Show progress while something works; what is yielded is called after each frame.

    On a terminal that is a bar with the time that is left, in a log at most a line a minute;
    nothing with --quiet. With --verbose each step is a line. What ``prints`` as it goes shows by
    itself how far it is on a terminal.
    """
    if level() == QUIET:
        yield lambda: None
        return
    work, logger = _Work(total, done), logging.getLogger("scanfab")
    before = logger.level
    logger.addHandler(work)
    logger.setLevel(logging.INFO)
    on_terminal = sys.stderr.isatty() and not (prints and sys.stdout.isatty())
    try:
        with _bar(work) if on_terminal and not work.says else nullcontext():
            yield work.advance
    finally:
        logger.removeHandler(work)
        logger.setLevel(before)


@contextmanager
def _bar(work: _Work) -> Iterator[None]:
    """A line on the terminal that is gone in the end."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    text = TextColumn("{task.description}")
    columns = (SpinnerColumn(), BarColumn(20), TimeElapsedColumn(), text)
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("")

        def show() -> None:
            progress.update(task, description=work.state(), completed=work.done, total=work.total())

        work.show = show  # type: ignore[method-assign]
        show()
        yield
