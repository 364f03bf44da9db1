"""
MercuryDPM: grains in ``.data`` and contacts in ``.fstat``, or both in ``.restart``.

In ``.fstat`` contacts name grains by their row, from 0, and walls by numbers below 0. Each pair is
listed from both sides, unless one of them is fixed or an image in a periodic cell. A restart names
grains by their ids, in rows of words and numbers.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats import shared
from scanfab.io.reader import Carries, FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

# the columns of a frame in the plane and in space, by the number of words in the line above it
PLANE = "x y vx vy radius angle omega species"
SPACE = "x y z vx vy vz radius q1 q2 q3 wx wy wz species"
LAYOUTS = {6: Layout(tuple(PLANE.split()), line=2), 8: Layout(tuple(SPACE.split()), line=2)}
# these lines: the number of grains, the time, and bounds
FRAMES = {
    width: re.compile(
        rb"(?m)^\d{1,15}[ \t]+(\S+)(?:[ \t]+[-+.\deEinfa]+){%d}[ \t]*\r?\n" % (width - 2)
    )
    for width in LAYOUTS
}
# time, both rows, contact point, overlaps, normal and tangential force, normal, tangent
FSTAT = "t i j x y z delta deltat fn ft nx ny nz tx ty tz"
FSTAT_HEAD = re.compile(
    rb"#[ \t]+\S+[ \t]+[01]\s+#(?:[ \t]+\S+){6}\s+#(?:[ \t]+\S+){6,7}[ \t]*\r?\n"
)
FSTAT_FRAME = re.compile(rb"#[ \t]+(\S+)[ \t]+[01][ \t]*\r?\n")
RESTART = re.compile(rb"(?:restart_version|MercuryDPM)[ \t]+[\d.]+")
TIME = re.compile(rb"^(?:timeStep|dt) \S+ (?:time|t) (\S+)", re.MULTILINE)
DOMAIN = re.compile(rb"(?im)^xmin (\S+) xmax (\S+) ymin (\S+) ymax (\S+) zmin (\S+) zmax (\S+)")
# rows of a restart; versions 1 to 3 have centre, velocity and radius without words
SPHERE = re.compile(
    rb"(?!\w*(?:SuperQuadric|NonSpherical|Clump|Multi))\w*Particle id (?P<id>\S+) indSpecies "
    rb"(?P<species>\S+) position (?P<x>\S+) (?P<y>\S+) (?P<z>\S+) .*\bradius (?P<radius>\S+)"
)
OLD_SPHERE = re.compile(rb"TSP BP (?P<x>\S+) (?P<y>\S+) (?P<z>\S+) \S+ \S+ \S+ (?P<radius>\S+)")
PAIR = re.compile(
    rb"\w+ particle(?:Wall)?Ids (?P<i>\S+) (?P<j>\S+) .*?"
    rb"\bforce (?P<fx>\S+) (?P<fy>\S+) (?P<fz>\S+)"
)
PERIOD = re.compile(
    rb"PeriodicBoundary .*?normal (?P<nx>\S+) (?P<ny>\S+) (?P<nz>\S+) .*?"
    rb"(?:position_left|distanceLeft) (?P<left>\S+) .*?shift (?P<x>\S+) (?P<y>\S+) (?P<z>\S+)"
)
# boundaries that repeat, most of them in another way than by a shift
PERIODS = re.compile(rb"\w*(?:LeesEdwards|Periodic|Maser|StressStrain|Circular)")


class MercuryReader(shared.GrainsOnly):
    """Reader plugin for the files of MercuryDPM."""

    name = "mercurydpm"
    description = "MercuryDPM .data with contacts in .fstat, and .restart"
    extensions: tuple[str, ...] = (".data", ".fstat", ".restart")
    lists_contacts = True

    def recognises(self, path: Path) -> bool:
        """A restart by its first word, contacts by three lines, grains by the line above them."""
        head = first_bytes(path, shared.HEADER_BYTES)
        first, second = (line.split() for line in (*head.split(b"\n", 2), b"")[:2])
        if RESTART.match(head) or FSTAT_HEAD.match(head):
            return True
        if len(first) not in FRAMES or not FRAMES[len(first)].match(head):
            return False
        # below an empty frame there is another one, or nothing
        is_empty = int(first[0]) == 0 and ".data" in bare_name(path)
        return is_empty or len(second) == len(LAYOUTS[len(first)].names)

    def kind(self, path: Path) -> FileKind:
        """Contacts are in ``.fstat`` files."""
        is_list = FSTAT_HEAD.match(first_bytes(path, shared.HEADER_BYTES)) is not None
        return "contacts" if is_list else super().kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """Frames one behind the other, with their times; a restart is one."""
        head = first_bytes(path, shared.HEADER_BYTES)
        if RESTART.match(head):
            found = TIME.search(head)
            return [Snapshot(path, time=found and shared.numbers(f"{path}: time", found[1], 1)[0])]
        if FSTAT_HEAD.match(head):
            return shared.marked_frames(path, FSTAT_FRAME)
        width = _width(head)

        def lack(frame: bytes) -> str | None:
            line, _, rows = frame.partition(b"\n")
            return shared.lack_of_rows(rows, int(line.split()[0]), len(LAYOUTS[width].names))

        return shared.marked_frames(path, FRAMES[width], lack=lack)

    def carries(self, path: Path) -> Carries:
        """A restart has its periodic boundaries; the bounds in ``.data`` may repeat or not."""
        return "cell" if RESTART.match(first_bytes(path)) else "box"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """A restart has words in its rows, and contacts."""
        if RESTART.match(first_bytes(snapshot.path)):
            return _restart(snapshot.path, text_of(snapshot), options)
        return super().read_grains(snapshot, options)

    @np.errstate(invalid="ignore")
    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The rows of ``.data``; nothing is known to repeat."""
        path, (line, _, rows) = snapshot.path, text_of(snapshot).partition(b"\n")
        where, width = f"{path}: number of grains, time and bounds above a frame", _width(line)
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
        Pairs with their forces; rows with walls are counted.

        The normal points from the second to the first grain, on which normal and tangential force
        act. That pairs are listed from both sides does no harm.
        """
        path, data = snapshot.path, text_of(snapshot)
        head = FSTAT_HEAD.match(data)
        if head is None:
            raise ReadError(f"{path}: contacts are read from .fstat files with whole headers")
        layout = Layout(tuple(FSTAT.split()), line=4, whole="ij")
        columns = read_rows(snapshot, data[head.end() :], layout, what="contacts")
        pairs = np.column_stack([whole_numbers(path, columns[name]) for name in "ij"])
        normal, tangent = (np.column_stack([columns[f"{v}{x}"] for x in "xyz"]) for v in "nt")
        with np.errstate(over="ignore", invalid="ignore"):
            force = -(columns["fn"][:, None] * normal + columns["ft"][:, None] * tangent)
        # rows of the grain file, whatever ids these have
        numbered = grains._replace(id=np.arange(len(grains.radius)))
        force = shared.finite_forces(path, force)
        return join_ids(path, numbered, pairs, force, walls="negative")


def _width(text: bytes) -> int:
    """The number of words in the line above a frame."""
    return 6 if len(text.partition(b"\n")[0].split()) == 6 else 8


def _restart(path: Path, data: bytes, options: ReadOptions) -> GrainTable:
    """The particles, and the interactions, whose force acts on the first grain."""
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    rows = _section(path, data, b"Particles")
    is_old = any(OLD_SPHERE.match(row) for row in rows[:1])
    columns = _columns(path, rows, OLD_SPHERE if is_old else SPHERE, "spheres")
    columns = {"id": np.arange(len(rows)), "species": np.zeros(len(rows)), **columns}
    told = options.cell is not None or options.beside is not None
    grains = grain_table(path, columns, None if told else _cell(path, data), options)
    if is_old or not rows:
        return grains
    rows = _section(path, data, b"Interactions")
    found = _columns(path, rows, PAIR, "interactions of particleIds with a force")
    pairs = np.column_stack([whole_numbers(path, found[end]) for end in "ij"])
    # walls have numbers from 0, too
    pairs[[b" particleWallIds " in row for row in rows], 1] = -1
    force = -np.column_stack([found[name] for name in ("fx", "fy", "fz")])
    force = shared.finite_forces(path, force)
    joined = join_ids(path, grains, pairs, force, walls="negative")
    return grains._replace(contacts=joined.contacts, wall_contacts=joined.wall_contacts)


def _section(path: Path, data: bytes, name: bytes) -> list[bytes]:
    """The rows below the line that counts them."""
    what = name.decode()
    head = re.search(rb"^" + name + rb"[ \t]+(\d{1,12})[ \t]*\r?\n", data, re.MULTILINE)
    if head is None:
        raise ReadError(f"{path}: expected a line '{what} N': the file is incomplete or damaged")
    *rows, behind = data[head.end() :].split(b"\n", int(head[1]))
    is_more = bool(rows) and behind.split(b" ", 1)[0] == rows[-1].split(b" ", 1)[0]
    if len(rows) < int(head[1]) or is_more:
        found = f"more: {spelt(behind)}" if is_more else f"{len(rows)}: the file is incomplete"
        raise ReadError(f"{path}: expected {head[1].decode()} {what}, found {found}")
    return rows


def _columns(path: Path, rows: list[bytes], pattern: re.Pattern[bytes], what: str) -> Columns:
    """The numbers that stand in the groups of a pattern, by their names."""
    table = np.zeros((len(rows), pattern.groups))
    for place, row in enumerate(rows):
        match = pattern.match(row)
        words = b" ".join(match.groups()) if match else b""
        table[place] = shared.numbers(f"{path}: {what} in {spelt(row)}", words, pattern.groups)
    return dict(zip(pattern.groupindex, table.T, strict=True))


def _cell(path: Path, data: bytes) -> Cell | None:
    """The domain, with the shift of each periodic boundary as the edge along its normal."""
    domain = DOMAIN.search(data)
    words = b" ".join(domain.groups()) if domain else b""
    bounds = np.array(shared.numbers(f"{path}: its domain xMin xMax ...", words, 6))
    origin, vectors = bounds[::2], np.diag(bounds[1::2] - bounds[::2])
    rows = [row for row in _section(path, data, b"Boundaries") if PERIODS.match(row)]
    expected = "a PeriodicBoundary (or name the cell: `cell=(LX, LY, LZ)`)"
    found = np.column_stack([*_columns(path, rows, PERIOD, expected).values()])
    which, axes = np.nonzero(found[:, :3])
    if len({*axes.tolist()}) < len(axes) or len(axes) != len(rows):
        raise ReadError(f"{path}: expected periodic boundaries along the axes, one along each")
    origin[axes] = found[which, 3] / found[which, axes]
    vectors[axes] = found[which, 4:]
    where, periodic = f"{path}: its domain and periodic boundaries", np.isin(np.arange(3), axes)
    return shared.cell_of(where, vectors, periodic, origin)
