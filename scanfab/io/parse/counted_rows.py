"""Rows of numbers in a part of a text, as many and as wide as a format says."""

from __future__ import annotations

from pathlib import Path
from typing import IO

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import check_memory, plain
from scanfab.io.parse.growing import warn_incomplete
from scanfab.io.parse.number_rows import rows_of_numbers
from scanfab.io.parse.text_table import FILLED, LONG, parse_rows
from scanfab.io.reader import Snapshot
from scanfab.io.unpacking import check_lines

# bytes that are read at a time
PIECE = 1 << 20
# times its size in memory: the text, its numbers, and the columns made of them
IN_MEMORY = 6.0
# lines for each row, of which the others are empty, and rows of a text of any number of lines
MOST_LINES, ANYWAY = 10, 1000


def text_of(snapshot: Snapshot) -> bytes:
    """The bytes of a snapshot, which may be its whole file; ReadError if they cannot be sound."""
    path, file = snapshot.path, plain(snapshot.path)
    stop = file.stat().st_size if snapshot.stop is None else snapshot.stop
    check_memory(path, IN_MEMORY * (stop - snapshot.start))
    check_lines(path, file)
    with open(file, "rb") as stream:
        stream.seek(snapshot.start)
        data = stream.read(max(stop - snapshot.start, 0))
    return data.removeprefix(b"\xef\xbb\xbf") if snapshot.start == 0 else data


def lines_above(snapshot: Snapshot) -> int:
    """How many lines of the file stand before the snapshot."""
    with open(plain(snapshot.path), "rb") as stream:
        lines, left = 0, snapshot.start
        while left > 0 and (part := stream.read(min(left, 1 << 20))):
            lines += part.count(b"\n")
            left -= len(part)
    return lines


def counted_rows(
    snapshot: Snapshot,
    data: bytes,
    begin: int,
    end: int,
    *,
    widths: tuple[int, ...],
    names: str,
    count: int | None = None,
) -> FloatArray:
    """
    The rows of numbers between two bytes of a snapshot's text, shape (N, columns).

    Parameters
    ----------
    snapshot : Snapshot
        Where the text comes from.
    data : bytes
        Its text, see :func:`text_of`.
    begin, end : int
        First byte, and the one behind the last.
    widths : tuple of int
        How many columns there may be; the first is that of an empty table.
    names : str
        What stands in the rows, for messages.
    count : int, optional
        How many rows there must be.

    Raises
    ------
    ReadError
        If there are more or fewer rows or columns, a word is no number, or the last line has no
        end, so that digits may be missing.
    """
    path = snapshot.path
    end = min(end, len(data))
    if count is not None and end - begin > LONG:
        _check_lines_of(path, data.count(b"\n", begin, end), count, names)
    if FILLED.search(data, begin, end) is None:
        values: FloatArray = np.zeros((0, widths[0]))
    else:
        # blanks behind the last line end do no harm
        if not data[max(begin, end - PIECE) : end].rstrip(b" \t\r").endswith(b"\n"):
            raise ReadError(f"{path}: the last line has no end: the file is incomplete")
        large = parse_rows(data, begin, end)
        if large is None:
            above = lines_above(snapshot) if snapshot.start else 0
            large = rows_of_numbers(path, data, begin, end, above)
        values = large
    if count is not None and len(values) != count:
        raise ReadError(f"{path}: the header counts {count} {names}, found {len(values)}")
    if values.shape[1] not in widths:
        expected = " or ".join(map(str, widths))
        raise ReadError(f"{path}: expected {expected} columns of {names}, found {values.shape[1]}")
    return values


def _check_lines_of(path: Path, lines: int, count: int, names: str) -> None:
    """ReadError if there cannot be so many rows, before the lines are parsed: a count may lie."""
    if lines < count or lines > MOST_LINES * (count + ANYWAY):
        raise ReadError(f"{path}: the header counts {count} {names}, found {lines} lines")


def skip_rows(stream: IO[bytes], count: int) -> int:
    """Go behind so many lines; how many there were, each with its end."""
    left = count
    while left > 0 and (piece := stream.read(PIECE)):
        here = piece.count(b"\n")
        if here >= left:
            ends = np.flatnonzero(np.frombuffer(piece, np.uint8) == ord("\n"))
            stream.seek(int(ends[left - 1]) + 1 - len(piece), 1)
        left -= min(here, left)
    return count - left


def leave_out_last(path: Path, complete: int, reason: str) -> None:
    """
    Warn that the last snapshot of a file, which ends too early, is left out.

    Raises
    ------
    ReadError
        If there is no complete one before it.
    """
    if complete == 0:
        raise ReadError(f"{path}: {reason}: the file is incomplete")
    warn_incomplete(
        f"{path}: the last snapshot, number {complete + 1}, is incomplete and is left out: {reason}"
    )


def spelt(line: bytes) -> str:
    """A line as messages show it."""
    return repr(line[:80].decode("utf-8", "replace").strip())
