"""
Tables of any program: text with or without names, Parquet, NPZ and ``.xyzd``.

What a column is, its name says, or the user. Without either, four columns are ``x y z r``, and five
are ``id x y z r`` or ``x y z r`` and the clump; a note says so.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.typing import FloatArray
from scanfab.io.binary_tables import binary_names, is_xyzd, read_binary, xyzd_cell
from scanfab.io.columns import grain_table
from scanfab.io.formats.table_contacts import join_table
from scanfab.io.formats.table_names import (
    EDEM,
    PERHAPS_FRAMES,
    PFC,
    TABLE,
    Names,
    check_units,
    find_columns,
    is_contacts,
    is_frame_name,
    is_of_contacts,
    plain_name,
)
from scanfab.io.layout import TextTable, check_names, check_width, read_text, text_table, unique
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.io.text import Columns, Layout

# what must be a number in each row, and what a whole one
NUMBERS = ("x", "y", "z", "radius", "diameter", "volume", "id", "id1", "id2", "clump")
WHOLE = ("id", "id1", "id2", "clump")
OF_GRAINS = ("x", "y", "z", "radius", "diameter", "id", "clump")
# grains by which a table without names is judged, and the least median distance of a grain from
# the nearest one, in r1 + r2: below it the radii are diameters, or these are several frames
LOOKED_AT, LEAST_DISTANCE = 2000, 0.75
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
        *(".csv", ".tsv", ".txt", ".dat"),
        *(".parquet", ".npz", ".xyzd"),
    )
    generic = True
    is_table = True
    names: ClassVar[Names] = TABLE
    marks: ClassVar[tuple[str, ...]] = ("",)
    """How names of columns begin by which a program's own tables are recognised."""

    def told(self, options: ReadOptions) -> TableReader:
        """Columns may have no names but those that users give them."""
        return replace(self, options=options)

    def recognises(self, path: Path) -> bool:
        """Names of columns, the usual or the user's, that make grains or contacts."""
        try:
            head = table_head(path, self.options.skip)
            if head.names is None or not any(
                plain_name(name).startswith(self.marks) for name in head.names
            ):
                return False
            return self._kind_of(path, head) != "points"
        except ReadError:
            return False

    def kind(self, path: Path) -> FileKind:
        """By the columns; a table without names holds grains."""
        head = table_head(path, self.options.skip)
        if head.names or self.options.columns or self.options.contact_columns:
            return self._kind_of(path, head)
        _guessed(path, head)
        return "grains"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One."""
        return [Snapshot(path)]

    def carries(self, path: Path) -> Carries:
        """A table has no cell, but beside an ``.xyzd`` there is one."""
        return "cell" if is_xyzd(path) and xyzd_cell(path) is not None else "nothing"

    def beside(self, path: Path) -> list[Path]:
        """The file with the cell of an ``.xyzd``."""
        return [path.with_name("packing.nfo")] if is_xyzd(path) else []

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names or numbers."""
        path, head = snapshot.path, table_head(snapshot.path, options.skip)
        is_guess = head.names is None and not options.columns
        if is_guess:
            found = _guessed(path, head)
        else:
            found = replace(self, options=options)._find(path, head, contacts=False)
        columns = _read(path, head, found)
        if is_guess:
            _refuse_wrong_guess(path, found, columns)
        if head.names is not None:
            _refuse_frames(path, columns)
            check_units(path, found)
        if "volume" in found and not found.keys() & {"radius", "diameter"}:
            warnings.warn(
                f"radii are those of spheres of the volumes in {found['volume']}: of particles "
                f"that are no single spheres they would be wrong",
                ScanfabNote,
                stacklevel=2,
            )
            volume = columns[found["volume"]].astype(np.float64)
            columns["radius"] = np.cbrt(0.75 / np.pi * volume)
            found["radius"] = "radius"
        # of the columns that are known only by their usual names, those of grains
        own_names = {
            what: name
            for what, name in found.items()
            if what in options.columns or what in OF_GRAINS
        }
        cell = xyzd_cell(path) if is_xyzd(path) else None
        return grain_table(path, columns, cell, replace(options, columns=own_names))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Pairs by the columns ``id1`` and ``id2``, or those that the user names."""
        path, head = snapshot.path, table_head(snapshot.path, options.skip)
        found = replace(self, options=options)._find(path, head, contacts=True)
        if not {"id1", "id2"} <= found.keys():
            raise ReadError(
                f"{path}: expected two columns of ids, id1 and id2, found {', '.join(head.own)}: "
                f'name them with `contact_columns="id1=NAME,id2=NAME"`'
            )
        check_units(path, found, contacts=True)
        columns = _read(path, head, found)
        return join_table(path, grains, {what: columns[name] for what, name in found.items()})

    def left_out(self, path: Path) -> list[str]:
        """The columns of a table of contacts that no packing has a place for."""
        head = table_head(path, self.options.skip)
        if head.names is None:
            return []
        found = self._find(path, head, contacts=True)
        used = {own for what, own in found.items() if is_of_contacts(what)}
        return [name for name in unique(head.names) if name not in used]

    def _find(self, path: Path, head: TextTable, *, contacts: bool) -> dict[str, str]:
        """The columns of grains, or those of contacts, by what they are."""
        if contacts:
            pairs = _named_contacts(path, self.options.contact_columns)
            return find_columns(path, head.own, self.names, pairs, "contact_columns")
        named = self.options.columns
        found = find_columns(path, head.own, self.names, named, "columns")
        for size, other in (("diameter", "radius"), ("radius", "diameter")):
            if size in named and other not in named:
                found.pop(other, None)
        return found

    def _kind_of(self, path: Path, head: TextTable) -> FileKind:
        """What these columns are; ReadError if they are nothing that scanfab reads."""
        wrong: list[ReadError] = []
        found: list[dict[str, str]] = []
        for contacts in (False, True):
            try:
                found.append(self._find(path, head, contacts=contacts))
            except ReadError as error:
                wrong.append(error)
                found.append({})
        grains, pairs = found
        if self.options.contact_columns and is_contacts(pairs):
            # other tables may have columns of these numbers: ids are whole numbers
            places = [unique(head.own).index(pairs[one]) for one in ("id1", "id2")]
            if all("".join(row[k].strip() for k in places).isdigit() for row in head.rows):
                return "contacts"
        if {"x", "y", "z"} <= grains.keys() and not is_contacts(grains):
            sized = grains.keys() & {"radius", "diameter", "volume"}
            return "grains" if sized else "points"
        if is_contacts(pairs):
            return "contacts"
        check_names(path, head)
        if wrong:
            raise wrong[0]
        raise ReadError(
            f"{path}: expected columns of grains (x, y, z, radius or diameter) or contacts "
            f"(id1, id2), found {', '.join(head.own)}: {ASK}"
        )


@dataclass(frozen=True)
class PfcReader(TableReader):
    """Tables that users of PFC write, by FISH or Python."""

    name = "pfc"
    description = "tables of PFC's ball and contact attributes: ball.pos.x, contact.end1.id, ..."
    extensions = ()
    names = PFC
    marks = ("ball.", "contact.end")


@dataclass(frozen=True)
class EdemReader(TableReader):
    """Tables that EDEM's export of queries makes."""

    name = "edem"
    description = (
        'tables of EDEM\'s export, by the titles of its queries: "Particle Position X", ...'
    )
    extensions = ()
    names = EDEM

    def recognises(self, path: Path) -> bool:
        """By name only."""
        return False


