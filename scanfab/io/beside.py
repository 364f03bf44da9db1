"""
The companion files of a file of grains, which hold what its format has no place for.

``STEM.contacts.csv``, ``STEM.frame.csv`` and ``STEM.columns.csv`` belong to the file STEM with any
ending. :mod:`scanfab.io.convert` writes them, and whoever reads the file finds them there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.columns import whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import bare_name, check_memory, first_bytes, plain
from scanfab.io.reader import BODIES, WALLS, GrainTable, JoinedContacts, Snapshot
from scanfab.io.written import contact_arrays, csv_bytes, frame_arrays, more_columns
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

IDS = ("id1", "id2")
# the columns of images, of the force on the second grain and of the normal force (compression
# positive), by the names of contact_arrays
PARTS = {"image": ("ix", "iy", "iz"), "force": ("fx2", "fy2", "fz2"), "force_n": ("fn",)}
CONTACTS = tuple(
    ",".join((*IDS, *PARTS["image"], *force)) for force in ((), PARTS["force"], PARTS["force_n"])
)
VECTORS = tuple(f"{vector}{axis}" for vector in "abco" for axis in "xyz")
FRAME = ("step", "time", *VECTORS, "periodic")
# files of earlier versions do not count
COUNTED = (*FRAME, "grains", "contacts")
# letters by which a frame file is known, even if the rest of its first line is missing
FRAME_WORDS = "step,time,ax,"
# the first column of a columns file, which no other file has
OF_ID = "scanfab_id"
# bytes of memory for each byte of a file
OF_TEXT = 12.0


class FrameData(NamedTuple):
    """Cell, step and time of a frame, and its numbers of grains and contacts."""

    step: int | None
    time: float | None
    cell: Cell | None
    grains: int | None
    """None: the file does not say."""
    contacts: int | None
    """None: there need not be a contacts file."""

    def moment_of(self, snapshot: Snapshot) -> Snapshot:
        """The snapshot at this step and time; if there is no step, its name says none either."""
        return replace(snapshot, step=self.step, time=self.time, stepless=self.step is None)


def _named(path: Path, what: str) -> Path:
    return path.with_name(f"{Path(bare_name(path)).stem}.{what}.csv")


def contacts_file(path: Path) -> Path:
    """The contacts file of a file of grains, which need not exist."""
    return _named(path, "contacts")


def frame_file(path: Path) -> Path:
    """The file with the cell, step and time of a file of grains."""
    return _named(path, "frame")


def columns_file(path: Path) -> Path:
    """The file with more columns of a file of grains."""
    return _named(path, "columns")


def companion_kind(path: Path) -> str | None:
    """``contacts``, ``frame`` or ``columns`` by the first line of a file; None for other files."""
    line = first_bytes(path).partition(b"\n")[0].decode("utf-8", "replace").rstrip("\r")
    if line in CONTACTS:
        return "contacts"
    if line.startswith(FRAME_WORDS):
        return "frame"
    return "columns" if line.startswith(f"{OF_ID},") else None


def is_contacts_file(path: Path) -> bool:
    """Whether a file is a contacts file of scanfab's."""
    return companion_kind(path) == "contacts"


def companions_there(path: Path) -> list[Path]:
    """The companion files of a file of grains that exist; files of others are not among them."""
    kinds = {"contacts": contacts_file, "frame": frame_file, "columns": columns_file}
    files = {kind: file(path) for kind, file in kinds.items()}
    return [file for kind, file in files.items() if file.is_file() and companion_kind(file) == kind]


def contacts_csv(packing: Packing) -> bytes:
    """The contacts of a packing, by ids, in their order."""
    assert packing.contacts is not None
    columns = dict(zip(IDS, packing.id[packing.contacts.pairs].T, strict=True))
    for name, values in contact_arrays(packing).items():
        columns |= zip(PARTS[name], values.reshape(len(values), len(PARTS[name])).T, strict=True)
    return csv_bytes(columns)


def frame_csv(packing: Packing) -> bytes:
    """Cell, step and time of a packing, and its numbers of grains and contacts, in one row."""
    words: dict[str, Any] = {"grains": len(packing)}
    if packing.contacts is not None:
        words["contacts"] = len(packing.contacts)
    words |= {name: repr(one) for name, one in frame_arrays(packing).items() if name in FRAME}
    cell = packing.cell
    if cell is not None:
        numbers = [*cell.vectors.ravel().tolist(), *cell.origin.tolist()]
        words |= zip(VECTORS, map(repr, numbers), strict=True)
        words["periodic"] = "".join(np.array(list("xyz"))[list(cell.periodic)])
    row = ",".join(str(words.get(name, "")) for name in COUNTED)
    return f"{','.join(COUNTED)}\n{row}\n".encode()


def columns_csv(packing: Packing, names: Iterable[str]) -> bytes:
    """Some columns of the grains, by id, in their order."""
    columns = more_columns(packing)
    return csv_bytes({OF_ID: packing.id, **{name: columns[name] for name in names}})


def _read(path: Path) -> Any:
    """A companion file as polars' frame of words; empty cells are null, empty texts are not."""
    import polars

    check_memory(path, OF_TEXT * plain(path).stat().st_size)
    data = plain(path).read_bytes()
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    try:
        # polars leaves doubled quotes in names as they are, but not in rows
        table = polars.read_csv(data, has_header=False, infer_schema=False)
        rows = table.slice(1)
        rows.columns = [str(name) for name in table.row(0)]
        return rows
    except polars.exceptions.PolarsError as error:
        raise ReadError(f"{path}: cannot be read: {str(error).partition(chr(10))[0]}") from None


