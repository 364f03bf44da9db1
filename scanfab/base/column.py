"""Columns of tables: each has a name, a kind of values, a unit and a meaning."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from scanfab.base.errors import ScanfabError
from scanfab.base.spelling import meant

# 17 significant digits are enough for every float to read back as the same number, so they are also
# the most that users can ask for. Manifests list the digits only if they differ from this.
DEFAULT_DIGITS = 17
# the unit of all lengths: that of the dump, as nothing is converted
LENGTH = "length"


@dataclass(frozen=True, slots=True)
class Column:
    """
    A column of a table; it is declared beside the code that computes its values.

    The declarations decide the header and order of CSV files, the schema of Parquet files, the rows
    of empty frames and the tables in docs/columns.md.

    Parameters
    ----------
    name : str
        Name in files and scripts.
    kind : type
        ``int``, ``float`` or ``str``; ``list`` for columns that CSV and TSV cannot hold. In any
        column, None stands for a missing value.
    unit : str
        ``"length"`` and ``"time"`` stand for the units of the dump. Names, counts and dimensionless
        numbers have an empty unit.
    meaning : str
        What the column holds, for the documentation.

    Examples
    --------
    >>> from scanfab import Column
    >>> Column("void_ratio", float, "", "volume of the voids over volume of the solids").kind
    <class 'float'>
    """

    name: str
    kind: type
    unit: str
    meaning: str


def numbers(meanings: Mapping[str, str], unit: str = "") -> tuple[Column, ...]:
    """Columns of floats from their names and meanings; without a unit they are dimensionless."""
    return tuple(Column(name, float, unit, meaning) for name, meaning in meanings.items())


class NoColumnError(ScanfabError, KeyError, AttributeError):
    """
    A row or table has no column of this name; the message suggests the most similar name.

    The arguments are the wrong name and the names of all columns.
    """

    def __str__(self) -> str:
        # The message is made only when it is shown, because ``row.get(name)`` drops many errors.
        return no_column(*self.args)


def no_column(name: object, known: Iterable[str], what: str = "column") -> str:
    """
    The message for a wrong name of a column, or of something else.

    Examples
    --------
    >>> from scanfab.base.column import no_column
    >>> no_column("alpha_v", ["frame", "alpha_vs"])
    "there is no column 'alpha_v': did you mean 'alpha_vs'?"
    """
    return f"there is no {what} {name!r}: {meant(name, known, what)}"
