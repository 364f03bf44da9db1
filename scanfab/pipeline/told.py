"""What a computation tells beside its rows: kept for the manifest, and passed on as warnings."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from scanfab.base.errors import ScanfabNote, ScanfabWarning, SkippedFrameWarning
from scanfab.pipeline.options import as_options


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

    At the end each text is warned of once, at the line that calls the function of the block, to be
    shown, hidden or raised as those filters say. Warnings of others are passed on as they come.
    """
    told, messages = Told(), list[Warning]()
    try:
        with warnings.catch_warnings():
            show = warnings.showwarning

            def hear(message: Any, category: type[Warning], *place: Any) -> None:
                if told.add(category, str(message)):
                    messages.append(message)
                elif not issubclass(category, ScanfabWarning | ScanfabNote):
                    show(message, category, *place)

            for kind in (ScanfabWarning, ScanfabNote):
                warnings.simplefilter("always", kind)
            warnings.showwarning = hear  # type: ignore[assignment]
            yield told
    finally:
        for message in messages:
            warnings.warn(message, stacklevel=4)
