"""
LAMMPS and LIGGGHTS: all kinds of dumps, ``write_data``, and LIGGGHTS' VTK files.

The columns of a ``dump local`` have meaningless names. The values say which columns hold ids: two
neighbouring columns of ids in LAMMPS' lists of pairs. LIGGGHTS' ``compute pair/gran/local`` and
``wall/gran/local`` write their values in a fixed order, whatever the order of the keywords.
"""

from __future__ import annotations

import re
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.columns import whole_numbers
from scanfab.io.contacts import NotContactsError, OtherGrainsError, branches, join_ids, rows_of_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats.binary_dump import BinaryDump, NetcdfDump
from scanfab.io.formats.lammps_data import DataFile
from scanfab.io.formats.shared import FormsReader, GrainsOnly
from scanfab.io.formats.text_dump import TextDump
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.reader import GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.packing.contacts import WallForces

# only LAMMPS writes these items, and bounds with 16 digits (LIGGGHTS: six digits)
LAMMPS_ITEMS = re.compile(rb"(?m)^ITEM: ((UNITS|TIME)\s|BOX BOUNDS( abc|[^\n]*\n-?\d\.\d{16}e))")
# a restart of LIGGGHTS begins with a flag, the length of the version, and the version
RESTART = re.compile(rb"LammpS RestartT|\0{4}.{2}\0\0[^\0]{0,100}LIGGGHTS", re.DOTALL)
# keywords of LIGGGHTS' compute pair/gran/local in the order of output, and how many values each has
PAIR_VALUES = {"pos": 6, "vel": 6, "id": 3, "force": 3, "force_normal": 3, "force_tangential": 3}
PAIR_VALUES |= {"torque": 3, "torque_normal": 3, "torque_tangential": 3, "history": 3}
PAIR_VALUES |= {"contactArea": 1, "delta": 1, "contactPoint": 3, "ms_id": 2, "heatFlux": 1}
# keys of contact_columns: ids, force on the first grain, and a second part of this force
IDS, FORCE, TANGENTIAL = ("id1", "id2"), ("fx", "fy", "fz"), ("tx", "ty", "tz")
# if no gap is wider than this, in units of r1 + r2, all listed pairs touch, up to rounding
ROUNDING = 1e-3
# a column has a meaning if the rule for it holds in more than this share of the rows
MOST_ROWS = 0.5
# of the pairs that LAMMPS lists, this share is closer than NEIGHBOURS, in units of r1 + r2
NEIGHBOURS, NEARLY_ALL = 2.0, 0.98
# at least this share of contact forces is repulsive; damping makes a few attractive
PUSHES = 0.9


class Places(NamedTuple):
    """The columns of a contact list by their meaning, counted from 0."""

    ids: list[int]
    force: list[list[int]] = []  # noqa: RUF012
    """Triples of columns; their sum is the force on the first grain."""
    normal: list[int] | None = None
    """The triple that holds the normal part of this force."""
    touch: bool = True
    """Whether all listed pairs touch; LAMMPS lists all pairs within a cut-off."""


FORMS: tuple[GrainsOnly, ...] = (TextDump(), DataFile(), NetcdfDump(), BinaryDump())


