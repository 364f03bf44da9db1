"""
The companion files of a file of grains, which hold what its format has no place for.

``STEM.contacts.csv``, ``STEM.frame.csv`` and ``STEM.columns.csv`` belong to the file STEM with any
ending. :func:`scanfab.convert` writes them, and whoever reads the file finds them there.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import Columns
from scanfab.io.columns import BODIES, WALLS, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.families import numbers_in
from scanfab.io.files import bare_name, check_memory, first_bytes, plain
from scanfab.io.reader import GrainTable, JoinedContacts, Snapshot
from scanfab.io.writer import Left, as_arrays, csv_bytes, more_columns
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

# the first line of each kind
HEADS = {
    "contacts": r"id1,id2,ix,iy,iz(,fx2,fy2,fz2|,fn)?\r?$",
    "frame": "step,time,ax,",
    "columns": "scanfab_id,",
}
# columns of contacts by the names of writer.Arrays; the force acts on the second grain, and the
# normal force is positive in compression
PARTS = {"id1": ["id1"], "id2": ["id2"], "image": ["ix", "iy", "iz"]}
PARTS |= {"force": ["fx2", "fy2", "fz2"], "force_n": ["fn"]}
WHOLE = ("id1", "id2", *PARTS["image"])
# vectors and corner of the cell
CELL = tuple(f"{vector}{axis}" for vector in "abco" for axis in "xyz")
FRAME = ("step", "time", *CELL, "periodic", "grains", "contacts")
# bytes of memory for each byte of a file
IN_MEMORY = 12.0


def companion_file(path: Path, kind: str) -> Path:
    """Where a companion file of a file of grains is, or would be."""
    return path.with_name(f"{Path(bare_name(path)).stem}.{kind}.csv")


def companion_kind(path: Path) -> str | None:
    """``contacts``, ``frame`` or ``columns`` by the first line of a file; None: it is another."""
    line = first_bytes(path).partition(b"\n")[0].decode("utf-8", "replace")
    return next((kind for kind, head in HEADS.items() if re.match(head, line)), None)


def companion_there(path: Path, kind: str) -> Path | None:
    """A companion file of a file of grains, if it exists and is no file of others."""
    file = companion_file(path, kind)
    return file if file.is_file() and companion_kind(file) == kind else None


def companions_of(packing: Packing, path: Path, left: Left) -> dict[Path, bytes]:
    """The companion files of a packing, for all that a writer left out of its file of grains."""
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


def _rows(path: Path) -> Any:
    """A companion file as a polars table of words, whose first row holds the names of columns."""
    import polars

    file = plain(path)
    check_memory(path, IN_MEMORY * file.stat().st_size)
    data = file.read_bytes()
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    try:
        # polars leaves doubled quotes in the names of columns, but not in words
        return polars.read_csv(data, has_header=False, infer_schema=False)
    except polars.exceptions.PolarsError as error:
        raise ReadError(f"{path}: cannot be read: {str(error).partition(chr(10))[0]}") from None


def _columns(path: Path) -> Columns:
    """The columns of a companion file: each whole numbers, numbers or texts, as all words are."""
    import polars

    words = _rows(path)
    if any(words.null_count().row(0)):
        raise ReadError(f"{path}: a line is incomplete")
    found = {}
    for name, column in zip(words.row(0), words.slice(1), strict=True):
        casts = [column.cast(kind, strict=False) for kind in (polars.Int64, polars.Float64)]
        values = next((one for one in casts if not one.null_count()), column).to_numpy()
        found[str(name)] = values.astype(str) if values.dtype == object else values
    return found


def read_contacts(path: Path, grains: GrainTable) -> JoinedContacts:
    """
    The contacts of a file, joined to its grains.

    Raises
    ------
    ReadError
        If a line is damaged or names a grain that does not exist; or if the frame file beside it
        says another number of contacts.
    """
    if companion_kind(path) != "contacts":
        raise ReadError(f"{path}: expected contacts under the line id1,id2,ix,iy,iz and forces")
    table = _columns(path)
    if any(values.dtype.kind == "U" for values in table.values()):
        raise ReadError(f"{path}: expected numbers as {', '.join(table)}, found other words")
    # the frame file is the same whatever the ending of the grain file
    grain_file = path.with_name(f"{bare_name(path).removesuffix('.contacts.csv')}.csv")
    _check_count(path, len(table["id1"]), "contacts", read_frame(grain_file))
    if grains.id is None:
        grains = grains._replace(id=np.arange(len(grains.radius)))
    whole = np.column_stack([whole_numbers(path, table[name]) for name in WHOLE])
    ids, image, normal = whole[:, :2], whole[:, 2:], table.get("fn")
    force = np.column_stack([table[name] for name in PARTS["force"]]) if "fx2" in table else None
    return join_ids(path, grains, ids, force, walls=False, image=image, force_n=normal)


def _check_count(path: Path, found: int, what: str, told: FrameData | None) -> None:
    """ReadError if a file has lost rows on its way, or belongs to another frame."""
    if told is not None and getattr(told, what) not in (None, found):
        expected = f"expected {getattr(told, what)} by {told.file.name}"
        raise ReadError(f"{path}: holds {found} {what}, {expected}: it was cut, or is of others")


class FrameData(NamedTuple):
    """What a frame file says of a frame."""

    file: Path
    step: int | None
    time: float | None
    cell: Cell | None
    grains: int | None
    """How many there are; None if the file does not say."""
    contacts: int | None
    """None: there need not be a contacts file."""

    def moment_of(self, snapshot: Snapshot) -> Snapshot:
        """The snapshot at this step and time; if there is no step, its name says none either."""
        return replace(snapshot, step=self.step, time=self.time, stepless=self.step is None)


def read_frame(path: Path) -> FrameData | None:
    """
    The frame file of a file of grains; None if there is none.

    Raises
    ------
    ReadError
        If it is damaged.
    """
    file = companion_there(path, "frame")
    if file is None:
        return None
    rows = _rows(file).rows()
    words = {name: word for name, word in zip(rows[0], rows[-1], strict=True) if word}
    along = words.get("periodic", "")
    try:
        if rows[0] != FRAME or len(rows) != 2 or set(along) - set("xyz"):
            raise ValueError(f"expected the line {','.join(FRAME)} and one row")
        cell = None
        if any(name in words for name in CELL):
            numbers = np.array([float(words[name]) for name in CELL]).reshape(4, 3)
            cell = Cell(numbers[:3], ("x" in along, "y" in along, "z" in along), numbers[3])
        counts = ("step", "grains", "contacts")
        step, grains, contacts = (int(words[one]) if one in words else None for one in counts)
        time = float(words["time"]) if "time" in words else None
    except (KeyError, ValueError, PackingError) as error:
        raise ReadError(f"{file}: cannot be read as cell, step and time: {error}") from None
    return FrameData(file, step, time, cell, grains, contacts)


def check_contacts_are_there(path: Path, told: FrameData | None) -> None:
    """
    Check grains that are read without contacts: none may have been lost.

    Parameters
    ----------
    path : Path
        The file of grains.
    told : FrameData, optional
        Its frame file.

    Raises
    ------
    ReadError
        If the contacts file is empty, or if it is missing although the frame file counts contacts.
    """
    file = companion_file(path, "contacts")
    is_empty = file.is_file() and not file.stat().st_size
    count = "" if told is None or told.contacts is None else f"{told.contacts} "
    if count or is_empty:
        found = "an empty file" if is_empty else "other words" if file.is_file() else "no such file"
        advice = 'copy it again, or choose `contacts="geometric"`'
        expected = f"expected the {count}contacts of {path.name}"
        raise ReadError(f"{file}: {expected}, found {found}: {advice}")


def with_columns(path: Path, grains: GrainTable, told: FrameData | None) -> GrainTable:
    """
    Grains with the columns of their columns file.

    Raises
    ------
    ReadError
        If it is damaged or belongs to other grains; or if the frame file says another number of
        grains.
    """
    _check_count(path, len(grains.radius), "grains", told)
    file = companion_there(path, "columns")
    if file is None:
        return grains
    own = _columns(file)
    id = np.arange(len(grains.radius)) if grains.id is None else grains.id
    if not np.array_equal(own.pop("scanfab_id"), id):
        raise ReadError(f"{file}: holds columns of other grains than {path.name}")
    if BODIES in own:
        grains = grains._replace(bodies=whole_numbers(file, own.pop(BODIES)))
    if WALLS in own:
        grains = grains._replace(wall_contacts=whole_numbers(file, own.pop(WALLS)))
    return grains._replace(columns={**grains.columns, **own})
