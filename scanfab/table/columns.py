"""The columns of the fabric table and of maps, in the order that scripts rely on."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import cache
from typing import Any

from scanfab.base.column import LENGTH, Column
from scanfab.fabric.predicted import PREDICTED_ALPHA, WINDOW_ALPHA
from scanfab.fabric.registry import GROUPS, OWN_FABRICS, Fabric, load_fabrics
from scanfab.fabric.usual import Contact, Void
from scanfab.packing.columns import RV_COLUMN, SAMPLE_COLUMNS
from scanfab.scan.edges import EDGE_COLUMNS, SCAN_COLUMNS
from scanfab.table.row import Row

FRAME_COLUMNS = (
    Column("source", str, "", "the series as given: folder, file, or the files' common folder"),
    Column("frame", int, "", "index in the series, from 0"),
    Column("step", int, "", "of the dump"),
    Column("time", float, "time", "of the dump"),
    Column("strain", float, "", "strain 1 - L/L0 along the loading axis, positive in compression"),
    Column("variant", str, "", "a whole sample, b without rattlers, c RV, d RV without rattlers"),
)
SHEAR = (
    "√(2/3 e:e) of the logarithmic strain's deviator e since the first frame, of a cell that "
    "repeats along all its vectors; else empty"
)
SHEAR_STRAIN = Column("shear_strain", float, "", SHEAR)
# the columns of halves are newer than the shear strain and stand behind it
OF_FABRICS = {name: fabric.columns for name, fabric in OWN_FABRICS.items()}
OF_FABRICS["halves"] = (SHEAR_STRAIN, *OF_FABRICS["halves"])

OWN_COLUMNS: tuple[Column, ...] = (
    *FRAME_COLUMNS,
    *SAMPLE_COLUMNS,
    *SCAN_COLUMNS,
    *(column for columns in OF_FABRICS.values() for column in columns),
)
"""The columns of every fabric table."""

COLUMNS: tuple[str, ...] = tuple(one.name for one in OWN_COLUMNS)
"""Their names."""

MORE_COLUMNS = (
    RV_COLUMN,
    WINDOW_ALPHA,
    *EDGE_COLUMNS,
    PREDICTED_ALPHA,
    *(column for group in GROUPS.values() for column in group.columns),
)
"""Columns that a table has only if its options ask for them."""

SHELL_COLUMNS = (
    Column("r_inner", float, LENGTH, "of a map: where the shell begins, from the centre"),
    Column("r_outer", float, LENGTH, "of a map: where the shell ends"),
)
SCATTER = "the sample's own scatter of coordination, by a jackknife over eight parts of the block"
MAP_COLUMNS = (
    *FRAME_COLUMNS[:-1],
    Column("block", int, "", "of a map: its number from 0; those along x count fastest"),
    *(Column(name, float, LENGTH, f"of a map: {name} of the block's middle") for name in "xyz"),
    FRAME_COLUMNS[-1],
    *SAMPLE_COLUMNS,
    *(one for one in SCAN_COLUMNS if one.name != "lines"),
    *Void.columns,
    *Contact.columns,
    Column("coordination_se", float, "", f"of a map: {SCATTER}"),
    Column("solid_fraction_se", float, "", "of a map: likewise of solid_fraction"),
    Column("mean_length_se", float, LENGTH, "of a map: likewise of mean_length"),
    Column("alpha_vs_axial_sample_se", float, "", "of a map: likewise of alpha_vs_axial"),
    Column("alpha_c_axial_sample_se", float, "", "of a map: likewise of alpha_c_axial"),
)
LOSES = "1 for blocks that lose void segments at the surface of the sample or the RV; else 0"
AT_SURFACE = Column("at_surface", int, "", f"of a map: {LOSES}")


@cache
def installed_fabrics() -> dict[str, Fabric]:
    """The fabrics of other packages by name; usually there are none."""
    return load_fabrics([*COLUMNS, *(one.name for one in MORE_COLUMNS)])


def table_columns(more: Collection[str] = ()) -> tuple[Column, ...]:
    """
    The columns of computed tables: those of the package, then those of other packages' fabrics.

    ``more`` are names from ``MORE_COLUMNS``.
    """
    asked = (column for column in MORE_COLUMNS if column.name in more)
    others = (column for fabric in installed_fabrics().values() for column in fabric.columns)
    return (*OWN_COLUMNS, *asked, *others)


def map_columns(more: Collection[str] = (), *, shells: bool = False) -> tuple[Column, ...]:
    """The columns of a map; ``more`` are names of the columns that its edge rule adds."""
    asked = (one for one in EDGE_COLUMNS if one.name in more)
    return (*MAP_COLUMNS, *(SHELL_COLUMNS if shells else ()), AT_SURFACE, *asked)


def row_of(columns: Iterable[Column], values: Mapping[str, Any]) -> Row:
    """A row with a value for each column, None where there is none."""
    return Row(**{one.name: values.get(one.name) for one in columns})


def complete_row(values: Mapping[str, Any], more: Collection[str] = ()) -> Row:
    """
    A row with all columns of :func:`table_columns`, in their order.

    Raises
    ------
    TypeError
        If a value belongs to no column, or a column has no value: an error of the program.

    Examples
    --------
    >>> from scanfab.table.columns import COLUMNS, complete_row
    >>> complete_row({**dict.fromkeys(COLUMNS), "frame": 3}).frame
    3
    """
    names = [one.name for one in table_columns(more)]
    if wrong := sorted({*names} ^ {*values}):
        raise TypeError(f"a row has a value for each column, None for none: {', '.join(wrong)}")
    return Row(**{name: values[name] for name in names})
