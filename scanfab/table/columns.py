"""The columns of the fabric table, in the order that scripts rely on; new ones come behind."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from functools import cache
from typing import Any

from scanfab.base.column import Column, columns_of_fields, no_column
from scanfab.fabric.registry import GROUPS, OWN_FABRICS, Fabric, load_fabrics
from scanfab.fabric.spectrum import PREDICTED_ALPHA
from scanfab.fabric.window import WINDOW_ALPHA
from scanfab.packing.columns import RV_COLUMN, SAMPLE_COLUMNS
from scanfab.scan.columns import EDGE_COLUMNS, SCAN_COLUMNS
from scanfab.table.row import Row

FRAME_COLUMNS = (
    Column("source", str, "", "the series as given: folder, file, or the files' common folder"),
    Column("frame", int, "", "index in the series, from 0"),
    Column("step", int, "", "of the dump"),
    Column("time", float, "time", "of the dump"),
    Column(
        "strain",
        float,
        "",
        "axial strain 1 - L/L0 along the loading axis, positive in compression",
    ),
    Column("variant", str, "", "a whole sample, b without rattlers, c RV, d RV without rattlers"),
)
SHEAR_STRAIN = Column(
    "shear_strain",
    float,
    "",
    "of a cell that repeats along all its vectors, since the first frame: √(2/3 e:e) of the "
    "logarithmic strain's deviator e; else empty",
)


def _own_columns() -> Iterator[Column]:
    yield from (*FRAME_COLUMNS, *SAMPLE_COLUMNS, *SCAN_COLUMNS)
    for name, fabric in OWN_FABRICS.items():
        if name == "halves":  # which are newer than the shear strain
            yield SHEAR_STRAIN
        yield from fabric.columns


OWN_COLUMNS = tuple(_own_columns())
"""Those of every fabric table."""

COLUMNS: tuple[str, ...] = tuple(one.name for one in OWN_COLUMNS)
"""Their names."""


MORE_COLUMNS = (
    RV_COLUMN,
    WINDOW_ALPHA,
    *EDGE_COLUMNS,
    PREDICTED_ALPHA,
    *(column for group in GROUPS.values() for column in group.columns),
)
"""Those of tables of which more is asked than the default."""


@cache
def installed_fabrics() -> dict[str, Fabric]:
    """The fabrics of other packages by name; none as a rule."""
    return load_fabrics([*COLUMNS, *(one.name for one in MORE_COLUMNS)])


def table_columns(more: Collection[str] = ()) -> tuple[Column, ...]:
    """
    The columns of the tables that are computed here: behind the own, those of other fabrics.

    ``more`` are the names of further own ones.
    """
    asked = (column for column in MORE_COLUMNS if column.name in more)
    others = (column for fabric in installed_fabrics().values() for column in fabric.columns)
    return (*OWN_COLUMNS, *asked, *others)


def columns_of(kind: type | Sequence[Column]) -> tuple[Column, ...]:
    """The columns of a kind of rows: the fabric table's, or the fields of a dataclass; or these."""
    if not isinstance(kind, type):
        return tuple(kind)
    return columns_of_fields(kind) if is_dataclass(kind) else table_columns()


def complete_row(values: Mapping[str, Any], more: Collection[str] = ()) -> Row:
    """
    A row that has all columns, in their order, and of further ones those that are named.

    Raises
    ------
    TypeError
        If a value is of no column, or a column has no value: the code that computes them has to
        be mended.

    Examples
    --------
    >>> from scanfab.table.columns import COLUMNS, complete_row
    >>> complete_row({**dict.fromkeys(COLUMNS), "frame": 3}).frame
    3
    """
    names = [one.name for one in table_columns(more)]
    for name in values:
        if name not in names:
            raise TypeError(no_column(name, names))
    missing = [name for name in names if name not in values]
    if missing:
        raise TypeError(f"a row needs a value for each column, None for none: {', '.join(missing)}")
    return Row(**{name: values[name] for name in names})
