"""
One table of text: polars makes columns of its rows, and a search by line finds what is wrong.

A format reads its own header, says how the rows below it are written (:class:`Layout`) and asks
:func:`read_rows` for the columns. Every number is the double nearest to its text, and whole numbers
are exact.
"""

from __future__ import annotations

import csv
import os
import re
import sys
import warnings
from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io.fence import fenced
from scanfab.io.files import check_lines, check_memory, plain
from scanfab.io.growing import grows
from scanfab.io.reader import Snapshot

Columns = dict[str, npt.NDArray[Any]]

NUMBER = re.compile(
    r"\s*[-+]?(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eEdD][-+]?[0-9]+)?|(?:nan|inf|infinity))\s*\Z",
    re.IGNORECASE,
)
# polars would decompress a text that begins with one of these
LIKE_COMPRESSED = (b"\x1f\x8b", b"x\x01", b"x^", b"x\x9c", b"x\xda", b"(\xb5")
# how many times its size a text takes in memory: the text, its numbers, and the packing's columns
IN_MEMORY = 6.0
# bytes that are handled at a time, and characters of a word or line that a message shows
PIECE, SHOWN = 1 << 18, 60
# the name that polars gets for what stands behind a separator at the end of each row
BEHIND = "behind"


class Layout(NamedTuple):
    """
    How the rows of a table are written.

    Each column is a float in every row, unless it is named in ``whole``, ``text`` or ``optional``.
    """

    names: tuple[str, ...]
    """Of all columns; of two with the same name the first is returned."""
    separator: str = " "
    """One character. A blank stands for any run of blanks and tabs, also around the row."""
    line: int = 1
    """Number of the first row's line, counted from the start of the snapshot."""
    whole: Collection[str] = ()
    """Columns of whole numbers: int64. Float64 if some are written as decimals (``1e5``, ``7.0``),
    which :func:`~scanfab.io.columns.whole_numbers` then checks."""
    text: Collection[str] = ()
    """Columns of words."""
    optional: Collection[str] = ()
    """Columns that may have gaps (NaN) or, if a word in them is no number, are read as words."""
    comma: bool = False
    """Whether the decimal sign is a comma."""


def read_rows(
    snapshot: Snapshot,
    rows: bytes,
    layout: Layout,
    *,
    count: int | None = None,
    what: str = "rows",
) -> Columns:
    """
    The columns of a table of text, by name.

    Parameters
    ----------
    snapshot : Snapshot
        Where the rows come from, for messages (``Snapshot(path)`` for a whole file).
    rows : bytes
        The rows alone: no header, no comments, no other section. Empty lines around them are left
        out, empty lines between them are an error. A format that allows comments removes them
        first (``re.sub(rb"[ \\t]*#[^\\n]*", b"", rows)``), and one with brackets replaces these by
        blanks (YAML: ``rows.replace(b"- [", b"").translate(None, b"],")``); line numbers stay.
        Fortran's ``1.5D-3`` is read, too, but faster after ``rows.replace(b"D", b"E")``.
    layout : Layout
        How they are written.
    count : int, optional
        How many rows the header says there are.
    what : str, optional
        What stands in the rows, for messages.

    Returns
    -------
    dict of str to ndarray
        A column each, shape (N,): float64, int64 or str.

    Raises
    ------
    ReadError
        If there are not ``count`` rows, a row has more or fewer words than there are names, or a
        word is no number; names the line.

    Warns
    -----
    ScanfabWarning
        If the last line has no end, so that its last number may have been cut.

    Examples
    --------
    >>> from pathlib import Path
    >>> from scanfab.io.reader import Snapshot
    >>> from scanfab.io.text import Layout, read_rows
    >>> layout = Layout(("id", "r"), whole=["id"])
    >>> found = read_rows(Snapshot(Path("dump.1")), b"1 0.5\\n2  0.25\\n", layout, count=2)
    >>> found["id"].tolist(), found["r"].tolist()
    ([1, 2], [0.5, 0.25])
    """
    rows, layout, has_end = _trimmed(rows, layout)
    found = rows.count(b"\n")
    if count is not None and found != count:
        step = "" if snapshot.step is None else f", step {snapshot.step}"
        raise ReadError(
            f"{snapshot.path}{step}: the header counts {count} {what}, found {found}: the "
            f"file is incomplete or damaged"
        )
    if not has_end:
        warn_of_end(snapshot.path)
    if _is_forked:
        columns = fenced(columns_of, snapshot.path, rows, layout)
    else:
        columns = columns_of("", rows, layout)
    if columns is None:
        raise _bad_line(snapshot, rows, layout)
    return columns


def columns_of(_path: str, rows: bytes, layout: Layout) -> Columns | None:
    """The columns of sound rows; None if a row is not as it should be. Runs in the worker, too."""
    # polars would pass over a carriage return that ends no line
    frame = _frame(rows, layout) if rows and b"\r" not in rows else None
    return None if rows and frame is None else _as_arrays(frame, layout)


