"""
The columns of a table of text, parsed by polars.

What polars takes as it stands is as fast as it can be; what it refuses, or reads as less than it
is, is looked at word by word in a second pass, which reads it or says what is wrong in which line.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.io.parse.sheet_layout import Layout, fields_of, refuse_control
from scanfab.io.parse.text_table import as_array, squeezed

Arrays = dict[int, npt.NDArray[Any]]

# how compressed files begin that are text at their first byte: polars would unpack them
LIKE_PACKED = (b"x\x01", b"x^", b"x\x9c", b"x\xda", b"(\xb5")
# at the beginning of a row, where it may be the heading of another table
COMMENT = r"^\s*(#|%|//|!)"
EMPTY_LINE = re.compile(rb"\n[ \t\r]*(?=\n)|\n[ \t]*(?:#|%|//|!)|\A[ \t\r]*\n")
LONGEST_WORD = 60
WITH_COMMA = r"^[-+0-9.eEdD\s]*,[-+0-9.,eEdD\s]*$"
# a number whose commas may stand before thousands: no decimal number has two, or begins with 0
THOUSANDS = r"^\s*[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+\s*$"


def read_columns(
    path: Path, data: bytes, layout: Layout, numbers: Collection[int], whole: Collection[int]
) -> Arrays:
    """
    The columns of a table by their place from 0.

    Parameters
    ----------
    path : Path
        For messages.
    data : bytes
        The whole text.
    layout : Layout
        How it is written.
    numbers : collection of int
        Columns that must hold a number in each row.
    whole : collection of int
        Those of them that are whole numbers, which stay exact whatever their size.

    Returns
    -------
    dict of int to ndarray
        Each of shape (N,): int64, float64 (NaN where a row is empty), or text.

    Raises
    ------
    ReadError
        If a row has more or fewer columns than the first, or a word is no number; names the line.
    """
    if not all(layout.are_numbers):
        _refuse_zeros(path, data)
    if not layout.has_commas:
        # runs of blanks are empty words to polars, which then refuses the row or has gaps in it
        found = _regular(data, layout, numbers, whole, skip=layout.first_line - 1)
        if found is not None:
            return found
    _refuse_zeros(path, data)
    rows = _rows(data, layout)
    if not rows:
        return {place: np.zeros(0) for place in range(layout.width)}
    plain = squeezed(rows) if layout.separator == " " else None
    body = bytes(rows) if plain is None else plain
    if layout.separator == " ":
        found = None if layout.has_commas else _regular(body, layout, numbers, whole)
        if found is not None:
            return found
    _check_lines(path, body, layout)
    return _word_by_word(path, body, layout, numbers, whole)


def _refuse_zeros(path: Path, data: bytes) -> None:
    """ReadError for a byte of zero among words, which no number has."""
    if b"\0" in data:
        refuse_control(path, data)


def _rows(data: bytes, layout: Layout) -> memoryview:
    """The rows, each with the end of its line."""
    end = len(data)
    while end > layout.start and data[end - 1] in b" \t\r\n":
        end -= 1
    line_end = data.find(b"\n", end)
    if end == layout.start:
        return memoryview(b"")
    if line_end < 0:
        return memoryview(data[layout.start :] + b"\n")
    return memoryview(data)[layout.start : line_end + 1]


def _check_lines(path: Path, body: bytes, layout: Layout) -> None:
    """ReadError where another table may begin among the rows."""
    found = EMPTY_LINE.search(body)
    if found is not None:
        line = layout.first_line + body.count(b"\n", 0, found.start() + 1)
        text = body[found.start() + 1 :].partition(b"\n")[0].strip()[:LONGEST_WORD]
        what = f"found {text.decode('utf-8', 'replace')!r}" if text else "found an empty line"
        raise ReadError(
            f"{path}, line {line}: expected rows to the end, {what}: one file holds one table of "
            f"one frame"
        )


def _parsed(
    body: bytes, separator: str, schema: Mapping[str, Any], *, has_quotes: bool, skip: int = 0
) -> Any:
    """A data frame; None if polars refuses the text."""
    import polars

    if body.startswith(LIKE_PACKED):
        return None
    try:
        return polars.read_csv(
            body,
            has_header=False,
            separator=separator,
            quote_char='"' if has_quotes else None,
            schema=schema,
            skip_lines=skip,
            encoding="utf8-lossy",
        )
    except (polars.exceptions.PolarsError, OSError):
        return None


def _regular(
    body: bytes, layout: Layout, numbers: Collection[int], whole: Collection[int], skip: int = 0
) -> Arrays | None:
    """
    The columns as polars reads them; None unless all rows surely have all words.

    Words of columns that need not be numbers may be empty, as behind a separator at the end.
    """
    import polars

    schema = {
        f"{place}": polars.Int64
        if place in whole
        else polars.Float64
        if layout.are_numbers[place]
        else polars.String
        for place in range(layout.width)
    }
    # a number with a quotation mark is none, and refused as such
    if not all(layout.are_numbers) and b'"' in body:
        return None
    frame = _parsed(body, layout.separator, schema, has_quotes=False, skip=skip)
    if frame is None or frame.height == 0:
        return None
    if schema["0"] == polars.String and frame["0"].str.contains(COMMENT).any():
        return None
    gaps = {place for place, count in enumerate(frame.null_count().row(0)) if count}
    # what has nothing in its first column may be a row of tabs
    if gaps and not (
        gaps.isdisjoint([0, *numbers, *whole]) and _has_all_signs(body, layout, frame)
    ):
        return None
    found = {place: _as_array(frame[f"{place}"]) for place in range(layout.width)}
    return None if any(found[place].dtype.kind not in "if" for place in numbers) else found


def _has_all_signs(body: bytes, layout: Layout, frame: Any) -> bool:
    """
    Whether gaps of a data frame are empty words between two signs, and no row lacks a word.

    Of too many words in a row polars makes an error, except in a last line without its end.
    """
    if layout.separator == " " or not all(layout.are_numbers) or not body.endswith(b"\n"):
        return False
    signs = body.count(layout.separator.encode(), layout.start)
    return bool(signs == frame.height * (layout.width - 1))


def _as_array(series: Any) -> npt.NDArray[Any]:
    """Numbers with NaN for what is empty; text."""
    if series.dtype.is_numeric():
        return as_array([series])
    return np.array(series.fill_null("").str.strip_chars().to_list(), dtype=np.str_)


def _word_by_word(
    path: Path, body: bytes, layout: Layout, numbers: Collection[int], whole: Collection[int]
) -> Arrays:
    """All words as text first, and then what they are."""
    import polars

    has_quotes = b'"' in body
    schema = dict.fromkeys((f"{place}" for place in range(layout.width)), polars.String)
    frame = _parsed(body, layout.separator, schema, has_quotes=has_quotes)
    rows = body.count(b"\n")
    signs = body.count(layout.separator.encode())
    ragged = not has_quotes and signs != rows * (layout.width - 1)
    if frame is None or frame.height != rows or ragged or has_quotes:
        _check_widths(path, body, layout)
    if frame is None or frame.height != rows:
        raise ReadError(f"{path}: cannot be read as a table of {layout.width} columns")
    if layout.has_commas:
        _refuse_thousands(path, frame)
    return {
        place: _column(path, frame[f"{place}"], layout, place, place in numbers, place in whole)
        for place in range(layout.width)
    }


def _refuse_thousands(path: Path, frame: Any) -> None:
    """ReadError if each comma of a table may as well be a sign of thousands."""
    found = None
    for words in frame.iter_columns():
        commas = words.filter(words.str.contains(WITH_COMMA))
        if not commas.str.contains(THOUSANDS).all():
            return
        found = commas[0] if found is None and len(commas) else found
    if found is not None:
        raise ReadError(
            f"{path}: {found.strip()!r} may be a decimal number or have a sign of thousands, as "
            f"may all numbers with a comma: write them with a point, without signs of thousands"
        )


def _column(
    path: Path, words: Any, layout: Layout, place: int, is_needed: bool, is_whole: bool
) -> npt.NDArray[Any]:
    import polars

    words = words.fill_null("").str.strip_chars()
    texts = words
    if layout.has_commas:
        # a point beside commas may be that of thousands
        points = words.str.contains(r"^[-+0-9.,eEdD]*\.[-+0-9.,eEdD]*$")
        if points.any():
            row = int(points.arg_max() or 0)
            raise _wrong(path, layout, row, place, words[row], "a number with a decimal comma")
        texts = words.str.replace(",", ".", literal=True)
    texts = texts.str.replace(r"^([-+]?[0-9.]+)[dD]([-+]?[0-9]+)$", "${1}e${2}")
    if is_whole:
        exact = texts.cast(polars.Int64, strict=False)
        if exact.null_count() == 0:
            return np.asarray(exact.to_numpy())
    values = texts.cast(polars.Float64, strict=False)
    wrong = values.is_null() if is_needed else values.is_null() & (words != "")
    if wrong.any():
        if not is_needed:
            return np.array(words.to_list(), dtype=np.str_)
        row = int(wrong.arg_max() or 0)
        raise _wrong(path, layout, row, place, words[row], "a number")
    return np.asarray(values.to_numpy())


def _wrong(path: Path, layout: Layout, row: int, place: int, word: str, expected: str) -> ReadError:
    name = layout.names[place] if layout.names is not None else f"{place + 1}"
    found = f"{word[:LONGEST_WORD]!r}" if word else "nothing"
    return ReadError(
        f"{path}, line {layout.first_line + row}: expected {expected} in the column {name}, found "
        f"{found}"
    )


def _check_widths(path: Path, body: bytes, layout: Layout) -> None:
    """ReadError for the first row that has not as many words as the others."""
    for number, line in enumerate(body.split(b"\n")[:-1], start=layout.first_line):
        text = line.decode("utf-8", "replace").rstrip("\r")
        found = fields_of(text, layout.separator)
        is_open = text.count('"') % 2
        if len(found) != layout.width or is_open:
            what = "a quotation mark without its second" if is_open else f"{len(found)}"
            raise ReadError(f"{path}, line {number}: expected {layout.width} columns, found {what}")
