"""ESyS-Particle: a snapshot is a header file (``snap_t=K_0.txt``) and a file for each worker."""

from __future__ import annotations

import re
from itertools import takewhile
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.files import file_inside, first_bytes
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbers
from scanfab.io.mesh import joined_arrays
from scanfab.io.reader import Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

# version of the layout (2 or 3), number of steps, time step, step, box, names of the files
HEADER = re.compile(
    rb"V\s+[23]\s+\d{1,18}\s+([-+.\deE]+)\s+(\d{1,18})\s+(?:ESyS|LSM)[^\n]*\n"
    rb"\s*BoundingBox\s+((?:[-+.\deEnaif]+\s+){6})PeriodicBoundaries\s+([01])\s+([01])\s+([01])\s+"
    rb"Dimension\s+([23])[dD]\s+(.*)\Z",
    re.DOTALL,
)
# centre, radius, id, tag, mass, initial and last centre, velocity, force, shift through the box
BASIC = "x y z radius id tag mass x0 y0 z0 xo yo zo vx vy vz fx fy fz sx sy sz"
TURNS = "q0 q1 q2 q3 wx wy wz"
# snapshots and checkpoints, without and with rotation; they differ in the number of columns
TITLES = (BASIC, f"{BASIC} {TURNS}", f"{BASIC} is_dynamic", f"{BASIC} is_dynamic i {TURNS} is_rot")
LAYOUTS = {len(row.split()): Layout(tuple(row.split()), line=2, whole=["id"]) for row in TITLES}
# the name of a worker's file, and its first line, the number of particles
PART = re.compile(r"(.*_t=\d+_)[1-9]\d*(\.\w+)")
COUNT = re.compile(rb"[ \t]*(\d{1,15})[ \t]*\r?\n")
LONGEST = 1 << 20


class EsysReader(GrainsOnly):
    """Reader plugin for ESyS-Particle's snapshots."""

    name = "esys"
    description = "ESyS-Particle snapshots: the header *_0.txt, with the files that it names"
    extensions: tuple[str, ...] = (".txt",)

    def recognises(self, path: Path) -> bool:
        """Recognised by the header; one byte is checked first, because a header may be long."""
        return first_bytes(path, 2)[:1] == b"V" and bool(HEADER.match(first_bytes(path, LONGEST)))

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The only snapshot, with step and time from the header."""
        head = _header(path)
        step = int(head[2])
        return [Snapshot(path, step, step * numbers(f"{path}: step length", head[1], 1)[0])]

    def beside(self, path: Path) -> list[Path]:
        """The files of the workers; their names differ from the header's in the last number."""
        stem, suffix = re.escape(path.stem[:-1]), re.escape(path.suffix)
        pattern = re.compile(rf"{stem}[1-9]\d*{suffix}")
        return sorted(file for file in path.parent.iterdir() if pattern.fullmatch(file.name))

    def listed_by(self, path: Path) -> Path | None:
        """The header that belongs to a worker's file, by its name."""
        match = PART.fullmatch(path.name)
        return None if match is None else path.with_name(f"{match[1]}0{match[2]}")

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The particles of all workers, one worker after the other."""
        path, head = snapshot.path, _header(snapshot.path)
        # the header has absolute paths from the run; the files are in the folder of the header
        names = [word.decode("utf-8", "replace").replace("\\", "/") for word in head[8].split()]
        files = [file_inside(path, name.rpartition("/")[2]) for name in names]
        # the last name has no line end, so a header that was cut off after any name looks complete
        lost = {file.name for file in self.beside(path)} - {file.name for file in files}
        if lost or not files or len(set(files)) < len(files):
            problem = f"found {names}, and {len(lost)} other files: it is cut or of another run"
            raise ReadError(f"{path}: expected the name of each worker's file once, {problem}")
        columns = joined_arrays([_particles(file) for file in files])
        low, high = np.reshape(numbers(f"{path}: BoundingBox", head[3], 6), (2, 3))
        # a 2D sample is not periodic along z, whatever the header says
        along = [flag == b"1" for flag in head.group(4, 5, 6)]
        along[2] &= head[7] == b"3" or bool(low[2] < high[2])
        return columns, cell_of(f"{path}: BoundingBox", high - low, along, low)


def _header(path: Path) -> re.Match[bytes]:
    head = HEADER.match(first_bytes(path, LONGEST))
    if head is None:
        raise ReadError(f"{path}: expected a header of ESyS-Particle: V 3, the box, names of files")
    return head


def _particles(file: Path) -> Columns:
    """The first block of a worker's file: a count and as many rows. Bonds follow, not read."""
    data = text_of(Snapshot(file))
    head = COUNT.match(data)
    if head is None:
        raise ReadError(f"{file}: expected the number of particles, found {spelt(data[:80])}")
    lines = data[head.end() :].split(b"\n")
    particles = [*takewhile(lambda line: len(line.split()) in LAYOUTS, lines)]
    layout = LAYOUTS[len(particles[0].split()) if particles else len(BASIC.split())]
    # add a line end to the last row only if the file goes on behind it
    rows = b"\n".join([*particles, *[b""] * (len(particles) < len(lines))])
    return read_rows(Snapshot(file), rows, layout, count=int(head[1]), what="particles")