# Whether this process was forked behind polars: the threads of polars are gone, and it would wait
# for them without end. Only the worker, a new process, can use it then.
_is_forked = False


def _note_fork() -> None:
    global _is_forked
    _is_forked = "polars" in sys.modules


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)


def _trimmed(rows: bytes, layout: Layout) -> tuple[bytes, Layout, bool]:
    """The rows without empty lines around them, and whether the last one had a newline."""
    if not rows[:PIECE].strip() and not rows.strip():
        return b"", layout, True
    has_end = rows[-PIECE:].rstrip(b" \t\r").endswith(b"\n")
    rows = rows if has_end else rows + b"\n"
    if b"\r" in rows:
        rows = rows.replace(b"\r\n", b"\n")
    start, stop = 0, len(rows)
    while (end := rows.find(b"\n", start) + 1) and not rows[start:end].strip():
        start, layout = end, layout._replace(line=layout.line + 1)
    while (begin := rows.rfind(b"\n", start, stop - 1) + 1) and not rows[begin:stop].strip():
        stop = begin
    return rows[start:stop], layout, has_end


def warn_of_end(path: Path) -> None:
    """Warn that the last line has no end; ReadError if the file may still be being written."""
    if grows():
        raise ReadError(f"{path}: the last line has no end: the file is still being written")
    warnings.warn(
        f"{path}: the last line has no end: if the file was cut, its last number may be cut, too, "
        f"and rows may be missing",
        ScanfabWarning,
        stacklevel=4,
    )


def _frame(rows: bytes, layout: Layout) -> Any:
    """The rows as a data frame of polars, whose columns are called by their places; or None."""
    frame = _parsed(rows, layout, loose=False)
    if layout.separator != " " or frame is not None:
        return _parsed(rows, layout, loose=True) if frame is None else frame
    rows = _single_blanks(rows)
    frame = _parsed(rows, layout, loose=False)
    return _parsed(rows.replace(b" \n", b"\n"), layout, loose=True) if frame is None else frame


def _single_blanks(rows: bytes) -> bytes:
    """The rows with one blank behind each word, but none behind the last of a row if none was."""
    rows = rows.replace(b"\t", b" ") if b"\t" in rows else rows

    def squeezed(start: int) -> bytes:
        text = np.frombuffer(rows, np.uint8, min(PIECE, len(rows) - start), start)
        kept: npt.NDArray[np.bool_] = text != ord(" ")
        is_word = kept & (text != ord("\n"))
        kept[1:] |= is_word[:-1]
        kept[0] |= start > 0 and rows[start - 1] not in b" \n"
        return text[kept].tobytes()

    with ThreadPoolExecutor() as pool:
        return b"".join(pool.map(squeezed, range(0, len(rows), PIECE)))


def _parsed(rows: bytes, layout: Layout, loose: bool) -> Any:
    """
    The rows as polars reads them; None unless every row has all its words.

    If ``loose``, polars makes words of all columns, and numbers of the words afterwards.
    """
    import polars

    first = rows[: rows.find(b"\n")].decode("utf-8", "replace")
    has_quotes = layout.separator != " " and b'"' in rows
    words = first.split(" ") if layout.separator == " " else words_of(first, layout.separator)
    # a separator at the end of each row looks like one more column
    is_behind = len(words) == len(layout.names) + 1 and not words[-1]
    schema: dict[str, Any] = {
        f"{place}": polars.String
        if loose or name in layout.text
        else polars.Int64
        if name in layout.whole
        else polars.Float64
        for place, name in enumerate(layout.names)
    }
    # with a decimal comma a point may stand for thousands, which the loose way tells
    if rows.startswith(LIKE_COMPRESSED) or (layout.comma and not loose and b"." in rows):
        return None
    try:
        frame = polars.read_csv(
            rows,
            has_header=False,
            separator=layout.separator,
            quote_char='"' if has_quotes else None,
            schema={**schema, BEHIND: polars.String} if is_behind else schema,
            decimal_comma=layout.comma and not loose,
            encoding="utf8-lossy",
        )
    except (polars.exceptions.PolarsError, OSError):
        return None
    if is_behind and frame[BEHIND].null_count() != frame.height:
        return None
    if loose:
        frame = frame.with_columns(
            _numbers(frame[f"{place}"], layout.comma, name in layout.whole)
            for place, name in enumerate(layout.names)
            if name not in layout.text
        )
    gaps = frame.null_count().row(0)
    gapless = layout.separator == " " or (any(gaps) and _is_ragged(rows, layout, frame))
    for place, name in enumerate(layout.names):
        is_needed = name not in layout.text and name not in layout.optional
        is_words = frame.dtypes[place] == polars.String
        if (gaps[place] and (is_needed or gapless)) or (is_needed and is_words):
            return None
    return frame


