"""
Long tables of text with one blank between two words: parsed by polars, and only where it is needed.

What is not regular (words, lines of another width) is left to the tolerant parser of the format,
which reads it or says what is wrong in which line.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Lock
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from scanfab.base.memory import free_memory
from scanfab.base.threads import in_order

# bytes; a smaller table is parsed before polars is loaded
LARGE = 8 << 20
# bytes that are parsed at a time: the memory of one piece serves the next, which is faster than new
PIECE = 16 << 20
# pieces under way: while polars parses one in several threads, another is counted, read or copied
WORKERS = 4


# bytes of rows in memory for which polars is worth loading, and that tell how they are written
LONG, PEEK = 2 << 20, 1 << 16
# a line that is not blank or a comment, as numpy has them
FILLED = re.compile(rb"^[ \t\r\f\v\x1c-\x1f\x85\xa0]*[^#\s\x1c-\x1f\x85\xa0]", re.MULTILINE)

# the name of what polars sees behind a separator at the end of a line
BEHIND = "behind"
# data frames of polars, whose columns are called by their places
Frames = list[Any]

# bytes that polars may need with all these pieces; without them it ends the process
ROOM = 3 << 29
# times the size of a text that its numbers may take, as polars has them and as arrays: two bytes
# may be a number
NUMBERS = 8


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
    Read some columns of a table, if it is regular.

    Every number is the double nearest to the text, as Python's float() has it, or just the whole
    number that the text is.

    Parameters
    ----------
    table : TextTable
        What to read.
    columns : mapping of int to ndarray
        Where the columns, from 0, are to be put: each of shape (count,), float64 or int64.

    Returns
    -------
    bool
        False if the table is not regular, or memory is short: what is in the arrays then has no
        meaning.
    """
    if free_memory() < ROOM:
        return False
    rows, kinds = 0, {place: column.dtype for place, column in columns.items()}
    # opened once: the file may be replaced by another while it is read
    with open(table.path, "rb") as file:
        file.seek(table.start)
        # polars sees an empty word behind such a line
        behind = file.readline().endswith(b" \n")
        parse = partial(_parse_piece, width=table.width, kinds=kinds, behind=behind, sign=" ")
        for frame in _parsed(file, table.start, table.stop, parse, PIECE):
            if frame is None or rows + frame.height > table.count:
                return False
            for place, column in columns.items():
                _put(frame[f"{place}"].get_chunks(), column[rows : rows + frame.height])
            rows += frame.height
    return rows == table.count


def has_pieces(path: Path) -> bool:
    """Whether an uncompressed file is so long that :func:`read_to_end` is faster than the whole."""
    return path.stat().st_size > PIECE


def read_to_end(
    path: Path, start: int, separator: str | None = None, whole: Collection[int] = ()
) -> list[npt.NDArray[Any]] | None:
    """
    All columns of the rows from a byte of an uncompressed file to its end, each of shape (N,).

    As :func:`parse_columns` has them, but only some pieces of the text are in memory, and one is
    parsed while another is read. Words stand apart by the separator, or by blanks and tabs. None if
    the text is not regular, or memory is short.
    """
    with open(path, "rb") as file:
        stop = file.seek(0, 2)
        if free_memory() < ROOM + NUMBERS * (stop - start):
            return None
        file.seek(start)
        way = _way_to_parse(file.readline(), separator, whole)
        frames = None if way is None else _all_of(_parsed(file, start, stop, *way))
    return None if frames is None else _columns_of(frames)


def _way_to_parse(
    line: bytes, separator: str | None, whole: Collection[int]
) -> tuple[Callable[[bytes], Any], int] | None:
    """
    What makes data frames of pieces of a text, by its first line, and how many bytes one has.

    None if the line is not regular.
    """
    sign = _sign(line) if separator is None else separator
    words = line.rstrip(b"\r\n").removesuffix(sign.encode()).split(sign.encode())
    behind = line.endswith(f"{sign}\n".encode())
    if behind and separator not in (None, " "):
        return None  # an empty word is a column, which another row may lack
    if all(words):
        kinds = _kinds(range(len(words)), whole)
        parse = partial(_parse_piece, width=len(words), kinds=kinds, behind=behind, sign=sign)
        return parse, PIECE
    width = len(line.split())
    if not sign.isspace() or width == 0:
        return None
    # two copies more of each are under way, and larger ones would not find their memory again
    return partial(_parse_squeezed, width=width, kinds=_kinds(range(width), whole)), PIECE // 2


