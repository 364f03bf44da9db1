"""LAMMPS: ``dump custom``, ``dump local``, ``dump yaml``, ``dump netcdf`` and ``write_data``."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.contacts import join_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats import binary_dump, lammps_netcdf, text_dump
from scanfab.io.formats.dump import Dump, dump_grains
from scanfab.io.formats.dump_contacts import (
    Places,
    id_column,
    join_places,
    named_places,
    refuse_rounded_ids,
)
from scanfab.io.formats.lammps_data import data_snapshots, is_data_file, of_liggghts, read_data
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


class Form(NamedTuple):
    """One of the forms in which LAMMPS and LIGGGHTS write grains."""

    fits: Callable[[bytes], object]
    """Whether a file has this form, by its first bytes."""
    kind: Callable[[Path], FileKind]
    snapshots: Callable[[Path], list[Snapshot]]
    read: Callable[[Snapshot, ReadOptions], Dump]
    cell: Carries = "cell"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names, of a data file by the atom style."""
        return dump_grains(snapshot, self.read(snapshot, options), options)

    def carries(self, path: Path) -> Carries:
        """A data file has a box without boundary flags."""
        return self.cell


TEXT = Form(
    text_dump.is_text_dump,
    text_dump.text_kind,
    text_dump.text_snapshots,
    lambda snapshot, _: text_dump.read_text_dump(snapshot),
)
FORMS = (
    TEXT,
    Form(is_data_file, lambda _: "grains", data_snapshots, read_data, "box"),
    Form(
        lammps_netcdf.is_netcdf,
        lammps_netcdf.netcdf_kind,
        lammps_netcdf.netcdf_snapshots,
        lambda snapshot, _: lammps_netcdf.read_netcdf(snapshot),
    ),
    Form(
        binary_dump.names_of_binary,
        binary_dump.binary_kind,
        binary_dump.binary_snapshots,
        lambda snapshot, _: binary_dump.read_binary_dump(snapshot),
    ),
)


def is_restart(head: bytes) -> bool:
    """Whether a file is what ``write_restart`` writes."""
    return RESTART.match(head) is not None


class DumpReader:
    """What the readers of LAMMPS' and LIGGGHTS' dumps have in common."""

    other: Form | VtkReader = TEXT
    """Reads files of all other forms."""
    lists_walls = False
    """Whether there are lists of contacts with walls, which are known by their values."""

    def form(self, path: Path) -> Form | VtkReader:
        """The form of a file, by its first bytes."""
        head = first_bytes(path)
        if is_restart(head):
            raise ReadError(
                f"{path}: a binary restart, which only the program that wrote it can read: let it "
                f"read_restart, and write the grains with dump custom ... id type x y z radius"
            )
        return next((form for form in FORMS if form.fits(head)), self.other)

    def kind(self, path: Path) -> FileKind:
        """By the names of the columns; whatever a text dump counts but ATOMS are contacts."""
        return self.form(path).kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """By ``ITEM: TIMESTEP``; a data file is one."""
        return self.form(path).snapshots(path)

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names; of a data file by the atom style."""
        return self.form(snapshot.path).read_grains(snapshot, options)

    def carries(self, path: Path) -> Carries:
        """A data file has a box without boundary flags, a VTK file at most the box beside it."""
        return self.form(path).carries(path)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        Pairs of a ``dump local``, with their force if it is known which columns are the force.

        Which column is what follows from ``contact_columns``, or from the values if these leave no
        doubt.
        """
        path, form = snapshot.path, self.form(snapshot.path)
        if isinstance(form, VtkReader):
            return form.read_contacts(snapshot, options, grains)
        if form is not TEXT:
            raise ReadError(
                f"{path}: contacts are read from text: write them by dump local, to a file without "
                f".bin"
            )
        dump = TEXT.read(snapshot, options)
        values = np.column_stack([dump.columns[name] for name in dump.names]).astype(np.float64)
        if not len(values):
            return join_ids(path, grains, np.zeros((0, 2), np.int64), None, walls=False)
        if grains.id is None:
            raise ReadError(f"{path}: names grains by id, but the grain file has no ids")
        refuse_rounded_ids(path, values, grains)
        told = options.contact_columns
        found = self.found(path, values, grains) if told is None or self.lists_walls else None
        if told is not None and not isinstance(found, JoinedContacts):
            found = named_places(path, told, dump.names)
        if found is None:
            raise ReadError(
                f"{path}: cannot tell which columns are the two ids of a contact: the ids may "
                f"belong to another step; or name the columns with "
                f'`contact_columns="id1=NAME,id2=NAME"`, which are {", ".join(dump.names)}, or the '
                f'keywords of LIGGGHTS\' compute with `contact_columns="pos id force ..."`; a dump '
                f'of LAMMPS is read with `format="lammps"`'
            )
        if isinstance(found, JoinedContacts):
            return found
        return join_places(path, values, found, grains)

    def found(
        self, path: Path, values: FloatArray, grains: GrainTable
    ) -> Places | JoinedContacts | None:
        """Which columns are the ids, if their values leave no doubt; no force is read."""
        place = id_column(values, grains, is_flagged=False)
        return None if place is None else Places([place, place + 1], are_contacts=False)


class LammpsReader(DumpReader):
    """Reader plugin for what LAMMPS dumps."""

    name = "lammps"
    description = "LAMMPS dump custom (text, binary, yaml, netcdf), dump local (text), write_data"
    extensions = (".lammpstrj", ".lmp", ".data", ".local", ".bin", ".yaml", ".nc")

    def recognises(self, path: Path) -> bool:
        """What LAMMPS writes and LIGGGHTS does not: units, time, bounds with all digits."""
        head = first_bytes(path)
        if head.startswith(b"ITEM: "):
            return LAMMPS_ITEMS.search(head) is not None
        if is_data_file(head) or is_restart(head):
            return not of_liggghts(head)
        if text_dump.is_text_dump(head) or lammps_netcdf.is_netcdf(head):
            return True
        # LIGGGHTS' binary dumps have numbered columns
        return (binary_dump.names_of_binary(head) or ["1"])[0] != "1"
