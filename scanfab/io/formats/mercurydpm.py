"""
MercuryDPM: grains in ``.data`` and contacts in ``.fstat``, or both in ``.restart``.

In ``.fstat`` contacts name grains by their row, from 0, and walls by numbers below 0. Each pair is
listed from both sides, unless one of them is fixed or an image in a periodic cell. A restart names
grains by their ids, in rows of words and numbers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import bare_name, first_bytes, plain
from scanfab.io.formats import shared
from scanfab.io.formats.shared import HEADER_BYTES, numbers
from scanfab.io.growing import leave_out_last
from scanfab.io.reader import Carries, FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, skip_rows, spelt, text_of
from scanfab.packing.cell import Cell

PLANE = "x y vx vy radius angle omega species"
SPACE = "x y z vx vy vz radius q1 q2 q3 wx wy wz species"
# by the number of words above a frame
LAYOUTS = {6: Layout(tuple(PLANE.split()), line=2), 8: Layout(tuple(SPACE.split()), line=2)}
ABOVE = "the number of grains, time and bounds above a frame"
# time, both rows, contact point, overlaps, normal and tangential force, normal, tangent
FSTAT = "t i j x y z delta deltat fn ft nx ny nz tx ty tz"
FSTAT_HEAD = re.compile(
    rb"#[ \t]+\S+[ \t]+[01]\s+#(?:[ \t]+\S+){6}\s+#(?:[ \t]+\S+){6,7}[ \t]*\r?\n"
)
FSTAT_FRAME = re.compile(rb"#[ \t]+(\S+)[ \t]+[01][ \t]*\r?\n")
RESTART = re.compile(rb"(?:restart_version|MercuryDPM)[ \t]+[\d.]+")
TIME = re.compile(rb"^(?:timeStep|dt) \S+ (?:time|t) (\S+)", re.MULTILINE)
DOMAIN = re.compile(rb"(?im)^xmin (\S+) xmax (\S+) ymin (\S+) ymax (\S+) zmin (\S+) zmax (\S+)")
# rows of a restart; versions 2 and 3 have centre, velocity and radius of a sphere without words
SPHERE = re.compile(
    rb"(?!\w*(?:SuperQuadric|NonSpherical|Clump|Multi))\w*Particle id (\S+) indSpecies (\S+) "
    rb"position (\S+) (\S+) (\S+) .*\bradius (\S+)"
)
OLD_SPHERE = re.compile(rb"TSP BP (\S+) (\S+) (\S+) \S+ \S+ \S+ (\S+)")
PAIR = re.compile(rb"\w+ particleIds (\S+) (\S+) .*?\bforce (\S+) (\S+) (\S+)")
AT_WALL = re.compile(rb"\w+ particleWallIds (\S+) \S+ ")
PERIOD = re.compile(
    rb"PeriodicBoundary .*?normal (\S+) (\S+) (\S+) .*?(?:position_left|distanceLeft) (\S+) "
    rb".*?shift (\S+) (\S+) (\S+)"
)
# boundaries that repeat in another way than by a shift
OTHER_PERIODS = re.compile(rb"\w*(?:LeesEdwards|Periodic|Maser|StressStrain|Circular)\w*")


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
        return "other" if form is None else "contacts" if form == "fstat" else "grains"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """Frames one behind the other, with their times."""
        head = first_bytes(path, HEADER_BYTES)
        if RESTART.match(head):
            found = TIME.search(head)
            time = None if found is None else numbers(f"{path}: time", found[1], 1)[0]
            return [Snapshot(path, time=time)]
        if FSTAT_HEAD.match(head):
            return shared.marked_frames(path, FSTAT_FRAME)
        return _grain_frames(path)

    def carries(self, path: Path) -> Carries:
        """A restart has its periodic boundaries; the bounds in ``.data`` may repeat or not."""
        return "cell" if RESTART.match(first_bytes(path)) else "box"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Rows of numbers; a restart has words in its rows, and contacts."""
        path, data = snapshot.path, text_of(snapshot)
        if RESTART.match(data):
            return _read_restart(path, data, options)
        line, _, rows = data.partition(b"\n")
        bounds = _bounds(line)
        if bounds is None:
            raise ReadError(f"{path}: expected {ABOVE}, found {spelt(line)}")
        layout = LAYOUTS[len(bounds)]
        columns = read_rows(snapshot, rows, layout, count=int(bounds[0]), what="grains")
        low, high = np.reshape(bounds[2:], (2, -1))
        with np.errstate(invalid="ignore"):
            edges = high - low
        if len(low) == 2:
            low, edges = np.append(low, 0.0), np.append(edges, edges.max())
        # nothing is known to repeat
        cell = shared.cell_of(path, edges, (False, False, False), low)
        return grain_table(path, shared.in_space(columns), cell, options)

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
        rows = np.column_stack([whole_numbers(path, columns[name]) for name in "ij"])
        normal, tangent = (np.column_stack([columns[f"{v}{x}"] for x in "xyz"]) for v in "nt")
        with np.errstate(over="ignore", invalid="ignore"):
            force = -(columns["fn"][:, None] * normal + columns["ft"][:, None] * tangent)
        # rows of the grain file, whatever ids these have; no grain has the number of a wall
        numbered = grains._replace(id=np.arange(len(grains.radius)))
        at_wall = rows[:, 1] < 0
        return _joined(path, numbered, rows[~at_wall], force[~at_wall], rows[at_wall, 0])