def parse_columns(
    data: bytes, begin: int, end: int, whole: Collection[int] = ()
) -> list[npt.NDArray[Any]] | None:
    """
    All columns of the rows of numbers between two bytes of a text, each of shape (N,).

    Those that must be whole numbers are int64, the others float64. Blanks and tabs may stand around
    words in any number. None if the rows are few, or not regular otherwise, or if columns that must
    be whole numbers are not: the tolerant parser is then to read them, or to say what is wrong.
    """
    frames = _frames_of(data, begin, end, whole)
    return None if frames is None else _columns_of(frames)


def parse_rows(data: bytes, begin: int, end: int) -> npt.NDArray[np.float64] | None:
    """The same as one array, shape (N, columns)."""
    frames = _frames_of(data, begin, end)
    return None if frames is None else _stacked(frames, range(_width(frames)))


def parse_some(
    text: bytes, width: int, places: Sequence[int], whole: Collection[int]
) -> npt.NDArray[np.float64] | None:
    """
    Some columns of rows of words with one blank between them, shape (N, columns).

    None if the rows are few, or if one is not regular or has no such number there: words of other
    columns may be anything.
    """
    long = len(text) >= LONG
    frames = _parse_all(text, width, " ", _kinds(places, whole)) if long else None
    return None if frames is None else _stacked(frames, places)


def _frames_of(data: bytes, begin: int, end: int, whole: Collection[int] = ()) -> Frames | None:
    first = FILLED.search(data, begin, end)
    stop = data.rfind(b"\n", begin, end) + 1
    if end - begin < LONG or first is None or stop <= first.start() or data[stop:end].strip():
        return None
    while data[stop - 2 : stop] == b"\n\n":
        stop -= 1
    text = data[first.start() : stop]
    line = text[: text.find(b"\n")]
    width, sign = len(line.split()), _sign(line)
    kinds = _kinds(range(width), whole)
    found = None
    # elsewhere a second try is the first: words stand apart by more than one sign
    if line[:1] > b" " and len(line.rstrip(sign.encode()).split(sign.encode())) == width:
        found = None if b"  " in text[:PEEK] else _parse_all(text, width, sign, kinds)
    if found is None:
        plain = _plain(text)
        found = None if plain is None else _parse_all(plain, width, " ", kinds)
    return found


def _sign(line: bytes) -> str:
    return "\t" if b"\t" in line else " "


def _kinds(places: Iterable[int], whole: Collection[int]) -> dict[int, np.dtype[Any]]:
    return {k: np.dtype(np.int64 if k in whole else np.float64) for k in places}


def _has_lone_returns(text: bytes) -> bool:
    """Whether a carriage return ends no line: polars passes over one behind a number."""
    return b"\r" in text and text.count(b"\r") != text.count(b"\r\n")


def _plain(text: bytes) -> bytes | None:
    return None if _has_lone_returns(text) else squeezed(text)


def squeezed(text: bytes | memoryview) -> bytes | None:
    """Rows with one blank between two words, and none around them; None if it is no plain text."""
    from scanfab.io.parse.kernels import single_blanks

    out = np.empty(len(text), np.uint8)
    size = single_blanks(np.frombuffer(text, np.uint8), out)
    return None if size < 0 else out[:size].tobytes()


def _parse_all(
    text: bytes, width: int, sign: str, kinds: Mapping[int, np.dtype[Any]]
) -> Frames | None:
    """The data frames of a long text one behind the other, if it is regular; else None."""
    if free_memory() < ROOM + 2 * len(text):
        return None
    behind = text[: text.find(b"\n") + 1].endswith(f"{sign}\n".encode())

    def pieces() -> Iterator[Any]:
        start = 0
        while start < len(text):
            stop = text.find(b"\n", min(start + PIECE, len(text) - 1)) + 1 or len(text)
            yield _parse_piece(text[start:stop], width, kinds, behind, sign)
            start = stop

    return _all_of(pieces())


def _all_of(frames: Iterator[Any]) -> Frames | None:
    """All of them; None if one is."""
    found = []
    for frame in frames:
        if frame is None:
            return None
        found.append(frame)
    return found


def _width(frames: Frames) -> int:
    return sum(name != BEHIND for name in frames[0].columns)


def _columns_of(frames: Frames) -> list[npt.NDArray[Any]]:
    # out of the frames, so that their memory serves the next column
    return [
        as_array([frame.drop_in_place(f"{k}") for frame in frames]) for k in range(_width(frames))
    ]


