"""
MercuryDPM: grains in ``.data`` and contacts in ``.fstat``, or both in ``.restart``.

In ``.fstat`` contacts name grains by their row, counted from 0, and walls by negative numbers. Each
pair is listed from both sides, unless one grain is fixed or a periodic image. A restart names
grains by ids, in rows of words and numbers.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.columns import grain_table
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats import shared
from scanfab.io.reader import Carries, FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

# columns of a frame in 2D and 3D; the line above the frame has 6 words in 2D and 8 in 3D
PLANE = "x y vx vy radius angle omega species"
SPACE = "x y z vx vy vz radius q1 q2 q3 wx wy wz species"
LAYOUTS = {6: Layout(tuple(PLANE.split()), line=2), 8: Layout(tuple(SPACE.split()), line=2)}
# the line above a frame: number of grains, time, and bounds
FRAME = rb"\d{1,15}[ \t]+(\S+)(?:[ \t]+[-+.\deEinfa]+){%d}[ \t]*\r?\n"
FRAMES = {width: re.compile(FRAME % (width - 2)) for width in LAYOUTS}
# time, rows of both grains, contact point, overlaps, normal and tangential force, both directions
PAIRS = "t i j x y z delta deltat fn ft nx ny nz tx ty tz"
FSTAT = re.compile(rb"#[ \t]+(\S+)[ \t]+[01][ \t]*\r?\n")
# the line FSTAT and two more lines above the contacts of a frame
FSTAT_HEAD = re.compile(FSTAT.pattern + rb"#(?:[ \t]+\S+){6}\s+#(?:[ \t]+\S+){6,7}[ \t]*\r?\n")
RESTART = re.compile(rb"(?:restart_version|MercuryDPM)[ \t]+[\d.]+")
TIME = re.compile(rb"^(?:timeStep|dt) \S+ (?:time|t) (\S+)", re.MULTILINE)
DOMAIN = re.compile(rb"(?im)^xmin (\S+) xmax (\S+) ymin (\S+) ymax (\S+) zmin (\S+) zmax (\S+)")
# rows of a restart; versions 2 and 3 list centre, velocity and radius without words between them
SPHERE = re.compile(
    rb"(?!\w*(?:SuperQuadric|NonSpherical|Clump|Multi))\w*Particle id (?P<id>\S+) indSpecies "
    rb"(?P<species>\S+) position (?P<x>\S+) (?P<y>\S+) (?P<z>\S+) .*\bradius (?P<radius>\S+)"
)
OLD_SPHERE = re.compile(
    rb"(?:TSP BP )?(?=[-+.\d])(?P<x>\S+) (?P<y>\S+) (?P<z>\S+) \S+ \S+ \S+ (?P<radius>\S+)"
)
PAIR = re.compile(
    rb"\w+ particle(?:Wall)?Ids (?P<i>\S+) (?P<j>\S+) .*?"
    rb"\bforce (?P<fx>\S+) (?P<fy>\S+) (?P<fz>\S+)"
)
PERIOD = re.compile(
    rb"(?:PeriodicBoundary .*?)?normal (?P<nx>\S+) (?P<ny>\S+) (?P<nz>\S+) .*?"
    rb"(?:pos\w*_left|distanceLeft) (?P<left>\S+) .*?shift (?P<x>\S+) (?P<y>\S+) (?P<z>\S+)"
)
# boundaries that repeat the sample; all but the plain PeriodicBoundary are refused. Version 2 lists
# them in a section of their own, without the word.
PERIODS = re.compile(rb"normal |\w*(?:LeesEdwards|Periodic|Maser|StressStrain|Circular)")


class MercuryReader(shared.GrainsOnly):
    """Reader plugin for the files of MercuryDPM."""

    name = "mercurydpm"
    description = "MercuryDPM .data with contacts in .fstat, and .restart"
    extensions: tuple[str, ...] = (".data", ".fstat", ".restart")

    def recognises(self, path: Path) -> bool:
        """A restart by its first word, contacts by three lines, grains by the line above them."""
        head = first_bytes(path, shared.HEADER_BYTES)
        second = head.partition(b"\n")[2].partition(b"\n")[0].split()
        # the second line has no 8 or 14 words after an empty frame: then the name decides
        is_data = len(second) in (8, 14) or ".data" in bare_name(path)
        marks = (RESTART, FSTAT_HEAD, *(FRAMES.values() if is_data else ()))
        return any(mark.match(head) for mark in marks)

    def kind(self, path: Path) -> FileKind:
        """Contacts for ``.fstat`` files, else grains."""
        is_list = FSTAT_HEAD.match(first_bytes(path, shared.HEADER_BYTES)) is not None
        return "contacts" if is_list else super().kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames, one after the other, with their times; a restart is one frame."""
        head = first_bytes(path, shared.HEADER_BYTES)
        if FSTAT_HEAD.match(head):
            return shared.marked_frames(path, FSTAT)
        if not RESTART.match(head):
            return shared.marked_frames(path, FRAMES[6 if FRAMES[6].match(head) else 8], self.table)
        time = TIME.search(head)
        return [Snapshot(path, time=time and shared.numbers(f"{path}: time", time[1], 1)[0])]

    def carries(self, path: Path) -> Carries:
        """A restart states its periodic boundaries; ``.data`` has only bounds."""
        return "cell" if RESTART.match(first_bytes(path)) else "box"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The grains of a frame; a restart also has contacts."""
        if RESTART.match(first_bytes(snapshot.path)):
            return _restart(snapshot.path, text_of(snapshot), options)
        return super().read_grains(snapshot, options)

    @np.errstate(invalid="ignore")
    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The rows of ``.data``, and their bounds as a cell that is not periodic."""
        path, (line, _, rows) = snapshot.path, text_of(snapshot).partition(b"\n")
        where = f"{path}: number of grains, time and bounds above a frame"
        width = 6 if len(line.split()) == 6 else 8
        count, _, *bounds = shared.numbers(where, line, width)
        columns = read_rows(snapshot, rows, LAYOUTS[width], count=int(count), what="grains")
        low, high = np.reshape(bounds, (2, -1))
        edges = high - low
        if len(low) == 2:
            low, edges = np.append(low, 0.0), np.append(edges, edges.max())
        return shared.in_space(columns), shared.cell_of(path, edges, (False, False, False), low)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        The pairs with their forces; contacts with walls are counted.

        Normal and tangential force act on the first grain, and the normal points to this grain from
        the second. Pairs that are listed from both sides are merged later.
        """
        rows = text_of(snapshot).split(b"\n", 3)[-1]
        layout = Layout(tuple(PAIRS.split()), line=4, whole="ij")
        columns = read_rows(snapshot, rows, layout, what="contacts")
        normal, tangent = (np.column_stack([columns[f"{v}{x}"] for x in "xyz"]) for v in "nt")
        with np.errstate(over="ignore", invalid="ignore"):
            force = -(columns["fn"][:, None] * normal + columns["ft"][:, None] * tangent)
        # contacts name rows of the grain file, whatever ids the grains have
        numbered = grains._replace(id=np.arange(len(grains.radius)))
        return shared.join_pairs(snapshot.path, numbered, (columns["i"], columns["j"]), force)


def _restart(path: Path, data: bytes, options: ReadOptions) -> GrainTable:
    """The particles of a restart with their interactions, whose force acts on the first grain."""
    rows = _section(path, data, b"Particles")
    is_old = any(OLD_SPHERE.match(row) for row in rows[:1])
    columns = _columns(path, rows, OLD_SPHERE if is_old else SPHERE, "spheres")
    columns = {"id": np.arange(len(rows)), "species": np.zeros(len(rows)), **columns}
    is_told = options.cell is not None or options.beside is not None
    grains = grain_table(path, columns, None if is_told else _cell(path, data), options)
    if is_old or not rows:
        return grains
    rows = _section(path, data, b"Interactions")
    values = _columns(path, rows, PAIR, "interactions of particleIds with a force")
    first, second, *force = values.values()
    # walls are also numbered from 0
    second[[b" particleWallIds " in row for row in rows]] = -1
    joined = shared.join_pairs(path, grains, (first, second), -np.column_stack(force))
    return grains._replace(contacts=joined.contacts, wall_contacts=joined.wall_contacts)


def _section(path: Path, data: bytes, name: bytes) -> list[bytes]:
    """The rows of a section, below the line with its name and their number."""
    head = re.search(rb"^" + name + rb"[ \t]+(\d{1,12})[ \t]*\r?\n", data, re.MULTILINE)
    count, below = (int(head[1]), data[head.end() :]) if head else (1, b"")
    *rows, behind = below.split(b"\n", count)
    is_more = bool(rows) and behind.split(b" ", 1)[0] == rows[-1].split(b" ", 1)[0]
    if len(rows) != count or is_more:
        raise ReadError(f"{path}: expected a line '{name.decode()} N' with N rows below it")
    return rows


def _columns(path: Path, rows: list[bytes], pattern: re.Pattern[bytes], what: str) -> Columns:
    """The numbers in the groups of a pattern, by the names of the groups; a row per line."""
    table = np.zeros((len(rows), pattern.groups))
    for place, row in enumerate(rows):
        match = pattern.match(row)
        words = b" ".join(match.groups()) if match else b""
        table[place] = shared.numbers(f"{path}: {what} in {spelt(row)}", words, pattern.groups)
    return dict(zip(pattern.groupindex, table.T, strict=True))


def _cell(path: Path, data: bytes) -> Cell | None:
    """The domain as a cell; along a periodic boundary the edge is the shift of the boundary."""
    words = b" ".join(word for bounds in DOMAIN.findall(data)[:1] for word in bounds)
    bounds = np.array(shared.numbers(f"{path}: its domain xMin xMax ...", words, 6))
    origin, vectors = bounds[::2], np.diag(bounds[1::2] - bounds[::2])
    section = b"WallsPeriodic" if b"\nWallsPeriodic " in data else b"Boundaries"
    rows = [row for row in _section(path, data, section) if PERIODS.match(row)]
    expected = "a PeriodicBoundary (or name the cell: `cell=(LX, LY, LZ)`)"
    boundaries = np.column_stack([*_columns(path, rows, PERIOD, expected).values()])
    which, axes = np.nonzero(boundaries[:, :3])
    if len({*axes.tolist()}) < len(axes) or len(axes) != len(rows):
        raise ReadError(f"{path}: expected periodic boundaries along the axes, one along each")
    origin[axes] = boundaries[which, 3] / boundaries[which, axes]
    vectors[axes] = boundaries[which, 4:]
    return shared.cell_of(f"{path}: its boundaries", vectors, np.isin([0, 1, 2], axes), origin)