def _form(path: Path) -> str | None:
    """``restart``, ``fstat`` or ``data``; None if it is no file of MercuryDPM."""
    head = first_bytes(path, HEADER_BYTES)
    if RESTART.match(head):
        return "restart"
    if FSTAT_HEAD.match(head):
        return "fstat"
    first, second = (*head.split(b"\n", 2), b"")[:2]
    bounds, width = _bounds(first), len(second.split())
    if bounds is None:
        return None
    # an empty frame is followed by another one; alone it may be anything
    is_data = _bounds(second) is not None if width else ".data" in bare_name(path)
    if bounds[0] > 0:
        is_data = width == len(LAYOUTS[len(bounds)].names)
    return "data" if is_data else None


def _bounds(line: bytes) -> list[float] | None:
    """Number of grains, time, low and high corner in 2D or 3D; None if it is no such line."""
    words = line.split()
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
        while line := stream.readline(HEADER_BYTES):
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


def _joined(
    path: Path, grains: GrainTable, pairs: IntArray, force: FloatArray, at_wall: IntArray
) -> JoinedContacts:
    """Contacts of two grains, with the force on the second, and how often a grain is at a wall."""
    joined = join_ids(path, grains, pairs, shared.finite_forces(path, force), walls=False)
    # the second id of a contact with a wall is one that no grain has
    none = np.full(len(at_wall), -1 if grains.id is None else grains.id.max(initial=0) + 1)
    walls = join_ids(path, grains, np.column_stack([at_wall, none]), None, walls=True)
    return joined._replace(wall_contacts=walls.wall_contacts)


def _read_restart(path: Path, data: bytes, options: ReadOptions) -> GrainTable:
    """The particles, and the interactions, whose force acts on the first grain."""
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    particles, interactions = (_section(path, data, one) for one in (b"Particles", b"Interactions"))
    if particles is None:
        raise ReadError(f"{path}: expected a line 'Particles N', found none")
    is_old = bool(particles) and OLD_SPHERE.match(particles[0]) is not None
    if is_old:
        x, y, z, radius = _numbers(path, particles, OLD_SPHERE, "spheres (TSP BP)").T
        id, species = np.arange(len(x)), np.zeros(len(x))
    else:
        id, species, x, y, z, radius = _numbers(path, particles, SPHERE, "spheres").T
    columns = {"id": id, "species": species, "x": x, "y": y, "z": z, "radius": radius}
    told = options.cell is not None or options.beside is not None
    grains = grain_table(path, columns, None if told else _cell(path, data), options)
    if interactions is None:
        if is_old or not particles:
            return grains
        raise ReadError(f"{path}: expected a line 'Interactions N': the file is incomplete")
    walls = [row for row in interactions if b" particleWallIds " in row]
    between = [row for row in interactions if b" particleWallIds " not in row]
    values = _numbers(path, between, PAIR, "interactions of particleIds with a force")
    pairs = np.column_stack([whole_numbers(path, values[:, end]) for end in (0, 1)])
    at_wall = whole_numbers(path, _numbers(path, walls, AT_WALL, "particleWallIds")[:, 0])
    joined = _joined(path, grains, pairs, -values[:, 2:], at_wall)
    return grains._replace(contacts=joined.contacts, wall_contacts=joined.wall_contacts)


