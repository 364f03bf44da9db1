"""
What lies beside a file of grains that cannot hold it: contacts, cell, step and time, columns.

``STEM.contacts.csv``, ``STEM.frame.csv`` and ``STEM.columns.csv``, which belong to the file STEM
with any ending. They are written by :mod:`scanfab.io.convert`, and found by whoever reads the file.
"""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.files import bare_name, check_memory, first_bytes, plain
from scanfab.io.formats.columns import whole_numbers
from scanfab.io.formats.join import join_ids
from scanfab.io.reader import BODIES, WALLS, GrainTable, JoinedContacts, Snapshot
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

IDS = ("id1", "id2")
IMAGE = ("ix", "iy", "iz")
FORCE = ("fx2", "fy2", "fz2")
"""Force on the second grain."""
FORCE_N = ("fn",)
"""Normal force, compression positive."""
CONTACTS = tuple(",".join((*IDS, *IMAGE, *force)) for force in ((), FORCE, FORCE_N))
VECTORS = tuple(f"{vector}{axis}" for vector in "abco" for axis in "xyz")
FRAME = ",".join(("step", "time", *VECTORS, "periodic"))
# how many there are, which earlier versions did not write
COUNTED = f"{FRAME},grains,contacts"
# letters by which it is known, also where the rest is missing
FRAME_WORDS = len("step,time,ax,")
# the first column of columns, which no other file has
OF_ID = "scanfab_id"
# bytes in memory for each of a file
OF_TEXT = 12.0


class FrameData(NamedTuple):
    """Cell, step and time of a frame, and how much there is of it."""

    step: int | None
    time: float | None
    cell: Cell | None
    grains: int | None
    contacts: int | None
    """None: it does not say; no contacts need lie beside."""

    def moment_of(self, snapshot: Snapshot) -> Snapshot:
        """The snapshot at this step and time; without a step the number in its name is none."""
        return replace(snapshot, step=self.step, time=self.time, stepless=self.step is None)


def _named(path: Path, what: str) -> Path:
    return path.with_name(f"{Path(bare_name(path)).stem}.{what}.csv")


def contacts_file(path: Path) -> Path:
    """Where the contacts of a file of grains lie."""
    return _named(path, "contacts")


def frame_file(path: Path) -> Path:
    """Where the cell, step and time of a file of grains lie."""
    return _named(path, "frame")


def columns_file(path: Path) -> Path:
    """Where more columns of a file of grains lie."""
    return _named(path, "columns")


def is_contacts_file(path: Path) -> bool:
    """Whether a file is one of those that :func:`contacts_csv` makes."""
    return _first_line(path).startswith(CONTACTS[0])


def is_frame_file(path: Path) -> bool:
    """Whether a file is one of those that :func:`frame_csv` makes."""
    return _first_line(path).startswith(FRAME[:FRAME_WORDS])


def is_columns_file(path: Path) -> bool:
    """Whether a file is one of those that :func:`columns_csv` makes."""
    return _first_line(path).startswith(f"{OF_ID},")


def _first_line(path: Path) -> str:
    return first_bytes(path).partition(b"\n")[0].decode("utf-8", "replace").rstrip("\r")


def contacts_csv(packing: Packing) -> bytes:
    """The contacts of a packing, by ids, in their order."""
    contacts = packing.contacts
    assert contacts is not None
    ids = packing.id[contacts.pairs]
    force = [] if contacts.force is None else list(contacts.force.T)
    named = [*IDS, *IMAGE, *(FORCE if force else ())]
    if not force and contacts.force_n is not None:
        force, named = [contacts.force_n], [*named, *FORCE_N]
    return _csv(dict(zip(named, [*ids.T, *contacts.image.T, *force], strict=True)))


