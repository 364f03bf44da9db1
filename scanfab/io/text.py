"""
Read the rows of a text table by polars; if that fails, check line by line to name the fault.

A format reads its own header, describes the rows below it (:class:`Layout`) and calls
:func:`read_rows` for the columns. Every number becomes the nearest double, and whole numbers are
exact.
"""

from __future__ import annotations

import csv
import os
import re
import sys
from collections.abc import Collection
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError, warn
from scanfab.base.typing import Columns
from scanfab.io.fence import fenced
from scanfab.io.files import grows, plain
from scanfab.io.reader import Snapshot

NUMBER = re.compile(
    r"\s*[-+]?(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eEdD][-+]?[0-9]+)?|(?:nan|inf|infinity))\s*\Z",
    re.IGNORECASE,
)
# polars would try to decompress a text that begins with these bytes
LIKE_COMPRESSED = (b"\x1f\x8b", b"x\x01", b"x^", b"x\x9c", b"x\xda", b"(\xb5")
# most bytes of a word or line that a message quotes
SHOWN = 80
# a process that was forked after polars was imported lacks the threads of polars, and polars would
# wait for them forever; such a process lets the worker, a new process, read its tables
_had_polars: list[bool] = []
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: _had_polars.append("polars" in sys.modules))


class CutError(ReadError):
    """A frame ends before the end that its header announces, as if the file was truncated."""


class Layout(NamedTuple):
    """
    How the rows of a table are written.

    Each column is a float in every row, unless it is named in ``whole``, ``text`` or ``optional``.
    """

    names: tuple[str, ...]
    """The names of all columns; of two columns with the same name, the first is returned."""
    separator: str = " "
    """One character. A blank means any run of blanks and tabs, also around the row."""
    line: int = 1
    """Line number of the first row, counted from the start of the snapshot."""
    whole: Collection[str] = ()
    """Columns of whole numbers, as int64; as float64 if some are written as decimals (``1e5``,
    ``7.0``), which :func:`~scanfab.io.columns.whole_numbers` then checks."""
    text: Collection[str] = ()
    """Columns of words."""
    optional: Collection[str] = ()
    """Columns that may have gaps (NaN); if a word is not a number, the column is read as words."""
    comma: bool = False
    """Whether the decimal sign is a comma."""


