"""LAMMPS: ``dump custom``, ``dump local``, ``dump yaml``, ``dump netcdf`` and ``write_data``."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.contacts import join_ids, rows_of_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats import ids, text_dump
from scanfab.io.formats.binary_dump import (
    binary_kind,
    index_binary,
    names_of_binary,
    read_binary_grains,
)
from scanfab.io.formats.lammps_data import index_data, is_data_file, of_liggghts, read_data_grains
from scanfab.io.formats.lammps_netcdf import (
    index_netcdf,
    is_netcdf,
    netcdf_kind,
    read_netcdf_grains,
)
from scanfab.io.formats.lammps_yaml import index_yaml, is_yaml, read_yaml_grains, yaml_kind
from scanfab.io.formats.text_dump import Dump, is_dump, read_dump
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)

# LIGGGHTS writes neither of these items, and its bounds with six digits
LAMMPS_ITEMS = re.compile(
    rb"^ITEM: (?:UNITS|TIME)[ \t]*\r?$"
    rb"|^ITEM: BOX BOUNDS[^\n]*\n-?\d\.\d{16}e[-+]\d+ "
    rb"|^ITEM: BOX BOUNDS abc origin",
    re.MULTILINE,
)
# LIGGGHTS begins a restart with a flag, the length of its version, and the version
RESTART = re.compile(rb"LammpS RestartT|\0{4}.{2}\0\0[^\0]{0,100}LIGGGHTS", re.DOTALL)

# LAMMPS lists pairs up to this distance, in r1 + r2, for nearly all rows
NEIGHBOURS, NEARLY_ALL = 2.0, 0.98


class Form(NamedTuple):
    """One of the forms in which LAMMPS and LIGGGHTS write grains."""

    fits: Callable[[bytes], object]
    """Whether a file has this form, by its first bytes."""
    kind: Callable[[Path], FileKind]
    snapshots: Callable[[Path], list[Snapshot]]
    read_grains: Callable[[Snapshot, ReadOptions], GrainTable]
    carries: Callable[[Path], Carries] = lambda _: "cell"


TEXT = Form(is_dump, text_dump.dump_kind, text_dump.index_dump, text_dump.read_dump_grains)
FORMS = (
    TEXT,
    Form(is_data_file, lambda _: "grains", index_data, read_data_grains, lambda _: "box"),
    Form(is_yaml, lambda path: yaml_kind(first_bytes(path, 1 << 16)), index_yaml, read_yaml_grains),
    Form(is_netcdf, netcdf_kind, index_netcdf, read_netcdf_grains),
    Form(names_of_binary, binary_kind, index_binary, read_binary_grains),
)


def is_restart(head: bytes) -> bool:
    """Whether a file is what ``write_restart`` writes."""
    return RESTART.match(head) is not None


def form_of(path: Path) -> Form | None:
    """The form of a file, by its first bytes; None if it has none of these forms."""
    head = first_bytes(path)
    if is_restart(head):
        raise ReadError(
            f"{path}: a binary restart, which only the program that wrote it can read: let it "
            f"read_restart, and write the grains with dump custom ... id type x y z radius"
        )
    return next((form for form in FORMS if form.fits(head)), None)


class DumpReader:
    """What the readers of LAMMPS' and LIGGGHTS' dumps have in common."""

    other: Form | VtkReader = TEXT
    """Reads files of all other forms."""

    def kind(self, path: Path) -> FileKind:
        """By the names of the columns; whatever a text dump counts but ATOMS are contacts."""
        return (form_of(path) or self.other).kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """By ``ITEM: TIMESTEP``; a data file is one."""
        return (form_of(path) or self.other).snapshots(path)

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names; of a data file by the atom style."""
        return (form_of(snapshot.path) or self.other).read_grains(snapshot, options)

    def carries(self, path: Path) -> Carries:
        """A data file has a box without boundary flags, a VTK file at most the box beside it."""
        return (form_of(path) or self.other).carries(path)


