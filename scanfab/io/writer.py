"""What a writer plugin offers, and what it answers."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Protocol

from scanfab.packing.packing import Packing


class Left(NamedTuple):
    """What of a packing a file of grains does not hold: it is written beside the file."""

    contacts: bool = False
    """Pairs, images and forces, into ``STEM.contacts.csv``."""
    frame: bool = False
    """Cell, step and time, into ``STEM.frame.csv``."""
    columns: tuple[str, ...] = ()
    """Columns of the grains, into ``STEM.columns.csv``."""
    notes: tuple[str, ...] = ()
    """What lies nowhere, or in another way than it was, in sentences."""
    no_step: bool = True
    """That there is no step, into ``STEM.frame.csv`` if its name has a number to take for one."""


class Writer(Protocol):
    """
    A writer plugin: an object registered under the entry point group ``scanfab.writers``.

    An object may be a reader as well. One that needs a package which scanfab does not bring says so
    with an attribute ``requires``: the name to import and the words behind ``pip install``.
    """

    name: str
    """As in ``--to NAME``."""
    description: str
    """One line for ``scanfab formats``."""
    extensions: tuple[str, ...]
    """File name extensions, the first for the files of a series."""

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame to a file; OSError if the disk does not take it."""
        ...
