"""
scanfab's own formats: packings as ``.npz``, and the companion files of other formats.

Companion files hold the data of a packing for which the format of its grain file has no place.

``STEM.contacts.csv``, ``STEM.frame.csv`` and ``STEM.columns.csv`` belong to the grain file STEM,
whatever its ending. :func:`scanfab.convert` writes them, and reading the grain file reads them too.
"""

from __future__ import annotations

import io
import re
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import Columns
from scanfab.io.binary_files import IS_NPZ, read_npz
from scanfab.io.columns import BODIES, WALLS, grain_table, whole_numbers
from scanfab.io.families import numbers_in
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats.shared import GrainsOnly
from scanfab.io.formats.table import TableReader
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, text_of, words_of
from scanfab.io.writer import Left, as_arrays, contacts_of, csv_bytes, more_columns, stated_cell
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

# the first line of each kind of companion file
HEADS = {
    "contacts": r"id1,id2,ix,iy,iz(,fx2,fy2,fz2|,compression)?\r?$",
    "frame": "step,time,ax,",
    "columns": "scanfab_id,",
}
# columns of the contacts file for each array of writer.Arrays; the force acts on the second grain,
# and the normal force is positive in compression
PARTS = {"id1": ["id1"], "id2": ["id2"], "image": ["ix", "iy", "iz"]}
PARTS |= {"force": ["fx2", "fy2", "fz2"], "force_n": ["compression"]}
# the three vectors of the cell, and its corner (o)
CELL = tuple(f"{vector}{axis}" for vector in "abco" for axis in "xyz")
FRAME = ("step", "time", *CELL, "periodic", "grains", "contacts")
# the array that marks a packing; its value is the version of the layout
MARK = "scanfab_packing"
# prefix of the names of arrays that are columns of the grains
COLUMN = "columns/"


def companion_file(path: Path, kind: str) -> Path:
    """The path of a companion file of a grain file, whether it exists or not."""
    return path.with_name(f"{Path(bare_name(path)).stem}.{kind}.csv")


def companion_kind(path: Path) -> str | None:
    """``contacts``, ``frame`` or ``columns``, judged by the first line; None for any other file."""
    line = first_bytes(path).partition(b"\n")[0].decode("utf-8", "replace")
    return next((kind for kind, head in HEADS.items() if re.match(head, line)), None)


def companion_there(path: Path, kind: str) -> Path | None:
    """The companion file of a grain file; None if there is none, or another program wrote it."""
    file = companion_file(path, kind)
    return file if file.is_file() and companion_kind(file) == kind else None


def companions_of(packing: Packing, path: Path, left: Left) -> dict[Path, bytes]:
    """The bytes of the companion files that hold the data a writer left out of the grain file."""
    arrays = as_arrays(packing)
    tables: dict[str, dict[str, Any]] = {}
    if left.contacts and packing.contacts is not None:
        tables["contacts"] = {}
        for name, values in arrays.contacts.items():
            tables["contacts"] |= zip(PARTS[name], np.atleast_2d(values.T), strict=True)
    if left.columns:
        columns = {"scanfab_id": packing.id, **more_columns(packing)}
        tables["columns"] = {name: columns[name] for name in ("scanfab_id", *left.columns)}
    says_no_step = left.no_step and packing.step is None and numbers_in(path)
    if left.frame or says_no_step or "contacts" in tables:
        row: dict[str, Any] = dict.fromkeys(FRAME) | {"step": packing.step, "time": packing.time}
        row["grains"] = len(packing)
        row["contacts"] = None if packing.contacts is None else len(packing.contacts)
        if (cell := packing.cell) is not None:
            row |= zip(CELL, [*cell.vectors.ravel().tolist(), *cell.origin.tolist()], strict=True)
            row["periodic"] = "".join(np.array(list("xyz"))[list(cell.periodic)]) or None
        tables["frame"] = {name: [value] for name, value in row.items()}
    return {companion_file(path, kind): csv_bytes(table) for kind, table in tables.items()}


def _columns(path: Path) -> Columns:
    """The columns of a companion file: int64 or float64 if all words allow it, else words."""
    data = text_of(Snapshot(path))
    head, _, rows = data.partition(b"\n")
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    names = tuple(words_of(head.decode("utf-8", "replace"), ","))
    return read_rows(Snapshot(path), rows, Layout(names, ",", 2, whole=names, optional=names))


class FrameData(NamedTuple):
    """The content of a frame file."""

    file: Path
    step: int | None
    time: float | None
    cell: Cell | None
    grains: int | None
    """The number of grains; None if the file does not say."""
    contacts: int | None
    """The number of contacts; None if no contacts file is needed."""


