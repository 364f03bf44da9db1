"""Ctrl-C and SIGTERM: the process ends at once, and says how far it came."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

from scanfab.base.ending import finish

ENDED: dict[int, str] = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
# clear the line of progress, and show the cursor that it hides
PLAIN_LINE = "\r\x1b[2K\x1b[?25h"
_more: list[Callable[[], str]] = []


@contextmanager
def telling(words: Callable[[], str]) -> Iterator[None]:
    """In the block these words follow "interrupted", such as "after 4 of 5 frames"."""
    _more[:] = [words]
    try:
        yield
    except Exception:
        _more.clear()
        raise
    # where KeyboardInterrupt ended the block, the words are still to be said
    _more.clear()


def interrupted_words(number: int) -> str:
    """What is said of a signal that ended the process."""
    return " ".join([f"scanfab: {ENDED[number]}", *(words() for words in _more)])


def catch_signals() -> None:
    """From now on signals end the process in our way; one that is ignored stays so."""
    signal.signal(signal.SIGTERM, _end)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _end)


@contextmanager
def ending_in_order(end: Callable[[], object]) -> Iterator[None]:
    """In the block the first signal calls this; a second one ends the process in our way."""

    before = {one: signal.getsignal(one) for one in ENDED}
    before = {one: what for one, what in before.items() if what is not signal.SIG_IGN}

    def restore() -> None:
        for one, what in before.items():
            signal.signal(one, what)

    def first(number: int, frame: FrameType | None) -> None:
        restore()
        end()
        words = f"scanfab: {ENDED[number]}: frames under way are finished, again to leave at once\n"
        with suppress(OSError):
            os.write(2, words.encode())

    for one in before:
        signal.signal(one, first)
    try:
        yield
    finally:
        restore()


def _end(number: int, frame: FrameType | None) -> None:
    """
    Say it, remove what is temporary, and leave.

    No exception is raised: it would come up anywhere, and extension modules, the compiler and their
    callbacks swallow it, take it for a failure of their own, or crash.
    """
    for again in ENDED:
        signal.signal(again, signal.SIG_DFL)  # a second one ends even what follows
    try:
        words = interrupted_words(number) + "\n"
        on_terminal = sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
        # not by the stream, which may be in the middle of a line itself
        os.write(2, ((PLAIN_LINE if on_terminal else "") + words).encode(errors="replace"))
    except Exception:  # a closed stream, no memory: it ends all the same
        pass
    finally:
        leave_at_once(128 + number)


def leave(code: int) -> NoReturn:
    """Exit with what has been printed; a signal from now on would only spoil the exit code."""
    for late in ENDED:
        signal.signal(late, signal.SIG_IGN)
    if code == 0:
        sys.exit(code)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # a full disk, a closed pipe: told already
            stream.flush()
    leave_at_once(code)


def leave_at_once(code: int) -> NoReturn:
    """Exit without waiting for the frames that other threads are computing."""
    try:
        finish()
    finally:
        os._exit(code)
