"""LF_DEM: ``par_*.dat`` with grains and ``int_*.dat`` with pairs, sheared by Lees and Edwards."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from scanfab.base.errors import PackingError, ReadError, ScanfabWarning
from scanfab.base.typing import FloatArray
from scanfab.io.files import first_bytes, plain
from scanfab.io.formats.columns import grain_table
from scanfab.io.formats.join import join_ids
from scanfab.io.parse.counted_rows import counted_rows, leave_out_last, spelt, text_of
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.unpacking import check_lines
from scanfab.packing.cell import Cell

HEAD = re.compile(rb"\A(?:\xef\xbb\xbf)?# LF_DEM version")
# what a column holds, or a range of them
LEGEND = re.compile(rb"^#(\d{1,3})(?:-(\d{1,3}))?:[ \t]*([^\r\n]*)", re.MULTILINE)
# above each frame: strain, shear displacement, rate and more
FRAME = re.compile(rb"^#[ \t]+([-+\d.eE]+)[ \t]+([-+\d.eE]+)[ \t]+[-+\d.eE]+[^\r\n]*\r?\n")
COUNT, *EDGES = (
    re.compile(rb"^#[ \t]+" + name + rb"[ \t]+(\S+)", re.MULTILINE)
    for name in (b"np", b"Lx", b"Ly", b"Lz")
)
HEADER_BYTES = 1 << 16
NORMAL = "normal vector, oriented from particle 1 to particle 2"
PUSH = "norm of the normal part of the contact force"
TANGENTIAL = "tangential part of the contact force"
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
        """By the first column of the legend."""
        head = first_bytes(path, HEADER_BYTES)
        if HEAD.match(head) is None:
            return "other"
        legend = _legend(head)
        if "particle 1 label" in legend:
            return "contacts"
        return "grains" if {"particle index", "radius"} <= legend.keys() else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One behind the other; their time is the strain."""
        head = first_bytes(path, HEADER_BYTES)
        found: list[tuple[int, float]] = []
        check_lines(path, plain(path))
        end, rows = b"", 0
        with open(plain(path), "rb") as stream:
            place = 0
            for line in stream:
                match = FRAME.match(line)
                if match is not None:
                    found.append((place, float(_number(path, match[1]))))
                    rows = 0
                # other lines above the frames, and blank ones, are no rows
                rows += not line.startswith(b"#") and not line.isspace()
                place += len(line)
                end = line
        if not found:
            raise ReadError(f"{path}: expected lines '# strain shear_disp rate', found none")
        lack = "" if end.endswith(b"\n") else "its last line has no end"
        if self.kind(path) == "grains":
            count = _particles(path, head)
            lack = lack or (f"{rows} rows of {count}" if rows < count else "")
        if lack:
            leave_out_last(path, len(found) - 1, lack)
            place = found.pop()[0]
        stops = [start for start, _ in found[1:]] + [place]
        return [
            Snapshot(path, time=strain, start=start, stop=stop)
            for (start, strain), stop in zip(found, stops, strict=True)
        ]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by the legend; the images above and below are shifted along x."""
        path = snapshot.path
        head = first_bytes(path, HEADER_BYTES)
        values, legend, shift = _rows(snapshot, head, _particles(path, head))
        place = legend.get("position (x, y, z)", range(0))
        if not {"particle index", "radius"} <= legend.keys() or len(place) != 3:
            raise ReadError(
                f"{path}: expected columns of the particle index, the radius and the position "
                f"(x, y, z), found {', '.join(legend)}"
            )
        columns = {"position": values[:, place.start : place.stop]}
        names = {"particle index": "id"}
        for name, where in legend.items():
            if where is not place:
                own = values[:, where.start : where.stop]
                columns[names.get(name, name)] = own[:, 0] if len(where) == 1 else own
        return grain_table(path, columns, _cell(path, head, shift), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        The pairs whose contact state is above zero.

        All others are near enough for lubrication, and do not touch. Forces are those of contact
        alone, without lubrication and repulsion.
        """
        path = snapshot.path
        head = first_bytes(path, HEADER_BYTES)
        values, legend, _ = _rows(snapshot, head, None)
        state = next((where for name, where in legend.items() if "contact state" in name), None)
        both = [legend.get(f"particle {number} label") for number in (1, 2)]
        if state is None or None in both:
            raise ReadError(f"{path}: expected two labels and the contact state in the legend")
        touching = values[values[:, state.start] > 0]
        ids = np.column_stack([touching[:, where.start] for where in both if where is not None])
        if not (np.all(ids == np.rint(ids)) and np.all(np.abs(ids) < 2.0**53)):
            raise ReadError(f"{path}: expected whole numbers as labels of particles")
        force = _contact_forces(path, legend, touching)
        return join_ids(path, grains, ids.astype(np.int64), force, walls=False)


