"""
MercuryDPM: grains in ``.data`` and contacts in ``.fstat``, or both in ``.restart``.

Contacts name grains by their row, from 0, and walls by numbers below 0. Each pair is listed from
both sides, unless one of them is fixed or an image in a periodic cell.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import IO

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import bare_name, first_bytes, plain
from scanfab.io.formats.columns import grain_table
from scanfab.io.formats.join import count_walls, join_ids
from scanfab.io.parse.counted_rows import counted_rows, leave_out_last, skip_rows, spelt, text_of
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.io.small_formats.mercury_restart import is_restart, read_restart, time_of_restart
from scanfab.packing.cell import Cell

PLANE = ["x", "y", "vx", "vy", "radius", "angle", "omega", "species"]
TURNS = ["q1", "q2", "q3", "wx", "wy", "wz"]
SPACE = ["x", "y", "z", "vx", "vy", "vz", "radius", *TURNS, "species"]
# by the number of words above a frame
LAYOUTS = {6: PLANE, 8: SPACE}
# time, both rows, contact point, overlaps, normal and tangential force, normal, tangent
FSTAT = "t i j x y z delta deltat fn ft nx ny nz tx ty tz"
FSTAT_WIDTH = len(FSTAT.split())
FSTAT_HEAD = re.compile(
    rb"\A(?:\xef\xbb\xbf)?#[ \t]+\S+[ \t]+[01][ \t]*\r?\n"
    rb"#(?:[ \t]+\S+){6}[ \t]*\r?\n#(?:[ \t]+\S+){6,7}[ \t]*\r?\n"
)
LONGEST = 1 << 16
# the interactions that it writes for ParaView name no grains
OF_PARAVIEW = (b'Name="Overlap"', b'Name="ContactRadius"', b'Name="TangentialOverlap"')


class MercuryReader:
    """Reader plugin for the files of MercuryDPM."""

    name = "mercurydpm"
    description = "MercuryDPM .data with contacts in .fstat, and .restart"
    extensions: tuple[str, ...] = (".data", ".fstat", ".restart")
    lists_contacts = True

    def recognises(self, path: Path) -> bool:
        """A restart by its first word, contacts by three lines, grains by a line of bounds."""
        head = first_bytes(path, LONGEST)
        if is_restart(head) or FSTAT_HEAD.match(head) is not None or _for_paraview(head):
            return True
        first, _, rest = head.partition(b"\n")
        bounds = _bounds(first)
        if bounds is None:
            return False
        count, width = int(bounds[0]), len(LAYOUTS[len(bounds)])
        if count == 0:
            following = rest.partition(b"\n")[0]
            again = _bounds(following)
            # nothing but an empty frame may be anything
            return again is not None if following.strip() else ".data" in bare_name(path)
        return len(rest.partition(b"\n")[0].split()) == width

    def kind(self, path: Path) -> FileKind:
        """Contacts are in ``.fstat`` files."""
        head = first_bytes(path, LONGEST)
        if _for_paraview(head):
            raise ReadError(
                f"{path}: MercuryDPM's interactions for ParaView do not say which grains touch: "
                f"contacts are read from .fstat or .restart"
            )
        if FSTAT_HEAD.match(head):
            return "contacts"
        return "grains" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """Frames one behind the other, with their times."""
        head = first_bytes(path)
        if is_restart(head):
            return [Snapshot(path, time=time_of_restart(path))]
        found = _contact_frames(path) if FSTAT_HEAD.match(head) else _grain_frames(path)
        if not found:
            raise ReadError(f"{path}: the file is empty")
        return found

    def carries(self, path: Path) -> Carries:
        """A restart has its periodic boundaries; the bounds in ``.data`` may repeat or not."""
        return "cell" if is_restart(first_bytes(path)) else "box"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Rows of numbers; a restart has names in its rows, and contacts."""
        path = snapshot.path
        if is_restart(first_bytes(path)):
            return read_restart(snapshot, options)
        data = text_of(snapshot)
        line = data[: max(data.find(b"\n"), 0)]
        bounds = _bounds(line)
        if bounds is None:
            raise ReadError(f"{path}: expected the number of grains, time and bounds")
        names = LAYOUTS[len(bounds)]
        values = counted_rows(
            snapshot,
            data,
            len(line) + 1,
            len(data),
            count=int(bounds[0]),
            widths=(len(names),),
            names="grains",
        )
        columns: dict[str, npt.NDArray[np.float64]] = dict(zip(names, values.T, strict=True))
        if names is PLANE:
            columns["z"] = np.zeros(len(values))
        return grain_table(path, columns, _box(bounds[2:]), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Each pair once, with its force; rows with walls are counted."""
        path = snapshot.path
        if FSTAT_HEAD.match(first_bytes(path)) is None:
            raise ReadError(f"{path}: holds grains: contacts for others are read from .fstat")
        data = text_of(snapshot)
        values = counted_rows(snapshot, data, 0, len(data), widths=(FSTAT_WIDTH,), names=FSTAT)
        ids = values[:, 1:3]
        count = len(grains.radius)
        if not (np.all(ids == np.rint(ids)) and np.all(np.abs(ids) < count + 2.0**31)):
            raise ReadError(f"{path}: expected whole numbers in the columns i and j")
        rows = ids.astype(np.int64)
        wall = rows[:, 1] < 0
        unknown = rows[(rows[:, 0] < 0) | (wall & (rows[:, 0] >= count)), 0]
        if len(unknown):
            raise ReadError(
                f"{path}: names the grain {unknown[0]}, but there are rows 0 to {count - 1}: do "
                f"both files belong to the same time?"
            )
        pairs, force = _once(rows[~wall], values[~wall])
        if not np.all(np.isfinite(force)):
            raise ReadError(f"{path}: expected finite numbers as forces and normals")
        # rows of the grain file, whatever ids these have
        numbered = grains._replace(id=np.arange(count))
        joined = join_ids(path, numbered, pairs, force, walls=False)
        return joined._replace(wall_contacts=count_walls(rows[wall, 0], count))


def _for_paraview(head: bytes) -> bool:
    return b"<VTKFile" in head and all(name in head for name in OF_PARAVIEW)


def _bounds(line: bytes) -> list[float] | None:
    """Number of grains, time, low and high corner in 2D or 3D; None if it is no such line."""
    words = line.removeprefix(b"\xef\xbb\xbf").split()
    if len(words) - 2 not in (4, 6) or not re.fullmatch(rb"[0-9]{1,15}", words[0]):
        return None
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return None
    half = len(numbers) // 2 + 1
    ordered = all(low <= high for low, high in zip(numbers[2:half], numbers[half:], strict=True))
    return numbers if ordered and numbers[1] >= 0 else None


def _grain_frames(path: Path) -> list[Snapshot]:
    found: list[Snapshot] = []
    with open(plain(path), "rb") as stream:
        start = 0
        while line := stream.readline(LONGEST):
            bounds = _bounds(line)
            if bounds is None and line.strip() and line.endswith(b"\n"):
                raise ReadError(
                    f"{path}: expected the number of grains, time and bounds at byte {start:,}, "
                    f"found {spelt(line)}"
                )
            if bounds is not None:
                count = int(bounds[0])
                rows = skip_rows(stream, count)
                if rows < count or not line.endswith(b"\n"):
                    reason = f"expected {count} grains at time {bounds[1]:g}, found {rows}"
                    leave_out_last(path, len(found), reason)
                    break
                found.append(Snapshot(path, time=bounds[1], start=start, stop=stream.tell()))
            elif line.strip():
                leave_out_last(path, len(found), f"found {spelt(line)} at its end")
            start = stream.tell()
    return found


def _contact_frames(path: Path) -> list[Snapshot]:
    """By the first of the three lines above each frame, of which it is the one of two words."""
    starts: list[tuple[int, float]] = []
    with open(plain(path), "rb") as stream:
        place = above = 0
        while line := stream.readline(LONGEST):
            if not line.startswith(b"#"):
                above = 0
            else:
                words = line[1:].split()
                if above % 3 == 0:
                    if len(words) != 2:
                        raise ReadError(f"{path}: expected '# time flag', found {spelt(line)}")
                    try:
                        starts.append((place, float(words[0])))
                    except ValueError:
                        raise ReadError(f"{path}: expected a time, found {spelt(line)}") from None
                above += 1
            place += len(line)
        if starts and not _ends_whole(stream, place):
            leave_out_last(path, len(starts) - 1, "its last line has no end")
            place = starts.pop()[0]
    stops = [start for start, _ in starts[1:]] + [place]
    return [
        Snapshot(path, time=time, start=start, stop=stop)
        for (start, time), stop in zip(starts, stops, strict=True)
    ]


def _ends_whole(stream: IO[bytes], size: int) -> bool:
    stream.seek(size - 1)
    return stream.read(1) == b"\n"


@np.errstate(over="ignore", invalid="ignore")
def _once(
    rows: npt.NDArray[np.int64], values: FloatArray
) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """
    Pairs and the force on their second grain, each once.

    The normal points from the second to the first grain, on which force and tangential force act.
    A pair that touches through two images has two normals, and is two contacts.
    """
    normal, tangent = values[:, 10:13], values[:, 13:16]
    force = -(values[:, 8:9] * normal + values[:, 9:10] * tangent)
    turned = rows[:, 0] > rows[:, 1]
    # 7 digits tell images apart, and are the same from both sides
    sides = np.round(np.where(turned[:, None], -normal, normal), 7) + 0.0
    keys = np.column_stack([np.sort(rows, axis=1), sides])
    _, first = np.unique(keys, axis=0, return_index=True)
    kept = np.sort(first)
    return rows[kept], force[kept]


def _box(bounds: list[float]) -> Cell | None:
    """The domain, of which nothing is known to repeat; None if it is no box."""
    if not np.all(np.isfinite(bounds)):
        return None
    half = len(bounds) // 2
    low, high = np.zeros(3), np.zeros(3)
    low[:half], high[:half] = bounds[:half], bounds[half:]
    if half == 2:
        high[2] = max(high - low)
    try:
        return Cell(high - low, (False, False, False), low) if np.all(high > low) else None
    except PackingError:
        return None
