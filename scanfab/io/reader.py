"""What a reader is asked and what it answers, which readers are installed, and which one fits."""

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
from scanfab.packing.contacts import ContactList, ListedWallForces

GROUP = "scanfab.readers"
"""The entry point by which packages offer readers."""
TABLE = "table"
"""The reader that any text is tried with."""

FileKind = Literal["grains", "index", "start", "points", "contacts", "cell", "other"]
"""
What a file holds. ``index``: names of other files that hold grains; ``start``: grains that a
simulation starts from, which are no frame beside its dumps; ``points``: grains without a
radius, unless the user gives one; ``cell``: the periodic cell of grains in another file, whose
reader finds it; ``other``: neither grains nor contacts (a wall mesh, a box).
"""


Carries = Literal["cell", "box", "nothing"]
"""
What a file of grains says of a cell: all; a ``box``, but not whether it repeats; or ``nothing``.
"""


@dataclass(frozen=True)
class ReadOptions:
    """What users tell of a dump that the dump does not tell itself."""

    format: str | None = None
    """Name of the reader; None: the one that knows the content."""
    columns: Mapping[str, str] = field(default_factory=dict)
    """Standard name to the file's own, for instance ``{"radius": "c_rad"}``."""
    contact_columns: str | None = None
    """Meaning of a contact file's columns, in the reader's own terms."""
    radius: float | None = None
    """Radius of all grains, for dumps without one; dump's length unit."""
    cell: tuple[float, ...] | None = None
    """LX LY LZ, or LX LY LZ XY XZ YZ; dump's length unit."""
    periodic: str | None = None
    """Letters out of xyz."""
    bodies: str | None = None
    """Column that says which clump a sphere belongs to; by default that of the format, if any."""
    skip: int = 0
    """Lines before a table of text."""
    max_unpacked: float | None = None
    """Times its size that a packed file may unpack to; None: the usual bound."""
    beside: Cell | Literal["none"] | None = None
    """The dump's own cell, where a file beside the dump says which it is, or that it has none."""


@dataclass(frozen=True)
class Snapshot:
    """One frame inside a file."""

    path: Path
    step: int | None = None
    time: float | None = None
    start: int = 0
    """Where it starts in the (decompressed) file, in bytes."""
    stop: int | None = None
    """Where it ends; None: the end of the file."""
    stepless: bool = False
    """Whether the file says that there is no step, so that a number in its name is none."""
    parts: tuple[Path, ...] = ()
    """Other files, with the rest of its grains."""


class GrainTable(NamedTuple):
    """The grains of a snapshot."""

    position: FloatArray
    """Shape (N, 3), dump's length unit."""
    radius: FloatArray
    """Shape (N,), dump's length unit."""
    id: IntArray | None
    """Shape (N,); None if the dump has none."""
    columns: Mapping[str, AnyArray]
    """What else the dump says of each grain, by its own names."""
    cell: Cell | None
    contacts: ContactList | None = None
    """Contacts that the grain file itself lists."""
    wall_contacts: IntArray | None = None
    """Number of contacts with walls of each grain, shape (N,), if the grain file lists them."""
    bodies: IntArray | None = None
    """Number of each sphere's body, shape (N,), if the file says so beyond all doubt."""
    wall_forces: ListedWallForces | None = None
    """The forces of all contacts with walls that the grain file lists, if it says them."""


class JoinedContacts(NamedTuple):
    """The contacts of a snapshot, joined to the rows of its grains."""

    contacts: ContactList | None
    """None if the file lists contacts with walls only."""
    wall_contacts: IntArray
    """Number of contacts with walls of each grain, shape (N,)."""
    wall_forces: ListedWallForces | None = None
    """The forces of all these contacts with walls, if the file says them."""


