"""A column of a table: its name, the kind of its values, their unit and what they mean."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from typing import get_args, get_origin, get_type_hints

from scanfab.base.errors import ScanfabError

# With 17 significant digits every float reads back as the same number; users cannot ask for more.
# Manifests list the digits only if they differ from this.
DEFAULT_DIGITS = 17
# all lengths are in the unit of the dump; nothing is converted
LENGTH = "length"


@dataclass(frozen=True, slots=True)
class Column:
    """
    A column of a table, declared beside the code that computes it.

    The header and the order of CSV files, the schema of Parquet files, the rows of empty frames
    and docs/command-line.md all follow from such declarations.

    Parameters
    ----------
    name : str
        As scripts know it.
    kind : type
        ``int``, ``float`` or ``str``; ``list`` only in tables that are written as JSON. A missing
        value is None in any column.
    unit : str
        ``"length"`` and ``"time"`` are the units of the dump; empty for names, counts and
        dimensionless numbers.
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
    """Columns of floats by their names and meanings; dimensionless if no unit is named."""
    return tuple(Column(name, float, unit, meaning) for name, meaning in meanings.items())


class NoColumnError(ScanfabError, KeyError, AttributeError):
    """
    A row or table has no column of this name; the message suggests the most similar one.

    Its arguments are the name that was asked for and the names of all columns.
    """

    def __str__(self) -> str:
        # made only when the error is shown: ``row.get(name)`` raises many that nobody sees
        return no_column(*self.args)


def no_column(name: object, known: Iterable[str]) -> str:
    """
    The message for a name that no column has.

    Examples
    --------
    >>> from scanfab.base.column import no_column
    >>> no_column("alpha_v", ["frame", "alpha_vs"])
    "there is no column 'alpha_v': did you mean alpha_vs?"
    """
    names = list(known)
    near = get_close_matches(str(name), names, n=1)
    hint = f"did you mean {near[0]}?" if near else f"the columns are {', '.join(names)}"
    return f"there is no column {name!r}: {hint}"


@cache
def columns_of_fields(kind: type) -> tuple[Column, ...]:
    """
    The columns of a dataclass, one for each field, with the meaning and unit of its annotation.

    An example of a field is ``radius: Annotated[float, "of the smallest grain", LENGTH]``.

    Examples
    --------
    >>> from scanfab.base.column import columns_of_fields
    >>> from scanfab.pipeline.calibration import StepRow
    >>> columns_of_fields(StepRow)[0].meaning
    'the series as given'
    """
    found = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        meaning, *unit = hint.__metadata__
        # ``float`` of ``float | None``, ``list`` of ``list[str]`` and the like
        of_value = next((one for one in get_args(hint.__origin__)), hint.__origin__)
        held = hint.__origin__ if get_origin(hint.__origin__) is list else of_value
        found.append(Column(name, get_origin(held) or held, "".join(unit), meaning))
    return tuple(found)