@np.errstate(over="ignore", invalid="ignore")
def _contact_forces(
    path: Path, legend: dict[str, range], touching: FloatArray
) -> FloatArray | None:
    """
    The forces on particle 2 of each pair, shape (M, 3); None if the legend lacks a part of them.

    In the program's source contact forces act on particle 1. There a push is against the normal,
    which points to particle 2; the file has it as a number, and the tangential part as it is.
    """
    places = [legend.get(name, range(0)) for name in (NORMAL, PUSH, TANGENTIAL)]
    if [len(where) for where in places] != [3, 1, 3]:
        return None
    normal, push, tangential = (touching[:, where.start : where.stop] for where in places)
    force: FloatArray = push * normal - tangential
    if not np.all(np.isfinite(force)):
        raise ReadError(f"{path}: expected finite numbers as contact forces and normals")
    if len(force) and OF_SIGNED_PUSH not in legend and np.all(push >= 0):
        warnings.warn(
            f"{path}: versions of LF_DEM of August 2016 and later write normal contact forces "
            f"without their sign: where the dashpot pulls two grains together, its force is taken "
            f"for a push",
            ScanfabWarning,
            stacklevel=2,
        )
    return force


def _legend(head: bytes) -> dict[str, range]:
    """The columns of each name, from 0."""
    found = {}
    for first, last, name in LEGEND.findall(head):
        where = range(max(int(first) - 1, 0), int(last or first))
        if len(where):
            found[name.decode("utf-8", "replace").strip()] = where
    return found


def _particles(path: Path, head: bytes) -> int:
    count = COUNT.search(head)
    if count is None or not re.fullmatch(rb"\d{1,15}", count[1]):
        raise ReadError(f"{path}: expected a line '# np N', found none")
    return int(count[1])


def _rows(
    snapshot: Snapshot, head: bytes, count: int | None
) -> tuple[FloatArray, dict[str, range], float]:
    """The rows of a frame, the columns of each name, and the shear displacement."""
    path, data = snapshot.path, text_of(snapshot)
    frame, legend = FRAME.match(data), _legend(head)
    width = max((where.stop for where in legend.values()), default=0)
    if frame is None or not legend:
        raise ReadError(f"{path}: expected '# strain shear_disp rate', found {spelt(data[:80])}")
    values = counted_rows(
        snapshot, data, frame.end(), len(data), count=count, widths=(width,), names="particles"
    )
    return values, legend, _number(path, frame[2])


def _number(path: Path, word: bytes) -> float:
    try:
        return float(word)
    except ValueError:
        raise ReadError(f"{path}: expected a number, found {spelt(word)}") from None


def _cell(path: Path, head: bytes, shift: float) -> Cell:
    """About the origin; a plane (Ly = 0) does not repeat across."""
    found = [pattern.search(head) for pattern in EDGES]
    edges = [_number(path, one[1]) for one in found if one is not None]
    if len(edges) != 3:
        raise ReadError(f"{path}: expected lines '# Lx', '# Ly' and '# Lz' with numbers")
    flat = edges[1] == 0.0
    vectors = np.diag([edges[0], edges[2] if flat else edges[1], edges[2]])
    vectors[2, 0] = shift
    try:
        return Cell(vectors, (True, not flat, True), -0.5 * vectors.sum(axis=0))
    except PackingError as error:
        raise ReadError(
            f"{path}: its lines Lx, Ly, Lz and the shear make no cell: {error}"
        ) from None