def _numbers(words: Any, comma: bool, is_whole: bool) -> Any:
    """A column of words as numbers, with gaps; as it is if a word is no number."""
    import polars

    words = words.str.strip_chars().replace("", None)
    texts = words
    if comma:
        if words.str.contains(r"^[-+0-9.,eEdD]*\.[-+0-9.,eEdD]*$").any():
            return words
        texts = words.str.replace(",", ".", literal=True)
    texts = texts.str.replace(r"^([-+]?[0-9.]+)[dD]([-+]?[0-9]+)$", "${1}e${2}")
    for kind in (polars.Int64, polars.Float64) if is_whole else (polars.Float64,):
        numbers = texts.cast(kind, strict=False)
        if numbers.null_count() == words.null_count():
            return numbers
    return words


def _is_ragged(rows: bytes, layout: Layout, frame: Any) -> bool:
    """Whether some row lacks a word, where gaps may as well be empty words."""
    if b'"' not in rows:
        return bool(rows.count(layout.separator.encode()) != frame.height * (frame.width - 1))
    lines = rows.decode("utf-8", "replace").split("\n")[:-1]
    return any(len(words_of(line, layout.separator)) != frame.width for line in lines)


def _as_arrays(frame: Any, layout: Layout) -> Columns:
    """The columns of a data frame by name; empty ones without it."""
    found: Columns = {}
    for place, name in enumerate(layout.names):
        if name in found:
            continue
        column = None if frame is None else frame[f"{place}"]
        if column is None:
            found[name] = np.zeros(0, np.int64 if name in layout.whole else np.float64)
        elif column.dtype.is_numeric():
            found[name] = column.to_numpy()
        else:
            words = column.fill_null("").str.strip_chars()
            found[name] = np.array(words.to_list(), dtype=np.str_)
    return found


def _bad_line(snapshot: Snapshot, rows: bytes, layout: Layout) -> ReadError:
    """The error for the first row that is not as it should be: each word is looked at."""
    width, above = len(layout.names), lines_above(snapshot)
    for number, row in enumerate(rows.split(b"\n")[:-1], start=above + layout.line):
        where = f"{snapshot.path}, line {number}"
        if not row.strip():
            return ReadError(f"{where}: expected rows to the end of the table, found an empty line")
        if b"\r" in row:
            return ReadError(f"{where}: found a carriage return that ends no line")
        words = words_of(row.decode("utf-8", "replace"), layout.separator)
        if len(words) == width + 1 and not words[-1]:
            words.pop()
        if len(words) != width or row.count(b'"') % 2:
            shown = spelt(row[:SHOWN])
            return ReadError(f"{where}: expected {width} columns, found {len(words)}: {shown}")
        for name, word in zip(layout.names, words, strict=True):
            if name in layout.text or name in layout.optional:
                continue
            is_sound = not (layout.comma and "." in word)
            if not is_sound or not is_number(word, layout.comma):
                expected = "a number" if is_sound else "a number with a decimal comma"
                found = repr(word.strip()[:SHOWN]) if word.strip() else "nothing"
                return ReadError(
                    f"{where}: expected {expected} in the column {name}, found {found}"
                )
    return ReadError(f"{snapshot.path}: cannot be read as a table of {width} columns")


def words_of(line: str, separator: str) -> list[str]:
    """The words of a row; between blanks none is empty, beside others quotation marks count."""
    if separator == " ":
        return line.split()
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a word that is longer than any name or number
        return line.split(separator)


def is_number(word: str, comma: bool = False) -> bool:
    """Whether a word is a number; not-a-number and Fortran's D exponents are among them."""
    return NUMBER.match(word.replace(",", ".", 1) if comma else word) is not None


def spelt(line: bytes) -> str:
    """A line as messages show it."""
    return repr(line[:80].decode("utf-8", "replace").strip())


def text_of(snapshot: Snapshot) -> bytes:
    """The bytes of a snapshot (or a whole file) without a byte order mark; checks their size."""
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
    if snapshot.start == 0:
        return 0
    with open(plain(snapshot.path), "rb") as stream:
        lines, left = 0, snapshot.start
        while left > 0 and (part := stream.read(min(left, PIECE))):
            lines += part.count(b"\n")
            left -= len(part)
    return lines


def skip_rows(stream: IO[bytes], count: int) -> int:
    """Go behind so many lines; returns how many there were (the last one may have no newline)."""
    left = count
    while left > 0 and (piece := stream.read(PIECE)):
        here = piece.count(b"\n")
        if here >= left:
            ends = np.flatnonzero(np.frombuffer(piece, np.uint8) == ord("\n"))
            stream.seek(int(ends[left - 1]) + 1 - len(piece), 1)
        left -= min(here, left)
    return count - left
