"""The interface of readers, the installed readers, and the choice of a reader for a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol

from scanfab.base.errors import ReadError, UnknownFormatError
from scanfab.base.plugins import Offer, having, load_plugins
from scanfab.base.typing import AnyArray, FloatArray, IntArray
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList, WallForces

GROUP = "scanfab.readers"
"""The entry point group under which packages register readers."""
TABLE = "table"
"""The reader that is tried with any text that no other reader knows."""

FileKind = Literal["grains", "index", "start", "points", "contacts", "cell", "other"]
"""
The content of a file. ``index``: a list of other files that hold grains; ``start``: grains from
which a simulation starts (not a frame if there are dumps); ``points``: grains without a radius,
which the user may give; ``cell``: the periodic cell of the grains in another file, whose reader
finds it; ``other``: neither grains nor contacts (a wall mesh, a box).
"""


Carries = Literal["cell", "box", "nothing"]
"""
How much a grain file says about a cell: ``cell``: everything; ``box``: its size, but not whether it
is periodic; ``nothing``.
"""


@dataclass(frozen=True)
class ReadOptions:
    """Information about a dump that the user adds because the dump lacks it."""

    format: str | None = None
    """Name of the reader; None: the reader that recognises the content."""
    columns: Mapping[str, str] = field(default_factory=dict)
    """Standard name of a column to its name in the file, for instance ``{"radius": "c_rad"}``."""
    contact_columns: str | None = None
    """Meaning of the columns of a contact file, in the terms of the reader."""
    radius: float | None = None
    """Radius of all grains, for dumps without one; dump's length unit."""
    cell: tuple[float, ...] | None = None
    """LX LY LZ, or LX LY LZ XY XZ YZ; dump's length unit."""
    periodic: str | None = None
    """The periodic directions, some of the letters x, y and z."""
    bodies: str | None = None
    """Column that numbers the clump of each sphere; None: the usual columns, if there are any."""
    skip: int = 0
    """Number of lines before a text table."""
    max_unpacked: float | None = None
    """How many times its compressed size a file may grow to; None: the usual limit."""
    beside: Cell | Literal["none"] | None = None
    """The cell that a companion file of the dump states, or ``none`` if it states there is none."""


@dataclass(frozen=True)
class Snapshot:
    """One frame inside a file."""

    path: Path
    step: int | None = None
    time: float | None = None
    start: int = 0
    """Offset of its first byte in the decompressed file; in binary formats its number in there."""
    stop: int | None = None
    """Offset behind its last byte, or the next number; None: the end of the file."""
    stepless: bool = False
    """Whether the file states that there is no step; then a number in its name is not a step."""


class GrainTable(NamedTuple):
    """The grains of a snapshot."""

    position: FloatArray
    """Shape (N, 3), dump's length unit."""
    radius: FloatArray
    """Shape (N,), dump's length unit."""
    id: IntArray | None
    """Shape (N,); None if the dump has none."""
    columns: Mapping[str, AnyArray]
    """All other columns of the dump, N rows each, by the names in the dump."""
    cell: Cell | None
    contacts: ContactList | None = None
    """Contacts, if the grain file itself lists them."""
    wall_contacts: IntArray | None = None
    """Number of contacts with walls of each grain, shape (N,), if the grain file lists them."""
    bodies: IntArray | None = None
    """Number of each sphere's body, shape (N,), if the format defines it."""
    wall_forces: WallForces | None = None
    """The forces of all contacts with walls, if the grain file lists them."""


class JoinedContacts(NamedTuple):
    """The contacts of a snapshot, joined to the rows of its grains."""

    contacts: ContactList | None
    """None if the file lists contacts with walls only."""
    wall_contacts: IntArray
    """Number of contacts with walls of each grain, shape (N,)."""
    wall_forces: WallForces | None = None
    """The forces of all these contacts with walls, if the file lists them."""