class LammpsReader(DumpReader):
    """Reader plugin for what LAMMPS dumps."""

    name = "lammps"
    description = "LAMMPS dump custom (text, binary, yaml, netcdf), dump local (text), write_data"
    extensions = (".lammpstrj", ".lmp", ".data", ".local", ".bin", ".yaml", ".nc")

    def recognises(self, path: Path) -> bool:
        """What LAMMPS writes and LIGGGHTS does not: units, time, bounds with all digits."""
        head = first_bytes(path)
        if is_dump(head):
            return LAMMPS_ITEMS.search(head) is not None
        if is_data_file(head) or is_restart(head):
            return not of_liggghts(head)
        # LIGGGHTS' binary dumps have numbered columns
        return is_yaml(head) or is_netcdf(head) or (names_of_binary(head) or ["1"])[0] != "1"

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        Pairs of ``compute property/local`` that touch, with the force of ``compute pair/local``.

        Which column is what follows from ``contact_columns``; without it the ids are found by
        their values, if there is no doubt, and no force is read.
        """
        path, dump = snapshot.path, read_contact_rows(snapshot, grains)
        places = ids.named_places(path, options.contact_columns, dump)
        if not places and dump.rows:
            place = id_column(dump.values, grains)
            if place is None:
                raise ReadError(
                    f"{path}: cannot tell which columns are the two ids of a contact: the ids may "
                    f"belong to another step; or name them with "
                    f'`contact_columns="id1=NAME,id2=NAME"`; the columns are '
                    f"{', '.join(dump.names)}"
                )
            places = {"id1": place, "id2": place + 1}
        return join_listed(path, dump, places, grains)


def read_contact_rows(snapshot: Snapshot, grains: GrainTable) -> Dump:
    """The rows of a dump local; ReadError if they cannot name the grains by their ids."""
    path = snapshot.path
    if form_of(path) is not TEXT:
        raise ReadError(
            f"{path}: contacts are read from text: write them by dump local, to a file without .bin"
        )
    dump = read_dump(snapshot)
    if dump.rows:
        if grains.id is None:
            raise ReadError(f"{path}: names grains by id, but the grain file has no ids")
        ids.refuse_rounded_ids(path, dump.values, grains)
    return dump


def join_listed(
    path: Path, dump: Dump, places: dict[str, int], grains: GrainTable
) -> JoinedContacts:
    """The pairs that touch, and their forces, by the places of the columns of ids and forces."""
    if not dump.rows:
        return join_ids(path, grains, np.zeros((0, 2), np.int64), None, walls=False)
    pairs = whole_ids(path, dump, [places[key] for key in ids.IDS])
    force = ids.named_force(dump, places)
    touch = ids.touching_pairs(grains, rows_of_ids(grains, pairs), force)
    return join_ids(
        path, grains, pairs[touch], None if force is None else force[touch], walls=False
    )


def whole_ids(path: Path, dump: Dump, places: list[int]) -> IntArray:
    """Two columns of ids, shape (M, 2)."""
    listed = dump.values[:, places]
    if not (ids.are_whole(listed) and np.all(np.abs(listed) < 2.0**53)):
        raise ReadError(f"{path}: expected ids in the columns {places[0] + 1} and {places[1] + 1}")
    return listed.astype(np.int64)


@np.errstate(over="ignore", invalid="ignore")
def id_column(values: FloatArray, grains: GrainTable, *, is_flagged: bool = False) -> int | None:
    """
    The first of two neighbouring columns of ids; None unless there is one choice.

    Parameters
    ----------
    values : ndarray, shape (M, columns)
        The rows of contacts.
    grains : GrainTable
        With ids.
    is_flagged : bool, optional
        Whether a flag 0 or 1 stands behind the ids, as LIGGGHTS writes it. Else the two ids must
        name grains that lie side by side, and hardly any pair may occur twice: the types of two
        grains do so all the time, a pair that touches through several images does not.
    """
    found = []
    for place in range(values.shape[1] - 1 - is_flagged):
        pairs = values[:, place : place + 2]
        if not all(ids.are_ids(column, grains) for column in pairs.T):
            continue
        if is_flagged:
            flag = values[:, place + 2]
            fits = np.isin(flag, (0, 1)).all() and np.all(pairs[:, 0] != pairs[:, 1])
        else:
            rows = rows_of_ids(grains, pairs)
            gap = ids.gaps(grains, rows[(rows >= 0).all(axis=1)])
            fits = np.mean(gap < NEIGHBOURS - 1.0) > NEARLY_ALL
            fits &= len(np.unique(np.sort(pairs, axis=1), axis=0)) >= 0.5 * len(pairs)
        if fits:
            found.append(place)
    return found[0] if len(found) == 1 else None
