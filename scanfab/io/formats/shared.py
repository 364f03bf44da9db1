"""Code that readers share: a base class, files with several frames, numbers in headers, cells."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import Columns, FloatArray
from scanfab.io.columns import grain_table, has_radius, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import leave_out_last, plain
from scanfab.io.reader import Carries, FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import CutError, spelt, text_of
from scanfab.packing.cell import Cell

# bytes that hold the header of any frame, even with thousands of columns
HEADER_BYTES = 1 << 16
# bytes that are searched in one piece
PIECE = 1 << 22
NO_COMMENT = re.compile(rb"^[ \t]*[^#\s][^\n]*", re.MULTILINE)


class GrainsOnly:
    """
    Base class of readers (:class:`scanfab.io.Reader`) whose files hold grains and no contacts.

    A subclass defines ``recognises`` (is a file of this format?) and ``table`` (the columns and the
    cell of a frame). It overrides ``snapshots`` if a file may hold several frames, and ``names`` if
    a file may lack radii.
    """

    name = description = ""
    extensions: tuple[str, ...] = ()
    has_cell: Carries = "cell"

    def recognises(self, path: Path) -> bool:
        """Whether the content is certainly of this format."""
        raise NotImplementedError

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """All columns of a frame by their names, and its cell."""
        raise NotImplementedError

    def names(self, path: Path) -> Sequence[str]:
        """The names of the columns; if none is a radius, the file holds points."""
        return ("radius",)

    def kind(self, path: Path) -> FileKind:
        """Grains or points, if the file is of this format."""
        if not self.recognises(path):
            return "other"
        return "grains" if has_radius(self.names(path)) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The only snapshot."""
        return [Snapshot(path)]

    def carries(self, path: Path) -> Carries:
        """`has_cell`, the same for all files of the format."""
        return self.has_cell

    def beside(self, path: Path) -> list[Path]:
        """The files that are read together with a grain file: none."""
        return []

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The grains, from the columns of `table`."""
        return grains_of(snapshot, *self.table(snapshot), options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """ReadError: there are no contacts."""
        raise ReadError(f"{snapshot.path}: {self.name} files hold no contacts of grains")


class FormsReader(GrainsOnly):
    """Base class of readers for programs that write several forms of files, VTK among them."""

    forms: tuple[GrainsOnly, ...]
    """A reader for each form, the reader of VTK last; it also reads what no other recognises."""

    def form(self, path: Path) -> GrainsOnly:
        """The reader for the form of a file, by its first bytes."""
        return next((form for form in self.forms if form.recognises(path)), self.forms[-1])

    def kind(self, path: Path) -> FileKind:
        """Passed on to the reader for the form of the file."""
        return self.form(path).kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """Passed on to the reader for the form of the file."""
        return self.form(path).snapshots(path)

    def carries(self, path: Path) -> Carries:
        """Passed on to the reader for the form of the file."""
        return self.form(path).carries(path)

    def beside(self, path: Path) -> list[Path]:
        """Those of VTK, found by their names; the other forms have none."""
        return self.forms[-1].beside(path)

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Passed on to the reader for the form of the file."""
        return self.form(snapshot.path).read_grains(snapshot, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Passed on to the reader for the form of the file."""
        return self.form(snapshot.path).read_contacts(snapshot, options, grains)


def numbered(width: int) -> list[str]:
    """Names for columns without names: their numbers, from 1."""
    return [f"{place + 1}" for place in range(width)]


def grains_of(
    snapshot: Snapshot, columns: Columns, cell: Cell | None, options: ReadOptions
) -> GrainTable:
    """The grains in the columns of a frame; ReadError if nobody names the columns."""
    if "1" in columns and not options.columns:
        advice = 'number them as the deck lists them: `columns="id=1,x=3,y=4,z=5,radius=6"`'
        raise ReadError(f"{snapshot.path}: the {len(columns)} columns have no names: {advice}")
    where = "" if snapshot.step is None else f", step {snapshot.step}"
    return grain_table(snapshot.path, columns, cell, options, where)


def in_space(columns: Columns) -> Columns:
    """The columns, with z = 0 for grains in the plane."""
    return columns if "z" in columns else {**columns, "z": np.zeros(len(columns["x"]))}


def numbers(where: str, text: bytes, count: int) -> list[float]:
    """The ``count`` numbers in a text; else a ReadError that begins with ``where``."""
    words = text.split()
    try:
        # float() would accept 1_000
        if len(words) == count and b"_" not in text:
            return [float(word) for word in words]
    except ValueError:
        pass
    raise ReadError(f"{where}: expected {count} numbers, found {spelt(text)}")


def join_pairs(
    path: Path, grains: GrainTable, ends: Iterable[npt.ArrayLike], force: FloatArray | None
) -> JoinedContacts:
    """
    Join contacts by the ids of their first and second grains; a negative id means a wall.

    The force acts on the second grain. ReadError if the force, or a normal from which it was
    computed, is not finite.
    """
    if force is not None and not np.all(np.isfinite(force)):
        raise ReadError(f"{path}: expected finite numbers as contact forces and normals")
    ids = np.column_stack([whole_numbers(path, end) for end in ends])
    return join_ids(path, grains, ids, force, walls="negative")


def cell_of(
    where: str | Path, vectors: npt.ArrayLike, periodic: Iterable[bool], origin: npt.ArrayLike
) -> Cell | None:
    """
    A :class:`Cell`; None if the vectors span no volume and the packing is not periodic.

    A periodic packing may have no thickness along an axis that is not periodic; it then gets one.
    """
    x, y, z = (bool(repeats) for repeats in periodic)
    edges = np.array(vectors, dtype=np.float64)
    edges = np.diag(edges) if edges.ndim == 1 else edges
    flat = np.flatnonzero(~edges.any(axis=1) & ~np.array([x, y, z]) & (x or y or z))
    edges[flat, flat] = np.abs(edges).max()
    try:
        return Cell(edges, (x, y, z), origin)
    except PackingError as error:
        if x or y or z:
            raise ReadError(f"{where}: {error}") from None
        return None


@np.errstate(over="ignore", invalid="ignore")
def box_cell(
    where: str | Path, bounds: FloatArray, periodic: Iterable[bool], *, is_around: bool = True
) -> Cell | None:
    """
    The cell for a box of LAMMPS; None if the box has no volume and is not periodic.

    Parameters
    ----------
    where : str or Path
        The beginning of error messages.
    bounds : ndarray, shape (3, 2), (3, 3) or (3, 4)
        Lower and upper bound of each axis, and in a third column the tilt (xy, xz, yz). Or
        three vectors (rows), and in a fourth column the origin. Dump's length unit.
    periodic : iterable of bool
        Whether the box is periodic along each vector.
    is_around : bool, optional
        Whether the bounds are those of the box *around* the tilted box, as in dumps. Data files
        have the bounds of the box before it was tilted.

    Raises
    ------
    ReadError
        If the box is periodic and has no volume.
    """
    if bounds.shape[1] == 4:
        return cell_of(where, bounds[:, :3], periodic, bounds[:, 3])
    low, high = bounds[:, 0], bounds[:, 1]
    xy, xz, yz = bounds[:, 2] if bounds.shape[1] == 3 else np.zeros(3)
    if is_around:
        low = low - [min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0]
        high = high - [max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0]
    edges = high - low
    vectors = np.array([[edges[0], 0, 0], [xy, edges[1], 0], [xz, yz, edges[2]]])
    return cell_of(where, np.zeros((3, 3)) if np.any(edges <= 0) else vectors, periodic, low)


def marked_frames(
    path: Path,
    mark: re.Pattern[bytes],
    check: Callable[[Snapshot], object] | None = None,
    moment: Callable[[Path, bytes], tuple[int | None, float | None] | None] | None = None,
) -> list[Snapshot]:
    """
    Find the frames of a text file; they are sorted by step.

    If the last frame is incomplete (the program is still writing), it is left out with a warning.
    If it is the only frame, it is kept, and reading it raises the error.

    Parameters
    ----------
    path : Path
        The file.
    mark : Pattern
        Matches at the first line of each frame.
    check : callable, optional
        Reads the last of several frames and raises CutError if it is incomplete. By default a
        frame is incomplete if its last line has no end.
    moment : callable, optional
        Returns step and time of a frame from its first bytes; (None, None) if the bytes are cut
        off; None if the frame goes on behind the next mark. Raises ReadError if the bytes are
        wrong. By default there is no step, and the time is the first group of ``mark``.

    Raises
    ------
    ReadError
        If there is no frame, or a frame has no step or time.
    """
    starts: list[int] = []
    frames: list[Snapshot] = []
    size = 0
    # the search is fast, as it begins with a literal
    line = re.compile(rb"\n(?=" + mark.pattern + rb")", mark.flags)
    # not mapped into memory: the process would crash if another program truncated the file
    with open(plain(path), "rb") as stream:
        # pieces of whole lines, so that no mark is cut in two
        while piece := stream.read(PIECE) + stream.readline():
            starts += [size + match.start() for match in line.finditer(b"\n" + piece)]
            size += len(piece)
        start = min(starts, default=size)
        lost = NO_COMMENT.search(text_of(Snapshot(path, stop=start)))
        if lost:
            raise ReadError(f"{path}: expected the header of a frame above {spelt(lost[0])}")
        for stop in [*starts[1:], size][: len(starts)]:
            stream.seek(start)
            head = stream.read(min(HEADER_BYTES, stop - start))
            at: tuple[int | None, float | None] | None
            if moment is not None:
                at = moment(path, head)
            else:
                header = mark.match(head)
                word = header[1] if header else b""
                at = None, numbers(f"{path}: time of a frame", word, 1)[0]
            # the header of the last frame may be cut off: keep the frame without step and time
            if at or stop == size:
                frames.append(Snapshot(path, *(at or (None, None)), start, stop))
                start = stop
    if not frames:
        raise ReadError(f"{path}: expected frames, found none: the file is empty or incomplete")
    if len(frames) > 1 and (reason := _lack(frames[-1], check)):
        del frames[-1]
        leave_out_last(path, len(frames), reason)
    return sorted(frames, key=lambda frame: frame.step or 0)


def _lack(snapshot: Snapshot, check: Callable[[Snapshot], object] | None) -> str | None:
    """Why a frame is incomplete, or None; other errors are raised when the frame is read."""
    if check is None:
        return None if text_of(snapshot).endswith(b"\n") else "its last line has no end"
    try:
        check(snapshot)
    except CutError as error:
        return f"{error}".removeprefix(f"{snapshot.path}").lstrip(":, ")
    except ReadError:
        pass
    return None


def numbered_frames(
    path: Path, moments: Iterable[tuple[int | None, float | None]]
) -> list[Snapshot]:
    """Snapshots with these steps and times; their ``start`` is the number of the frame."""
    found = [
        Snapshot(path, step, time, start=number, stop=number + 1)
        for number, (step, time) in enumerate(moments)
    ]
    if not found:
        raise ReadError(f"{path}: expected frames, found none")
    return found
