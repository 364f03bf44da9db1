"""scanfab's own formats: packings as ``.npz``, and the companion files of other formats."""

from __future__ import annotations

import io
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.binary_tables import IS_NPZ, npz_shapes, read_npz
from scanfab.io.columns import BODIES, WALLS, grain_table
from scanfab.io.companions import companion_kind, read_contacts
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.writer import Left, as_arrays, cell_of, contacts_of
from scanfab.packing.packing import Packing

# the array that marks a packing; its value is the version of the layout
MARK = "scanfab_packing"
# prefix of the names of arrays that are columns of the grains
COLUMN = "columns/"


class NpzFormat(GrainsOnly):
    """Reader and writer plugin for arrays named as a :class:`scanfab.Packing` names them."""

    name = "npz"
    description = "packings as arrays of NumPy; .contacts.csv, .frame.csv and .columns.csv"
    extensions: tuple[str, ...] = (".npz",)
    lists_contacts = True

    def recognises(self, path: Path) -> bool:
        """By the array `MARK`, or by the first line of a companion file."""
        if first_bytes(path, 2) != IS_NPZ:
            return companion_kind(path) is not None
        with suppress(ReadError):
            return MARK in npz_shapes(path)
        return False

    def kind(self, path: Path) -> FileKind:
        """Grains, or for companion files contacts or ``cell``."""
        if first_bytes(path, 2) == IS_NPZ:
            return "grains"
        return "contacts" if companion_kind(path) == "contacts" else "cell"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The only snapshot, with the step and time of the packing."""
        if self.kind(path) != "grains":
            return [Snapshot(path)]
        moment = read_npz(path, ("step", "time"))
        try:
            step = int(moment["step"].item()) if "step" in moment else None
            time = float(moment["time"].item()) if "time" in moment else None
        except (TypeError, ValueError, OverflowError) as error:
            raise ReadError(f"{path}: step and time: expected a number each: {error}") from None
        return [Snapshot(path, step, time, stepless=step is None)]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The grains, with contacts if the file has them."""
        path = snapshot.path
        arrays = read_npz(path)
        given = ("position", "radius", "id", BODIES, WALLS)
        columns: dict[str, Any] = {name: arrays[name] for name in given if name in arrays}
        columns |= {k.removeprefix(COLUMN): v for k, v in arrays.items() if k.startswith(COLUMN)}
        if len({values.shape[:1] for values in columns.values()}) != 1:
            raise ReadError(f"{path}: expected arrays with a row for each grain")
        grains = grain_table(path, columns, cell_of(path, arrays), options)
        if "pairs" not in arrays:
            return grains
        return grains._replace(contacts=contacts_of(arrays["pairs"], arrays))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """The contacts in a companion file."""
        return read_contacts(snapshot.path, grains)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; the file holds all data of the packing."""
        parts = as_arrays(packing)
        arrays: dict[str, Any] = {MARK: 1, "position": packing.position}
        arrays |= parts.grains | parts.frame
        arrays |= {f"{COLUMN}{name}": values for name, values in parts.own.items()}
        if packing.contacts is not None:
            # this format stores pairs as rows of grains, not as ids
            named = {"pairs": packing.contacts.pairs, **parts.contacts}
            arrays |= {name: values for name, values in named.items() if name not in ("id1", "id2")}
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)
        path.write_bytes(stream.getvalue())
        return Left(no_step=False, notes=tuple(parts.notes))
