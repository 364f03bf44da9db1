"""
How a table of text is written: its encoding, separator, decimal sign, names, and first row.

Found by trying what programs and spreadsheets write, and taken only if every word of the first
rows then is what it should be.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from scanfab.base.errors import ReadError
from scanfab.io.files import check_memory, plain
from scanfab.io.unpacking import check_lines

# of a file, in which the names and the first rows stand
HEAD = 1 << 18
# times the size of a text that it takes with its numbers
IN_MEMORY = 8.0
# rows that are looked at to tell how the others are written
SAMPLE = 20
# bytes of such a row, of which at least two fit into what is looked at; and its columns
LONGEST_ROW, MOST_COLUMNS = HEAD // 4, 4096
NUMBER = re.compile(
    r"[-+]?(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eEdD][-+]?[0-9]+)?|(?:nan|inf|infinity))\Z",
    re.IGNORECASE,
)
COMMENTS = ("#", "%", "//", "!")
CONTROL = bytes([*range(0x09), *range(0x0E, 0x20)])
# a blank stands for any run of blanks and tabs
SEPARATORS = ("\t", ";", ",", " ")


@dataclass(frozen=True)
class Layout:
    """How the rows of a table are written."""

    separator: str
    """One sign; a blank stands for any run of blanks and tabs."""
    has_commas: bool
    """Whether the decimal sign is a comma."""
    names: tuple[str, ...] | None
    """Of the columns, as they stand there; None: the table has none."""
    width: int
    """Number of columns; those behind the named ones are empty."""
    first_line: int
    """Of the first row, from 1."""
    start: int
    """Byte of the first row in the text."""
    are_numbers: tuple[bool, ...]
    """Which columns hold numbers, by the first rows."""


def is_number(word: str) -> bool:
    """Whether a word is a number, with D exponents and not-a-number among them."""
    return NUMBER.match(word.strip()) is not None


def read_text(path: Path, size: int = -1) -> bytes:
    """
    A text, or its first bytes, as UTF-8 with newlines.

    Raises
    ------
    ReadError
        If it begins with bytes that no text has.
    """
    file = plain(path)
    if size < 0:
        check_memory(path, IN_MEMORY * file.stat().st_size)
        check_lines(path, file)
    with open(file, "rb") as stream:
        data = stream.read(size)
    data = _decoded(path, data, size >= 0)
    refuse_control(path, data, HEAD)
    if b"\r" in data[:HEAD] and b"\n" not in data[:HEAD]:
        data = data.replace(b"\r", b"\n")
    return data


def refuse_control(path: Path, data: bytes, size: int | None = None) -> None:
    """ReadError if a text, or its first bytes, holds bytes that no text has."""
    head = data[:size]
    # ten times as fast as to search for them where there are none
    if len(head.translate(None, CONTROL)) == len(head):
        return
    found = re.search(b"[" + re.escape(CONTROL) + b"]", head)
    assert found is not None
    line = data.count(b"\n", 0, found.start()) + 1
    raise ReadError(
        f"{path}, line {line}: expected text, found the byte {found[0][0]}: this is no table of "
        f"text"
    )


def _decoded(path: Path, data: bytes, is_part: bool) -> bytes:
    """The text as UTF-8, or as what shares its digits and signs."""
    if data.startswith(b"\xef\xbb\xbf"):
        return data[3:]
    if data.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        raise ReadError(f"{path}: this is UTF-32: save the table as UTF-8")
    encoding = None
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif len(data) > 3 and data[1] == data[3] == 0 != data[0]:
        encoding = "utf-16-le"
    elif len(data) > 3 and data[0] == data[2] == 0 != data[1]:
        encoding = "utf-16-be"
    if encoding is None:
        return data
    try:
        text = data[: len(data) // 2 * 2].decode(encoding, "ignore" if is_part else "strict")
    except UnicodeDecodeError as error:
        raise ReadError(f"{path}: cannot be read as UTF-16: {error.reason}") from None
    return text.encode("utf-8", "replace")


def layout_of(path: Path, data: bytes, skip: int) -> Layout:
    """
    How a table is written.

    Parameters
    ----------
    path : Path
        For messages.
    data : bytes
        The text, or the beginning of it.
    skip : int
        Lines before the table.

    Raises
    ------
    ReadError
        If it is no table: the first rows differ in width, or are neither names nor numbers.
    """
    lines = _lines(path, data, skip)
    while lines and not lines[-1][2].strip():
        lines.pop()
    comment: str | None = None
    while lines and (not lines[0][2].strip() or lines[0][2].lstrip().startswith(COMMENTS)):
        comment = lines.pop(0)[2]
    if not lines:
        raise ReadError(f"{path}: expected a table, found no row")
    separator, has_commas = _separator(path, [text for _, _, text in lines])
    rows = [fields_of(text, separator) for _, _, text in lines]
    names: tuple[str, ...] | None = None
    # a name beside a number is no header: "P 0.3 1.2 4.1" is a row whose first column is a word
    is_value = [_is_value(word, has_commas) for word in rows[0] if word]
    if is_value and not any(is_value):
        words = fields_of(lines[0][2].strip(), separator)
        names = tuple(word.strip() for word in words)
        lines, rows = lines[1:], rows[1:]
    elif comment is not None:
        names = _names_in_comment(comment, separator, len(rows[0]))
    if not lines:
        number = lines_before(data, skip)
        assert names is not None
        kinds = (True,) * len(names)
        return Layout(separator, has_commas, names, len(names), number, len(data), kinds)
    width = len(rows[0])
    for (number, _, _), row in zip(lines, rows, strict=True):
        if len(row) != width:
            raise ReadError(
                f"{path}, line {number}: expected {width} columns as in line {lines[0][0]}, "
                f"found {len(row)}"
            )
    if names is not None:
        names = _checked_names(path, names, rows, lines[0][0])
    kinds = tuple(
        all(not word.strip() or _is_value(word, has_commas) for word in column)
        for column in zip(*rows, strict=True)
    )
    return Layout(separator, has_commas, names, width, lines[0][0], lines[0][1], kinds)


def first_rows(data: bytes, layout: Layout) -> list[list[str]]:
    """The words of the first rows, of which the text holds the beginning."""
    lines = data[layout.start :].split(b"\n", SAMPLE)
    whole = lines[:SAMPLE] if len(data) < HEAD else lines[:-1] or lines
    texts = [_as_text(line).rstrip("\r") for line in whole]
    rows = [fields_of(text, layout.separator) for text in texts if text.strip()]
    return [row for row in rows if len(row) == layout.width]


def lines_before(data: bytes, skip: int) -> int:
    """The number of the line behind the last."""
    return data.count(b"\n") + 1 + (not data.endswith(b"\n"))


def _lines(path: Path, data: bytes, skip: int) -> list[tuple[int, int, str]]:
    """Numbers, first bytes and texts of the lines that are looked at, all of them whole."""
    place = 0
    for _ in range(skip):
        place = data.find(b"\n", place) + 1
        if place == 0:
            lines = data.count(b"\n")
            raise ReadError(f"{path}: `skip={skip}` leaves no line: it has {lines}")
    found: list[tuple[int, int, str]] = []
    number, filled = skip + 1, 0
    while place < len(data) and filled <= SAMPLE:
        end = data.find(b"\n", place)
        end = len(data) if end < 0 else end
        if end - place > LONGEST_ROW:
            raise ReadError(
                f"{path}, line {number}: expected a row of at most {LONGEST_ROW} bytes, found "
                f"{end - place if end < len(data) else 'more'}: is this a table of grains?"
            )
        text = _as_text(data[place:end]).rstrip("\r")
        found.append((number, place, text))
        filled += bool(text.strip()) and not text.lstrip().startswith(COMMENTS)
        place, number = end + 1, number + 1
    # where only the beginning of a file is looked at, its last line may be cut
    if place > len(data) and len(data) == HEAD and len(found) > 1:
        found.pop()
    return found


def _as_text(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def fields_of(line: str, separator: str) -> list[str]:
    """The words of a line; of one between blanks none is empty."""
    if separator == " ":
        return line.split()
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a word of a length that no name or number has
        return line.split(separator)


def _is_value(word: str, has_commas: bool) -> bool:
    return is_number(word.replace(",", ".", 1) if has_commas and "." not in word else word)


def check_width(path: Path, width: int) -> None:
    """ReadError for more columns than any table of grains has: each would take its time."""
    if width > MOST_COLUMNS:
        raise ReadError(f"{path}: expected at most {MOST_COLUMNS} columns, found {width}")


def _separator(path: Path, lines: Sequence[str]) -> tuple[str, bool]:
    """What stands between columns, and whether a comma is the decimal sign."""
    best, choice = 0.0, (" ", False)
    for separator in SEPARATORS:
        if not any(separator in line.strip() for line in lines):
            continue
        rows = [fields_of(line, separator) for line in lines]
        check_width(path, max(map(len, rows)))
        # names of columns say nothing, but where there is nothing else
        rows = rows[1:] or rows
        words = [word for row in rows for word in row]
        if not words:
            continue
        same = sum(len(row) == len(rows[0]) and len(row) > 1 for row in rows) / len(rows)
        for has_commas in (False, True) if separator != "," else (False,):
            numbers = sum(not word or _is_value(word, has_commas) for word in words) / len(words)
            if same * (1e-3 + numbers) > best + 1e-9:
                best, choice = same * (1e-3 + numbers), (separator, has_commas)
    return choice


def _names_in_comment(comment: str, separator: str, width: int) -> tuple[str, ...] | None:
    """The names in the line above the rows, as ``numpy.savetxt`` writes them, if it is such."""
    text = comment.strip().lstrip("#%!/").strip()
    for one in dict.fromkeys((separator, " ", ",", ";")):
        words = [word.strip() for word in fields_of(text, one)]
        if len(words) == width and not any(map(is_number, words)) and all(words):
            return tuple(words)
    return None


def _checked_names(
    path: Path, names: tuple[str, ...], rows: Sequence[Sequence[str]], line: int
) -> tuple[str, ...]:
    """One name for each column; a column without a name must be empty, and the last."""
    width = len(rows[0])
    while len(names) > width and not names[-1]:
        names = names[:-1]
    surplus = width - len(names)
    if surplus == 1 and not any(row[-1] for row in rows):
        names = (*names, "")
    if len(names) != width:
        raise ReadError(
            f"{path}, line {line}: the names of the columns are {len(names)} "
            f"({', '.join(names[:8])}), but {width} columns follow: it cannot be told which name "
            f"is whose; skip them with `skip`, and name columns by their numbers with `columns`"
        )
    if len(rows) > 1 and not any(map(is_number, rows[0])) and any(map(is_number, rows[1])):
        raise ReadError(
            f"{path}, line {line}: expected numbers below the names, found "
            f"{' '.join(rows[0])[:60]!r}: skip these lines with `skip`, and name columns by their "
            f"numbers with `columns`"
        )
    return names
