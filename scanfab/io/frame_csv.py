"""Numbers of each frame from a CSV file: strains, or cells of a series that does not carry them."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from scanfab.base.errors import ReadError


class FrameFile:
    """
    A CSV file with the columns ``step`` or ``frame``, and numbers.

    Parameters
    ----------
    path : Path
        The file.
    names : sequence of str
        Columns that must be there.
    optional : sequence of str, optional
        Columns that are 0 if none of them is there, and otherwise must all be.
    positive : int, optional
        How many of the first columns must be above 0.

    Raises
    ------
    ReadError
        If a column is missing, a value is no number, or a frame occurs twice with other numbers.
    """

    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        optional: Sequence[str] = (),
        *,
        positive: int = 0,
    ) -> None:
        self.path = path
        self._positive = positive
        self.key = "step"
        """Whether rows go by step or by frame."""
        self._rows: dict[int, tuple[float, ...]] = {}
        try:
            with open(path, newline="", encoding="utf-8-sig") as stream:
                rows = csv.DictReader(stream, skipinitialspace=True)
                try:
                    self._read(rows, names, optional)
                except csv.Error as error:  # of a cell that is far too long
                    line = rows.line_num + 1
                    raise ReadError(f"{path}, line {line}: {error}, expected numbers") from None
        except UnicodeDecodeError:
            raise ReadError(f"{path}: expected a CSV file, found bytes that are no text") from None

    def _read(
        self, rows: csv.DictReader[str], names: Sequence[str], optional: Sequence[str]
    ) -> None:
        found = [name.strip() for name in rows.fieldnames or []]
        rows.fieldnames = found
        self.key = "step" if "step" in found else "frame"
        given = [*names, *(optional if set(optional) & set(found) else ())]
        if self.key not in found or not set(given) <= set(found):
            raise ReadError(
                f"{self.path}: expected the columns step or frame, and {', '.join(given)}; "
                f"found {found}"
            )
        missing = (0.0,) * (len(names) + len(optional) - len(given))
        for row in rows:
            number, values = self._numbers(rows.line_num, row, given)
            if self._rows.setdefault(number, values + missing) != values + missing:
                raise ReadError(
                    f"{self.path}, line {rows.line_num}: {self.key} {number} occurs twice, with "
                    f"other numbers"
                )

    def _numbers(
        self, line: int, row: dict[str, str], names: Sequence[str]
    ) -> tuple[int, tuple[float, ...]]:
        try:
            number = _whole(row[self.key])
            values = tuple(float(row[name]) for name in names)
            is_above = all(value > 0 for value in values[: self._positive])
            if is_above and all(map(math.isfinite, values)):
                return number, values
        except (OverflowError, TypeError, ValueError):
            pass
        above = f" (above 0: {', '.join(names[: self._positive])})" if self._positive else ""
        raise ReadError(
            f"{self.path}, line {line}: expected numbers as {self.key} and {', '.join(names)}"
            f"{above}, the first a whole one, "
            f"found {row[self.key]!r} and {', '.join(repr(row[name]) for name in names)}"
        )

    def at(self, frame: int, step: int | None) -> tuple[float, ...] | None:
        """The numbers of a frame; None if the file does not name it."""
        number = step if self.key == "step" else frame
        return None if number is None else self._rows.get(number)


def _whole(text: str) -> int:
    """A step or frame, also as 1e3; ValueError if it is none."""
    number = float(text)
    if not number.is_integer():
        raise ValueError
    return int(number)
