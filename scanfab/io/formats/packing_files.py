"""What scanfab alone writes: packings as ``.npz``, and what lies beside files of other formats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.beside import (
    is_columns_file,
    is_contacts_file,
    is_frame_file,
    read_contacts,
)
from scanfab.io.files import first_bytes
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.sheet_binary import IS_NPZ, npz_shapes, read_npz
from scanfab.io.reader import (
    BODIES,
    WALLS,
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.io.writers.npz import COLUMN, MARK, NpzWriter
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList


class PackingReader(NpzWriter):
    """Reader plugin for packings as NumPy's arrays, and for what lies beside other files."""

    name = "npz"
    description = "packings as arrays of NumPy; .contacts.csv, .frame.csv and .columns.csv"
    lists_contacts = True

    def recognises(self, path: Path) -> bool:
        """By the mark among the arrays, or the first line of a file beside another."""
        if first_bytes(path, 2) == IS_NPZ:
            try:
                return MARK in npz_shapes(path)
            except ReadError:
                return False
        return is_contacts_file(path) or is_frame_file(path) or is_columns_file(path)

    def kind(self, path: Path) -> FileKind:
        """Grains, or what belongs to grains in another file."""
        if first_bytes(path, 2) == IS_NPZ:
            return "grains"
        return "contacts" if is_contacts_file(path) else "cell"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, whose step and time are those of the packing."""
        if self.kind(path) != "grains":
            return [Snapshot(path)]
        found = read_npz(path, ("step", "time"))
        step, time = found.get("step"), found.get("time")
        return [
            Snapshot(
                path,
                None if step is None else int(_one(path, "step", step)),
                None if time is None else float(_one(path, "time", time)),
                stepless=step is None,
            )
        ]

    def carries(self, path: Path) -> Carries:
        """The cell is among the arrays, or there is none."""
        return "cell"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The arrays, with the contacts that they list."""
        path = snapshot.path
        arrays = read_npz(path)
        position, radius = arrays.get("position"), arrays.get("radius")
        if position is None or radius is None:
            raise ReadError(f"{path}: expected the arrays position and radius")
        if position.shape != (len(position), 3) or radius.shape != (len(position),):
            raise ReadError(f"{path}: expected position of shape (N, 3) and radius of shape (N,)")
        columns: dict[str, Any] = {
            "position": position,
            "radius": radius,
            **{name: arrays[name] for name in ("id", BODIES, WALLS) if name in arrays},
        }
        own = {k.removeprefix(COLUMN): v for k, v in arrays.items() if k.startswith(COLUMN)}
        wrong = [name for name, values in own.items() if values.shape[:1] != (len(position),)]
        if wrong:
            raise ReadError(f"{path}: the column {wrong[0]} does not have {len(position)} rows")
        grains = grain_table(path, {**columns, **own}, _cell(path, arrays), options)
        return grains._replace(contacts=_contacts(path, arrays))

    def left_out(self, path: Path) -> list[str]:
        """Of what scanfab writes nothing."""
        return []

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Those that lie beside a file of grains."""
        if first_bytes(snapshot.path, 2) == IS_NPZ:
            raise ReadError(
                f"{snapshot.path}: expected contacts, found a packing: read it by itself"
            )
        return read_contacts(snapshot.path, grains)


def _one(path: Path, name: str, values: npt.NDArray[Any]) -> Any:
    if values.size != 1 or values.dtype.kind not in "iuf" or not np.isfinite(values).all():
        raise ReadError(f"{path}: {name}: expected one number")
    return values.ravel()[0]


def _cell(path: Path, arrays: dict[str, npt.NDArray[Any]]) -> Cell | None:
    if "cell" not in arrays:
        return None
    along = arrays.get("periodic", np.zeros(3, np.bool_))
    try:
        if along.shape != (3,):
            raise PackingError(f"periodic: expected three truths, found {along.tolist()}")
        return Cell(
            arrays["cell"],
            (bool(along[0]), bool(along[1]), bool(along[2])),
            arrays.get("origin", np.zeros(3)),
        )
    except PackingError as error:
        raise ReadError(f"{path}: {error}") from None


def _contacts(path: Path, arrays: dict[str, npt.NDArray[Any]]) -> ContactList | None:
    pairs = arrays.get("pairs")
    if pairs is None:
        return None
    force = arrays.get("force")
    force_n = None if force is not None else arrays.get("force_n")
    return ContactList(pairs, arrays.get("image"), force, force_n=force_n)
