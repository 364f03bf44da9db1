"""What a reader plugin offers, what it is asked, and what it answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol

import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.options import (
    parse_cell,
    parse_max_unpacked,
    parse_periodic,
    parse_radius,
    parse_skip,
)
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.walls import ListedWallForces

BODIES = "scanfab_bodies"
"""A column of this name is the number of each sphere's body, whatever other columns say."""
WALLS = "scanfab_wall_contacts"
"""A column of this name is the number of contacts with walls of each grain."""

FileKind = Literal["grains", "index", "start", "points", "contacts", "cell", "other"]
"""
What a file holds. ``index``: names of other files that hold grains; ``start``: grains that a
simulation starts from, which are no frame beside its dumps; ``points``: grains without a
radius, unless the user gives one; ``cell``: the periodic cell of grains in another file, whose
reader finds it; ``other``: neither grains nor contacts (a wall mesh, a box).
"""


class NotContactsError(ReadError):
    """No column of a file can hold ids: if nobody named the file, it is skipped with a note."""


class OtherGrainsError(NotContactsError):
    """The ids of a file of contacts are not those of the grains."""


Carries = Literal["cell", "box", "nothing"]
"""
What a file of grains says of a cell: all; a ``box``, but not whether it repeats; or ``nothing``.
"""


@dataclass(frozen=True)
class ReadOptions:
    """What users tell of a dump that the dump does not tell itself."""

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

    def __post_init__(self) -> None:
        """Raise SettingsError if a value cannot be used."""
        parse_cell("cell", self.cell)
        parse_periodic("periodic", self.periodic)
        parse_radius("radius", self.radius)
        parse_skip("skip", self.skip)
        parse_max_unpacked("max_unpacked", self.max_unpacked)


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
    columns: Mapping[str, npt.NDArray[Any]]
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
    anything says ``is_table = True``: in a folder they count only where there are no dumps. One
    whose contact files have columns that no packing has a place for may have a method
    ``left_out(path)`` that answers with their names, for ``convert`` to tell.
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
