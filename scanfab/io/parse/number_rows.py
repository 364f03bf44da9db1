"""Rows of numbers with comments, and numpy's messages about them in users' words."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError

# whole numbers from here on may be rounded as decimals
ROUNDED = 2.0**53


def rows_of_numbers(
    path: Path, data: bytes, begin: int = 0, end: int | None = None, above: int = 0
) -> npt.NDArray[np.float64]:
    """
    The numbers between two bytes of a text, shape (N, columns); lines may end in a comment.

    ``above`` lines of the file stand before the text.

    Raises
    ------
    ReadError
        If a word is no number, or rows differ in width; names the line.
    """
    try:
        values: npt.NDArray[np.float64] = np.loadtxt(
            io.BytesIO(data[begin:end]), dtype=np.float64, ndmin=2, comments="#", encoding="latin1"
        )
    except ValueError as error:
        reason, row = plain_reason(str(error))
        raise ReadError(f"{path}{_line_of(data, begin, row, above)}: {reason}") from None
    return values


def exact_column(values: npt.NDArray[np.float64], rows: bytes, place: int) -> npt.NDArray[Any]:
    """
    A column of rows that were read as decimals; anew as whole numbers if decimals may round them.

    Parameters
    ----------
    values : ndarray, shape (N, columns)
        As they were read.
    rows : bytes
        The text that they were read from, with nothing else but comments.
    place : int
        Which column.
    """
    column = values[:, place]
    with np.errstate(invalid="ignore"):
        if not np.any(np.abs(column) >= ROUNDED) or np.any(column != np.rint(column)):
            return column
    try:
        return np.loadtxt(
            io.BytesIO(rows), np.int64, ndmin=1, usecols=place, comments="#", encoding="latin1"
        )
    except (ValueError, OverflowError):
        return column  # 1e17 and the like


def number_or_nan(word: str) -> float:
    """A word of a column of text: names of kinds may be numbers, too."""
    try:
        return float(word)
    except ValueError:
        return float("nan")


def plain_reason(reason: str) -> tuple[str, int | None]:
    """What numpy says of a row, without its number, and that, from 0 and without empty lines."""
    match = re.search(r"at row (\d+)", reason)
    row = None
    if match is not None:
        row = int(match[1]) - ("changed" in reason)
        reason = reason[: match.start()].rstrip(" ;,")
    if "embedded newline" in reason:
        reason = "expected the end of the line behind a carriage return, found none"
    reason = reason.replace("could not convert string", "expected a number, found")
    return reason.replace(" to float64", ""), row


def _line_of(data: bytes, begin: int, row: int | None, above: int) -> str:
    lines = data[begin:].split(b"\n")
    filled = [number for number, line in enumerate(lines) if line.partition(b"#")[0].strip()]
    if row is None or row >= len(filled):
        return ""
    before = above + data.count(b"\n", 0, begin)
    return f", line {before + 1 + filled[row]}"
