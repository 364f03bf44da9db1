"""Warnings and notes of a computation: kept for the manifest, and shown to the user."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from scanfab.base.errors import ScanfabNote, ScanfabWarning, SkippedFrameWarning
from scanfab.pipeline.options import as_options


class Told:
    """Warnings and notes as manifests list them: each text once, spelt as on the command line."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self.notes: list[str] = []
        self.skipped = 0
        """Number of frames that were skipped."""

    def add(self, message: Warning) -> bool:
        """Keep a warning or note; returns whether its text is new."""
        self.skipped += isinstance(message, SkippedFrameWarning)
        known = self.notes if isinstance(message, ScanfabNote) else self.warnings
        text = as_options(str(message))
        is_new = text not in known
        if is_new:
            known.append(text)
        return is_new


@contextmanager
def listening(show: Callable[[Warning], object] | None = None) -> Iterator[Told]:
    """
    Keep the warnings and notes of scanfab inside the block, whatever the filters of the caller say.

    Each new text is shown at once by ``show``. Without ``show`` the texts are issued again after
    the block, as warnings at the line that calls the function of the block; there the filters of
    the caller show them, hide them or raise them. Warnings of other packages pass unchanged.
    """
    told, later = Told(), list[Warning]()
    try:
        with warnings.catch_warnings():
            others: Any = warnings.showwarning

            def hear(message: Any, category: type[Warning], *place: Any, **more: Any) -> None:
                if not issubclass(category, ScanfabWarning | ScanfabNote):
                    others(message, category, *place, **more)
                elif told.add(message):
                    (show or later.append)(message)

            for kind in (ScanfabWarning, ScanfabNote):
                warnings.simplefilter("always", kind)
            warnings.showwarning = hear
            yield told
    finally:
        for message in later:
            warnings.warn(message, stacklevel=4)
