"""Readers: their interface and options, and the choice of an installed reader for a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol

from scanfab.base.errors import ReadError, UnknownFormatError
from scanfab.base.option import (
    accepted,
    fill,
    number,
    numbers,
    optional,
    options_of,
    reading,
    unusable,
)
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


parse_positive = optional(number("a number above 0", lambda value: 0 < value < math.inf))
parse_skip = number("how many lines to skip, 0 or more", lambda value: 0 <= value < 2**31, int)
# texts and paths are checked further where they are used
parse_text = optional(accepted("text", lambda value: isinstance(value, str)))
parse_contacts = accepted(
    "auto, file, geometric or a path", lambda value: isinstance(value, str | PathLike)
)
parse_periodic = optional(
    accepted(
        "letters out of xyz",
        lambda value: isinstance(value, str) and len(value) <= 3 and set(value) <= set("xyz"),
    )
)


def parse_frames(name: str, value: str | int | slice | None) -> slice:
    """A slice from ``A:B:C`` or a single number; None gives all frames."""
    if value is None or (isinstance(value, slice) and value.step != 0):
        return value or slice(None)
    words = str(value).split(":")
    with suppress(ValueError):
        if len(words) == 1:
            first = int(words[0])
            # -1 is the last frame: the slice -1:0 would be empty, so the end is None
            return slice(first, first + 1 or None)
        parts = [int(word) if word.strip() else None for word in words]
        if len(parts) <= 3 and parts[2:] != [0]:
            return slice(*parts)
    raise unusable(name, "a slice such as 0:10:2, :5 or -1:", value)


def parse_columns(name: str, value: Any) -> dict[str, str]:
    """A dict of standard name to column, from a mapping or from ``NAME=COLUMN,NAME=COLUMN``."""
    if value is None:
        return {}
    parts: Any = [part.partition("=")[::2] for part in str(value).split(",")]
    if isinstance(value, Mapping):
        parts = value.items()
    names = {f"{standard}".strip(): f"{column}".strip() for standard, column in parts}
    if not all([*names, *names.values()]) or len({*names.values()}) < len(parts):
        expected = 'NAME=COLUMN such as "radius=c_rad,x=px", each name and each column once'
        raise unusable(name, expected, value)
    return names


def parse_format(name: str, value: Any) -> Any:
    """The name of an installed reader."""
    if value is not None:
        reader_named(parse_text(name, value))
    return value


def parse_cell(name: str, value: Any) -> tuple[float, ...] | str | PathLike[str] | None:
    """Three or six numbers, or the path of a file with the numbers of each frame."""
    if value is None or (isinstance(value, str | PathLike) and Path(value).is_file()):
        return value
    expected = (
        "three lengths LX LY LZ above 0, or six numbers LX LY LZ XY XZ YZ, or a CSV file with the "
        "cell of each frame"
    )
    return numbers(expected, lambda cell: len(cell) in (3, 6) and min(cell[:3]) > 0)(name, value)


def parse_dim(name: str, value: Any) -> str | int:
    """``auto``, 2 or 3."""
    if str(value) not in ("auto", "2", "3"):
        raise unusable(name, "auto, 2 or 3", value)
    return "auto" if value == "auto" else int(value)


@dataclass(frozen=True, init=False)
class ReadOptions:
    """
    The options of ``read_series``: what users add to the information in the files.

    Parameters
    ----------
    beside : Cell or "none", optional
        The cell that a companion file of the dump states, or ``none`` if it states there is none.
    **options
        Options of :func:`scanfab.read_series`.
    """

    format: str | None = reading(parse_format, form="NAME", words=installed_readers)
    """Reader to use (default: chosen by the content of the file)."""
    columns: Mapping[str, str] = reading(parse_columns, form="NAMES")
    """
    Names of columns that differ from the usual names: "radius=c_rad,x=px". In a table without names
    use the numbers of the columns, from 1: "x=1,y=2,z=3,diameter=4".
    """
    contact_columns: str | None = reading(parse_text, form="KEYWORDS")
    """
    Meaning of the columns of a dump local: LIGGGHTS keywords "pos id force", or names of columns
    "id1=NAME,id2=NAME", which also work for tables of contacts.
    """
    skip: int = reading(parse_skip, default=0)
    """Number of lines to skip at the top of a text table."""
    radius: float | None = reading(parse_positive, form="L")
    """Radius of all grains in the dump's units, for dumps without radii."""
    cell: tuple[float, ...] | None = reading(parse_cell, form="LX LY LZ [XY XZ YZ]|FILE.csv")
    """
    Periodic cell, for formats that do not store it. It repeats along x, y and z unless `periodic`
    says otherwise. FILE.csv lists the cell of each step or frame: columns step lx ly lz, and
    xy xz yz if it is tilted.
    """
    periodic: str | None = reading(parse_periodic, form="xyz")
    """Periodic directions (default: from the dump)."""
    bodies: str | None = reading(parse_text, form="COLUMN")
    """
    Column that numbers the clump of each sphere; a negative number is a grain of its own (default:
    id_multisphere, clumpId, clump_id or clump, if there is one); id: each sphere is a grain.
    """
    max_unpacked: float | None = reading(parse_positive, form="TIMES")
    """How many times its compressed size a file may grow to (default: 1000)."""
    contacts: str | PathLike[str] = reading(
        parse_contacts, default="auto", form="file|geometric|PATH"
    )
    """
    Source of the contacts. PATH: a file, folder or glob, matched by step; file: the contact files
    of the dump; geometric: positions and radii (default: file if there is one, else geometric).
    """
    dim: str | int = reading(parse_dim, default="auto", form="auto|2|3")
    """
    2: discs in a coordinate plane; 3: spheres; auto: 2 if the first frame with grains has at least
    ten grains and all centres share exactly one coordinate. The first frame decides for all.
    """
    beside: Cell | Literal["none"] | None = None

    def __init__(self, beside: Cell | Literal["none"] | None = None, **options: Any) -> None:
        object.__setattr__(self, "beside", beside)
        fill(self, options)


READING_OPTIONS = options_of(ReadOptions)
READING = tuple(option.name for option in READING_OPTIONS)
"""The names of the options of :func:`read_series`, also used by commands and manifests."""


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