def _section(path: Path, data: bytes, name: bytes) -> list[bytes] | None:
    """The rows below the line that counts them."""
    head = re.search(rb"^" + name + rb"[ \t]+(\S+)[ \t]*\r?\n", data, re.MULTILINE)
    if head is None:
        return None
    if not re.fullmatch(rb"\d{1,12}", head[1]):
        raise ReadError(f"{path}: expected a number of {name.decode()}, found {spelt(head[1])}")
    count = int(head[1])
    *rows, behind = data[head.end() :].split(b"\n", count)
    is_more = rows and behind.split(b" ", 1)[0] == rows[-1].split(b" ", 1)[0]
    if len(rows) < count or is_more:
        found = f"more: {spelt(behind)}" if is_more else f"{len(rows)}: the file is incomplete"
        raise ReadError(f"{path}: expected {count} {name.decode()}, found {found}")
    return rows


def _numbers(
    path: Path, rows: Sequence[bytes], pattern: re.Pattern[bytes], what: str
) -> FloatArray:
    """The numbers that stand in the groups of a pattern, shape (rows, groups)."""
    found = []
    for row in rows:
        match = pattern.match(row)
        if match is None:
            raise ReadError(f"{path}: expected {what}, found {spelt(row)}")
        words = b" ".join(match.groups())
        found.append(numbers(f"{path}: {what} in {spelt(row)}", words, pattern.groups))
    return np.reshape(np.array(found, dtype=np.float64), (-1, pattern.groups))


def _cell(path: Path, data: bytes) -> Cell | None:
    """The domain, with the shift of each periodic boundary as the edge along its normal."""
    where = f"{path}: its domain and periodic boundaries make no cell"
    domain = DOMAIN.search(data)
    bounds = numbers(f"{where}: xMin xMax ...", b" ".join(domain.groups()) if domain else b"", 6)
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    vectors, normals, offsets = np.diag(high - low), np.eye(3), low
    rows = _section(path, data, b"Boundaries") or []
    for row in rows:
        name = row.split(b" ", 1)[0]
        if name != b"PeriodicBoundary" and OTHER_PERIODS.match(name):
            raise ReadError(
                f"{path}: a {spelt(name)} repeats in a way that is not read: name the cell with "
                f"`cell=(LX, LY, LZ)`"
            )
    periodic = np.zeros(3, dtype=bool)
    periods = [row for row in rows if row.startswith(b"PeriodicBoundary ")]
    for period in _numbers(path, periods, PERIOD, "normal, distanceLeft and shift"):
        axis = int(np.argmax(np.abs(period[:3])))
        if periodic[axis]:
            raise ReadError(f"{path}: two periodic boundaries along the axis {'xyz'[axis]}")
        periodic[axis] = True
        normals[axis], offsets[axis], vectors[axis] = period[:3], period[3], period[4:]
    # a domain may be flat where nothing repeats: any thickness will do
    flat = np.flatnonzero(~periodic & (vectors.diagonal() <= 0) & periodic.any())
    vectors[flat, flat] = np.abs(vectors).max()
    try:
        origin = np.linalg.solve(normals, offsets)
    except np.linalg.LinAlgError as error:
        raise ReadError(f"{where}: {error}") from None
    return shared.cell_of(where, vectors, periodic, origin)
