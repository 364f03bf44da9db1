"""How a table of text is written, by its first rows: separator, decimal sign, names of columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from scanfab.base.errors import ReadError
from scanfab.io.files import first_bytes, plain
from scanfab.io.reader import Snapshot
from scanfab.io.text import (
    Columns,
    Layout,
    is_number,
    read_rows,
    spelt,
    text_of,
    warn_of_end,
    words_of,
)

# bytes of a file that are looked at, the rows among them, and the most columns a table has
HEAD, SAMPLE, MOST_COLUMNS = 1 << 18, 20, 4096
COMMENTS = ("#", "%", "//", "!")
CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
# a word with a comma, and one whose comma may stand before thousands: no decimal number has two
# commas, or begins with 0
WITH_COMMA = re.compile(rb"[-+0-9.eE]*,[-+0-9.,eE]*")
THOUSANDS = re.compile(rb"[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+")
# a blank stands for any run of blanks and tabs
SEPARATORS = ("\t", ";", ",", " ")


class Line(NamedTuple):
    """A line of a file: its number from 1, its first byte and its text."""

    number: int
    start: int
    text: str


class TextTable(NamedTuple):
    """A table of text, as its first rows show it."""

    layout: Layout
    """With the numbers of columns as names where the table has none (or one twice)."""
    names: list[str] | None
    """As they stand there; None if the table has none."""
    start: int
    """Byte of the first row in the file."""
    rows: list[list[str]]
    """The words of the first rows."""

    @property
    def own(self) -> Sequence[str]:
        """The names of columns, or their numbers."""
        return self.names or self.layout.names


def text_table(path: Path, skip: int) -> TextTable:
    """
    How a table is written.

    Parameters
    ----------
    path : Path
        A file, which may be compressed.
    skip : int
        Lines before the table.

    Raises
    ------
    ReadError
        If it is no table: no text, or its first rows differ in width.
    """
    *lines, end = _lines(path, skip)
    above = ""
    while lines and (not lines[0].text.strip() or lines[0].text.lstrip().startswith(COMMENTS)):
        above = lines.pop(0).text
    lines = [line for line in lines if line.text.strip()][: SAMPLE + 1]
    if not lines:
        raise ReadError(f"{path}: expected a table, found no row")
    separator, comma = _separator([line.text for line in lines])
    rows = [words_of(line.text, separator) for line in lines]
    names: list[str] | None = None
    # a name beside a number is no header: "P 0.3 1.2 4.1" is a row
    if not any(is_number(word, comma) for word in rows[0]):
        text = lines[0].text.strip().rstrip(separator)
        names = [word.strip() for word in words_of(text, separator)]
        lines, rows = lines[1:], rows[1:]
    elif above:
        names = _names_in_comment(above, separator, len(rows[0]))
    width = len(rows[0]) if rows else len(names or ())
    check_width(path, width)
    for line, row in zip(lines, rows, strict=True):
        # rows below names that are cut are found when the table is read
        if names is None and len(row) != width:
            raise ReadError(
                f"{path}, line {line.number}: expected {width} columns as in line "
                f"{lines[0].number}, found {len(row)}"
            )
    if width > 1 and len(names or ()) != width and rows and not any(row[-1] for row in rows):
        width -= 1  # there is a separator at the end of each row
    line = lines[0] if rows else end
    layout = Layout(tuple(unique(names or [""] * width)), separator, line.number, comma=comma)
    return TextTable(layout, names, line.start, [row[:width] for row in rows])


def read_text(
    path: Path, table: TextTable, numbers: Sequence[str], whole: Sequence[str]
) -> Columns:
    """
    All columns of a table of text.

    Parameters
    ----------
    path : Path
        Of the file.
    table : TextTable
        How it is written.
    numbers : sequence of str
        Columns that must hold a number in each row; others may have gaps or hold words.
    whole : sequence of str
        Columns among them that hold whole numbers.

    Raises
    ------
    ReadError
        If a row does not fit the columns, or a comma may stand before thousands.
    """
    check_names(path, table)
    snapshot = Snapshot(path, start=table.start)
    rows = text_of(snapshot)
    if not rows and not plain(path).read_bytes().endswith(b"\n"):
        warn_of_end(path)
    doubtful = [one[0] for one in WITH_COMMA.finditer(rows)] if table.layout.comma else []
    if doubtful and all(map(THOUSANDS.fullmatch, doubtful)):
        raise ReadError(
            f"{path}: {doubtful[0].decode()!r} may be a decimal number or have a sign of "
            f"thousands, as may all numbers with a comma: write them with a point, without signs "
            f"of thousands"
        )
    optional = [name for name in table.layout.names if name not in numbers]
    layout = table.layout._replace(line=1, whole=whole, optional=optional)
    return read_rows(snapshot, rows, layout)


def check_names(path: Path, table: TextTable) -> None:
    """ReadError if the first row has more or fewer columns than there are names."""
    width, names = len(table.rows[0]) if table.rows else 0, table.names or ()
    if names and table.rows and len(names) != width:
        raise ReadError(
            f"{path}, line {table.layout.line}: the columns have {len(names)} names "
            f"({', '.join(names[:8])}), but {width} columns follow: it cannot be told which name "
            f"is whose; skip the names with `skip`, and name columns by their numbers with "
            f"`columns`"
        )


def check_width(path: Path, width: int) -> None:
    """ReadError for more columns than any table of grains has: each would take its time."""
    if width > MOST_COLUMNS:
        raise ReadError(f"{path}: expected at most {MOST_COLUMNS} columns, found {width}")


def _lines(path: Path, skip: int) -> list[Line]:
    """The lines that are looked at, without those to be skipped, and where the next one begins."""
    head = first_bytes(path, HEAD)
    if found := CONTROL.search(head):
        line = head.count(b"\n", 0, found.start()) + 1
        raise ReadError(
            f"{path}, line {line}: expected text, found the byte {found[0][0]}: this is no "
            f"table of text (or it is UTF-16: save it as UTF-8)"
        )
    texts = head.removeprefix(b"\xef\xbb\xbf").split(b"\n")
    if len(head) == HEAD:
        texts.pop()  # which is cut
    if not texts or (len(texts) == 1 and b"\r" in texts[0].rstrip()):
        raise ReadError(f"{path}: expected rows of a table, found {spelt(head)} without a line end")
    if skip >= len(texts):
        raise ReadError(f"{path}: `skip={skip}` leaves no line: it has {len(texts)}")
    lines, start = [], len(head) - len(head.removeprefix(b"\xef\xbb\xbf"))
    for number, text in enumerate(texts, start=1):
        lines.append(Line(number, start, _decoded(text).rstrip("\r")))
        start += len(text) + 1
    return [*lines[skip:], Line(len(texts) + 1, start, "")]


def _decoded(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _separator(lines: Sequence[str]) -> tuple[str, bool]:
    """What stands between columns, and whether a comma is the decimal sign: by most numbers."""
    best, choice = 0.0, (" ", False)
    # names of columns say nothing, unless there is nothing else
    lines = lines[1:] or lines
    for separator in SEPARATORS:
        rows = [words_of(line, separator) for line in lines]
        words = [word for row in rows for word in row]
        same = sum(len(row) == len(rows[0]) > 1 for row in rows) / len(rows)
        for comma in (False,) if separator == "," else (False, True):
            numbers = sum(not word or is_number(word, comma) for word in words)
            score = same * (1e-3 + numbers / max(len(words), 1))
            if score > best + 1e-9:
                best, choice = score, (separator, comma)
    return choice


def _names_in_comment(comment: str, separator: str, width: int) -> list[str] | None:
    """The names in the line above the rows, as ``numpy.savetxt`` writes them, if it holds names."""
    text = comment.strip().lstrip("#%!/").strip()
    for one in dict.fromkeys((separator, " ", ",", ";")):
        words = [word.strip() for word in words_of(text, one)]
        if len(words) == width and all(words) and not any(map(is_number, words)):
            return words
    return None


def unique(names: Sequence[str]) -> list[str]:
    """Names of columns; one that is empty, or there before, is the number of its column."""
    return [
        name if name and name not in names[:place] else f"{place + 1}"
        for place, name in enumerate(names)
    ]
