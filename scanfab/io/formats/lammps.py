"""LAMMPS: ``dump custom``, ``dump local``, ``dump yaml``, ``dump netcdf`` and ``write_data``."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.contacts import NotContactsError, OtherGrainsError, join_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats import dump_contacts
from scanfab.io.formats.binary_dump import BinaryDump, NetcdfDump
from scanfab.io.formats.lammps_data import DataFile
from scanfab.io.formats.shared import GrainsOnly
from scanfab.io.formats.text_dump import TextDump
from scanfab.io.formats.vtk import FormsReader, VtkReader
from scanfab.io.reader import GrainTable, JoinedContacts, ReadOptions, Snapshot

# LIGGGHTS writes neither of these items, and its bounds with six digits
LAMMPS_ITEMS = re.compile(
    rb"^ITEM: (?:(?:UNITS|TIME)\s|BOX BOUNDS(?: abc|[^\n]*\n-?\d\.\d{16}e))", re.MULTILINE
)
# LIGGGHTS begins a restart with a flag, the length of its version, and the version
RESTART = re.compile(rb"LammpS RestartT|\0{4}.{2}\0\0[^\0]{0,100}LIGGGHTS", re.DOTALL)
FORMS: tuple[GrainsOnly, ...] = (TextDump(), DataFile(), NetcdfDump(), BinaryDump())


class DumpReader(FormsReader):
    """What the readers of LAMMPS' and LIGGGHTS' dumps have in common."""

    lists_contacts = False
    lists_walls = False
    """Whether there are lists of contacts with walls, which are known by their values."""
    forms = FORMS

    def recognises(self, path: Path) -> bool:
        """By what only one of both programs writes."""
        return _program(path) == self.name

    def form(self, path: Path) -> GrainsOnly | VtkReader:
        """The reader of the form that a file has, by its first bytes; VTK's for all others."""
        if RESTART.match(first_bytes(path)):
            advice = "let its program read it, and dump custom ... id type x y z radius"
            raise ReadError(f"{path}: a binary restart, which only its program reads: {advice}")
        return super().form(path)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        Pairs of a ``dump local``, with their force if it is known which columns are the force.

        Which column is what follows from ``contact_columns``, or from the values if these leave no
        doubt.
        """
        path, told, form = snapshot.path, options.contact_columns, self.form(snapshot.path)
        if not isinstance(form, TextDump):
            return form.read_contacts(snapshot, options, grains)
        columns, _ = form.table(snapshot)
        values = np.column_stack(list(columns.values())).astype(np.float64)
        if not len(values) or grains.id is None:
            return join_ids(path, grains, np.zeros((0, 2), np.int64), None, walls=False)
        dump_contacts.refuse_rounded_ids(path, values, grains)
        found = self.found(path, values, grains) if told is None or self.lists_walls else None
        if isinstance(found, JoinedContacts):
            return found
        if told is not None:
            found = dump_contacts.named_places(path, told, list(columns))
        if found is None:
            may_be_ids = sum(map(dump_contacts.are_whole, values.T)) > 1
            told = f"no two columns of {', '.join(columns)} are surely ids of these grains"
            advice = '`contact_columns="id1=NAME,id2=NAME"` or LIGGGHTS\' keywords name them'
            error = OtherGrainsError if may_be_ids else NotContactsError
            raise error(f"{path}: {told}: {advice}")
        return dump_contacts.join_places(path, values, found, grains)

    def found(
        self, path: Path, values: FloatArray, grains: GrainTable
    ) -> dump_contacts.Places | JoinedContacts | None:
        """Which columns are the ids, if their values leave no doubt; no force is read."""
        place = dump_contacts.id_column(values, grains, is_flagged=False)
        return None if place is None else dump_contacts.Places([place, place + 1], touch=False)


def _program(path: Path) -> str | None:
    """Which of both programs wrote a file; None if neither did."""
    head = first_bytes(path)
    first, _, rest = head.partition(b"\n")
    if head.startswith(b"# vtk DataFile"):
        return "liggghts" if b"LIGGGHTS" in rest.partition(b"\n")[0] else None
    form = next((form for form in FORMS if form.recognises(path)), None)
    if RESTART.match(head) or isinstance(form, DataFile):
        # the first line is free, or holds the version of the program
        is_liggghts = b"LIGGGHTS" in first[:1000].upper()
    elif isinstance(form, BinaryDump):
        # the columns of LIGGGHTS' binary dumps have no names
        is_liggghts = form.names(path)[:1] == ["1"]
    elif form is None:
        return None
    else:
        is_liggghts = head.startswith(b"ITEM: ") and LAMMPS_ITEMS.search(head) is None
    return "liggghts" if is_liggghts else "lammps"


class LammpsReader(DumpReader):
    """Reader plugin for what LAMMPS dumps."""

    name = "lammps"
    description = "LAMMPS dump custom (text, binary, yaml, netcdf), dump local (text), write_data"
    extensions = (".lammpstrj", ".lmp", ".data", ".local", ".bin", ".yaml", ".nc")
