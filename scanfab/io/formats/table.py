"""
Tables of any program: text with or without names, Parquet, NPZ and ``.xyzd``.

What a column is, its name says, or the user. Without either a guess is made, and taken only if the
grains that come of it touch one another; it is told.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.io.files import Stamp, stamp_of
from scanfab.io.formats.columns import grain_table
from scanfab.io.formats.proof import TOO_FEW, touch
from scanfab.io.formats.table_contacts import join_table
from scanfab.io.formats.table_files import (
    Columns,
    has_ids,
    names_of,
    read_table,
    read_unnamed,
)
from scanfab.io.formats.table_names import (
    CONTACTS,
    EDEM,
    PERHAPS_FRAMES,
    PFC,
    TABLE,
    Names,
    check_one_unit,
    find_columns,
    is_contacts,
    is_frame_name,
    is_of_contacts,
    plain_name,
    unique,
    warn_of_lacking_unit,
)
from scanfab.io.formats.xyzd import is_xyzd, prove_xyzd
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)

# what must be a number in each row, and what a whole one
NUMBERS = ("x", "y", "z", "radius", "diameter", "volume", "id", "id1", "id2")
WHOLE = ("id", "id1", "id2")
OF_GRAINS = ("x", "y", "z", "radius", "diameter", "id")
# the columns of the table whose names were guessed last, until it is read; and lines to skip
_guessed: dict[tuple[Stamp, int], Columns] = {}
ASK = (
    'name them, for instance `columns="x=1,y=2,z=3,radius=4"` (or diameter=4; numbers of columns '
    "count from 1); discs have a column z, too, with one value"
)


@dataclass(frozen=True)
class TableReader:
    """Reader plugin for tables of any program."""

    options: ReadOptions = field(default_factory=ReadOptions)

    name = "table"
    description = (
        "tables with a column each of x, y, z, radius: CSV, TSV, blanks, Parquet, NPZ, xyzd"
    )
    extensions: ClassVar[tuple[str, ...]] = (
        ".csv",
        ".tsv",
        ".txt",
        ".dat",
        ".parquet",
        ".npz",
        ".xyzd",
    )
    generic = True
    is_table = True
    names: Names = field(default_factory=lambda: {**TABLE, **CONTACTS}, init=False, repr=False)

    def told(self, options: ReadOptions) -> TableReader:
        """Columns may have no names but those that users give them."""
        return replace(self, options=options)

    def recognises(self, path: Path) -> bool:
        """Names of columns, the usual or the user's, that make grains or contacts."""
        try:
            names, _ = names_of(path, self.options.skip)
            return names is not None and self._kind_of(path, names) != "points"
        except ReadError:
            return False

    def kind(self, path: Path) -> FileKind:
        """By the columns; of a table without names by a guess that holds."""
        names, width = names_of(path, self.options.skip)
        if names is not None:
            return self._kind_of(path, names)
        if self.options.columns or self.options.contact_columns:
            return self._kind_of(path, [f"{place + 1}" for place in range(width)])
        _guess(path, self.options.skip)
        return "grains"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One."""
        return [Snapshot(path)]

    def carries(self, path: Path) -> Carries:
        """A table has no cell."""
        return "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names or numbers."""
        path, reader = snapshot.path, replace(self, options=options)
        names, width = names_of(path, options.skip)
        own = names or [f"{place + 1}" for place in range(width)]
        is_guess = names is None and not options.columns
        found = _guess(path, options.skip) if is_guess else reader._find(path, own, contacts=False)
        guessed = _guessed.pop((stamp_of(path), options.skip), None) if is_guess else None
        columns = guessed or read_table(path, options.skip, *_needed(found))
        if names is not None:
            _refuse_frames(path, columns)
            warn_of_lacking_unit(path, found)
        if is_xyzd(path) and not options.columns:
            prove_xyzd(path, columns)
        if "volume" in found and not found.keys() & {"radius", "diameter"}:
            columns = _radii_of_volumes(columns, found["volume"])
            found["radius"] = "radius"
        _tell_guess(names, found, options)
        own_names = _grain_columns(found, options.columns)
        return grain_table(path, columns, None, replace(options, columns=own_names))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Pairs by the columns ``id1`` and ``id2``, or those that the user names."""
        path, reader = snapshot.path, replace(self, options=options)
        names, width = names_of(path, options.skip)
        own = names or [f"{place + 1}" for place in range(width)]
        found = reader._find(path, own, contacts=True)
        if not {"id1", "id2"} <= found.keys():
            raise ReadError(
                f"{path}: expected two columns of ids, id1 and id2, found {', '.join(own)}: name "
                f'them with `contact_columns="id1=NAME,id2=NAME"`'
            )
        check_one_unit(path, "forces", found, [one for one in found if one.startswith("f")])
        columns = read_table(path, options.skip, *_needed(found))
        for name in found.values():
            if name not in columns:
                raise ReadError(f"{path}: expected numbers in the column {name}, which is empty")
        return join_table(path, grains, {what: columns[name] for what, name in found.items()})

    def left_out(self, path: Path) -> list[str]:
        """The columns of a table of contacts that no packing has a place for."""
        names, _ = names_of(path, self.options.skip)
        if names is None:
            return []
        found = self._find(path, names, contacts=True)
        used = {own for what, own in found.items() if is_of_contacts(what)}
        return [name for name in unique(names) if name not in used]

    def _find(self, path: Path, names: Sequence[str], *, contacts: bool) -> dict[str, str]:
        """The columns of grains, or those of contacts, by what they are."""
        if contacts:
            pairs = _named_contacts(path, self.options.contact_columns)
            return find_columns(path, names, self.names, pairs, "contact_columns")
        named = self.options.columns
        found = find_columns(path, names, self.names, named, "columns")
        for size, other in (("diameter", "radius"), ("radius", "diameter")):
            if size in named and other not in named:
                found.pop(other, None)
        return found

    def _kind_of(self, path: Path, names: Sequence[str]) -> FileKind:
        """What these columns are; ReadError if they are nothing that scanfab reads."""
        wrong: list[ReadError] = []
        found: list[dict[str, str]] = []
        for contacts in (False, True):
            try:
                found.append(self._find(path, names, contacts=contacts))
            except ReadError as error:
                wrong.append(error)
                found.append({})
        grains, pairs = found[0], found[1]
        if (
            self.options.contact_columns
            and is_contacts(pairs)
            and has_ids(path, self.options.skip, pairs)
        ):
            return "contacts"
        if {"x", "y", "z"} <= grains.keys() and not is_contacts(grains):
            sized = grains.keys() & {"radius", "diameter", "volume"}
            return "grains" if sized else "points"
        if is_contacts(pairs):
            return "contacts"
        raise (
            wrong[0]
            if wrong
            else ReadError(
                f"{path}: expected columns of grains (x, y, z, radius or diameter) or contacts "
                f"(id1, id2), found {', '.join(names)}: {ASK}"
            )
        )


@dataclass(frozen=True)
class PfcReader(TableReader):
    """Tables that users of PFC write, by FISH or Python."""

    name = "pfc"
    description = "tables of PFC's ball and contact attributes: ball.pos.x, contact.end1.id, ..."
    extensions = ()
    names: Names = field(default_factory=lambda: PFC, init=False, repr=False)

    def recognises(self, path: Path) -> bool:
        """By name only."""
        return False


@dataclass(frozen=True)
class EdemReader(TableReader):
    """Tables that EDEM's export of queries makes."""

    name = "edem"
    description = (
        'tables of EDEM\'s export, by the titles of its queries: "Particle Position X", ...'
    )
    extensions = ()
    names: Names = field(default_factory=lambda: EDEM, init=False, repr=False)

    def recognises(self, path: Path) -> bool:
        """By name only."""
        return False


