"""What readers share: frames below one another, numbers in headers, cells, a base class."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table
from scanfab.io.files import check_lines, plain
from scanfab.io.growing import leave_out_last
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    Reader,
    ReadOptions,
    Snapshot,
)
from scanfab.io.text import Columns, spelt, text_of
from scanfab.packing.cell import Cell

# the header of a frame is shorter, even with thousands of columns
HEADER_BYTES = 1 << 16
# bytes that are searched at a time
PIECE = 1 << 22
NO_COMMENT = re.compile(rb"^[ \t]*[^#\s][^\n]*", re.MULTILINE)


class GrainsOnly(Reader):
    """
    Base class of readers whose files hold grains and no contacts.

    A reader says by ``recognises`` which files are of its format, and by ``table`` which
    columns and which cell a frame has. It overrides ``snapshots`` if a file
    may hold several frames.
    """

    has_cell: Carries = "cell"

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """All columns of a frame by their names, and its cell."""
        raise NotImplementedError

    def kind(self, path: Path) -> FileKind:
        """Grains, if the file is one of this format."""
        return "grains" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One."""
        return [Snapshot(path)]

    def carries(self, path: Path) -> Carries:
        """The same for all files of the format."""
        return self.has_cell

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The columns by their names; what lies in the plane has no column z."""
        columns, cell = self.table(snapshot)
        return grain_table(snapshot.path, in_space(columns), cell, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """There are none."""
        raise ReadError(f"{snapshot.path}: {self.name} files hold no contacts of grains")


def in_space(columns: Columns) -> Columns:
    """The columns, with z = 0 for grains in the plane."""
    if "x" in columns and "z" not in columns:
        columns["z"] = np.zeros(len(columns["x"]))
    return columns


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
    where: str | Path, vectors: npt.ArrayLike, periodic: Iterable[bool], origin: npt.ArrayLike
) -> Cell | None:
    """A :class:`Cell`; None if the vectors span no volume and the packing is not periodic."""
    x, y, z = (bool(one) for one in periodic)
    try:
        return Cell(vectors, (x, y, z), origin)
    except PackingError as error:
        if x or y or z:
            raise ReadError(f"{where}: {error}") from None
        return None


def lack_of_end(frame: bytes) -> str | None:
    """The ``lack`` of frames without a count."""
    return None if frame.endswith(b"\n") else "its last line has no end"


def marked_frames(
    path: Path,
    mark: re.Pattern[bytes],
    moment: Callable[[Path, bytes], tuple[int | None, float | None] | None] | None = None,
    lack: Callable[[bytes], str | None] = lack_of_end,
) -> list[Snapshot]:
    """
    The frames of a text in the order of their steps.

    If the last frame is incomplete (the program is still writing), it is left out with a warning,
    unless it is the only one: then reading it says what is wrong.

    Parameters
    ----------
    path : Path
        The file.
    mark : Pattern
        Matches the beginning of a line with which a frame begins. It is fast if it begins with a
        letter, not with ``^`` or a choice.
    moment : callable, optional
        Says step and time of a frame from its first bytes. None: the frame goes on behind the next
        mark. Raises ReadError if the bytes do not say it. By default the time is the first group
        of ``mark``.
    lack : callable, optional
        Says what an incomplete frame lacks, from its bytes; None if it is complete. By default the
        end of its last line.

    Raises
    ------
    ReadError
        If there is no frame, or one has no step or time.
    """
    check_lines(path, plain(path))
    starts: list[int] = []
    found: list[Snapshot] = []
    # not mapped into memory: if a mapped file is cut meanwhile, the process dies
    with open(plain(path), "rb") as stream:
        place = 0
        # pieces of whole lines, so that no mark is cut in two
        while piece := stream.read(PIECE) + stream.readline():
            found_here = (one.start() for one in mark.finditer(piece))
            starts += [place + at for at in found_here if piece[at - 1 : at] in (b"", b"\n")]
            place += len(piece)
        start = min(starts, default=0)
        lost = NO_COMMENT.search(text_of(Snapshot(path, stop=start)))
        if lost:
            raise ReadError(f"{path}: expected the header of a frame above {spelt(lost[0])}")
        for stop in [*starts[1:], place] if starts else ():
            is_last = found and stop == place
            if is_last and (reason := lack(text_of(Snapshot(path, start=start)))):
                leave_out_last(path, len(found), reason)
                break
            stream.seek(start)
            head = stream.read(min(HEADER_BYTES, stop - start))
            at = moment(path, head) if moment else (None, _time(path, mark.match(head)))
            if at is not None:
                found.append(Snapshot(path, *at, start, stop))
                start = stop
    if not found:
        expected = "expected the header of a frame, found none"
        raise ReadError(f"{path}: {expected if place else 'the file is empty'}")
    return sorted(found, key=lambda one: one.step or 0)


def numbered_frames(
    path: Path, moments: Iterable[tuple[int | None, float | None]]
) -> list[Snapshot]:
    """Frames with these steps and times; ``start`` of each is its number, not a byte."""
    found = [
        Snapshot(path, step, time, start=number, stop=number + 1)
        for number, (step, time) in enumerate(moments)
    ]
    if not found:
        raise ReadError(f"{path}: expected frames, found none")
    return found


def _time(path: Path, header: re.Match[bytes] | None) -> float:
    """The time in the first group of the header of a frame."""
    return numbers(f"{path}: time of a frame", header[1] if header else b"", 1)[0]
