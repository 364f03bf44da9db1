"""
Tables of any program: text with or without names, Parquet, NPZ and ``.xyzd``.

The meaning of a column follows from its name, or from the user's options. Without names, four
columns are taken as ``x y z r``, and five as ``id x y z r`` or ``x y z r clump``; a note says so.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.typing import Columns
from scanfab.io.binary_files import binary_names, is_xyzd, packing_info, read_binary
from scanfab.io.columns import DIAMETER_NAMES, ID_NAMES, RADIUS_NAMES, grain_table
from scanfab.io.contacts import join_table
from scanfab.io.layout import TextTable, read_text, text_table
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
    parse_columns,
)
from scanfab.io.text import Layout

Names = Mapping[str, tuple[str, ...]]
"""The names that a column may have for each quantity, in the form of :func:`plain_name`."""

# names of columns that number the frames in a file
FRAME_NAMES = ("step", "timestep", "time.step", "frame", "time", "time.s", "time.ms")
# names of a coordinate (axis and its number), of a grain in a contact, and of a force component,
# including the names of PFC and EDEM
CENTRE = (
    "{0} pos.{0} pos{0} position.{0} positions.{0} points.{0} points.{1} ball.pos.{0} "
    "ball.position.{0} ball.{0} particle.position.{0}"
)
END = (
    "id{0} id.{0} grain{0} particle{0} particle.{0} body{0} contact.end{0}.id contact.end{0} "
    "end{0}.id end{0} contact.id{0}"
)
FORCE = "f{0} force.{0} f.{0} contact.force.global.{0} force.global.{0}"
# contacts: force on either grain, image of the second, force on the first or second grain, normal
# and tangential part of the force
ALONG = {"f{0}": FORCE, "i{0}": "i{0} image.{0}", "f{0}1": "f{0}1", "f{0}2": "f{0}2"}
ALONG |= {"fn{0}": "fn{0} contact.normal.force.{0}", "ft{0}": "ft{0} contact.tangential.force.{0}"}
FORCES: dict[str, tuple[str, ...]] = {
    "fn": ("fn", "force.n", "normal.force", "contact.force.normal", "force.normal"),
    "compression": ("compression",),
    "kind": ("contact.type", "kind"),
}
FORCES |= {k.format(x): tuple(v.format(x).split()) for x in "xyz" for k, v in ALONG.items()}
TABLE: Names = {
    **{axis: tuple(CENTRE.format(axis, number).split()) for number, axis in enumerate("xyz")},
    "radius": (*RADIUS_NAMES, "f.radius", "ball.radius", "particle.radius"),
    "diameter": (*DIAMETER_NAMES, "ball.diameter", "particle.diameter"),
    "id": (*ID_NAMES, "particle.id", "body.id", "ball.id"),
    "id1": (*END.format(1).split(), "geoa", "i", "contact.idfirst", "contact.id.first"),
    "id2": (*END.format(2).split(), "geob", "j", "contact.idsecond", "contact.id.second"),
    **FORCES,
}
PFC: Names = {**TABLE, "kind": ("contact.type", "type")}
EDEM: Names = {**TABLE, "volume": ("particle.volume", "volume")}

LENGTHS = ("x", "y", "z", "radius", "diameter", "volume")
# EDEM numbers its queries: "Q05 : Particle Position X:"
QUERY = re.compile(r"^q[0-9]+[\s:.]+")
CUBE = re.compile(r"^cu |(\^|\*\*)?3$")
UNIT = re.compile(r"\s*[\[(]\s*([^\])]*)\s*[\])]\s*$")
# quantities that must be a number in each row; WHOLE: a whole number
WHOLE = ("id", "id1", "id2", "clump")
NUMBERS = ("x", "y", "z", "radius", "diameter", "volume", *WHOLE)
MOST_COLUMNS = 4096
CENTRES, SIZES = {"x", "y", "z"}, {"radius", "diameter", "volume"}
OF_GRAINS = ("x", "y", "z", "radius", "diameter", "id", "clump")
# check of a table without names, by its first grains (LOOKED_AT): if their median distance to the
# nearest grain is below LEAST_DISTANCE diameters, radii are diameters, or there are several frames
LOOKED_AT, LEAST_DISTANCE = 2000, 0.75
ASK = (
    'name them, for instance `columns="x=1,y=2,z=3,radius=4"` (or diameter=4; numbers of columns '
    "count from 1); discs need a column z, too, with the same value in each row"
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
    names: ClassVar[Names] = TABLE
    marks: ClassVar[tuple[str, ...]] = ("",)
    """Prefixes of names of columns by which tables of a program are recognised."""

    def told(self, options: ReadOptions) -> TableReader:
        """The reader with the user's options, which may name the columns."""
        return replace(self, options=options)

    def recognises(self, path: Path) -> bool:
        """Whether the columns, by usual names or the user's, hold grains or contacts."""
        try:
            head = table_head(path, self.options.skip)
            is_marked = any(plain_name(name).startswith(self.marks) for name in head.own)
            return head.is_named and is_marked and self._kind_of(path, head) != "points"
        except ReadError:
            return False

    def kind(self, path: Path) -> FileKind:
        """The kind of the table, by its columns; a table without names holds grains."""
        head = table_head(path, self.options.skip)
        if head.is_named or self.options.columns or self.options.contact_columns:
            return self._kind_of(path, head)
        _guessed(path, head)
        return "grains"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The only snapshot."""
        return [Snapshot(path)]

    def carries(self, path: Path) -> Carries:
        """Tables have no cell, except ``.xyzd`` with its file packing.nfo."""
        return "cell" if is_xyzd(path) and packing_info(path) is not None else "nothing"

    def beside(self, path: Path) -> list[Path]:
        """The file packing.nfo, which holds the cell of an ``.xyzd``."""
        return [path.with_name("packing.nfo")] if is_xyzd(path) else []

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The grains, with columns found by names or numbers."""
        path, head = snapshot.path, table_head(snapshot.path, options.skip)
        is_guessed = not head.is_named and not options.columns
        roles = _guessed(path, head) if is_guessed else self.told(options)._grains(path, head)
        # not id1 and id2: an NPZ file may hold contacts, too, in arrays of another length
        columns = _read(path, head, {k: own for k, own in roles.items() if k not in ("id1", "id2")})
        if is_guessed:
            _refuse_wrong_guess(path, roles, columns)
        elif head.is_named:
            for name in (name for name in columns if plain_name(name) in FRAME_NAMES):
                if (count := len(np.unique(columns[name]))) > 1:
                    expected = "expected one frame in a file: write one for each, or rename it"
                    raise ReadError(f"{path}: the column {name} has {count} values: {expected}")
            check_units(path, roles)
        if "volume" in roles and not roles.keys() & {"radius", "diameter"}:
            own = roles["volume"]
            note(f"radii are computed from the volumes in {own}: is each particle a single sphere?")
            columns["radius"] = np.cbrt(0.75 / np.pi * doubles(columns[own]))
            roles["radius"] = "radius"
        # columns that the user names, and columns of grains with usual names; not those of contacts
        known = {k: own for k, own in roles.items() if k in options.columns or k in OF_GRAINS}
        info = packing_info(path) if is_xyzd(path) else None
        return grain_table(path, columns, info and info[1], replace(options, columns=known))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """The pairs in the columns ``id1`` and ``id2``, or in the columns that the user names."""
        path, head = snapshot.path, table_head(snapshot.path, options.skip)
        roles = self.told(options)._pairs(path, head)
        if not {"id1", "id2"} <= roles.keys():
            problem = f"expected two columns of ids, id1 and id2, found {', '.join(head.own)}"
            advice = 'name them with `contact_columns="id1=...,id2=..."`'
            raise ReadError(f"{path}: {problem}: {advice}")
        check_units(path, roles, contacts=True)
        columns = _read(path, head, roles)
        return join_table(path, grains, {what: columns[name] for what, name in roles.items()})

    def _grains(self, path: Path, head: TextTable) -> dict[str, str]:
        """The columns of grains by quantity."""
        named, sizes = self.options.columns, {"radius", "diameter"}
        roles = find_columns(path, head, self.names, named, "columns")
        # if the user names only radius or only diameter, ignore the other
        lost = sizes - named.keys() if sizes & named.keys() else set()
        return {what: own for what, own in roles.items() if what not in lost}

    def _pairs(self, path: Path, head: TextTable) -> dict[str, str]:
        """The columns of contacts by quantity."""
        try:
            named = parse_columns("contact_columns", self.options.contact_columns)
        except SettingsError as error:  # the option may be meant for another format
            raise ReadError(f"{path}: {error}") from None
        return find_columns(path, head, self.names, named, "contact_columns")

    def _kind_of(self, path: Path, head: TextTable) -> FileKind:
        """The kind of a table with these columns; ReadError if scanfab cannot use them."""
        roles: list[dict[str, str]] = []
        wrong = f"{path}: expected columns of grains (x, y, z, radius or diameter) or contacts "
        wrong += f"(id1, id2), found {', '.join(head.own)}: {ASK}"
        for columns in (self._pairs, self._grains):
            try:
                roles.append(columns(path, head))
            except ReadError as error:
                roles.append({})
                wrong = str(error)
        pairs, grains = roles
        has_ids = {"id1", "id2"} <= pairs.keys() and not _are_grains(pairs)
        if self.options.contact_columns and has_ids:
            # any table may have columns of these numbers: check that they hold whole numbers
            places = [head.layout.names.index(pairs[end]) for end in ("id1", "id2")]
            ids = [row[k : k + 1] for row in head.rows for k in places]
            if all(word and word[0].strip().isdigit() for word in ids):
                return "contacts"
        if _are_grains(grains) or has_ids:
            return "grains" if _are_grains(grains) else "contacts"
        if grains.keys() >= CENTRES:
            return "points"
        raise ReadError(wrong)


