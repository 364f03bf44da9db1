"""The columns of a map: a row for each frame, variant and block."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from scanfab.base.column import LENGTH, Column
from scanfab.fabric.contact import Contact
from scanfab.fabric.void import Void
from scanfab.packing.columns import SAMPLE_COLUMNS
from scanfab.scan.columns import EDGE_COLUMNS, SCAN_COLUMNS
from scanfab.table.columns import FRAME_COLUMNS
from scanfab.table.row import Row

BLOCK_COLUMNS = (
    Column("block", int, "", "of a map: its number from 0; those along x count fastest"),
    *(Column(name, float, LENGTH, f"of a map: {name} of the block's middle") for name in "xyz"),
)
SHELL_COLUMNS = (
    Column("r_inner", float, LENGTH, "of a map: where the shell begins, from the centre"),
    Column("r_outer", float, LENGTH, "of a map: where the shell ends"),
)
ERROR_COLUMNS = (
    Column(
        "coordination_se",
        float,
        "",
        "of a map: the sample's own scatter of coordination, by a jackknife over eight parts of "
        "the block",
    ),
    Column("solid_fraction_se", float, "", "of a map: likewise of solid_fraction"),
    Column("mean_length_se", float, LENGTH, "of a map: likewise of mean_length"),
    Column("alpha_vs_axial_sample_se", float, "", "of a map: likewise of alpha_vs_axial"),
    Column("alpha_c_axial_sample_se", float, "", "of a map: likewise of alpha_c_axial"),
)
AT_SURFACE = Column(
    "at_surface",
    int,
    "",
    "of a map: 1 for blocks that lose void segments at the surface of the sample or the RV, so "
    "that their mean length is low; else 0",
)
VARIANT = FRAME_COLUMNS[-1]


def map_columns(more: Collection[str] = (), *, shells: bool = False) -> tuple[Column, ...]:
    """Those of a map; ``more`` are the names of what its options ask for."""
    return (
        *FRAME_COLUMNS[:-1],
        *BLOCK_COLUMNS,
        VARIANT,
        *SAMPLE_COLUMNS,
        *(one for one in SCAN_COLUMNS if one.name != "lines"),
        *Void.columns,
        *Contact.columns,
        *ERROR_COLUMNS,
        *(SHELL_COLUMNS if shells else ()),
        AT_SURFACE,
        *(one for one in EDGE_COLUMNS if one.name in more),
    )


def map_row(columns: Collection[Column], values: Mapping[str, Any]) -> Row:
    """A row with a value for each column, None where there is none."""
    return Row(**{one.name: values.get(one.name) for one in columns})
