"""Files that may still be being written, and what is told of snapshots that are not whole."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from scanfab.base.errors import ReadError, ScanfabWarning

_grows: ContextVar[bool] = ContextVar("grows", default=False)


@contextmanager
def growing() -> Iterator[None]:
    """In the block files may still be being written: what lacks at their end is no warning."""
    token = _grows.set(True)
    try:
        yield
    finally:
        _grows.reset(token)


def grows() -> bool:
    """Whether files may still be being written."""
    return _grows.get()


def leave_out_last(path: Path, complete: int, reason: str) -> None:
    """Warn that an incomplete last snapshot is left out; ReadError if none is complete."""
    if complete == 0:
        raise ReadError(f"{path}: {reason}: the file is incomplete")
    if not grows():
        text = f"{path}: the last snapshot, number {complete + 1}, is incomplete and is left out"
        warnings.warn(f"{text}: {reason}", ScanfabWarning, stacklevel=3)
