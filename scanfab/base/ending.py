"""Steps that must be taken before the process ends, also when a signal ends it at once."""

from __future__ import annotations

import atexit
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

Step = Callable[[], object]
_steps: list[Step] = []


def at_end(step: Step) -> None:
    """Call a function at the end of the process."""
    if util := sys.modules.get("multiprocessing.util"):
        # a worker that was forked ends without the functions of atexit
        util.Finalize(None, finish, exitpriority=0)
    _steps.append(step)


@contextmanager
def undone_at_end(step: Step) -> Iterator[None]:
    """Call a function if the process ends inside the block."""
    _steps.append(step)
    try:
        yield
    finally:
        _steps.remove(step)


if hasattr(os, "register_at_fork"):
    # a forked process leaves the steps that it inherits to its parent
    os.register_at_fork(after_in_child=_steps.clear)


@atexit.register
def finish() -> None:
    """Take all steps that are left; the one that was asked for last comes first."""
    while _steps:
        with suppress(OSError):
            _steps.pop()()
