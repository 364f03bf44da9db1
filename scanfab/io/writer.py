"""
The interface of writers, the installed writers, and the arrays of a packing for writers.

All writers take the arrays from here, so that readers find the same names in every format.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from scanfab.base.errors import PackingError, ReadError, UnknownFormatError
from scanfab.base.plugins import Offer
from scanfab.base.typing import AnyArray, Columns
from scanfab.io.columns import BODIES, DIAMETER_NAMES, WALLS, first_of, other_size
from scanfab.io.reader import installed, plugin_named
from scanfab.packing.bodies import CLUMP_COLUMNS
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing

GROUP = "scanfab.writers"
# names that a column of the source must not have, in any spelling
TAKEN = {"id", "x", "y", "z", "radius", "position"}


class Left(NamedTuple):
    """The data of a packing that the grain file does not hold; companion files get them."""

    contacts: bool = False
    """Whether contacts (pairs, images and forces) go into ``STEM.contacts.csv``."""
    frame: bool = False
    """Whether cell, step and time go into ``STEM.frame.csv``."""
    columns: tuple[str, ...] = ()
    """Columns that go into ``STEM.columns.csv``, by the names of :func:`more_columns`."""
    notes: tuple[str, ...] = ()
    """Sentences that say what is lost or changed."""
    no_step: bool = True
    """
    Whether the format cannot state that a packing has no step. If the file name then has a number,
    which would be taken for a step, ``STEM.frame.csv`` states it.
    """


class Writer(Protocol):
    """
    A writer plugin: an object registered under the entry point group ``scanfab.writers``.

    An object may be both reader and writer. If it needs a package that scanfab does not install, it
    has an attribute ``requires``: the name to import, and the words that follow ``pip install``.
    """

    name: str
    """The NAME in ``--to NAME``."""
    description: str
    """One line for ``scanfab formats``."""
    extensions: tuple[str, ...]
    """File name extensions; the files of a series get the first."""

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame to a file; OSError if the file cannot be written."""
        ...


@cache
def installed_writers() -> dict[str, Offer]:
    """All writers by name, with the package of each."""
    return installed(GROUP, "writer", "write")


def writer_named(name: str) -> Writer:
    """The writer that a user names; UnknownFormatError lists those that exist."""
    writer: Writer = plugin_named(installed_writers(), "writer", name)
    return writer


def writer_for(path: Path) -> Writer:
    """The writer for the suffix of a path; UnknownFormatError lists the known suffixes."""
    endings_of = {name: offer.plugin.extensions for name, offer in installed_writers().items()}
    for name, endings in endings_of.items():
        if path.name.lower().endswith(endings):
            return writer_named(name)
    known = " ".join(dict.fromkeys(chain(*endings_of.values())))
    expected = f"expected one of {known}, or the name of a format as `to`"
    raise UnknownFormatError(f"{path}: no format has this suffix: {expected}")


class Arrays(NamedTuple):
    """The arrays of a packing except positions, under the names that readers look for."""

    grains: Columns
    """``id``, ``radius``, and, if there are any, body numbers and numbers of wall contacts."""
    own: Columns
    """The other columns of the source, numbers and texts, shape (N,) or (N, K)."""
    notes: list[str]
    """Sentences about columns of the source that were renamed or left out."""
    frame: dict[str, Any]
    """``step``, ``time``, and of the cell ``cell``, ``origin``, ``periodic``, if they are known."""
    contacts: Columns
    """``id1``, ``id2``, ``image``, and ``force`` on the second grain, or else ``force_n``."""


def as_arrays(packing: Packing) -> Arrays:
    """The arrays of a packing, for a writer."""
    bodies, cell, listed = packing.bodies, packing.cell, packing.contacts
    numbers = None if bodies is None else bodies.number
    if bodies is None and first_of(CLUMP_COLUMNS, packing.columns) is not None:
        # or a reader would join spheres by another column that usually numbers clumps
        numbers = np.full(len(packing), -1)
    walls = packing.wall_contacts if packing.wall_contacts.any() else None
    grains = {"id": packing.id, "radius": packing.radius, BODIES: numbers, WALLS: walls}
    frame: dict[str, Any] = {"step": packing.step, "time": packing.time}
    if cell is not None:
        frame |= {"cell": cell.vectors, "origin": cell.origin, "periodic": np.array(cell.periodic)}
    contacts: dict[str, Any] = {}
    if listed is not None:
        id1, id2 = packing.id[listed.pairs].T
        contacts = {"id1": id1, "id2": id2, "image": listed.image, "force": listed.force}
        contacts["force_n"] = listed.force_n if listed.force is None else None
    return Arrays(_known(grains), *_own_columns(packing), _known(frame), _known(contacts))


