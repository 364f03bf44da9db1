"""Clean-up steps that run before the process ends, also if a signal ends it."""

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
        # a forked worker process ends without calling the functions of atexit
        util.Finalize(None, finish, exitpriority=0)
    _steps.append(step)


@contextmanager
def undone_at_end(step: Step) -> Iterator[None]:
    """Within the block, call a function if the process ends."""
    _steps.append(step)
    try:
        yield
    finally:
        _steps.remove(step)


if hasattr(os, "register_at_fork"):
    # the parent process runs its own steps, so a forked child forgets them
    os.register_at_fork(after_in_child=_steps.clear)


@atexit.register
def finish() -> None:
    """Run all remaining steps, the newest first."""
    while _steps:
        with suppress(OSError):
            _steps.pop()()