def _stacked(frames: Frames, places: Sequence[int]) -> npt.NDArray[np.float64]:
    values = np.empty((len(places), sum(frame.height for frame in frames)))
    for place, column in zip(places, values, strict=True):
        _put([part for frame in frames for part in frame[f"{place}"].get_chunks()], column)
    return values.T


def as_array(columns: Sequence[Any]) -> npt.NDArray[Any]:
    """Series of polars, without gaps, one behind the other as an array that is no view of them."""
    kind = np.int64 if columns[0].dtype.is_integer() else np.float64
    array = np.empty(sum(map(len, columns)), kind)
    _put([part for column in columns for part in column.get_chunks()], array)
    return array


def _put(parts: Sequence[Any], column: npt.NDArray[Any]) -> None:
    start = 0
    for part in parts:
        column[start : start + len(part)] = part.to_numpy()
        start += len(part)


def _parsed(
    file: IO[bytes], start: int, stop: int, parse: Callable[[bytes], Any], size: int
) -> Iterator[Any]:
    """The data frames of a table's pieces, in their order; None for one that is not regular."""
    pieces, lock = list(_pieces(file, start, stop, size)), Lock()

    def parse_piece(begin: int, end: int) -> Any:
        with lock:
            file.seek(begin)
            text = file.read(end - begin)
        return parse(text)

    with ThreadPoolExecutor(WORKERS) as pool:
        yield from in_order(pool, (partial(parse_piece, *piece) for piece in pieces), 2 * WORKERS)


def _pieces(file: IO[bytes], start: int, stop: int, size: int) -> Iterator[tuple[int, int]]:
    """First bytes, and those behind the last, of parts of a table that are whole lines."""
    while start < stop:
        place = file.seek(start + size)
        end = min(place + len(file.readline()), stop)
        yield start, end
        start = end


def _parse_squeezed(text: bytes, width: int, kinds: Mapping[int, np.dtype[Any]]) -> Any:
    plain = _plain(text)
    return None if plain is None else _parse_piece(plain, width, kinds, behind=False, sign=" ")


def _parse_piece(
    text: bytes, width: int, kinds: Mapping[int, np.dtype[Any]], behind: bool, sign: str
) -> Any:
    """
    The columns of some lines; None if they are not regular.

    Where all columns are wanted, polars refuses a line with more words, and has gaps in one with
    fewer. Where only some are, it must be told not to look at the ends of lines: but if no two
    blanks stand together except there, the words that it sees are those of the line, and if there
    are just as many as there should be, and no line lacks its last word, no line has a word more.
    """
    # a last line without its end may lack digits; a byte order mark would be passed over
    if not text.endswith(b"\n") or not text[:1].isascii():
        return None
    frame = _parse(text, width, kinds, behind, sign)
    if frame is None or len(kinds) == width:
        return None if _has_lone_returns(text) else frame
    from scanfab.io.parse.kernels import count_spaces

    rows = frame.height
    blanks_at_ends = rows * behind
    expected = rows * (width + behind), blanks_at_ends, blanks_at_ends
    return frame if count_spaces(np.frombuffer(text, np.uint8)) == expected else None


def _parse(
    text: bytes, width: int, kinds: Mapping[int, np.dtype[Any]], behind: bool, sign: str
) -> Any:
    """The columns as polars sees them; None if a line has too few, or a word is no such number."""
    import polars

    names = [f"{place}" for place in range(width)]
    schema: dict[str, Any] = dict.fromkeys(names, polars.Float64)
    schema |= {names[place]: polars.Int64 for place, kind in kinds.items() if kind == np.int64}
    if behind:
        schema[BEHIND] = polars.String
    are_all = len(kinds) == width
    wanted = list(schema) if are_all else list({names[place]: 0 for place in [*kinds, -1]})
    try:
        frame = (
            polars.scan_csv(
                text,
                has_header=False,
                separator=sign,
                quote_char=None,
                schema=schema,
                encoding="utf8-lossy",  # numbers are none, and nothing else is kept
                truncate_ragged_lines=not are_all,  # blanks are then counted elsewhere
                glob=False,
            )
            .select(wanted)
            .collect()
        )
    except (polars.exceptions.PolarsError, OSError):  # the latter: like a compressed file
        return None
    gaps = dict(zip(wanted, frame.null_count().row(0), strict=True))
    is_full = gaps.pop(BEHIND, frame.height) == frame.height and not any(gaps.values())
    return frame if is_full else None