def _known(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None}


def _own_columns(packing: Packing) -> tuple[Columns, list[str]]:
    """
    The columns of the source, and notes about changed columns.

    A column is renamed if a reader would mistake it for another quantity.
    """
    columns: Columns = {}
    notes: list[str] = []
    for name, values in packing.columns.items():
        # e and g are floats of other than 4 and 8 bytes, which few formats have
        if values.dtype.kind not in "biufU" or values.dtype.char in "eg":
            notes.append(f"the column {name} is left out: it holds {values.dtype}")
            continue
        plain = re.sub(r"[^a-z0-9]", "", name.lower())
        is_size = plain in DIAMETER_NAMES and other_size(packing.radius, values) is not None
        free = name
        if is_size or plain in TAKEN or name in (BODIES, WALLS):
            free = f"{name}_of_dump"
            while free in columns or free in packing.columns:
                free += "_"
            notes.append(f"the column {name} is renamed to {free}: {name} has another meaning")
        columns[free] = values
    return columns, notes


def flat(columns: Mapping[str, AnyArray]) -> Columns:
    """Columns with one value per grain: vectors become ``v_x v_y v_z``, truth values 0 and 1."""
    parts: Columns = {}
    for name, values in columns.items():
        table = values.astype(np.int64) if values.dtype.kind == "b" else values
        names = [name]
        if table.ndim > 1:
            table = table.reshape(len(table), int(np.prod(table.shape[1:])))
            axes = "xyz" if table.shape[1] == 3 else range(table.shape[1])
            names = [f"{name}_{axis}" for axis in axes]
        parts |= zip(names, np.atleast_2d(table.T), strict=True)
    return parts


def split(
    columns: Columns, holds: Callable[[str, AnyArray], bool]
) -> tuple[Columns, tuple[str, ...]]:
    """The columns that a format holds, and the names of the others in the companion file."""
    held = {name: values for name, values in columns.items() if holds(name, values)}
    return held, tuple(flat({name: columns[name] for name in columns if name not in held}))


def are_numbers(_name: str, values: AnyArray) -> bool:
    """Whether a column holds numbers or truth values, not texts."""
    return values.dtype.kind != "U"


def table_columns(packing: Packing) -> tuple[Columns, Columns, list[str]]:
    """The standard columns of a table, those of the source, and notes about the latter."""
    arrays = as_arrays(packing)
    place = dict(zip("xyz", packing.position.T, strict=True))
    split = [
        f"the column {name} is split into {', '.join(flat({name: values}))}"
        for name, values in arrays.own.items()
        if values.ndim > 1
    ]
    return {"id": packing.id, **place, **arrays.grains}, flat(arrays.own), [*arrays.notes, *split]


def more_columns(packing: Packing) -> Columns:
    """
    The columns of the grains besides id, position and radius, with one value per grain.

    Parameters
    ----------
    packing : Packing
        The packing to be written.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        The columns, under names that no reader mistakes for another quantity.
    """
    known, own, _ = table_columns(packing)
    return {name: known[name] for name in known if name not in TAKEN} | own


def csv_bytes(
    columns: Mapping[str, Any], separator: str = ",", *, with_names: bool = True
) -> bytes:
    """A table as text, with all digits; a table with names puts texts into quotes if necessary."""
    import polars

    quotes: Any = "necessary" if with_names else "never"
    table = polars.DataFrame(dict(columns))
    text = table.write_csv(separator=separator, include_header=with_names, quote_style=quotes)
    return text.encode()


def stated_cell(path: Path, arrays: Mapping[str, Any]) -> Cell | None:
    """The cell in the arrays of a frame, or None; ReadError if the arrays are no valid cell."""
    if "cell" not in arrays:
        return None
    try:
        vectors, origin = (np.asarray(arrays[name], np.float64) for name in ("cell", "origin"))
        x, y, z = (bool(repeats) for repeats in np.ravel(arrays["periodic"]))
        return Cell(vectors.reshape(3, 3), (x, y, z), origin.reshape(3))
    except (KeyError, TypeError, ValueError, PackingError) as error:
        raise ReadError(f"{path}: cell, origin and periodic do not form a cell: {error}") from None


def contacts_of(pairs: AnyArray, arrays: Mapping[str, Any]) -> ContactList:
    """The contacts in the arrays of a file; Packing checks them later."""
    image, force, force_n = map(arrays.get, ("image", "force", "force_n"))
    return ContactList(pairs, image, force, force_n=force_n)