def read_rows(
    snapshot: Snapshot, rows: bytes, layout: Layout, *, count: int | None = None, what: str = "rows"
) -> Columns:
    """
    Read the columns of a text table.

    Parameters
    ----------
    snapshot : Snapshot
        Where the rows come from, for messages (``Snapshot(path)`` for a whole file).
    rows : bytes
        The rows alone, without header, comments and other sections. Empty lines around the rows are
        ignored, empty lines between rows are an error. A format with comments removes them first
        (``re.sub(rb"[ \\t]*#[^\\n]*", b"", rows)``), and a format with brackets removes these
        (YAML: ``rows.replace(b"- [", b"").translate(None, b"],")``), so that line numbers stay.
        Fortran's ``1.5D-3`` is read too, but faster after ``rows.replace(b"D", b"E")``.
    layout : Layout
        How the rows are written.
    count : int, optional
        The number of rows that the header states.
    what : str, optional
        What the rows are, for messages: ``"atoms"``.

    Returns
    -------
    dict of str to ndarray
        The columns by name, shape (N,): float64, int64 or str.

    Raises
    ------
    ReadError
        If there are not ``count`` rows, a row has more or fewer words than there are names, or a
        word is not a number. The message names the line. :class:`CutError` if the end is missing.

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
    # if tabs separate words, tabs at the edges stand for empty words: keep them
    edge = None if layout.separator == " " else b" \n"
    if b"\r" in rows:  # to look first is faster than to replace nothing
        rows = rows.replace(b"\r\n", b"\n")
    body = rows.lstrip(edge)
    layout = layout._replace(line=layout.line + rows.count(b"\n", 0, len(rows) - len(body)))
    has_end = not body or body.rstrip(b" \t").endswith(b"\n")
    # as a rule there is nothing to strip, and no copy to be made
    is_clean = body.endswith(b"\n") and not body[-2:-1].isspace()
    rows = body if is_clean or not body else body.rstrip(edge) + b"\n"
    rows_found = rows.count(b"\n")
    if count is not None and rows_found != count:
        step = "" if snapshot.step is None else f", step {snapshot.step}"
        problem = f"the header counts {count} {what}, found {rows_found}: "
        problem += "the file is incomplete or damaged"
        error = CutError if rows_found < count or not has_end else ReadError
        raise error(f"{snapshot.path}{step}: {problem}")
    if not rows:
        kinds = {name: np.int64 if name in layout.whole else np.float64 for name in layout.names}
        return {name: np.zeros(0, kind) for name, kind in kinds.items()}
    if any(_had_polars):
        columns = fenced(columns_of, snapshot.path, rows, layout)
    else:
        columns = columns_of("", rows, layout)
    if columns is None:
        raise (ReadError if has_end else CutError)(_bad_line(snapshot, rows, layout))
    if not has_end:
        problem = f"{snapshot.path}: the last line has no end"
        if grows():
            raise CutError(f"{problem}: the file is still being written")
        warn(f"{problem}: if the file was cut, rows or digits may be missing")
    return columns


def columns_of(_path: str, rows: bytes, layout: Layout) -> Columns | None:
    """The columns of the rows; None if a row is wrong. May run in the worker process."""
    # polars would skip a carriage return inside a line, and decompress bytes that look compressed
    if b"\r" in rows or rows.startswith(LIKE_COMPRESSED):
        return None
    first = rows[: rows.find(b"\n")]
    is_spaced = layout.separator == " "
    if is_spaced and b"\t" in first:
        rows, first = rows.replace(b"\t", b" "), first.replace(b"\t", b" ")
    if is_spaced and (b"  " in first or first[:1] == b" "):
        rows = _single_blanks(rows)
    # with decimal commas, a point may separate thousands: only a check of the words finds that
    columns = None if layout.comma else _parsed(rows, layout, by_words=False)
    if columns is not None:
        return columns
    return _parsed(_single_blanks(rows) if is_spaced else rows, layout, by_words=True)


def _single_blanks(rows: bytes) -> bytes:
    """The rows with one blank between words and none around rows."""
    text = np.frombuffer(rows.replace(b"\t", b" "), np.uint8)
    kept: npt.NDArray[np.bool_] = text != ord(" ")
    kept[1:] |= kept[:-1].copy()
    return text[kept].tobytes().replace(b" \n", b"\n").replace(b"\n ", b"\n").lstrip(b" ")


def _parsed(rows: bytes, layout: Layout, by_words: bool) -> Columns | None:
    """
    The columns as polars reads them; None unless every row has all its words.

    With ``by_words`` polars reads words, and `_numbers` converts them: it knows more spellings.
    """
    import polars

    kinds: dict[str, Any] = dict.fromkeys(layout.whole, polars.Int64)
    kinds |= dict.fromkeys(layout.names if by_words else layout.text, polars.String)
    schema = {f"{k}": kinds.get(name, polars.Float64) for k, name in enumerate(layout.names)}
    first = rows[: rows.find(b"\n")].decode("utf-8", "replace")
    words = first.split(" ") if layout.separator == " " else words_of(first, layout.separator)
    is_behind = len(words) == len(layout.names) + 1 and not words[-1]
    if is_behind:  # a separator behind the last word
        schema["behind"] = polars.String
    try:
        frame = polars.read_csv(
            rows,
            has_header=False,
            separator=layout.separator,
            quote_char='"' if layout.separator != " " and b'"' in rows else None,
            schema=schema,
            encoding="utf8-lossy",
        )
    except (polars.exceptions.PolarsError, OSError):
        return None
    if is_behind and frame.drop_in_place("behind").null_count() < frame.height:
        return None
    if any(frame.null_count().row(0)):
        # polars reads a missing word as an empty word: count the separators
        bare = re.sub(rb'"[^"\n]*"', b"", rows) if b'"' in rows else rows
        signs = bare.count(layout.separator.encode())
        if layout.separator == " " or signs != frame.height * (len(schema) - 1):
            return None
    columns: Columns = {}
    for column, name in zip(frame, layout.names, strict=True):
        if by_words and name not in layout.text:
            column = _numbers(column, layout.comma, name in layout.whole)
        numeric = column.dtype.is_numeric()
        if name not in (*layout.text, *layout.optional) and (column.has_nulls() or not numeric):
            return None
        if name not in columns:
            texts = None if numeric else column.fill_null("").str.strip_chars().to_list()
            columns[name] = column.to_numpy() if texts is None else np.array(texts, dtype=np.str_)
    return columns


def _numbers(words: Any, comma: bool, is_whole: bool) -> Any:
    """A column of words as numbers, with gaps; unchanged if a word is not a number."""
    import polars

    words = words.str.strip_chars().replace("", None)
    if comma and words.str.contains(".", literal=True).any():
        return words
    texts = words.str.replace(",", ".", literal=True) if comma else words
    texts = texts.str.replace(r"^([-+]?[0-9.]+)[dD]([-+]?[0-9]+)$", "${1}e${2}")
    for kind in (polars.Int64, polars.Float64) if is_whole else (polars.Float64,):
        numbers = texts.cast(kind, strict=False)
        if numbers.null_count() == words.null_count():
            return numbers
    return words


def _bad_line(snapshot: Snapshot, rows: bytes, layout: Layout) -> str:
    """The message about the first wrong row, found by checking every word."""
    width, above = len(layout.names), 0
    with open(plain(snapshot.path), "rb") if snapshot.start else BytesIO() as stream:
        while stream.tell() < snapshot.start and stream.readline():
            above += 1
    for number, row in enumerate(rows.split(b"\n")[:-1], start=above + layout.line):
        where = f"{snapshot.path}, line {number}: expected"
        words = words_of(row.decode("utf-8", "replace"), layout.separator)
        if len(words) == width + 1 and not words[-1]:
            words.pop()
        if len(words) != width or row.count(b'"') % 2:
            return f"{where} {width} columns, found {len(words)}: {spelt(row)}"
        for name, word in zip(layout.names, words, strict=True):
            is_sound = is_number(word, layout.comma) and not (layout.comma and "." in word)
            if not is_sound and name not in (*layout.text, *layout.optional):
                comma = " with a decimal comma" * layout.comma
                found = spelt(word.encode()) if word.strip() else "nothing"
                return f"{where} a number{comma} in the column {name}, found {found}"
    return f"{snapshot.path}: cannot be read as a table of {width} columns"


def words_of(line: str, separator: str) -> list[str]:
    """The words of a row; with separators other than blanks, words may be empty or in quotes."""
    if separator == " ":
        return line.split()
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a word is longer than csv allows
        return line.split(separator)


def is_number(word: str, comma: bool = False) -> bool:
    """Whether a word is a number, including nan, inf and Fortran's D exponents."""
    return NUMBER.match(word.replace(",", ".", 1) if comma else word) is not None


def spelt(text: bytes) -> str:
    """A word or line as messages quote it."""
    return repr(text[:SHOWN].decode("utf-8", "replace").strip())


def text_of(snapshot: Snapshot) -> bytes:
    """The bytes of a snapshot or file, without a byte order mark."""
    file = plain(snapshot.path)
    stop = file.stat().st_size if snapshot.stop is None else snapshot.stop
    with open(file, "rb") as stream:
        stream.seek(snapshot.start)
        data = stream.read(max(stop - snapshot.start, 0))
    return data.removeprefix(b"\xef\xbb\xbf") if snapshot.start == 0 else data