class Reader(Protocol):
    """
    A reader plugin: an object registered under the entry point group ``scanfab.readers``.

    All methods raise only ReadError, with the file and what was expected. A reader may also have
    these attributes and methods:

    - ``generic = True``: any program may write the format; the reader is asked after the others.
    - ``is_table = True``: the files are tables that may hold anything; in a folder they count only
      if there are no dumps.
    - ``carries(path)``, one of :data:`Carries`: needed if not all grain files store their cell.
    - ``beside(path)``, a list of paths: the files that are read together with a grain file, for
      instance its cell. They are inputs too. Called for each file of a series, it should not open
      them.
    - ``listed_by(path)``, a path or None: which file lists this file as one of its parts, judged by
      the name alone. Needed if parts are named like grain files; in a folder they are no frames.
    - ``told(options)``, a reader: a reader with the user's options, which it needs to know what a
      file holds (the columns of a table).
    """

    name: str
    """The NAME in ``--format NAME``."""
    description: str
    """One line for ``scanfab formats``."""
    extensions: tuple[str, ...]
    """Usual file name extensions, the most common first."""

    def recognises(self, path: Path) -> bool:
        """Whether the content is certainly of this format."""
        ...

    def kind(self, path: Path) -> FileKind:
        """What a file of this format holds."""
        ...

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames in a file, found without parsing them."""
        ...

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The grains of a frame."""
        ...

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """The contacts of a frame."""
        ...


@cache
def installed_readers() -> dict[str, Offer]:
    """
    All readers by name, with the package that offers each.

    A warning names each plugin that cannot be loaded.

    Raises
    ------
    ScanfabError
        If two packages offer a reader of the same name.
    """
    return installed(GROUP, "reader", "recognises", "kind", "snapshots", "read_grains")


def installed(group: str, what: str, *methods: str) -> dict[str, Offer]:
    """The readers or writers that packages register; each plugin is an instance of its class."""
    make = having(
        f"a class of objects with the members of scanfab.io.{what.title()}",
        **dict.fromkeys(("name", "description"), str),
        extensions=tuple,
        **dict.fromkeys(methods, Callable),
    )
    return load_plugins(group, what, lambda plugin: make(plugin()))


def lacking(plugin: object) -> str | None:
    """The pip command for a plugin's missing package; None if nothing is missing."""
    module, words = getattr(plugin, "requires", (None, ""))
    return None if module is None or find_spec(module) is not None else f"pip install {words}"


def plugin_named(offers: Mapping[str, Offer], what: str, name: str) -> Any:
    """The ``reader`` or ``writer`` that a user names; UnknownFormatError lists those that exist."""
    if name not in offers:
        raise UnknownFormatError(f"there is no {what} called {name!r}, only {', '.join(offers)}")
    advice = lacking(offers[name].plugin)
    if advice is not None:
        raise UnknownFormatError(f"{name} needs another package: {advice}")
    return offers[name].plugin


def reader_named(name: str, options: ReadOptions | None = None) -> Reader:
    """The reader that a user names; UnknownFormatError lists those that exist."""
    return _told(plugin_named(installed_readers(), "reader", name), options)


def _told(reader: Reader, options: ReadOptions | None) -> Reader:
    """The reader; with the user's options if it needs them to know what a file holds."""
    tell = getattr(reader, "told", None)
    informed: Reader = reader if tell is None or options is None else tell(options)
    return informed


def reader_for(path: Path, options: ReadOptions | None = None) -> Reader | None:
    """The reader that the user names, else the first that recognises the file, else tables."""
    if options is not None and options.format is not None:
        return reader_named(options.format, options)
    # generic formats, which any program may write, come last
    offers = installed_readers().values()
    for offer in sorted(offers, key=lambda offer: getattr(offer.plugin, "generic", False)):
        reader = _told(offer.plugin, options)
        if reader.recognises(path):
            if (advice := lacking(reader)) is not None:
                raise ReadError(f"{path}: {reader.name} needs another package: {advice}")
            return reader
    return None if why_no_table(path, options) else reader_named(TABLE, options)


def why_no_table(path: Path, options: ReadOptions | None) -> str:
    """Why a file cannot be read as a text table; empty if it can."""
    try:
        reader_named(TABLE, options).kind(path)
    except ReadError as error:
        return str(error).removeprefix(f"{path}").lstrip(":, ")
    return ""
