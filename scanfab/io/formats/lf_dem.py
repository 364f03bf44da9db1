"""LF_DEM: ``par_*.dat`` with grains and ``int_*.dat`` with pairs, sheared by Lees and Edwards."""

from __future__ import annotations

import re
import warnings
from collections.abc import Collection
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.base.typing import FloatArray
from scanfab.io.columns import whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats import shared
from scanfab.io.formats.shared import HEADER_BYTES, GrainsOnly, numbers
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

# what a column holds, or a range of them
LEGEND = re.compile(rb"^#(\d{1,3})(?:-(\d{1,3}))?:[ \t]*([^\r\n]*)", re.MULTILINE)
# above each frame: strain, shear displacement, rate and more
FRAME = re.compile(rb"#[ \t]+([-+\d.eE]+)[ \t]+([-+\d.eE]+)[ \t]+[-+\d.eE]+[^\r\n]*\r?\n")
EDGE = re.compile(rb"^#[ \t]+L([xyz])[ \t]+(\S+)", re.MULTILINE)
COUNT = re.compile(rb"^#[ \t]+np[ \t]+(\d{1,15})\s", re.MULTILINE)
POSITION = "position (x, y, z)"
NORMAL = "normal vector, oriented from particle 1 to particle 2"
PUSH = "norm of the normal part of the contact force"
TANGENTIAL = "tangential part of the contact force"
# versions with this title write a push with its sign, whatever the title of the push says
OF_SIGNED_PUSH = "normal part of the lubrication force"


class LfDemReader(GrainsOnly):
    """Reader plugin for LF_DEM."""

    name = "lf-dem"
    description = "LF_DEM par_*.dat and int_*.dat, in their sheared cell"
    extensions: tuple[str, ...] = (".dat",)

    def recognises(self, path: Path) -> bool:
        """By the first line."""
        return first_bytes(path).startswith(b"# LF_DEM version")

    def kind(self, path: Path) -> FileKind:
        """By the titles of the columns."""
        titles = _legend(path) if self.recognises(path) else {}
        if "particle 1 label" in titles:
            return "contacts"
        return "grains" if {"particle index", "radius"} <= titles.keys() else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One behind the other; their time is the strain."""
        count = _count(path) if self.kind(path) == "grains" else 0

        def lack(frame: bytes) -> str | None:
            rows = frame.count(b"\n") - 1
            return f"it has {rows} rows of {count}" if rows < count else shared.lack_of_end(frame)

        return shared.marked_frames(path, FRAME, lack=lack)

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """Columns by their titles; the images above and below are shifted along x."""
        path = snapshot.path
        needed = ("particle index", "radius", POSITION)
        columns, shift = _columns(snapshot, needed, _count(path))
        names = {"particle index": "id", POSITION: "position"}
        named = {names.get(title, title): values for title, values in columns.items()}
        edges = dict(EDGE.findall(first_bytes(path, HEADER_BYTES)))
        words = b" ".join(edges.get(axis, b"") for axis in (b"x", b"y", b"z"))
        x, y, z = numbers(f"{path}: lines '# Lx', '# Ly' and '# Lz'", words, 3)
        # the cell lies about the origin; a plane (Ly = 0) does not repeat across
        vectors = np.array([[x, 0, 0], [0, y or z, 0], [shift, 0, z]])
        where = f"{path}: its lines Lx, Ly, Lz and the shear make no cell"
        origin = -0.5 * vectors.sum(axis=0)
        return named, shared.cell_of(where, vectors, (True, y != 0.0, True), origin)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        The pairs whose contact state is above zero.

        All others are near enough for lubrication, and do not touch. Forces are those of contact
        alone, without lubrication and repulsion.
        """
        path = snapshot.path
        titles = [title for title in _legend(path) if "contact state" in title]
        needed = ("particle 1 label", "particle 2 label", *(titles[:1] or ["contact state"]))
        columns, _ = _columns(snapshot, needed)
        state = columns[needed[2]]
        touching = {title: values[state > 0] for title, values in columns.items()}
        ids = [whole_numbers(path, touching[title]) for title in needed[:2]]
        force = _contact_forces(path, touching)
        return join_ids(path, grains, np.column_stack(ids), force, walls=False)


@np.errstate(over="ignore", invalid="ignore")
def _contact_forces(path: Path, columns: Columns) -> FloatArray | None:
    """
    The forces on particle 2 of each pair, shape (M, 3); None if the file lacks a part of them.

    In the program's source contact forces act on particle 1. There a push is against the normal,
    which points to particle 2; the file has it as a number, and the tangential part as it is.
    """
    if not {NORMAL, PUSH, TANGENTIAL} <= columns.keys():
        return None
    push = columns[PUSH][:, None]
    force = shared.finite_forces(path, push * columns[NORMAL] - columns[TANGENTIAL])
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
        if len(places) == 3 or (len(places) and title not in (POSITION, NORMAL, TANGENTIAL)):
            found[title] = places
    return found


def _count(path: Path) -> int:
    count = COUNT.search(first_bytes(path, HEADER_BYTES))
    if count is None:
        raise ReadError(f"{path}: expected a line '# np N', found none")
    return int(count[1])


def _columns(
    snapshot: Snapshot, needed: Collection[str], count: int | None = None
) -> tuple[Columns, float]:
    """The columns of a frame by their titles, and the shear displacement."""
    path, data, legend = snapshot.path, text_of(snapshot), _legend(snapshot.path)
    frame = FRAME.match(data)
    if frame is None or not legend.keys() >= {*needed}:
        raise ReadError(
            f"{path}: expected '# strain shear_disp rate' below columns with the titles "
            f"{', '.join(needed)}, found {spelt(data[:80])} below {', '.join(legend) or 'none'}"
        )
    width = max(places.stop for places in legend.values())
    layout = Layout(tuple(f"{place}" for place in range(width)), line=2)
    rows = read_rows(snapshot, data[frame.end() :], layout, count=count, what="particles")
    columns = {}
    for title, places in legend.items():
        own = [rows[f"{place}"] for place in places]
        columns[title] = own[0] if len(own) == 1 else np.column_stack(own)
    return columns, numbers(f"{path}: shear displacement", frame[2], 1)[0]
