"""
The ``ITEM:`` text dumps of LIGGGHTS and LAMMPS: sections by their key, never by line number.

Knows the syntax of snapshots, not the meaning of columns.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import check_memory, plain
from scanfab.io.parse.counted_rows import lines_above
from scanfab.io.parse.growing import warn_incomplete
from scanfab.io.parse.lammps_box import dump_cell
from scanfab.io.parse.number_rows import exact_column, number_or_nan, plain_reason
from scanfab.io.parse.text_table import LARGE, LONG, TextTable, read_regular
from scanfab.io.reader import Snapshot
from scanfab.io.unpacking import check_lines
from scanfab.packing.cell import Cell
from scanfab.packing.packing import LazyColumns

Columns = dict[str, npt.NDArray[Any]]

# a snapshot's header never comes near this size, whatever the number of columns
HEADER_BYTES = 1 << 16
# bytes that are searched at a time
PIECE = 1 << 18
# bytes of a word and the blanks around it; those that rows need not fill
WORD_BYTES = 100
MUCH_TEXT = 16 << 20
STEP_KEY = b"ITEM: TIMESTEP"
# bytes above that key in which LAMMPS' units and time may stand, and those with a part of the key
ABOVE, TAIL = 300, 320
COUNT_KEY = re.compile(rb"^ITEM: NUMBER OF (\S+)[ \t]*\r?$", re.MULTILINE)

# also spaces of latin1, as numpy has them
BLANK = re.compile(rb"^[\s\x1c-\x1f\x85\xa0]*(?:\n|\Z)", re.MULTILINE)

# LAMMPS writes units and time before the step
BEFORE_STEP = re.compile(rb"(?:^ITEM: (?:UNITS|TIME)[ \t]*\r?\n[^\n]*\n)+\Z", re.MULTILINE)
STEP_OR_TIME = re.compile(rb"^ITEM: (TIMESTEP|TIME)[ \t]*\r?\n\s*(\S+)", re.MULTILINE)


@dataclass(frozen=True)
class DumpBlock:
    """One snapshot, as it stands."""

    step: int | None
    time: float | None
    cell: Cell | None
    names: list[str]
    """Names of the columns; empty in very old files."""
    values: FloatArray
    """Shape (N, columns)."""


def row_word(head: bytes) -> str | None:
    """What a dump counts: ``ATOMS``, ``ENTRIES``, or the word of a label; None if no dump."""
    if not head.startswith((b"ITEM: ", b"\xef\xbb\xbfITEM: ")):
        return None
    match = COUNT_KEY.search(head)
    return match[1].decode("ascii", "replace") if match else None


def index_dump(path: Path) -> list[Snapshot]:
    """
    The snapshots of a file, by their first bytes, in the order of their steps.

    An incomplete last snapshot (the program is still writing) is left out with a warning if there
    is a complete one before it.
    """
    file = plain(path)
    if file.stat().st_size == 0:
        raise ReadError(f"{path}: the file is empty")
    check_lines(path, file)
    # not mapped into memory: where a mapped file is cut meanwhile, the process dies
    with open(file, "rb") as stream:
        starts, size = _starts(stream)
        if not starts:
            raise ReadError(f"{path}: expected a line ITEM: TIMESTEP, found none")
        stops = [*starts[1:], size]
        if len(starts) > 1 and not _is_complete(stream, starts[-1], stops[-1]):
            warn_incomplete(
                f"{path}: the last snapshot, number {len(starts)}, is incomplete and is left out"
            )
            starts.pop()
        found = [
            _snapshot(path, stream, start, stop) for start, stop in zip(starts, stops, strict=False)
        ]
    # a program that was started again may have gone back
    return sorted(found, key=lambda one: one.step or 0)


def read_block(snapshot: Snapshot) -> DumpBlock:
    """
    Parse one snapshot.

    Raises
    ------
    ReadError
        If the header or a line is not as it should be; names the line.
    """
    where, sections, body = _header(snapshot)
    count = _count(where, sections)
    values = _regular(snapshot, body, count, range(len(body.names)))
    if values is None:
        values = _tolerant(snapshot, body, count)
    return DumpBlock(snapshot.step, snapshot.time, dump_cell(where, sections), body.names, values)


def read_columns(
    snapshot: Snapshot, room: Callable[[Sequence[str], int], tuple[Columns, Columns]]
) -> tuple[LazyColumns, Cell | None]:
    """
    The columns of a snapshot by name, and its cell; of repeated names the first counts.

    Of a large snapshot only the columns are parsed for which ``room`` makes arrays, from the names
    of all and the number of rows: those to fill in by the dump's names, and what they are to be
    called. The others wait until they are asked for. Columns of old files, which name none, are
    called by their numbers from 1.

    Raises
    ------
    ReadError
        If the header or a line is not as it should be; names the line.
    """
    where, sections, body = _header(snapshot)
    count, cell = _count(where, sections), dump_cell(where, sections)
    table, load = _long_table(snapshot, body, count), partial(_read_column, snapshot)
    if not body.names:
        values = _tolerant(snapshot, body, count)
        own = {f"{place + 1}": column for place, column in enumerate(values.T)}
        return LazyColumns(list(own), own, own.__getitem__), cell
    if table is not None:
        filled, ready = room(body.names, count)
        places = {body.names.index(name): column for name, column in filled.items()}
        if read_regular(table, places):
            rest = [name for name in body.names if name in ready or name not in filled]
            return LazyColumns([*rest, *ready], ready, load), cell
    values = _tolerant(snapshot, body, count)
    ready = {name: values[:, body.names.index(name)] for name in body.names}
    if "id" in ready:
        ready["id"] = _exact_ids(snapshot, body, values)
    return LazyColumns(body.names, ready, load), cell


def _exact_ids(snapshot: Snapshot, body: _Body, values: FloatArray) -> npt.NDArray[Any]:
    with open(plain(snapshot.path), "rb") as stream:
        stream.seek(snapshot.start + body.start)
        size = -1 if snapshot.stop is None else snapshot.stop - snapshot.start - body.start
        place = body.names.index("id")
        return exact_column(values, stream.read(size), place) if len(values) else values[:, place]


def _read_column(snapshot: Snapshot, name: str) -> FloatArray:
    where, sections, body = _header(snapshot)
    count, place = _count(where, sections), body.names.index(name)
    values = _regular(snapshot, body, count, [place])
    return _tolerant(snapshot, body, count)[:, place] if values is None else values[:, 0]


@dataclass(frozen=True)
class _Body:
    names: list[str]
    start: int
    """Bytes from the start of the snapshot to its first row."""


def _header(snapshot: Snapshot) -> tuple[str, dict[str, list[str]], _Body]:
    """How messages name the snapshot, the sections of its header, and its body."""
    step = "" if snapshot.step is None else f", step {snapshot.step}"
    where = f"{snapshot.path}{step}"
    with open(plain(snapshot.path), "rb") as stream:
        stream.seek(snapshot.start)
        head = stream.read(HEADER_BYTES)
    if snapshot.stop is not None:
        head = head[: snapshot.stop - snapshot.start]
    return where, *_sections(where, head)


def _regular(
    snapshot: Snapshot, body: _Body, count: int, places: Sequence[int]
) -> FloatArray | None:
    """Some columns of a large snapshot, shape (count, n); None if its table is not regular."""
    table = _long_table(snapshot, body, count)
    if table is None:
        return None
    values = np.empty((count, len(places)))
    return values if read_regular(table, dict(zip(places, values.T, strict=True))) else None


def _long_table(snapshot: Snapshot, body: _Body, count: int) -> TextTable | None:
    """Where the rows of a large snapshot stand; None if it is small; a long one may be cut."""
    path = plain(snapshot.path)
    stop = path.stat().st_size if snapshot.stop is None else snapshot.stop
    start = snapshot.start + body.start
    _check_size(snapshot, stop - start, len(body.names), count)
    # a row has at least a digit and a blank for each column
    possible = 2 * count * max(len(body.names), 1) <= stop - start
    if not possible and stop - start > LONG:
        with open(path, "rb") as stream:
            raise _incomplete(snapshot, count, _line_ends(stream, start, stop))
    if not (possible and body.names) or stop - start < LARGE:
        return None
    return TextTable(path, start, stop, len(body.names), count)


def _tolerant(snapshot: Snapshot, body: _Body, count: int) -> FloatArray:
    """All numbers of a snapshot with any white space; says what is wrong in which line."""
    path, names = snapshot.path, body.names
    with open(plain(path), "rb") as stream:
        stop = os.fstat(stream.fileno()).st_size if snapshot.stop is None else snapshot.stop
        # the text, the same without empty lines, and its numbers
        check_memory(path, 4.0 * (stop - snapshot.start))
        stream.seek(snapshot.start)
        block = stream.read(stop - snapshot.start)
    values = _values(path, snapshot, block, body, count)
    if names and values.shape[1] != len(names):
        raise ReadError(
            f"{path}, step {snapshot.step}: the header names {len(names)} columns, the lines have "
            f"{values.shape[1]}"
        )
    return values


def _check_size(snapshot: Snapshot, size: int, columns: int, count: int) -> None:
    """ReadError if there is far more text than rows, as a few bytes can be unpacked to."""
    if columns and size > MUCH_TEXT + count * columns * WORD_BYTES:
        raise ReadError(
            f"{snapshot.path}, step {snapshot.step}: the header counts {count} rows, but {size:,} "
            f"bytes follow: one of both is damaged"
        )


def _starts(stream: IO[bytes]) -> tuple[list[int], int]:
    """Where snapshots begin (UNITS and TIME may stand before TIMESTEP), and where the file ends."""
    starts, end, before = [], 0, b"\n"
    while piece := stream.read(PIECE):
        # most pieces are numbers alone, and a letter is found faster than a word; a key may begin
        # in one piece and end in the next
        if b"I" in piece or b"I" in before[-len(STEP_KEY) :]:
            data, first = before + piece, end - len(before)
            place = data.find(STEP_KEY, max(len(before) - len(STEP_KEY) + 1, 0))
            while place >= 0:
                # some files begin with a byte order mark
                if data[place - 1 : place] in (b"\n", b"\xbf"):
                    above = BEFORE_STEP.search(data[max(place - ABOVE, 0) : place])
                    starts.append(first + place - (len(above[0]) if above else 0))
                place = data.find(STEP_KEY, place + 1)
        end += len(piece)
        before = (before + piece[-TAIL:])[-TAIL:]
    return starts, end


def _snapshot(path: Path, stream: IO[bytes], start: int, stop: int) -> Snapshot:
    stream.seek(start)
    # what belongs to the snapshot stands before its count of rows
    header = stream.read(min(HEADER_BYTES, stop - start)).partition(b"ITEM: NUMBER OF")[0]
    found = dict(STEP_OR_TIME.findall(header))
    try:
        step = int(found[b"TIMESTEP"])
    except (KeyError, ValueError):
        raise ReadError(f"{path}: expected a whole number after ITEM: TIMESTEP") from None
    try:
        time = float(found[b"TIME"]) if b"TIME" in found else None
    except ValueError:
        time = None
    return Snapshot(path, step=step, time=time, start=start, stop=stop)


def _is_complete(stream: IO[bytes], start: int, stop: int) -> bool:
    """Whether all rows that the header counts are there, each with its line end."""
    stream.seek(start)
    try:
        sections, body = _sections("", stream.read(min(HEADER_BYTES, stop - start)))
        count = _count("", sections)
    except ReadError:
        return False
    return _line_ends(stream, start + body.start, stop) >= count


def _line_ends(stream: IO[bytes], start: int, stop: int) -> int:
    """How many lines end between two bytes, in the memory of a few of them."""
    place, lines = stream.seek(start), 0
    while place < stop and (piece := stream.read(min(PIECE, stop - place))):
        lines += piece.count(b"\n")
        place += len(piece)
    return lines


def _incomplete(snapshot: Snapshot, count: int, lines: int) -> ReadError:
    return ReadError(
        f"{snapshot.path}, step {snapshot.step}: the header counts {count} rows, but the file ends "
        f"after {lines} complete lines: the snapshot is incomplete"
    )


def _sections(where: str, block: bytes) -> tuple[dict[str, list[str]], _Body]:
    """The header's sections by key, and the body: the first section whose key has no known word."""
    sections: dict[str, list[str]] = {}
    word, place = None, 0
    for line in block[:HEADER_BYTES].splitlines(keepends=True):
        place += len(line)
        text = line.decode("utf-8", "replace").strip().removeprefix("\ufeff")
        if not text.startswith("ITEM:"):
            if sections:
                next(reversed(sections.values())).append(text)
            continue
        key = text.removeprefix("ITEM:").strip()
        if key.startswith("NUMBER OF "):
            word = key.removeprefix("NUMBER OF ")
        elif word is not None and key.split()[:1] == [word]:
            return sections, _Body(key.split()[1:], place)
        sections[key] = []
    raise ReadError(f"{where}: the header is incomplete: no ITEM: {word or 'ATOMS'} line")


