"""What scanfab alone writes: packings as ``.npz``, and the companion files of other formats."""

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

# the array that makes it a packing; its value is the version of the layout
MARK = "scanfab_packing"
# stands before the names of the columns of the grains
COLUMN = "columns/"


class NpzFormat(GrainsOnly):
    """Reader and writer plugin for arrays named as a :class:`scanfab.Packing` names them."""

    name = "npz"
    description = "packings as arrays of NumPy; .contacts.csv, .frame.csv and .columns.csv"
    extensions: tuple[str, ...] = (".npz",)
    lists_contacts = True

    def recognises(self, path: Path) -> bool:
        """By the mark among the arrays, or the first line of a companion file."""
        if first_bytes(path, 2) != IS_NPZ:
            return companion_kind(path) is not None
        with suppress(ReadError):
            return MARK in npz_shapes(path)
        return False

    def kind(self, path: Path) -> FileKind:
        """Grains, or what belongs to grains in another file."""
        if first_bytes(path, 2) == IS_NPZ:
            return "grains"
        return "contacts" if companion_kind(path) == "contacts" else "cell"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, whose step and time are those of the packing."""
        if self.kind(path) != "grains":
            return [Snapshot(path)]
        found = read_npz(path, ("step", "time"))
        try:
            step = int(found["step"].item()) if "step" in found else None
            time = float(found["time"].item()) if "time" in found else None
        except (TypeError, ValueError, OverflowError) as error:
            raise ReadError(f"{path}: step and time: expected a number each: {error}") from None
        return [Snapshot(path, step, time, stepless=step is None)]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The arrays, with the contacts that they list."""
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
        """Those that lie beside a file of grains."""
        return read_contacts(snapshot.path, grains)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; it holds everything."""
        found = as_arrays(packing)
        arrays: dict[str, Any] = {MARK: 1, "position": packing.position}
        arrays |= found.grains | found.frame
        arrays |= {f"{COLUMN}{name}": values for name, values in found.own.items()}
        if packing.contacts is not None:
            # pairs are rows of the grains here, not ids
            named = {"pairs": packing.contacts.pairs, **found.contacts}
            arrays |= {name: one for name, one in named.items() if name not in ("id1", "id2")}
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)
        path.write_bytes(stream.getvalue())
        return Left(no_step=False, notes=tuple(found.notes))
