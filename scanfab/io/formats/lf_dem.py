"""LF_DEM: ``par_*.dat`` with grains and ``int_*.dat`` with pairs, in a Lees-Edwards cell."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError, warn
from scanfab.base.typing import Columns
from scanfab.io.files import first_bytes
from scanfab.io.formats import shared
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

# the title of a column, or of a range of columns
LEGEND = re.compile(rb"^#(\d{1,3})(?:-(\d{1,3}))?:[ \t]*([^\r\n]*)", re.MULTILINE)
# the number of grains, and the edges of the cell
SIZES = re.compile(rb"^#[ \t]+(np(?=[ \t]+\d{1,15}\s)|L[xyz])[ \t]+(\S+)", re.MULTILINE)
# the line above each frame: strain, shear displacement, rate and more
FRAME = re.compile(rb"#[ \t]+([-+\d.eE]+)[ \t]+([-+\d.eE]+)[ \t]+[-+\d.eE]+[^\r\n]*\r?\n")
POSITION, PAIR = "position (x, y, z)", ("particle 1 label", "particle 2 label")
NORMAL = "normal vector, oriented from particle 1 to particle 2"
PUSH = "norm of the normal part of the contact force"
TANGENTIAL = "tangential part of the contact force"
# versions with this title write PUSH with a sign, although its title says norm
OF_SIGNED_PUSH = "normal part of the lubrication force"


class LfDemReader(shared.GrainsOnly):
    """Reader plugin for LF_DEM."""

    name = "lf-dem"
    description = "LF_DEM par_*.dat and int_*.dat, in their sheared cell"
    extensions: tuple[str, ...] = (".dat",)

    def recognises(self, path: Path) -> bool:
        """Recognised by the first line."""
        return first_bytes(path).startswith(b"# LF_DEM version")

    def kind(self, path: Path) -> FileKind:
        """Contacts or grains, by the titles of the columns."""
        titles = _legend(path) if self.recognises(path) else {}
        if PAIR[0] in titles:
            return "contacts"
        return "grains" if {"particle index", "radius"} <= titles.keys() else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames, one after the other; their time is the strain."""
        check = None if self.kind(path) == "contacts" else self.table
        return shared.marked_frames(path, FRAME, check)

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The columns by their titles; the third cell vector is sheared along x."""
        path = snapshot.path
        sizes = dict(SIZES.findall(first_bytes(path, shared.HEADER_BYTES)))
        words = b" ".join(sizes.get(name, b"") for name in (b"np", b"Lx", b"Ly", b"Lz"))
        where = f"{path}: lines '# np', '# Lx', '# Ly' and '# Lz'"
        count, x, y, z = shared.numbers(where, words, 4)
        needed = ("particle index", "radius", POSITION)
        columns, shift = _columns(snapshot, needed, int(count))
        columns["id"], columns["position"] = columns.pop("particle index"), columns.pop(POSITION)
        # the cell is centred at the origin; a 2D sample (Ly = 0) is not periodic along y
        vectors = np.array([[x, 0, 0], [0, y or z, 0], [shift, 0, z]])
        where, origin = f"{path}: the cell of Lx, Ly, Lz and the shear", -0.5 * vectors.sum(axis=0)
        return columns, shared.cell_of(where, vectors, (True, y != 0.0, True), origin)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        The pairs whose contact state is above zero, with contact forces.

        Other pairs interact by lubrication only and do not touch. Forces of lubrication and
        repulsion are not included.
        """
        path = snapshot.path
        states = [title for title in _legend(path) if "contact state" in title]
        needed = (*PAIR, *(states[:1] or ["contact state"]))
        columns, _ = _columns(snapshot, needed)
        is_contact = columns[needed[2]] > 0
        columns = {title: values[is_contact] for title, values in columns.items()}
        ends = [columns[title] for title in PAIR]
        if not {NORMAL, PUSH, TANGENTIAL} <= columns.keys():
            return shared.join_pairs(path, grains, ends, None)
        push = columns[PUSH][:, None]
        if len(push) and OF_SIGNED_PUSH not in columns and np.all(push >= 0):
            problem = "LF_DEM has written normal contact forces without sign since August 2016"
            warn(f"{path}: {problem}: all are taken as repulsive")
        # by LF_DEM's source, contact forces act on particle 1; the normal points to particle 2, so
        # a push on particle 1 is against the normal, while the tangential part needs no sign
        with np.errstate(over="ignore", invalid="ignore"):
            force = push * columns[NORMAL] - columns[TANGENTIAL]
        return shared.join_pairs(path, grains, ends, force)


def _legend(path: Path) -> dict[str, range]:
    """The range of columns of each title."""
    legend = {}
    for first, last, words in LEGEND.findall(first_bytes(path, shared.HEADER_BYTES)):
        places = range(max(int(first) - 1, 0), int(last or first))
        title = words.decode("utf-8", "replace").strip()
        if len(places) == 3 or (len(places) and title not in (POSITION, NORMAL, TANGENTIAL)):
            legend[title] = places
    return legend


def _columns(
    snapshot: Snapshot, needed: tuple[str, ...], count: int | None = None
) -> tuple[Columns, float]:
    """The columns of a frame by their titles, and the shear displacement."""
    path, data, legend = snapshot.path, text_of(snapshot), _legend(snapshot.path)
    frame = FRAME.match(data)
    if frame is None or not legend.keys() >= {*needed}:
        expected = f"'# strain shear_disp rate' and the titles {', '.join(needed)}"
        found = f"{spelt(data)} and the titles {', '.join(legend)}"
        raise ReadError(f"{path}: expected {expected}, found {found}")
    width = max(places.stop for places in legend.values())
    layout = Layout(tuple(shared.numbered(width)), line=2)
    rows = read_rows(snapshot, data[frame.end() :], layout, count=count, what="particles")
    table = np.column_stack([*rows.values()])
    columns = {
        title: table[:, places] if len(places) > 1 else table[:, places[0]]
        for title, places in legend.items()
    }
    return columns, shared.numbers(f"{path}: shear displacement", frame[2], 1)[0]
