"""What the readers of small formats share: numbers in headers, cells, frames below one another."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import check_lines, plain
from scanfab.io.parse.growing import leave_out_last
from scanfab.io.reader import FileKind, GrainTable, JoinedContacts, Reader, ReadOptions, Snapshot
from scanfab.io.text import spelt
from scanfab.packing.cell import Cell


class GrainsOnly(Reader):
    """Base class of readers whose files hold one frame of grains, and no contacts."""

    def kind(self, path: Path) -> FileKind:
        """Grains, if the file is one of this format."""
        return "grains" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One."""
        return [Snapshot(path)]

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """There are none."""
        raise ReadError(f"{snapshot.path}: {self.name} files hold no contacts of grains")


def numbers(where: str, text: bytes, count: int) -> list[float]:
    """So many numbers in a text; ReadError, which begins with ``where``, if it is anything else."""
    words = text.split()
    try:
        # float() takes 1_000 for a number
        if len(words) == count and b"_" not in text:
            return [float(word) for word in words]
    except ValueError:
        pass
    raise ReadError(f"{where}: expected {count} numbers, found {spelt(text)}")


def finite_forces(path: Path, force: FloatArray) -> FloatArray:
    """The forces; ReadError if one is no finite number."""
    if not np.all(np.isfinite(force)):
        raise ReadError(f"{path}: expected finite numbers as contact forces and normals")
    return force


def cell_of(
    where: str, vectors: npt.ArrayLike, periodic: Iterable[bool], origin: npt.ArrayLike
) -> Cell | None:
    """A :class:`Cell`; None if the vectors span no volume, and the packing is not periodic."""
    x, y, z = (bool(one) for one in periodic)
    try:
        return Cell(vectors, (x, y, z), origin)
    except PackingError as error:
        if x or y or z:
            raise ReadError(f"{where}: {error}") from None
        return None


def frames_below(path: Path, head: re.Pattern[bytes]) -> list[Snapshot]:
    """
    The frames of a text that each begin with a line like ``head``.

    The first group of ``head`` is the time of the frame. If the last line of the file has no end,
    the last frame is left out with a warning.

    Raises
    ------
    ReadError
        If no frame is complete.
    """
    check_lines(path, plain(path))
    starts: list[tuple[int, float]] = []
    place, line = 0, b""
    with open(plain(path), "rb") as stream:
        for line in stream:
            match = head.match(line)
            if match is not None:
                starts.append((place, numbers(f"{path}: time of a frame", match[1], 1)[0]))
            elif not starts and line.strip() and not line.lstrip(b"\xef\xbb\xbf").startswith(b"#"):
                raise ReadError(f"{path}: expected a line '# TIME ...' above {spelt(line)}")
            place += len(line)
    if not starts:
        raise ReadError(f"{path}: expected frames below lines of '# TIME ...', found none")
    stops = [*(start for start, _ in starts[1:]), place]
    frames = [
        Snapshot(path, time=time, start=start, stop=stop)
        for (start, time), stop in zip(starts, stops, strict=True)
    ]
    if not line.endswith(b"\n"):
        leave_out_last(path, len(frames) - 1, "its last line has no end")
        frames.pop()
    return frames
