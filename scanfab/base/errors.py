"""
Errors, warnings and notes.

Each kind of problem that a user can mend has an error class of its own. A note is data about a
frame; the command line and the report make sentences of it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import NamedTuple

SKIPPED = "skipped"
"""Code of the note about a frame that was skipped because it could not be read."""


class ScanfabError(Exception):
    """Base class of the errors that scanfab raises on purpose; users can act on the message."""


class ReadError(ScanfabError):
    """A file cannot be read; the message names the file, what was expected and what was found."""


class UnknownFormatError(ReadError):
    """No reader recognises the file, or there is no reader of the given name."""


class NoFrameError(ReadError, IndexError):
    """A series has no frame of this number; the message says how many it has."""


class PackingError(ScanfabError):
    """Grains, contacts and cell do not form a packing: a radius is 0, or a grain is missing."""


class SettingsError(ScanfabError):
    """The value of an option cannot be used, either at all or with this packing."""


class DimensionError(SettingsError):
    """An option for spheres is used with discs, or the other way round."""


class ScanfabWarning(UserWarning):
    """A doubt about a result, which is nevertheless computed."""


class ScanfabNote(UserWarning):
    """Information that puts no result in doubt."""


class SkippedFrameWarning(ScanfabWarning):
    """A frame was skipped because it could not be read."""


class Note(NamedTuple):
    """One thing that a user should know."""

    code: str
    """Kind of the note, for programs."""
    text: str
    """The message; it names options as Python spells them."""
    variants: tuple[str, ...] = ()
    """Variants that the note is about; empty if it is about the whole frame."""

    def told(self, where: str) -> str:
        """
        The message, preceded by the frame and the variants that it is about.

        Examples
        --------
        >>> from scanfab.base.errors import Note
        >>> Note("empty", "no grain is left", ("b", "d")).told("frame 3")
        'frame 3, variants b, d: no grain is left'
        """
        if not where:
            return self.text
        several = "s" if len(self.variants) > 1 else ""
        named = f", variant{several} {', '.join(self.variants)}" if self.variants else ""
        return f"{where}{named}: {self.text}"


def warn(text: str) -> None:
    """Warn the user of a doubt about a result."""
    warnings.warn(text, ScanfabWarning, stacklevel=5)


def note(text: str) -> None:
    """Inform the user of something that puts no result in doubt."""
    warnings.warn(text, ScanfabNote, stacklevel=5)


def joined(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Merge notes with the same message into one note about all their variants."""
    variants: dict[tuple[str, str], dict[str, None]] = {}
    for code, text, about in notes:
        variants.setdefault((code, text), {}).update(dict.fromkeys(about))
    return tuple(Note(*key, tuple(about)) for key, about in variants.items())


def tell(notes: Iterable[Note], where: str = "") -> None:
    """Issue a warning for each note; a skipped frame has a warning class of its own."""
    for note in notes:
        skipped = note.code == SKIPPED
        text = note.told(f"{where} skipped" if skipped else where)
        warnings.warn(text, SkippedFrameWarning if skipped else ScanfabWarning, stacklevel=3)
