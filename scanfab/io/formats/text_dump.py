"""
The ``ITEM:`` text dumps of LIGGGHTS and LAMMPS.

A snapshot is a header of sections, each below a line such as ``ITEM: TIMESTEP``, and a table, whose
columns stand in the last of these lines: ``ITEM: ATOMS id type x y z radius``.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table, has_radius
from scanfab.io.files import check_lines, first_bytes, plain
from scanfab.io.formats.lammps_box import dump_cell
from scanfab.io.parse.growing import grows, warn_incomplete
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, text_of
from scanfab.packing.cell import Cell

# a header is shorter, even with thousands of columns
HEADER_BYTES = 1 << 16
# bytes that are searched at a time
PIECE = 1 << 22
# a snapshot may be this large, and larger by so many bytes for each word of its rows: what is
# larger was decompressed from a file that was made to fill the memory
MUCH_TEXT, WORD_BYTES = 16 << 20, 100
# a key, and the lines below it; some files begin with a byte order mark
SECTION = re.compile(
    rb"^(?:\xef\xbb\xbf)?ITEM: ([^\r\n]*)\r?\n((?:(?!ITEM: )[^\n]*\n)*)", re.MULTILINE
)
# the sections with which a snapshot begins
FIRST = ([b"UNITS"], [b"TIME"], [b"TIMESTEP"])
# columns of words
WORDS = ("element", "lattice")


class Dump(NamedTuple):
    """One snapshot."""

    names: list[str]
    """Of the columns; their numbers from 1 in old files, which do not name them."""
    columns: Columns
    """Shape (N,) each; of repeated names the first counts."""
    cell: Cell | None
    rows: int
    """Number of rows."""

    @property
    def values(self) -> FloatArray:
        """All columns, shape (N, columns)."""
        return np.column_stack([self.columns[name] for name in self.names]).astype(np.float64)


def is_dump(head: bytes) -> bool:
    """Whether a file starts as such dumps do."""
    return head.startswith((b"ITEM: ", b"\xef\xbb\xbfITEM: "))


def dump_kind(path: Path) -> FileKind:
    """Whatever a dump counts are contacts, unless they are atoms: grains, if they have a radius."""
    sections, names, _ = _header(first_bytes(path, HEADER_BYTES))
    words = [key for key in sections if key.startswith("NUMBER OF ")]
    if words and words != ["NUMBER OF ATOMS"]:
        return "contacts"
    return "grains" if has_radius(names) else "points" if sections else "other"


def index_dump(path: Path) -> list[Snapshot]:
    """
    The snapshots of a file, in the order of their steps.

    An incomplete last snapshot (the program is still writing) is left out with a warning if there
    is a complete one before it.

    Raises
    ------
    ReadError
        If there is no snapshot, or one has no step.
    """
    file = plain(path)
    check_lines(path, file)
    found: list[Snapshot] = []
    # not mapped into memory: if a mapped file is cut meanwhile, the process dies
    with open(file, "rb") as stream:
        starts = _starts(stream)
        size = stream.tell()
        if not starts:
            reason = "expected a line ITEM: TIMESTEP, found none" if size else "the file is empty"
            raise ReadError(f"{path}: {reason}")
        for start, stop in pairwise([*starts, size]):
            if found and stop == size and not _is_whole(Snapshot(path, start=start, stop=stop)):
                number = len(starts)
                warn_incomplete(
                    f"{path}: the last snapshot, number {number}, is incomplete and is left out"
                )
                break
            stream.seek(start)
            sections, _, _ = _header(stream.read(min(HEADER_BYTES, stop - start)))
            try:
                step = int(sections["TIMESTEP"][0])
                time = float(sections["TIME"][0]) if "TIME" in sections else None
            except (LookupError, ValueError):
                raise ReadError(f"{path}: expected a whole number after ITEM: TIMESTEP") from None
            found.append(Snapshot(path, step, time, start, stop))
    # a program that was started again may have gone back
    return sorted(found, key=lambda one: one.step or 0)


def read_dump(snapshot: Snapshot) -> Dump:
    """
    One snapshot; words of elements stay words, all other columns are numbers.

    Raises
    ------
    ReadError
        If the header or a line is not as it should be; names the line.
    """
    data = text_of(snapshot)
    where = f"{snapshot.path}, step {snapshot.step}"
    sections, names, count, begin = _table(where, data)
    first = data[begin : data.find(b"\n", begin)]
    names = names or [f"{place + 1}" for place in range(len(first.split()))]
    line = data.count(b"\n", 0, begin) + 1
    layout = Layout(tuple(names), line=line, whole=("id",), text=WORDS)
    columns = read_rows(snapshot, data[begin:], layout, count=count)
    return Dump(names, columns, dump_cell(where, sections), count)


def read_dump_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """Columns in any order and any subset that suffices; of repeated names the first counts."""
    dump = read_dump(snapshot)
    columns = dump.columns
    if "1" in columns:
        options = numbered_columns(snapshot.path, "dump", len(columns), options)
    # LAMMPS called ids so until 2008
    if "tag" in columns and "id" not in {*columns, *options.columns}:
        columns["id"] = columns.pop("tag")
    return grain_table(snapshot.path, columns, dump.cell, options, f", step {snapshot.step}")


def numbered_columns(path: Path, what: str, width: int, options: ReadOptions) -> ReadOptions:
    """Options with the numbers of columns as their names; ReadError if users name no columns."""
    if not options.columns:
        raise ReadError(
            f"{path}: this {what} does not name its {width} columns: name them as the deck "
            f'lists them, by their numbers from 1: `columns="id=1,type=2,x=3,y=4,z=5,radius=6"`'
        )
    return replace(options, columns={what: str(own) for what, own in options.columns.items()})


def _starts(stream: IO[bytes]) -> list[int]:
    """First bytes of the snapshots; the stream is at its end then."""
    starts: list[int] = []
    place, is_first = 0, False
    # pieces of whole lines, so that no key is cut in two
    while piece := stream.read(PIECE) + stream.readline(HEADER_BYTES):
        at = piece.find(b"ITEM: ")
        while at >= 0:
            if at == 0 or piece[at - 1] in b"\n\xbf":
                was_first, is_first = is_first, piece[at + 6 : at + 20].split()[:1] in FIRST
                if is_first and not was_first:
                    starts.append(place + at)
            at = piece.find(b"ITEM: ", at + 6)
        place += len(piece)
    return starts


def _header(head: bytes) -> tuple[dict[str, list[str]], list[str], int]:
    """Lines by the key above them, names of the columns, and the first row; 0 if there is none."""
    sections: dict[str, list[str]] = {}
    word = None
    for one in SECTION.finditer(head):
        key = one[1].decode("utf-8", "replace").strip()
        if key.split()[:1] == [word]:
            return sections, key.split()[1:], one.start(2)
        sections[key] = one[2].decode("utf-8", "replace").splitlines()
        if key.startswith("NUMBER OF "):
            word = key.removeprefix("NUMBER OF ")
    return sections, [], 0


def _table(where: str, data: bytes) -> tuple[dict[str, list[str]], list[str], int, int]:
    """The header of a snapshot with the number of its rows; ReadError if they cannot be there."""
    sections, names, begin = _header(data[:HEADER_BYTES])
    key = next((key for key in sections if key.startswith("NUMBER OF ")), "NUMBER OF ATOMS")
    found = "".join(sections.get(key, [])[:1]).strip()
    if sections and not re.fullmatch(r"\d{1,18}", found):
        raise ReadError(f"{where}: expected a whole number after ITEM: {key}, found {found[:80]!r}")
    if not begin:
        raise ReadError(f"{where}: the header is incomplete: no ITEM: ATOMS line")
    count, width, size = int(found), max(len(names), 1), len(data) - begin
    if size > MUCH_TEXT + count * width * WORD_BYTES:
        raise ReadError(f"{where}: the header counts {count} rows, but {size:,} bytes follow")
    last = data[data.rfind(b"\n") + 1 :].split()
    # the last line may lack its end if it lacks no word
    lines = data.count(b"\n", begin) + (len(last) == width and not grows())
    if lines < count:
        raise ReadError(
            f"{where}: the header counts {count} rows, but the file ends after {lines} complete "
            f"lines: the snapshot is incomplete"
        )
    return sections, names, count, begin


def _is_whole(snapshot: Snapshot) -> bool:
    """Whether a snapshot has all rows that its header counts."""
    data = text_of(snapshot)
    try:
        _table("", data)
    except ReadError:
        return False
    return True
