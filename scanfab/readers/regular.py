"""
Long tables of text with one blank between two words: parsed by polars, and only where it is needed.

What is not regular (runs of blanks, tabs, words, lines of another width) is left to the tolerant
parser of the format, which reads it or says what is wrong in which line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["LARGE", "TextTable", "read_regular"]

# bytes; a smaller table is parsed before polars is loaded
LARGE = 8 << 20
# bytes that are parsed at a time: the memory of one piece serves the next, which is faster than new
PIECE = 16 << 20
# pieces on their way: while polars parses one in several threads, others are read, counted, copied
WORKERS = 4


@dataclass(frozen=True)
class TextTable:
    """Where a table stands in an uncompressed file."""

    path: Path
    start: int
    """First byte of the first row."""
    stop: int
    """Byte behind the last row."""
    width: int
    """Number of columns."""
    count: int
    """Number of rows."""


def read_regular(table: TextTable, columns: Mapping[int, npt.NDArray[Any]]) -> bool:
    """
    Some columns of a table; False if it is not regular.

    Every number is the double nearest to the text, as Python's float() has it, or just the whole
    number that the text is.

    Parameters
    ----------
    table : TextTable
        What to read.
    columns : mapping of int to ndarray
        Where the columns, from 0, are to be put: each of shape (count,), float64 or int64.
    """
    behind = _ends_with_blank(table)
    kinds = {place: column.dtype for place, column in columns.items()}
    rows = 0
    with ThreadPoolExecutor(WORKERS) as pool:
        for frame in pool.map(partial(_read_piece, table, kinds, behind), _pieces(table)):
            if frame is None or rows + frame.height > table.count:
                return False
            for place, column in columns.items():
                _put(frame[f"{place}"].get_chunks(), column[rows : rows + frame.height])
            rows += frame.height
    return rows == table.count


def _put(parts: list[Any], column: npt.NDArray[Any]) -> None:
    """Series of polars one behind the other into an array."""
    start = 0
    for part in parts:
        column[start : start + len(part)] = part.to_numpy()
        start += len(part)


def _pieces(table: TextTable) -> Iterator[tuple[int, int]]:
    """First bytes, and those behind the last, of parts of the table that are whole lines."""
    start = table.start
    with open(table.path, "rb") as file:
        while start < table.stop:
            place = file.seek(start + PIECE)
            stop = min(place + len(file.readline()), table.stop)
            yield start, stop
            start = stop


def _read_piece(
    table: TextTable, kinds: Mapping[int, np.dtype[Any]], behind: bool, piece: tuple[int, int]
) -> Any:
    """
    The columns of some lines; None if they are not regular.

    If no two blanks stand together but at the end of each line, the words that polars sees are
    those of the line. If besides there are just as many as there should be, and no line lacks its
    last word, no line has a word more either.
    """
    from scanfab.kernels.text import count_spaces

    start, stop = piece
    with open(table.path, "rb") as file:
        file.seek(start)
        text = file.read(stop - start)
    # a last line without its end may lack digits
    frame = _parse(text, table.width, kinds, behind) if text.endswith(b"\n") else None
    if frame is None:
        return None
    rows = frame.height
    blanks_at_ends = rows * behind
    expected = rows * (table.width + behind), blanks_at_ends, blanks_at_ends
    return frame if count_spaces(np.frombuffer(text, np.uint8)) == expected else None


def _parse(text: bytes, width: int, kinds: Mapping[int, np.dtype[Any]], behind: bool) -> Any:
    """The columns as polars sees them; None if a line has too few, or a word is no such number."""
    import polars

    names = [f"{place}" for place in range(width)]
    schema: dict[str, Any] = dict.fromkeys(names, polars.Float64)
    schema |= {names[place]: polars.Int64 for place, kind in kinds.items() if kind == np.int64}
    if behind:
        schema["behind"] = polars.String
    wanted = list(dict.fromkeys([*(names[place] for place in kinds), names[-1]]))
    try:
        frame = (
            polars.scan_csv(
                text,
                has_header=False,
                separator=" ",
                quote_char=None,
                schema=schema,
                encoding="utf8-lossy",  # numbers are none, and nothing else is kept
                truncate_ragged_lines=True,  # blanks are counted elsewhere
                glob=False,
            )
            .select(wanted)
            .collect()
        )
    except polars.exceptions.PolarsError:
        return None
    return None if any(frame.null_count().row(0)) else frame


def _ends_with_blank(table: TextTable) -> bool:
    """Whether the first row does: polars sees an empty word behind it."""
    with open(table.path, "rb") as file:
        file.seek(table.start)
        return file.readline().endswith(b" \n")
