"""ESyS-Particle: a snapshot's header (``snap_t=K_0.txt``) and the files of its workers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import file_inside, first_bytes
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.counted_rows import counted_rows, spelt, text_of
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

# version of the layout; steps in all, length of a step, step; then the box in words
HEADER = re.compile(
    rb"\A(?:\xef\xbb\xbf)?V\s+(\d{1,3})\s+(\d{1,18})\s+([-+.\deE]+)\s+(\d{1,18})\s+(?:ESyS|LSM)[^\n]*\n"
    rb"\s*BoundingBox\s+((?:[-+.\deEnaif]+\s+){6})PeriodicBoundaries\s+([01])\s+([01])\s+([01])\s+"
    rb"Dimension\s+([23])[dD]\s+(.*)\Z",
    re.DOTALL,
)
BEGINNING = re.compile(rb"(?:\xef\xbb\xbf)?V\s")
# centre, radius, id, tag, mass; first and last centre, velocity, force, shift through the box
FIRST_WORDS = "x y z radius id tag mass x0 y0 z0 xo yo zo vx vy vz fx fy fz sx sy sz"
BASIC = tuple(FIRST_WORDS.split())
ROTATING = ("q0", "q1", "q2", "q3", "wx", "wy", "wz")
# snapshots and checkpoints, without and with rotation
LAYOUTS = {
    len(names): names
    for names in (
        BASIC,
        (*BASIC, *ROTATING),
        (*BASIC, "is_dynamic"),
        (*BASIC, "is_dynamic", "inertia", *ROTATING, "is_rot"),
    )
}
# the name of a worker's file
PART = re.compile(r"(.*_t=\d+_)[1-9]\d*(\.\w+)")
WORKER = re.compile(rb"\A(?:\xef\xbb\xbf)?\s*(\d{1,15})[ \t]*\r?\n")
VERSIONS = (b"2", b"3")
LONGEST = 1 << 20


class EsysReader:
    """Reader plugin for ESyS-Particle's snapshots."""

    name = "esys"
    description = "ESyS-Particle snapshots: the header *_0.txt, with the files that it names"
    extensions: tuple[str, ...] = (".txt",)

    def recognises(self, path: Path) -> bool:
        """By the first words of a header."""
        # a header may be long, but few files begin as one does
        begins = BEGINNING.match(first_bytes(path)) is not None
        return begins and HEADER.match(first_bytes(path, LONGEST)) is not None

    def kind(self, path: Path) -> FileKind:
        """Headers list the files of a frame."""
        return "grains" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, at its step."""
        head = _header(path)
        step, length = int(head[4]), _numbers(path, head[3])[0]
        return [Snapshot(path, step, step * length)]

    def beside(self, path: Path) -> list[Path]:
        """The files of the workers, called like their header but for the last number."""
        match = re.fullmatch(r"(.*_)0(\.\w+)", path.name)
        if match is None:
            return []
        pattern = re.compile(re.escape(match[1]) + r"[1-9]\d*" + re.escape(match[2]))
        return sorted(one for one in path.parent.iterdir() if pattern.fullmatch(one.name))

    def listed_by(self, path: Path) -> Path | None:
        """The header of a worker's file."""
        match = PART.fullmatch(path.name)
        return None if match is None else path.with_name(f"{match[1]}0{match[2]}")

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The particles of all workers, one behind the other."""
        path, head = snapshot.path, _header(snapshot.path)
        if head[1] not in VERSIONS:
            raise ReadError(f"{path}: expected version 2 or 3, found {head[1].decode()}")
        # absolute names where the run was: the files lie beside their header
        names = [word.decode("utf-8", "replace").replace("\\", "/") for word in head[10].split()]
        files = [file_inside(path, name.rpartition("/")[2]) for name in names]
        if not files or len(set(files)) < len(files):
            raise ReadError(f"{path}: expected the names of its workers' files, found {names}")
        parts = [_particles(file) for file in files]
        widths = {part.shape[1] for part in parts}
        if len(widths) > 1:
            raise ReadError(f"{path}: its files have {sorted(widths)} columns of particles")
        table = np.concatenate(parts)
        columns = dict(zip(LAYOUTS[table.shape[1]], table.T, strict=True))
        return grain_table(path, columns, _cell(path, head), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It lists bonds, which need not touch."""
        raise ReadError(f"{snapshot.path}: ESyS-Particle's snapshots hold bonds, but no contacts")


def _header(path: Path) -> re.Match[bytes]:
    head = HEADER.match(first_bytes(path, LONGEST))
    if head is None:
        raise ReadError(f"{path}: expected a header of ESyS-Particle: V 3, the box, names of files")
    return head


def _particles(file: Path) -> FloatArray:
    """The first block of a worker's file: how many, and their rows; bonds follow."""
    snapshot = Snapshot(file)
    data = text_of(snapshot)
    count = WORKER.match(data)
    if count is None:
        raise ReadError(f"{file}: expected the number of particles, found {spelt(data[:80])}")
    end = count.end()
    for _ in range(min(int(count[1]), len(data))):
        end = data.find(b"\n", end) + 1
        if end == 0:
            raise ReadError(f"{file}: expected {int(count[1])} particles: the file is incomplete")
    return counted_rows(
        snapshot,
        data,
        count.end(),
        end,
        count=int(count[1]),
        widths=tuple(LAYOUTS),
        names="particles",
    )


def _numbers(path: Path, words: bytes) -> list[float]:
    try:
        return [float(word) for word in words.split()]
    except ValueError:
        raise ReadError(f"{path}: expected numbers, found {spelt(words)}") from None


def _cell(path: Path, head: re.Match[bytes]) -> Cell | None:
    bounds = _numbers(path, head[5])
    low, high = np.array(bounds[:3]), np.array(bounds[3:])
    along = [one == b"1" for one in head.group(6, 7, 8)]
    edges = high - low
    if head[9] == b"2" and edges[2] <= 0:
        # a plane repeats in itself only
        along[2], edges[2] = False, float(max(edges[0], edges[1]))
    try:
        return Cell(edges, (along[0], along[1], along[2]), low)
    except PackingError as error:
        if not any(along):
            return None
        raise ReadError(f"{path}: BoundingBox: {error}") from None
