"""What a computation tells beside its rows: kept for the manifest, and passed on as warnings."""

from __future__ import annotations

import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from scanfab.base.errors import ScanfabNote, ScanfabWarning, SkippedFrameWarning
from scanfab.pipeline.options import as_options

_ears = threading.local()


class Told:
    """Warnings and notes, each text once, in the words of the command line as manifests have it."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self.notes: list[str] = []
        self.skipped = 0
        """Frames that were skipped."""

    def add(self, category: type[Warning], text: str) -> bool:
        """Keep a warning; says whether it is one of scanfab's that was not told before."""
        self.skipped += issubclass(category, SkippedFrameWarning)
        known = self.notes if issubclass(category, ScanfabNote) else self.warnings
        text = as_options(text)
        if not issubclass(category, ScanfabWarning | ScanfabNote) or text in known:
            return False
        known.append(text)
        return True


@contextmanager
def recorded() -> Iterator[Told]:
    """
    Keep what is told in the block, also what the caller's filters of warnings hide.

    Each text is passed on once, to be shown, hidden or raised as those filters say.
    """
    told = Told()
    with warnings.catch_warnings():
        filters, show = list(warnings.filters), warnings.showwarning

        def hear(message: Any, category: type[Warning], file: str, line: int, *rest: Any) -> None:
            is_ours = issubclass(category, ScanfabWarning | ScanfabNote)
            is_known = is_ours and not told.add(category, str(message))
            action = _action(filters, str(message), category, file, line) if is_ours else ""
            if action == "error":
                raise message
            if action != "ignore" and not is_known:
                show(message, category, file, line, *rest)

        for kind in (ScanfabWarning, ScanfabNote):
            warnings.simplefilter("always", kind)
        warnings.showwarning = hear  # type: ignore[assignment]
        yield told


def _action(
    filters: list[Any], text: str, category: type[Warning], filename: str, lineno: int
) -> str:
    """What filters of warnings say, by the rules of the standard library."""
    files = {getattr(one, "__file__", None): name for name, one in list(sys.modules.items())}
    module = files.get(filename, filename)
    for action, message, kind, of_module, line in filters:
        if (
            issubclass(category, kind)
            and (message is None or message.match(text))
            and (of_module is None or of_module.match(module))
            and line in (0, lineno)
        ):
            return str(action)
    return "default"


@contextmanager
def heard_by_thread() -> Iterator[list[Warning]]:
    """
    The warnings of a thread, in a process where nobody else hears any.

    Other threads may listen to theirs: what the standard library has for it is for one at a time.
    """
    if warnings.showwarning is not _hear:
        warnings.showwarning = _hear
        warnings.simplefilter("always")
    _ears.heard = []
    try:
        yield _ears.heard
    finally:
        del _ears.heard


def _hear(message: Warning | str, *rest: Any, **more: Any) -> None:
    if isinstance(message, Warning) and hasattr(_ears, "heard"):
        _ears.heard.append(message)
