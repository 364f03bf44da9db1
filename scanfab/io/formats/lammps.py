"""LAMMPS: ``dump custom``, ``dump local``, ``dump yaml``, ``dump netcdf`` and ``write_data``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Protocol

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.contacts import join_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats import binary_dump, dump_contacts, lammps_data, lammps_netcdf, text_dump
from scanfab.io.formats.dump import Dump, dump_grains
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    NotContactsError,
    OtherGrainsError,
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


class Form(Protocol):
    """A module that reads one of the forms in which LAMMPS and LIGGGHTS write grains."""

    carries: Carries

    def fits(self, head: bytes) -> bool:
        """Whether a file has this form, by its first bytes."""
        ...

    def kind(self, path: Path) -> FileKind:
        """What a file holds, by the names of its columns."""
        ...

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The snapshots of a file."""
        ...

    def read(self, snapshot: Snapshot, options: ReadOptions) -> Dump:
        """One snapshot."""
        ...


FORMS: tuple[Form, ...] = (text_dump, lammps_data, lammps_netcdf, binary_dump)


def is_restart(head: bytes) -> bool:
    """Whether a file is what ``write_restart`` writes."""
    return RESTART.match(head) is not None


def form_of(path: Path) -> Form | None:
    """The form of a file, by its first bytes; None if it is VTK, or something else."""
    head = first_bytes(path)
    if is_restart(head):
        raise ReadError(
            f"{path}: a binary restart, which only the program that wrote it can read: let it "
            f"read_restart, and write the grains with dump custom ... id type x y z radius"
        )
    return next((form for form in FORMS if form.fits(head)), None)


class DumpReader(VtkReader):
    """What the readers of LAMMPS' and LIGGGHTS' dumps have in common."""

    generic = False
    lists_contacts = False
    lists_walls = False
    """Whether there are lists of contacts with walls, which are known by their values."""

    def kind(self, path: Path) -> FileKind:
        """By the names of the columns; whatever a text dump counts but ATOMS are contacts."""
        form = form_of(path)
        return super().kind(path) if form is None else form.kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """By ``ITEM: TIMESTEP``; a data file is one."""
        form = form_of(path)
        return super().snapshots(path) if form is None else form.snapshots(path)

    def carries(self, path: Path) -> Carries:
        """A data file has a box without boundary flags, a VTK file at most the box beside it."""
        form = form_of(path)
        return super().carries(path) if form is None else form.carries

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names; of a data file by the atom style."""
        form = form_of(snapshot.path)
        if form is None:
            return super().read_grains(snapshot, options)
        return dump_grains(snapshot, form.read(snapshot, options), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        Pairs of a ``dump local``, with their force if it is known which columns are the force.

        Which column is what follows from ``contact_columns``, or from the values if these leave no
        doubt.
        """
        path, form, told = snapshot.path, form_of(snapshot.path), options.contact_columns
        if form is None:
            return super().read_contacts(snapshot, options, grains)
        if form is not text_dump:
            raise ReadError(
                f"{path}: contacts are read from text: write them by dump local, no .bin"
            )
        dump = form.read(snapshot, options)
        values = np.column_stack([dump.columns[name] for name in dump.names]).astype(np.float64)
        if not len(values) or grains.id is None:
            return join_ids(path, grains, np.zeros((0, 2), np.int64), None, walls=False)
        dump_contacts.refuse_rounded_ids(path, values, grains)
        found = self.found(path, values, grains) if told is None or self.lists_walls else None
        if isinstance(found, JoinedContacts):
            return found
        if told is not None:
            found = dump_contacts.named_places(path, told, dump.names)
        if found is None:
            may_be_ids = sum(map(dump_contacts.are_whole, values.T)) > 1
            raise (OtherGrainsError if may_be_ids else NotContactsError)(
                f"{path}: cannot tell which columns are the two ids of a contact: the ids may "
                f"belong to another step; or name the columns with "
                f'`contact_columns="id1=NAME,id2=NAME"`, which are {", ".join(dump.names)}, or the '
                f'keywords of LIGGGHTS\' compute with `contact_columns="pos id force ..."`; a dump '
                f'of LAMMPS is read with `format="lammps"`'
            )
        return dump_contacts.join_places(path, values, found, grains)

    def found(
        self, path: Path, values: FloatArray, grains: GrainTable
    ) -> dump_contacts.Places | JoinedContacts | None:
        """Which columns are the ids, if their values leave no doubt; no force is read."""
        place = dump_contacts.id_column(values, grains, is_flagged=False)
        return None if place is None else dump_contacts.Places([place, place + 1], touch=False)


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
        if lammps_data.fits(head) or is_restart(head):
            return not lammps_data.of_liggghts(head)
        if text_dump.fits(head) or lammps_netcdf.fits(head):
            return True
        # LIGGGHTS' binary dumps have numbered columns
        return (binary_dump.names_in(head) or ["1"])[0] != "1"