def frame_csv(packing: Packing, *, with_contacts: bool = True) -> bytes:
    """Cell, step and time of a packing, its number of grains, and of the contacts beside."""
    cell = packing.cell
    numbers = [""] * len(VECTORS)
    along = ""
    if cell is not None:
        numbers = [repr(float(one)) for one in (*cell.vectors.ravel(), *cell.origin)]
        along = "".join(x for x, repeats in zip("xyz", cell.periodic, strict=True) if repeats)
    step = "" if packing.step is None else str(packing.step)
    time = "" if packing.time is None else repr(packing.time)
    contacts = packing.contacts if with_contacts else None
    counts = str(len(packing)), "" if contacts is None else str(len(contacts))
    return f"{COUNTED}\n{','.join((step, time, *numbers, along, *counts))}\n".encode()


def columns_csv(packing: Packing, columns: dict[str, npt.NDArray[Any]]) -> bytes:
    """Some columns of the grains, by id, in their order."""
    return _csv({OF_ID: packing.id, **columns})


def _csv(columns: dict[str, npt.NDArray[Any]]) -> bytes:
    import polars

    stream = io.BytesIO()
    polars.DataFrame({name: np.ascontiguousarray(v) for name, v in columns.items()}).write_csv(
        stream
    )
    return stream.getvalue()


def read_contacts(path: Path, grains: GrainTable) -> JoinedContacts:
    """
    The contacts of a file, joined to its grains.

    Raises
    ------
    ReadError
        If a line is not as it should be, or names a grain that does not exist; or if there are
        fewer or more than the file of the frame beside it says.
    """
    if _first_line(path) not in CONTACTS:
        raise ReadError(f"{path}: expected one of the lines {'; '.join(CONTACTS)}")
    names = _first_line(path).split(",")
    whole = [*IDS, *IMAGE]
    kinds = np.dtype([(name, np.int64 if name in whole else np.float64) for name in names])
    check_memory(path, OF_TEXT * plain(path).stat().st_size)
    with open(plain(path), "rb") as stream:
        _, end, rows = stream.read().partition(b"\n")
    table = np.zeros(0, kinds)
    if rows.strip() or not end:
        if not rows.endswith(b"\n"):
            raise ReadError(f"{path}: the last line has no end: the file is incomplete")
        try:
            table = np.loadtxt(io.BytesIO(rows), kinds, delimiter=",", ndmin=1, comments=None)
        except (ValueError, OverflowError) as error:
            raise ReadError(f"{path}: expected numbers as {', '.join(names)}: {error}") from None
    told = read_frame(_grains_of(path))
    if told is not None:
        _check_count(path, len(table), "contacts", told.contacts, frame_file(_grains_of(path)))
    ids = np.column_stack([table[name] for name in IDS])
    image = np.column_stack([table[name] for name in IMAGE])
    force = force_n = None
    if FORCE[0] in names:
        force = np.column_stack([table[name] for name in FORCE])
    elif FORCE_N[0] in names:
        force_n = np.ascontiguousarray(table[FORCE_N[0]])
    if grains.id is None:
        grains = grains._replace(id=np.arange(len(grains.radius)))
    return join_ids(path, grains, ids, force, walls=False, image=image, force_n=force_n)


def _grains_of(contacts: Path) -> Path:
    """A file of grains that these contacts lie beside."""
    return contacts.with_name(f"{bare_name(contacts).removesuffix('.contacts.csv')}.csv")


def _check_count(path: Path, found: int, what: str, expected: int | None, frame: Path) -> None:
    """ReadError if a file has lost rows on its way, or belongs to another frame."""
    if expected not in (None, found):
        raise ReadError(
            f"{path}: holds {found} {what}, expected {expected} by {frame.name} beside it: it was "
            f"cut, or belongs to another frame (rows that you took out yourself: empty that number)"
        )


def check_contacts_are_there(path: Path, told: FrameData | None) -> None:
    """
    Whether grains that are read without contacts have none beside them that are lost.

    Parameters
    ----------
    path : Path
        The file of grains.
    told : FrameData, optional
        What lies beside it.

    Raises
    ------
    ReadError
        If the file of its contacts is empty, or is not there although there were some.
    """
    file = contacts_file(path)
    is_there = file.is_file()
    expected = None if told is None else told.contacts
    if expected is None and not (is_there and file.stat().st_size == 0):
        return
    found = "something else" if is_there else "no such file"
    if is_there and file.stat().st_size == 0:
        found = "an empty file"
    raise ReadError(
        f"{file}: expected the {'' if expected is None else f'{expected} '}contacts of "
        f'{path.name}, found {found}: copy it again, or choose `contacts="geometric"`'
    )


