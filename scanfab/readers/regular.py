"""
Long tables of text with one blank between two words: parsed by polars, and only where it is needed.

What is not regular (runs of blanks, tabs, words, lines of another width) is left to the tolerant
parser of the format, which reads it or says what is wrong in which line.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["LARGE", "TextTable", "read_regular"]

# bytes; a smaller table is parsed before polars is loaded
LARGE = 8 << 20
# bytes before the first row, up to which a table is parsed where it lies
HEADER = 1 << 16


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


def read_regular(table: TextTable, types: Mapping[int, type]) -> list[npt.NDArray[Any]] | None:
    """
    Some columns of a table; None if it is not regular.

    Every number is the double nearest to the text, as Python's float() has it, or just the whole
    number that the text is.

    Parameters
    ----------
    table : TextTable
        What to read.
    types : mapping of int to type
        The columns, from 0, and what they are to be: ``float`` or ``int``.

    Returns
    -------
    list of ndarray or None
        An array of shape (count,) for each column.
    """
    behind = _ends_with_blank(table)
    with ThreadPoolExecutor(1) as pool:
        # kernels and polars both let go of Python's lock
        spaces = pool.submit(_count_spaces, table)
        columns = _parse(table, types, behind)
        blanks_at_ends = table.count * behind
        expected = table.count * (table.width + behind), blanks_at_ends, blanks_at_ends
        return columns if spaces.result() == expected else None


def _count_spaces(table: TextTable) -> tuple[int, int, int]:
    """
    How much white space there is, how often it follows other, and how often lines end in a blank.

    If no two blanks stand together but at the end of each line, the words that polars sees are
    those of the line. If besides there are just as many as there should be, and no line lacks its
    last word, no line has a word more either.
    """
    from scanfab.kernels.text import LINE_END, count_spaces

    file = np.memmap(table.path, np.uint8, "r").view(np.ndarray)
    # from the line end before the first row
    text = file[table.start - 1 : table.stop]
    # a last line without its end may lack digits
    return count_spaces(text) if text[-1] == LINE_END else (-1, -1, -1)


def _parse(
    table: TextTable, types: Mapping[int, type], behind: bool
) -> list[npt.NDArray[Any]] | None:
    """The columns as polars sees them; None if a line has too few, or a word is no such number."""
    import polars

    names = [f"{place}" for place in range(table.width)]
    schema: dict[str, Any] = dict.fromkeys(names, polars.Float64)
    schema |= {names[place]: polars.Int64 for place, kind in types.items() if kind is int}
    if behind:
        schema["behind"] = polars.String
    wanted = list(dict.fromkeys([*(names[place] for place in types), names[-1]]))
    source, lines_before = _source(table)
    try:
        frame = (
            polars.scan_csv(
                source,
                has_header=False,
                separator=" ",
                quote_char=None,
                schema=schema,
                skip_lines=lines_before,
                n_rows=table.count,
                encoding="utf8-lossy",  # numbers are none, and nothing else is kept
                truncate_ragged_lines=True,  # blanks are counted elsewhere
                glob=False,
            )
            .select(wanted)
            .collect()
        )
    except polars.exceptions.PolarsError:
        return None
    if frame.height < table.count or any(frame.null_count().row(0)):
        return None
    # memory of numpy's own comes in large pages, which is faster, and can be kept as it is
    return [
        np.concatenate([chunk.to_numpy() for chunk in frame[names[place]].get_chunks()])
        for place in types
    ]


def _ends_with_blank(table: TextTable) -> bool:
    """Whether the first row does: polars sees an empty word behind it."""
    with open(table.path, "rb") as file:
        file.seek(table.start)
        return file.readline().endswith(b" \n")


def _source(table: TextTable) -> tuple[Path | bytes, int]:
    """Where polars finds the rows, and how many lines there are before them."""
    with open(table.path, "rb") as file:
        if table.start <= HEADER and table.stop == os.path.getsize(table.path):
            return table.path, file.read(table.start).count(b"\n")
        # a part of a file has to be taken out
        file.seek(table.start)
        return file.read(table.stop - table.start), 0