def table_head(path: Path, skip: int) -> TextTable:
    """The names of the columns, and of a text how it is written."""
    names = binary_names(path)
    if names is None:
        return text_table(path, skip)
    check_width(path, len(names))
    return TextTable(Layout(tuple(names)), names, 0, [])


def _read(path: Path, head: TextTable, found: Mapping[str, str]) -> Columns:
    """All columns by their names; those that were found hold numbers if they must."""
    numbers = [found[one] for one in NUMBERS if one in found]
    if binary_names(path) is None:
        columns = read_text(path, head, numbers, [found[one] for one in WHOLE if one in found])
    else:
        columns = read_binary(path)
    for name in numbers:
        if name not in columns or columns[name].dtype.kind not in "biuf":
            raise ReadError(f"{path}: expected numbers in the column {name}, found none")
    return columns


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


def _guessed(path: Path, head: TextTable) -> dict[str, str]:
    """
    The columns of a table without names, by their number.

    Four are x y z r. Five are id x y z r if the first holds distinct whole numbers, else x y z r
    and the number of the clump.
    """
    width, first = len(head.own), [row[0].strip() for row in head.rows]
    has_ids = all(word.isdigit() for word in first) and len(set(first)) == len(first)
    if width == 5:
        names = ["id", "x", "y", "z", "radius"] if has_ids else ["x", "y", "z", "radius", "clump"]
    elif width == 4 and not (has_ids and len(first) > 1):
        names = ["x", "y", "z", "radius"]
    else:
        lacks = "the first of four seems to be ids" if width == 4 else "expected four or five"
        raise ReadError(f"{path}: the {width} columns have no names ({lacks}): {ASK}")
    return {name: f"{place + 1}" for place, name in enumerate(names)}


def _refuse_wrong_guess(path: Path, found: Mapping[str, str], columns: Columns) -> None:
    """ReadError if the columns of a table without names cannot be what they were taken for."""
    radius = doubles(columns[found["radius"]])
    position = np.column_stack([columns[found[axis]] for axis in "xyz"]).astype(np.float64)
    lacks = ""
    if not np.all(radius > 0):
        lacks = "some radii would not be positive"
    elif "clump" in found and columns[found["clump"]].dtype.kind != "i":
        lacks = "some numbers of clumps would not be whole"
    elif _median_distance(position, radius) < LEAST_DISTANCE:
        lacks = "grains would lie in one another: is the last a diameter, or are these two frames"
    told = " ".join(found)
    if lacks:
        raise ReadError(f"{path}: the columns have no names, and as {told} {lacks}: {ASK}")
    warnings.warn(
        f"{path}: the columns have no names and are taken for {told}: if they are something "
        f"else, say so with `columns`",
        ScanfabNote,
        stacklevel=3,
    )


def _median_distance(position: FloatArray, radius: FloatArray) -> float:
    """The median distance of grains from the nearest one, in the sum of both radii."""
    from scipy.spatial import KDTree

    if len(radius) < 2 or not np.all(np.abs(position) < MOST):
        return np.inf
    chosen = np.random.default_rng(0).permutation(len(radius))[:LOOKED_AT]
    distance, other = KDTree(position, balanced_tree=False).query(position[chosen], k=2)
    return float(np.median(distance[:, 1] / (radius[chosen] + radius[other[:, 1]])))
