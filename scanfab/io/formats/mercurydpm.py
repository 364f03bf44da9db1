"""
MercuryDPM: grains in ``.data`` and contacts in ``.fstat``, or both in ``.restart``.

Contacts name grains by their row, from 0, and walls by numbers below 0. Each pair is listed from
both sides, unless one of them is fixed or an image in a periodic cell.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import bare_name, first_bytes, plain
from scanfab.io.formats.mercury_restart import is_restart, read_restart, time_of_restart
from scanfab.io.formats.shared import cell_of, finite_forces, marked_frames, numbers
from scanfab.io.parse.growing import leave_out_last
from scanfab.io.reader import Carries, FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, skip_rows, spelt, text_of
from scanfab.packing.cell import Cell

PLANE = "x y vx vy radius angle omega species"
SPACE = "x y z vx vy vz radius q1 q2 q3 wx wy wz species"
# by the number of words above a frame
LAYOUTS = {6: Layout(tuple(PLANE.split()), line=2), 8: Layout(tuple(SPACE.split()), line=2)}
# time, both rows, contact point, overlaps, normal and tangential force, normal, tangent
FSTAT = "t i j x y z delta deltat fn ft nx ny nz tx ty tz"
FSTAT_HEAD = re.compile(
    rb"\A(?:\xef\xbb\xbf)?#[ \t]+\S+[ \t]+[01][ \t]*\r?\n"
    rb"#(?:[ \t]+\S+){6}[ \t]*\r?\n#(?:[ \t]+\S+){6,7}[ \t]*\r?\n"
)
FSTAT_FRAME = re.compile(rb"#[ \t]+(\S+)[ \t]+[01][ \t]*\r?\n")
ABOVE = "the number of grains, time and bounds above a frame"
LONGEST = 1 << 16
# the interactions that it writes for ParaView name no grains
OF_PARAVIEW = (b"<VTKFile", b'Name="Overlap"', b'Name="ContactRadius"', b'Name="TangentialOverlap"')


class MercuryReader:
    """Reader plugin for the files of MercuryDPM."""

    name = "mercurydpm"
    description = "MercuryDPM .data with contacts in .fstat, and .restart"
    extensions: tuple[str, ...] = (".data", ".fstat", ".restart")
    lists_contacts = True

    def recognises(self, path: Path) -> bool:
        """A restart by its first word, contacts by three lines, grains by a line of bounds."""
        return _form(path) is not None

    def kind(self, path: Path) -> FileKind:
        """Contacts are in ``.fstat`` files."""
        form = _form(path)
        if form == "paraview":
            raise ReadError(
                f"{path}: MercuryDPM's interactions for ParaView do not say which grains touch: "
                f"contacts are read from .fstat or .restart"
            )
        return "other" if form is None else "contacts" if form == "fstat" else "grains"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """Frames one behind the other, with their times."""
        head = first_bytes(path, LONGEST)
        if is_restart(head):
            return [Snapshot(path, time=time_of_restart(head))]
        return (
            marked_frames(path, FSTAT_FRAME, _fstat_moment, _fstat_lack)
            if FSTAT_HEAD.match(head)
            else _grain_frames(path)
        )

    def carries(self, path: Path) -> Carries:
        """A restart has its periodic boundaries; the bounds in ``.data`` may repeat or not."""
        return "cell" if is_restart(first_bytes(path)) else "box"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Rows of numbers; a restart has names in its rows, and contacts."""
        path = snapshot.path
        if is_restart(first_bytes(path)):
            return read_restart(snapshot, options)
        line, _, rows = text_of(snapshot).partition(b"\n")
        bounds = _bounds(line)
        if bounds is None:
            raise ReadError(f"{path}: expected {ABOVE}, found {spelt(line)}")
        layout = LAYOUTS[len(bounds)]
        columns = read_rows(snapshot, rows, layout, count=int(bounds[0]), what="grains")
        if "z" not in columns:
            columns["z"] = np.zeros(len(columns["x"]))
        return grain_table(path, columns, _box(path, bounds[2:]), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Each pair once, with its force; rows with walls are counted."""
        path, data = snapshot.path, text_of(snapshot)
        head = FSTAT_HEAD.match(data)
        if head is None:
            raise ReadError(f"{path}: contacts are read from .fstat files with whole headers")
        layout = Layout(tuple(FSTAT.split()), line=4, whole="ij")
        columns = read_rows(snapshot, data[head.end() :], layout, what="contacts")
        rows = np.column_stack([whole_numbers(path, columns[name]) for name in "ij"])
        count = len(grains.radius)
        unknown = rows[(rows >= count) | (rows * [1, 0] < 0)]
        if len(unknown):
            raise ReadError(
                f"{path}: names the grain {unknown[0]}, but there are rows 0 to {count - 1}: do "
                f"both files belong to the same time?"
            )
        kept, force = _once(rows, columns)
        finite_forces(path, force[rows[:, 1] >= 0])
        # rows of the grain file, whatever ids these have; no grain has the number of a wall
        numbered = grains._replace(id=np.arange(count))
        return join_ids(path, numbered, rows[kept], force[kept], walls=True)


def _form(path: Path) -> str | None:
    """``restart``, ``fstat``, ``data`` or ``paraview``; None if it is no file of MercuryDPM."""
    head = first_bytes(path, LONGEST)
    if is_restart(head):
        return "restart"
    if FSTAT_HEAD.match(head):
        return "fstat"
    if all(word in head for word in OF_PARAVIEW):
        return "paraview"
    first, second = (*head.split(b"\n", 2), b"")[:2]
    bounds, width = _bounds(first), len(second.split())
    if bounds is None:
        return None
    # an empty frame is followed by another one; alone it may be anything
    is_data = _bounds(second) is not None if width else ".data" in bare_name(path)
    if bounds[0] > 0:
        is_data = width == len(LAYOUTS[len(bounds)].names)
    return "data" if is_data else None


def _fstat_moment(path: Path, head: bytes) -> tuple[None, float]:
    frame = FSTAT_FRAME.match(head)
    assert frame is not None
    return None, numbers(f"{path}: time of a frame", frame[1], 1)[0]


def _fstat_lack(data: bytes) -> str | None:
    return None if data.endswith(b"\n") else "its last line has no end"


def _bounds(line: bytes) -> list[float] | None:
    """Number of grains, time, low and high corner in 2D or 3D; None if it is no such line."""
    words = line.removeprefix(b"\xef\xbb\xbf").split()
    if len(words) not in LAYOUTS or not re.fullmatch(rb"[0-9]{1,15}", words[0]):
        return None
    try:
        found = [float(word) for word in words]
    except ValueError:
        return None
    low, high = np.reshape(found[2:], (2, -1))
    return found if np.all(low <= high) and found[1] >= 0 else None


def _grain_frames(path: Path) -> list[Snapshot]:
    """The frames of a ``.data`` file; a last one that is cut is left out with a warning."""
    found: list[Snapshot] = []
    with open(plain(path), "rb") as stream:
        while line := stream.readline(LONGEST):
            start, bounds, is_whole = stream.tell() - len(line), _bounds(line), line[-1:] == b"\n"
            if not line.strip():
                continue
            if bounds is None and is_whole:
                raise ReadError(f"{path}: expected {ABOVE}, found {spelt(line)}")
            rows = 0 if bounds is None else skip_rows(stream, int(bounds[0]))
            if bounds is None or not is_whole or rows < bounds[0]:
                leave_out_last(path, len(found), f"found {rows} rows below {spelt(line)}")
                break
            found.append(Snapshot(path, time=bounds[1], start=start, stop=stream.tell()))
    if not found:
        raise ReadError(f"{path}: the file is empty")
    return found


@np.errstate(over="ignore", invalid="ignore")
def _once(rows: IntArray, columns: Columns) -> tuple[IntArray, FloatArray]:
    """
    The rows that are left when each contact is listed once, and the force on each second grain.

    The normal points from the second to the first grain, on which force and tangential force act.
    A pair that touches through two images has two normals, and is two contacts.
    """
    normal = np.column_stack([columns[name] for name in ("nx", "ny", "nz")])
    tangent = np.column_stack([columns[name] for name in ("tx", "ty", "tz")])
    force = -(columns["fn"][:, None] * normal + columns["ft"][:, None] * tangent)
    turned = rows[:, :1] > rows[:, 1:]
    # 7 digits tell images apart, and are the same from both sides
    sides = np.round(np.where(turned, -normal, normal), 7) + 0.0
    _, first = np.unique(np.column_stack([np.sort(rows, axis=1), sides]), axis=0, return_index=True)
    # contacts with a wall are listed from one side only, and a wall may touch a grain twice
    return np.union1d(first, np.flatnonzero(rows[:, 1] < 0)), force


@np.errstate(invalid="ignore")
def _box(path: Path, bounds: list[float]) -> Cell | None:
    """The domain, of which nothing is known to repeat; None if it has no volume."""
    low, high = np.reshape(bounds, (2, -1))
    edges = high - low
    if len(low) == 2:
        low, edges = np.append(low, 0.0), np.append(edges, edges.max())
    return cell_of(f"{path}: its bounds", edges, (False, False, False), low)