class Reader(Protocol):
    """
    A reader plugin: an object registered under the entry point group ``scanfab.readers``.

    All methods raise ReadError, with the file and what was expected, and nothing else. A reader of
    a format that any program may write can say so with an attribute ``generic = True``: it is asked
    after the others. One whose grain files may list contacts says ``lists_contacts = True``. One
    whose grain files do not all carry their cell has a method ``carries(path)`` that answers with
    one of :data:`Carries`. One that reads other files together with a file of grains, such as that
    of its cell, has a method ``beside(path)`` that answers with a list of their paths: they are
    inputs too. It is asked for each file of a series, so it should not open them. If these are
    called like files of grains, a method ``listed_by(path)`` answers, by its name alone, which file
    lists a file, or None: in a folder the listed ones are no frames. One that cannot
    know what a file holds without what users tell of it (the columns of a table) has a method
    ``told(options)`` that answers with a reader that does know. One of tables that may hold
    anything says ``is_table = True``: in a folder they count only where there are no dumps.
    """

    name: str
    """As in ``--format NAME``."""
    description: str
    """One line for ``scanfab formats``."""
    extensions: tuple[str, ...]
    """Usual file name extensions, the first the most usual."""

    def recognises(self, path: Path) -> bool:
        """Whether the content is surely of this format."""
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
    All readers by name, with the package of each.

    A plugin that cannot be loaded is one warning with its name.

    Raises
    ------
    ScanfabError
        If two packages offer a reader of the same name.
    """
    return installed(GROUP, "reader", "recognises", "kind", "snapshots", "read_grains")


def installed(group: str, what: str, *methods: str) -> dict[str, Offer]:
    """The readers or writers that packages offer, each an object of the class that is offered."""
    make = having(
        f"a class of objects with the members of scanfab.io.{what.title()}",
        **dict.fromkeys(("name", "description"), str),
        extensions=tuple,
        **dict.fromkeys(methods, Callable),
    )
    return load_plugins(group, what, lambda plugin: make(plugin()))


def lacking(plugin: object) -> str | None:
    """What to install for a plugin whose package is not there; None if nothing lacks."""
    module, words = getattr(plugin, "requires", (None, ""))
    return None if module is None or find_spec(module) is not None else f"pip install {words}"


def plugin_named(offers: Mapping[str, Offer], what: str, name: str) -> Any:
    """The ``reader`` or ``writer`` that a user names; UnknownFormatError lists those that exist."""
    if name not in offers:
        there = f"the {what}s are {', '.join(offers)}"
        raise UnknownFormatError(f"there is no {what} called {name!r}; {there}")
    advice = lacking(offers[name].plugin)
    if advice is not None:
        raise UnknownFormatError(f"{name} needs another package: {advice}")
    return offers[name].plugin


def reader_named(name: str, options: ReadOptions | None = None) -> Reader:
    """The reader that a user names; UnknownFormatError lists those that exist."""
    return _told(plugin_named(installed_readers(), "reader", name), options)


def _told(reader: Reader, options: ReadOptions | None) -> Reader:
    """The reader, with what users say of its files if it needs that to know what they hold."""
    tell = getattr(reader, "told", None)
    told: Reader = reader if tell is None or options is None else tell(options)
    return told


def reader_for(path: Path, options: ReadOptions | None = None) -> Reader | None:
    """The reader that a user names, or that knows the file; any text may be a table."""
    if options is not None and options.format is not None:
        return reader_named(options.format, options)
    # formats that any program may write are asked last
    offers = installed_readers().values()
    for one in sorted(offers, key=lambda one: getattr(one.plugin, "generic", False)):
        reader = _told(one.plugin, options)
        try:
            is_known = reader.recognises(path)
        except ReadError:
            raise
        # a plugin may raise anything
        except Exception as error:
            reason = f"the reader {reader.name!r} failed: {type(error).__name__}: {error}"
            raise ReadError(f"{path}: {reason}") from error
        if is_known and (advice := lacking(reader)) is not None:
            raise ReadError(f"{path}: {reader.name} needs another package: {advice}")
        if is_known:
            return reader
    return None if why_no_table(path, options) else reader_named(TABLE, options)


def why_no_table(path: Path, options: ReadOptions | None) -> str:
    """Why a file cannot be read as a table of text; empty if it can."""
    try:
        reader_named(TABLE, options).kind(path)
    except ReadError as error:
        return str(error).removeprefix(f"{path}").lstrip(":, ")
    return ""