def _count(where: str, sections: dict[str, list[str]]) -> int:
    key = next((key for key in sections if key.startswith("NUMBER OF ")), None)
    try:
        count = int(sections[key][0]) if key else -1
    except (IndexError, ValueError):
        count = -1
    if count < 0:
        raise ReadError(f"{where}: expected a whole number after ITEM: {key or 'NUMBER OF ATOMS'}")
    return count


def _values(path: Path, snapshot: Snapshot, block: bytes, body: _Body, count: int) -> FloatArray:
    """The numbers of the body; words of columns of text come out as NaN."""
    if count == 0 and not block[body.start :].strip():
        return np.zeros((0, len(body.names)))
    available = block.count(b"\n", body.start)
    if count > available:
        raise _incomplete(snapshot, count, available)
    # a line without an end may lack digits; numpy warns of lines without a word
    rows = BLANK.sub(b"", block[body.start : block.rfind(b"\n") + 1])
    if not rows.strip():
        raise ReadError(
            f"{path}, step {snapshot.step}: the header counts {count} rows, found none: "
            f"the snapshot is incomplete"
        )
    text = _text_columns(block, body)
    converters: dict[int | str, Callable[[str], float]]
    converters = dict.fromkeys(text, number_or_nan)
    try:
        values: FloatArray = np.loadtxt(
            io.BytesIO(rows),
            dtype=np.float64,
            max_rows=count + 1,
            comments=None,
            ndmin=2,
            converters=converters or None,
            encoding="latin1",
        )
    except ValueError as error:
        raise ReadError(_locate(path, snapshot, block, body, str(error))) from None
    if len(values) < count:
        raise ReadError(
            f"{path}, step {snapshot.step}: the header counts {count} rows, found {len(values)}: "
            f"the snapshot is incomplete"
        )
    if len(values) > count:
        raise ReadError(
            f"{path}, step {snapshot.step}: the header counts {count} rows, but more follow: "
            f"one of both is damaged"
        )
    return values


def _text_columns(block: bytes, body: _Body) -> list[int]:
    """Columns of words (the element's name), by the first line."""
    first = block[body.start : body.start + HEADER_BYTES].split(b"\n", 1)[0].split()
    known = {"element", "lattice"}
    return [
        place
        for place, name in enumerate(body.names)
        if place < len(first) and name.lower() in known
    ]


def _locate(path: Path, snapshot: Snapshot, block: bytes, body: _Body, reason: str) -> str:
    """A message with the line of the file, from numpy's with the row of the block."""
    reason, row = plain_reason(reason)
    line = lines_above(snapshot) + block.count(b"\n", 0, body.start) + 1 + (row or 0)
    return f"{path}, line {line}: {reason}"
