"""
Tables of any program: text with or without names, Parquet, NPZ and ``.xyzd``.

What a column is, its name says, or the user. Without either, four columns are ``x y z r``, and five
are ``id x y z r`` or ``x y z r`` and the clump; a note says so.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.typing import Columns
from scanfab.io.binary_tables import binary_names, is_xyzd, read_binary, xyzd_cell
from scanfab.io.columns import grain_table
from scanfab.io.contacts import join_table
from scanfab.io.formats import table_names
from scanfab.io.formats.table_names import Names, find_columns, plain_name
from scanfab.io.layout import TextTable, read_text, text_table
from scanfab.io.options import parse_columns
from scanfab.io.reader import Carries, FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Layout

# what must be a number in each row, and what a whole one
WHOLE = ("id", "id1", "id2", "clump")
NUMBERS = ("x", "y", "z", "radius", "diameter", "volume", *WHOLE)
MOST_COLUMNS = 4096
CENTRES, SIZES = {"x", "y", "z"}, {"radius", "diameter", "volume"}
OF_GRAINS = ("x", "y", "z", "radius", "diameter", "id", "clump")
# a table without names is judged by this many grains; if their median distance to the nearest grain
# is below this many diameters, its radii are diameters, or it holds several frames
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
    extensions: ClassVar[tuple[str, ...]] = (".csv", ".tsv", ".txt", ".dat", ".parquet", ".npz")
    extensions += (".xyzd",)
    generic = True
    is_table = True
    names: ClassVar[Names] = table_names.TABLE
    marks: ClassVar[tuple[str, ...]] = ("",)
    """How names of columns begin by which a program's own tables are recognised."""

    def told(self, options: ReadOptions) -> TableReader:
        """Columns may have no names but those that users give them."""
        return replace(self, options=options)

    def recognises(self, path: Path) -> bool:
        """Names of columns, the usual or the user's, that make grains or contacts."""
        try:
            head = table_head(path, self.options.skip)
            is_marked = any(plain_name(name).startswith(self.marks) for name in head.own)
            return head.is_named and is_marked and self._kind_of(path, head) != "points"
        except ReadError:
            return False

    def kind(self, path: Path) -> FileKind:
        """By the columns; a table without names holds grains."""
        head = table_head(path, self.options.skip)
        if head.is_named or self.options.columns or self.options.contact_columns:
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
        is_guessed = not head.is_named and not options.columns
        found = _guessed(path, head) if is_guessed else self.told(options)._grains(path, head)
        columns = _read(path, head, found)
        if is_guessed:
            _refuse_wrong_guess(path, found, columns)
        elif head.is_named:
            table_names.refuse_frames(path, columns)
            table_names.check_units(path, found)
        if "volume" in found and not found.keys() & {"radius", "diameter"}:
            own = found["volume"]
            note(f"radii are those of spheres of the volumes in {own}: is each particle one?")
            columns["radius"] = np.cbrt(0.75 / np.pi * doubles(columns[own]))
            found["radius"] = "radius"
        # of the columns that are known only by their usual names, those of grains
        known = {k: own for k, own in found.items() if k in options.columns or k in OF_GRAINS}
        cell = xyzd_cell(path) if is_xyzd(path) else None
        return grain_table(path, columns, cell, replace(options, columns=known))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Pairs by the columns ``id1`` and ``id2``, or those that the user names."""
        path, head = snapshot.path, table_head(snapshot.path, options.skip)
        found = self.told(options)._pairs(path, head)
        if not {"id1", "id2"} <= found.keys():
            told = f"expected two columns of ids, id1 and id2, found {', '.join(head.own)}"
            raise ReadError(f'{path}: {told}: name them with `contact_columns="id1=...,id2=..."`')
        table_names.check_units(path, found, contacts=True)
        columns = _read(path, head, found)
        return join_table(path, grains, {what: columns[name] for what, name in found.items()})

    def _grains(self, path: Path, head: TextTable) -> dict[str, str]:
        """The columns of grains by what they are."""
        named, sizes = self.options.columns, {"radius", "diameter"}
        found = find_columns(path, head, self.names, named, "columns")
        # where users name one size, the other need not be believed
        lost = sizes - named.keys() if sizes & named.keys() else set()
        return {what: own for what, own in found.items() if what not in lost}

    def _pairs(self, path: Path, head: TextTable) -> dict[str, str]:
        """The columns of contacts by what they are."""
        try:
            named = parse_columns("contact_columns", self.options.contact_columns) or {}
        except SettingsError as error:  # for another format than this, perhaps
            raise ReadError(f"{path}: {error}") from None
        return find_columns(path, head, self.names, named, "contact_columns")

    def _kind_of(self, path: Path, head: TextTable) -> FileKind:
        """What these columns are; ReadError if they are nothing that scanfab reads."""
        found: list[dict[str, str]] = []
        wrong = f"{path}: expected columns of grains (x, y, z, radius or diameter) or contacts "
        wrong += f"(id1, id2), found {', '.join(head.own)}: {ASK}"
        for columns in (self._pairs, self._grains):
            try:
                found.append(columns(path, head))
            except ReadError as error:
                found.append({})
                wrong = str(error)
        pairs, grains = found
        has_ids = {"id1", "id2"} <= pairs.keys() and not _are_grains(pairs)
        if self.options.contact_columns and has_ids:
            # other tables may have columns of these numbers: ids are whole numbers
            places = [head.layout.names.index(pairs[one]) for one in ("id1", "id2")]
            if all("".join(row[k].strip() for k in places).isdigit() for row in head.rows):
                return "contacts"
        if _are_grains(grains) or has_ids:
            return "grains" if _are_grains(grains) else "contacts"
        if grains.keys() >= CENTRES:
            return "points"
        raise ReadError(wrong)


def _are_grains(columns: dict[str, str]) -> bool:
    """Whether columns say where grains are, and how large."""
    return columns.keys() >= CENTRES and not SIZES.isdisjoint(columns)


@dataclass(frozen=True)
class PfcReader(TableReader):
    """Tables that users of PFC write, by FISH or Python."""

    name = "pfc"
    description = "tables of PFC's ball and contact attributes: ball.pos.x, contact.end1.id, ..."
    extensions = ()
    names = table_names.PFC
    marks = ("ball.", "contact.end")


@dataclass(frozen=True)
class EdemReader(TableReader):
    """Tables that EDEM's export of queries makes."""

    name = "edem"
    description = (
        'tables of EDEM\'s export, by the titles of its queries: "Particle Position X", ...'
    )
    extensions = ()
    names = table_names.EDEM
    marks = ("particle.position.", "contact.idfirst")


