"""What there is to tell of a frame, as data: whoever faces the user makes sentences of it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace

from scanfab.base.errors import ScanfabWarning, SkippedFrameWarning

SKIPPED = "skipped"
"""The code of a frame that was left out because it could not be read."""


@dataclass(frozen=True)
class Note:
    """One thing that a user should know."""

    code: str
    """What it is about, for programs: the same for all of its kind."""
    text: str
    """The sentence, which speaks of arguments as the library calls them."""
    variants: tuple[str, ...] = ()
    """Those that it is about; none if it is about the whole frame."""

    def told(self, where: str) -> str:
        """
        The sentence with what it is about.

        Examples
        --------
        >>> from scanfab.base.note import Note
        >>> Note("empty", "no grain is left", ("b", "d")).told("frame 3")
        'frame 3, variants b, d: no grain is left'
        """
        if not where:
            return self.text
        several = "s" if len(self.variants) > 1 else ""
        named = f", variant{several} {', '.join(self.variants)}" if self.variants else ""
        return f"{where}{named}: {self.text}"


def joined(notes: Iterable[Note]) -> tuple[Note, ...]:
    """The notes with each sentence once, of all variants that it is about."""
    found: dict[tuple[str, str], Note] = {}
    for note in notes:
        key = note.code, note.text
        before = found.get(key)
        variants = note.variants if before is None else (*before.variants, *note.variants)
        found[key] = replace(note, variants=tuple(dict.fromkeys(variants)))
    return tuple(found.values())


def tell(notes: Iterable[Note], where: str = "") -> None:
    """Warn of each; a frame that was left out is a warning of its own kind."""
    for note in notes:
        if note.code == SKIPPED:
            warnings.warn(note.told(f"{where} skipped"), SkippedFrameWarning, stacklevel=3)
        else:
            warnings.warn(note.told(where), ScanfabWarning, stacklevel=3)
