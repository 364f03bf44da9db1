"""Whether a file may still be being written, so that what lacks at its end is no news."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from scanfab.base.errors import ScanfabWarning

_grows: ContextVar[bool] = ContextVar("grows", default=False)


@contextmanager
def growing() -> Iterator[None]:
    """In the block nobody is warned of a last snapshot that is incomplete."""
    token = _grows.set(True)
    try:
        yield
    finally:
        _grows.reset(token)


def warn_incomplete(text: str) -> None:
    """Warn that a last snapshot is left out."""
    if not _grows.get():
        warnings.warn(text, ScanfabWarning, stacklevel=3)
