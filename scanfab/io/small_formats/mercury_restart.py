"""MercuryDPM's ``.restart``: words and numbers in rows, with contacts and periodic boundaries."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import plain
from scanfab.io.formats.columns import grain_table
from scanfab.io.formats.join import join_ids
from scanfab.io.parse.counted_rows import spelt, text_of
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

HEAD = re.compile(rb"\A(?:\xef\xbb\xbf)?(?:restart_version|MercuryDPM)[ \t]+[\d.]+")
SECTION = re.compile(rb"^(Particles|Interactions|Boundaries|Walls)[ \t]+(\d{1,12})[ \t]*\r?$")
TIME = re.compile(rb"^(?:timeStep|dt)[ \t]+\S+[ \t]+(?:time|t)[ \t]+(\S+)", re.MULTILINE)
DOMAIN = re.compile(rb"^[xX][mM]in[ \t]+(.*)$", re.MULTILINE)
# particles that are no spheres, or hold them
NO_SPHERES = re.compile(rb"SuperQuadric|NonSpherical|Clump|MultiParticle")
# boundaries that repeat in another way than by a shift
OTHER_PERIODS = re.compile(rb"LeesEdwards|Periodic|Maser|StressStrain|Circular")

Rows = list[list[bytes]]


def is_restart(head: bytes) -> bool:
    """Whether a file starts as a restart does."""
    return HEAD.match(head) is not None


def time_of_restart(path: Path) -> float | None:
    """The time in its header."""
    with open(plain(path), "rb") as stream:
        found = TIME.search(stream.read(1 << 16))
    try:
        return None if found is None else float(found[1])
    except ValueError:
        return None


def read_restart(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    The particles by the words in their rows, and the interactions that are listed.

    Raises
    ------
    ReadError
        If a section has not as many rows as it says, or a particle is no sphere.
    """
    path = snapshot.path
    data = text_of(snapshot)
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    sections = _sections(path, data)
    if "Particles" not in sections:
        raise ReadError(f"{path}: expected a line 'Particles N', found none")
    columns = _particles(path, sections["Particles"])
    told = options.cell is not None or options.beside is not None
    cell = None if told else _cell(path, data, sections.get("Boundaries", []))
    grains = grain_table(path, columns, cell, options)
    return _with_contacts(path, grains, sections.get("Interactions"))


def _sections(path: Path, data: bytes) -> dict[str, Rows]:
    """Words of the rows below each line that counts them."""
    lines = iter(data.splitlines())
    found: dict[str, Rows] = {}
    for line in lines:
        head = SECTION.match(line)
        if head is None:
            continue
        name, count = head[1].decode(), int(head[2])
        rows: Rows = []
        while len(rows) < count:
            row = next(lines, None)
            if row is None:
                raise ReadError(
                    f"{path}: expected {count} {name}, found {len(rows)}: the file is incomplete"
                )
            if row.strip():
                rows.append(row.split())
        found[name] = rows
    return found


def _numbers(path: Path, row: Sequence[bytes], start: int, count: int) -> list[float]:
    words = row[start : start + count]
    try:
        if len(words) < count or any(b"_" in word for word in words):
            raise ValueError
        return [float(word) for word in words]
    except ValueError:
        raise ReadError(
            f"{path}: expected {count} numbers in {spelt(b' '.join(row[:3]))}, found "
            f"{spelt(b' '.join(words))}"
        ) from None


def _behind(path: Path, row: list[bytes], word: bytes, count: int) -> list[float]:
    """The numbers behind a word."""
    if word not in row:
        raise ReadError(f"{path}: expected {word.decode()!r} in {spelt(b' '.join(row))}")
    return _numbers(path, row, row.index(word) + 1, count)


def _particles(path: Path, rows: Rows) -> dict[str, npt.NDArray[np.float64]]:
    """Centres, radii, ids and species; rows of old versions have no words."""
    values = []
    for number, row in enumerate(rows):
        if NO_SPHERES.search(row[0]) or not (
            row[:2] == [b"TSP", b"BP"] or row[0].endswith(b"Particle")
        ):
            raise ReadError(
                f"{path}: expected spheres, found a {row[0].decode('utf-8', 'replace')}"
            )
        if row[0] == b"TSP":
            # centre, velocity, radius
            numbers = _numbers(path, row, 2, 7)
            values.append([number, 0.0, *numbers[:3], numbers[6]])
            continue
        id, species = _behind(path, row, b"id", 1), _behind(path, row, b"indSpecies", 1)
        place, radius = _behind(path, row, b"position", 3), _behind(path, row, b"radius", 1)
        values.append([*id, *species, *place, *radius])
    table = np.array(values, dtype=np.float64).reshape(-1, 6)
    return dict(zip(("id", "species", "x", "y", "z", "radius"), table.T, strict=True))


