"""Columns of fabric tables and of maps, in an order that scripts rely on."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from functools import cache
from typing import Any

from scanfab.base.column import LENGTH, Column
from scanfab.fabric.predicted import PREDICTED_ALPHA, WINDOW_ALPHA
from scanfab.fabric.registry import GROUPS, OWN_FABRICS, Fabric, load_fabrics
from scanfab.fabric.usual import CONTACT_COLUMNS, VOID_COLUMNS
from scanfab.table.row import Row

FRAME_COLUMNS = (
    Column("source", str, "", "the series as given: folder, file, or the files' common folder"),
    Column("frame", int, "", "index of the frame in the series, from 0"),
    Column("step", int, "", "time step of the dump"),
    Column("time", float, "time", "simulation time of the dump"),
    Column("strain", float, "", "strain 1 - L/L0 along the loading axis, positive in compression"),
    Column("variant", str, "", "a: whole, b: without rattlers, c: RV, d: RV without rattlers"),
)
SAMPLE_COLUMNS = (
    Column("grains", int, "", "solid in this variant, centre in the window; a clump is one"),
    Column("rattlers", int, "", "grains with too few neighbours, centre in the window"),
    Column("contacts", int, "", "contacts between grains that enter gc_*; of clumps, each point"),
    Column("contacts_from", str, "", "file or geometric"),
    Column(
        "coordination",
        float,
        "",
        "mean number of contacts of the grains counted in grains, boundary's included; of clumps, "
        "neighbours",
    ),
)
RV_COLUMN = Column(
    "rv", float, "", "size of the RV as a fraction of the sample's, where several are asked for"
)
SCAN_COLUMNS = (
    Column("solid_fraction", float, "", "of the variant's solids in the RV or cell; else empty"),
    Column("directions", int, "", "axes of the direction rule, in each replicate"),
    Column("replicates", int, "", "number of replicates"),
    Column("lines", int, "", "scan lines that meet the window (for the whole: any solid)"),
    Column("segments", int, "", "void segments kept"),
    Column("spacing", float, LENGTH, "distance of neighbouring lines, all replicates together"),
    Column("cutoff", float, LENGTH, "shortest void segment kept"),
)

EDGE_COLUMNS = (
    Column("edge", str, "", "rule at the window's surface: clip, start or ends; empty without one"),
    Column("left_out", float, "", "share of segments that start leaves out: they leave the sample"),
)
SHEAR = (
    "√(2/3 e:e) of the deviator e of the logarithmic strain since the reference frame; empty "
    "unless the cell is periodic along all its vectors"
)
SHEAR_STRAIN = Column("shear_strain", float, "", SHEAR)
# parts of the jackknife, which only errors are made of: the last columns of a table
JACKKNIFE = re.compile(r"_(without|half)_\d$")


def _ordered(columns: Iterable[Column]) -> tuple[Column, ...]:
    return tuple(sorted(columns, key=lambda column: JACKKNIFE.search(column.name) is not None))


IN_FABRICS = [column for fabric in OWN_FABRICS.values() for column in fabric.columns]
OWN_COLUMNS = _ordered([*FRAME_COLUMNS, *SAMPLE_COLUMNS, *SCAN_COLUMNS, *IN_FABRICS, SHEAR_STRAIN])
"""Columns of every fabric table."""

COLUMNS: tuple[str, ...] = tuple(column.name for column in OWN_COLUMNS)
"""Names of the columns of every fabric table."""

IN_GROUPS = [column for group in GROUPS.values() for column in group.columns]
MORE_COLUMNS = (RV_COLUMN, WINDOW_ALPHA, *EDGE_COLUMNS, PREDICTED_ALPHA, *IN_GROUPS)
"""Columns that a table has only if options ask for them."""

KINDS = {column.name: column.kind for column in (*OWN_COLUMNS, *MORE_COLUMNS)}
"""The kind of each column of fabric tables."""

SHELL_COLUMNS = (
    Column("r_inner", float, LENGTH, "of a map: inner radius of the shell"),
    Column("r_outer", float, LENGTH, "of a map: outer radius of the shell"),
)
SCATTER = (
    "standard error of coordination due to the sample, by a jackknife over eight parts of the block"
)
MAP_COLUMNS = (
    *FRAME_COLUMNS[:-1],
    Column("block", int, "", "of a map: number of the block, from 0; it grows fastest along x"),
    *(Column(name, float, LENGTH, f"of a map: {name} of the block's centre") for name in "xyz"),
    FRAME_COLUMNS[-1],
    *SAMPLE_COLUMNS,
    *(column for column in SCAN_COLUMNS if column.name != "lines"),
    *VOID_COLUMNS,
    *CONTACT_COLUMNS,
    Column("coordination_se", float, "", f"of a map: {SCATTER}"),
    Column("solid_fraction_se", float, "", "of a map: the same of solid_fraction"),
    Column("mean_length_se", float, LENGTH, "of a map: the same of mean_length"),
    Column("alpha_vs_axial_sample_se", float, "", "of a map: the same of alpha_vs_axial"),
    Column("alpha_c_axial_sample_se", float, "", "of a map: the same of alpha_c_axial"),
)
LOSES = "1 for blocks that lose void segments at the surface of the sample or of the RV, else 0"
AT_SURFACE = Column("at_surface", int, "", f"of a map: {LOSES}")


@cache
def installed_fabrics() -> dict[str, Fabric]:
    """Fabrics of other installed packages, by name; usually there are none."""
    return load_fabrics([*COLUMNS, *(column.name for column in MORE_COLUMNS)])


def table_columns(more: Collection[str] = ()) -> tuple[Column, ...]:
    """
    The columns of a computed table.

    The columns of every table come first, then the columns of ``MORE_COLUMNS`` whose names are in
    ``more``, then the columns of other packages' fabrics, and last the parts of the jackknife.
    """
    chosen = (column for column in MORE_COLUMNS if column.name in more)
    others = (column for fabric in installed_fabrics().values() for column in fabric.columns)
    return _ordered([*OWN_COLUMNS, *chosen, *others])


def map_columns(more: Collection[str] = (), *, shells: bool = False) -> tuple[Column, ...]:
    """The columns of a map; ``more`` names the columns that its edge rule adds."""
    chosen = (column for column in EDGE_COLUMNS if column.name in more)
    return (*MAP_COLUMNS, *(SHELL_COLUMNS if shells else ()), AT_SURFACE, *chosen)


def row_of(columns: Iterable[Column], values: Mapping[str, Any]) -> Row:
    """A row with a value for each column; a missing value is None."""
    return Row(**{column.name: values.get(column.name) for column in columns})
