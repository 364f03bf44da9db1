"""LF_DEM: ``par_*.dat`` with grains and ``int_*.dat`` with pairs, sheared by Lees and Edwards."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import cell_of, finite_forces, marked_frames, numbers
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

HEAD = re.compile(rb"\A(?:\xef\xbb\xbf)?# LF_DEM version")
# what a column holds, or a range of them
LEGEND = re.compile(rb"^#(\d{1,3})(?:-(\d{1,3}))?:[ \t]*([^\r\n]*)", re.MULTILINE)
# above each frame: strain, shear displacement, rate and more
FRAME = re.compile(rb"#[ \t]+([-+\d.eE]+)[ \t]+([-+\d.eE]+)[ \t]+[-+\d.eE]+[^\r\n]*\r?\n")
EDGE = re.compile(rb"^#[ \t]+L([xyz])[ \t]+(\S+)", re.MULTILINE)
COUNT = re.compile(rb"^#[ \t]+np[ \t]+(\d{1,15})\s", re.MULTILINE)
HEADER_BYTES = 1 << 16
POSITION = "position (x, y, z)"
NORMAL = "normal vector, oriented from particle 1 to particle 2"
PUSH = "norm of the normal part of the contact force"
TANGENTIAL = "tangential part of the contact force"
VECTORS = (POSITION, NORMAL, TANGENTIAL)
# versions with this title write a push with its sign, whatever the title of the push says
OF_SIGNED_PUSH = "normal part of the lubrication force"


class LfDemReader:
    """Reader plugin for LF_DEM."""

    name = "lf-dem"
    description = "LF_DEM par_*.dat and int_*.dat, in their sheared cell"
    extensions: tuple[str, ...] = (".dat",)

    def recognises(self, path: Path) -> bool:
        """By the first line."""
        return HEAD.match(first_bytes(path)) is not None

    def kind(self, path: Path) -> FileKind:
        """By the titles of the columns."""
        titles = _legend(path) if self.recognises(path) else {}
        if "particle 1 label" in titles:
            return "contacts"
        return "grains" if {"particle index", "radius"} <= titles.keys() else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One behind the other; their time is the strain."""
        count = _count(path) if self.kind(path) == "grains" else 0

        def moment(path: Path, head: bytes) -> tuple[None, float]:
            frame = FRAME.match(head)
            assert frame is not None
            return None, numbers(f"{path}: time of a frame", frame[1], 1)[0]

        def lack(data: bytes) -> str | None:
            rows = data.count(b"\n") - 1
            if rows < count:
                return f"it has {rows} rows of {count}"
            return None if data.endswith(b"\n") else "its last line has no end"

        return marked_frames(path, FRAME, moment, lack)

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their titles; the images above and below are shifted along x."""
        path = snapshot.path
        columns, shift = _columns(snapshot, _count(path))
        if not {"particle index", "radius", POSITION} <= columns.keys():
            raise ReadError(
                f"{path}: expected columns of the particle index, the radius and the {POSITION}, "
                f"found {', '.join(columns)}"
            )
        names = {"particle index": "id", POSITION: "position"}
        named = {names.get(title, title): values for title, values in columns.items()}
        return grain_table(path, named, _cell(path, shift), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        The pairs whose contact state is above zero.

        All others are near enough for lubrication, and do not touch. Forces are those of contact
        alone, without lubrication and repulsion.
        """
        path = snapshot.path
        columns, _ = _columns(snapshot, None)
        state = next((own for title, own in columns.items() if "contact state" in title), None)
        both = [columns.get(f"particle {number} label") for number in (1, 2)]
        if state is None or both[0] is None or both[1] is None:
            raise ReadError(f"{path}: expected columns of two labels and of the contact state")
        touching = {title: values[state > 0] for title, values in columns.items()}
        ids = [whole_numbers(path, own[state > 0]) for own in both if own is not None]
        force = _contact_forces(path, touching)
        return join_ids(path, grains, np.column_stack(ids), force, walls=False)


@np.errstate(over="ignore", invalid="ignore")
def _contact_forces(path: Path, columns: dict[str, FloatArray]) -> FloatArray | None:
    """
    The forces on particle 2 of each pair, shape (M, 3); None if the file lacks a part of them.

    In the program's source contact forces act on particle 1. There a push is against the normal,
    which points to particle 2; the file has it as a number, and the tangential part as it is.
    """
    if not {NORMAL, PUSH, TANGENTIAL} <= columns.keys():
        return None
    push = columns[PUSH][:, None]
    force = finite_forces(path, push * columns[NORMAL] - columns[TANGENTIAL])
    if len(force) and OF_SIGNED_PUSH not in columns and np.all(push >= 0):
        warnings.warn(
            f"{path}: versions of LF_DEM of August 2016 and later write normal contact forces "
            f"without their sign: where the dashpot pulls two grains together, its force is taken "
            f"for a push",
            ScanfabWarning,
            stacklevel=2,
        )
    return force


def _legend(path: Path) -> dict[str, range]:
    """The places of the columns of each title."""
    found = {}
    for first, last, title in LEGEND.findall(first_bytes(path, HEADER_BYTES)):
        places = range(max(int(first) - 1, 0), int(last or first))
        title = title.decode("utf-8", "replace").strip()
        if len(places) == 3 or (len(places) and title not in VECTORS):
            found[title] = places
    return found


def _count(path: Path) -> int:
    count = COUNT.search(first_bytes(path, HEADER_BYTES))
    if count is None:
        raise ReadError(f"{path}: expected a line '# np N', found none")
    return int(count[1])


def _columns(snapshot: Snapshot, count: int | None) -> tuple[dict[str, FloatArray], float]:
    """The columns of a frame by their titles, and the shear displacement."""
    path, data, legend = snapshot.path, text_of(snapshot), _legend(snapshot.path)
    frame = FRAME.match(data)
    if frame is None or not legend:
        raise ReadError(f"{path}: expected '# strain shear_disp rate', found {spelt(data[:80])}")
    width = max(places.stop for places in legend.values())
    layout = Layout(tuple(f"{place + 1}" for place in range(width)), line=2)
    rows = read_rows(snapshot, data[frame.end() :], layout, count=count, what="particles")
    columns = {
        title: np.column_stack([rows[f"{place + 1}"] for place in places])
        if len(places) > 1
        else rows[f"{places.start + 1}"]
        for title, places in legend.items()
    }
    return columns, numbers(f"{path}: shear displacement", frame[2], 1)[0]


def _cell(path: Path, shift: float) -> Cell | None:
    """About the origin; a plane (Ly = 0) does not repeat across."""
    edges = dict(EDGE.findall(first_bytes(path, HEADER_BYTES)))
    if edges.keys() != {b"x", b"y", b"z"}:
        raise ReadError(f"{path}: expected lines '# Lx', '# Ly' and '# Lz' with numbers")
    words = b" ".join(edges[axis] for axis in (b"x", b"y", b"z"))
    x, y, z = numbers(f"{path}: Lx, Ly, Lz", words, 3)
    flat = y == 0.0
    vectors = np.array([[x, 0, 0], [0, z if flat else y, 0], [shift, 0, z]])
    where = f"{path}: its lines Lx, Ly, Lz and the shear make no cell"
    return cell_of(where, vectors, (True, not flat, True), -0.5 * vectors.sum(axis=0))
