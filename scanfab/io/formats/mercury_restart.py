"""MercuryDPM's ``.restart``: words and numbers in rows, with contacts and periodic boundaries."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.formats.shared import cell_of, finite_forces, numbers
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Columns, spelt, text_of
from scanfab.packing.cell import Cell

HEAD = re.compile(rb"\A(?:\xef\xbb\xbf)?(?:restart_version|MercuryDPM)[ \t]+[\d.]+")
TIME = re.compile(
    rb"^(?:timeStep|dt)[ \t]+\S+[ \t]+(?:time|t)[ \t]+([-+\d.]+(?:[eE][-+]?\d+)?)\s", re.MULTILINE
)
DOMAIN = re.compile(
    rb"^xmin (\S+) xmax (\S+) ymin (\S+) ymax (\S+) zmin (\S+) zmax (\S+)",
    re.MULTILINE | re.IGNORECASE,
)
# spheres in words, and as versions 2 and 3 have them: centre, velocity and radius behind two words
SPHERE, OLD_SPHERE = re.compile(rb"\w*Particle "), b"TSP BP "
# particles that are no spheres, or hold them
NO_SPHERES = re.compile(rb"SuperQuadric|NonSpherical|Clump|MultiParticle")
# boundaries that repeat in another way than by a shift
OTHER_PERIODS = re.compile(rb"LeesEdwards|Periodic|Maser|StressStrain|Circular")


def is_restart(head: bytes) -> bool:
    """Whether a file starts as a restart does."""
    return HEAD.match(head) is not None


def time_of_restart(head: bytes) -> float | None:
    """The time in its header."""
    found = TIME.search(head)
    return None if found is None else numbers("time", found[1], 1)[0]


def read_restart(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    The particles by the words in their rows, and the interactions that are listed.

    Raises
    ------
    ReadError
        If a section has not as many rows as it says, or a particle is no sphere.
    """
    path, data = snapshot.path, text_of(snapshot)
    if not data.endswith(b"\n"):
        raise ReadError(f"{path}: the last line has no end: the file is incomplete")
    particles = _section(path, data, b"Particles")
    if particles is None:
        raise ReadError(f"{path}: expected a line 'Particles N', found none")
    told = options.cell is not None or options.beside is not None
    cell = None if told else _cell(path, data)
    grains = grain_table(path, _columns(path, particles), cell, options)
    interactions = _section(path, data, b"Interactions")
    if interactions is not None:
        return _with_contacts(path, grains, interactions)
    if particles and not particles[0].startswith(OLD_SPHERE):
        raise ReadError(f"{path}: expected a line 'Interactions N': the file is incomplete")
    return grains


def _section(path: Path, data: bytes, name: bytes) -> list[bytes] | None:
    """The rows below the line that counts them."""
    head = re.search(rb"^" + name + rb"[ \t]+(\S+)[ \t]*\r?\n", data, re.MULTILINE)
    if head is None:
        return None
    if not re.fullmatch(rb"\d{1,12}", head[1]):
        raise ReadError(f"{path}: expected a number of {name.decode()}, found {spelt(head[1])}")
    count = int(head[1])
    *rows, behind = data[head.end() :].split(b"\n", count)
    if len(rows) < count:
        raise ReadError(
            f"{path}: expected {count} {name.decode()}, found {len(rows)}: the file is incomplete"
        )
    if rows and behind.split(b" ", 1)[0] == rows[-1].split(b" ", 1)[0]:
        raise ReadError(f"{path}: expected {count} {name.decode()}, found more: {spelt(behind)}")
    return [row.strip() for row in rows]


def _behind(path: Path, row: bytes, word: bytes, count: int) -> list[float]:
    """The numbers behind a word of a row."""
    _, found, rest = row.partition(b" " + word + b" ")
    where = f"{path}: {word.decode()} in {spelt(row)}"
    return numbers(where, b" ".join(rest.split(None, count)[:count]) if found else b"", count)


def _columns(path: Path, rows: list[bytes]) -> Columns:
    """Centres, radii, ids and species; rows of old versions have no words."""
    values = []
    for number, row in enumerate(rows):
        if row.startswith(OLD_SPHERE):
            old = numbers(f"{path}: {spelt(row)}", b" ".join(row.split()[2:9]), 7)
            values.append([number, 0.0, *old[:3], old[6]])
            continue
        if SPHERE.match(row) is None or NO_SPHERES.match(row) is not None:
            raise ReadError(f"{path}: expected spheres, found {spelt(row[:60])}")
        columns = ((b"id", 1), (b"indSpecies", 1), (b"position", 3), (b"radius", 1))
        values.append([one for word, size in columns for one in _behind(path, row, word, size)])
    table = np.array(values, dtype=np.float64).reshape(-1, 6)
    return dict(zip(("id", "species", "x", "y", "z", "radius"), table.T, strict=True))


def _with_contacts(path: Path, grains: GrainTable, rows: list[bytes]) -> GrainTable:
    """With the interactions, whose force acts on the first grain."""
    ids, force, walls = [], [], []
    for row in rows:
        if b" particleWallIds " in row:
            walls.append(_behind(path, row, b"particleWallIds", 2)[0])
            continue
        ids.append(_behind(path, row, b"particleIds", 2))
        force.append(_behind(path, row, b"force", 3))
    pairs = np.column_stack([whole_numbers(path, one) for one in np.reshape(ids, (-1, 2)).T])
    twice = pairs[:, 0] == pairs[:, 1]
    if twice.any():
        raise ReadError(f"{path}: an interaction names the grain {pairs[twice][0, 0]} twice")
    forces = finite_forces(path, -np.reshape(np.array(force, np.float64), (-1, 3)))
    joined = join_ids(path, grains, pairs, forces, walls=False)
    # walls have numbers of their own: the second id is one that no grain has
    assert grains.id is not None
    touching = whole_numbers(path, np.array(walls, np.float64))
    none = np.full(len(touching), grains.id.max(initial=0) + 1)
    of_walls = join_ids(path, grains, np.column_stack([touching, none]), None, walls=True)
    return grains._replace(contacts=joined.contacts, wall_contacts=of_walls.wall_contacts)


def _cell(path: Path, data: bytes) -> Cell | None:
    """The domain, with the shift of each periodic boundary as the edge along its normal."""
    domain = DOMAIN.search(data)
    where = f"{path}: its domain and periodic boundaries make no cell"
    bounds = numbers(f"{where}: xMin xMax ...", b" ".join(domain.groups()) if domain else b"", 6)
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    vectors, normals, offsets = np.diag(high - low), np.eye(3), low
    periodic = np.zeros(3, dtype=bool)
    for row in _section(path, data, b"Boundaries") or []:
        name = row.split(b" ", 1)[0]
        if name != b"PeriodicBoundary":
            if OTHER_PERIODS.search(name):
                raise ReadError(
                    f"{path}: a {name.decode('utf-8', 'replace')} repeats in a way that is not "
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
    # a domain may be flat where nothing repeats: any thickness will do
    flat = np.flatnonzero(~periodic & (vectors.diagonal() <= 0) & periodic.any())
    vectors[flat, flat] = np.abs(vectors).max()
    try:
        origin = np.linalg.solve(normals, offsets)
    except np.linalg.LinAlgError as error:
        raise ReadError(f"{where}: {error}") from None
    return cell_of(where, vectors, periodic, origin)