def _with_contacts(path: Path, grains: GrainTable, rows: Rows | None) -> GrainTable:
    """With the interactions, whose force acts on the first grain; old versions list none."""
    if rows is None:
        return grains
    ids, force, walls = [], [], []
    for row in rows:
        if b"particleWallIds" in row:
            walls.append(_behind(path, row, b"particleWallIds", 1) * 2)
            continue
        ids.append(_behind(path, row, b"particleIds", 2))
        force.append(_behind(path, row, b"force", 3))
    pairs = _whole(path, ids)
    twice = pairs[:, 0] == pairs[:, 1]
    if twice.any():
        raise ReadError(f"{path}: an interaction names the grain {pairs[twice][0, 0]} twice")
    forces = -np.array(force, dtype=np.float64).reshape(-1, 3)
    if not np.all(np.isfinite(forces)):
        raise ReadError(f"{path}: expected finite numbers as forces of interactions")
    joined = join_ids(path, grains, pairs, forces, walls=False)
    # a wall's own number is none of a grain: the second id is one that no grain has
    touching = _whole(path, walls)
    assert grains.id is not None
    touching[:, 1] = grains.id.max(initial=0) + 1
    of_walls = join_ids(path, grains, touching, None, walls=True).wall_contacts
    return grains._replace(contacts=joined.contacts, wall_contacts=of_walls)


def _whole(path: Path, ids: list[list[float]]) -> npt.NDArray[np.int64]:
    numbers = np.array(ids, dtype=np.float64).reshape(-1, 2)
    if not (np.all(numbers == np.rint(numbers)) and np.all(np.abs(numbers) < 2.0**53)):
        raise ReadError(f"{path}: expected whole numbers as ids of an interaction")
    return numbers.astype(np.int64)


def _cell(path: Path, data: bytes, boundaries: Rows) -> Cell | None:
    """
    The domain, with the shift of each periodic boundary in the place of the edge along its normal.

    Raises
    ------
    ReadError
        If something repeats in another way.
    """
    domain = DOMAIN.search(data)
    words = domain[1].split() if domain else []
    bounds = _numbers(path, words, 0, 1) + [
        _numbers(path, words, place, 1)[0] for place in (2, 4, 6, 8, 10)
    ]
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    vectors, normals, offsets = np.diag(high - low), np.eye(3), low
    periodic = [False, False, False]
    for row in boundaries:
        if row[0] != b"PeriodicBoundary":
            if OTHER_PERIODS.search(row[0]):
                raise ReadError(
                    f"{path}: a {row[0].decode('utf-8', 'replace')} repeats in a way that is not "
                    f"read: name the cell with `cell=(LX, LY, LZ)`"
                )
            continue
        normal = np.array(_behind(path, row, b"normal", 3))
        left = b"position_left" if b"position_left" in row else b"distanceLeft"
        axis = int(np.argmax(np.abs(normal)))
        if periodic[axis]:
            raise ReadError(f"{path}: two periodic boundaries along the axis {'xyz'[axis]}")
        periodic[axis] = True
        vectors[axis] = _behind(path, row, b"shift", 3)
        normals[axis], offsets[axis] = normal, _behind(path, row, left, 1)[0]
    try:
        if not any(periodic) and np.any(high <= low):
            return None
        vectors = _with_thickness(vectors, periodic)
        origin: FloatArray = np.linalg.solve(normals, offsets)
        return Cell(vectors, (periodic[0], periodic[1], periodic[2]), origin)
    except (PackingError, np.linalg.LinAlgError) as error:
        raise ReadError(
            f"{path}: its domain and periodic boundaries make no cell: {error}"
        ) from None


def _with_thickness(vectors: FloatArray, periodic: list[bool]) -> FloatArray:
    """A domain may be flat where nothing repeats: any thickness will do."""
    for axis in range(3):
        if not periodic[axis] and vectors[axis, axis] <= 0:
            vectors[axis, axis] = np.abs(vectors).max()
    return vectors