def _are_grains(columns: dict[str, str]) -> bool:
    """Whether the columns include centres and sizes of grains."""
    return columns.keys() >= CENTRES and not SIZES.isdisjoint(columns)


@dataclass(frozen=True)
class PfcReader(TableReader):
    """Reader plugin for tables that users of PFC write, by FISH or Python."""

    name = "pfc"
    description = "tables of PFC's ball and contact attributes: ball.pos.x, contact.end1.id, ..."
    extensions = ()
    names = PFC
    marks = ("ball.", "contact.end")


@dataclass(frozen=True)
class EdemReader(TableReader):
    """Reader plugin for tables that EDEM exports from queries."""

    name = "edem"
    description = (
        'tables of EDEM\'s export, by the titles of its queries: "Particle Position X", ...'
    )
    extensions = ()
    names = EDEM
    marks = ("particle.position.", "contact.idfirst")


def plain_name(name: str) -> str:
    """A name in small letters, points between words, without the number of a query and the unit."""
    text = QUERY.sub("", UNIT.sub("", name.strip()).lower())
    return re.sub(r"[^a-z0-9]+", ".", text).strip(".")


def find_columns(
    path: Path, table: TextTable, known: Names, named: Mapping[str, str], option: str
) -> dict[str, str]:
    """
    Find the column (its name in the layout) for each known quantity.

    Parameters
    ----------
    path : Path
        The file, for messages.
    table : TextTable
        The table, with the names of all columns.
    known : mapping
        The usual names of each quantity.
    named : mapping of str to str
        The user's choice: quantity to name or number (from 1) of a column; a name comes first.
    option : str
        The name of the option with the user's choice, for messages.

    Raises
    ------
    ReadError
        If the user names a column that does not exist, or one column twice, or if two columns have
        the name of one quantity.
    """
    names, plain = table.own, [plain_name(name) for name in table.own]
    roles: dict[str, str] = {}
    for standard in (*named, *(what for what in known if what not in named)):
        if (key := named.get(standard)) is not None:
            places = [place for place, name in enumerate(names) if name == key]
            if not places and re.fullmatch(r"[0-9]{1,6}", key) and 1 <= int(key) <= len(names):
                places = [int(key) - 1]
            if not places:
                problem = f"there is no column {key!r} to serve as {standard}"
                raise ReadError(f"{path}: {problem}; the columns are {', '.join(names)}")
        else:
            word = next((name for name in known[standard] if name in plain), None)
            places = [place for place, name in enumerate(plain) if name == word]
        if len(places) > 1:
            listed = ", ".join(f"{names[place]!r} (column {place + 1})" for place in places)
            advice = f'choose one by its number: `{option}={{"{standard}": {places[0] + 1}}}`'
            raise ReadError(f"{path}: several columns may be {standard}: {listed}: {advice}")
        keys = [table.layout.names[place] for place in places]
        if standard in named or not {*keys} <= {*roles.values()}:
            roles[standard] = keys[0]
    return roles


