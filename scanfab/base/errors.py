"""
Errors and warnings, a class for each kind of problem that a user can mend, and notes.

A note is data about a frame; the command line and the report make sentences of it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import NamedTuple

SKIPPED = "skipped"
"""The code of the note on a frame that was left out because it could not be read."""


class ScanfabError(Exception):
    """Base of all errors that scanfab raises on purpose; the message is written for users."""


class ReadError(ScanfabError):
    """A file could not be read; names the file, what was found and what was expected."""


class UnknownFormatError(ReadError):
    """No reader knows the file, or the named reader does not exist."""


class NoFrameError(ReadError, IndexError):
    """A series has no frame of this number; says how many it has."""


class PackingError(ScanfabError):
    """Grains, contacts or cell do not form a packing (a radius of zero, a missing grain)."""


class SettingsError(ScanfabError):
    """An option has a value that cannot be used, by itself or with this packing."""


class DimensionError(SettingsError):
    """An option for spheres was given for discs, or the other way round: wrong usage."""


class ScanfabWarning(UserWarning):
    """Something that the user should know, although the result stands."""


class ScanfabNote(UserWarning):
    """Something worth knowing that puts nothing in doubt."""


class SkippedFrameWarning(ScanfabWarning):
    """A frame was left out because it could not be read."""


class Note(NamedTuple):
    """One thing that a user should know."""

    code: str
    """The kind of the note, for programs."""
    text: str
    """The sentence; it names arguments as the library does."""
    variants: tuple[str, ...] = ()
    """The variants that the note is about; empty if it is about the whole frame."""

    def told(self, where: str) -> str:
        """
        The sentence behind the frame and variants that it is about.

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
    """Tell the user something that he should know, although the result stands."""
    warnings.warn(text, ScanfabWarning, stacklevel=5)


def note(text: str) -> None:
    """Tell the user something worth knowing that puts nothing in doubt."""
    warnings.warn(text, ScanfabNote, stacklevel=5)


def joined(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Notes with the same sentence become one note about all their variants."""
    variants: dict[tuple[str, str], dict[str, None]] = {}
    for code, text, about in notes:
        variants.setdefault((code, text), {}).update(dict.fromkeys(about))
    return tuple(Note(*key, tuple(about)) for key, about in variants.items())


def tell(notes: Iterable[Note], where: str = "") -> None:
    """Warn of each note; a frame that was left out is a warning of its own kind."""
    for one in notes:
        skipped = one.code == SKIPPED
        text = one.told(f"{where} skipped" if skipped else where)
        warnings.warn(text, SkippedFrameWarning if skipped else ScanfabWarning, stacklevel=3)
