"""The errors and warnings of scanfab: one kind for each thing that a user can mend."""

from __future__ import annotations


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
    """An option of three dimensions meets discs, or the other way round: wrong usage."""


class ScanfabWarning(UserWarning):
    """Something that the user should know, although the result stands."""


class ScanfabNote(UserWarning):
    """Something worth knowing that puts nothing in doubt."""


class SkippedFrameWarning(ScanfabWarning):
    """A frame was left out because it could not be read."""