def _values(path: Path, words: Any) -> npt.NDArray[Any]:
    """A column as whole numbers, numbers or texts, whichever all of its words are."""
    import polars

    if words.null_count():
        raise ReadError(f"{path}: column {words.name}: a line is incomplete")
    for kind in (polars.Int64, polars.Float64):
        values = words.cast(kind, strict=False)
        if not values.null_count():
            return np.array(values.to_numpy())
    return np.array(words.to_list(), dtype=str)


def read_contacts(path: Path, grains: GrainTable) -> JoinedContacts:
    """
    The contacts of a file, joined to its grains.

    Raises
    ------
    ReadError
        If a line is damaged or names a grain that does not exist; or if the frame file beside it
        says another number of contacts.
    """
    if not is_contacts_file(path):
        raise ReadError(f"{path}: expected one of the lines {'; '.join(CONTACTS)}")
    words = _read(path)
    table = {name: _values(path, words[name]) for name in words.columns}
    if any(values.dtype.kind == "U" for values in table.values()):
        raise ReadError(f"{path}: expected numbers as {', '.join(table)}, found other words")
    # any file of grains of this name has the same frame file
    grain_file = path.with_name(f"{bare_name(path).removesuffix('.contacts.csv')}.csv")
    told = read_frame(grain_file)
    if told is not None:
        _check_count(path, len(words), "contacts", told.contacts, frame_file(grain_file))
    if grains.id is None:
        grains = grains._replace(id=np.arange(len(grains.radius)))
    ids, image = (
        np.column_stack([whole_numbers(path, table[name]) for name in names])
        for names in (IDS, PARTS["image"])
    )
    force = force_n = None
    if "fx2" in table:
        force = np.column_stack([table[name] for name in PARTS["force"]]).astype(np.float64)
    elif "fn" in table:
        force_n = table["fn"].astype(np.float64)
    return join_ids(path, grains, ids, force, walls=False, image=image, force_n=force_n)


def _check_count(path: Path, found: int, what: str, expected: int | None, frame: Path) -> None:
    """ReadError if a file has lost rows on its way, or belongs to another frame."""
    if expected not in (None, found):
        raise ReadError(
            f"{path}: holds {found} {what}, expected {expected} by {frame.name} beside it: it was "
            f"cut, or belongs to another frame (if you took rows out yourself, empty that number)"
        )


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
    file = contacts_file(path)
    is_empty = file.is_file() and not file.stat().st_size
    expected = None if told is None else told.contacts
    if expected is None and not is_empty:
        return
    found = "an empty file" if is_empty else "something else" if file.is_file() else "no such file"
    raise ReadError(
        f"{file}: expected the {'' if expected is None else f'{expected} '}contacts of "
        f'{path.name}, found {found}: copy it again, or choose `contacts="geometric"`'
    )


def read_frame(path: Path) -> FrameData | None:
    """
    The frame file of a file of grains; None if there is none.

    Raises
    ------
    ReadError
        If it is damaged.
    """
    file = frame_file(path)
    if not file.is_file() or companion_kind(file) != "frame":
        return None
    table = _read(file)
    if tuple(table.columns) not in (FRAME, COUNTED) or len(table) != 1:
        raise ReadError(f"{file}: expected the line {','.join(COUNTED)} and one row")
    words = {name: word for name, word in table.row(0, named=True).items() if word is not None}
    try:
        cell, along = None, words.get("periodic", "")
        if any(name in words for name in VECTORS):
            numbers = np.array([float(words[name]) for name in VECTORS]).reshape(4, 3)
            if not set(along) <= set("xyz"):
                raise ValueError(f"periodic: expected letters out of xyz, found {along!r}")
            cell = Cell(numbers[:3], ("x" in along, "y" in along, "z" in along), numbers[3])
        step, grains, contacts = (
            int(words[name]) if name in words else None for name in ("step", "grains", "contacts")
        )
        time = float(words["time"]) if "time" in words else None
    except (KeyError, ValueError, PackingError) as error:
        raise ReadError(f"{file}: cannot be read as cell, step and time: {error}") from None
    return FrameData(step, time, cell, grains, contacts)


def with_columns(path: Path, grains: GrainTable, told: FrameData | None) -> GrainTable:
    """
    Grains with the columns of their columns file.

    Raises
    ------
    ReadError
        If it is damaged or belongs to other grains; or if the frame file says another number of
        grains.
    """
    if told is not None:
        _check_count(path, len(grains.radius), "grains", told.grains, frame_file(path))
    file = columns_file(path)
    if not file.is_file() or companion_kind(file) != "columns":
        return grains
    words = _read(file)
    own = {name: _values(file, words[name]) for name in words.columns}
    id = np.arange(len(grains.radius)) if grains.id is None else grains.id
    if not np.array_equal(own.pop(OF_ID), id):
        raise ReadError(
            f"{file}: holds columns of other grains than {path.name}: they belong to another step, "
            f"or the file was left behind"
        )
    bodies, walls = (
        whole_numbers(file, own.pop(name)) if name in own else None for name in (BODIES, WALLS)
    )
    return grains._replace(
        columns={**grains.columns, **own},
        bodies=grains.bodies if bodies is None else bodies,
        wall_contacts=grains.wall_contacts if walls is None else walls,
    )
