"""
Errors, warnings and notes.

Each kind of problem that a user can mend has an error class of its own. A note is data about a
frame; the command line and the report make sentences of it.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Any, NamedTuple, TypeVar

Value = TypeVar("Value")


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


class NoReferenceError(SettingsError):
    """The frame that `reference` names does not exist, or has no grains."""


class ScanfabWarning(UserWarning):
    """A doubt about a result, which is nevertheless computed."""


class ScanfabNote(UserWarning):
    """Information that puts no result in doubt."""


class SkippedFrameWarning(ScanfabWarning):
    """A frame was skipped because it could not be read."""


class Note(NamedTuple):
    """One thing that a user should know."""

    code: str
    """Kind of the note: a series tells the first of a kind, and names the frames of the others."""
    text: str
    """The message; it names options as Python spells them."""
    variants: tuple[str, ...] = ()
    """Variants that the note is about; empty if it is about the whole frame."""
    kind: type[Warning] = ScanfabWarning
    """How it is issued: a doubt about a result, or mere information (:class:`ScanfabNote`)."""

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


_kept: ContextVar[list[Note] | None] = ContextVar("kept", default=None)


def warn(text: str, kind: type[Warning] = ScanfabWarning) -> None:
    """Warn the user of a doubt about a result, or issue a warning of another kind."""
    kept = _kept.get()
    if kept is None:
        warnings.warn(text, kind, stacklevel=5)
    else:
        # messages that differ only in numbers, such as steps in names of files, are the same note
        kept.append(Note(re.sub(r"\d+", "", text), text, kind=kind))


note = partial(warn, kind=ScanfabNote)
"""Inform the user of something that puts no result in doubt."""


def collected() -> AbstractContextManager[list[Note]]:
    """Collect what this thread calls :func:`warn` and :func:`note` for inside the block."""
    return within(_kept, [])


@contextmanager
def within(variable: ContextVar[Any], value: Value) -> Iterator[Value]:
    """Inside the block, a variable of this thread has a value."""
    token = variable.set(value)
    try:
        yield value
    finally:
        variable.reset(token)


def joined(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Merge notes with the same message into one note about all their variants."""
    merged: dict[tuple[str, str], Note] = {}
    for one in notes:
        before = merged.setdefault((one.code, one.text), one)
        variants = tuple(dict.fromkeys(before.variants + one.variants))
        merged[one.code, one.text] = before._replace(variants=variants)
    return tuple(merged.values())


def tell(notes: Iterable[Note], where: str = "") -> None:
    """Issue a warning for each note; ``where`` names its frame."""
    for note in notes:
        text = note.told(f"{where} skipped" if note.kind is SkippedFrameWarning else where)
        warnings.warn(text, note.kind, stacklevel=3)
