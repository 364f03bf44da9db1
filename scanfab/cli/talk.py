"""How much a command says beside its result: --quiet, --verbose, and the progress of long work."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import click

from scanfab.base.spelling import spelt_time

if TYPE_CHECKING:
    from scanfab.io.series import Series


# where standard error is no terminal there is a line of progress after so many seconds
EVERY = 60.0
KEY = "scanfab.talk"

Count = Callable[[], int | None]


class Level(IntEnum):
    """What is said beside the result: errors and warnings always."""

    QUIET = 0
    USUAL = 1
    """Notes and progress too."""
    VERBOSE = 2
    """What was opened with which reader, and how long each step took."""


def level() -> Level:
    """What the command that runs now was asked for."""
    context = click.get_current_context(silent=True)
    return Level.USUAL if context is None else context.meta.get(KEY, Level.USUAL)


def _choose(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if not value:
        return
    if KEY in ctx.meta:
        raise click.UsageError("--quiet and --verbose exclude one another")
    ctx.meta[KEY] = Level[str(parameter.name).upper()]


def talk_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options --quiet and --verbose."""
    quiet = click.option(
        "--quiet",
        is_flag=True,
        expose_value=False,
        callback=_choose,
        help="No progress and no notes; warnings and errors stay.",
    )
    verbose = click.option(
        "--verbose",
        is_flag=True,
        expose_value=False,
        callback=_choose,
        help="Say which readers, files and versions are used, and how long each step takes.",
    )
    return quiet(verbose(command))


def tell_inputs(every: Iterable[Series], workers: int) -> None:
    """With --verbose: versions, and what is read by which reader."""
    if level() is not Level.VERBOSE:
        return
    import platform
    from importlib.metadata import version

    used = ", ".join(f"{name} {version(name)}" for name in ("scanfab", "numpy", "numba"))
    _say(f"{used}, Python {platform.python_version()}; {workers} workers")
    for one in every:
        for family in (one.grains, *one.contacts):
            reader = "no reader" if family.reader is None else family.reader.name
            _say(
                f"{one.name}: {family.kind} from {family.pattern} by {reader}, "
                f"{len(family.files)} files"
            )


class _Latest(logging.Handler):
    """Keeps what the library has said last, and prints all of it if asked."""

    def __init__(self, show: Callable[[str], None] | None) -> None:
        super().__init__(logging.INFO)
        self.text = ""
        self.show = show
        self.heard: Callable[[], None] | None = None

    def emit(self, record: logging.LogRecord) -> None:
        self.text = record.getMessage()
        if self.show is not None:
            self.show(self.text)
        if self.heard is not None:
            self.heard()


@contextmanager
def _listening(show: Callable[[str], None] | None) -> Iterator[_Latest]:
    """What the library tells while it works; it never prints by itself."""
    logger, handler = logging.getLogger("scanfab"), _Latest(show)
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield handler
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)


def _say(text: str) -> None:
    from scanfab.io.files import without_temporary

    click.echo(f"scanfab: {without_temporary(text)}", err=True)


class _Work:
    """Work that is counted, and how far it is."""

    def __init__(self, total: Count, done: int) -> None:
        self.total = total
        self.before = self.done = done
        self.begun = time.monotonic()

    def state(self, latest: str) -> str:
        """How many frames are done, how long the others will take, and what was said last."""
        total = self.total()
        if not total:
            return latest
        text, now = f"{self.done} of {total} frames", self.done - self.before
        if now:
            rest = (time.monotonic() - self.begun) / now * max(total - self.done, 0)
            text += f", about {spelt_time(rest)}"
        return f"{text}; {latest}" if latest else text


@contextmanager
def working(
    total: Count = lambda: None, done: int = 0, prints: bool = False
) -> Iterator[Callable[..., None]]:
    """
    Show progress while something works; what is yielded is called after each frame.

    On a terminal that is a bar with the time that is left, in a log a line a minute; nothing with
    --quiet. With --verbose each step is a line. What ``prints`` as it goes shows by itself how far
    it is on a terminal.
    """
    work, chosen = _Work(total, done), level()
    if chosen is Level.QUIET:
        yield lambda: None
        return
    with _listening(_say if chosen is Level.VERBOSE else None) as heard:
        on_terminal = chosen is Level.USUAL and sys.stderr.isatty()
        on_terminal = on_terminal and not (prints and sys.stdout.isatty())
        with _bar(work, heard) if on_terminal else _lines(work, heard) as show:

            def advance() -> None:
                work.done += 1
                show()

            yield advance


@contextmanager
def _lines(work: _Work, heard: _Latest) -> Iterator[Callable[[], None]]:
    """A line of progress each minute."""
    ended = threading.Event()

    def tell() -> None:
        while not ended.wait(EVERY):
            _say(work.state(heard.text) or "at work")

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield lambda: None
    finally:
        ended.set()
        # nothing is said behind the end
        teller.join()


@contextmanager
def _bar(work: _Work, heard: _Latest) -> Iterator[Callable[[], None]]:
    """A line on the terminal that is gone in the end."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        BarColumn(20),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("", total=work.total())

        def show() -> None:
            state = work.state(heard.text)
            progress.update(task, description=state, completed=work.done, total=work.total())

        heard.heard = show
        show()
        yield show