def check_units(path: Path, roles: Mapping[str, str], contacts: bool = False) -> None:
    """
    Check that all lengths have one unit and volumes its cube; for contacts, that forces have one.

    Raises
    ------
    ReadError
        If the names of the columns state different units.
    """
    units: dict[str, str] = {}
    for what, name in roles.items():
        # NFKC unifies the two letters for micro; CUBE knows the spellings of a cube
        unit = UNIT.search(unicodedata.normalize("NFKC", name))
        if unit and unit[1].strip() and (what.startswith("f") if contacts else what in LENGTHS):
            units[name] = CUBE.sub("", unit[1].strip())
    if len({*units.values()}) > 1:
        kind = "forces" if contacts else "lengths (and volumes in its cube)"
        raise ReadError(f"{path}: expected {kind} of one unit, found {', '.join(units)}")


def table_head(path: Path, skip: int) -> TextTable:
    """The names of the columns of a table, and for text the layout."""
    names = binary_names(path)
    head = text_table(path, skip) if names is None else TextTable(Layout(tuple(names)), names, True)
    if len(head.own) > MOST_COLUMNS:
        raise ReadError(f"{path}: expected at most {MOST_COLUMNS} columns, found {len(head.own)}")
    return head


def _read(path: Path, head: TextTable, roles: dict[str, str]) -> Columns:
    """All columns by name; ReadError if a column of `roles` that needs numbers has none."""
    numbers = [roles[what] for what in NUMBERS if what in roles]
    if binary_names(path) is None:
        return read_text(path, head, numbers, [roles[what] for what in WHOLE if what in roles])
    columns = read_binary(path)
    for name in numbers:
        if name not in columns or columns[name].dtype.kind not in "biuf":
            raise ReadError(f"{path}: expected numbers in the column {name}, found none")
    return columns