def read_frame(path: Path) -> FrameData | None:
    """
    Read the frame file of a grain file; None if there is none.

    Raises
    ------
    ReadError
        If the frame file is damaged.
    """
    file = companion_there(path, "frame")
    if file is None:
        return None
    try:
        table = _columns(file)
        if tuple(table) != FRAME or len(table["step"]) != 1:
            raise ValueError(f"expected the line {','.join(FRAME)} and one row")
        words = {name: value.item() for name, value in table.items() if value[0] == value[0]}
        along = words.get("periodic", "")
        if set(along) - set("xyz"):
            raise ValueError(f"expected letters of xyz as periodic, found {along}")
        cell = None
        if any(name in words for name in CELL):
            numbers = np.array([float(words[name]) for name in CELL]).reshape(4, 3)
            cell = Cell(numbers[:3], ("x" in along, "y" in along, "z" in along), numbers[3])
        counts = ("step", "grains", "contacts")
        step, grains, contacts = (int(words[count]) if count in words else None for count in counts)
        time = float(words["time"]) if "time" in words else None
    except (KeyError, TypeError, ValueError, PackingError) as error:
        raise ReadError(f"{file}: cannot be read as cell, step and time: {error}") from None
    return FrameData(file, step, time, cell, grains, contacts)


def read_contacts(
    path: Path, grains: GrainTable, options: ReadOptions, frame: FrameData | None
) -> JoinedContacts | None:
    """
    Read the contacts file of a grain file; None if there is none.

    Raises
    ------
    ReadError
        If the file is damaged, or if the frame file counts another number of contacts.
    """
    file, joined, found = companion_file(path, "contacts"), None, None
    if file.is_file():
        joined = TableReader().read_contacts(Snapshot(file), options, grains)
        found = 0 if joined.contacts is None else len(np.asarray(joined.contacts.pairs))
    if frame is not None and frame.contacts not in (None, found):
        problem = f"holds {found or 'no'} contacts of {path.name}, but {frame.file.name} counts"
        advice = 'copy it again, or choose `contacts="geometric"`'
        raise ReadError(f"{file}: {problem} {frame.contacts}: {advice}")
    return joined


def with_columns(path: Path, grains: GrainTable, frame: FrameData | None) -> GrainTable:
    """
    Add the columns of the columns file to the grains.

    Raises
    ------
    ReadError
        If the columns file is damaged or belongs to other grains; or if the frame file counts
        another number of grains.
    """
    count = len(grains.radius)
    if frame is not None and frame.grains not in (None, count):
        expected = f"but {frame.file.name} counts {frame.grains}: it is cut or of another frame"
        raise ReadError(f"{path}: holds {count} grains, {expected}")
    file = companion_there(path, "columns")
    if file is None:
        return grains
    columns = _columns(file)
    id = np.arange(len(grains.radius)) if grains.id is None else grains.id
    if not np.array_equal(columns.pop("scanfab_id"), id):
        raise ReadError(f"{file}: its ids are not those of the grains in {path.name}")
    if BODIES in columns:
        grains = grains._replace(bodies=whole_numbers(file, columns.pop(BODIES)))
    if WALLS in columns:
        grains = grains._replace(wall_contacts=whole_numbers(file, columns.pop(WALLS)))
    return grains._replace(columns={**grains.columns, **columns})


class NpzFormat(GrainsOnly):
    """Reader and writer plugin for arrays named as a :class:`scanfab.Packing` names them."""

    name = "npz"
    description = "packings as arrays of NumPy; .contacts.csv, .frame.csv and .columns.csv"
    extensions: tuple[str, ...] = (".npz",)

    def recognises(self, path: Path) -> bool:
        """Recognised by the array `MARK`, or by the first line of a companion file."""
        if first_bytes(path, 2) != IS_NPZ:
            return companion_kind(path) in ("frame", "columns")
        with suppress(ReadError):
            return MARK in read_npz(path, MARK)
        return False

    def kind(self, path: Path) -> FileKind:
        """Grains, or for companion files contacts or ``cell``."""
        if first_bytes(path, 2) == IS_NPZ:
            return "grains"
        return "cell" if companion_kind(path) in ("frame", "columns") else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The only snapshot, with the step and time of the packing."""
        if self.kind(path) != "grains":
            return [Snapshot(path)]
        moment = read_npz(path, "step", "time")
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
        grains = grain_table(path, columns, stated_cell(path, arrays), options)
        if "pairs" not in arrays:
            return grains
        return grains._replace(contacts=contacts_of(arrays["pairs"], arrays))

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