class LammpsReader(FormsReader):
    """Reader plugin for the dumps of LAMMPS."""

    name = "lammps"
    description = "LAMMPS dump custom (text, binary, yaml, netcdf), dump local (text), write_data"
    extensions = (".lammpstrj", ".lmp", ".data", ".local", ".bin", ".yaml", ".nc")
    forms = (*FORMS, VtkReader())
    lists_walls = False
    """Whether the program lists contacts with walls, which are recognised by their values."""

    def recognises(self, path: Path) -> bool:
        """Recognised by marks that only one of both programs writes."""
        head = first_bytes(path)
        first, _, rest = head.partition(b"\n")
        if head.startswith(b"# vtk DataFile"):
            # only LIGGGHTS writes legacy VTK
            return self.name == "liggghts" and b"LIGGGHTS" in rest.partition(b"\n")[0]
        form = next((form for form in FORMS if form.recognises(path)), None)
        if RESTART.match(head) or isinstance(form, DataFile):
            # the first line is free text, or holds the version of the program
            is_liggghts = b"LIGGGHTS" in first[:1000].upper()
        elif isinstance(form, BinaryDump):
            # the columns of LIGGGHTS' binary dumps have no names
            is_liggghts = form.names(path)[:1] == ["1"]
        elif form is None:
            return False
        else:
            is_liggghts = head.startswith(b"ITEM: ") and LAMMPS_ITEMS.search(head) is None
        return is_liggghts == (self.name == "liggghts")

    def form(self, path: Path) -> GrainsOnly:
        """The reader for the form of a file; ReadError for a restart."""
        if RESTART.match(first_bytes(path)):
            advice = "let its program read it, and dump custom ... id type x y z radius"
            raise ReadError(f"{path}: only its own program can read a binary restart: {advice}")
        return super().form(path)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        The pairs of a ``dump local``, with forces if the columns of the force are known.

        The meaning of the columns comes from ``contact_columns``, or from the values if these leave
        no doubt.
        """
        path, option, form = snapshot.path, options.contact_columns, self.form(snapshot.path)
        if not isinstance(form, TextDump):
            return form.read_contacts(snapshot, options, grains)
        columns, _ = form.table(snapshot)
        values = np.column_stack(list(columns.values())).astype(np.float64)
        if not len(values) or grains.id is None:
            return join_ids(path, grains, np.zeros((0, 2), np.int64), None, walls=False)
        refuse_rounded_ids(path, values, grains.id)
        places = self.found(path, values, grains) if option is None or self.lists_walls else None
        if isinstance(places, JoinedContacts):
            return places
        if option is not None:
            places = named_places(path, option, list(columns))
        if places is None:
            may_be_ids = sum(map(are_whole, values.T)) > 1
            problem = f"no two columns of {', '.join(columns)} are surely ids of these grains"
            advice = '`contact_columns="id1=NAME,id2=NAME"` or LIGGGHTS\' keywords name them'
            error = OtherGrainsError if may_be_ids else NotContactsError
            raise error(f"{path}: {problem}: {advice}")
        return join_places(path, values, places, grains)

    def found(
        self, path: Path, values: FloatArray, grains: GrainTable
    ) -> Places | JoinedContacts | None:
        """The columns of ids, if the values leave no doubt; forces cannot be recognised."""
        place = id_column(values, grains, is_flagged=False)
        return None if place is None else Places([place, place + 1], touch=False)


class LiggghtsVtk(VtkReader):
    """Reads VTK files, in which contacts are between grains only."""

    walls = False
    # the force acts on the first grain
    force_arrays = ("force", "force_normal", "force_tangential")
    sign = -1.0


class LiggghtsReader(LammpsReader):
    """Reader plugin for the dumps of LIGGGHTS, which began as a copy of LAMMPS."""

    name = "liggghts"
    description = (
        "LIGGGHTS dump custom (text, binary), dump local, custom/vtk, local/gran/vtk, data files"
    )
    extensions = (".liggghts", ".dump", ".vtk", ".vtp", ".vtu", ".bin", ".data")

    lists_walls = True
    forms = (*FORMS, LiggghtsVtk())

    @np.errstate(over="ignore", invalid="ignore")
    def found(
        self, path: Path, values: FloatArray, grains: GrainTable
    ) -> Places | JoinedContacts | None:
        """
        Recognise the columns of ``pair/gran/local``: two ids, then the periodic flag 0 or 1.

        The next three columns are the force if they push the grains apart. If there are no pairs,
        the list is tried as contacts with walls.
        """
        place = id_column(values, grains, is_flagged=True)
        if place is None:
            return _walls(path, values, grains)
        ids, force = [place, place + 1], [place + 3, place + 4, place + 5]
        if force[-1] < values.shape[1]:
            branch = branches(grains, rows_of_ids(grains, values[:, ids]))
            if np.mean(np.sum(values[:, force] * branch, axis=1) < 0) > PUSHES:
                return Places(ids, [force])
        return Places(ids)


@np.errstate(all="ignore")
def join_places(
    path: Path, values: FloatArray, places: Places, grains: GrainTable
) -> JoinedContacts:
    """
    Join the pairs that touch, with the force on the second grain of each.

    In a list of all pairs within a cut-off, pairs with a force touch; if no force is known, pairs
    that overlap. If no gap is wide, all pairs touch.
    """
    first, second = places.ids
    where = f", columns {first + 1} and {second + 1}"
    ids = np.column_stack([whole_numbers(path, values[:, k], where) for k in places.ids])
    parts = [values[:, triple] for triple in places.force]
    force = -np.sum(parts, axis=0) if parts else None
    normal = None if places.normal is None else -values[:, places.normal]
    if not places.touch:
        rows = rows_of_ids(grains, ids)
        are_known, gap = (rows >= 0).all(axis=1), np.zeros(len(rows))
        gap[are_known] = _gaps(grains, rows[are_known])
        if np.any(gap > ROUNDING):
            # keep ids that no grain has: join_ids raises the error that names them
            touches = ~are_known | (gap < 0 if force is None else force.any(axis=1))
            ids, force = ids[touches], None if force is None else force[touches]
    return join_ids(path, grains, ids, force, walls=False, force_n=normal)


def named_places(path: Path, option: str, names: list[str]) -> Places:
    """
    The meaning of the columns, from the option ``contact_columns``.

    Parameters
    ----------
    path : Path
        The file, for messages.
    option : str
        Names of columns, ``id1=c_ids[1],id2=c_ids[2],...``; or the keywords of LIGGGHTS' compute
        pair/gran/local, ``pos id force ...``, in any order (LIGGGHTS has an order of its own).
    names : list of str
        The names of all columns.
    """
    if "=" not in option:
        return _keyword_places(path, option, len(names))
    pairs = [part.partition("=") for part in option.split(",")]
    named = {key.strip(): column.strip() for key, _, column in pairs}
    allowed = ({*IDS}, {*IDS, *FORCE}, {*IDS, *FORCE, *TANGENTIAL})
    if set(named) not in allowed or len(named) < len(pairs) or not {*named.values()} <= {*names}:
        raise ReadError(
            f"{path}: `contact_columns`: expected id1=NAME,id2=NAME, and fx, fy, fz (tx, ty, tz) "
            f"for the force on the first grain, found {option!r}; "
            f"the columns are {', '.join(names)}"
        )
    triples = [triple for triple in (FORCE, TANGENTIAL) if triple[0] in named]
    ids, *force = ([names.index(named[key]) for key in keys] for keys in (IDS, *triples))
    return Places(ids, force, touch=False)


def _keyword_places(path: Path, option: str, width: int) -> Places:
    """The columns for keywords of compute pair/gran/local; history:N has N values."""
    keywords = dict(word.partition(":")[::2] for word in option.split())
    sizes = {name: size for name, size in PAIR_VALUES.items() if name in keywords}
    if keywords.get("history", "").isdecimal():
        sizes["history"] = int(keywords["history"])
    count = sum(sizes.values())
    if len(sizes) < len(keywords) or "id" not in keywords or count != width:
        raise ReadError(
            f"{path}: `contact_columns`: expected id1=NAME,id2=NAME, or keywords, id among them "
            f"({', '.join(PAIR_VALUES)}), for {width} columns; {option!r} is for {count}"
        )
    starts = dict(zip(sizes, accumulate(sizes.values(), initial=0), strict=False))
    triple = {name: [start, start + 1, start + 2] for name, start in starts.items()}
    normal, tangential = triple.get("force_normal"), triple.get("force_tangential")
    parts = [normal, tangential] if normal and tangential else []
    return Places(triple["id"][:2], [triple["force"]] if "force" in triple else parts, normal)


def are_whole(values: FloatArray) -> bool:
    """Whether all values are whole numbers."""
    return bool(np.all(values == np.rint(values)))


def are_ids(values: FloatArray, grains: GrainTable) -> bool:
    """Whether most values are ids of grains; a wrong id among them is reported later."""
    return are_whole(values) and bool(np.mean(rows_of_ids(grains, values) >= 0) > MOST_ROWS)


@np.errstate(over="ignore", invalid="ignore")
def id_column(values: FloatArray, grains: GrainTable, *, is_flagged: bool) -> int | None:
    """
    Find two neighbouring columns of ids; the number of the first, None unless it is unique.

    Parameters
    ----------
    values : ndarray, shape (M, columns)
        The rows of contacts.
    grains : GrainTable
        The grains, with ids.
    is_flagged : bool
        Whether a flag 0 or 1 follows the ids, as LIGGGHTS writes it. If not, the ids must name
        grains that are close, and at least half of the pairs must be distinct: columns with the
        types of two grains repeat the same few pairs.
    """
    places = []
    for place in range(values.shape[1] - 1 - is_flagged):
        pairs = values[:, place : place + 2]
        if not all(are_ids(column, grains) for column in pairs.T):
            continue
        if is_flagged:
            is_pair = np.isin(values[:, place + 2], (0, 1)) & (pairs[:, 0] != pairs[:, 1])
            fits = bool(is_pair.all())
        else:
            rows = rows_of_ids(grains, pairs)
            gaps = _gaps(grains, rows[(rows >= 0).all(axis=1)])
            single = len(np.unique(np.sort(pairs, axis=1), axis=0))
            is_near = bool(np.mean(gaps < NEIGHBOURS - 1) > NEARLY_ALL)
            fits = is_near and single >= 0.5 * len(pairs)
        if fits:
            places.append(place)
    return places[0] if len(places) == 1 else None


def refuse_rounded_ids(path: Path, values: FloatArray, id: IntArray) -> None:
    """ReadError if ids of a million or more were rounded to six digits by the format %g."""
    longer = id[id >= 1_000_000]
    digits = 10 ** (np.floor(np.log10(np.maximum(longer, 1))).astype(np.int64) - 5)
    longer = longer[longer % digits != 0]
    large = np.any(values >= 1e6, axis=0) & np.all(values == np.rint(values), axis=0)
    if longer.size and large.any() and not np.isin(values[:, large], longer).any():
        advice = 'write them with dump_modify ... format "%.0f ..."'
        raise ReadError(f"{path}: ids above 999999 are rounded to six digits: {advice}")


def _gaps(grains: GrainTable, rows: IntArray) -> FloatArray:
    """Gaps between the surfaces of pairs of grains (nearest image), in units of r1 + r2."""
    length = np.linalg.norm(branches(grains, rows), axis=1)
    gaps: FloatArray = length / grains.radius[rows].sum(axis=1) - 1.0
    return gaps


@np.errstate(over="ignore", invalid="ignore")
def _walls(path: Path, values: FloatArray, grains: GrainTable) -> JoinedContacts | None:
    """
    Number of contacts with walls of each grain, and forces if there are any; None for other files.

    The columns are: contact point, centre of the grain, ids of wall, triangle and grain, force on
    the grain. Point and force are optional and recognised by their values: the point lies on the
    surface of the grain, and the force pushes the grain away from it.
    """
    for place in range(5, values.shape[1]):
        if not are_ids(values[:, place], grains) or not are_whole(values[:, place - 2 : place]):
            continue
        rows = rows_of_ids(grains, values[:, place])
        radius = grains.radius[rows]
        for start in range(place - 4):
            centre = values[:, start : start + 3]
            away = np.linalg.norm(centre - grains.position[rows], axis=1)
            if np.mean(away < 0.01 * radius) <= MOST_ROWS:
                continue
            if np.any(rows < 0):
                name = f"the grain {values[np.argmin(rows), place]:g}"
                raise ReadError(f"{path}: names {name}, which is not in the grain file")
            point, force = values[:, max(start - 3, 0) : start], values[:, place + 1 : place + 4]
            forces = None
            if point.shape[1] == force.shape[1] == 3:
                distance = np.linalg.norm(centre - point, axis=1) / radius
                touches = (distance > 0.5) & (distance < 1.01)
                pushes = np.sum(force * (centre - point), axis=1) > 0
                if touches.mean() >= MOST_ROWS and pushes.mean() >= PUSHES:
                    forces = WallForces(rows, point, force)
            return JoinedContacts(None, np.bincount(rows, minlength=len(grains.radius)), forces)
    return None