def _needed(found: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Which columns must be numbers, and which whole ones."""
    return (
        [found[one] for one in NUMBERS if one in found],
        [found[one] for one in WHOLE if one in found],
    )


def _may_be_ids(values: npt.NDArray[Any]) -> bool:
    is_whole = values.dtype.kind in "iuf" and np.all(values == np.rint(values))
    return bool(is_whole) and len(np.unique(values)) == len(values)


def _named_contacts(path: Path, text: str | None) -> dict[str, str]:
    """``id1=NAME,id2=NAME,...`` as a mapping."""
    if text is None:
        return {}
    pairs = [part.partition("=") for part in text.split(",")]
    is_sound = all(key.strip() and equals and own.strip() for key, equals, own in pairs)
    if not is_sound or len({key.strip() for key, _, _ in pairs}) < len(pairs):
        raise ReadError(
            f"{path}: `contact_columns`: expected id1=NAME,id2=NAME, and fx1, fy1, fz1 or fx2, "
            f"fy2, fz2 for the force on the first or second grain, found {text!r}"
        )
    return {key.strip(): own.strip() for key, _, own in pairs}


def _refuse_frames(path: Path, columns: Columns) -> None:
    """Several frames one below the other would be read as one packing."""
    for name, values in columns.items():
        may_be = plain_name(name) in PERHAPS_FRAMES
        if values.dtype.kind not in "iuf" or not (may_be or is_frame_name(name)):
            continue
        count = len(np.unique(values))
        if count > 1 and not may_be:
            raise ReadError(
                f"{path}: the column {name} has {count} values: expected one frame in a file: "
                f"write each to a file of its own"
            )
        blocks = np.count_nonzero(np.diff(values)) + 1
        if 1 < count == blocks <= len(values) / 2:
            warnings.warn(
                f"{path}: the column {name} has {count} values, each in rows that follow each "
                f"other: if these are frames, they are read as one packing: write each to a file "
                f"of its own",
                ScanfabWarning,
                stacklevel=3,
            )


def _grain_columns(found: Mapping[str, str], named: Mapping[str, str]) -> dict[str, str]:
    """Those columns that are a grain's by their names, and whatever else the user names."""
    return {what: name for what, name in found.items() if what in named or what in OF_GRAINS}


def _radii_of_volumes(columns: Columns, name: str) -> Columns:
    """The columns and a radius from the volume."""
    warnings.warn(
        f"radii are those of spheres of the volumes in {name}: of particles that are no single "
        f"spheres they would be wrong",
        ScanfabNote,
        stacklevel=3,
    )
    return {**columns, "radius": np.cbrt(0.75 / np.pi * columns[name].astype(np.float64))}


def _guess(path: Path, skip: int) -> dict[str, str]:
    """Columns without names: ``x y z r`` or ``id x y z r``, if the grains then touch."""
    names = _proved_names(path, skip, stamp_of(path))
    return {name: f"{place + 1}" for place, name in enumerate(names)}


@lru_cache
def _proved_names(path: Path, skip: int, stamp: Stamp) -> tuple[str, ...]:
    """Of a table as it stood then, so that it is proved once."""
    columns = read_unnamed(path, skip)
    names = _names_by_touch(path, list(columns.values()))
    _guessed.clear()
    _guessed[stamp, skip] = columns
    return names


def _names_by_touch(path: Path, places: Sequence[npt.NDArray[Any]]) -> tuple[str, ...]:
    """What columns must be, for grains to touch one another; ReadError if that cannot be told."""
    fits, large = [], False
    for begin in (0, 1):
        part = places[begin : begin + 4]
        if len(part) < 4 or any(column.dtype.kind not in "iuf" for column in part):
            continue
        if begin and not _may_be_ids(places[0]):
            continue
        x, y, z, radius = map(doubles, part)
        if touch(x, y, z, radius):
            fits.append(begin)
        elif not fits:
            large = large or touch(x, y, z, 0.5 * radius)
    if len(fits) != 1:
        lacks = (
            f"fewer than {TOO_FEW} grains prove nothing"
            if places and len(places[0]) < TOO_FEW
            else "the fourth is a diameter, it seems"
            if large
            else "as x y z r or id x y z r its grains do not touch"
        )
        raise ReadError(
            f"{path}: the {len(places)} columns have no names, and what they are cannot be "
            f"told ({lacks}): {ASK}"
        )
    return ("x", "y", "z", "radius") if fits[0] == 0 else ("id", "x", "y", "z", "radius")


def _tell_guess(
    names: Sequence[str] | None, found: Mapping[str, str], options: ReadOptions
) -> None:
    if names is not None or options.columns:
        return
    columns = " ".join(sorted(found, key=lambda what: int(found[what])))
    warnings.warn(
        f"the columns of the table have no names and are taken for {columns}, since the grains "
        f"then touch one another",
        ScanfabNote,
        stacklevel=2,
    )
