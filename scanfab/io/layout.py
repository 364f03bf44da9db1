"""Tables of text from any program: find the layout from the first rows, and read the columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.files import Stamp, first_bytes, growing, stamp_of
from scanfab.io.reader import Snapshot
from scanfab.io.text import CutError, Layout, is_number, read_rows, text_of, words_of

# how many bytes and rows at the top of a file are examined
HEAD, SAMPLE = 1 << 18, 20
COMMENTS = ("#", "%", "//", "!")
CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
# a word with a comma, and a word whose commas may separate thousands: 1,234 may, 0,234 may not
WITH_COMMA = re.compile(rb"[-+0-9.eE]*,[-+0-9.,eE]*")
THOUSANDS = re.compile(rb"[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+")
# separators (a blank means any run of blanks and tabs), and whether the decimal sign is a comma
WAYS = [("\t", False), ("\t", True), (";", False), (";", True), (",", False), (" ", False)]
WAYS += [(" ", True)]


class TextTable(NamedTuple):
    """The layout of a table, found from its first rows."""

    layout: Layout
    """How rows are written. A column without a name of its own gets its number as name."""
    own: Sequence[str]
    """The names of the columns as in the file, or their numbers."""
    is_named: bool
    """Whether the table has names of columns."""
    start: int = 0
    """Offset of the first row in the file, in bytes."""
    rows: Sequence[Sequence[str]] = ()
    """The words of the first rows."""


def text_table(path: Path, skip: int) -> TextTable:
    """
    Find out how a table of text is written.

    Parameters
    ----------
    path : Path
        A file, which may be compressed.
    skip : int
        The number of lines before the table.

    Raises
    ------
    ReadError
        If the file is not a table: it is not text, or its first rows differ in width.
    """
    head = _first_lines(path)
    lines = head.decode("utf-8-sig", "replace").split("\n")
    # skip comments and empty lines above the table, and empty lines among the examined rows
    numbers = [k for k in range(skip, len(lines)) if lines[k].strip()]
    while numbers and lines[numbers[0]].lstrip().startswith(COMMENTS):
        del numbers[0]
    numbers = numbers[: SAMPLE + 1]
    if not numbers:
        skipped = f" (`skip={skip}`)" if skip else ""
        raise ReadError(f"{path}: expected a table, found no row{skipped}")
    texts = [lines[k].rstrip("\r") for k in numbers]
    separator, comma = max(WAYS, key=lambda way: _score(texts[1:] or texts, *way))
    rows = [words_of(text, separator) for text in texts]
    width, first = len(rows[0]), numbers[0]
    names: list[str] | None = None
    # a line of names has no number: "P 0.3 1.2 4.1" is a row
    if not any(is_number(word, comma) for word in rows[0]):
        names = [word.strip() for word in words_of(texts[0].strip().rstrip(separator), separator)]
        first, rows = numbers[1] if len(numbers) > 1 else first + 1, rows[1:]
        if not rows and not head.endswith(b"\n"):
            raise CutError(f"{path}: the file ends within its line of names: it is incomplete")
        width = len(rows[0]) if rows else len(names)
    elif first > skip:
        # the last comment above the rows may hold the names, as numpy.savetxt writes them
        words = re.split(r"[\s,;]+", lines[first - 1].strip().lstrip("#%!/").strip())
        names = words if len(words) == width and not any(map(is_number, words)) else None
    # rows below a line of names are checked later, when the table is read
    for number, row in zip(numbers if names is None else (), rows, strict=False):
        if len(row) != width:
            wrong = f"expected {width} columns as above, found {len(row)}"
            raise ReadError(f"{path}, line {number + 1}: {wrong}")
    if width > 1 and len(names or ()) != width and rows and not any(row[-1] for row in rows):
        width -= 1  # each row ends with a separator
    own = names or [f"{place + 1}" for place in range(width)]
    # a column whose name is empty or occurs before gets its number as key
    places = {name: place for place, name in reversed([(-1, ""), *enumerate(own)])}
    keys = [name if places[name] == k else f"{k + 1}" for k, name in enumerate(own)]
    layout = Layout(tuple(keys), separator, first + 1, comma=comma)
    start = sum(len(line) + 1 for line in head.split(b"\n")[:first])
    return TextTable(layout, own, names is not None, start, [row[:width] for row in rows])


def read_text(
    path: Path, table: TextTable, numbers: Sequence[str], whole: Sequence[str]
) -> Columns:
    """
    Read all columns of a table of text.

    Parameters
    ----------
    path : Path
        The file.
    table : TextTable
        The layout of the table.
    numbers : sequence of str
        Columns that must have a number in each row; other columns may have gaps or words.
    whole : sequence of str
        Those of ``numbers`` that hold whole numbers.

    Raises
    ------
    ReadError
        If a row does not fit the columns, or commas may separate thousands.
    """
    names = table.layout.names
    if table.rows and len(names) != len(table.rows[0]):
        problem = f"expected {len(names)} columns, one for each name, found {len(table.rows[0])}"
        advice = "skip the line of names by `skip`, and name the columns by `columns`"
        raise ReadError(f"{path}, line {table.layout.line}: {problem}: {advice}")
    rows = text_of(Snapshot(path, start=table.start))
    first = WITH_COMMA.search(rows) if table.layout.comma else None
    if first and all(THOUSANDS.fullmatch(match[0]) for match in WITH_COMMA.finditer(rows)):
        doubt = "may be a decimal sign or separate thousands: write numbers with a point"
        raise ReadError(f"{path}: the comma in {first[0].decode()!r} {doubt}")
    optional = [name for name in names if name not in numbers]
    return read_rows(Snapshot(path), rows, table.layout._replace(whole=whole, optional=optional))


def _first_lines(path: Path) -> bytes:
    """The first lines of a file, none cut; ReadError if they are not text."""
    head = first_bytes(path, HEAD)
    if found := CONTROL.search(head):
        line = head.count(b"\n", 0, found.start()) + 1
        raise ReadError(f"{path}, line {line}: expected text, found the byte {found[0][0]}")
    if b"\n" not in head and (len(head) == HEAD or b"\r" in head.rstrip()):
        raise ReadError(f"{path}: expected rows of a table, found text without a line end")
    return head if len(head) < HEAD else head[: head.rfind(b"\n") + 1]


def _score(lines: Sequence[str], separator: str, comma: bool) -> float:
    """How well lines fit a separator: do rows have as many words each, and are these numbers?"""
    rows = [words_of(line, separator) for line in lines]
    words = [word for row in rows for word in row]
    alike = sum(len(row) == len(rows[0]) > 1 for row in rows) / len(rows)
    numbers = sum(not word or is_number(word, comma) for word in words) / max(len(words), 1)
    # if no separator splits the rows, take blanks: the table has one column
    return alike * (1e-3 + numbers) if alike or separator == " " else -1.0


class FrameFile:
    """
    A table with numbers for each frame: strains, or the cells of a series whose dumps have none.

    Parameters
    ----------
    path : Path
        A table of text with a column ``step`` or ``frame``.
    names : sequence of str
        Columns that the table must have.
    optional : sequence of str, optional
        Columns that the table has all or none of; without them their values are 0.
    positive : int, optional
        The first so many columns of ``names`` must be above 0.

    Raises
    ------
    ReadError
        If a column is missing, a value is not finite, or a frame occurs twice with other numbers.
    """

    def __init__(
        self, path: Path, names: Sequence[str], optional: Sequence[str] = (), *, positive: int = 0
    ) -> None:
        self.path, self._asked = path, (names, optional, positive)
        self._stamp: Stamp | None = None
        self._read()

    def _read(self) -> None:
        path, (names, optional, positive) = self.path, self._asked
        table = text_table(path, 0)
        present = table.layout.names
        self.key = "step" if "step" in present else "frame"
        """``step`` or ``frame``: the column that identifies the frame of a row."""
        wanted = [*names, *(optional if set(optional) & set(present) else ())]
        if not {self.key, *wanted} <= set(present):
            expected = f"expected the columns step or frame, and {', '.join(wanted)}"
            raise ReadError(f"{path}: {expected}, found {', '.join(present)}")
        columns = read_text(path, table, [self.key, *wanted], [self.key])
        blank = np.zeros(len(columns[self.key]))
        rows = np.column_stack([columns.get(name, blank) for name in (*names, *optional)])
        known: dict[int, tuple[float, ...]] = {}
        pairs = zip(columns[self.key].tolist(), map(tuple, rows.tolist()), strict=True)
        for line, (number, row) in enumerate(pairs, table.layout.line):
            is_sound = np.isfinite([number, *row]).all() and number == round(number)
            if not is_sound or min(row[:positive], default=1.0) <= 0.0:
                above = f" (above 0: {', '.join(names[:positive])})" if positive else ""
                expected = f"expected a whole {self.key} and finite numbers{above}"
                raise ReadError(f"{path}, line {line}: {expected}, found {number}, {row}")
            if known.setdefault(int(number), row) != row:
                raise ReadError(f"{path}, line {line}: {self.key} {number} occurs twice")
        # at once, as other threads read it
        self._rows = known

    def at(self, frame: int, step: int | None) -> tuple[float, ...] | None:
        """The numbers of a frame; None if the file has no row for it."""
        number = step if self.key == "step" else frame
        if number is not None and number not in self._rows:
            # a running simulation may have added lines, of which the last may be incomplete
            with suppress(ReadError, OSError), growing():
                # taken before the file is read: lines added meanwhile change the next stamp
                if (stamp := stamp_of(self.path)) != self._stamp:
                    self._read()
                    self._stamp = stamp
        return None if number is None else self._rows.get(number)