def read_frame(path: Path) -> FrameData | None:
    """
    What lies beside a file of grains; None if nothing does.

    Raises
    ------
    ReadError
        If the file that lies there is damaged.
    """
    file = frame_file(path)
    if not file.is_file() or not is_frame_file(file):
        return None
    text = first_bytes(file, 1 << 14).decode("utf-8", "replace")
    rows = list(csv.reader(text.splitlines()))
    try:
        if ",".join(rows[0]) not in (FRAME, COUNTED):
            raise ValueError(f"expected the line {COUNTED}")
        if len(rows) != 2 or len(rows[1]) != len(rows[0]) or not text.endswith("\n"):
            raise ValueError("expected one row")
        words = dict(zip(rows[0], rows[1], strict=True))
        step, grains, contacts = (
            int(words[name]) if words.get(name) else None for name in ("step", "grains", "contacts")
        )
        time = float(words["time"]) if words["time"] else None
        return FrameData(step, time, _cell(words), grains, contacts)
    except (ValueError, PackingError) as error:
        raise ReadError(f"{file}: cannot be read as cell, step and time: {error}") from None


def _cell(words: dict[str, str]) -> Cell | None:
    if not any(words[name] for name in VECTORS):
        return None
    numbers = np.array([float(words[name]) for name in VECTORS]).reshape(4, 3)
    along = words["periodic"]
    if not set(along) <= set("xyz"):
        raise ValueError(f"periodic: expected letters out of xyz, found {along!r}")
    return Cell(numbers[:3], ("x" in along, "y" in along, "z" in along), numbers[3])


def with_columns(path: Path, grains: GrainTable, told: FrameData | None) -> GrainTable:
    """
    Grains with the columns that lie beside their file.

    Raises
    ------
    ReadError
        If these are of other grains, or damaged; or if there are fewer or more grains than lies
        beside.
    """
    if told is not None:
        _check_count(path, len(grains.radius), "grains", told.grains, frame_file(path))
    file = columns_file(path)
    if not file.is_file() or not is_columns_file(file):
        return grains
    check_memory(file, OF_TEXT * file.stat().st_size)
    data = file.read_bytes()
    try:
        rows = list(csv.reader(io.StringIO(data.decode("utf-8"))))
        names, *body = rows
        if not data.endswith(b"\n") or any(len(row) != len(names) for row in body):
            raise ValueError("a line is incomplete")
        listed = list(zip(*body, strict=True)) if body else [()] * len(names)
        ids = np.array(list(map(int, listed[0])), dtype=np.int64)
    except (ValueError, OverflowError, UnicodeDecodeError, csv.Error) as error:
        raise ReadError(f"{file}: cannot be read as columns of grains: {error}") from None
    id = np.arange(len(grains.radius)) if grains.id is None else grains.id
    if not np.array_equal(ids, id):
        raise ReadError(
            f"{file}: holds columns of other grains than {path.name}: they belong to another step, "
            f"or the file was left behind"
        )
    own = {name: _values(words) for name, words in zip(names[1:], listed[1:], strict=True)}
    bodies, walls = (
        whole_numbers(file, own.pop(name)) if name in own else None for name in (BODIES, WALLS)
    )
    columns: Any = grains.columns
    merged = columns.copy() if hasattr(columns, "copy") else dict(columns)
    merged.update(own)
    return grains._replace(
        columns=merged,
        bodies=grains.bodies if bodies is None else bodies,
        wall_contacts=grains.wall_contacts if walls is None else walls,
    )


def _values(words: tuple[str, ...]) -> npt.NDArray[Any]:
    """Whole numbers, numbers or texts, whichever all words are."""
    for kind, read in ((np.int64, int), (np.float64, float)):
        try:
            if not any("_" in word for word in words):
                return np.array(list(map(read, words)), dtype=kind)
        except (ValueError, OverflowError):
            continue
    return np.array(words, dtype=str)
