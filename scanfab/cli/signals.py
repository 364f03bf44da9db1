"""Ctrl-C and SIGTERM end the process at once, with a message that says how far it came."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

from scanfab.base.files import finish

ENDED: dict[int, str] = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
# clear the progress bar, and show the cursor that it hides
PLAIN_LINE = "\r\x1b[2K\x1b[?25h"
_more: list[Callable[[], str]] = []


def tell_if_ended(*words: Callable[[], str]) -> None:
    """From now on add these words to "interrupted", for instance "after 4 of 5 frames"."""
    _more[:] = words


def interrupted_words(number: int) -> str:
    """The message about a signal that ended the process."""
    return " ".join([f"scanfab: {ENDED[number]}", *(words() for words in _more)])


def catch_signals() -> None:
    """Install our handler of SIGTERM and Ctrl-C; Ctrl-C stays ignored if the shell ignores it."""
    signal.signal(signal.SIGTERM, _end)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _end)


@contextmanager
def ending_in_order(end: Callable[[], object]) -> Iterator[None]:
    """Inside the block, the first signal calls ``end``; a second signal ends the process."""
    found = [(number, signal.getsignal(number)) for number in ENDED]
    before = {number: what for number, what in found if what is not signal.SIG_IGN}

    def restore() -> None:
        for number, what in before.items():
            signal.signal(number, what)

    def first(number: int, frame: FrameType | None) -> None:
        restore()
        end()
        words = f"scanfab: {ENDED[number]}: finishing frames under way; repeat to stop at once\n"
        with suppress(OSError):
            os.write(2, words.encode())

    for number in before:
        signal.signal(number, first)
    try:
        yield
    finally:
        restore()


def _end(number: int, frame: FrameType | None) -> None:
    """
    Print the message, remove temporary files, and end the process.

    This raises no exception, because it would appear at any line: extension modules, the compiler
    and their callbacks swallow it, take it for a failure of their own, or crash.
    """
    for again in ENDED:
        signal.signal(again, signal.SIG_DFL)  # a second signal interrupts even the code below
    try:
        words = interrupted_words(number) + "\n"
        on_terminal = sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
        # os.write, because sys.stderr may be in the middle of writing a line
        os.write(2, ((PLAIN_LINE if on_terminal else "") + words).encode(errors="replace"))
    except Exception:  # a closed stream or no memory: the process ends all the same
        pass
    finally:
        leave_at_once(128 + number)


def leave(code: int) -> NoReturn:
    """Flush the output and exit; further signals are ignored, as they would spoil the exit code."""
    for late in ENDED:
        signal.signal(late, signal.SIG_IGN)
    if code == 0:
        sys.exit(code)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # a full disk or a closed pipe: this was reported already
            stream.flush()
    leave_at_once(code)


def leave_at_once(code: int) -> NoReturn:
    """Exit without waiting for frames that other threads are computing."""
    try:
        finish()
    finally:
        os._exit(code)