def table_head(path: Path, skip: int) -> TextTable:
    """The names of the columns, and of a text how it is written."""
    names = binary_names(path)
    head = text_table(path, skip) if names is None else TextTable(Layout(tuple(names)), names, True)
    if len(head.own) > MOST_COLUMNS:
        raise ReadError(f"{path}: expected at most {MOST_COLUMNS} columns, found {len(head.own)}")
    return head


def _read(path: Path, head: TextTable, found: dict[str, str]) -> Columns:
    """All columns by their names; those that were found hold numbers if they must."""
    numbers = [found[one] for one in NUMBERS if one in found]
    if binary_names(path) is None:
        return read_text(path, head, numbers, [found[one] for one in WHOLE if one in found])
    columns = read_binary(path)
    for name in numbers:
        if name not in columns or columns[name].dtype.kind not in "biuf":
            raise ReadError(f"{path}: expected numbers in the column {name}, found none")
    return columns


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


def _refuse_wrong_guess(path: Path, found: dict[str, str], columns: Columns) -> None:
    """ReadError if the columns of a table without names cannot be what they were taken for."""
    from scipy.spatial import KDTree

    radius = columns[found["radius"]]
    position = np.column_stack([columns[found[axis]] for axis in "xyz"])
    lacks = ""
    if not np.all(radius > 0):
        lacks = "some radii would not be positive"
    elif "clump" in found and columns[found["clump"]].dtype.kind != "i":
        lacks = "some numbers of clumps would not be whole"
    elif len(radius) > 1 and np.all(np.abs(position) < MOST):
        away, nearest = KDTree(position, balanced_tree=False).query(position[:LOOKED_AT], k=2)
        if np.median(away[:, 1] / radius[nearest].sum(axis=1)) < LEAST_DISTANCE:
            lacks = "grains would lie in one another: is the last a diameter, or are these two "
            lacks += "frames"
    told = " ".join(found)
    if lacks:
        raise ReadError(f"{path}: the columns have no names, and as {told} {lacks}: {ASK}")
    note(f"{path}: the columns have no names and are taken for {told}: if not, use `columns`")