def _guessed(path: Path, head: TextTable) -> dict[str, str]:
    """
    Guess the columns of a table without names from how many there are.

    Four are x y z r. Five are id x y z r if the first column holds distinct whole numbers, else
    x y z r and the number of the clump.
    """
    width, first = len(head.own), [row[0].strip() for row in head.rows]
    has_ids = all(word.isdigit() for word in first) and len(set(first)) == len(first)
    if width == 5:
        names = ["id", "x", "y", "z", "radius"] if has_ids else ["x", "y", "z", "radius", "clump"]
    elif width == 4 and not (has_ids and len(first) > 1):
        names = ["x", "y", "z", "radius"]
    else:
        lacks = "the first of four looks like ids" if width == 4 else "expected four or five"
        raise ReadError(f"{path}: the {width} columns have no names ({lacks}): {ASK}")
    return {name: f"{place + 1}" for place, name in enumerate(names)}


def _refuse_wrong_guess(path: Path, roles: dict[str, str], columns: Columns) -> None:
    """ReadError if the guessed meaning of the columns is impossible."""
    from scipy.spatial import KDTree

    radius = columns[roles["radius"]]
    position = np.column_stack([columns[roles[axis]] for axis in "xyz"])
    lacks = ""
    if not np.all(radius > 0):
        lacks = "some radii would not be positive"
    elif "clump" in roles and columns[roles["clump"]].dtype.kind != "i":
        lacks = "some numbers of clumps would not be whole"
    elif len(radius) > 1 and np.all(np.abs(position) < MOST):
        away, nearest = KDTree(position, balanced_tree=False).query(position[:LOOKED_AT], k=2)
        if np.median(away[:, 1] / radius[nearest].sum(axis=1)) < LEAST_DISTANCE:
            lacks = "grains would be inside one another: is the last a diameter, or are these two "
            lacks += "frames"
    guess = " ".join(roles)
    if lacks:
        raise ReadError(f"{path}: the columns have no names, and as {guess} {lacks}: {ASK}")
    note(f"{path}: the columns have no names and are taken as {guess}: if not, use `columns`")
