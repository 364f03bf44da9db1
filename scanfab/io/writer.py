"""What a writer plugin offers and what it answers; the writers that are installed."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import NamedTuple, Protocol

from scanfab.base.errors import UnknownFormatError
from scanfab.base.plugins import Offer, having, load_offers
from scanfab.io.registry import lacking
from scanfab.packing.packing import Packing

GROUP = "scanfab.writers"


class Left(NamedTuple):
    """What a file of grains does not hold of its packing: it is written beside the file."""

    contacts: bool = False
    """Whether pairs, images and forces go into ``STEM.contacts.csv``."""
    frame: bool = False
    """Whether cell, step and time go into ``STEM.frame.csv``."""
    columns: tuple[str, ...] = ()
    """Columns of the grains for ``STEM.columns.csv``, by the names of :func:`more_columns`."""
    notes: tuple[str, ...] = ()
    """What is lost or changed, in sentences."""
    no_step: bool = True
    """
    Whether the file cannot say that the packing has no step. ``STEM.frame.csv`` says it then, if
    the name of the file has a number that would be taken for a step.
    """


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


@cache
def installed_writers() -> dict[str, Offer]:
    """All writers by name, with the package of each."""
    make = having(
        "a class of objects with the members of scanfab.io.writer.Writer",
        **dict.fromkeys(("name", "description"), str),
        extensions=tuple,
        write=Callable,
    )
    return load_offers(entry_points(group=GROUP), "writer", lambda writer: make(writer()))


def writer_named(name: str) -> Writer:
    """The writer that a user names; UnknownFormatError lists those that exist."""
    writers = installed_writers()
    if name not in writers:
        raise UnknownFormatError(
            f"there is no writer called {name!r}; the writers are {', '.join(writers)}"
        )
    writer: Writer = writers[name].plugin
    advice = lacking(writer)
    if advice is not None:
        raise UnknownFormatError(f"{name} needs another package: {advice}")
    return writer


def writer_for(path: Path) -> Writer:
    """The writer of a suffix; UnknownFormatError lists those that exist."""
    endings = {name: one.plugin.extensions for name, one in installed_writers().items()}
    for name, known in endings.items():
        if path.name.lower().endswith(known):
            return writer_named(name)
    every = dict.fromkeys(ending for known in endings.values() for ending in known)
    raise UnknownFormatError(
        f"{path}: no format has this suffix: expected one of {' '.join(every)}, or its name as `to`"
    )
