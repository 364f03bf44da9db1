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
from scanfab.io.formats.shared import FormsReader, GrainsOnly
from scanfab.io.formats.text_dump import TextDump
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.reader import GrainTable, JoinedContacts, ReadOptions, Snapshot

# only LAMMPS writes these items, and bounds with 16 digits (LIGGGHTS: six digits)
LAMMPS_ITEMS = re.compile(rb"(?m)^ITEM: ((UNITS|TIME)\s|BOX BOUNDS( abc|[^\n]*\n-?\d\.\d{16}e))")
# a restart of LIGGGHTS begins with a flag, the length of the version, and the version
RESTART = re.compile(rb"LammpS RestartT|\0{4}.{2}\0\0[^\0]{0,100}LIGGGHTS", re.DOTALL)
FORMS: tuple[GrainsOnly, ...] = (TextDump(), DataFile(), NetcdfDump(), BinaryDump())


class DumpReader(FormsReader):
    """Base class of the readers of LAMMPS' and LIGGGHTS' dumps."""

    lists_walls = False
    """Whether the program lists contacts with walls, which are recognised by their values."""
    forms = (*FORMS, VtkReader())

    def recognises(self, path: Path) -> bool:
        """By marks that only one of both programs writes."""
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
        dump_contacts.refuse_rounded_ids(path, values, grains)
        places = self.found(path, values, grains) if option is None or self.lists_walls else None
        if isinstance(places, JoinedContacts):
            return places
        if option is not None:
            places = dump_contacts.named_places(path, option, list(columns))
        if places is None:
            may_be_ids = sum(map(dump_contacts.are_whole, values.T)) > 1
            problem = f"no two columns of {', '.join(columns)} are surely ids of these grains"
            advice = '`contact_columns="id1=NAME,id2=NAME"` or LIGGGHTS\' keywords name them'
            error = OtherGrainsError if may_be_ids else NotContactsError
            raise error(f"{path}: {problem}: {advice}")
        return dump_contacts.join_places(path, values, places, grains)

    def found(
        self, path: Path, values: FloatArray, grains: GrainTable
    ) -> dump_contacts.Places | JoinedContacts | None:
        """The columns of ids, if the values leave no doubt; forces cannot be recognised."""
        place = dump_contacts.id_column(values, grains, is_flagged=False)
        return None if place is None else dump_contacts.Places([place, place + 1], touch=False)


class LammpsReader(DumpReader):
    """Reader plugin for the dumps of LAMMPS."""

    name = "lammps"
    description = "LAMMPS dump custom (text, binary, yaml, netcdf), dump local (text), write_data"
    extensions = (".lammpstrj", ".lmp", ".data", ".local", ".bin", ".yaml", ".nc")
